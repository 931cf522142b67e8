# SPDX-License-Identifier: Apache-2.0
"""The street of the night market: wet ground, kerbs of stones, houses with lit windows, the gate and tower at its end.

The street runs along +Y, 10.4 m from wall to wall, X = 0 its middle.
"""

import math

import numpy as np
from shapes import Shape, new_collection, place, scatter

HALF_WIDTH = 5.2
START, END = -16.0, 46.0


def ground(m, scene):
    """The wet roadway: one tile of setts is 6 m by 12 m; cross-fall towards the gutters."""
    xs = np.linspace(-HALF_WIDTH - 1, HALF_WIDTH + 1, 25)
    ys = np.linspace(START - 6, END + 24, 61)
    points = np.empty((len(ys), len(xs), 3))
    points[..., 0], points[..., 1] = xs[None, :], ys[:, None]
    points[..., 2] = 0.05 * (1 - (np.abs(xs) / 2.1) ** 2).clip(-0.4, 1)[None, :]
    shape = Shape().sheet(points, uv_size=((xs[-1] - xs[0]) / 6, (ys[-1] - ys[0]) / 12))
    place("Street", shape.mesh("Street", [m["street"]]), scene)


def kerbs(m, scene, seed):
    """Rounded stones along both gutters, instanced by geometry nodes."""
    rng = np.random.default_rng(seed)
    stones = new_collection("Stones")
    for index in range(3):
        profile = [(0.001, 0.05), (0.055, 0.045), (0.075, 0.015), (0.07, -0.04)]
        turned = Shape().lathe(profile[::-1], 8, squash=(1.0, 0.75 + 0.12 * index))
        place(f"Stone {index}", turned.mesh(f"Stone {index}", [m["sett"]]), stones)
    points = []
    for side in (-1, 1):
        for lane in range(4):
            y = np.arange(START, END, 0.165)
            x = side * (1.98 + 0.15 * lane) + rng.normal(0, 0.008, len(y))
            points.append(np.column_stack([x, y + rng.normal(0, 0.012, len(y)), np.full(len(y), 0.045)]))
    scatter("Kerb stones", np.vstack(points), stones, scene, seed, (0.85, 1.12), upright=True)


def _window(name, pane, m, size=(0.95, 1.35)):
    """A window with frame, bars and sill, facing +X from the wall plane X = 0; origin at its middle."""
    w, h = size
    shape = Shape()
    shape.quad([(0.02, -w / 2, -h / 2), (0.02, w / 2, -h / 2), (0.02, w / 2, h / 2), (0.02, -w / 2, h / 2)], 0)
    for y in (-w / 2, w / 2):
        shape.box((0.05, y, 0), (0.12, 0.08, h + 0.08), 1)
    for z in (-h / 2, h / 2):
        shape.box((0.05, 0, z), (0.12, w, 0.08), 1)
    shape.box((0.045, 0, 0), (0.04, 0.035, h), 1)
    shape.box((0.045, 0, h * 0.18), (0.04, w, 0.035), 1)
    shape.box((0.10, 0, -h / 2 - 0.06), (0.24, w + 0.25, 0.06), 1)
    return shape.mesh(name, [pane, m["dark wood"]])


