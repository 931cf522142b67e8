# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets: sampling settings that come with the add-on, and the operator that stores one's own."""

import os

import bpy
from bl_operators.presets import AddPresetBase

_FOLDER = os.path.dirname(os.path.dirname(__file__))  # Blender looks into its "presets" folder


class HEADWATER_OT_sampling_preset_add(AddPresetBase, bpy.types.Operator):
    """Add or remove a sampling preset"""

    bl_idname = "headwater.sampling_preset_add"
    bl_label = "Add Sampling Preset"
    preset_menu = "HEADWATER_PT_sampling_presets"
    preset_defines = ["own = bpy.context.scene.headwater"]
    preset_values = [
        "own.use_cycles_settings",
        "own.samples",
        "own.time_limit",
        "own.max_bounces",
        "own.diffuse_bounces",
        "own.glossy_bounces",
        "own.transmission_bounces",
        "own.transparent_bounces",
        "own.clamp_direct",
        "own.clamp_indirect",
        "own.filter_glossy",
    ]
    preset_subdir = "headwater/sampling"


def register():
    bpy.utils.register_class(HEADWATER_OT_sampling_preset_add)
    bpy.utils.register_preset_path(_FOLDER)


def unregister():
    bpy.utils.unregister_preset_path(_FOLDER)
    bpy.utils.unregister_class(HEADWATER_OT_sampling_preset_add)
