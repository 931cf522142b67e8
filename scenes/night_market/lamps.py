# SPDX-License-Identifier: Apache-2.0
"""Lamps of the night market: paper lanterns, strings of bulbs, spots, lit signs, neon, sky lanterns, the moon.

Every function returns how many light sources it made: lamps and emissive meshes that shine on their own.
"""

import math

import bpy
import numpy as np
from shapes import Shape, catenary, place


def lamp(name, kind, collection, location, colour, watts, rotation=(0, 0, 0), **more):
    """A Blender lamp; watts: its power as Blender counts it (W; W/m² for a sun)."""
    light = bpy.data.lights.new(name, kind)
    light.color, light.energy = colour, watts
    for key, value in more.items():
        setattr(light, key, value)
    return place(name, light, collection, location, rotation)


def lantern_meshes(m):
    """Paper lanterns that hang below their origin: (shape, colour) -> mesh."""
    profiles = {
        "round": ([(0.07 + 0.13 * math.sin(a), -0.17 * math.cos(a)) for a in np.linspace(0.0, math.pi, 9)], 16, 0.0),
        "tall": ([(0.07, -0.26), (0.115, -0.22), (0.12, 0.0), (0.115, 0.22), (0.07, 0.26)], 14, 0.0),
        "gourd": ([(0.05, -0.24), (0.15, -0.15), (0.165, -0.08), (0.09, 0.05), (0.115, 0.13), (0.05, 0.22)], 16, 0.0),
        "drum": ([(0.16, -0.09), (0.18, -0.07), (0.185, 0.07), (0.16, 0.09)], 20, 0.0),
        "star": ([(0.05, -0.2), (0.21, 0.0), (0.05, 0.2)], 12, 0.45),
    }
    meshes = {}
    for form, (profile, segments, ribs) in profiles.items():
        for colour in ("red", "orange", "yellow", "white", "teal"):
            shape = Shape()
            low, high = profile[0][1], profile[-1][1]
            middle = (0, 0, -0.16 - high)
            shape.lathe(profile, segments, middle, 0, ribs=ribs)
            for z in (low - 0.015, high - 0.005):
                cap = profile[0][0] if z < 0 else profile[-1][0]
                shape.lathe([(0.001, z), (cap + 0.008, z), (cap + 0.008, z + 0.02), (0.001, z + 0.02)], 12, middle, 1)
            shape.tube([(0, 0, 0), (0, 0, -0.16)], 0.005, 5, 1)
            shape.tube([(0, 0, middle[2] + low), (0, 0, middle[2] + low - 0.2)], np.array([0.016, 0.024]), 6, 2)
            name = f"Lantern {form} {colour}"
            meshes[form, colour] = shape.mesh(name, [m[f"lantern {colour}"], m["dark wood"], m["cloth red"]])
    return meshes


def swing(thing, phase, frames, angle=0.16, period=40):
    """Keys a pendulum about the object's own X and Y."""
    base = tuple(thing.rotation_euler)
    for frame in range(1, frames + 5, 4):
        turn = 2 * math.pi * frame / period + phase
        tilt = (base[0] + angle * math.sin(turn), base[1] + 0.6 * angle * math.sin(turn * 0.7 + 1), base[2])
        thing.rotation_euler = tilt
        thing.keyframe_insert("rotation_euler", frame=frame)


