# SPDX-License-Identifier: Apache-2.0
"""A hundred objects, forty of them subdivided heads, on a floor under a few large area lamps."""

import math

import bpy
import numpy as np
import surfaces


def build(scene, lights: int, seed: int) -> None:
    """`lights` area lamps in a ring above the objects; their power together does not depend on their number."""
    objects(scene, seed)
    for i in range(lights):
        angle = 2 * math.pi * (i + 0.5) / lights
        data = bpy.data.lights.new("Area", "AREA")
        data.energy = 6000.0 / lights
        data.color = surfaces.hue(0.08 + 0.5 * i / lights, 0.25, 1.0)
        data.shape = ("SQUARE", "RECTANGLE", "DISK", "ELLIPSE")[i % 4]
        data.size, data.size_y = 3.0, 1.5
        lamp = bpy.data.objects.new("Area", data)
        lamp.location = (11 * math.cos(angle), 11 + 11 * math.sin(angle), 8)
        lamp.rotation_euler = (math.radians(45), 0, angle + math.pi / 2)
        scene.collection.objects.link(lamp)


def objects(scene, seed: int) -> None:
    """The floor, what stands on it, and the camera."""
    rng = np.random.default_rng(seed)
    images = surfaces.Images()
    materials = surfaces.row(images)
    bpy.ops.mesh.primitive_plane_add(size=60)
    bpy.context.object.data.materials.append(
        surfaces.principled("Floor", color_image=images.checks, roughness_image=images.roughness)
    )
    places = [(x * 2.6, y * 2.6) for y in range(10) for x in range(-5, 5)]
    order = rng.permutation(len(places))
    heads = set(order[:40].tolist())
    for number, (x, y) in enumerate(places):
        at = (x + rng.uniform(-0.4, 0.4), y + rng.uniform(-0.4, 0.4))
        turn = rng.uniform(-0.9, 0.9)
        if number in heads:
            bpy.ops.mesh.primitive_monkey_add(size=1.9, location=(*at, 0.95), rotation=(0, 0, turn))
            modifier = bpy.context.object.modifiers.new("Subdivision", "SUBSURF")
            modifier.levels, modifier.render_levels = 1, 2
            bpy.ops.object.shade_smooth()
        else:
            _solid(number % 4, at, turn)
        bpy.context.object.data.materials.append(materials[int(rng.integers(len(materials)))])
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, -13, 7.5)
    camera.rotation_euler = (math.radians(69), 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera


def _solid(kind: int, at, turn: float) -> None:
    if kind == 0:
        bpy.ops.mesh.primitive_cube_add(size=1.3, location=(*at, 0.65), rotation=(0, 0, turn))
    elif kind == 1:
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8, segments=48, ring_count=24, location=(*at, 0.8))
        bpy.ops.object.shade_smooth()
    elif kind == 2:
        bpy.ops.mesh.primitive_cylinder_add(radius=0.6, depth=1.6, vertices=48, location=(*at, 0.8))
    else:
        bpy.ops.mesh.primitive_torus_add(
            major_radius=0.7, minor_radius=0.28, major_segments=64, minor_segments=24, location=(*at, 0.28)
        )
        bpy.ops.object.shade_smooth()
