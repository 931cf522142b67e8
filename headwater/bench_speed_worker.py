# SPDX-License-Identifier: Apache-2.0
"""One process of `headwater bench-speed`: renders a .blend several times by one engine and writes what each cost.

    python -m headwater.bench_speed_worker JOB.json RESULT.json

The engine's status texts, which Blender hands to `render_stats` handlers, say when synchronizing ends: both engines
show "Sample 0/N" when they are ready to trace.
"""

import json
import os
import resource
import sys
import tempfile
import time

from headwater.blend_overrides import apply
from headwater.errors import UserError
from headwater.render_request import Request
from headwater.render_stats import peak_rss_bytes


class _Clock:
    """Marks of the frame that is being rendered, in seconds since it began.

    A frame begins where the render begins or the frame before it ended. There is no handler of `render_pre` or of frame
    changes: it might edit the scene, so our sync would compare everything for its sake: the clock would time itself.
    """

    def __init__(self, bpy):
        self.frames = []
        handlers = bpy.app.handlers
        handlers.render_init.append(lambda *_: self._begin())
        handlers.render_post.append(lambda *_: self._end())
        handlers.render_write.append(lambda *_: self._begin())  # animations: the frame's file is written
        handlers.render_stats.append(lambda text, *_: self._status(str(text)))

    def _begin(self):
        self._start, self._cpu, self._marks = time.perf_counter(), _cpu_seconds(), {}

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
                "cpu_seconds": _cpu_seconds() - self._cpu,
                "marks": self._marks,
                "ended_at": time.time(),
            }
        )


def _cpu_seconds() -> float:
    """CPU time of all threads of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _prepare(job, bpy):
    """Opens the file and gives both engines the same work. Returns the scene and the list our engine's facts go to."""
    import headwater.blender

    facts = []
    addon = None
    if job["engine"] == "headwater":
        sys.argv = ["headwater", "--", f"--headwater-tracer={job['tracer']}"]
        if job["device"]:
            sys.argv.append(f"--headwater-device={job['device']}")
        addon = headwater.blender.register()
        final = sys.modules[f"{addon.__name__}.final"]
        final.observers.append(lambda event, found: facts.append(found) if event == "frame" else None)
    bpy.ops.wm.open_mainfile(filepath=job["file"], load_ui=False, use_scripts=False)
    scene = bpy.context.scene
    request = Request.blank(
        job["file"],
        engine=job["engine"],
        size=tuple(job["size"]),
        bounces=job["bounces"],
        threads=job["threads"],
        no_clamp=True,
        passes=["Combined"],
    )
    apply(scene, request)
    cycles = getattr(scene, "cycles", None)
    if cycles is not None:
        cycles.use_light_tree = True
        cycles.use_denoising = cycles.use_adaptive_sampling = False
        cycles.use_auto_tile = False
    scene.render.use_sequencer = scene.render.use_compositing = False
    scene.render.use_persistent_data = job["persistent"]
    return scene, facts, addon


def _set_samples(scene, samples: int) -> None:
    for name in ("headwater", "cycles"):
        group = getattr(scene, name, None)
        if group is not None:
            group.samples = samples


def _render(bpy, addon) -> None:
    bpy.ops.render.render()
    if addon is not None and addon.engine.last_error:
        raise UserError(addon.engine.last_error)


def _moved_object(scene, name):
    """The object named, else the last mesh of the scene that is rendered."""
    found = scene.objects.get(name) if name else None
    if name and found is None:
        raise UserError(f"no object '{name}' in the scene")
    found = found or next((o for o in reversed(scene.objects) if o.type == "MESH" and not o.hide_render), None)
    if found is None:
        raise UserError("no mesh object to move")
    return found


def _stills(job, bpy, scene, addon) -> None:
    """The first picture, then rounds of a render with few samples and one with many."""
    few, many = job["samples"]
    for samples in [few] + [few, many] * job["rounds"]:
        _set_samples(scene, samples)
        _render(bpy, addon)


def _keyframes(job, bpy, scene, addon) -> None:
    """An animation of which one object's place is keyed."""
    moved = _moved_object(scene, job["move"])
    scene.frame_set(scene.frame_start)
    for number in range(job["frames"]):
        moved.location.x += 0.05 * number
        moved.keyframe_insert("location", frame=scene.frame_start + number)
    scene.frame_end = scene.frame_start + job["frames"] - 1
    _set_samples(scene, job["samples"][0])
    with tempfile.TemporaryDirectory(prefix="headwater-bench-") as folder:
        scene.render.filepath = os.path.join(folder, "frame####")
        bpy.ops.render.render(animation=True)
    if addon is not None and addon.engine.last_error:
        raise UserError(addon.engine.last_error)


def _script(job, bpy, scene, addon) -> None:
    """Stills of the same frame between which a script moves one object."""
    moved = _moved_object(scene, job["move"])
    _set_samples(scene, job["samples"][0])
    for number in range(job["frames"]):
        moved.location.x += 0.05 * (number > 0)
        _render(bpy, addon)


def _sync_build(engine: str, frame: dict, facts: dict | None) -> float:
    """Seconds from the engine's first look at the scene until it can trace.

    Cycles: between status texts. Ours: between texts up to the build, then the core's own clock, because texts are
    shown at intervals while the core works.
    """
    marks = frame["marks"]
    if engine == "cycles":
        return marks["sample"] - marks["first"]
    parts = ("commit_seconds", "upload_seconds", "build_seconds", "lights_seconds")
    return marks["building"] - marks["first"] + sum(facts["sync"][part] for part in parts)


def _record(job, frame, facts) -> dict:
    record = {
        "samples": 0,
        "seconds": frame["seconds"],
        "cpu_seconds": frame["cpu_seconds"],
        "sync_build_seconds": _sync_build(job["engine"], frame, facts),
        "before_samples_seconds": frame["marks"].get("sample"),
        "blender_seconds": frame["marks"].get("first"),
        "ended_at": frame["ended_at"],
    }
    if facts is not None:
        record |= {"export": facts["export"], "sync": facts["sync"], "core": facts["core"]}
    return record


def main(job_path: str, result_path: str) -> int:
    """Does the job; the result is {"renders": [...], ...} or {"error": text}."""
    with open(job_path, encoding="utf-8") as file:
        job = json.load(file)
    try:
        import bpy

        scene, facts, addon = _prepare(job, bpy)
        clock = _Clock(bpy)  # after the file was opened: opening forgets handlers
        before = peak_rss_bytes()
        {"stills": _stills, "keyframes": _keyframes, "script": _script}[job["mode"]](job, bpy, scene, addon)
        pairs = facts if facts else [None] * len(clock.frames)
        if len(pairs) != len(clock.frames):
            raise UserError(f"{len(clock.frames)} pictures but {len(pairs)} reports")
        result = {
            "renders": [_record(job, frame, found) for frame, found in zip(clock.frames, pairs, strict=True)],
            "peak_rss_bytes": peak_rss_bytes(),
            "rss_before_bytes": before,
            "cpu_seconds": _cpu_seconds(),
            "blender": bpy.app.version_string,
        }
        few, many = job["samples"]
        if job["mode"] == "stills":
            counts = [few] + [few, many] * job["rounds"]
        else:
            counts = [few] * len(result["renders"])
        for record, count in zip(result["renders"], counts, strict=True):
            record["samples"] = count
    except (UserError, ImportError, RuntimeError) as error:
        result = {"error": str(error)}
    with open(result_path, "w", encoding="utf-8") as file:
        json.dump(result, file, default=str)
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:3]))
