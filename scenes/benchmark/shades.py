# SPDX-License-Identifier: Apache-2.0
"""A hall hung with lamps in shades of cloth, paper and metal: what a lamp gives depends on what is around it."""

import math

import bpy
import numpy as np
import spread
import surfaces
from mathutils import Matrix

SPACING, HEIGHT = 2.2, 4.0  # metres, between lamps; of the ceiling
THINGS = 240  # heads and solids, on the floor in front of the camera


def build(scene, lights: int, seed: int) -> None:
    """`lights` point lamps, one in each shade, in a hall that grows with them."""
    rng = np.random.default_rng(seed)
    images = surfaces.Images()
    columns = max(4, math.ceil(math.sqrt(lights)))
    rows = max(4, math.ceil(lights / columns))
    width, depth = columns * SPACING, rows * SPACING
    paint = surfaces.principled("Paint", color=(0.6, 0.57, 0.5), Roughness=0.8)
    boards = surfaces.principled("Boards", color_image=images.checks, roughness_image=images.roughness)
    for name, low, high, material in (
        ("Floor", [(-width / 2, 0, -0.2)], [(width / 2, depth, 0)], boards),
        ("Ceiling", [(-width / 2, 0, HEIGHT)], [(width / 2, depth, HEIGHT + 0.2)], paint),
        (
            "Walls",
            [(-width / 2 - 0.2, 0, 0), (width / 2, 0, 0), (-width / 2, -0.2, 0), (-width / 2, depth, 0)],
            [(-width / 2, depth, HEIGHT), (width / 2 + 0.2, depth, HEIGHT)]
            + [(width / 2, 0, HEIGHT), (width / 2, depth + 0.2, HEIGHT)],
            paint,
        ),
    ):
        mesh = spread.boxes(name, low, high, material)
        if name == "Floor":
            _map(mesh, width, depth)
        scene.collection.objects.link(bpy.data.objects.new(name, mesh))
    _things(scene, images, rng, width, depth)
    order = np.arange(lights)
    places = np.column_stack(
        [
            (order % columns + 0.5 - columns / 2) * SPACING + rng.uniform(-0.5, 0.5, lights),
            (order // columns + 0.5) * SPACING + rng.uniform(-0.5, 0.5, lights),
            rng.uniform(1.7, 2.9, lights),
        ]
    )
    kinds = _kinds(rng)
    spread.spread(scene, "Lamp", kinds, rng.integers(len(kinds), size=lights), places)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0.4, 1.9)
    camera.rotation_euler = (math.radians(84), 0, math.radians(4))
    camera.data.lens = 24
    scene.collection.objects.link(camera)
    scene.camera = camera


def _map(mesh, width: float, depth: float) -> None:
    """UVs of the floor: one tile of its images every four metres."""
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.attributes["position"].data.foreach_get("vector", points)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    uvs = points.reshape(-1, 3)[corners, :2] / 4
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.ascontiguousarray(uvs).ravel())


def _things(scene, images, rng, width: float, depth: float) -> None:
    bpy.ops.mesh.primitive_monkey_add(size=1.0)
    head = bpy.context.object
    head.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    base = bpy.data.meshes.new_from_object(head.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    bpy.data.objects.remove(head)
    base.shade_smooth()
    bpy.ops.mesh.primitive_cylinder_add(radius=0.4, depth=1.1, vertices=48, location=(0, 0, 0))
    solid = spread.taken(bpy.context.object)
    things = []
    for i, material in enumerate(surfaces.row(images)):
        mesh = (base if i % 2 else solid).copy()
        mesh.materials.clear()
        mesh.materials.append(material)
        things.append([(mesh, Matrix.Translation((0, 0, 0.5 if i % 2 else 0.55)))])
    low, high = (-min(width / 2 - 1, 12), 1.5, 0), (min(width / 2 - 1, 12), min(depth - 1, 28), 0)
    count = min(THINGS, int(width * depth / 3))
    spread.spread(scene, "Thing", things, rng.integers(len(things), size=count), rng.uniform(low, high, (count, 3)))


def _kinds(rng) -> list:
    """Twenty lamps with their shades, around the lamp."""
    kinds = []
    for i in range(20):
        form = ("drum", "globe", "cone", "drum")[i % 4]
        tint = surfaces.hue(0.06 + 0.5 * rng.random() * (i % 3 == 0), float(rng.uniform(0.1, 0.5)), 0.9)
        if form == "globe":
            bpy.ops.mesh.primitive_uv_sphere_add(radius=0.28, segments=24, ring_count=12, location=(0, 0, 0))
            mesh = spread.taken(bpy.context.object)
            mesh.shade_smooth()
            mesh.materials.append(_cloth(f"Paper {i}", tint, 0.6))
        elif form == "drum":
            mesh = _tube("Drum", 0.26, 0.22, 0.34, _cloth(f"Cloth {i}", tint, 0.45))
        else:
            metal = surfaces.principled(f"Tin {i}", color=tint, Metallic=1.0, Roughness=0.35)
            mesh = _tube("Cone", 0.3, 0.05, 0.22, metal)
        lamp = bpy.data.lights.new("Bulb", "POINT")
        lamp.energy, lamp.shadow_soft_size = float(rng.uniform(15, 45)), 0.04
        lamp.color = surfaces.hue(float(rng.uniform(0.06, 0.12)), float(rng.uniform(0.2, 0.5)), 1.0)
        kinds.append([(mesh, Matrix.Identity(4)), (lamp, Matrix.Identity(4))])
    return kinds


def _tube(name: str, bottom: float, top: float, height: float, material):
    """The side of a truncated cone about the origin, open at both ends; radii and height in metres."""
    count = 32
    angles = np.arange(count) * 2 * math.pi / count
    ring = np.stack([np.cos(angles), np.sin(angles)], 1)
    vertices = [(*(bottom * p), -height / 2) for p in ring] + [(*(top * p), height / 2) for p in ring]
    faces = [(i, (i + 1) % count, count + (i + 1) % count, count + i) for i in range(count)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.shade_smooth()
    mesh.materials.append(material)
    return mesh


def _cloth(name: str, color, through: float):
    """Thin cloth: `through` of the light it scatters leaves on the other side."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    out, mix = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeMixShader")
    mix.inputs["Fac"].default_value = through
    for socket, kind in ((1, "ShaderNodeBsdfDiffuse"), (2, "ShaderNodeBsdfTranslucent")):
        node = tree.nodes.new(kind)
        node.inputs["Color"].default_value = (*color, 1.0)
        tree.links.new(node.outputs["BSDF"], mix.inputs[socket])
    tree.links.new(mix.outputs["Shader"], out.inputs["Surface"])
    return material
