# SPDX-License-Identifier: GPL-3.0-or-later
"""Object properties: which rays see it, holdout, shadow terminator."""

import bpy

from .panel import HeadwaterPanel, split

_SURFACES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


class _ObjectPanel(HeadwaterPanel):
    bl_context = "object"

    @classmethod
    def applies(cls, context):
        obj = context.object
        return obj is not None and (obj.type in {*_SURFACES, "LIGHT"} or obj.is_instancer)


class HEADWATER_OBJECT_PT_ray_visibility(_ObjectPanel, bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        obj = context.object
        column = split(self.layout)
        for ray in ("camera", "diffuse", "glossy", "transmission"):
            column.prop(obj, f"visible_{ray}", text=ray.capitalize())
        if obj.type != "LIGHT":
            column.prop(obj, "visible_shadow", text="Shadow")
        if obj.type in _SURFACES:
            column.separator()
            column.prop(obj, "is_holdout")


class HEADWATER_OBJECT_PT_shading(_ObjectPanel, bpy.types.Panel):
    bl_label = "Shadow Terminator"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def applies(cls, context):
        return context.object is not None and context.object.type in _SURFACES

    def draw(self, context):
        obj = context.object
        column = split(self.layout)
        source = obj if hasattr(obj, "shadow_terminator_geometry_offset") else getattr(obj, "cycles", None)
        if source is not None:
            column.prop(source, "shadow_terminator_geometry_offset", text="Geometry Offset")


register, unregister = bpy.utils.register_classes_factory(
    (HEADWATER_OBJECT_PT_ray_visibility, HEADWATER_OBJECT_PT_shading)
)
