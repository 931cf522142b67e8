# SPDX-License-Identifier: GPL-3.0-or-later
"""World properties: surface, mist, ray visibility, sampling."""

import bpy

from .panel import HeadwaterPanel, split


class _WorldPanel(HeadwaterPanel):
    bl_context = "world"

    @classmethod
    def applies(cls, context):
        return context.world is not None


class HEADWATER_WORLD_PT_surface(_WorldPanel, bpy.types.Panel):
    bl_label = "Surface"

    def draw(self, context):
        world = context.world
        self.layout.use_property_split = True
        if not world.use_nodes or world.node_tree is None:
            self.layout.operator("headwater.use_nodes", icon="NODETREE")
            self.layout.prop(world, "color")
            return
        output = world.node_tree.get_output_node("CYCLES") or world.node_tree.get_output_node("ALL")
        if output is None:
            self.layout.label(text="No output node")
        else:
            self.layout.template_node_view(world.node_tree, output, output.inputs["Surface"])


class HEADWATER_WORLD_PT_mist(_WorldPanel, bpy.types.Panel):
    bl_label = "Mist Pass"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def applies(cls, context):
        return context.world is not None and any(layer.use_pass_mist for layer in context.scene.view_layers)

    def draw(self, context):
        mist = context.world.mist_settings
        column = split(self.layout)
        column.prop(mist, "start")
        column.prop(mist, "depth")
        column.prop(mist, "falloff")


class HEADWATER_WORLD_PT_visibility(_WorldPanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        world = context.world
        column = split(self.layout)
        source = getattr(world, "cycles_visibility", None) or world.headwater
        for name in ("camera", "diffuse", "glossy", "transmission"):
            column.prop(source, name)


class HEADWATER_WORLD_PT_settings(_WorldPanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        world = context.world
        source = getattr(world, "cycles", None) or world.headwater
        column = split(self.layout)
        column.prop(source, "sampling_method", text="Sampling")
        if source.sampling_method == "MANUAL":
            column.prop(source, "sample_map_resolution")


register, unregister = bpy.utils.register_classes_factory(
    (
        HEADWATER_WORLD_PT_surface,
        HEADWATER_WORLD_PT_mist,
        HEADWATER_WORLD_PT_visibility,
        HEADWATER_WORLD_PT_settings,
    )
)