def stall_lights(m, scene, meshes, stall, index, side, rng, frames):
    """Lanterns under the awning's edge, a spot over the goods, a candle at the back."""
    made = 0
    forms = ["round", "tall", "gourd", "drum", "star"]
    families = [("red", "orange"), ("orange", "yellow"), ("white", "yellow"), ("teal", "white"), ("red", "red")]
    form, colours = forms[int(rng.integers(5))], families[int(rng.integers(5))]
    for k, y in enumerate((-1.2, 1.2) if form != "star" else (-1.25, 0.0, 1.25)):
        thing = place(
            "Stall lantern", meshes[form, colours[k % 2]], scene, (0.52, y, 2.26), scale=rng.uniform(0.85, 1.1)
        )
        thing.parent = stall
        if index < 10:
            swing(thing, rng.uniform(0, 6), frames, 0.09)
        made += 1
    warm = ((1.0, 0.66, 0.34), (1.0, 0.80, 0.55), (0.80, 0.92, 1.0))[int(rng.choice(3, p=[0.5, 0.35, 0.15]))]
    spot = lamp(
        "Stall spot", "SPOT", scene, (-0.30, 0, 2.12), warm, 160, spot_size=2.1, spot_blend=0.6, shadow_soft_size=0.05
    )
    candle = lamp(
        "Candle", "POINT", scene, (-0.72, rng.uniform(-1, 1), 1.06), (1.0, 0.5, 0.18), 40, shadow_soft_size=0.03
    )
    spot.parent = candle.parent = stall
    return made + 2


def garlands(m, scene, meshes, rng, frames):
    """Cords of lanterns across the street; the near ones swing, some with a lamp of their own inside."""
    made = 0
    cord = Shape()
    palettes = [
        ("red", "orange", "red", "yellow"),
        ("orange", "yellow", "white"),
        ("red", "white"),
        ("teal", "yellow", "orange"),
    ]
    for index, (y, z) in enumerate(
        ((-3.6, 5.2), (0.6, 5.5), (5.0, 6.0), (9.5, 6.6), (14.5, 7.3), (20.5, 8.4), (27.0, 9.6))
    ):
        points = catenary(
            (-5.0, y + rng.uniform(-1, 1), z + rng.uniform(-0.2, 0.4)),
            (5.0, y + rng.uniform(-1, 1), z + rng.uniform(-0.2, 0.4)),
            0.8,
            40,
        )
        cord.tube(points, 0.012, 5)
        palette = palettes[index % 4]
        form = ("round", "tall", "drum", "gourd", "star")[index % 5]
        for k, at in enumerate(np.linspace(3, 36, 8).astype(int)):
            thing = place(
                "Garland lantern",
                meshes[form, palette[k % len(palette)]],
                scene,
                points[at],
                (0, 0, rng.uniform(0, 3)),
                rng.uniform(1.15, 1.55),
            )
            if index < 4:
                swing(thing, 0.7 * k + index, frames)
            made += 1
            if k % 4 == 1:
                inside = lamp(
                    "Garland lamp", "POINT", scene, (0, 0, -0.75), (1.0, 0.42, 0.12), 45, shadow_soft_size=0.06
                )
                inside.parent = thing
                made += 1
    place("Garland cords", cord.mesh("Garland cords", [m["cable"]]), scene)
    return made


