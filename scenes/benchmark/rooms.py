# SPDX-License-Identifier: Apache-2.0
"""Rooms in rows, joined by doorways, lit only by emissive spheres: few of the lights matter at any one point."""

import math

import bpy
import numpy as np
import surfaces

SIDE, HEIGHT, WALL, DOOR = 6.0, 3.2, 0.2, 1.4  # metres


def build(scene, lights: int, seed: int) -> None:
    """`lights` emissive spheres (one mesh a colour) spread evenly over enough rooms for about twelve each."""
    rng = np.random.default_rng(seed)
    images = surfaces.Images()
    columns = max(2, math.ceil(math.sqrt(lights / 12)))
    floor = surfaces.principled("Boards", color_image=images.checks, roughness_image=images.roughness)
    paint = surfaces.principled("Paint", color=(0.7, 0.68, 0.62), Roughness=0.8)
    things = surfaces.row(images)
    extent = columns * SIDE
    for name, z, material in (("Floor", 0.0, floor), ("Ceiling", HEIGHT, paint)):
        bpy.ops.mesh.primitive_plane_add(size=extent, location=(0, extent / 2, z))
        bpy.context.object.name = name
        bpy.context.object.data.materials.append(material)
    _walls(scene, columns, paint)
    bpy.ops.mesh.primitive_monkey_add(size=1.2)
    head = bpy.context.object
    head.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    evaluated = head.evaluated_get(bpy.context.evaluated_depsgraph_get())
    base = bpy.data.meshes.new_from_object(evaluated)
    bpy.data.objects.remove(head)
    base.shade_smooth()
    meshes = []
    for material in things:
        mesh = base.copy()
        mesh.materials.clear()
        mesh.materials.append(material)
        meshes.append(mesh)
    for row in range(columns):
        for column in range(columns):
            corner = np.array([(column - columns / 2) * SIDE, row * SIDE])
            for _ in range(3):
                thing = bpy.data.objects.new("Head", meshes[int(rng.integers(len(meshes)))])
                thing.location = (*(corner + rng.uniform(1.2, SIDE - 1.2, 2)), 0.6)
                thing.rotation_euler = (0, 0, float(rng.uniform(-math.pi, math.pi)))
                scene.collection.objects.link(thing)
    spheres = [_sphere(i) for i in range(8)]
    for i in range(lights):
        room = i % columns**2
        corner = np.array([(room % columns - columns / 2) * SIDE, room // columns * SIDE])
        sphere = bpy.data.objects.new("Lamp", spheres[int(rng.integers(len(spheres)))])
        sphere.location = (*(corner + rng.uniform(0.5, SIDE - 0.5, 2)), float(rng.uniform(1.8, HEIGHT - 0.3)))
        sphere.scale = (float(rng.uniform(0.5, 1.5)),) * 3
        scene.collection.objects.link(sphere)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = ((0.5 - columns % 2 / 2) * SIDE, 0.4, 1.6)
    camera.rotation_euler = (math.radians(86), 0, math.radians(-8))
    camera.data.lens = 22
    scene.collection.objects.link(camera)
    scene.camera = camera


def _sphere(i: int):
    bpy.ops.mesh.primitive_ico_sphere_add(radius=0.08, subdivisions=2)
    made = bpy.context.object
    mesh = made.data
    bpy.data.objects.remove(made)
    mesh.shade_smooth()
    mesh.materials.append(surfaces.emitter(f"Glow {i}", surfaces.hue(i / 8, 0.35, 1.0), 40.0 + 20.0 * (i % 3)))
    return mesh


def _walls(scene, columns: int, material) -> None:
    """Walls along both directions with a doorway in the middle of every room's side; none where the outside is."""
    pieces = []
    extent = columns * SIDE
    for line in range(columns + 1):
        for room in range(columns):
            outer = line in (0, columns)
            start, at = room * SIDE, line * SIDE
            gap = 0.0 if outer else DOOR
            spans = [(start, start + SIDE / 2 - gap / 2, 0.0), (start + SIDE / 2 + gap / 2, start + SIDE, 0.0)]
            if gap:
                spans.append((start + SIDE / 2 - gap / 2, start + SIDE / 2 + gap / 2, 2.2))
            for a, b, low in spans:
                pieces.append(((a, at - WALL / 2, low), (b, at + WALL / 2, HEIGHT)))
                pieces.append(((at - WALL / 2, a, low), (at + WALL / 2, b, HEIGHT)))
    vertices, faces = [], []
    for low, high in pieces:
        base = len(vertices)
        vertices += [
            ((low, high)[i & 1][0] - extent / 2, (low, high)[i >> 1 & 1][1], (low, high)[i >> 2][2]) for i in range(8)
        ]
        quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
        faces += [tuple(base + i for i in quad) for quad in quads]
    mesh = bpy.data.meshes.new("Walls")
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new("Walls", mesh))
