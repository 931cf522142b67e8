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

SAMPLES = 4
CHANGED = 1e-3  # mean difference of pictures that show another scene; equal scenes give equal pictures


def look(session) -> np.ndarray:
    picture = session.picture()
    assert picture.samples == SAMPLES, "pictures of other samples differ by noise"
    return picture.pixels[..., :3].copy()


def edits(session):
    """(name, function, whether the picture changes), one for each kind of edit."""
    data, scene = bpy.data, session.scene
    cube, lamp = data.objects["Cube"], data.objects["Light"]
    material = cube.data.materials[0]

    def principled():
        return next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")

    def move():
        cube.location.x += 0.7

    def edit_mesh():
        positions = np.empty(len(cube.data.vertices) * 3, np.float32)
        cube.data.vertices.foreach_get("co", positions)
        cube.data.vertices.foreach_set("co", positions * 1.4)
        cube.data.update()

    def node():
        principled().inputs["Base Color"].default_value = (0.8, 0.1, 0.05, 1)

    def lamp_color():
        lamp.data.color = (0.2, 0.4, 1.0)

    def lamp_power():
        lamp.data.energy *= 3

    def lamp_nodes():
        lamp.data.use_nodes = True
        emission = next(node for node in lamp.data.node_tree.nodes if node.type == "EMISSION")
        emission.inputs["Color"].default_value = (1.0, 0.5, 0.1, 1)

    def lamp_node():
        emission = next(node for node in lamp.data.node_tree.nodes if node.type == "EMISSION")
        emission.inputs["Strength"].default_value = 2.5

    def holdout():
        session.window.view_layer.layer_collection.children[0].holdout = True

    def no_holdout():
        session.window.view_layer.layer_collection.children[0].holdout = False

    def ray_visibility():
        cube.visible_camera = False

    def visible_again():
        cube.visible_camera = True

    def other_material():
        material = data.materials.new("Fresh")
        material.use_nodes = True
        cube.material_slots[0].material = material

    def old_material():
        cube.material_slots[0].material = material

    def image():
        picture = data.images.new("Swap", 8, 8)
        picture.generated_color = (0.1, 0.9, 0.1, 1)
        texture = material.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = picture
        material.node_tree.links.new(texture.outputs["Color"], principled().inputs["Base Color"])

    def swap_image():
        other = data.images.new("Other", 8, 8)
        other.generated_color = (0.9, 0.1, 0.9, 1)
        next(n for n in material.node_tree.nodes if n.type == "TEX_IMAGE").image = other

    def paint_image():
        data.images["Other"].pixels.foreach_set(np.tile(np.float32([1, 0.9, 0.1, 1]), 64))
        data.images["Other"].update()
        data.images["Other"].update_tag()  # painting does that; pixels set by a script do not

    def world():
        background = next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND")
        background.inputs["Color"].default_value = (0.1, 0.2, 0.4, 1)

    def settings():
        scene.headwater.exposure = 1.6

    def add():
        with session.context():
            bpy.ops.mesh.primitive_uv_sphere_add(location=(-0.6, -2.6, 0))  # where the cube does not hide it

    def duplicate():
        with session.context():
            bpy.ops.object.duplicate()
            bpy.context.active_object.location.z += 1.5

    def delete():
        with session.context():
            bpy.ops.object.delete()

    def hide():
        cube.hide_set(True)

    def show():
        cube.hide_set(False)

    def exclude():
        session.window.view_layer.layer_collection.children[0].exclude = True

    def include():
        session.window.view_layer.layer_collection.children[0].exclude = False

    def append():
        library = str(session.folder / "library.blend")
        mesh = data.meshes.new("Appended")
        mesh.from_pydata([(-3, -3, -1.2), (3, -3, -1.2), (3, 3, -1.2), (-3, 3, -1.2)], [], [(0, 1, 2, 3)])
        floor = data.objects.new("Appended", mesh)
        data.libraries.write(library, {floor})
        data.objects.remove(floor)
        data.meshes.remove(mesh)
        with data.libraries.load(library) as (_, wanted):
            wanted.objects = ["Appended"]
        scene.collection.objects.link(wanted.objects[0])

    def local_view():
        with session.context():
            bpy.ops.object.select_all(action="DESELECT")
            lamp.select_set(True)
            bpy.context.view_layer.objects.active = lamp
            bpy.ops.view3d.localview(frame_selected=False)

    def leave_local_view():
        with session.context():
            bpy.ops.view3d.localview(frame_selected=False)

    def border():
        session.space.render_border_min_x = session.space.render_border_min_y = 0.3
        session.space.render_border_max_x = session.space.render_border_max_y = 0.7
        session.space.use_render_border = True

    def no_border():
        session.space.use_render_border = False

    def channel():
        session.space.shading.headwater.render_pass = "NORMAL"

    def combined():
        session.space.shading.headwater.render_pass = "COMBINED"

    steps = (move, edit_mesh, node, lamp_color, lamp_power, image, swap_image, paint_image, world, settings, add)
    steps += (lamp_nodes, lamp_node, holdout, no_holdout, ray_visibility, visible_again, other_material, old_material)
    steps += (duplicate, delete, hide, show, exclude, include, append, local_view, leave_local_view)
    return steps + (border, no_border, channel, combined)


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

    facts["edits"] = {}
    for number, edit in enumerate(edits(session)):
        yield from session.settled(SAMPLES)
        before, request = look(session), session.picture().request
        edit()
        yield from session.settled(SAMPLES, after=request)
        after = look(session)
        difference = float(np.abs(after - before).mean()) if before.shape == after.shape else 1.0
        facts["edits"][edit.__name__] = {"difference": difference, "sync_ms": 1e3 * session.views[0].sync_seconds}
        session.shot(f"10_{number:02}_{edit.__name__}")
        assert difference > CHANGED, f"the picture is the same after '{edit.__name__}'"

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
