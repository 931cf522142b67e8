# SPDX-License-Identifier: GPL-3.0-or-later
"""The shading popover's own switches: which pass the viewport shows. Kept in the viewport, as Cycles' are."""

import bpy
from bpy.props import EnumProperty, PointerProperty

# identifier, the core's pass, label; alphabetical numbers are kept by Blender files: append only
_PASSES = (
    ("COMBINED", "Combined", "Combined"),
    ("EMISSION", "Emission", "Emission"),
    ("ENVIRONMENT", "Environment", "Environment"),
    ("DIFFUSE_DIRECT", "Diffuse Direct", "Diffuse Direct"),
    ("DIFFUSE_INDIRECT", "Diffuse Indirect", "Diffuse Indirect"),
    ("DIFFUSE_COLOR", "Diffuse Color", "Diffuse Color"),
    ("GLOSSY_DIRECT", "Glossy Direct", "Glossy Direct"),
    ("GLOSSY_INDIRECT", "Glossy Indirect", "Glossy Indirect"),
    ("GLOSSY_COLOR", "Glossy Color", "Glossy Color"),
    ("TRANSMISSION_DIRECT", "Transmission Direct", "Transmission Direct"),
    ("TRANSMISSION_INDIRECT", "Transmission Indirect", "Transmission Indirect"),
    ("TRANSMISSION_COLOR", "Transmission Color", "Transmission Color"),
    ("POSITION", "Position", "Position"),
    ("NORMAL", "Normal", "Normal"),
    ("UV", "UV", "UV"),
    ("MIST", "Mist", "Mist"),
    ("DENOISING_ALBEDO", "Denoising Albedo", "Denoising Albedo"),
    ("DENOISING_NORMAL", "Denoising Normal", "Denoising Normal"),
)
_CORE_NAMES = {identifier: core for identifier, core, _ in _PASSES}


class HeadwaterShadingSettings(bpy.types.PropertyGroup):
    render_pass: EnumProperty(
        name="Render Pass",
        description="Which pass the viewport shows",
        items=tuple((identifier, label, "") for identifier, _, label in _PASSES),
        default="COMBINED",
    )


class HEADWATER_VIEW3D_PT_render_pass(bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "HEADER"
    bl_label = "Render Pass"
    bl_parent_id = "VIEW3D_PT_shading"

    @classmethod
    def poll(cls, context):
        return context.engine == "HEADWATER" and context.space_data.shading.type == "RENDERED"

    def draw(self, context):
        self.layout.prop(context.space_data.shading.headwater, "render_pass", text="")


def shown_pass(space) -> str:
    """The core's name of the pass that a 3D viewport shows."""
    return _CORE_NAMES[space.shading.headwater.render_pass]


_classes = (HeadwaterShadingSettings, HEADWATER_VIEW3D_PT_render_pass)


def register():
    for each in _classes:
        bpy.utils.register_class(each)
    bpy.types.View3DShading.headwater = PointerProperty(name="Headwater", type=HeadwaterShadingSettings)


def unregister():
    del bpy.types.View3DShading.headwater
    for each in reversed(_classes):
        bpy.utils.unregister_class(each)
