# SPDX-License-Identifier: Apache-2.0
"""Stalls of the night market: frame, awning, goods. A stall faces +X with its counter's front at X = 0, Y along it."""

import numpy as np
from shapes import Shape, catenary, new_collection, place, scatter

WIDTH, DEPTH = 2.7, 1.5


def frame(name, awning, m):
    """Posts, counter with a cloth front, back wall of boards and a striped awning with a scalloped edge."""
    shape = Shape()
    for x, top in ((-DEPTH, 2.75), (-0.05, 2.45)):
        for y in (-WIDTH / 2, WIDTH / 2):
            shape.tube([(x, y, 0), (x, y, top)], 0.035, 8, 0)
    shape.box((-0.45, 0, 0.86), (0.95, WIDTH + 0.1, 0.06), 1)
    shape.box((-0.45, 0, 0.44), (0.8, WIDTH - 0.1, 0.8), 1)
    shape.box((-DEPTH, 0, 1.25), (0.05, WIDTH, 2.5), 1)
    for z in (1.45, 1.95):
        shape.box((-DEPTH + 0.17, 0, z), (0.3, WIDTH - 0.1, 0.035), 1)
    folds = np.linspace(-WIDTH / 2, WIDTH / 2, 61)
    front = 0.03 + 0.022 * np.sin(folds * 21)
    rows = [np.column_stack([front * k, folds, np.full(61, z)]) for z, k in ((0.10, 1.6), (0.5, 1.0), (0.84, 0.6))]
    shape.sheet(np.array(rows), 3, uv_size=(1.0, 0.3))
    across = np.linspace(-WIDTH / 2 - 0.15, WIDTH / 2 + 0.15, 49)
    slope = []
    for t in np.linspace(0, 1, 9):
        sag = 0.06 * np.sin(np.pi * t) * (1 + 0.6 * np.cos(across / WIDTH * 4 * np.pi))
        slope.append(np.column_stack([np.full(49, -DEPTH - 0.05 + t * 2.2), across, 2.80 - 0.55 * t - sag]))
    scallop = 0.20 + 0.06 * np.abs(np.sin(np.linspace(0, 8, 49) * np.pi))
    for k in (0.5, 1.0):
        slope.append(np.column_stack([np.full(49, -DEPTH + 2.15 + 0.02 * k), across, 2.25 - scallop * k]))
    shape.sheet(np.array(slope), 2, uv_size=(1.0, 1.0))
    return shape.mesh(name, [m["iron"], m["boards"], m[f"awning {awning}"], m[f"cloth {awning}"]])


def fruit_sources(m):
    """One collection for each fruit: three sizes of it, with a dimple."""
    sources = {}
    for kind in ("orange", "apple", "lime", "lemon", "plum", "peach"):
        collection = new_collection(f"Fruit {kind}")
        for index in range(2):
            r = 0.042 - 0.006 * index
            tall = 1.25 if kind in ("lemon", "lime") else 0.94
            angles = np.linspace(-np.pi / 2, np.pi / 2, 8)
            profile = [(max(r * np.cos(a), 1e-4), r * tall * np.sin(a) - 0.010 * (a > 1.5)) for a in angles]
            place(
                f"{kind} {index}", Shape().lathe(profile, 12).mesh(f"{kind} {index}", [m[f"fruit {kind}"]]), collection
            )
        sources[kind] = collection
    return sources


def crate(kind, fruit, m, seed):
    """A collection: a slatted crate tipped to the buyer with a heap of fruit on it (geometry nodes instances)."""
    collection = new_collection(f"Crate {kind}")
    shape = Shape()
    for z in (0.04, 0.12):
        for x in (-0.2, 0.2):
            shape.box((x, 0, z), (0.015, 0.56, 0.06), 0)
        for y in (-0.28, 0.28):
            shape.box((0, y, z), (0.4, 0.015, 0.06), 0)
    shape.box((0, 0, 0.01), (0.4, 0.56, 0.02), 0)
    place(f"Crate {kind}", shape.mesh(f"Crate {kind}", [m["boards"]]), collection)
    rng = np.random.default_rng(seed)
    points = []
    for layer, (nx, ny) in enumerate(((5, 7), (4, 6), (2, 4))):
        x, y = np.meshgrid((np.arange(nx) - (nx - 1) / 2) * 0.077, (np.arange(ny) - (ny - 1) / 2) * 0.077)
        layer_points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.09 + 0.058 * layer)])
        points.append(layer_points + rng.normal(0, 0.005, layer_points.shape))
    scatter(f"Heap {kind}", np.vstack(points), fruit, collection, seed)
    return collection


def bottle(name, glass, m):
    shape = Shape()
    outer = [
        (0.001, 0.0),
        (0.038, 0.0),
        (0.04, 0.02),
        (0.04, 0.17),
        (0.032, 0.205),
        (0.014, 0.235),
        (0.013, 0.29),
        (0.001, 0.29),
    ]
    shape.lathe(outer, 14, slot=0)
    shape.lathe([(0.015, 0.285), (0.016, 0.315), (0.001, 0.316)], 10, slot=1)
    return shape.mesh(name, [m[glass], m["brass"]])


