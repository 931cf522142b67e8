# SPDX-License-Identifier: Apache-2.0
"""Renders closures with Cycles so that our own can be compared value by value, without noise.

A row of small quads a material, tilted from facing the camera to nearly edge-on. Each is lit by a sun of angle 0, one
render a sun, and sees nothing else, so a pixel is exactly f(wo, wi)|cos| of the material times the sun's irradiance;
the colour passes give the albedos. Materials and results are written for core/tests/test_closure_reference.cpp.

    python blender_tests/closure_reference.py core/tests/closure_reference.inc
"""

from __future__ import annotations

import math
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

COSINES = (1.0, 0.9, 0.7, 0.5, 0.3, 0.15, 0.05)
# World space; the camera looks down -z.
TOWARDS_SUNS = (
    (0.02, 0.01, 1.0),
    (0.6, 0.2, 0.7),
    (-0.5, 0.3, 0.5),
    (0.9, -0.5, 0.1),
    (0.1, 0.2, -1.0),
    (0.6, -0.5, -0.6),
)
SUNS = tuple(tuple(np.array(v) / np.linalg.norm(v)) for v in TOWARDS_SUNS)
PASSES = ("diffuse_color", "glossy_color", "transmission_color", "emission")


def principled(**inputs) -> dict:
    return {"node": "ShaderNodeBsdfPrincipled", "inputs": inputs, "distribution": "MULTI_GGX"}


def node(kind: str, distribution: str = "", **inputs) -> dict:
    return {"node": kind, "inputs": inputs, "distribution": distribution}


