# SPDX-License-Identifier: Apache-2.0
"""What a viewport costs in a real scene: first picture, orbit, scrub, one moved object; and that it equals F12.

Arguments: the artefact folder, a .blend. Figures go to facts.json; marks are judged by who runs it.
"""

import math
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion

sys.path.insert(0, str(Path(__file__).parent))
import driver

ORBIT_STEPS = 40


def percentile(values, share=95) -> float:
    return float(np.percentile(values, share)) if len(values) else -1.0


def orbit(session, name: str):
    drawn, pictures, blocks, begun = 0, set(), [], time.perf_counter()
    for _ in range(ORBIT_STEPS):
        session.region_3d.view_rotation = (
            Quaternion((0, 0, 1), 2 * math.pi / ORBIT_STEPS) @ session.region_3d.view_rotation
        )
        session.area.tag_redraw()
        yield 0.0
        view = session.views[0]
        drawn += 1
        blocks.append(view.draw_seconds)
        pictures.add(view.picture.at)
    seconds = time.perf_counter() - begun
    session.facts[name] = {
        "draws_a_second": drawn / seconds,
        "pictures_a_second": len(pictures) / seconds,
        "divider": session.views[0].picture.divider,
        "block_ms_p95": 1e3 * percentile(blocks),
        "block_ms_most": 1e3 * max(blocks),
    }


def same_as_final(session, samples: int):
    """Sets a camera that sees what the viewport sees, renders it, and compares. Both have the same seed."""
    facts, scene, space = session.facts, session.scene, session.space
    region = next(region for region in session.area.regions if region.type == "WINDOW")
    camera = bpy.data.objects.new("View", bpy.data.cameras.new("View"))
    scene.collection.objects.link(camera)
    camera.matrix_world = session.region_3d.view_matrix.inverted()
    camera.data.lens, camera.data.sensor_width = space.lens, 72
    camera.data.clip_start, camera.data.clip_end = space.clip_start, space.clip_end
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = region.width, region.height
    scene.render.resolution_percentage = 100
    scene.render.use_border = False
    scene.headwater.samples = scene.headwater.preview_samples = samples
    scene.headwater.use_animated_seed = False
    yield from session.settled(samples, 300)
    viewport = session.picture().pixels.copy()
    final, seen = driver.submodule("final"), []
    final.observers.append(lambda event, data: seen.append(event) and None)
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    with session.context():
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield from session.until(lambda: "frame" in seen, 300, "F12")
    yield 0.5
    final.observers.clear()
    path = str(session.folder / "f12.exr")
    bpy.data.images["Render Result"].save_render(path, scene=scene)
    image = bpy.data.images.load(path)
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    f12 = pixels.reshape(image.size[1], image.size[0], 4)
    assert f12.shape == viewport.shape, (f12.shape, viewport.shape)
    np.save(session.folder / "viewport.npy", viewport)
    np.save(session.folder / "f12.npy", f12)
    a, b = viewport[..., :3], f12[..., :3]
    facts["against_f12"] = {
        "samples": samples,
        "mean_ratio": float(a.mean() / b.mean()),
        "relmse": float(np.mean((a - b) ** 2 / (b**2 + 1e-2))),
        "equal_pixels": float(np.mean(np.abs(a - b).max(-1) <= 1e-3 * (1 + b.max(-1)))),
    }
    session.shot("50_f12")


def steps(session):
    driver.addon()
    facts = session.facts
    bpy.ops.wm.open_mainfile(filepath=driver.arguments()[1])
    yield 0.5
    scene = session.scene
    scene.render.engine = "HEADWATER"
    scene.headwater.use_cycles_settings = False
    if len(driver.arguments()) > 2:
        scene.headwater.integrator = driver.arguments()[2]
    session.region_3d.view_perspective = "CAMERA"
    yield 0.5
    facts["size"] = [session.area.width, session.area.height]
    for name in ("first", "again"):  # the second time kernels are compiled and Blender's data is evaluated
        session.space.shading.type = "SOLID"
        yield 0.5
        begun = time.perf_counter()
        session.space.shading.type = "RENDERED"
        yield from session.until(lambda: session.views and session.views[0].synced_at, 60, "the sync")
        yield from session.until(lambda: session.picture() is not None, 60, "the first picture")
        view = session.views[0]
        facts[f"{name}_switch"] = {
            "to_picture_seconds": time.perf_counter() - begun,
            "from_synced_to_picture_seconds": view.picture.at - view.synced_at,
            "sync_ms": 1e3 * view.sync_seconds,
            "core_sync": view.core_sync,
            "divider": view.picture.divider,
        }
    yield from session.settled(16, 120)
    session.shot("01_camera")
    session.region_3d.view_perspective = "PERSP"  # from where the scene's camera stands
    session.space.lens = scene.camera.data.lens
    session.region_3d.view_distance = 3.0
    session.region_3d.view_matrix = scene.camera.matrix_world.inverted()
    yield from session.settled(1)
    yield from orbit(session, "orbit")
    session.shot("02_orbit")
    yield from session.settled(8, 120)
    session.shot("03_after_orbit")

    sync, built, current = [], [], scene.frame_current
    for frame in [*range(current, current + 12), *range(current + 12, current, -1)]:
        scene.frame_set(frame)
        yield from session.settled(1)
        sync.append(session.views[0].sync_seconds)
        built.append(sum(v for k, v in session.views[0].core_sync.items() if k.endswith("_seconds")))
        if frame % 4 == 0:
            session.shot(f"10_frame_{frame:03}")
    facts["scrub"] = {"sync_ms_p95": 1e3 * percentile(sync), "core_ms_p95": 1e3 * percentile(built)}
    movable = next(o for o in scene.objects if o.type == "MESH" and o.visible_get() and o.parent is None)
    sync, built = [], []
    for _ in range(8):
        movable.location.x += 0.05
        yield from session.settled(1)
        sync.append(session.views[0].sync_seconds)
        built.append(sum(v for k, v in session.views[0].core_sync.items() if k.endswith("_seconds")))
    facts["moved"] = {
        "object": movable.name,
        "sync_ms_p95": 1e3 * percentile(sync),
        "core_ms_p95": 1e3 * percentile(built),
    }
    yield from same_as_final(session, 32)
    facts["memory_mib"] = driver.resident_bytes() >> 20


driver.Session(steps)