def bulb_strings(m, scene, count, rng):
    """`count` small point lamps on cords zigzagging over the stalls, each with a glowing bulb around it."""
    if count <= 0:
        return 0
    profile = [(0.001, -0.034), (0.02, -0.026), (0.027, -0.008), (0.02, 0.014), (0.009, 0.03)]
    bulb = Shape().lathe(profile, 8).mesh("Bulb", [m["bulb"]])
    spans = []
    for side in (-1, 1):
        for y in np.arange(-9, 32, 5.2):
            spans.append(((side * 1.9, y, 2.95), (side * 4.9, y + 2.6, 3.55)))
            spans.append(((side * 4.9, y + 2.6, 3.55), (side * 1.9, y + 5.2, 2.95)))
    for y in np.arange(-7, 32, 6.5):
        spans.append(((-4.9, y, 3.9), (4.9, y + 3.0, 3.9)))
    share = np.full(len(spans), count // len(spans))
    share[: count % len(spans)] += 1
    hues = [(1.0, 0.60, 0.26), (1.0, 0.60, 0.26), (1.0, 0.72, 0.42), (1.0, 0.42, 0.14)]
    watts = 7.0 * (300 / max(count, 300))
    lights = []
    for hue in hues:  # lamp data is shared: a string is bought as one
        light = bpy.data.lights.new("String bulb", "POINT")
        light.color, light.energy, light.shadow_soft_size = hue, watts, 0.024
        lights.append(light)
    cord = Shape()
    for span, number in zip(spans, share, strict=True):
        points = catenary(*span, 0.32, number + 2)
        cord.tube(catenary(*span, 0.32, 14), 0.007, 4)
        for k, point in enumerate(points[1:-1]):
            place("String bulb", lights[k % len(hues)], scene, point - [0, 0, 0.075])
            place("Bulb", bulb, scene, point - [0, 0, 0.035])
    place("Bulb cords", cord.mesh("Bulb cords", [m["cable"]]), scene)
    return int(count)


def signs(m, scene, rng):
    """Hanging box signs along both walls: glowing paper, and an area lamp that throws its colour on the street."""
    colours = {
        "red": (1.0, 0.25, 0.12),
        "cream": (1.0, 0.78, 0.50),
        "night": (0.25, 0.75, 1.0),
        "green": (0.4, 1.0, 0.5),
        "violet": (0.8, 0.35, 1.0),
    }
    shapes = ("RECTANGLE", "RECTANGLE", "ELLIPSE", "DISK", "SQUARE")
    meshes = {}
    for name in colours:
        box = Shape()
        for way in (-1, 1):
            corners = [
                (-0.4, way * 0.08, -0.85),
                (0.4, way * 0.08, -0.85),
                (0.4, way * 0.08, 0.85),
                (-0.4, way * 0.08, 0.85),
            ]
            box.quad(corners if way < 0 else [corners[i] for i in (1, 0, 3, 2)], 0)
        for x in (-0.42, 0.42):
            box.box((x, 0, 0), (0.05, 0.2, 1.78), 1)
        for z in (-0.87, 0.87):
            box.box((0, 0, z), (0.88, 0.2, 0.05), 1)
        meshes[name] = box.mesh(f"Sign {name}", [m[f"sign {name}"], m["iron"]])
    made = 0
    names = list(colours)
    for side in (-1, 1):
        for index, y in enumerate(np.arange(-6.5 + (side > 0) * 1.7, 31, 3.9)):
            name = names[(index + (side > 0) * 2) % 5]
            where = np.array([side * 4.45, y + rng.uniform(-0.5, 0.5), rng.uniform(4.0, 5.6)])
            place(f"Sign {name}", meshes[name], scene, where, scale=rng.uniform(0.8, 1.15))
            shape = shapes[index % 5]
            size = {"size": 0.7} | ({"size_y": 1.5} if shape in ("RECTANGLE", "ELLIPSE") else {})
            glow = lamp(
                "Sign glow",
                "AREA",
                scene,
                where + [-side * 0.55, -0.2, -0.2],
                colours[name],
                75,
                (0, side * 0.9, 0),
                shape=shape,
                **size,
            )
            glow.data.spread = 2.6
            made += 2
    return made


def _neon_path(form):
    t = np.linspace(0, 2 * math.pi, 33)[:-1]
    if form == "ring":
        return np.column_stack([np.cos(t) * 0.45, 0 * t, np.sin(t) * 0.45]), True
    if form == "fish":
        return np.column_stack([0.62 * np.cos(t) - 0.25 * np.sin(t) ** 2, 0 * t, 0.42 * np.cos(t) * np.sin(t)]), True
    if form == "wave":
        x = np.linspace(-0.75, 0.75, 40)
        return np.column_stack([x, 0 * x, 0.16 * np.sin(x * 10)]), False
    if form == "bolt":
        return np.array(
            [(0.1, 0, 0.8), (-0.25, 0, 0.08), (0.06, 0, 0.08), (-0.12, 0, -0.8), (0.3, 0, 0.2), (0.0, 0, 0.2)]
        ), True
    bar = np.linspace(-1.1, 1.1, 3)
    return np.column_stack([0 * bar, 0 * bar, bar]), False


def neon(m, scene, rng):
    """Bent glass tubes on brackets, facing down the street, and long tubes under the eaves."""
    made = 0
    hues = list("rose cyan violet green amber".split())
    for side in (-1, 1):
        for index, y in enumerate(np.arange(-4.2 + 2 * (side > 0), 30, 4.7)):
            form = ("ring", "bar", "fish", "wave", "bolt")[(index + 2 * (side > 0)) % 5]
            hue = hues[(index * 2 + (side > 0)) % 5]
            path, closed = _neon_path(form)
            shape = Shape().tube(path * rng.uniform(0.9, 1.25), 0.022, 7, 0, closed=closed)
            shape.box((-side * 0.0, 0.06, 0), (0.9, 0.03, 0.05), 1)
            where = (side * 4.35, y, rng.uniform(3.5, 6.4))
            place(f"Neon {form}", shape.mesh(f"Neon {form}", [m[f"neon {hue}"], m["iron"]]), scene, where)
            made += 1
    for side, y, hue in ((-1, -3.0, "cyan"), (1, 6.0, "rose"), (-1, 15.0, "violet"), (1, 22.0, "cyan")):
        shape = Shape().tube([(side * 5.02, y, 3.25), (side * 5.02, y + 3.4, 3.25)], 0.02, 7)
        place("Neon eaves", shape.mesh("Neon eaves", [m[f"neon {hue}"]]), scene)
        made += 1
    return made


def sky_lanterns(m, scene, rng, frames):
    """Paper sky lanterns rising and drifting beyond the gate, each carrying a small flame's light."""
    profile = [(0.30, -0.4), (0.36, -0.2), (0.42, 0.15), (0.34, 0.38), (0.12, 0.5), (0.001, 0.52)]
    shape = Shape().lathe(profile, 14, slot=0)
    mesh = shape.mesh("Sky lantern", [m["sky lantern"]])
    made = 0
    for _ in range(22):
        y = rng.uniform(14, 75)
        where = np.array([rng.uniform(-4, 4) * max(1, y / 50), y, 1.5 + (y + 11) * math.tan(rng.uniform(0.16, 0.33))])
        thing = place("Sky lantern", mesh, scene, where, scale=rng.uniform(0.9, 1.3))
        drift = np.array([rng.uniform(0.1, 0.5), rng.uniform(-0.2, 0.3), rng.uniform(0.5, 0.9)]) * frames / 24
        for frame, t in ((1, 0.0), (frames, 1.0)):
            thing.location = where + drift * t
            thing.keyframe_insert("location", frame=frame)
        flame = lamp("Sky flame", "POINT", scene, (0, 0, -0.5), (1.0, 0.45, 0.12), 20, shadow_soft_size=0.08)
        flame.parent = thing
        made += 2
    return made


def moon(scene):
    """Dim, blue, from behind the left roofs."""
    lamp("Moon", "SUN", scene, (0, 0, 20), (0.38, 0.52, 1.0), 0.05, (0.75, -0.55, 0.3), angle=0.0093)
    return 1


def gate_lights(m, scene, meshes):
    """Two rows of red lanterns under the gate's beams and two spots up its posts."""
    made = 0
    for x in np.linspace(-2.7, 2.7, 7):
        place("Gate lantern", meshes["round", "red"], scene, (x, 32.75, 4.35), scale=1.7)
        made += 1
    for x in (-3.3, 3.3):
        lamp(
            "Gate spot",
            "SPOT",
            scene,
            (x * 0.86, 31.2, 0.3),
            (1.0, 0.45, 0.18),
            420,
            (math.pi * 0.91, 0, 0),
            spot_size=1.1,
            spot_blend=0.7,
            shadow_soft_size=0.12,
        )
        made += 1
    for z, y in ((4.0, 50.5), (11.0, 51.5)):
        lamp(
            "Tower glow",
            "AREA",
            scene,
            (0, y, z),
            (1.0, 0.5, 0.2),
            700,
            (math.pi / 2, 0, 0),
            shape="ELLIPSE",
            size=4,
            size_y=2,
        )
        made += 1
    return made