# Sockets by Blender's names. "bump": the normal input differs from the geometry's; "rotated": a tangent is given.
GOLD = (1.0, 0.71, 0.29)
MATERIALS: dict[str, dict] = {
    "default": principled(),
    "rough 0": principled(Roughness=0.0, Base_Color=(0.2, 0.5, 0.9)),
    "rough 0.1": principled(Roughness=0.1),
    "rough 0.3": principled(Roughness=0.3, Base_Color=(0.9, 0.2, 0.1)),
    "rough 0.75": principled(Roughness=0.75),
    "rough 1": principled(Roughness=1.0),
    "ior 1.1": principled(IOR=1.1, Roughness=0.4),
    "ior 2.4": principled(IOR=2.4, Roughness=0.4),
    "ior 0.8": principled(IOR=0.8, Roughness=0.4),
    "level": principled(Specular_IOR_Level=0.9, Roughness=0.4),
    "level 0": principled(Specular_IOR_Level=0.0),
    "tint": principled(Specular_Tint=(1.0, 0.3, 0.1), Roughness=0.35),
    "diffuse roughness": principled(Diffuse_Roughness=0.7, Base_Color=(0.8, 0.5, 0.2)),
    "ggx": principled(Roughness=0.8) | {"distribution": "GGX"},
    "alpha": principled(Alpha=0.4),
    "metal": principled(Metallic=1.0, Base_Color=GOLD, Roughness=0.3),
    "metal rough": principled(Metallic=1.0, Base_Color=GOLD, Roughness=0.9),
    "metal edge": principled(Metallic=1.0, Base_Color=GOLD, Roughness=0.45, Specular_Tint=(0.3, 0.5, 0.9)),
    "metal half": principled(Metallic=0.6, Base_Color=GOLD, Roughness=0.6),
    "metal ggx": principled(Metallic=1.0, Base_Color=GOLD, Roughness=0.9) | {"distribution": "GGX"},
    "anisotropic": principled(Metallic=1.0, Anisotropic=0.8, Anisotropic_Rotation=0.1) | {"rotated": True},
    "anisotropic dielectric": principled(Roughness=0.6, Anisotropic=0.5) | {"rotated": True},
    "transmission": principled(Transmission_Weight=1.0, Roughness=0.4, Base_Color=(0.9, 0.6, 0.3)),
    "transmission half": principled(Transmission_Weight=0.5, Roughness=0.7, IOR=1.33, Specular_Tint=(0.5, 0.8, 1.0)),
    "transmission dense": principled(Transmission_Weight=1.0, Roughness=0.6, IOR=2.0),
    "coat": principled(Coat_Weight=1.0, Coat_Roughness=0.2, Base_Color=(0.7, 0.1, 0.1)),
    "coat tint": principled(Coat_Weight=0.7, Coat_Tint=(0.9, 0.5, 0.2), Coat_IOR=1.8, Coat_Roughness=0.5, Metallic=0.5),
    "emission": principled(
        Emission_Color=(1.0, 0.5, 0.25),
        Emission_Strength=2.0,
        Alpha=0.7,
        Coat_Weight=0.8,
        Coat_Tint=(0.5, 0.8, 0.9),
        Sheen_Weight=0.5,
    ),
    "sheen": principled(Sheen_Weight=1.0, Sheen_Roughness=0.5),
    "sheen tint": principled(Sheen_Weight=0.6, Sheen_Roughness=0.25, Sheen_Tint=(0.9, 0.3, 0.5), Coat_Weight=0.3),
    "all": principled(
        Sheen_Weight=0.4, Coat_Weight=0.5, Metallic=0.2, Transmission_Weight=0.4, Alpha=0.9, Diffuse_Roughness=0.3
    ),
    "bump": principled(Roughness=0.4) | {"bump": True},
    "bump metal": principled(Metallic=1.0, Roughness=0.3) | {"bump": True},
    "bump coat": principled(Coat_Weight=1.0, Coat_Roughness=0.3, Roughness=0.6) | {"bump": True},
    "node diffuse": node("ShaderNodeBsdfDiffuse", Color=(0.8, 0.6, 0.3)),
    "node diffuse rough": node("ShaderNodeBsdfDiffuse", Color=(0.8, 0.6, 0.3), Roughness=0.9),
    "node translucent": node("ShaderNodeBsdfTranslucent", Color=(0.8, 0.6, 0.3)),
    "node glossy": node("ShaderNodeBsdfAnisotropic", "MULTI_GGX", Color=GOLD, Roughness=0.6),
    "node glossy ggx": node("ShaderNodeBsdfAnisotropic", "GGX", Color=GOLD, Roughness=0.6),
    "node glossy stretched": node("ShaderNodeBsdfAnisotropic", "GGX", Roughness=0.5, Anisotropy=-0.6, Rotation=0.2)
    | {"rotated": True},
    "node glass": node("ShaderNodeBsdfGlass", "MULTI_GGX", Color=(0.9, 0.7, 0.6), Roughness=0.5, IOR=1.45),
    "node glass rough": node("ShaderNodeBsdfGlass", "MULTI_GGX", Roughness=0.9, IOR=1.7),
    "node glass ggx": node("ShaderNodeBsdfGlass", "GGX", Roughness=0.4, IOR=1.3),
    "node refraction": node("ShaderNodeBsdfRefraction", "GGX", Color=(0.9, 0.7, 0.6), Roughness=0.4, IOR=1.5),
    "node sheen": node("ShaderNodeBsdfSheen", "MICROFIBER", Color=(0.9, 0.7, 0.6), Roughness=0.7),
    "node sheen smooth": node("ShaderNodeBsdfSheen", "MICROFIBER", Roughness=0.1),
    "node metal f82": node("ShaderNodeBsdfMetallic", "MULTI_GGX", Base_Color=GOLD, Edge_Tint=(0.6, 0.7, 0.9))
    | {"fresnel": "F82"},
    "node metal physical": node(
        "ShaderNodeBsdfMetallic", "MULTI_GGX", IOR=(0.2, 0.9, 1.4), Extinction=(3.0, 2.4, 1.8), Roughness=0.4
    )
    | {"fresnel": "PHYSICAL_CONDUCTOR"},
    "node toon": node("ShaderNodeBsdfToon", "DIFFUSE", Size=0.5, Smooth=0.3),
    "node toon glossy": node("ShaderNodeBsdfToon", "GLOSSY", Size=0.3, Smooth=0.4),
}

TANGENT = np.array((0.3, 0.8, -0.4))
BUMP = np.array((0.25, -0.35, 0.0))


