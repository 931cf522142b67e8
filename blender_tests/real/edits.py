# SPDX-License-Identifier: Apache-2.0
"""Edits of Blender's first scene, one for each kind that a viewport must follow, and how they are tried."""

import bpy
import numpy as np

SAMPLES = 4
CHANGED = 1e-3  # mean difference of pictures that show another scene; equal scenes give equal pictures


def look(session) -> np.ndarray:
    picture = session.picture()
    assert picture.samples == SAMPLES, "pictures of other samples differ by noise"
    return picture.pixels[..., :3].copy()


def edits(session):
    """The edits, as functions: each is to change the picture, and some take back others."""
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


def try_edits(session, names=()):
    """Makes all edits, or those named, in their order. AssertionError for one that does not show in the viewport."""
    facts = session.facts["edits"] = {}
    for number, edit in enumerate(edits(session)):
        if names and edit.__name__ not in names:
            continue
        yield from session.settled(SAMPLES)
        before, request = look(session), session.picture().request
        edit()
        yield from session.settled(SAMPLES, after=request)
        after = look(session)
        difference = float(np.abs(after - before).mean()) if before.shape == after.shape else 1.0
        facts[edit.__name__] = {"difference": difference, "sync_ms": 1e3 * session.views[0].sync_seconds}
        session.shot(f"10_{number:02}_{edit.__name__}")
        assert difference > CHANGED, f"the picture is the same after '{edit.__name__}'"
