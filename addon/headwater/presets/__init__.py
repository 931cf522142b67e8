# SPDX-License-Identifier: GPL-3.0-or-later
"""Presets: sampling settings that come with the add-on, and the operator that stores one's own."""

import os

import bpy
from bl_operators.presets import AddPresetBase

from headwater.integrators import INTEGRATORS

from .. import render_settings

_FOLDER = os.path.dirname(os.path.dirname(__file__))  # Blender looks into its "presets" folder
_SETTINGS = (  # of Sampling and Light Paths: property of ours, of Cycles
    ("preview_samples", "preview_samples"),
    ("samples", "samples"),
    ("time_limit", "time_limit"),
    ("max_bounces", "max_bounces"),
    ("diffuse_bounces", "diffuse_bounces"),
    ("glossy_bounces", "glossy_bounces"),
    ("transmission_bounces", "transmission_bounces"),
    ("transparent_bounces", "transparent_max_bounces"),
    ("min_bounces", "min_light_bounces"),
    ("clamp_direct", "sample_clamp_direct"),
    ("clamp_indirect", "sample_clamp_indirect"),
    ("filter_glossy", "blur_glossy"),
    ("caustics_reflective", "caustics_reflective"),
    ("caustics_refractive", "caustics_refractive"),
)
_ADAPTIVE = ("use_adaptive_sampling", "adaptive_threshold", "adaptive_min_samples")  # ours whoever's the others are


class HEADWATER_OT_sampling_preset_add(AddPresetBase, bpy.types.Operator):
    """Add or remove a sampling preset"""

    bl_idname = "headwater.sampling_preset_add"
    bl_label = "Add Sampling Preset"
    preset_menu = "HEADWATER_PT_sampling_presets"
    preset_defines = [
        "own = bpy.context.scene.headwater",
        "cycles = getattr(bpy.context.scene, 'cycles', None)",
    ]
    preset_subdir = "headwater/sampling"

    @property
    def preset_values(self) -> list[str]:
        """What the preset stores: the integrator and what it reads, and the sampling settings that are in use."""
        scene = bpy.context.scene
        own, cycles = scene.headwater, render_settings.cycles_of(scene)
        integrator = INTEGRATORS[own.integrator]
        values = [
            f"own.{name}" for name in ("integrator", "estimator", "use_cycles_settings", "light_choice", *_ADAPTIVE)
        ]
        group = integrator.group(own.estimator)
        values += [f"own.{group}.{name}" for name in integrator.parameters(own.estimator)]
        return values + [f"cycles.{theirs}" if cycles else f"own.{ours}" for ours, theirs in _SETTINGS]


def register():
    bpy.utils.register_class(HEADWATER_OT_sampling_preset_add)
    bpy.utils.register_preset_path(_FOLDER)


def unregister():
    bpy.utils.unregister_preset_path(_FOLDER)
    bpy.utils.unregister_class(HEADWATER_OT_sampling_preset_add)
