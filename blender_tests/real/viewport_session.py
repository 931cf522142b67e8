# SPDX-License-Identifier: Apache-2.0
"""A driven session of Rendered viewports: every kind of edit, undo, playing, scrubbing, F12, save, load, disable."""

import math
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from mathutils import Quaternion

sys.path.insert(0, str(Path(__file__).parent))
import driver
from edits import CHANGED, SAMPLES, look, try_edits


def orbit(session, steps: int):
    begun, block = time.perf_counter(), []
    drawn = sum(view.draws for view in session.views)
    for _ in range(steps):
        session.region_3d.view_rotation = Quaternion((0, 0, 1), 2 * math.pi / steps) @ session.region_3d.view_rotation
        session.area.tag_redraw()
        yield 0.0
        block += [view.draw_seconds for view in session.views]
    seconds = time.perf_counter() - begun
    drawn = sum(view.draws for view in session.views) - drawn
    session.facts["orbit"] = {
        "draws_a_second": drawn / seconds,
        "block_ms_p95": 1e3 * float(np.percentile(block, 95)),
    }


def steps(session):
    driver.addon()
    scene, facts = session.scene, session.facts
    scene.render.engine = "HEADWATER"
    scene.headwater.use_cycles_settings = False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 64, 100
    scene.headwater.samples = 4
    scene.headwater.use_preview_history = False  # equal scenes are to give equal pictures; carried_session.py is of it
    if scene.world is None:
        scene.world = bpy.data.worlds.new("World")
    session.space.shading.type = "RENDERED"
    session.region_3d.view_distance = 7
    begun = time.perf_counter()
    yield from session.until(lambda: session.picture() is not None, 60, "the first picture")
    facts["first_picture_seconds"] = time.perf_counter() - begun
    yield from session.settled(16)
    session.shot("01_rendered")
    scene.headwater.preview_samples = SAMPLES

    yield from orbit(session, 50)
    session.shot("02_orbit")

    yield from try_edits(session)

    cube = bpy.data.objects["Cube"]
    yield from session.settled(SAMPLES)
    place = tuple(cube.location)
    with session.context():
        bpy.ops.ed.undo_push(message="before")
    for number in range(20):
        bpy.data.objects["Cube"].location.y = 0.2 * (number + 1)
        with session.context():
            bpy.ops.ed.undo_push(message=f"move {number}")
        yield 0.02
    yield from session.settled(SAMPLES)
    moved, places = look(session), []
    facts["places"] = places
    for _ in range(20):
        with session.context():
            bpy.ops.ed.undo()
        yield 0.02
        places.append(bpy.data.objects["Cube"].location.y)
    yield from session.settled(SAMPLES)
    undone = look(session)
    for _ in range(20):
        with session.context():
            bpy.ops.ed.redo()
        yield 0.02
    yield from session.settled(SAMPLES)
    facts["undo"] = float(np.abs(undone - moved).mean())
    facts["redo"] = float(np.abs(look(session) - moved).mean())
    facts["place"] = [place, tuple(bpy.data.objects["Cube"].location)]
    assert facts["undo"] > CHANGED > facts["redo"], "undo and redo do not show"
    session.shot("20_redone")

    cube = bpy.data.objects["Cube"]
    cube.keyframe_insert("location", frame=1)
    cube.location.x -= 2
    cube.keyframe_insert("location", frame=48)
    session.scene.frame_start, session.scene.frame_end = 1, 48
    frames = set()
    with session.context():
        bpy.ops.screen.animation_play()
    end = time.perf_counter() + 40
    while len(frames) < 40 and time.perf_counter() < end:
        frames.add(session.scene.frame_current)
        yield 0.0
    with session.context():
        bpy.ops.screen.animation_cancel(restore_frame=False)
    facts["frames_played"] = len(frames)
    scrub = []
    for frame in [*range(1, 49, 3), *range(48, 0, -3), 1, 48, 1]:
        session.scene.frame_set(frame)
        yield from session.settled(1)
        scrub.append(1e3 * session.views[0].sync_seconds)
    facts["scrub_sync_ms_p95"] = float(np.percentile(scrub, 95))
    session.shot("30_scrubbed")

    yield from two_viewports(session)
    yield from final_pictures(session)

    saved = str(session.folder / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=saved)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=False)
    yield 0.5
    bpy.ops.wm.open_mainfile(filepath=saved)
    yield 0.5
    session.space.shading.type = "RENDERED"
    yield from session.settled(SAMPLES)
    session.shot("50_loaded")

    session.space.shading.type = "SOLID"
    yield 0.3
    facts["views_left"] = len(session.views)
    if driver.EXTENSION in bpy.context.preferences.addons:
        session.space.shading.type = "RENDERED"
        yield 0.3
        bpy.ops.preferences.addon_disable(module=driver.EXTENSION)  # while a viewport renders
        yield 0.5
        bpy.ops.preferences.addon_enable(module=driver.EXTENSION)
        session.scene.render.engine = "HEADWATER"
        yield from session.settled(SAMPLES)
    session.shot("60_end")


