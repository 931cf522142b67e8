# SPDX-License-Identifier: Apache-2.0
"""A town at night: blocks of buildings with window recesses, and a great many lamps along its streets."""

import math

import bpy
import numpy as np
import spread
import surfaces
from mathutils import Euler

BLOCKS = 8  # a side
BLOCK, STREET = 14.0, 8.0  # metres
STEP = BLOCK + STREET


def build(scene, lights: int, seed: int) -> None:
    """`lights` lamps: three fifths points, a quarter spots, the rest areas; many small ones, a few strong ones.

    Their power together does not depend on their number; above 1,000, neither does the area in which they are seen.
    """
    rng = np.random.default_rng(seed)
    extent = town(scene, rng)
    power, size = 1000 / max(lights, 1), min(1.0, math.sqrt(1000 / max(lights, 1)))
    if lights > spread.OBJECTS:
        kinds = [_lamp(i, rng, power, size) for i in range(100)]
        order = np.arange(lights)
        lamps = [[(data, Euler(turn).to_matrix().to_4x4())] for data, turn, _ in kinds]
        where = np.column_stack([places(order, rng, extent), rng.uniform(2.5, 5.5, lights)])
        spread.spread(scene, "Lamp", lamps, order % len(lamps), where)
    else:
        for i in range(lights):
            where = places(i, rng, extent)
            data, turn, height = _lamp(i, rng, power, size)
            lamp = bpy.data.objects.new(data.name, data)
            lamp.location, lamp.rotation_euler = (*where, height), turn
            scene.collection.objects.link(lamp)
    look(scene)


def town(scene, rng) -> float:
    """Ground and houses; streets lie around the blocks. Returns the side of the town, metres: x within half of it, y
    from 0."""
    images = surfaces.Images()
    extent = BLOCKS * STEP
    bpy.ops.mesh.primitive_plane_add(size=extent * 2, location=(0, extent / 2, 0))
    bpy.context.object.data.materials.append(
        surfaces.principled("Asphalt", color=(0.12, 0.12, 0.13), roughness_image=images.roughness)
    )
    walls = [
        surfaces.principled("Stone", color_image=images.marble, Roughness=0.7),
        surfaces.principled("Brick", color=(0.45, 0.2, 0.14), Roughness=0.85, normal_image=images.normal),
        surfaces.principled("Paint", color=(0.75, 0.7, 0.55), Roughness=0.5),
        surfaces.principled("Tiles", color_image=images.checks, Roughness=0.2, Coat_Weight=0.5),
        surfaces.principled("Metal", color=(0.5, 0.55, 0.6), Metallic=1.0, roughness_image=images.roughness),
    ]
    kinds = [_house(storeys, walls[storeys % len(walls)]) for storeys in (3, 4, 5, 7, 9)]
    for by in range(BLOCKS):
        for bx in range(BLOCKS):
            for quarter in range(4):
                x = (bx - BLOCKS / 2) * STEP + STREET / 2 + BLOCK * (0.25 + 0.5 * (quarter % 2))
                y = by * STEP + STREET / 2 + BLOCK * (0.25 + 0.5 * (quarter // 2))
                house = bpy.data.objects.new("House", kinds[int(rng.integers(len(kinds)))])
                house.location = (x, y, 0)
                house.rotation_euler = (0, 0, math.pi / 2 * int(rng.integers(4)))
                scene.collection.objects.link(house)
    return extent


def look(scene) -> None:
    """The camera, above the town's edge."""
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (3, -34, 27)
    camera.rotation_euler = (math.radians(66), 0, math.radians(3))
    camera.data.lens = 30
    scene.collection.objects.link(camera)
    scene.camera = camera


def _house(storeys: int, material):
    """A block of 6.6 m a side whose walls have a window recess every 1.65 m; the mesh is shared by its instances."""
    side, storey, columns, depth = 6.6, 3.0, 4, 0.25
    vertices, faces = [], []

    def quad(*points):
        base = len(vertices)
        vertices.extend(points)
        faces.append(tuple(range(base, base + 4)))

    width = side / columns
    for turn in range(4):
        c, s = round(math.cos(turn * math.pi / 2)), round(math.sin(turn * math.pi / 2))

        def at(u, z, d=0.0, c=c, s=s):
            x, y = u - side / 2, d - side / 2
            return (c * x - s * y, s * x + c * y, z)

        for level in range(storeys):
            for column in range(columns):
                u0, u1, z0, z1 = column * width, (column + 1) * width, level * storey, (level + 1) * storey
                a, b, m, n = u0 + 0.35, u1 - 0.35, z0 + 0.8, z1 - 0.5
                quad(at(u0, z0), at(u1, z0), at(u1, m), at(u0, m))
                quad(at(u0, n), at(u1, n), at(u1, z1), at(u0, z1))
                quad(at(u0, m), at(a, m), at(a, n), at(u0, n))
                quad(at(b, m), at(u1, m), at(u1, n), at(b, n))
                quad(at(a, m), at(b, m), at(b, m, depth), at(a, m, depth))
                quad(at(a, n, depth), at(b, n, depth), at(b, n), at(a, n))
                quad(at(a, m), at(a, m, depth), at(a, n, depth), at(a, n))
                quad(at(b, m, depth), at(b, m), at(b, n), at(b, n, depth))
                quad(at(a, m, depth), at(b, m, depth), at(b, n, depth), at(a, n, depth))
    top, h = storeys * storey, side / 2
    quad((-h, -h, top), (h, -h, top), (h, h, top), (-h, h, top))
    mesh = bpy.data.meshes.new("House")
    mesh.from_pydata(vertices, [], faces)
    uvs = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32), (len(faces), 1))
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", uvs.ravel())
    mesh.materials.append(material)
    return mesh


