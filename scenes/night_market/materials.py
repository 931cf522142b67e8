# SPDX-License-Identifier: Apache-2.0
"""Materials of the night market: Principled BSDF with packed pictures, and paper, glass, metal, neon."""

import bpy
import textures


def principled(
    name, colour=(0.8, 0.8, 0.8), roughness=0.5, colour_map=None, roughness_map=None, normal_map=None, **more
):
    """A material with one Principled BSDF. more: socket names with underscores for spaces, e.g. Emission_Strength=3."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):  # always true since 5.0
        material.use_nodes = True
    tree = material.node_tree
    shader = tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Roughness"].default_value = roughness
    for key, value in more.items():
        shader.inputs[key.replace("_", " ")].default_value = (*value, 1) if isinstance(value, tuple) else value
    for picture, socket in ((colour_map, "Base Color"), (roughness_map, "Roughness")):
        if picture:
            tree.links.new(_picture(tree, picture).outputs["Color"], shader.inputs[socket])
    if normal_map:
        bump = tree.nodes.new("ShaderNodeNormalMap")
        tree.links.new(_picture(tree, normal_map).outputs["Color"], bump.inputs["Color"])
        tree.links.new(bump.outputs["Normal"], shader.inputs["Normal"])
    return material


def glowing(name, strength, colour=(1, 1, 1), picture=None, base=(0.5, 0.5, 0.5)):
    """Emission of `strength` (W·sr⁻¹·m⁻² times colour) over a rough surface; picture: the emission's colour map."""
    material = principled(name, base, 0.6, Emission_Color=colour, Emission_Strength=strength)
    if picture:
        shader = material.node_tree.nodes["Principled BSDF"]
        read = _picture(material.node_tree, picture)
        material.node_tree.links.new(read.outputs["Color"], shader.inputs["Emission Color"])
        material.node_tree.links.new(read.outputs["Color"], shader.inputs["Base Color"])
    return material


def _picture(tree, picture):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = picture
    return node


NEON = {
    "rose": (1.0, 0.06, 0.42),
    "cyan": (0.04, 0.75, 1.0),
    "violet": (0.42, 0.10, 1.0),
    "green": (0.10, 1.0, 0.35),
    "amber": (1.0, 0.35, 0.05),
}
PAPER = {
    "red": (1.0, 0.33, 0.10),
    "orange": (1.0, 0.56, 0.16),
    "yellow": (1.0, 0.78, 0.34),
    "white": (1.0, 0.90, 0.72),
    "teal": (0.32, 0.88, 0.82),
}
LANTERN_STRENGTH = {"red": 1.5, "orange": 2.0, "yellow": 2.6, "white": 2.4, "teal": 1.8}
AWNINGS = {
    "red": ((0.72, 0.10, 0.08), (0.90, 0.84, 0.72)),
    "indigo": ((0.10, 0.14, 0.40), (0.85, 0.84, 0.78)),
    "ochre": ((0.80, 0.48, 0.10), (0.90, 0.82, 0.64)),
    "teal": ((0.06, 0.40, 0.38), (0.88, 0.86, 0.76)),
    "plum": ((0.42, 0.08, 0.26), (0.88, 0.72, 0.62)),
}
FRUIT = {
    "orange": (0.95, 0.36, 0.03),
    "apple": (0.62, 0.04, 0.03),
    "lime": (0.30, 0.55, 0.06),
    "lemon": (0.93, 0.68, 0.05),
    "plum": (0.16, 0.03, 0.16),
    "peach": (0.93, 0.48, 0.28),
}
WALLS = {"ochre": (0.62, 0.45, 0.28), "rose": (0.56, 0.34, 0.32), "blue": (0.28, 0.36, 0.45), "ash": (0.42, 0.41, 0.40)}
COATS = {
    "charcoal": (0.03, 0.03, 0.04),
    "navy": (0.03, 0.05, 0.13),
    "rust": (0.28, 0.08, 0.03),
    "sand": (0.42, 0.33, 0.22),
}


