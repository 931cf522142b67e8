# SPDX-License-Identifier: GPL-3.0-or-later
"""View layer properties: the passes, and overrides."""

import bpy

from .panel import HeadwaterPanel, split


class _LayerPanel(HeadwaterPanel):
    bl_context = "view_layer"


class HEADWATER_LAYER_PT_passes(_LayerPanel, bpy.types.Panel):
    bl_label = "Passes"

    def draw(self, _context):
        pass


class HEADWATER_LAYER_PT_passes_data(_LayerPanel, bpy.types.Panel):
    bl_label = "Data"
    bl_parent_id = "HEADWATER_LAYER_PT_passes"

    def draw(self, context):
        layer = context.view_layer
        column = split(self.layout)
        for name in ("combined", "z", "mist", "position", "normal", "vector", "uv"):
            column.prop(layer, f"use_pass_{name}")
        column.prop(layer, "use_pass_object_index")
        column.prop(layer, "use_pass_material_index")
        if hasattr(layer, "cycles"):
            column.prop(layer.cycles, "denoising_store_passes", text="Denoising Data")
        else:
            column.prop(layer.headwater, "use_pass_denoising")
        column.prop(layer, "pass_alpha_threshold")


class HEADWATER_LAYER_PT_passes_light(_LayerPanel, bpy.types.Panel):
    bl_label = "Light"
    bl_parent_id = "HEADWATER_LAYER_PT_passes"

    def draw(self, context):
        layer = context.view_layer
        column = split(self.layout)
        for kind in ("Diffuse", "Glossy", "Transmission"):
            row = column.row(heading=kind, align=True)
            for part in ("direct", "indirect", "color"):
                row.prop(layer, f"use_pass_{kind.lower()}_{part}", text=part.capitalize(), toggle=True)
        column.prop(layer, "use_pass_emit", text="Emission")
        column.prop(layer, "use_pass_environment")


class HEADWATER_LAYER_PT_override(_LayerPanel, bpy.types.Panel):
    bl_label = "Override"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layer = context.view_layer
        column = split(self.layout)
        column.prop(layer, "material_override")
        if hasattr(layer, "world_override"):
            column.prop(layer, "world_override")
        column.prop(layer, "samples")


register, unregister = bpy.utils.register_classes_factory(
    (
        HEADWATER_LAYER_PT_passes,
        HEADWATER_LAYER_PT_passes_data,
        HEADWATER_LAYER_PT_passes_light,
        HEADWATER_LAYER_PT_override,
    )
)
