# SPDX-License-Identifier: GPL-3.0-or-later
"""A board of 8x8-pixel squares, each with the emission of one node case, rendered by an engine in one picture."""

import math
import os

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

SIDE = 8


def positive(tree, socket):
    """|v| + (1 - sign v) / 4: emission cannot be negative, but the test is to see signs."""

    def node(operation, *inputs):
        made = tree.nodes.new("ShaderNodeVectorMath")
        made.operation = operation
        for i, value in enumerate(inputs):
            if isinstance(value, bpy.types.NodeSocket):
                tree.links.new(value, made.inputs[i])
            else:
                made.inputs[i].default_value = (value,) * 3
        return made.outputs[0]

    raised = node("ADD", node("ABSOLUTE", socket), 0.25)
    return node("MULTIPLY_ADD", node("SIGN", socket), -0.25, raised)


def fill(cases: dict, prepare=lambda: None) -> dict:
    """Builds the board in an emptied file. `cases`: name → function(tree, coordinate socket) → output socket.

    `prepare` makes what they need in the emptied file. Returns name → material.
    """
    from node_cases import pixel_centres

    bpy.ops.wm.read_factory_settings(use_empty=True)
    prepare()
    materials = {}
    for name, build in cases.items():
        material = materials[name] = bpy.data.materials.new(name)
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        coordinates = tree.nodes.new("ShaderNodeTexCoord")
        socket = build(tree, pixel_centres(tree, coordinates.outputs["UV"]))
        if socket.type != "SHADER":
            emission = tree.nodes.new("ShaderNodeEmission")
            tree.links.new(positive(tree, socket), emission.inputs[0])
            socket = emission.outputs[0]
        tree.links.new(socket, output.inputs["Surface"])
    columns = columns_of(len(cases))
    rows = math.ceil(len(cases) / columns)
    vertices, faces = [], []
    for i in range(len(cases)):
        x, y = i % columns, i // columns
        first = len(vertices)
        vertices += [(x, y, 0), (x + 1, y, 0), (x + 1, y + 1, 0), (x, y + 1, 0)]
        faces.append(range(first, first + 4))
    mesh = bpy.data.meshes.new("board")
    mesh.from_pydata(vertices, [], faces)
    corners = np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32)
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", np.tile(corners, len(faces)))
    for i, material in enumerate(materials.values()):
        mesh.materials.append(material)
        mesh.polygons[i].material_index = i
    scene = bpy.context.scene
    place = Matrix.LocRotScale(Vector((3, -2, 1)), None, Vector((2, 2, 2)))
    _unseen(mesh, place)  # so that the board is not the first of the instances
    board = bpy.data.objects.new("board", mesh)
    scene.collection.objects.link(board)
    board.matrix_world = place
    camera = scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2 * max(columns, rows)
    camera.location = place @ Vector((columns / 2, rows / 2, 5))
    scene.render.resolution_x, scene.render.resolution_y = columns * SIDE, rows * SIDE
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    return materials


def _unseen(mesh, place) -> None:
    """Three objects behind the camera, each placed otherwise."""
    for i in range(3):
        obj = bpy.data.objects.new(f"a{i}", mesh)
        bpy.context.scene.collection.objects.link(obj)
        obj.matrix_world = place @ Matrix.LocRotScale(Vector((0, 0, 50 + i)), Euler((i, 1, 2)), Vector((1, 2 + i, 3)))


def columns_of(count: int) -> int:
    return math.ceil(math.sqrt(count))


def render(engine: str, folder: str, names: list) -> dict:
    """Name → (8, 8, 3) float32, bottom row first."""
    pixels = picture(engine, folder)
    columns = columns_of(len(names))
    found = {}
    for i, name in enumerate(names):
        x, y = i % columns * SIDE, i // columns * SIDE
        found[name] = pixels[y : y + SIDE, x : x + SIDE]
    return found


def picture(engine: str, folder: str) -> np.ndarray:
    """The scene with one sample at (nearly) the middle of each pixel, (H, W, 3) float32, bottom row first."""
    import OpenEXR

    scene = bpy.context.scene
    scene.render.engine = engine
    scene.cycles.samples, scene.cycles.use_adaptive_sampling, scene.cycles.use_denoising = 1, False, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    if engine != "CYCLES":
        scene.headwater.use_cycles_settings = True
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    scene.render.filepath = os.path.join(folder, engine + ".exr")
    bpy.ops.render.render(write_still=True)
    channels = OpenEXR.File(scene.render.filepath).channels()
    return np.asarray(channels["RGBA" if "RGBA" in channels else "RGB"].pixels)[::-1, :, :3]
