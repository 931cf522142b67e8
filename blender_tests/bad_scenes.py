# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes with something wrong, rendered one after another in one Blender with the real core.

A process that survives the whole list has survived each case; the good scene between them must stay what it was.
`python bad_scenes.py FOLDER` prints one JSON object: by case, the error, the warnings and the picture's numbers.
"""

import json
import os
import struct
import sys
import traceback
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
if __name__ == "__main__":
    sys.path[:0] = [os.path.dirname(HERE), HERE]

import bpy  # noqa: E402
import numpy as np  # noqa: E402
import OpenEXR  # noqa: E402

NAN, INF = float("nan"), float("inf")
QUAD = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
SIZE = (24, 16)


def scene():
    return bpy.context.scene


def add(name, vertices=QUAD, faces=((0, 1, 2, 3),), edges=(), **place):
    """An object of a mesh of these vertices, which may be no numbers."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(0, 0, 0)] * len(vertices), edges, faces)
    if vertices:
        mesh.vertices.foreach_set("co", np.array(vertices, np.float32).reshape(-1))
    obj = bpy.data.objects.new(name, mesh)
    scene().collection.objects.link(obj)
    for key, value in place.items():
        setattr(obj, key, value)
    return obj


def lamp(kind, name="Lamp", **settings):
    light = bpy.data.lights.new(name, kind)
    obj = bpy.data.objects.new(name, light)
    obj.location = (0, 0, 4)
    scene().collection.objects.link(obj)
    for key, value in settings.items():
        setattr(light, key, value)
    return obj


def good():
    """A cube under a white sky, seen from above."""
    bpy.ops.wm.read_homefile(use_empty=True)
    s = scene()
    s.render.engine = "HEADWATER"
    s.render.resolution_x, s.render.resolution_y, s.render.resolution_percentage = *SIZE, 100
    s.headwater.use_cycles_settings = False
    s.headwater.samples = 2
    world = s.world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background(world).inputs["Color"].default_value = (1, 1, 1, 1)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 6)
    s.collection.objects.link(camera)
    s.camera = camera
    bpy.ops.mesh.primitive_cube_add(size=2)
    bpy.context.object.name = "Cube"
    s.view_layers[0].use_pass_normal = True
    image = s.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"