def quad_normal(cosine: float) -> np.ndarray:
    return np.array((math.sqrt(1.0 - cosine * cosine), 0.0, cosine))


def make_material(name: str, spec: dict) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    bsdf = tree.nodes.new(spec["node"])
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(bsdf.outputs[0], output.inputs["Surface"])
    if spec.get("distribution"):
        attribute = "component" if spec["node"] == "ShaderNodeBsdfToon" else "distribution"
        setattr(bsdf, attribute, spec["distribution"])
    if "fresnel" in spec:
        bsdf.fresnel_type = spec["fresnel"]
    for key, value in spec["inputs"].items():
        socket = bsdf.inputs[key.replace("_", " ")]
        socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
    for wanted, attribute, socket in (("bump", "bumped", "Normal"), ("rotated", "along", "Tangent")):
        if spec.get(wanted):
            link_attribute(tree, attribute, "Vector", bsdf.inputs[socket])
    return material


def link_attribute(tree: bpy.types.NodeTree, name: str, output: str, socket: bpy.types.NodeSocket) -> None:
    read = tree.nodes.new("ShaderNodeAttribute")
    read.attribute_name = name
    tree.links.new(read.outputs[output], socket)


def make_scene(normals: np.ndarray, attributes: dict[str, np.ndarray], materials: dict[str, dict]) -> bpy.types.Scene:
    """A quad in the middle of each pixel of an orthographic camera that looks down.

    normals: (rows, columns, 3), unit. attributes: (rows, columns) or (rows, columns, 3), one value a quad. materials:
    one, or one a row from the bottom.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    height, width = normals.shape[:2]
    vertices = []
    for row, column in np.ndindex(height, width):
        n = normals[row, column]
        x = np.array((n[2], 0.0, -n[0])) / np.hypot(n[0], n[2])
        x *= 0.4 / x[0]
        y = np.cross(n, x)
        y *= 0.4 / y[1]
        center = np.array((column + 0.5, row + 0.5, 0.0))
        vertices += [center + i * x + j * y for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    faces = np.arange(len(vertices)).reshape(-1, 4)
    mesh = bpy.data.meshes.new("quads")
    mesh.from_pydata([tuple(v) for v in vertices], [], faces.tolist())
    for name, values in attributes.items():
        vector = values.ndim == 3
        attribute = mesh.attributes.new(name, "FLOAT_VECTOR" if vector else "FLOAT", "FACE")
        attribute.data.foreach_set("vector" if vector else "value", np.asarray(values, np.float32).ravel())
    for name, spec in materials.items():
        mesh.materials.append(make_material(name, spec))
    if len(materials) > 1:
        mesh.polygons.foreach_set("material_index", np.repeat(np.arange(height, dtype=np.int32), width))
    quads = bpy.data.objects.new("quads", mesh)
    for ray in ("diffuse", "glossy", "transmission", "shadow", "volume_scatter"):
        setattr(quads, f"visible_{ray}", False)  # quads neither shade nor see each other
    scene.collection.objects.link(quads)

    camera = bpy.data.cameras.new("camera")
    camera.type = "ORTHO"
    camera.ortho_scale = max(width, height)
    placed = bpy.data.objects.new("camera", camera)
    placed.location = (width / 2, height / 2, 50.0)
    scene.collection.objects.link(placed)
    scene.camera = placed

    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = 1.0
    sun.angle = 0.0
    scene.collection.objects.link(bpy.data.objects.new("sun", sun))

    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = False
    cycles = scene.cycles
    cycles.samples = 1
    cycles.use_denoising = False
    cycles.use_adaptive_sampling = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 0.01
    cycles.light_sampling_threshold = 0.0
    cycles.blur_glossy = 0.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    layer = scene.view_layers[0]
    layer.use_pass_diffuse_color = layer.use_pass_glossy_color = layer.use_pass_transmission_color = True
    layer.use_pass_emit = True
    return scene


def point_sun(direction: tuple[float, ...]) -> None:
    from mathutils import Vector

    # A sun shines along its -Z.
    bpy.data.objects["sun"].rotation_mode = "QUATERNION"
    bpy.data.objects["sun"].rotation_quaternion = Vector(direction).to_track_quat("Z", "Y")


def render(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """The passes of the active scene, each (height, width, 3), bottom row first."""
    import OpenEXR

    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "closures.exr")
        settings = scene.render.image_settings
        settings.media_type = "MULTI_LAYER_IMAGE"
        settings.file_format = "OPEN_EXR_MULTILAYER"
        settings.color_depth = "32"
        bpy.ops.render.render(write_still=True)
        found: dict[str, dict[str, np.ndarray]] = {}
        for part in OpenEXR.File(scene.render.filepath, separate_channels=True).parts:  # a part a pass
            for key, channel in part.channels.items():
                _, name, component = key.split(".")
                found.setdefault(name, {})[component] = np.array(channel.pixels)[::-1]
    wanted = {"combined": "Combined", "diffuse_color": "Diffuse Color", "glossy_color": "Glossy Color",
              "transmission_color": "Transmission Color", "emission": "Emission"}  # fmt: skip
    return {ours: np.stack([found[theirs][c] for c in "RGB"], -1).astype(np.float64) for ours, theirs in wanted.items()}


def measure(materials: dict[str, dict]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Albedo passes (materials, cosines, 3) by name, and values (suns, materials, cosines, 3) of f|cos|."""
    normals = np.broadcast_to([quad_normal(c) for c in COSINES], (len(materials), len(COSINES), 3))
    bumped = normals + BUMP
    bumped /= np.linalg.norm(bumped, axis=-1, keepdims=True)
    scene = make_scene(normals, {"bumped": bumped, "along": np.broadcast_to(TANGENT, normals.shape)}, materials)
    values = []
    for direction in SUNS:
        point_sun(direction)
        passes = render(scene)
        values.append(passes["combined"] - passes["emission"])
    return {name: passes[name] for name in PASSES}, np.stack(values)


