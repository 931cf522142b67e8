# SPDX-License-Identifier: Apache-2.0
"""Rooms in rows, joined by doorways, lit only by emissive spheres: few of the lights matter at any one point."""

import math

import bpy
import numpy as np
import spread
import surfaces
from mathutils import Matrix

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
    if 3 * columns**2 > spread.OBJECTS:
        corners = _corners(np.repeat(np.arange(columns**2), 3), columns)
        places = np.column_stack([corners + rng.uniform(1.2, SIDE - 1.2, corners.shape), np.full(len(corners), 0.6)])
        turns = [Matrix.Rotation(turn, 4, "Z") for turn in rng.uniform(-math.pi, math.pi, 4 * len(meshes))]
        heads = [[(meshes[i % len(meshes)], turn)] for i, turn in enumerate(turns)]
        spread.spread(scene, "Head", heads, rng.integers(len(heads), size=len(places)), places)
    else:
        for room in range(columns**2):
            corner = _corners(room, columns)
            for _ in range(3):
                thing = bpy.data.objects.new("Head", meshes[int(rng.integers(len(meshes)))])
                thing.location = (*(corner + rng.uniform(1.2, SIDE - 1.2, 2)), 0.6)
                thing.rotation_euler = (0, 0, float(rng.uniform(-math.pi, math.pi)))
                scene.collection.objects.link(thing)
    spheres = [_sphere(i) for i in range(8)]
    if lights > spread.OBJECTS:
        _instanced_lamps(scene, spheres, lights, columns, rng)
    else:
        for i in range(lights):
            room = i % columns**2
            corner = _corners(room, columns)
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


def _corners(rooms, columns: int):
    """(..., 2) corner of each room, metres."""
    return np.stack([(rooms % columns - columns / 2) * SIDE, rooms // columns * SIDE], -1)


def _instanced_lamps(scene, spheres, lights: int, columns: int, rng) -> None:
    """Lamps as above, but instanced and of five sizes."""
    corners = _corners(np.arange(lights) % columns**2, columns)
    low, high = (0.5, 0.5, 1.8), (SIDE - 0.5, SIDE - 0.5, HEIGHT - 0.3)
    places = rng.uniform(low, high, (lights, 3))
    places[:, :2] += corners
    sizes = [Matrix.Diagonal((size, size, size, 1.0)) for size in np.linspace(0.5, 1.5, 5)]
    lamps = [[(sphere, size)] for sphere in spheres for size in sizes]
    spread.spread(scene, "Lamp", lamps, rng.integers(len(lamps), size=lights), places)


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
    extent = columns * SIDE
    line, room = (n.ravel() for n in np.mgrid[0 : columns + 1, 0:columns])
    gap = np.where((line == 0) | (line == columns), 0.0, DOOR)
    start, middle, at = room * SIDE, room * SIDE + SIDE / 2, line * SIDE
    zero = np.zeros(len(line))
    low, high = [], []
    for a, b, bottom, kept in (
        (start, middle - gap / 2, zero, slice(None)),
        (middle + gap / 2, start + SIDE, zero, slice(None)),
        (middle - gap / 2, middle + gap / 2, zero + 2.2, gap > 0),  # over the doorway
    ):
        for x0, x1, y0, y1 in ((a, b, at - WALL / 2, at + WALL / 2), (at - WALL / 2, at + WALL / 2, a, b)):
            low.append(np.stack([x0 - extent / 2, y0, bottom], 1)[kept])
            high.append(np.stack([x1 - extent / 2, y1, zero + HEIGHT], 1)[kept])
    mesh = spread.boxes("Walls", np.concatenate(low), np.concatenate(high), material)
    scene.collection.objects.link(bpy.data.objects.new("Walls", mesh))
