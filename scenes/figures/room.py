# SPDX-License-Identifier: Apache-2.0
"""The room: a classroom decked out for a feast. Strings of bulbs, shaded lamps, ceiling panels, lit shelves, and a
second room behind a doorway whose lights reach the first only through it.

Metres; the room spans x 0–9, y 0–12, the camera stands at y = 0.6 and looks along +Y.
"""

import math

import bpy
import bulbs
import numpy as np
import surfaces
import textures
from shapes import Shape, new_collection, place

WIDTH, DEPTH, HEIGHT = 9.0, 12.0, 3.4
DOOR = (6.9, 8.3, 2.25)  # in the far wall: from x, to x, height
BACK = 5.0  # depth of the room behind


def build(scene, lights: int, seed: int) -> int:
    """Fills the empty scene; returns how many light sources it made."""
    rng = np.random.default_rng(seed)
    m = _materials()
    shell, things, lamps = (new_collection(name, scene.collection) for name in ("Shell", "Things", "Lights"))
    _shell(m, shell)
    _board(m, shell)
    made = _panels(m, lamps)
    made += _desks(m, things, lamps, rng)
    made += _shelves(m, things, lamps, rng)
    made += _pendants(m, lamps)
    made += _sofa_corner(m, things, lamps)
    rest = max(lights - made, 0)
    hidden = rest // 3
    meshes = bulbs.glows("Bulb", bulbs.FESTIVE, 0.018, 26.0)
    spans = [((x, y, 3.3), (x + 1.5, y + 1.2, 3.3)) for y in np.arange(0.6, 11, 2.4) for x in np.arange(0, 9, 3.0)]
    spans += [((x + 1.5, y + 1.2, 3.3), (x + 3, y, 3.3)) for y in np.arange(0.6, 11, 2.4) for x in np.arange(0, 9, 3.0)]
    spans += [((0.03, y, 2.7), (0.03, y + 2, 2.7)) for y in np.arange(0, 12, 2.0)]
    made += bulbs.strings("Bulb", spans, rest - hidden, meshes, lamps, rng, m["cord"], 0.3)
    back = [
        ((x, DEPTH + 0.3 + d, 3.2), (x + 3, DEPTH + 0.3 + d, 3.2)) for d in np.arange(0, 4.5, 0.5) for x in (0, 3, 6)
    ]
    made += bulbs.strings("Back bulb", back, hidden, meshes, lamps, rng, m["cord"], 0.4)
    scene.world = _night()
    _camera(scene)
    return made


def _materials():
    m = {
        "floor": surfaces.matte("Parquet", picture=textures.planks()[0]),
        "wall": surfaces.matte("Plaster", picture=textures.plaster("Plaster cream", (0.80, 0.74, 0.62), 11)[0]),
        "ceiling": surfaces.matte("Ceiling", (0.78, 0.77, 0.74)),
        "wainscot": surfaces.glossy("Wainscot", (0.10, 0.22, 0.20), 0.4),
        "oak": surfaces.glossy("Oak", (0.42, 0.25, 0.12), 0.35),
        "dark": surfaces.glossy("Walnut", (0.09, 0.05, 0.03), 0.4),
        "steel": surfaces.glossy("Lacquered steel", (0.30, 0.31, 0.33), 0.25),
        "brass": surfaces.glossy("Brass lacquer", (0.55, 0.36, 0.12), 0.25),
        "board": surfaces.matte("Board", (0.025, 0.075, 0.055)),
        "chalk": surfaces.matte("Chalk", (0.8, 0.8, 0.76)),
        "cord": surfaces.matte("Cord", (0.02, 0.03, 0.02)),
        "glass": surfaces.glossy("Night window", (0.01, 0.014, 0.025), 0.08),
        "shade": surfaces.matte("Shade", (0.75, 0.55, 0.32)),
        "green shade": surfaces.glossy("Green shade", (0.03, 0.25, 0.12), 0.15),
        "sofa": surfaces.matte("Sofa", (0.42, 0.07, 0.05)),
        "rug": surfaces.matte("Rug", (0.16, 0.05, 0.07)),
        "panel": surfaces.glow("Panel", 1.1, (0.82, 0.92, 1.0)),
        "strip": surfaces.glow("Shelf light", 14.0, (1.0, 0.74, 0.42)),
        "filament": surfaces.glow("Filament", 75.0, (1.0, 0.68, 0.36)),
    }
    covers = ((0.45, 0.08, 0.06), (0.08, 0.2, 0.35), (0.55, 0.42, 0.15), (0.10, 0.28, 0.14), (0.5, 0.5, 0.45))
    return m | {f"book {i}": surfaces.matte(f"Book {i}", tint) for i, tint in enumerate(covers)}


