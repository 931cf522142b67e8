# SPDX-License-Identifier: Apache-2.0
"""The town: a boulevard 260 m long at night. Lanterns, lit windows, shop signs and strings of bulbs, all the way down:
half of the picture's ground lies more than 50 m from the camera.

Metres; the boulevard runs along +Y, the camera stands over its near end.
"""

import math

import bpy
import bulbs
import numpy as np
import surfaces
import textures
from materials import WALLS
from shapes import Shape, new_collection, place

LENGTH, HALF = 260.0, 13.0  # of the boulevard, half its width between the houses
SIGNS = ((1.0, 0.12, 0.06), (0.1, 0.6, 1.0), (1.0, 0.55, 0.1), (0.2, 0.95, 0.4), (0.85, 0.15, 0.8))


def build(scene, lights: int, seed: int) -> int:
    """Fills the empty scene; returns how many light sources it made: lit panes, signs, lanterns and bulbs."""
    rng = np.random.default_rng(seed)
    m = _materials()
    ground, houses, life, lamps = (
        new_collection(n, scene.collection) for n in ("Ground", "Houses", "Things", "Lights")
    )
    _ground(m, ground)
    made = _houses(m, houses, rng)
    made += _lanterns(m, lamps)
    _trees_and_benches(m, life, rng)
    rest = max(lights - made, 0)
    meshes = bulbs.glows("Town bulb", bulbs.FESTIVE, 0.06, 60.0)
    spans = [((-HALF, y, 8.2), (HALF, y + 2, 8.2)) for y in np.arange(14, LENGTH, 9.5)]
    made += bulbs.strings("Town bulb", spans, rest, meshes, lamps, rng, m["cord"], 1.6)
    world = scene.world = bpy.data.worlds.new("Night")
    if bpy.app.version < (5, 0):  # always true since 5.0
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.006, 0.010, 0.024, 1)
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width, data.clip_end = 24, 36, 1000
    scene.camera = place(
        "Camera", data, scene.collection, (-2.2, -6, 11.5), (math.radians(78.5), 0, math.radians(-2.5))
    )
    return made


def _materials():
    m = {
        "setts": surfaces.matte(
            "Setts", picture=surfaces.slabs("Slabs", (0.72, 0.70, 0.68), (0.34, 0.33, 0.33), 12, 4, 33)
        ),
        "path": surfaces.matte("Path", (0.30, 0.27, 0.23)),
        "kerb": surfaces.matte("Kerb", (0.22, 0.21, 0.20)),
        "grass": surfaces.matte("Grass", (0.05, 0.10, 0.03)),
        "roof": surfaces.matte("Roof", (0.10, 0.045, 0.035)),
        "trim": surfaces.matte("Trim", (0.55, 0.52, 0.46)),
        "dark pane": surfaces.glossy("Dark pane", (0.015, 0.02, 0.03), 0.08),
        "iron": surfaces.glossy("Iron", (0.04, 0.05, 0.05), 0.4),
        "leaf": surfaces.matte("Leaves", (0.05, 0.11, 0.04)),
        "bark": surfaces.matte("Bark", (0.10, 0.07, 0.05)),
        "cord": surfaces.matte("Cord", (0.01, 0.01, 0.01)),
        "pane warm": surfaces.glow("Pane warm", 2.4, (1.0, 0.62, 0.28)),
        "pane pale": surfaces.glow("Pane pale", 1.6, (1.0, 0.82, 0.55)),
        "pane blue": surfaces.glow("Pane blue", 0.9, (0.45, 0.7, 1.0)),
        "lantern": surfaces.glow("Lantern", 55.0, (1.0, 0.70, 0.38)),
    }
    for index, (name, tint) in enumerate(WALLS.items()):
        facade = textures.plaster(f"Facade {name}", tint, 40 + index)[0]
        m[f"wall {name}"] = surfaces.matte(f"Facade {name}", picture=facade)
    return m | {f"sign {index}": surfaces.glow(f"Sign {index}", 7.0, tint) for index, tint in enumerate(SIGNS)}


