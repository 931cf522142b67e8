# SPDX-License-Identifier: GPL-3.0-or-later
"""A small scene in which every pass has something to show: all kinds of surfaces, two mirrors of conventions (a moving
camera, a moving object), a transparent card, glass, an emitter, a holdout."""

import bpy
import engine_pictures as ep

SIZE = (64, 48)


def clear_card():
    """Half of it is a transparent shader."""
    material = bpy.data.materials.new("card")
    material.use_nodes = True
    tree = material.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.4
    clear = tree.nodes.new("ShaderNodeBsdfTransparent")
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(tree.nodes["Principled BSDF"].outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs[0])
    return material


def build(scene, card_seen: bool = True, size=SIZE):
    """Fills the scene; frame 2, of which both engines make the picture, has moved on from frame 1."""
    ep.clear(scene)
    ep.settings(scene, *size)
    ep.passes(scene.view_layers[0])
    ep.sky((0.3, 0.4, 0.6))
    ground = ep.principled("ground", Base_Color=(0.6, 0.5, 0.3, 1), Roughness=0.6)
    ep.shape("plane", (0, 2, 0), (5, 6, 1), material=ground)
    metal = ep.principled("metal", Base_Color=(0.9, 0.7, 0.4, 1), Metallic=1.0, Roughness=0.3)
    ball = ep.shape("uv_sphere", (-1.6, 0, 1), material=metal, smooth=True)
    glass = ep.principled("glass", Base_Color=(0.8, 0.9, 1, 1), Transmission_Weight=1.0, Roughness=0.2)
    ep.shape("uv_sphere", (0.9, -0.6, 0.8), (0.8, 0.8, 0.8), material=glass, smooth=True)
    mirror = ep.principled("mirror", Metallic=1.0, Roughness=0.0)
    ep.shape("cube", (0.3, 3, 1), (0.8, 0.2, 1), (0, 0, 0.4), mirror)
    clear = clear_card()
    card = ep.shape("plane", (2.4, 0.6, 1), (0.7, 0.7, 1), (1.4, 0, 0.4), clear)
    glow = ep.principled("glow", Emission_Color=(1, 0.5, 0.2, 1), Emission_Strength=3.0)
    ep.shape("cube", (-0.6, -1.2, 0.25), (0.25, 0.25, 0.25), (0, 0, 0.3), glow)
    ep.shape("cube", (-2.6, 2.6, 1), (0.5, 0.5, 1)).is_holdout = True
    card.hide_render = not card_seen
    for index, thing in enumerate(o for o in scene.objects if o.type == "MESH"):
        thing.pass_index = index + 1
    for index, material in enumerate((ground, metal, glass, mirror, clear, glow)):
        material.pass_index = 10 + index
    ep.lamp("AREA", (2, -2, 4), 150.0, (0.6, 0.4, 0), size=1.0)
    scene.world.mist_settings.start, scene.world.mist_settings.depth = 4.0, 9.0
    scene.world.mist_settings.falloff = "QUADRATIC"
    eye = ep.camera((0.4, -6.0, 2.4), (0, 0, 0.8), lens=32)
    for frame in (1, 2, 3):
        ball.location.z = 1.0 + 0.3 * (frame - 2)
        ball.keyframe_insert("location", frame=frame)
        eye.location.x = 0.4 + 0.1 * (frame - 2)
        eye.keyframe_insert("location", frame=frame)
    scene.frame_set(2)
