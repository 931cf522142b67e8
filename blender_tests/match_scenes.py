# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes for the statistical test against Cycles: one for each kind of light, material and camera."""

import math

import bpy
import engine_pictures as ep
import numpy as np


def _room(world=(0, 0, 0), eye=(0, -6, 3), kind="PERSP", **look):
    """A ground with a box and a ball on it, and a camera. Returns the ground and the camera."""
    ep.clear(bpy.context.scene)
    ep.settings(bpy.context.scene, 40, 30, bounces=3)
    ep.passes(bpy.context.scene.view_layers[0], (), False)
    ep.sky(world)
    grey = ep.principled("grey", Base_Color=(0.5, 0.5, 0.5, 1), Roughness=0.7)
    ground = ep.shape("plane", (0, 0, 0), (4, 4, 1), material=grey)
    ep.shape(
        "cube", (-1.2, 0.6, 0.5), (0.5, 0.5, 0.5), (0, 0, 0.5), ep.principled("red", Base_Color=(0.7, 0.2, 0.1, 1))
    )
    ep.shape("uv_sphere", (1.1, 0.3, 0.6), (0.6, 0.6, 0.6), material=grey, smooth=True)
    camera = ep.camera(eye, (0, 0, 0.4), kind, **look)
    return ground, camera


def _picture(name, pixels):
    image = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    return image


def _textured(thing, material, image):
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(texture.outputs[0], tree.nodes["Principled BSDF"].inputs["Base Color"])
    thing.data.materials[0] = material


def point():
    _room()
    ep.lamp("POINT", (1, -1.5, 2.5), 120, shadow_soft_size=0.3)


def sharp():
    _room()
    ep.lamp("POINT", (1, -1.5, 2.5), 80, shadow_soft_size=0.0)
    ep.lamp("SPOT", (-1, -1, 3), 300, (0.2, -0.3, 0), shadow_soft_size=0.0, spot_size=1.2, spot_blend=1.0)
    ep.lamp("SUN", (0, 0, 3), 0.5, (0.7, -0.3, 0.2), angle=0.0)


def spot():
    _room()
    ep.lamp("SPOT", (0.5, -1, 3), 400, (0.4, 0.1, 0), shadow_soft_size=0.1, spot_size=1.0, spot_blend=0.4)


def sun():
    _room()
    ep.lamp("SUN", (0, 0, 3), 3, (0.7, 0.3, 0.2), angle=0.2)


def square():
    _room()
    ep.lamp("AREA", (0, -1, 2.5), 90, (0.4, 0.2, 0), size=1.2, spread=math.radians(120))


def rectangle():
    _room()
    ep.lamp("AREA", (0, -1, 2.5), 90, (0.3, 0.2, 0.3), shape="RECTANGLE", size=2.0, size_y=0.4)


def disk():
    _room()
    ep.lamp("AREA", (0, -1, 2.5), 90, (-0.1, 0.2, 0), shape="DISK", size=1.0)


def ellipse():
    _room()
    ep.lamp("AREA", (0, -1, 2.5), 90, (0.3, 0.2, 0.6), shape="ELLIPSE", size=1.5, size_y=0.6)


def many():
    _room()
    for i in range(12):
        angle = i * math.tau / 12
        kind = ("POINT", "SPOT", "AREA")[i % 3]
        thing = ep.lamp(kind, (2 * math.cos(angle), 2 * math.sin(angle), 1.8), 10 + 3 * i)
        thing.data.color = (0.5 + 0.04 * i, 0.7, 1 - 0.06 * i)


def emitter():
    _room()
    glow = ep.principled("glow", Base_Color=(0, 0, 0, 1), Emission_Color=(1, 0.7, 0.4, 1), Emission_Strength=6)
    ep.shape("torus", (0, 0.4, 2), (0.5, 0.5, 0.5), (0.5, 0.2, 0), glow)


def world():
    _room((0.4, 0.5, 0.7))


def environment():
    _room()
    v, u = np.mgrid[0:32, 0:64]
    bright = 20.0 * ((np.abs(u - 20) < 3) & (np.abs(v - 24) < 2))
    pixels = np.stack([0.2 + bright, 0.3 + 0.8 * bright, 0.2 + v / 64 + 0.5 * bright, np.ones_like(bright)], -1)
    tree = bpy.context.scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = _picture("sky", pixels)
    tree.links.new(texture.outputs[0], tree.nodes["Background"].inputs[0])
    tree.nodes["Background"].inputs[1].default_value = 0.8


def principled_grid():
    _room((0.25, 0.3, 0.35))
    ep.lamp("AREA", (0, -1.5, 3), 120, (0.4, 0, 0), size=1.5)
    for i, values in enumerate(
        [
            dict(Metallic=1.0, Roughness=0.4),
            dict(Roughness=0.35, IOR=1.8),
            dict(Coat_Weight=1.0, Roughness=0.8, Coat_Roughness=0.3),
            dict(Transmission_Weight=1.0, Roughness=0.4),
            dict(Metallic=0.5, Roughness=0.5, Specular_Tint=(1, 0.5, 0.5, 1)),
            dict(Alpha=0.5, Roughness=0.6),
        ]
    ):
        material = ep.principled(str(i), Base_Color=(0.8, 0.6, 0.3, 1), **values)
        ep.shape("uv_sphere", (0.8 * (i % 3) - 0.8, -1 - 0.8 * (i // 3), 0.35), (0.35,) * 3, (0, 0, 0), material, True)


def texture():
    ground, _ = _room((0.5, 0.5, 0.5))
    v, u = np.mgrid[0:8, 0:8]
    checks = ((u + v) % 2)[..., None] * np.array([0.7, 0.5, 0.2, 0]) + np.array([0.1, 0.1, 0.2, 1])
    _textured(ground, ep.principled("checks", Roughness=0.8), _picture("checks", checks))


def transparent():
    _room((0.3, 0.3, 0.3))
    ep.lamp("SUN", (0, 0, 3), 2, (0.5, 0.3, 0), angle=0.1)
    from pass_scene import clear_card

    ep.shape("plane", (0.2, -1.2, 1), (1, 0.6, 1), (0.9, 0.2, 0), clear_card())


def depth_of_field():
    _, camera = _room((0.4, 0.4, 0.4))
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance, camera.data.dof.aperture_fstop = 4.0, 0.15
    camera.data.dof.aperture_blades = 5
    ep.lamp("POINT", (1, -1.5, 2.5), 100, shadow_soft_size=0.5)


def shift_and_fit():
    _, camera = _room((0.4, 0.4, 0.4))
    camera.data.shift_x, camera.data.shift_y = 0.2, -0.15
    camera.data.sensor_fit, camera.data.sensor_height = "VERTICAL", 20.0
    bpy.context.scene.render.pixel_aspect_x = 1.3


def orthographic():
    _, camera = _room((0.4, 0.5, 0.4), kind="ORTHO")
    camera.data.ortho_scale = 4.0


SCENES = (
    point, sharp, spot, sun, square, rectangle, disk, ellipse, many, emitter, world, environment, principled_grid,
    texture, transparent, depth_of_field, shift_and_fit, orthographic,
)  # fmt: skip
