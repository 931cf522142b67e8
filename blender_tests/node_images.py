# SPDX-License-Identifier: GPL-3.0-or-later
"""Image node cases: filters, wrapping, colour spaces, alpha modes and projections on a small random image."""

import bpy
import numpy as np

# name: float, colour space, alpha mode
IMAGES = {
    "byte": (False, "sRGB", "STRAIGHT"),
    "packed": (False, "sRGB", "CHANNEL_PACKED"),
    "no alpha": (False, "sRGB", "NONE"),
    "premultiplied": (False, "sRGB", "PREMUL"),
    "data": (False, "Non-Color", "STRAIGHT"),
    "byte linear": (False, "Linear Rec.709", "STRAIGHT"),
    "float": (True, "Linear Rec.709", "STRAIGHT"),
    "float data": (True, "Non-Color", "STRAIGHT"),
}


def prepare() -> None:
    pixels = np.random.default_rng(1).random((6, 5, 4)).astype(np.float32)
    for name, (is_float, space, alpha) in IMAGES.items():
        image = bpy.data.images.new(name, 5, 6, alpha=True, float_buffer=is_float)
        image.colorspace_settings.name, image.alpha_mode = space, alpha
        image.pixels.foreach_set(pixels.reshape(-1))
        image.update()
        image.pack()


def _case(image, show="color", kind="TexImage", **settings):
    def build(tree, co):
        node = tree.nodes.new(f"ShaderNode{kind}")
        node.image = bpy.data.images[image]
        for key, value in settings.items():
            setattr(node, key, value)
        place = tree.nodes.new("ShaderNodeMapping")
        place.inputs["Scale"].default_value = (2.3, -1.7, 1.1)
        place.inputs["Location"].default_value = (-0.7, 1.2, 0.3)
        place.inputs["Rotation"].default_value = (0.3, 0.5, 0.4)
        tree.links.new(co, place.inputs[0])
        tree.links.new(place.outputs[0], node.inputs[0])
        if show != "both":
            return node.outputs[1 if show == "alpha" else 0]
        both = tree.nodes.new("ShaderNodeVectorMath")
        tree.links.new(node.outputs[0], both.inputs[0])
        tree.links.new(node.outputs[1], both.inputs[1])
        return both.outputs[0]

    return build


def cases() -> dict:
    found = {}
    for interpolation in ("Linear", "Closest", "Cubic"):
        for extension in ("REPEAT", "EXTEND", "CLIP", "MIRROR"):
            name = f"{interpolation} {extension}"
            found[name] = _case("byte", interpolation=interpolation, extension=extension)
    for image in IMAGES:
        for show in ("color", "alpha", "both"):
            found[f"{image}: {show}"] = _case(image, show)
    for projection in ("BOX", "SPHERE", "TUBE"):
        found[projection] = _case("data", projection=projection, projection_blend=0.3)
    for projection in ("EQUIRECTANGULAR", "MIRROR_BALL"):
        found[projection] = _case("data", kind="TexEnvironment", projection=projection)
    return found
