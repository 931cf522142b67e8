# SPDX-License-Identifier: Apache-2.0
"""The garden: a terrace with a pond under the sky of dusk, lit by paper lanterns and bulbs between columns. The sky,
an environment picture, gives about as much light as the lanterns.

Metres; the camera stands at y = -11 and looks along +Y over the pond, which is centred on the origin.
"""

import math

import bpy
import bulbs
import numpy as np
import surfaces
import textures
from materials import PAPER
from shapes import Shape, new_collection, place

POND = 5.2  # radius
RING = 8.6  # radius of the colonnade


def build(scene, lights: int, seed: int) -> int:
    """Fills the empty scene; returns how many light sources it made, the sky not counted."""
    rng = np.random.default_rng(seed)
    m = _materials()
    stone, green, lamps = (new_collection(name, scene.collection) for name in ("Stone", "Green", "Lights"))
    _ground(m, stone)
    tops = _columns(m, stone)
    _statues(m, stone)
    _trees(m, green, rng)
    made = _lanterns(m, lamps, tops, rng)
    rest = max(lights - made, 0)
    meshes = bulbs.glows("Garden bulb", bulbs.FESTIVE, 0.035, 34.0)
    spans = [(a, b) for a, b in zip(tops, tops[1:] + tops[:1], strict=True)]
    spans += [(top, (0, 0, 5.6)) for top in tops[::2]]
    made += bulbs.strings("Garden bulb", spans, rest, meshes, lamps, rng, m["cord"], 0.7)
    scene.world = _dusk()
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width, data.clip_start = 24, 36, 0.05
    scene.camera = place("Camera", data, scene.collection, (-1.6, -11.6, 2.3), (math.radians(87), 0, math.radians(-7)))
    return made


def _materials():
    m = {
        "paving": surfaces.matte(
            "Paving", picture=surfaces.slabs("Slabs", (0.80, 0.76, 0.70), (0.36, 0.33, 0.31), 6, 3, 31)
        ),
        "marble": surfaces.matte("Marble", picture=textures.plaster("Marble", (0.86, 0.83, 0.78), 21)[0]),
        "bronze": surfaces.glossy("Bronze", (0.30, 0.17, 0.07), 0.3),
        "water": surfaces.glossy("Water", (0.01, 0.03, 0.035), 0.08),
        "grass": surfaces.matte("Grass", (0.06, 0.12, 0.03)),
        "leaf": surfaces.matte("Leaves", (0.04, 0.10, 0.035)),
        "blossom": surfaces.matte("Blossom", (0.62, 0.25, 0.32)),
        "bark": surfaces.matte("Bark", (0.12, 0.07, 0.045)),
        "cord": surfaces.matte("Cord", (0.02, 0.02, 0.02)),
    }
    return m | {f"lantern {name}": surfaces.glow(f"Lantern {name}", 4.0, tint) for name, tint in PAPER.items()}


def _ground(m, collection):
    disc, pond = Shape(), Shape()
    angles = np.linspace(0, 2 * math.pi, 97)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for inner, outer, low, high, slot in ((POND, 12.5, 0.0, 0.0, 0), (12.5, 60.0, -0.02, 0.6, 1)):
        rings = np.stack([np.column_stack([circle * r, np.full(97, z)]) for r, z in ((inner, low), (outer, high))])
        disc.sheet(rings[:, ::-1], slot, uv_size=(2 * math.pi * 8 / 2.4, (outer - inner) / 2.4))
    disc.lathe([(POND + 0.32, 0.0), (POND + 0.32, 0.3), (POND, 0.3), (POND, -0.4)], 96, slot=2)
    pond.lathe([(0.001, 0.06), (POND, 0.06)], 96, slot=0)
    place("Terrace", disc.mesh("Terrace", [m["paving"], m["grass"], m["marble"]]), collection)
    place("Pond", pond.mesh("Pond", [m["water"]]), collection)


