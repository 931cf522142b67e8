# SPDX-License-Identifier: Apache-2.0
"""Materials of the benchmark scenes: Principled BSDFs with everyday settings, some fed by packed image textures."""

import colorsys

import bpy
import numpy as np


def smooth_noise(size: int, cells: int, seed: int) -> np.ndarray:
    """Tileable value noise in [0, 1], (size, size): three octaves, linear between random knots."""
    rng = np.random.default_rng(seed)
    total = np.zeros((size, size))
    for octave in range(3):
        n = cells << octave
        knots = rng.random((n, n))
        t = np.arange(size) / size * n
        i, f = t.astype(int), t % 1.0
        j = (i + 1) % n
        rows = knots[i] * (1 - f)[:, None] + knots[j] * f[:, None]
        total += (rows[:, i] * (1 - f) + rows[:, j] * f) * 0.5**octave
    return total / 1.75


def _image(name: str, pixels: np.ndarray, colour: bool):
    """A packed 8-bit image from (H, W, 3) values in [0, 1]; colour: sRGB-encoded, else data."""
    height, width, _ = pixels.shape
    image = bpy.data.images.new(name, width, height)
    image.colorspace_settings.name = "sRGB" if colour else "Non-Color"
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = np.clip(pixels, 0, 1)
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    return image


class Images:
    """The images that materials share."""

    def __init__(self, size: int = 1024):
        ramp = smooth_noise(size, 8, 1)[..., None]
        self.marble = _image("Marble", 0.35 + 0.6 * np.abs(np.sin(12 * ramp + [0.0, 0.05, 0.1])), True)
        y, x = np.mgrid[0:size, 0:size] * 16 // size
        checks = ((x + y) % 2)[..., None]
        self.checks = _image("Checks", checks * [0.75, 0.72, 0.65] + (1 - checks) * [0.25, 0.3, 0.35], True)
        self.roughness = _image("Roughness", np.repeat(0.15 + 0.7 * smooth_noise(size, 16, 2)[..., None], 3, 2), False)
        height = smooth_noise(size, 32, 3) * 6.0
        slopes = np.stack([np.roll(height, 1, a) - np.roll(height, -1, a) for a in (1, 0)] + [np.ones_like(height)], 2)
        normal = slopes / np.linalg.norm(slopes, axis=2, keepdims=True)
        self.normal = _image("Bumps", normal * 0.5 + 0.5, False)


def principled(
    name: str, *, color=(0.8, 0.8, 0.8), color_image=None, roughness_image=None, normal_image=None, **inputs
):
    """A material of one Principled BSDF. Other keywords are its sockets' names, underscores for spaces."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    bsdf = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    bsdf.inputs["Base Color"].default_value = (*color, 1.0)
    for key, value in inputs.items():
        bsdf.inputs[key.replace("_", " ")].default_value = value

    def texture(image):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        return node.outputs["Color"]

    if color_image is not None:
        tree.links.new(texture(color_image), bsdf.inputs["Base Color"])
    if roughness_image is not None:
        tree.links.new(texture(roughness_image), bsdf.inputs["Roughness"])
    if normal_image is not None:
        bumps = tree.nodes.new("ShaderNodeNormalMap")
        bumps.inputs["Strength"].default_value = 0.6
        tree.links.new(texture(normal_image), bumps.inputs["Color"])
        tree.links.new(bumps.outputs["Normal"], bsdf.inputs["Normal"])
    return material


def emitter(name: str, color, strength: float):
    """A black Principled BSDF that emits. Strength in W per square metre and steradian."""
    inputs = {"Emission_Color": (*color, 1.0), "Emission_Strength": strength, "Specular_IOR_Level": 0.0}
    return principled(name, color=(0, 0, 0), **inputs)


def hue(h: float, s: float = 0.6, v: float = 0.8):
    """A linear RGB colour by hue, saturation and value in [0, 1]."""
    return colorsys.hsv_to_rgb(h % 1.0, s, v)


def row(images: Images) -> list:
    """Twelve different surfaces, from plaster to car paint."""
    return [
        principled("Plaster", color=(0.7, 0.66, 0.6), Roughness=0.9, Specular_IOR_Level=0.3),
        principled("Gold", color=(1.0, 0.77, 0.34), Metallic=1.0, Roughness=0.25),
        principled("Steel", color=(0.6, 0.6, 0.62), Metallic=1.0, roughness_image=images.roughness),
        principled("Red plastic", color=(0.7, 0.05, 0.04), Roughness=0.3, IOR=1.5),
        principled("Car paint", color=(0.02, 0.12, 0.45), Metallic=0.4, Roughness=0.4, Coat_Weight=1.0),
        principled("Marble", color_image=images.marble, Roughness=0.15),
        principled("Hammered", color=(0.9, 0.5, 0.3), Metallic=1.0, Roughness=0.35, normal_image=images.normal),
        principled("Velvet", color=(0.3, 0.05, 0.2), Roughness=0.8, Sheen_Weight=1.0),
        principled("Rubber", color=(0.03, 0.03, 0.03), Roughness=0.6),
        principled("Glazed", color=(0.1, 0.4, 0.3), Roughness=0.5, Coat_Weight=0.7, Coat_Roughness=0.1),
        principled("Checked", color_image=images.checks, roughness_image=images.roughness),
        principled("Clay", color=(0.55, 0.28, 0.16), Roughness=0.75, normal_image=images.normal),
    ]