def places(order, rng, extent: float):
    """(..., 2) of lamps over streets, metres: streets run in both directions between the blocks, lamps by turns."""
    shape = np.shape(order)
    street = rng.integers(BLOCKS + 1, size=shape or None)
    across = (street - BLOCKS / 2) * STEP + rng.uniform(-0.4, 0.4, shape or None) * STREET
    along = rng.uniform(-STREET, extent, shape or None)
    turned = np.asarray(order) % 2 == 0
    return np.where(
        turned[..., None], np.stack([along - extent / 2, across + extent / 2], -1), np.stack([across, along], -1)
    )


def _lamp(i: int, rng, power: float, size: float):
    """Lamp i: its data, its rotation (Euler angles), its height. power and size: factors."""
    kind = "POINT" if i % 20 < 12 else "SPOT" if i % 20 < 17 else "AREA"
    data = bpy.data.lights.new(kind.title(), kind)
    data.energy = (3000.0 if i % 25 == 0 else float(rng.uniform(100, 400))) * power
    data.color = surfaces.hue(float(rng.random()), float(rng.uniform(0.1, 0.7)), 1.0)
    height = float(rng.uniform(2.5, 5.5))
    turn = (0.0, 0.0, 0.0)
    if kind == "POINT":
        data.shadow_soft_size = float(rng.uniform(0.03, 0.2)) * size
    elif kind == "SPOT":
        data.shadow_soft_size = 0.08 * size
        data.spot_size, data.spot_blend = math.radians(float(rng.uniform(50, 110))), 0.3
        data.energy *= 2
        turn = (float(rng.uniform(-0.5, 0.5)), float(rng.uniform(-0.5, 0.5)), 0.0)
    else:
        data.shape, data.size, data.size_y = "RECTANGLE", float(rng.uniform(0.3, 1.2)) * size, 0.3 * size
        turn = (float(rng.uniform(-0.8, 0.8)), 0.0, float(rng.uniform(0, 6.3)))
    return data, turn, height