def background(world):
    return next(node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")


def sky(color):
    background(scene().world).inputs["Color"].default_value = (*color, 1)


def cube_material():
    """Nodes and links of a new material on the cube, and its Principled node."""
    material = bpy.data.materials.new("Paint")
    material.use_nodes = True
    bpy.data.objects["Cube"].data.materials.append(material)
    tree = material.node_tree
    return tree.nodes, tree.links, next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")


def texture(path=None, image=None):
    """The cube's base colour from an image file (loaded as a .blend would hold it, whether it is there or not)."""
    nodes, links, principled = cube_material()
    node = nodes.new("ShaderNodeTexImage")
    node.image = image or file_image(path)
    links.new(node.outputs["Color"], principled.inputs["Base Color"])


def environment(path):
    tree = scene().world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = file_image(path)
    tree.links.new(node.outputs["Color"], background(scene().world).inputs["Color"])


def file_image(path):
    image = bpy.data.images.new(os.path.basename(path), 4, 4)
    image.source = "FILE"
    image.filepath = path
    return image


# Files


def png(width, height, rows=None):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    data = b"".join(b"\0" + b"\x00\xff\x00" * width for _ in range(height if rows is None else rows))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")


def write_files(folder) -> None:
    """Images that are broken, empty, or as small as can be."""
    noise = np.random.default_rng(3).random((64, 64, 3), np.float32)

    def exr(name, pixels):
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}  # write() adds to it
        OpenEXR.File(header, {"RGB": np.ascontiguousarray(pixels, np.float32)}).write(os.path.join(folder, name))

    exr("whole.exr", noise)
    exr("one.exr", np.full((1, 1, 3), (0, 1, 0)))
    exr("nan.exr", np.full((4, 4, 3), np.nan))
    with open(os.path.join(folder, "whole.exr"), "rb") as file:
        whole = file.read()
    radiance = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n"
    contents = {
        "one.png": png(1, 1),
        "zero.png": png(0, 0),
        "half.png": png(64, 64)[:70],
        "short.png": png(64, 64, rows=3),
        "junk.png": b"junk" * 50,
        "empty.png": b"",
        "huge.png": png(1, 1)[:16] + struct.pack(">II", 2**31 - 1, 2**31 - 1) + png(1, 1)[24:],
        "half.exr": whole[: len(whole) // 2],
        "junk.exr": whole[:4] + b"\2\0\0\0" + b"junk" * 30,
        "junk.hdr": radiance % (40, 40) + b"junk",
        "zero.hdr": radiance % (0, 0),
        "head.hdr": b"#?RADIANCE\nnothing",
    }
    for name, data in contents.items():
        with open(os.path.join(folder, name), "wb") as file:
            file.write(data)


BROKEN_IMAGES = (
    "missing.png", "zero.png", "half.png", "short.png", "junk.png", "empty.png", "huge.png",
    "half.exr", "junk.exr", "junk.hdr", "zero.hdr", "head.hdr",
)  # fmt: skip


# The list


def cases(folder) -> dict:
    """Name of a case: what is done to the good scene."""
    at = lambda name: os.path.join(folder, name)  # noqa: E731
    cube = lambda: bpy.data.objects["Cube"]  # noqa: E731
    camera = lambda: scene().camera  # noqa: E731

    def set_render(**values):
        for key, value in values.items():
            setattr(scene().render, key, value)

    def no_world():
        scene().world = None

    def no_camera():
        scene().camera = None

    def nan_uv():
        cube().data.uv_layers.active.data.foreach_set("uv", np.full(48, NAN, np.float32))
        texture(image=bpy.data.images.new("generated", 4, 4))

    def nan_normals():
        cube().data.attributes.new("custom_normal", "FLOAT_VECTOR", "CORNER").data.foreach_set(
            "vector", np.full(72, NAN, np.float32)
        )

    def nan_color():
        cube_material()[2].inputs["Base Color"].default_value = (NAN, INF, 1, 1)

    def loop():
        nodes, links, principled = cube_material()
        a, b = nodes.new("ShaderNodeMix"), nodes.new("ShaderNodeMix")
        links.new(a.outputs[0], b.inputs[2]), links.new(b.outputs[0], a.inputs[2])
        links.new(a.outputs[0], principled.inputs["Roughness"])

    def own_image(size):
        texture(image=bpy.data.images.new("made", *size))

    def emissive_point():
        add("point", [(0, 0, 2)] * 3, [(0, 1, 2)])
        nodes, _, principled = cube_material()
        principled.inputs["Emission Color"].default_value = (1, 1, 1, 1)
        principled.inputs["Emission Strength"].default_value = 1
        bpy.data.objects["point"].data.materials.append(bpy.data.materials["Paint"])
        sky((0, 0, 0))

    table = {
        "good": lambda: None,
        "no camera": no_camera,
        "camera is a mesh": lambda: setattr(scene(), "camera", cube()),
        "flat camera": lambda: setattr(camera(), "scale", (0, 0, 0)),
        "camera nowhere": lambda: setattr(camera(), "location", (NAN, 0, 0)),
        "camera clips nothing": lambda: (
            setattr(camera().data, "clip_end", 1),
            setattr(camera().data, "clip_start", 5),
        ),
        "no lights": lambda: sky((0, 0, 0)),
        "no world": no_world,
        "empty mesh": lambda: add("empty", [], []),
        "loose mesh": lambda: add("loose", [(0, 0, 2), (1, 0, 2)], [], [(0, 1)]),
        "only empty mesh": lambda: (bpy.data.objects.remove(cube()), add("empty", [], [])),
        "zero area": lambda: add("sliver", [(0, 0, 2), (1, 0, 2), (2, 0, 2)], [(0, 1, 2)]),
        "zero area, emissive": emissive_point,
        "nan vertex": lambda: add("broken", [*QUAD[:3], (NAN, 0, 2)]),
        "infinite vertex": lambda: add("broken", [*QUAD[:3], (INF, 0, 2)]),
        "huge vertex": lambda: add("large", [(3e38, 0, -50), (-3e38, 1, -50), (0, 3e38, -50)], [(0, 1, 2)]),
        "nan uv": nan_uv,
        "nan normals": nan_normals,
        "nan colour": nan_color,
        "scale 0": lambda: add("point", scale=(0, 0, 0)),
        "scale flat": lambda: add("flat", scale=(1, 0, 1)),
        "scale tiny": lambda: add("tiny", scale=(1e-30,) * 3),
        "scale huge": lambda: add("huge", scale=(1e30,) * 3, location=(0, 0, -9)),
        "nan place": lambda: add("nowhere", location=(NAN, 0, 0)),
        "mirrored": lambda: setattr(cube(), "scale", (-1, 1, 1)),
        "mirrored thrice": lambda: setattr(cube(), "scale", (-1, -1, -1)),
        "lamp without size": lambda: lamp("AREA", size=0),
        "lamp of no number": lambda: lamp("POINT", energy=NAN),
        "lamp nowhere": lambda: setattr(lamp("POINT"), "location", (INF, 0, 0)),
        "lamp of scale 0": lambda: setattr(lamp("AREA"), "scale", (0, 0, 0)),
        "lamp of less than nothing": lambda: lamp("SUN", energy=-1),
        "node loop": loop,
        "image 1x1": lambda: texture(at("one.png")),
        "image 1x1 exr": lambda: texture(at("one.exr")),
        "image of nan": lambda: texture(at("nan.exr")),
        "image made 1x1": lambda: own_image((1, 1)),
        "image slot empty": empty_slot,
        "environment 1x1": lambda: environment(at("one.exr")),
        "picture 1x1": lambda: set_render(resolution_x=4, resolution_y=4, resolution_percentage=1),
        "unknown device": lambda: setattr(scene().headwater, "device", "No Such Card"),
        "unwritable output": lambda: set_render(filepath="/proc/none/picture.exr"),
        "memory limit": lambda: (set_render(resolution_x=512), setattr(preferences(), "memory_limit", 2)),
    }
    table.update({f"image {name}": lambda name=name: texture(at(name)) for name in BROKEN_IMAGES})
    table.update({f"environment {name}": lambda name=name: environment(at(name)) for name in BROKEN_IMAGES[::4]})
    return table


def empty_slot():
    nodes, links, principled = cube_material()
    links.new(nodes.new("ShaderNodeTexImage").outputs["Color"], principled.inputs["Base Color"])


def preferences():
    return bpy.context.preferences.addons["headwater_addon"].preferences


def shown(path) -> dict:
    """Numbers of a multilayer EXR: mean colour, mean normal, whether all is finite, size."""
    with OpenEXR.File(path, separate_channels=True) as file:
        found = {name.split(".", 1)[1]: c.pixels for part in file.parts for name, c in part.channels.items()}
    colour = np.stack([found[f"Combined.{c}"] for c in "RGB"], axis=2)
    normal = [float(found[f"Normal.{c}"].mean()) for c in "XYZ"]
    finite = all(bool(np.isfinite(pixels).all()) for pixels in found.values())
    middle = colour[colour.shape[0] // 2, colour.shape[1] // 2]
    return {
        "mean": [float(v) for v in colour.mean(axis=(0, 1))],
        "middle": [float(v) for v in middle],
        "normal": normal,
        "finite": finite,
        "size": [colour.shape[1], colour.shape[0]],
    }


def render_case(name, change, folder, hb, notes) -> dict:
    good()
    preferences().memory_limit = 0
    path = os.path.join(folder, "picture.exr")
    if os.path.exists(path):
        os.unlink(path)
    scene().render.filepath = path
    notes.clear()
    change()
    raised = ""
    try:
        bpy.ops.render.render(write_still=True)
    except RuntimeError as error:
        raised = str(error)
    facts = {"raised": raised, "error": hb.last_error(), "notes": list(notes)}
    if os.path.exists(path):
        facts |= shown(path)
    return facts


def main(folder) -> None:
    import headwater.blender as hb

    hb.register()
    final = sys.modules["headwater_addon.final"]
    notes, traces = [], []
    final.traceback = type("Traces", (), {"print_exc": staticmethod(lambda: traces.append(traceback.format_exc()))})
    kind = sys.modules["headwater_addon.sync.problems"].Notes
    add_note = kind.add
    kind.add = lambda self, text, *about: (notes.append(text), add_note(self, text, *about))[1]
    write_files(folder)
    results = {}
    table = cases(folder)
    for name, change in table.items():
        traces.clear()
        results[name] = render_case(name, change, folder, hb, notes) | {"traces": list(traces)}
        if results[name]["error"]:  # the next picture is good again
            results[name]["after"] = render_case("good", table["good"], folder, hb, notes)
    print("\nBAD_SCENES:" + json.dumps(results), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1])
