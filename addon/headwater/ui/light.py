# SPDX-License-Identifier: GPL-3.0-or-later
"""Light properties: power, colour and shape; sampling; nodes."""

import bpy

from .panel import HeadwaterPanel, split


class _LightPanel(HeadwaterPanel):
    bl_context = "data"

    @classmethod
    def applies(cls, context):
        return context.light is not None


class HEADWATER_LIGHT_PT_light(_LightPanel, bpy.types.Panel):
    bl_label = "Light"

    def draw(self, context):
        light = context.light
        self.layout.row().prop(light, "type", expand=True)
        column = split(self.layout)
        if hasattr(light, "use_temperature"):
            row = column.row(heading="Temperature")
            row.prop(light, "use_temperature", text="")
            value = row.row()
            value.active = light.use_temperature
            value.prop(light, "temperature", text="")
        column.prop(light, "color")
        column.separator()
        column.prop(light, "energy", text="Strength" if light.type == "SUN" else "Power")
        for name in ("exposure", "normalize"):
            if hasattr(light, name):
                column.prop(light, name)
        column.separator()
        if light.type == "SUN":
            column.prop(light, "angle")
        elif light.type == "AREA":
            column.prop(light, "shape")
            if light.shape in {"SQUARE", "DISK"}:
                column.prop(light, "size")
            else:
                column.prop(light, "size", text="Size X")
                column.prop(light, "size_y", text="Y")
            column.prop(light, "spread")
        else:
            column.prop(light, "use_soft_falloff")
            column.prop(light, "shadow_soft_size", text="Radius")


class HEADWATER_LIGHT_PT_beam(_LightPanel, bpy.types.Panel):
    bl_label = "Beam Shape"
    bl_parent_id = "HEADWATER_LIGHT_PT_light"

    @classmethod
    def applies(cls, context):
        return context.light is not None and context.light.type == "SPOT"

    def draw(self, context):
        column = split(self.layout)
        column.prop(context.light, "spot_size", text="Spot Size")
        column.prop(context.light, "spot_blend", slider=True)
        column.prop(context.light, "show_cone")


class HEADWATER_LIGHT_PT_settings(_LightPanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        light = context.light
        column = split(self.layout)
        column.prop(light, "use_shadow", text="Cast Shadow")
        if hasattr(light, "cycles"):
            column.prop(light.cycles, "use_multiple_importance_sampling", text="Multiple Importance")
            if light.type == "AREA" and light.cycles.is_portal:
                column.prop(light.cycles, "is_portal", text="Portal")  # set for Cycles: says why the lamp is dark
        else:
            column.prop(light.headwater, "use_mis")


class HEADWATER_LIGHT_PT_nodes(_LightPanel, bpy.types.Panel):
    bl_label = "Nodes"

    def draw(self, context):
        light = context.light
        if not light.use_nodes or light.node_tree is None:
            self.layout.operator("headwater.use_nodes", icon="NODETREE")
            return
        output = light.node_tree.get_output_node("CYCLES") or light.node_tree.get_output_node("ALL")
        if output is None:
            self.layout.label(text="No output node")
        else:
            self.layout.template_node_view(light.node_tree, output, output.inputs["Surface"])


register, unregister = bpy.utils.register_classes_factory(
    (HEADWATER_LIGHT_PT_light, HEADWATER_LIGHT_PT_beam, HEADWATER_LIGHT_PT_settings, HEADWATER_LIGHT_PT_nodes)
)