def _shell(m, collection):
    floor, walls, trim = Shape(), Shape(), Shape()
    w, d, h = WIDTH, DEPTH, HEIGHT
    far = d + BACK
    floor.quad([(0, 0, 0), (w, 0, 0), (w, far, 0), (0, far, 0)], 0, [(0, 0), (w, 0), (w, far), (0, far)])
    floor.quad([(0, far, h), (w, far, h), (w, 0, h), (0, 0, h)], 1)
    for x in (0, w):
        walls.box((x + (0.1 if x else -0.1), far / 2, h / 2), (0.2, far, h))
        trim.box((x - (0.012 if x else -0.012), d / 2, 0.55), (0.03, d, 1.1))
    for y in (-0.1, far + 0.1):
        walls.box((w / 2, y, h / 2), (w, 0.2, h))
    left, right, top = DOOR
    for a, b, low in ((0, left, 0), (right, w, 0), (left, right, top)):
        walls.box(((a + b) / 2, d + 0.1, (low + h) / 2), (b - a, 0.2, h - low))
        if not low:
            trim.box(((a + b) / 2, d - 0.012, 0.55), (b - a, 0.03, 1.1))
    for x in (left - 0.06, right + 0.06):
        trim.box((x, d - 0.03, top / 2), (0.12, 0.1, top), 1)
    trim.box(((left + right) / 2, d - 0.03, top + 0.06), (right - left + 0.24, 0.1, 0.12), 1)
    for y in np.arange(1.5, 12, 3.0):  # windows of the left wall, night behind
        trim.box((0.03, y + 0.4, 1.85), (0.06, 1.5, 1.35), 1)
        trim.box((0.05, y + 0.05, 1.85), (0.06, 0.62, 1.2), 2)
        trim.box((0.05, y + 0.75, 1.85), (0.06, 0.62, 1.2), 2)
    for y in np.arange(0.0, 12.1, 2.4):
        trim.box((w / 2, y, h - 0.1), (w, 0.16, 0.2), 1)
    place("Floor", floor.mesh("Floor", [m["floor"], m["ceiling"]]), collection)
    place("Walls", walls.mesh("Walls", [m["wall"]]), collection)
    place("Trim", trim.mesh("Trim", [m["wainscot"], m["dark"], m["glass"]]), collection)


def _board(m, collection):
    """The blackboard on the far wall, with chalk drawings of curves."""
    shape = Shape().box((3.4, DEPTH - 0.03, 1.85), (4.6, 0.06, 1.4), 0)
    shape.box((3.4, DEPTH - 0.07, 1.12), (4.7, 0.12, 0.05), 1)
    for k in range(4):
        t = np.linspace(0, 1, 40)
        x, z = 1.4 + k * 1.05 + t * 0.85, 1.85 + 0.42 * np.sin(t * (5 + 3 * k) + k) * (1 - 0.5 * t)
        shape.tube(np.stack([x, np.full(40, DEPTH - 0.063), z], axis=1), 0.008, 4, 2)
    place("Board", shape.mesh("Board", [m["board"], m["oak"], m["chalk"]]), collection)


def _panels(m, collection):
    """Dimmed ceiling panels between the beams."""
    shape = Shape()
    shape.box((0, 0, 0), (1.1, 0.5, 0.05), 1)
    shape.quad([(-0.5, 0.2, -0.03), (0.5, 0.2, -0.03), (0.5, -0.2, -0.03), (-0.5, -0.2, -0.03)], 0)
    mesh = shape.mesh("Panel", [m["panel"], m["steel"]])
    spots = [(x, y) for y in np.arange(1.2, 12, 2.4) for x in (1.5, 4.5, 7.5)]
    for x, y in spots:
        place("Panel", mesh, collection, (x, y, HEIGHT - 0.03))
    return len(spots)