def _ground(m, collection):
    shape = Shape()
    a, b, w = -30.0, LENGTH + 60, HALF
    shape.quad([(-90, a, -0.16), (90, a, -0.16), (90, b, -0.16), (-90, b, -0.16)], 1)
    shape.quad(
        [(-w, a, 0), (w, a, 0), (w, b, 0), (-w, b, 0)],
        0,
        [(0, 0), (2 * w / 6, 0), (2 * w / 6, (b - a) / 12), (0, (b - a) / 12)],
    )
    for side in (-1, 1):
        x0, x1 = side * (w - 4.2), side * w
        shape.box(((x0 + x1) / 2, (a + b) / 2, 0.06), (4.2, b - a, 0.14), 1)
        shape.box((x0, (a + b) / 2, 0.065), (0.25, b - a, 0.15), 2)
    for y in np.arange(16.0, LENGTH, 20.0):
        shape.box((0, y, 0.1), (3.4, 12.0, 0.2), 2)
        shape.box((0, y, 0.2), (3.1, 11.7, 0.06), 3)
    place("Ground", shape.mesh("Ground", [m["setts"], m["path"], m["kerb"], m["grass"]]), collection)


def _house(m, name, wall, width, storeys, rng):
    """A house front with its back: (mesh, number of lit panes and signs). It looks along -Y, its front at y = 0."""
    lit = 0
    shape = Shape()
    storey, depth = 3.4, 11.0
    height = storeys * storey + 0.8
    shape.box((0, depth / 2, height / 2), (width, depth, height), 0)
    shape.box((0, -0.12, storey + 0.25), (width + 0.1, 0.3, 0.22), 2)
    shape.box((0, -0.2, height), (width + 0.4, 0.5, 0.3), 2)
    ridge = height + 3.2
    corners = [(-width / 2 - 0.2, -0.4, height + 0.1), (width / 2 + 0.2, -0.4, height + 0.1)]
    corners += [(width / 2 + 0.2, depth / 2, ridge), (-width / 2 - 0.2, depth / 2, ridge)]
    shape.quad(corners, 1)
    back = [(x, depth + 0.4 if z < ridge else y, z) for x, y, z in corners]
    shape.quad(back[::-1], 1)
    columns = int(width // 2.4)
    for level in range(storeys):
        z = level * storey + (1.5 if level else 1.35)
        for column in range(columns):
            x = (column - (columns - 1) / 2) * width / columns
            if level == 0 and column == columns // 2:
                shape.box((x, -0.03, 1.25), (1.2, 0.1, 2.5), 3)
                continue
            wide, tall = (1.8, 1.9) if level == 0 else (1.15, 1.75)
            shape.box((x, -0.03, z + 0.4), (wide + 0.24, 0.12, tall + 0.24), 2)
            on = rng.random() < (0.75 if level == 0 else 0.42)
            slot = 3 if not on else 4 + int(rng.choice(3, p=[0.55, 0.33, 0.12]))
            z0, z1, y = z + 0.4 - tall / 2, z + 0.4 + tall / 2, -0.1
            lit += on
            shape.quad(
                [(x - wide / 2, y, z0), (x + wide / 2, y, z0), (x + wide / 2, y, z1), (x - wide / 2, y, z1)], slot
            )
            shape.box((x, -0.11, z + 0.4), (0.06, 0.05, tall), 2)
    sign = 7 + int(rng.integers(len(SIGNS)))
    shape.box((rng.uniform(-width / 4, width / 4), -0.22, 3.15), (width * 0.4, 0.12, 0.42), sign)
    shape.box((width / 2 - 0.6, -0.75, 4.8), (0.12, 0.8, 1.6), 7 + int(rng.integers(len(SIGNS))))
    slots = [m[wall], m["roof"], m["trim"], m["dark pane"], m["pane warm"], m["pane pale"], m["pane blue"]]
    return shape.mesh(name, slots + [m[f"sign {i}"] for i in range(len(SIGNS))]), lit + 2


def _houses(m, collection, rng):
    """Two rows of houses with side streets between; returns their lit panes and signs."""
    walls = [f"wall {name}" for name in WALLS]
    kinds = []
    for index in range(12):
        width, storeys = float(rng.choice([9.0, 11.0, 13.0])), int(rng.integers(3, 6))
        kinds.append((*_house(m, f"House {index}", walls[index % len(walls)], width, storeys, rng), width))
    made = 0
    for side in (-1, 1):
        y, count = -8.0, 0
        while y < LENGTH:
            mesh, lit, width = kinds[int(rng.integers(len(kinds)))]
            turn = -math.pi / 2 if side < 0 else math.pi / 2
            place("House", mesh, collection, (side * HALF, y + width / 2, 0), (0, 0, turn + math.pi))
            made += lit
            count += 1
            y += width + (7.0 if count % 4 == 0 else 0.05)
    for x in (-18, -6, 6, 18):  # the far end
        mesh, lit, _ = kinds[int(rng.integers(len(kinds)))]
        place("House", mesh, collection, (x, LENGTH + 20, 0))
        made += lit
    return made


def _lanterns(m, collection):
    """Lamp posts along both kerbs, with a lantern of two glowing spheres' worth of light; returns their number."""
    post = Shape().lathe([(0.16, 0), (0.12, 0.5), (0.06, 0.7), (0.045, 4.0), (0.1, 4.05)], 10)
    post.box((0, 0, 3.7), (0.9, 0.05, 0.05)).lathe([(0.16, 4.42), (0.02, 4.62)], 8)
    mesh = post.mesh("Post", [m["iron"]])
    glow = bulbs.sphere("Lantern", 0.16, m["lantern"])
    made = 0
    for side in (-1, 1):
        for y in np.arange(-4.0, LENGTH + 15, 8.0):
            at = (side * (HALF - 4.8), y + (4 if side > 0 else 0))
            place("Post", mesh, collection, (*at, 0))
            place("Lantern", glow, collection, (*at, 4.25))
            made += 1
    return made


def _trees_and_benches(m, collection, rng):
    shapes = []
    for index in range(3):
        crown = Shape().tube([(0, 0, 0), (0.1, 0, 1.4), (0, 0, 2.6)], [0.2, 0.15, 0.12], 7, slot=0)
        for _ in range(7):
            centre = (*rng.normal(0, 0.75, 2), 3.0 + rng.uniform(0, 1.6))
            profile = [(0.85 * math.sin(a) + 1e-3, -0.7 * math.cos(a)) for a in np.linspace(0, math.pi, 7)]
            crown.lathe(profile, 12, centre, 1, ribs=0.15)
        shapes.append(crown.mesh(f"Tree {index}", [m["bark"], m["leaf"]]))
    bench = Shape().box((0, 0, 0.45), (0.5, 1.7, 0.06)).box((0.24, 0, 0.75), (0.05, 1.7, 0.35))
    for y in (-0.7, 0.7):
        bench.box((0, y, 0.22), (0.45, 0.08, 0.44), 1)
    seat = bench.mesh("Bench", [m["bark"], m["iron"]])
    for y in np.arange(16.0, LENGTH, 20.0):
        for k in (-4, 0, 4):
            place(
                "Tree",
                shapes[int(rng.integers(3))],
                collection,
                (0, y + k, 0.2),
                (0, 0, rng.uniform(0, 6)),
                rng.uniform(0.7, 0.95),
            )
        for side in (-1, 1):
            place("Bench", seat, collection, (side * 2.3, y, 0), (0, 0, 0 if side < 0 else math.pi))