def houses(m, scene, rng):
    """Two rows of narrow houses, each with its own height, wall and windows; the windows share meshes."""
    lit = ["amber", "amber", "cream", "cream", "rose", "television"]
    panes = {name: _window(f"Window {name}", m[f"window {name}"], m) for name in set(lit)}
    panes["dark"] = _window("Window dark", m["dark window"], m)
    walls = ["brick", "ochre", "rose", "blue", "ash"]
    lit_windows = 0
    for side in (-1, 1):
        y, previous = START, None
        while y < END:
            width, floors = rng.choice([4.2, 5.1, 6.0]), int(rng.integers(3, 6))
            wall = rng.choice([w for w in walls if w != previous])
            previous = wall
            back, height = rng.uniform(0, 0.45), 3.4 + 2.75 * (floors - 1)
            face = side * (HALF_WIDTH + back)
            shape = Shape()
            shape.box((face + side * 3, y + width / 2, height / 2), (6, width - 0.02, height), 0, uv_scale=0.4)
            for level in range(1, floors):
                shape.box((face - side * 0.07, y + width / 2, 3.15 + 2.75 * (level - 1)), (0.14, width, 0.14), 1)
            shape.box((face - side * 0.2, y + width / 2, height + 0.1), (0.9, width + 0.15, 0.2), 1)
            _roof(shape, side, face, y, width, height)
            if rng.random() < 0.5 and floors > 2:
                _balcony(shape, side, face, y + width / 2, 3.15 + 2.75 * int(rng.integers(0, floors - 2)), width * 0.62)
            place(
                f"House {wall}",
                shape.mesh(f"House {wall}", [m[f"wall {wall}"], m["dark wood"], m["roof"], m["iron"]]),
                scene,
            )
            columns = int(width // 1.6)
            for level in range(1, floors):
                for column in range(columns):
                    pane = rng.choice(lit) if rng.random() < 0.52 else "dark"
                    lit_windows += pane != "dark"
                    where = (face - side * 0.0, y + width * (column + 0.5) / columns, 4.55 + 2.75 * (level - 1))
                    place(f"Window {pane}", panes[pane], scene, where, (0, 0, 0 if side < 0 else math.pi))
            y += width
    return lit_windows


def _roof(shape, side, face, y, width, height):
    rise = 1.1
    points = np.array(
        [
            [[face - side * 0.65, y - 0.05, height + 0.2], [face - side * 0.65, y + width + 0.05, height + 0.2]],
            [
                [face + side * 3, y - 0.05, height + 0.2 + rise],
                [face + side * 3, y + width + 0.05, height + 0.2 + rise],
            ],
        ]
    )
    shape.sheet(points if side < 0 else points[:, ::-1], 2, smooth=False)
    for ridge in np.arange(y, y + width, 0.42):
        shape.tube(
            [(face - side * 0.68, ridge, height + 0.23), (face + side * 3, ridge, height + 0.23 + rise)], 0.06, 6, 2
        )


def _balcony(shape, side, face, y, z, width):
    x = face - side * 0.45
    shape.box((x, y, z), (0.9, width, 0.09), 1)
    shape.tube([(x - side * 0.42, y - width / 2, z + 0.9), (x - side * 0.42, y + width / 2, z + 0.9)], 0.028, 6, 3)
    for bar in np.linspace(-width / 2, width / 2, int(width / 0.16)):
        shape.tube([(x - side * 0.42, y + bar, z), (x - side * 0.42, y + bar, z + 0.9)], 0.012, 5, 3)


def gate(m, scene, y=33.0):
    """A lacquered gate over the street with two swept roofs, lit by its own lanterns elsewhere."""
    shape = Shape()
    for x in (-3.3, 3.3):
        shape.tube([(x, y, 0), (x, y, 5.6)], 0.24, 14, 0)
        shape.box((x, y, 0.25), (0.8, 0.8, 0.5), 1)
    shape.box((0, y, 4.6), (7.6, 0.30, 0.36), 0)
    shape.box((0, y, 5.45), (8.2, 0.36, 0.30), 0)
    shape.box((0, y, 5.02), (1.5, 0.2, 0.62), 3)
    for z, half, depth in ((5.75, 4.9, 1.25), (6.75, 3.1, 0.95)):
        x = np.linspace(-half, half, 25)
        lift = 0.75 * np.abs(x / half) ** 3
        for way in (-1, 1):
            rows = [
                np.column_stack([x, np.full(25, y + way * depth), z + lift]),
                np.column_stack([x, np.full(25, y + way * depth * 0.45), z + 0.32 + lift]),
                np.column_stack([x * 0.93, np.full(25, y), z + 0.75 + lift]),
            ]
            shape.sheet(np.array(rows), 2)
        shape.tube(np.column_stack([x * 0.93, np.full(25, y), z + 0.78 + lift]), 0.09, 8, 2)
        shape.box((0, y, z + 0.2), (half * 1.5, 0.5, 0.5), 0)
    place("Gate", shape.mesh("Gate", [m["lacquer"], m["sett"], m["roof"], m["brass"]]), scene)


def tower(m, scene, y=58.0):
    """A five-storey tower in the distance; its storeys glow from within."""
    shape = Shape()
    z = 0.0
    for level in range(5):
        half, height = 3.4 - 0.5 * level, 3.3 - 0.25 * level
        shape.box((0, y, z + height / 2), (half * 1.5, half * 1.5, height), 0)
        for x in np.linspace(-half * 0.52, half * 0.52, 4):
            front = y - half * 0.76
            shape.quad(
                [
                    (x - 0.3, front, z + 0.6),
                    (x + 0.3, front, z + 0.6),
                    (x + 0.3, front, z + height - 0.5),
                    (x - 0.3, front, z + height - 0.5),
                ],
                2,
            )
        z += height
        ring = np.linspace(0, 2 * math.pi, 33)
        corner = 1 / np.maximum(np.abs(np.cos(ring)), np.abs(np.sin(ring)))
        sweep = 0.45 * (corner - 1) / 0.414
        rows = [
            np.column_stack([np.cos(ring) * corner * r, y + np.sin(ring) * corner * r, np.full(33, z + h) + sweep * k])
            for r, h, k in ((half * 1.22, -0.15, 1), (half * 0.95, 0.12, 0.5), (half * 0.62, 0.6, 0))
        ]
        shape.sheet(np.array(rows), 1)
        z += 0.35
    shape.tube([(0, y, z), (0, y, z + 2.6)], np.array([0.14, 0.02]), 8, 3)
    place("Tower", shape.mesh("Tower", [m["dark wood"], m["roof"], m["window amber"], m["brass"]]), scene)