def _desks(m, things, lamps, rng):
    """Rows of desks with chairs, each with a small lamp under a green or cloth shade."""
    desk = Shape().box((0, 0, 0.73), (1.25, 0.6, 0.04), 0)
    for x in (-0.57, 0.57):
        for y in (-0.25, 0.25):
            desk.tube([(x, y, 0), (x, y, 0.72)], 0.02, 6, 1)
    desk.box((0, 0.24, 0.5), (1.15, 0.02, 0.36), 0)
    chair = Shape().box((0, 0, 0.44), (0.42, 0.42, 0.03), 0).box((0, -0.2, 0.78), (0.42, 0.025, 0.26), 0)
    for x in (-0.18, 0.18):
        chair.tube([(x, -0.2, 0), (x, -0.2, 0.9)], 0.014, 6, 1)
        chair.tube([(x, 0.18, 0), (x, 0.18, 0.44)], 0.014, 6, 1)
    lamp = Shape().lathe(
        [(0.001, 0), (0.08, 0.004), (0.07, 0.02), (0.012, 0.03), (0.01, 0.3), (0.001, 0.31)], 12, slot=1
    )
    shades = {
        "green shade": [(0.15, 0.26), (0.13, 0.33), (0.05, 0.38), (0.012, 0.385)],
        "shade": [(0.13, 0.24), (0.08, 0.42)],
    }
    lamp_meshes = []
    for name, profile in shades.items():
        one = Shape()
        one.vertices, one.faces, one.uvs = list(lamp.vertices), list(lamp.faces), list(lamp.uvs)
        one.slots, one.smooth, one.groups = list(lamp.slots), list(lamp.smooth), list(lamp.groups)
        one.lathe(profile, 20, slot=0)
        lamp_meshes.append(one.mesh(f"Desk lamp {name}", [m[name], m["brass"]]))
    glow = bulbs.sphere("Desk bulb", 0.024, m["filament"])
    desk_mesh, chair_mesh = desk.mesh("Desk", [m["oak"], m["steel"]]), chair.mesh("Chair", [m["oak"], m["steel"]])
    books = [Shape().box((0, 0, 0.02), (0.18, 0.25, 0.04)).mesh(f"Book {i}", [m[f"book {i}"]]) for i in range(5)]
    made = 0
    for row, y in enumerate((3.0, 4.7, 6.4, 8.1, 9.8)):
        for column, x in enumerate((1.4, 3.2, 5.0)):
            turn = rng.normal(0, 0.03)
            place("Desk", desk_mesh, things, (x, y, 0), (0, 0, turn))
            place("Chair", chair_mesh, things, (x + rng.normal(0, 0.1), y - 0.5, 0), (0, 0, rng.normal(0, 0.25)))
            spot = (x + rng.choice([-0.42, 0.42]), y + 0.12, 0.75)
            place("Desk lamp", lamp_meshes[(row + column) % 2], lamps, spot)
            place("Desk bulb", glow, lamps, (spot[0], spot[1], 0.75 + 0.29))
            made += 1
            for k in range(int(rng.integers(0, 4))):
                at = (x + rng.uniform(-0.25, 0.25), y - 0.1, 0.75 + 0.04 * k)
                place("Book", books[int(rng.integers(5))], things, at, (0, 0, rng.normal(0, 0.3)))
    return made


