# SPDX-License-Identifier: Apache-2.0
"""A .blend in this process's bpy, given to Headwater and to Cycles as the same work, and a clock of its renders.

The engine's status texts, which Blender hands to `render_stats` handlers, say when synchronizing ends: both engines
show "Sample 0/N" when they are ready to trace.
"""

import resource
import sys
import time

from headwater.blend_overrides import apply
from headwater.errors import UserError
from headwater.render_request import Request


class Clock:
    """Marks of each frame that is rendered, in seconds since it began: `frames`, in order.

    A frame begins where the render begins or the frame before it ended. There is no handler of `render_pre` or of frame
    changes: it might edit the scene, so our sync would compare everything for its sake: the clock would time itself.
    Make it after the file was opened: opening forgets handlers.
    """

    def __init__(self, bpy):
        self.frames = []
        handlers = bpy.app.handlers
        handlers.render_init.append(lambda *_: self._begin())
        handlers.render_post.append(lambda *_: self._end())
        handlers.render_write.append(lambda *_: self._begin())  # animations: the frame's file is written
        handlers.render_stats.append(lambda text, *_: self._status(str(text)))

    def _begin(self):
        self._start, self._cpu, self._marks = time.perf_counter(), cpu_seconds(), {}

    def _status(self, text: str):
        now = time.perf_counter() - self._start
        if "Loading the core" in text or "Saving:" in text:  # ours: device and tracer, once a process; Blender's file
            return
        self._marks.setdefault("first", now)
        if "Building" in text:
            self._marks.setdefault("building", now)
        if "Sample 0/" in text or "Sample 1/" in text:
            self._marks.setdefault("sample", now)

    def _end(self):
        self.frames.append(
            {
                "seconds": time.perf_counter() - self._start,
                "cpu_seconds": cpu_seconds() - self._cpu,
                "marks": self._marks,
                "ended_at": time.time(),
            }
        )


def cpu_seconds() -> float:
    """CPU time of all threads of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


class MeasuredBlend:
    """An opened .blend, its scene and, for Headwater, what the add-on says of each picture (`facts`).

    job: file, engine ("headwater" or "cycles"), size, bounces (the core's setting -> limit), threads, device, tracer,
    persistent, passes (default: Combined). Cycles has its light tree; both are without denoising, adaptive sampling and
    clamping.
    """

    def __init__(self, job: dict):
        import bpy

        import headwater.blender

        self.bpy, self.engine = bpy, job["engine"]
        self.facts = []
        self.addon = None
        if self.engine == "headwater":
            sys.argv = ["headwater", "--", f"--headwater-tracer={job['tracer']}"]
            if job["device"]:
                sys.argv.append(f"--headwater-device={job['device']}")
            self.addon = headwater.blender.register()
            final = sys.modules[f"{self.addon.__name__}.final"]
            final.observers.append(lambda event, found: self.facts.append(found) if event == "frame" else None)
        try:
            bpy.ops.wm.open_mainfile(filepath=job["file"], load_ui=False, use_scripts=False)
        except RuntimeError as error:
            raise UserError(f"can't be read: {str(error).strip().removeprefix('Error: ')}") from error
        self.scene = bpy.context.scene
        self.apply(job)
        cycles = getattr(self.scene, "cycles", None)
        if cycles is not None:
            cycles.use_light_tree = True
            cycles.use_denoising = cycles.use_adaptive_sampling = False
            cycles.use_auto_tile = False
        render = self.scene.render
        render.use_sequencer = render.use_compositing = False
        render.use_persistent_data = job["persistent"]
        self.clock = Clock(bpy)

    def apply(self, job: dict, **values) -> None:
        """Settings of the job and `values` (of a Request) into the scene."""
        request = Request.blank(
            job["file"],
            engine=self.engine,
            size=tuple(job["size"]),
            bounces=job["bounces"],
            threads=job["threads"],
            no_clamp=True,
            passes=job.get("passes", ["Combined"]),
            **values,
        )
        persistent = self.scene.render.use_persistent_data
        apply(self.scene, request)
        self.scene.render.use_persistent_data = persistent

    def set_samples(self, samples: int) -> None:
        """Samples a pixel of the next render."""
        for name in ("headwater", "cycles"):
            group = getattr(self.scene, name, None)
            if group is not None:
                group.samples = samples

    def render(self, **options) -> None:
        """Renders as F12 does. `options`: of bpy.ops.render.render. UserError when our engine failed."""
        self.bpy.ops.render.render(**options)
        self.check()

    def check(self) -> None:
        """Raises UserError with what our engine said of its last render, if that failed."""
        if self.addon is not None and self.addon.engine.last_error:
            raise UserError(self.addon.engine.last_error)

    def pairs(self) -> list:
        """(marks of the clock, facts of the add-on or None) of every render so far."""
        facts = self.facts if self.addon is not None else [None] * len(self.clock.frames)
        if len(facts) != len(self.clock.frames):
            raise UserError(f"{len(self.clock.frames)} pictures but {len(facts)} reports")
        return list(zip(self.clock.frames, facts, strict=True))


def sync_build(engine: str, frame: dict, facts: dict | None) -> float:
    """Seconds from the engine's first look at the scene until it can trace.

    Cycles: between status texts. Ours: between texts up to the build, then the core's own clock, because texts are
    shown at intervals while the core works.
    """
    marks = frame["marks"]
    if engine == "cycles":
        return marks["sample"] - marks["first"]
    parts = ("commit_seconds", "upload_seconds", "build_seconds", "lights_seconds")
    return marks["building"] - marks["first"] + sum(facts["sync"][part] for part in parts)
