# SPDX-License-Identifier: Apache-2.0
"""Measures a scrub: frames of an animation as a viewport shows them, at equal time, against references frame by frame.

    python blender_tests/measure_scrub.py SCENE.blend [SIZE [FRAMES [REFERENCE_SAMPLES [SECONDS [BOUNCES [WHAT…]]]]]]

WHAT is an integrator, or one with `+history`: then pictures are carried on as a viewport's are (headwater/temporal.py).
Each has the same CPU time for each frame (all threads; rendering and blending alone) and hands its reservoirs on, as
viewports do: one slice of one sample, then slices that go on with it until the time is over. References are of
`wssr-hash`, and kept beside the scene. The errors are means over the frames but the first: FLIP, trimmed relMSE, and
the mean square of what changed from frame to frame less what changes in the references (of tanh of the picture, so that
lamps do not count alone). HEADWATER_PICTURES=FOLDER: every picture, as PNG.
"""

import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np

import headwater.blender
from headwater import temporal
from headwater.image_io import write_png
from headwater.metrics import error_metrics, flip

addon = headwater.blender.register()
from headwater_addon import native, options  # noqa: E402
from headwater_addon import render_settings as rs  # noqa: E402
from headwater_addon.sync.state import SceneSync  # noqa: E402

WARM_UP = 2  # renders before the first frame: kernels are compiled


def settings_of(scene, size, bounces: int, passes) -> dict:
    frame = rs.Frame(*size, 0, 0, *size)
    view_layer = scene.view_layers[0]
    settings = rs.build(scene, view_layer, frame, list(passes), options.Options())
    return settings | {"seed": 1, "time_limit": 0.0, "max_bounces": bounces}


class Scrub:
    """Pictures of one contestant, frame by frame."""

    def __init__(self, seconds: float, carried: bool):
        self._seconds, self._history = seconds, temporal.History() if carried else None
        self._first = 0

    def picture(self, session, settings: dict) -> tuple[np.ndarray, int]:
        """What there is when the time is over, in whole samples."""
        end, samples, took = time.process_time() + self._seconds, 0, 0.0
        if self._history:
            settings = settings | {"first_sample": self._first}
            self._history.advance()
        while samples == 0 or time.process_time() < end - took:
            begun = time.process_time()
            session.start(settings | {"samples": samples + 1, "resume": samples > 0, "continue_history": True})
            session.finish()
            samples += 1
            shown = session.read("Combined")
            if self._history:  # each slice is shown
                shown = self._history.blend(shown, samples, *map(session.read, temporal.GUIDES))
            took = time.process_time() - begun
        self._first += samples
        return shown[..., :3].astype(np.float64), samples


def frames_of(scene, size, integrator: str, frames: range, bounces: int, render, passes=("Combined",)):
    """render(session, settings) of each frame, in one session."""
    scene.headwater.integrator = integrator
    sync = SceneSync(native.core())
    session = native.core().Session(native.context(), sync.scene)
    settings = settings_of(scene, size, bounces, passes)
    found = []
    for number, frame in enumerate(frames):
        scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        sync.sync(depsgraph, False, next_frame=number > 0)
        sync.camera.sync(depsgraph, scene.camera.evaluated_get(depsgraph), scene.render, rs.Frame(*size, 0, 0, *size))
        session.sync()
        for _ in range(WARM_UP if number == 0 else 0):
            session.start(settings | {"samples": 1})
            session.finish()
        found.append(render(session, settings))
    return found


def references_of(blend: Path, scene, size, frames, bounces: int, samples: int) -> list[np.ndarray]:
    kept = blend.with_suffix(f".{size[0]}x{size[1]}.{frames[0]}-{frames[-1]}.{bounces}.{samples}.npy")
    if kept.exists():
        return list(np.load(kept).astype(np.float64))

    def reference(session, settings):
        session.start(settings | {"samples": samples, "seed": 1000})
        session.finish()
        return session.read("Combined")[..., :3]

    found = frames_of(scene, size, "wssr-hash", frames, bounces, reference)
    np.save(kept, np.array(found))
    return [each.astype(np.float64) for each in found]


def save(folder: str, name: str, picture: np.ndarray) -> None:
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        write_png(Path(folder) / f"{name}.png", picture)


def main() -> None:
    given = [*sys.argv[1:7], *("160x90", "8", "128", "0.25", "0")[len(sys.argv[1:7]) - 1 :]]
    contestants = sys.argv[7:] or ("path", "path+history", "wssr-hash", "wssr-hash+history")
    blend, size, count, most, seconds, bounces = given
    size = tuple(map(int, size.split("x")))
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    scene.render.engine = "HEADWATER"
    scene.headwater.use_cycles_settings = False
    frames = range(scene.frame_start, scene.frame_start + int(count))
    folder = os.environ.get("HEADWATER_PICTURES", "")
    references = references_of(Path(blend), scene, size, frames, int(bounces), int(most))
    for frame, picture in zip(frames, references, strict=True):
        save(folder, f"reference_{frame:03}", picture)
    print("| what | samples a frame | FLIP | relMSE, trimmed | frame difference |\n| --- | --- | --- | --- | --- |")
    for what in contestants:
        carried = what.endswith("+history")
        passes = ("Combined", *temporal.GUIDES) if carried else ("Combined",)
        integrator = what.removesuffix("+history")
        scrub = Scrub(float(seconds), carried)
        pictures = frames_of(scene, size, integrator, frames, int(bounces), scrub.picture, passes)
        rows = []
        for i in range(1, len(pictures)):
            (a, _), (b, samples), ra, rb = pictures[i - 1], pictures[i], references[i - 1], references[i]
            errors = error_metrics(b, rb)
            shown = flip(b, rb)
            change = np.mean((np.tanh(b) - np.tanh(a) - np.tanh(rb) + np.tanh(ra)) ** 2)
            rows.append((samples, shown[0] if shown else np.nan, errors["relmse_trimmed"], change))
        for frame, (picture, _) in zip(frames, pictures, strict=True):
            save(folder, f"{what}_{frame:03}", picture)
        samples, shown, relmse, change = np.mean(rows, axis=0)
        print(f"| {what} | {samples:.1f} | {shown:.4f} | {relmse:.4f} | {change:.6f} |", flush=True)


main()
