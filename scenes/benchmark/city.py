# SPDX-License-Identifier: Apache-2.0
"""The town of `streets` with traffic: half of its lamps are cars' and move from frame to frame."""

import math

import animation
import bpy
import numpy as np
import spread
import streets
import surfaces
from mathutils import Matrix

LAMPS = 4  # of a car: two headlamps, two tail lamps


def build(scene, lights: int, seed: int) -> None:
    """`lights` lamps, of which half, in fours, belong to cars; the rest stand along the streets.

    Their power together does not depend on their number; above 1,000, neither does the area in which they are seen.
    """
    rng = np.random.default_rng(seed)
    extent = streets.town(scene, rng)
    scene.frame_end = animation.FRAMES
    cars = lights // (2 * LAMPS)
    power, size = 1000 / max(lights, 1), min(1.0, math.sqrt(1000 / max(lights, 1)))
    posts = lights - LAMPS * cars
    kinds = [[(_post(rng, power, size), Matrix.Identity(4))] for _ in range(40)]
    streets_of = streets.places(np.arange(posts), rng, extent)
    places = np.column_stack([streets_of, rng.uniform(4.0, 6.0, posts)])
    spread.spread(scene, "Post", kinds, rng.integers(len(kinds), size=posts), places)
    _traffic(scene, cars, rng, extent, power, size)
    streets.look(scene)


def _post(rng, power: float, size: float):
    lamp = bpy.data.lights.new("Post", "SPOT" if rng.random() < 0.5 else "POINT")
    lamp.energy, lamp.shadow_soft_size = float(rng.uniform(300, 1200)) * power, 0.12 * size
    lamp.color = surfaces.hue(float(rng.uniform(0.05, 0.14)), float(rng.uniform(0.2, 0.6)), 1.0)
    if lamp.type == "SPOT":
        lamp.spot_size, lamp.spot_blend = math.radians(130), 0.4
    return lamp


def _traffic(scene, cars: int, rng, extent: float, power: float, size: float) -> None:
    """Cars in lanes: every street has one each way, which moves as a whole at a speed of its own."""
    lanes = [(street, axis, way) for street in range(streets.BLOCKS + 1) for axis in (0, 1) for way in (-1, 1)]
    lane_of = rng.integers(len(lanes), size=cars)
    along = rng.uniform(-streets.STREET, extent + streets.STREET, cars)
    side = rng.uniform(1.2, 2.6, cars)
    paints = [
        surfaces.principled(f"Car {i}", color=surfaces.hue(i / 6, 0.7, 0.4), Metallic=0.4, Roughness=0.35)
        for i in range(6)
    ]
    parts = _parts(paints, power, size)
    paint_of = rng.integers(len(paints), size=cars)
    for number, (street, axis, way) in enumerate(lanes):
        mine = lane_of == number
        speed = float(rng.uniform(6, 16))  # metres a second
        if not mine.any():
            continue
        mover = bpy.data.objects.new("Lane", None)
        scene.collection.objects.link(mover)
        for frame in (1, animation.FRAMES):
            travelled = way * speed * (frame - 1) / scene.render.fps
            mover.location = (travelled, 0, 0) if axis == 0 else (0, travelled, 0)
            mover.keyframe_insert("location", frame=frame)
        animation.linear(mover)
        across = (street - streets.BLOCKS / 2) * streets.STEP - (side[mine] * way if axis == 0 else -side[mine] * way)
        if axis == 0:
            places = np.column_stack([along[mine] - extent / 2, across + extent / 2, np.zeros(mine.sum())])
        else:
            places = np.column_stack([across, along[mine], np.zeros(mine.sum())])
        turn = Matrix.Rotation(math.pi / 2 * axis + (math.pi if way < 0 else 0.0), 4, "Z")
        things = [[(data, turn @ matrix) for data, matrix in kind] for kind in parts]
        spread.spread(scene, "Car", things, paint_of[mine], places, mover, count=cars * (1 + LAMPS))


def _parts(paints, power: float, size: float) -> list:
    """A car for each paint, driving along +X: body, two headlamps ahead of it, two tail lamps behind."""
    head = bpy.data.lights.new("Headlamp", "SPOT")
    head.energy, head.shadow_soft_size, head.color = 2000.0 * power, 0.08 * size, (1.0, 0.95, 0.85)
    head.spot_size, head.spot_blend = math.radians(50), 0.5
    tail = bpy.data.lights.new("Tail lamp", "POINT")
    tail.energy, tail.shadow_soft_size, tail.color = 40.0 * power, 0.06 * size, (1.0, 0.05, 0.02)
    ahead = Matrix.Rotation(math.radians(-83), 4, "Y")  # a lamp shines along its -Z
    cars = []
    for paint in paints:
        body = spread.boxes(
            "Car", [(-2.0, -0.85, 0.3), (-1.2, -0.75, 0.9)], [(2.0, 0.85, 0.9), (0.8, 0.75, 1.45)], paint
        )
        lamps = [(head, Matrix.Translation((2.1, y, 0.65)) @ ahead) for y in (-0.6, 0.6)]
        lamps += [(tail, Matrix.Translation((-2.1, y, 0.7))) for y in (-0.6, 0.6)]
        cars.append([(body, Matrix.Identity(4)), *lamps])
    return cars