def build():
    """All materials by a short name; families ("lantern red", "awning teal", …) share a prefix."""
    m = {}
    colour, rough, normal = textures.wet_street()
    m["street"] = principled("Wet setts", colour_map=colour, roughness_map=rough, normal_map=normal)
    colour, rough, normal = textures.wall_bricks()
    m["wall brick"] = principled("Bricks", colour_map=colour, roughness_map=rough, normal_map=normal)
    for index, (name, tint) in enumerate(WALLS.items()):
        colour, normal = textures.plaster(f"Plaster {name}", tint, 70 + 2 * index)
        m[f"wall {name}"] = principled(f"Plaster {name}", roughness=0.8, colour_map=colour, normal_map=normal)
    colour, rough, normal = textures.planks()
    m["boards"] = principled("Boards", colour_map=colour, roughness_map=rough, normal_map=normal)
    m["lacquer"] = principled("Red lacquer", (0.30, 0.02, 0.015), 0.28, Coat_Weight=0.6, Coat_Roughness=0.08)
    m["dark wood"] = principled("Dark wood", (0.045, 0.028, 0.02), 0.45)
    m["iron"] = principled("Iron", (0.10, 0.10, 0.11), 0.42, Metallic=1.0)
    m["copper"] = principled("Copper", (0.93, 0.50, 0.32), 0.18, Metallic=1.0)
    m["steel"] = principled("Steel", (0.66, 0.67, 0.70), 0.22, Metallic=1.0)
    m["brass"] = principled("Brass", (0.88, 0.62, 0.26), 0.25, Metallic=1.0)
    m["roof"] = principled("Roof tiles", (0.035, 0.042, 0.055), 0.32)
    m["cable"] = principled("Cable", (0.01, 0.01, 0.012), 0.5)
    m["dark window"] = principled("Dark window", (0.015, 0.022, 0.035), 0.06)
    m["sett"] = principled("Kerb stone", (0.09, 0.085, 0.09), 0.2)
    m["skin"] = principled("Skin", (0.50, 0.28, 0.19), 0.5)
    for name, tint in (("green", (0.35, 0.85, 0.45)), ("amber", (0.95, 0.55, 0.15)), ("blue", (0.30, 0.55, 0.95))):
        m[f"glass {name}"] = principled(f"Glass {name}", tint, 0.03, Transmission_Weight=1.0, IOR=1.5)
    for name, colours in AWNINGS.items():
        stripes = textures.stripes(f"Stripes {name}", *colours)
        m[f"awning {name}"] = principled(f"Awning {name}", roughness=0.75, colour_map=stripes)
        m[f"cloth {name}"] = principled(f"Cloth {name}", tuple(0.7 * c * c for c in colours[0]), 0.85)
    for name, tint in FRUIT.items():
        m[f"fruit {name}"] = principled(f"Fruit {name}", tint, 0.32, Coat_Weight=0.3, Coat_Roughness=0.2)
    for name, tint in COATS.items():
        m[f"coat {name}"] = principled(f"Coat {name}", tint, 0.8)
    for name, tint in PAPER.items():
        m[f"lantern {name}"] = glowing(
            f"Lantern {name}", LANTERN_STRENGTH[name], picture=textures.paper(f"Paper {name}", tint)
        )
    for name, tint in NEON.items():
        m[f"neon {name}"] = glowing(f"Neon {name}", 14.0, tint)
    m["bulb"] = glowing("Bulb", 30.0, (1.0, 0.62, 0.28))
    m["sky lantern"] = glowing("Sky lantern", 3.5, picture=textures.paper("Sky lantern paper", (1.0, 0.48, 0.14)))
    m["umbrella"] = glowing("Umbrella paper", 0.5, (1.0, 0.07, 0.03), base=(0.62, 0.05, 0.03))
    m["fish"] = glowing("Paper fish", 2.6, picture=textures.fish_scales())
    m["flame"] = glowing("Flame", 60.0, (1.0, 0.5, 0.15))
    windows = (
        ("amber", (1.0, 0.72, 0.34), (0.55, 0.24, 0.08), 0.16),
        ("cream", (1.0, 0.86, 0.60), (0.62, 0.40, 0.18), 0.05),
        ("rose", (1.0, 0.55, 0.42), (0.48, 0.12, 0.12), 0.22),
        ("television", (0.52, 0.78, 1.0), (0.06, 0.12, 0.26), 0.12),
    )
    for index, (name, light, dark, curtain) in enumerate(windows):
        picture = textures.glowing_window(f"Window {name}", light, dark, 80 + index, curtain)
        m[f"window {name}"] = glowing(f"Window {name}", 2.2, picture=picture)
    signs = (
        ("red", (0.85, 0.10, 0.06), (1.0, 0.85, 0.55)),
        ("cream", (1.0, 0.88, 0.66), (0.45, 0.04, 0.03)),
        ("night", (0.03, 0.05, 0.16), (0.35, 0.90, 1.0)),
        ("green", (0.03, 0.30, 0.18), (1.0, 0.92, 0.60)),
        ("violet", (0.22, 0.05, 0.35), (1.0, 0.60, 0.85)),
    )
    for index, (name, ground, ink) in enumerate(signs):
        picture = textures.sign(f"Sign {name}", ground, ink, 90 + index)
        m[f"sign {name}"] = glowing(f"Sign {name}", 2.0, picture=picture)
    return m