def cpp_value(value) -> str:
    if isinstance(value, tuple):
        return "vec3(" + ", ".join(f"{v:.9g}f" if "." in f"{v:.9g}" else f"{v:.1f}f" for v in value) + ")"
    return f"{value:.9g}f" if "." in f"{value:.9g}" or "e" in f"{value:.9g}" else f"{value:.1f}f"


def write_inc(path: Path) -> None:
    albedo, values = measure(MATERIALS)
    lines = [
        "// SPDX-License-Identifier: Apache-2.0",
        f"// Written by blender_tests/closure_reference.py with Blender {bpy.app.version_string}; not to be edited.",
        "static const float kCosines[] = {" + ", ".join(cpp_value(c) for c in COSINES) + "};",
        "static const vec3 kSuns[] = {" + ", ".join(cpp_value(tuple(s)) for s in SUNS) + "};",
        f"static const vec3 kTangent = {cpp_value(tuple(TANGENT))}, kBump = {cpp_value(tuple(BUMP))};",
        "// Name, node, distribution, flags, inputs; per cosine: three colours, emission, f|cos| per sun.",
        "static const Reference kReferences[] = {",
    ]
    for row, (name, spec) in enumerate(MATERIALS.items()):
        kind = spec["node"].removeprefix("ShaderNodeBsdf") + spec.get("fresnel", "").split("_")[0].title()
        vectors = {k: v if isinstance(v, tuple) else (v, v, v) for k, v in spec["inputs"].items()}
        inputs = ", ".join(f'{{"{k}", {cpp_value(v)}}}' for k, v in vectors.items())
        flags = f"{str(spec.get('bump', False)).lower()}, {str(spec.get('rotated', False)).lower()}"
        lines.append(f'  {{"{name}", "{kind}", "{spec.get("distribution", "")}", {flags}, {{{inputs}}}, {{')
        for column in range(len(COSINES)):
            numbers = [albedo[p][row, column] for p in PASSES] + [values[s, row, column] for s in range(len(SUNS))]
            lines.append("    " + " ".join(f"{v:.7g}," for v in np.concatenate(numbers)))
        lines.append("  }},")
    lines.append("};")
    path.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    write_inc(Path(sys.argv[1]))
