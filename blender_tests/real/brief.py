# SPDX-License-Identifier: Apache-2.0
"""Less than a minute in a real Blender's window, for every run of the tests: edits, undo, scrub, F12, save, load."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import driver
import numpy as np
from edits import CHANGED, SAMPLES, look, try_edits

EDITS = ("move", "edit_mesh", "node", "lamp_color", "image", "world", "add", "delete", "hide", "show")


def steps(session):
    driver.addon()
    scene = session.scene
    scene.render.engine = "HEADWATER"
    scene.headwater.use_cycles_settings = False
    scene.headwater.use_preview_history = False
    scene.headwater.samples = scene.headwater.preview_samples = SAMPLES
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 64, 100
    session.space.shading.type = "RENDERED"
    session.region_3d.view_distance = 7
    yield from session.until(lambda: session.picture() is not None, 60, "the first picture")
    yield from try_edits(session, EDITS)

    push = bpy.ops.ed.undo_push
    with session.context():
        push(message="before")
        bpy.data.objects["Cube"].location.z += 0.5
        push(message="moved")
    yield from session.settled(SAMPLES)
    moved = look(session)
    for step, limit in ((bpy.ops.ed.undo, np.greater), (bpy.ops.ed.redo, np.less)):
        with session.context():
            step()
        yield from session.settled(SAMPLES)
        assert limit(np.abs(look(session) - moved).mean(), CHANGED), f"{step.idname()} does not show"

    cube = bpy.data.objects["Cube"]
    cube.keyframe_insert("location", frame=1)
    cube.location.x -= 1
    cube.keyframe_insert("location", frame=4)
    pictures = []
    for frame in (1, 4, 2, 1):
        session.scene.frame_set(frame)  # undo has replaced what was held
        yield from session.settled(SAMPLES)
        pictures.append(look(session))
    assert np.abs(pictures[1] - pictures[0]).mean() > CHANGED, "another frame shows the same"
    assert np.array_equal(pictures[3], pictures[0]), "the first frame does not come back"

    final, seen = driver.submodule("final"), []
    final.observers.append(lambda event, data: seen.append(event) and None)
    with session.context():
        assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield from session.until(lambda: "frame" in seen, 60, "F12")
    yield from session.no_render()
    assert final.last_error == "", final.last_error
    picture = str(session.folder / "f12.png")
    bpy.data.images["Render Result"].save_render(picture)
    pixels = np.array(bpy.data.images.load(picture).pixels[:]).reshape(-1, 4)
    assert pixels[:, :3].std() > 0.05 and pixels[:, 3].min() == 1, "F12's picture is empty"
    yield 0.5  # the window is drawn
    session.shot("40_f12")
    final.observers.clear()

    saved = str(session.folder / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=saved)
    bpy.ops.wm.open_mainfile(filepath=saved)
    yield 0.5
    session.space.shading.type = "RENDERED"
    yield from session.settled(SAMPLES)
    session.shot("50_loaded")


driver.Session(steps)
