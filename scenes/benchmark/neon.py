# SPDX-License-Identifier: Apache-2.0
"""A wet street between walls full of neon tubes: glossy reflections of small, coloured, bent emitters."""

import math

import bpy
import numpy as np
import spread
import surfaces
from mathutils import Matrix

LENGTH, WIDTH, HEIGHT = 60.0, 9.0, 8.0  # metres, of the street and its walls


def build(scene, lights: int, seed: int) -> None:
    """`lights` neon tubes (64 to 192 triangles each) on both walls. Above 200 they become smaller, so that their area
    together stays the same."""
    rng = np.random.default_rng(seed)
    images = surfaces.Images()
    floor = surfaces.principled("Wet asphalt", color=(0.02, 0.02, 0.025), Roughness=0.12, normal_image=images.normal)
    bumps = next(node for node in floor.node_tree.nodes if node.bl_idname == "ShaderNodeNormalMap")
    bumps.inputs["Strength"].default_value = 0.12
    bpy.ops.mesh.primitive_plane_add(size=1, location=(0, LENGTH / 2, 0))
    plane = bpy.context.object
    plane.scale = (WIDTH, LENGTH, 1)
    plane.data.materials.append(floor)
    for loop in plane.data.uv_layers.active.uv:
        loop.vector = (loop.vector[0] * WIDTH / 4, loop.vector[1] * LENGTH / 4)
    wall = surfaces.principled("Plaster", color=(0.35, 0.33, 0.32), Roughness=0.75)
    side = WIDTH / 2
    low = [(-side - 0.3, 0, 0), (side, 0, 0), (-side, LENGTH, 0)]
    high = [(-side, LENGTH, HEIGHT), (side + 0.3, LENGTH, HEIGHT), (side, LENGTH + 0.3, HEIGHT)]
    walls = bpy.data.objects.new("Walls", spread.boxes("Walls", low, high, wall))
    scene.collection.objects.link(walls)
    size = min(1.0, math.sqrt(200 / max(lights, 1)))
    left = rng.random(lights) < 0.5
    places = rng.uniform((0, 1.5, 1.2), (0, LENGTH - 1, HEIGHT - 1), (lights, 3))
    places[:, 0] = np.where(left, -side + 0.12, side - 0.12)
    tubes = []
    for turn in (math.pi / 2, -math.pi / 2):  # signs face the street
        tubes += [[(mesh, Matrix.Rotation(turn, 4, "Z") @ Matrix.Scale(size, 4))] for mesh in _signs(rng)]
    which = rng.integers(len(tubes) // 2, size=lights) + np.where(left, 0, len(tubes) // 2)
    spread.spread(scene, "Neon", tubes, which, places)
    _things(scene, images, rng)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (-0.8, -3.5, 1.7)
    camera.rotation_euler = (math.radians(86), 0, math.radians(-2))
    camera.data.lens = 26
    scene.collection.objects.link(camera)
    scene.camera = camera


def _signs(rng) -> list:
    """Eighteen tubes: rings, zigzags and bars in six colours."""
    signs = []
    for i in range(18):
        t = np.linspace(0, 1, 25)
        if i % 3 == 0:
            points = np.stack([0.4 * np.cos(2 * math.pi * t), 0 * t, 0.4 * np.sin(2 * math.pi * t)], 1)
        elif i % 3 == 1:
            points = np.stack([1.2 * t - 0.6, 0 * t, 0.25 * np.abs((t * 6) % 2 - 1)], 1)
        else:
            points = np.stack([1.6 * t - 0.8, 0 * t, 0 * t], 1)[::3]
        colour = surfaces.hue(i / 18 + float(rng.uniform(0, 0.05)), 0.85, 1.0)
        signs.append(_tube(f"Neon {i}", points, 0.025, surfaces.emitter(f"Neon {i}", colour, 30.0)))
    return signs


def _tube(name: str, points, radius: float, material):
    """A tube of four sides along points in the XZ plane."""
    along = np.gradient(points, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.stack([-along[:, 2], 0 * along[:, 0], along[:, 0]], 1)
    out = np.array([0.0, 1.0, 0.0])
    rings = np.stack([points + radius * d for d in (across, out, -across, -out)], 1)  # (P, 4, 3)
    faces = [
        (4 * i + k, 4 * i + (k + 1) % 4, 4 * i + 4 + (k + 1) % 4, 4 * i + 4 + k)
        for i in range(len(points) - 1)
        for k in range(4)
    ]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(rings.reshape(-1, 3).tolist(), [], faces)
    mesh.shade_smooth()
    mesh.materials.append(material)
    return mesh


def _things(scene, images, rng) -> None:
    """Bins, balls and blocks at the sides of the street."""
    materials = surfaces.row(images)
    bpy.ops.mesh.primitive_cylinder_add(radius=0.35, depth=1.0, vertices=48, location=(0, 0, 0))
    bin_ = spread.taken(bpy.context.object)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.45, segments=48, ring_count=24, location=(0, 0, 0))
    ball = spread.taken(bpy.context.object)
    ball.shade_smooth()
    things = []
    for i, material in enumerate(materials):
        mesh, z = ((bin_, 0.5), (ball, 0.45))[i % 2]
        mesh = mesh.copy()
        mesh.materials.append(material)
        things.append([(mesh, Matrix.Translation((0, 0, z)))])
    y = np.arange(24) * 2.2 + 1.5
    x = np.where(np.arange(24) % 2, 1, -1) * rng.uniform(2.2, 3.8, 24)
    spread.spread(scene, "Thing", things, np.arange(24) % len(things), np.column_stack([x, y, 0 * y]))
