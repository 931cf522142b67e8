# SPDX-License-Identifier: Apache-2.0
"""The scene of `headwater bench --gpu-report`, made straight in the core: a hilly field of glossy and matte balls under
a thousand lamps and a hundred glowing balls. No file, no Blender; always the same."""

import numpy as np

from headwater.materials import Graph, Surface, closures

GROUND, MATTE, GLOSSY, GLOW = 1, 2, 3, 10  # ids of materials; glowing ones count on from GLOW
SIDE = 40.0  # metres, of the field
COLOURS = ((9.0, 6.0, 3.0), (8.0, 2.0, 1.5), (1.5, 4.0, 9.0), (2.0, 8.0, 3.0))


def build(core, aspect: float, lamps: int = 1000, balls: int = 2000, glows: int = 100):
    """A core.Scene with that many lamps, balls and glowing balls (320 triangles each). aspect: width / height."""
    scene = core.Scene()
    rng = np.random.default_rng(7)
    _material(scene, GROUND, lambda g, s: closures.add_diffuse(s, g.one, g.const(0.45, 0.42, 0.38), g.zero, g.normal))
    _material(scene, MATTE, lambda g, s: closures.add_diffuse(s, g.one, g.const(0.6, 0.3, 0.2), g.zero, g.normal))
    _material(scene, GLOSSY, _glossy)
    for number, colour in enumerate(COLOURS):
        _material(scene, GLOW + number, lambda g, s, c=colour: s.emit(g.const(*c)), colour)
    scene.upsert_mesh(1, "field", *_field(256))
    scene.upsert_mesh(2, "ball", *_ball(10, 17))
    scene.upsert_instance(1, 1, _placed([[0, 0, 0]], 1.0)[0], materials=[GROUND])
    places = rng.uniform(-SIDE / 2, SIDE / 2, (balls + glows, 2))
    heights = _height(places[:, 0], places[:, 1])
    at = np.column_stack([places, heights + 0.3])
    half = balls // 2
    for first, part, material in ((10, at[:half], MATTE), (1 << 20, at[half:balls], GLOSSY)):
        if len(part):
            scene.upsert_instances(first, 2, _placed(part, 0.3), materials=[material])
    for number in range(len(COLOURS)):
        part = at[balls + number :: len(COLOURS)] + [0, 0, 0.6]
        if len(part):
            scene.upsert_instances((2 + number) << 20, 2, _placed(part, 0.12), materials=[GLOW + number])
    lamp_places = rng.uniform(-SIDE / 2, SIDE / 2, (lamps, 2))
    lamp_heights = _height(lamp_places[:, 0], lamp_places[:, 1]) + rng.uniform(0.8, 2.0, lamps)
    matrices = _placed(np.column_stack([lamp_places, lamp_heights]), 1.0)
    for number, matrix in enumerate(matrices):
        kind = ("point", "spot", "area")[number % 3]
        color = COLOURS[number % len(COLOURS)]
        scene.upsert_light(number + 1, f"lamp {number}", kind, matrix, color=color, power=1.5, **_SHAPES[kind])
    scene.set_world("night", (0.004, 0.006, 0.012))
    scene.set_camera("perspective", _looking((0, -SIDE * 0.48, 4.5), (0, 0, 0)), _plane(aspect))
    return scene


_SHAPES = {
    "point": {"radius": 0.05},
    "spot": {"radius": 0.05, "spot_size": 1.4},
    "area": {"size_x": 0.3, "size_y": 0.3},
}


def _material(scene, number: int, add, emission=(0.0, 0.0, 0.0)) -> None:
    surface = Surface(Graph())
    add(surface.graph, surface)
    made = surface.finish([], [], [])
    scene.upsert_material(
        number, f"material {number}", made.program, made.constants, flags=made.flags, emission=emission
    )


def _glossy(g, s) -> None:
    closures.add_diffuse(s, g.const(0.4), g.const(0.2, 0.35, 0.5), g.zero, g.normal)
    closures.add_glossy(s, g.const(0.6), g.one, g.const(0.25), g.zero, g.zero, g.normal, g.zero, 0)


def _height(x, y):
    return 0.6 * np.sin(0.5 * x) * np.cos(0.4 * y) + 0.15 * np.sin(1.9 * x + 0.7 * y)


def _field(count: int):
    v, u = np.mgrid[0 : count + 1, 0 : count + 1] / count * SIDE - SIDE / 2
    positions = np.stack([u, v, _height(u, v)], -1).reshape(-1, 3).astype(np.float32)
    return positions, _quads(count, count)


def _ball(rows: int, columns: int):
    """A unit sphere of 2 x rows x columns triangles (flat ones at the poles among them)."""
    v, u = np.mgrid[0 : rows + 1, 0 : columns + 1]
    polar, azimuth = np.pi * v / rows, 2 * np.pi * (u % columns) / columns
    points = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    return points.reshape(-1, 3).astype(np.float32), _quads(rows, columns)


def _quads(rows: int, columns: int):
    """(2 * rows * columns, 3) triangles of a grid of points."""
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    corners = np.stack([first, first + columns + 1, first + columns + 2, first + 1], 1)
    return corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.uint32)


def _placed(places, scale: float):
    """(N, 3, 4) object to world."""
    places = np.asarray(places, np.float32)
    matrices = np.zeros((len(places), 3, 4), np.float32)
    matrices[:, [0, 1, 2], [0, 1, 2]] = scale
    matrices[:, :, 3] = places
    return matrices


def _looking(eye, target):
    """(3, 4) matrix of a camera at `eye` that looks at `target`."""
    eye, target = np.asarray(eye, float), np.asarray(target, float)
    z = (eye - target) / np.linalg.norm(eye - target)
    x = np.cross((0, 0, 1), z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z, eye], 1).astype(np.float32)


def _plane(aspect: float):
    return (-0.6, 0.6, -0.6 / aspect, 0.6 / aspect)
