# SPDX-License-Identifier: Apache-2.0
"""Measures a scrub: frames of an animation as a viewport shows them, at equal time, against references frame by frame.

    python blender_tests/measure_scrub.py SCENE.blend [SIZE] [FRAMES] [REFERENCE_SAMPLES] [SECONDS] [MAX_BOUNCES]

Each integrator has the same wall time for each frame (render alone) and hands its reservoirs on, as viewports do: one
slice of one sample, then slices that go on with it until the time is over. The errors are means over the frames but the
first: FLIP, trimmed relMSE, and the mean square of what changed from frame to frame less what changes in the references
(of tanh of the picture, so that lamps do not count alone).
"""

import sys
import time

import bpy
import numpy as np

import headwater.blender
from headwater.metrics import error_metrics, flip

addon = headwater.blender.register()
from headwater_addon import native, options  # noqa: E402
from headwater_addon import render_settings as rs  # noqa: E402
from headwater_addon.sync.state import SceneSync  # noqa: E402

WARM_UP = 2  # renders before the first frame: kernels are compiled


def settings_of(scene, size, bounces: int) -> dict:
    frame = rs.Frame(*size, 0, 0, *size)
    view_layer = scene.view_layers[0]
    settings = rs.build(scene, view_layer, frame, ["Combined"], options.Options())
    return settings | {"seed": 1, "time_limit": 0.0, "max_bounces": bounces}


def timed_picture(session, settings: dict, seconds: float) -> tuple[np.ndarray, int]:
    """What there is when the time is over, in whole samples."""
    end, samples, took = time.perf_counter() + seconds, 0, 0.0
    while samples == 0 or time.perf_counter() < end - took:
        begun = time.perf_counter()
        session.start(settings | {"samples": samples + 1, "resume": samples > 0, "continue_history": True})
        session.finish()
        samples, took = samples + 1, time.perf_counter() - begun
    return session.read("Combined")[..., :3].astype(np.float64), samples


def frames_of(scene, size, integrator: str, frames: range, bounces: int, render):
    """render(session, settings) of each frame, in one session."""
    scene.headwater.integrator = integrator
    sync = SceneSync(native.core())
    session = native.core().Session(native.context(), sync.scene)
    settings = settings_of(scene, size, bounces)
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


def main() -> None:
    given = [*sys.argv[1:], *("160x90", "8", "512", "0.25", "0")[len(sys.argv) - 2 :]]
    blend, size, count, most, seconds, bounces = given
    size = tuple(map(int, size.split("x")))
    bpy.ops.wm.open_mainfile(filepath=blend)
    scene = bpy.context.scene
    scene.render.engine = "HEADWATER"
    scene.headwater.use_cycles_settings = False
    frames = range(scene.frame_start, scene.frame_start + int(count))

    def reference(session, settings):
        session.start(settings | {"samples": int(most), "seed": 1000})
        session.finish()
        return session.read("Combined")[..., :3].astype(np.float64)

    references = frames_of(scene, size, "path", frames, int(bounces), reference)
    print(
        "| integrator | samples a frame | FLIP | relMSE, trimmed | frame difference |\n| --- | --- | --- | --- | --- |"
    )
    for integrator in ("path", "restir-reproject", "wssr-grid", "wssr-grid-reproject"):
        pictures = frames_of(
            scene,
            size,
            integrator,
            frames,
            int(bounces),
            lambda s, settings: timed_picture(s, settings, float(seconds)),
        )
        rows = []
        for i in range(1, len(pictures)):
            (a, _), (b, samples), ra, rb = pictures[i - 1], pictures[i], references[i - 1], references[i]
            errors = error_metrics(b, rb)
            shown = flip(b, rb)
            change = np.mean((np.tanh(b) - np.tanh(a) - np.tanh(rb) + np.tanh(ra)) ** 2)
            rows.append((samples, shown[0] if shown else np.nan, errors["relmse_trimmed"], change))
        samples, shown, relmse, change = np.mean(rows, axis=0)
        print(f"| {integrator} | {samples:.1f} | {shown:.4f} | {relmse:.4f} | {change:.6f} |", flush=True)


main()
