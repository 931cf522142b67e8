# SPDX-License-Identifier: GPL-3.0-or-later
"""Render passes: which ones a view layer asks for, under Cycles' names, channel ids and kinds.

Blender 5.0 renamed the passes ("DiffDir" became "Diffuse Direct"); compositing files of a version expect its names.
"""

from typing import NamedTuple

import bpy

from . import denoising, options


class RenderPass(NamedTuple):
    core_name: str  # the core's name, which is Blender 5.0's
    name: str  # the name in this Blender
    channels: str  # channel ids, one letter each
    kind: str  # 'COLOR', 'VECTOR' or 'VALUE'


# The picture before denoising; there whether or not denoising succeeds, so that compositing finds it.
NOISY = RenderPass("Combined", "Noisy Image", "RGBA", "COLOR")

# view layer property, core name, name before 5.0, channel ids, kind
_TABLE = (
    ("use_pass_z", "Depth", "Depth", "Z", "VALUE"),
    ("use_pass_mist", "Mist", "Mist", "Z", "VALUE"),
    ("use_pass_position", "Position", "Position", "XYZ", "VECTOR"),
    ("use_pass_normal", "Normal", "Normal", "XYZ", "VECTOR"),
    ("use_pass_vector", "Vector", "Vector", "XYZW", "VECTOR"),
    ("use_pass_uv", "UV", "UV", "UVA", "VECTOR"),
    ("use_pass_object_index", "Object Index", "IndexOB", "X", "VALUE"),
    ("use_pass_material_index", "Material Index", "IndexMA", "X", "VALUE"),
    ("use_pass_diffuse_direct", "Diffuse Direct", "DiffDir", "RGB", "COLOR"),
    ("use_pass_diffuse_indirect", "Diffuse Indirect", "DiffInd", "RGB", "COLOR"),
    ("use_pass_diffuse_color", "Diffuse Color", "DiffCol", "RGB", "COLOR"),
    ("use_pass_glossy_direct", "Glossy Direct", "GlossDir", "RGB", "COLOR"),
    ("use_pass_glossy_indirect", "Glossy Indirect", "GlossInd", "RGB", "COLOR"),
    ("use_pass_glossy_color", "Glossy Color", "GlossCol", "RGB", "COLOR"),
    ("use_pass_transmission_direct", "Transmission Direct", "TransDir", "RGB", "COLOR"),
    ("use_pass_transmission_indirect", "Transmission Indirect", "TransInd", "RGB", "COLOR"),
    ("use_pass_transmission_color", "Transmission Color", "TransCol", "RGB", "COLOR"),
    ("use_pass_emit", "Emission", "Emit", "RGB", "COLOR"),
    ("use_pass_environment", "Environment", "Env", "RGB", "COLOR"),
)
_DENOISING = (
    ("Denoising Normal", "XYZ", "VECTOR"),
    ("Denoising Albedo", "RGB", "COLOR"),
    ("Denoising Depth", "Z", "VALUE"),
)


def denoising_wanted(view_layer) -> bool:
    """Whether the passes a denoiser needs are stored: Cycles' switch where Cycles is there, or ours."""
    cycles = getattr(view_layer, "cycles", None)
    own = getattr(view_layer, "headwater", None)
    return bool(getattr(cycles, "denoising_store_passes", False) or getattr(own, "use_pass_denoising", False))


def wanted(scene, view_layer, given) -> list[RenderPass]:
    """The passes of a view layer, Combined first, in Cycles' order. `given`: the options of the command line."""
    old_names = bpy.app.version < (5, 0, 0)
    found = [RenderPass("Combined", "Combined", "RGBA", "COLOR")]
    for switch, name, old_name, channels, kind in _TABLE:
        if getattr(view_layer, switch):
            found.append(RenderPass(name, old_name if old_names else name, channels, kind))
    if denoising.recipe(scene, view_layer, given) is not None:
        found.append(NOISY)
    if denoising_wanted(view_layer):
        found += [RenderPass(name, name, channels, kind) for name, channels, kind in _DENOISING]
    return found


def has_motion(wanted: list[RenderPass]) -> bool:
    """Whether one of the passes needs to know the frame before."""
    return any(item.core_name == "Vector" for item in wanted)


def register(engine, scene, view_layer) -> None:
    """Tells Blender the passes of a view layer: from RenderEngine.update_render_passes."""
    try:
        given = options.current()
    except ValueError:
        given = options.Options()  # the render tells what is wrong with them
    for item in wanted(scene, view_layer, given):
        engine.register_pass(scene, view_layer, item.name, len(item.channels), item.channels, item.kind)