def two_viewports(session):
    """A second viewport, through the camera: both render, both show an edit, and closing it leaves one."""
    with session.context():
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    yield 0.5
    areas = [area for area in session.window.screen.areas if area.type == "VIEW_3D"]
    for area in areas:
        area.spaces.active.shading.type = "RENDERED"
    areas[1].spaces.active.region_3d.view_perspective = "CAMERA"

    def both_have(samples: int, of=()) -> bool:
        pictures = [view.picture for view in session.views if view.picture and view.is_current(view.picture)]
        fresh = [picture for picture in pictures if picture.request not in of]
        return len([picture for picture in fresh if picture.divider == 1 and picture.samples >= samples]) == 2

    yield from session.until(lambda: both_have(4), 30, "pictures in two viewports")
    before = [view.picture.request for view in session.views]
    bpy.data.objects["Cube"].location.x += 0.2
    yield from session.until(lambda: both_have(4, before), 30, "an edit in two viewports")
    session.shot("35_two")
    with bpy.context.temp_override(window=session.window, area=areas[1]):
        bpy.ops.screen.area_close()
    yield from session.until(lambda: len(session.views) == 1, 10, "one view left")


def final_pictures(session):
    """F12 beside a viewport, F12 while one runs, Esc, an animation; edits and undo meanwhile."""
    facts, scene = session.facts, session.scene
    final = driver.submodule("final")
    seen = []
    final.observers.append(lambda event, data: seen.append((event, data)) and None)
    scene.frame_set(1)
    yield from session.settled(1)
    with session.context():
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield from session.until(lambda: any(event == "frame" for event, _ in seen), 60, "F12")
    yield from session.no_render()
    yield 0.3
    session.shot("40_f12")
    assert final.last_error == "", final.last_error

    scene.headwater.samples = 100000
    with session.context():
        bpy.ops.render.render("INVOKE_DEFAULT")
        yield 0.5
        assert bpy.ops.render.render.poll()
        bpy.ops.render.render("INVOKE_DEFAULT")  # a second F12: Blender refuses or leaves the first alone
    bpy.data.objects["Cube"].location.z += 0.1  # an edit while it renders
    yield 0.3
    seen.clear()
    observer = lambda event, data: event == "progress"  # noqa: E731  cancels, as Esc does
    final.observers.append(observer)
    begun = time.perf_counter()
    yield from session.until(lambda: any(event == "frame" for event, _ in seen), 10, "the cancelled render's end")
    facts["cancel_seconds"] = time.perf_counter() - begun
    final.observers.remove(observer)
    assert seen[-1][1]["cancelled"] and final.last_error == "", final.last_error
    yield from session.no_render()
    yield 0.3
    session.shot("41_cancelled")

    scene.headwater.samples = 2
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.filepath = str(session.folder / "anim_")
    seen.clear()
    with session.context():
        assert bpy.ops.render.render("INVOKE_DEFAULT", animation=True) == {"RUNNING_MODAL"}
    frames = lambda: len([1 for event, _ in seen if event == "frame"])  # noqa: E731
    yield from session.until(lambda: frames() == 3, 60, "an animation of three frames")
    yield 0.5
    facts["animation_files"] = sorted(path.name for path in session.folder.glob("anim_*"))
    assert len(facts["animation_files"]) == 3
    final.observers.clear()
    yield from session.settled(SAMPLES)  # the viewport goes on


driver.Session(steps)
