# SPDX-License-Identifier: GPL-3.0-or-later
"""Input nodes on a small scene: a smooth, turned and stretched torus piece before a camera at an angle."""

import bpy
import numpy as np

RESOLUTION = (48, 32)


def _out(kind, output, **settings):
    def build(tree):
        node = tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        return node.outputs[output]

    return build


def _with(kind, inputs, output=0, **settings):
    def build(tree):
        node = tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        for name, value in inputs.items():
            if callable(value):
                tree.links.new(value(tree), node.inputs[name])
            else:
                node.inputs[name].default_value = value
        return node.outputs[output]

    return build


def _noise(scale):
    return _with("TexNoise", {"Scale": scale}, 0)


def _transform(kind, source, target):
    return _with(
        "VectorTransform",
        {0: _out("NewGeometry", "Position")},
        vector_type=kind,
        convert_from=source,
        convert_to=target,
    )


def _image(name, vector=None, **settings):
    def build(tree):
        node = tree.nodes.new("ShaderNodeTexImage")
        alpha = settings.pop("alpha", None) if "alpha" in settings else None
        node.image = bpy.data.images[name]
        for key, value in settings.items():
            setattr(node, key, value)
        if vector is not None:
            tree.links.new(vector(tree), node.inputs[0])
        return node.outputs[1 if alpha else 0]

    return build


def cases() -> dict:
    found = {
        f"coordinate {o}": _out("TexCoord", o)
        for o in ("Generated", "Normal", "UV", "Object", "Camera", "Window", "Reflection")
    }
    for output in ("Position", "Normal", "True Normal", "Incoming", "Tangent", "Backfacing"):
        found[f"geometry {output}"] = _out("NewGeometry", output)
    found |= {
        f"object {o}": _out("ObjectInfo", o) for o in ("Location", "Color", "Object Index", "Material Index", "Random")
    }
    found |= {f"camera {o}": _out("CameraData", o) for o in ("View Vector", "View Z Depth", "View Distance")}
    found |= {f"path {o}": _out("LightPath", o) for o in ("Is Camera Ray", "Is Shadow Ray", "Ray Length", "Ray Depth")}
    found["fresnel"] = _with("Fresnel", {"IOR": 1.6})
    found["layer fresnel"] = _with("LayerWeight", {"Blend": 0.3}, 0)
    found["layer facing"] = _with("LayerWeight", {"Blend": 0.3}, 1)
    for axis in "XYZ":
        found[f"tangent {axis}"] = _out("Tangent", 0, direction_type="RADIAL", axis=axis)
    found["tangent uv"] = _out("Tangent", 0, direction_type="UV_MAP", uv_map="UVMap")
    for kind in ("POINT", "VECTOR", "NORMAL"):
        for source, target in (("WORLD", "OBJECT"), ("OBJECT", "WORLD"), ("WORLD", "CAMERA"), ("CAMERA", "OBJECT")):
            found[f"transform {kind} {source} {target}"] = _transform(kind, source, target)
    for space in ("TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD"):
        found[f"normal map {space}"] = _with(
            "NormalMap", {"Color": (0.6, 0.35, 0.9, 1), "Strength": 0.8}, space=space, uv_map="UVMap"
        )
    found["bump"] = _with("Bump", {"Height": _noise(3.0), "Strength": 0.7, "Distance": 0.3})
    found["bump generated"] = _with(
        "Bump", {"Height": _with("TexWave", {"Scale": 1.0}, 1), "Distance": 0.2}, invert=True
    )
    found["attribute"] = _out("Attribute", "Color", attribute_name="UVMap")
    found["attribute vertex"] = _out("Attribute", "Fac", attribute_name="weight")
    found["color attribute"] = _out("VertexColor", "Color", layer_name="paint")
    found["color attribute alpha"] = _out("VertexColor", "Alpha", layer_name="paint")
    found["attribute missing"] = _out("Attribute", "Color", attribute_name="nowhere")
    return found


def fill() -> None:
    """Camera and object, without a material."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    n, m = 24, 12
    u, v = np.meshgrid(np.arange(n + 1) / n, np.arange(m + 1) / m)
    a, b = 2 * np.pi * u, 2 * np.pi * v
    points = np.stack([(1 + 0.4 * np.cos(b)) * np.cos(a), (1 + 0.4 * np.cos(b)) * np.sin(a), 0.4 * np.sin(b)], -1)
    number = np.arange((n + 1) * (m + 1)).reshape(m + 1, n + 1)
    faces = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], -1).reshape(-1, 4)
    mesh = bpy.data.meshes.new("torus")
    mesh.from_pydata(points.reshape(-1, 3).tolist(), [], faces.tolist())
    uv = np.stack([u, v], -1).reshape(-1, 2)
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", uv[faces.reshape(-1)].astype(np.float32).reshape(-1))
    weight = mesh.attributes.new("weight", "FLOAT", "POINT")
    weight.data.foreach_set("value", (uv[:, 0] * 2 - 0.5).astype(np.float32))
    paint = mesh.color_attributes.new("paint", "FLOAT_COLOR", "POINT")
    colors = np.concatenate([uv, 1 - uv], 1).astype(np.float32)
    paint.data.foreach_set("color", colors.reshape(-1))
    mesh.shade_smooth()
    ob = bpy.data.objects.new("torus", mesh)
    ob.location, ob.rotation_euler, ob.scale = (0.3, -0.2, 0.5), (0.4, 0.7, -0.3), (1.2, 0.8, 1.5)
    ob.color, ob.pass_index = (0.2, 0.7, 0.4, 1), 5
    scene.collection.objects.link(ob)
    camera = scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    camera.location, camera.rotation_euler = (2.5, -3.0, 2.2), (1.05, 0.1, 0.7)
    camera.data.lens, camera.data.shift_x = 40, 0.05
    scene.render.resolution_x, scene.render.resolution_y = RESOLUTION
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"


def show(build) -> None:
    """Gives the object a material that emits what `build(tree)` returns."""
    from node_board import positive

    mesh = bpy.data.objects["torus"].data
    mesh.materials.clear()
    material = bpy.data.materials.new("m")
    material.use_nodes, material.pass_index = True, 3
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(positive(tree, build(tree)), emission.inputs[0])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