def _columns(m, collection):
    """Twelve fluted columns in a ring, the near ones left out; returns the points that cords hang from."""
    column = Shape()
    column.box((0, 0, 0.15), (0.8, 0.8, 0.3)).box((0, 0, 4.15), (0.8, 0.8, 0.24))
    heights = np.linspace(0.3, 4.03, 8)
    column.lathe([(0.27 - 0.06 * (z / 4) ** 2, z) for z in heights], 32, ribs=0.07)
    mesh = column.mesh("Column", [m["marble"]])
    tops = []
    for k in range(14):
        angle = math.radians(-38 + k * 256 / 13)
        x, y = RING * math.cos(angle), RING * math.sin(angle)
        place("Column", mesh, collection, (x, y, 0), (0, 0, angle))
        tops.append((x * 0.965, y * 0.965, 4.05))
    beam = Shape()
    for (ax, ay, _), (bx, by, _) in zip(tops, tops[1:], strict=False):
        a, b = np.array([ax, ay]) / 0.965, np.array([bx, by]) / 0.965
        across = np.array([-(b - a)[1], (b - a)[0]]) / np.linalg.norm(b - a) * 0.3
        low = [(*(p + s), 4.27) for p, s in ((a, -across), (b, -across), (b, across), (a, across))]
        high = [(x, y, 4.62) for x, y, _ in low]
        faces = [(3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
        beam.add(low + high, faces, [(0, 0), (2, 0), (2, 0.4), (0, 0.4)] * 6)
    place("Beam", beam.mesh("Beam", [m["marble"]]), collection)
    return tops


def _statues(m, collection):
    """Heads on pedestals between the columns, a tall one in the pond."""
    bpy.ops.mesh.primitive_monkey_add(size=1.0)
    head = bpy.context.object
    head.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
    head.modifiers[0].levels = 1
    mesh = bpy.data.meshes.new_from_object(head.evaluated_get(bpy.context.evaluated_depsgraph_get()))
    bpy.data.objects.remove(head)
    mesh.shade_smooth()
    pedestal = (
        Shape().box((0, 0, 0.1), (0.9, 0.9, 0.2)).box((0, 0, 0.65), (0.6, 0.6, 0.9)).box((0, 0, 1.14), (0.8, 0.8, 0.1))
    )
    stand = pedestal.mesh("Pedestal", [m["marble"]])
    kinds = []
    for name in ("bronze", "marble"):
        one = mesh.copy()
        one.materials.clear()
        one.materials.append(m[name])
        kinds.append(one)
    spots = [(-5.6, -4.6, 0), (5.2, -5.0, 1), (-6.6, 1.8, 1), (6.7, 1.2, 0), (2.6, 6.4, 1), (-3.2, 6.2, 0)]
    for x, y, kind in spots:
        place("Pedestal", stand, collection, (x, y, 0))
        turn = math.atan2(-11.6 - y, -1.6 - x) + math.pi / 2
        place("Head", kinds[kind], collection, (x, y, 1.62), (math.radians(-8), 0, turn), 0.5)
    fountain = Shape().lathe(
        [(0.5, -0.4), (0.45, 0.5), (0.16, 0.7), (0.13, 1.5), (0.9, 1.75), (0.95, 1.85), (0.85, 1.8)], 40
    )
    fountain.lathe([(0.1, 1.7), (0.08, 2.3), (0.45, 2.45), (0.48, 2.52), (0.4, 2.48)], 32)
    place("Fountain", fountain.mesh("Fountain", [m["marble"]]), collection)
    place("Head", kinds[0], collection, (0, 0, 2.95), (math.radians(-5), 0, math.radians(8)), 0.5)


def _trees(m, collection, rng):
    """Cypresses and blossoming trees around the terrace: crumpled spheres and spindles."""
    shapes = []
    for index in range(3):
        crown = Shape()
        crown.tube([(0, 0, 0), (0.05, 0.1, 1.2), (0, 0, 2.2)], [0.16, 0.12, 0.1], 7, slot=0)
        for _ in range(6):
            c = (*rng.normal(0, 0.7, 2), 2.6 + rng.uniform(0, 1.3))
            profile = [(0.75 * math.sin(a) + 1e-3, -0.62 * math.cos(a)) for a in np.linspace(0, math.pi, 8)]
            crown.lathe(profile, 14, c, 1, ribs=0.16)
        shapes.append(crown.mesh(f"Tree {index}", [m["bark"], m["blossom" if index == 0 else "leaf"]]))
    cypress = Shape().lathe(
        [(0.05, 0), (0.75, 0.5), (0.95, 1.6), (0.85, 3.2), (0.55, 5.2), (0.22, 6.8), (0.01, 7.6)], 18, ribs=0.22
    )
    shapes.append(cypress.mesh("Cypress", [m["leaf"]]))
    for k in range(46):
        angle = math.radians(-30 + k * 240 / 45 + rng.normal(0, 2))
        radius = rng.uniform(13.5, 24)
        kind = shapes[3] if k % 3 == 0 else shapes[int(rng.integers(3))]
        at = (radius * math.cos(angle), radius * math.sin(angle), 0)
        place("Tree", kind, collection, at, (0, 0, rng.uniform(0, 6)), rng.uniform(0.9, 1.4))


def _lanterns(m, collection, tops, rng):
    """Paper lanterns: hanging between the columns, floating on the pond, standing about. Returns their number."""

    def lantern(radius, height, sides, name):
        profile = [(radius * 0.55, -height / 2), (radius, 0), (radius * 0.55, height / 2)]
        return Shape().lathe(profile, sides).mesh(f"{name} lantern", [m[f"lantern {name}"]])

    big = [lantern(0.22, 0.46, 10, name) for name in ("red", "orange", "yellow")]
    small = [lantern(0.1, 0.16, 6, name) for name in ("orange", "yellow", "white", "teal", "red")]
    made = 0
    for a, b in zip(tops, tops[1:], strict=False):
        for t in (0.25, 0.5, 0.75):
            x, y, z = np.add(np.multiply(a, 1 - t), np.multiply(b, t))
            place("Hanging lantern", big[made % 3], collection, (x, y, z - 0.55 - 0.9 * t * (1 - t)), (0, 0, t))
            made += 1
    for _ in range(130):
        r, angle = POND * 0.94 * math.sqrt(rng.uniform(0.05, 1)), rng.uniform(0, 2 * math.pi)
        at = (r * math.cos(angle), r * math.sin(angle), 0.15)
        place("Floating lantern", small[int(rng.integers(5))], collection, at, (0, 0, rng.uniform(0, 3)))
        made += 1
    for k in range(60):
        angle = 2 * math.pi * k / 60
        at = ((POND + 0.16) * math.cos(angle), (POND + 0.16) * math.sin(angle), 0.39)
        place("Rim lantern", small[k % 3], collection, at)
        made += 1
    for _ in range(70):  # a path through the grass beyond
        at = (rng.uniform(-20, 20), rng.uniform(9.5, 26), 0.2)
        place("Grass lantern", small[int(rng.integers(5))], collection, at, scale=1.3)
        made += 1
    return made


def _dusk():
    """An equirectangular sky: afterglow low over the far side, violet and deep blue above, thin clouds."""
    height, width = 256, 512
    v = (np.arange(height)[:, None] + 0.5) / height * math.pi - math.pi / 2  # elevation, bottom row first
    u = (np.arange(width)[None, :] + 0.5) / width * 2 * math.pi
    up = np.clip(np.sin(v), 0, 1)
    toward = 0.5 + 0.5 * np.cos(u - 0.22 * 2 * math.pi)
    zenith, low, glow = np.array([0.045, 0.075, 0.19]), np.array([0.16, 0.13, 0.24]), np.array([1.5, 0.52, 0.16])
    sky = zenith + (low - zenith) * np.exp(-3.2 * up)[..., None]
    sky = sky + glow * (np.exp(-9 * up) * toward**3)[..., None]
    cloud = textures.noise((height, width), (10, 6), 5) * np.exp(-2.5 * (up - 0.18) ** 2 * 12)
    sky = sky + np.array([0.75, 0.30, 0.28]) * (np.clip(cloud - 0.45, 0, 1) * 0.8 * toward)[..., None]
    sky[(v < 0).ravel()] *= 0.15
    world = bpy.data.worlds.new("Dusk")
    if bpy.app.version < (5, 0):  # always true since 5.0
        world.use_nodes = True
    tree = world.node_tree
    read = tree.nodes.new("ShaderNodeTexEnvironment")
    read.image = textures.environment("Dusk sky", sky.astype(np.float32))
    tree.links.new(read.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    return world