def pot(name, metal, m, wide=0.17):
    profile = [
        (0.001, 0.0),
        (wide * 0.7, 0.0),
        (wide, 0.07),
        (wide * 1.02, 0.17),
        (wide * 1.1, 0.18),
        (wide * 1.08, 0.19),
        (wide * 0.97, 0.17),
        (wide * 0.94, 0.08),
        (0.001, 0.03),
    ]
    shape = Shape().lathe(profile, 28)
    for y in (-1, 1):
        shape.tube(
            [
                (0.05, y * wide, 0.13),
                (0.045, y * (wide + 0.06), 0.15),
                (-0.045, y * (wide + 0.06), 0.15),
                (-0.05, y * wide, 0.13),
            ],
            0.011,
            7,
        )
    return shape.mesh(name, [m[metal]])


def cup(name, cloth, m):
    profile = [
        (0.001, 0),
        (0.03, 0),
        (0.028, 0.01),
        (0.055, 0.05),
        (0.06, 0.075),
        (0.055, 0.075),
        (0.045, 0.03),
        (0.001, 0.02),
    ]
    return Shape().lathe(profile, 16).mesh(name, [m[cloth]])


class Goods:
    """Meshes and collections that all stalls share; lay() sets out one stall's goods."""

    KINDS = ("fruit", "bottles", "kitchen", "tea", "fruit")

    def __init__(self, m):
        fruit = fruit_sources(m)
        self.crates = [crate(kind, source, m, 100 + i) for i, (kind, source) in enumerate(fruit.items())]
        self.bottles = [bottle(f"Bottle {c}", f"glass {c}", m) for c in ("green", "amber", "blue")]
        self.pots = [
            pot("Pot copper", "copper", m),
            pot("Pot steel", "steel", m, 0.14),
            pot("Pot brass", "brass", m, 0.11),
        ]
        self.cups = [cup(f"Cup {c}", f"cloth {c}", m) for c in ("teal", "indigo", "red", "ochre")]
        self.hook = (
            Shape().tube(catenary((0, -WIDTH / 2, 0), (0, WIDTH / 2, 0), 0.04, 9), 0.008, 5).mesh("Rail", [m["iron"]])
        )

    def lay(self, kind, stall, scene, rng):
        """stall: the stall's frame object; goods become its children."""

        def put(name, data, location, turn=0.0, tip=0.0, scale=1.0):
            thing = place(name, data if not hasattr(data, "objects") else None, scene, location, (0, tip, turn), scale)
            if hasattr(data, "objects"):
                thing.instance_type, thing.instance_collection = "COLLECTION", data
            thing.parent = stall

        if kind == "fruit":
            for y in np.linspace(-1.02, 1.02, 4):
                for row in range(2):
                    source = self.crates[int(rng.integers(len(self.crates)))]
                    put("Crate", source, (-0.2 - 0.42 * row, y, 0.90 + 0.13 * row), rng.normal(0, 0.03), 0.22)
            put(
                "Crate",
                self.crates[int(rng.integers(len(self.crates)))],
                (0.38, rng.uniform(-0.9, 0.9), 0.0),
                rng.uniform(-0.3, 0.3),
            )
        elif kind == "bottles":
            for z, x, step in (
                (0.89, -0.25, 0.17),
                (0.89, -0.5, 0.21),
                (1.47, -DEPTH + 0.18, 0.13),
                (1.97, -DEPTH + 0.18, 0.15),
            ):
                for y in np.arange(-WIDTH / 2 + 0.2, WIDTH / 2 - 0.15, step):
                    which = int(rng.integers(3))
                    put(
                        "Bottle",
                        self.bottles[which],
                        (x + rng.normal(0, 0.02), y, z),
                        rng.uniform(0, 6),
                        0,
                        rng.uniform(0.85, 1.2),
                    )
        elif kind == "kitchen":
            for y in np.linspace(-1.0, 1.0, 5):
                put(
                    "Pot",
                    self.pots[int(rng.integers(3))],
                    (-0.35 + rng.normal(0, 0.06), y, 0.89),
                    rng.uniform(0, 6),
                    0,
                    rng.uniform(0.9, 1.25),
                )
            put("Rail", self.hook, (-0.2, 0, 2.06))
            for y in np.linspace(-1.1, 1.1, 7):
                put("Hanging pot", self.pots[int(rng.integers(3))], (-0.2, y, 1.84), 0, 1.35, rng.uniform(0.6, 0.9))
        else:
            for x in (-0.2, -0.42, -0.64):
                for y in np.arange(-1.15, 1.2, 0.19):
                    put(
                        "Cup",
                        self.cups[int(rng.integers(4))],
                        (x, y + rng.normal(0, 0.015), 0.89),
                        rng.uniform(0, 6),
                        0,
                        rng.uniform(0.9, 1.2),
                    )
            for z in (1.47, 1.97):
                for y in np.arange(-1.1, 1.2, 0.28):
                    put("Jar", self.pots[int(rng.integers(3))], (-DEPTH + 0.2, y, z), rng.uniform(0, 6), 0, 0.65)