def _shelves(m, things, lamps, rng):
    """Book shelves along the right wall; every compartment has a strip of four small lights under its top."""
    made = 0
    strip = Shape().box((0, 0, 0), (0.012, 0.05, 0.012)).mesh("Shelf light", [m["strip"]])
    books, frame = Shape(), Shape()
    for y0 in np.arange(1.0, 11.0, 1.0):
        frame.box((WIDTH - 0.17, y0, 1.2), (0.34, 0.03, 2.4))
        for level in range(6):
            z = 0.06 + 0.46 * level
            frame.box((WIDTH - 0.17, y0 + 0.5, z), (0.34, 1.0, 0.025))
            if level == 5:
                continue
            for k in range(4):
                place("Shelf light", strip, lamps, (WIDTH - 0.3, y0 + 0.14 + 0.24 * k, z + 0.43))
                made += 1
            y = y0 + 0.04
            while y < y0 + rng.uniform(0.45, 0.95):
                thick, tall = rng.uniform(0.025, 0.06), rng.uniform(0.22, 0.36)
                books.box(
                    (WIDTH - 0.13, y + thick / 2, z + 0.014 + tall / 2), (0.2, thick * 0.94, tall), int(rng.integers(5))
                )
                y += thick
    frame.box((WIDTH - 0.17, 11.0, 1.2), (0.34, 0.03, 2.4))
    place("Shelves", frame.mesh("Shelves", [m["dark"]]), things)
    place("Shelf books", books.mesh("Shelf books", [m[f"book {i}"] for i in range(5)]), things)
    return made


def _pendants(m, collection):
    """Pendant lamps with deep shades over the aisle: bulbs seen only from below."""
    shape = Shape().lathe([(0.26, -0.14), (0.2, 0.02), (0.07, 0.1), (0.015, 0.12)], 24, slot=0)
    shape.tube([(0, 0, 0.12), (0, 0, 1.0)], 0.006, 5, 1)
    mesh = shape.mesh("Pendant", [m["brass"], m["cord"]])
    glow = bulbs.sphere("Pendant bulb", 0.045, m["filament"], 2)
    spots = [(x, y) for y in (2.4, 4.8, 7.2, 9.6) for x in (2.3, 4.1, 6.7)]
    for x, y in spots:
        place("Pendant", mesh, collection, (x, y, 2.35))
        place("Pendant bulb", glow, collection, (x, y, 2.31))
    return len(spots)


def _sofa_corner(m, things, lamps):
    """A red sofa on a rug, a floor lamp with a cloth shade beside it."""
    place("Rug", Shape().box((6.9, 4.3, 0.008), (2.0, 3.2, 0.016)).mesh("Rug", [m["rug"]]), things)
    sofa = Shape()
    sofa.lathe([(0.001, 0), (0.24, 0.02), (0.26, 0.2), (0.22, 0.36), (0.001, 0.4)], 20, (7.0, 2.6, 0), squash=(1, 1))
    sofa.box((7.6, 4.6, 0.26), (0.85, 1.9, 0.34)).box((7.95, 4.6, 0.62), (0.24, 1.9, 0.6))
    for y in (3.6, 5.6):
        sofa.box((7.6, y, 0.38), (0.9, 0.2, 0.56))
    for y in (4.15, 5.05):
        sofa.box((7.52, y, 0.47), (0.7, 0.86, 0.14), 1)
    place("Sofa", sofa.mesh("Sofa", [m["sofa"], m["book 2"]]), things)
    lamp = Shape().lathe(
        [(0.001, 0), (0.17, 0.01), (0.16, 0.03), (0.014, 0.05), (0.012, 1.5), (0.001, 1.52)], 16, slot=1
    )
    lamp.lathe([(0.26, 1.36), (0.16, 1.7)], 28, slot=0)
    mesh = lamp.mesh("Floor lamp", [m["shade"], m["brass"]])
    glow = bulbs.sphere("Floor bulb", 0.04, m["filament"], 2)
    spots = ((7.7, 6.2), (7.75, 3.1), (0.6, 10.9))
    for x, y in spots:
        place("Floor lamp", mesh, lamps, (x, y, 0))
        place("Floor bulb", glow, lamps, (x, y, 1.5))
    return len(spots)


def _night():
    world = bpy.data.worlds.new("Night")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    return world


def _camera(scene):
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width, data.clip_start = 21, 36, 0.05
    eye = place("Camera", data, scene.collection, (5.0, 0.35, 1.62), (math.radians(85.5), 0, math.radians(2)))
    scene.camera = eye
