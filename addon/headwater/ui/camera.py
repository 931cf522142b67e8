# SPDX-License-Identifier: GPL-3.0-or-later
"""Camera properties: depth of field (Blender's own lens panels are inherited)."""

import bpy

from .panel import HeadwaterPanel, split


class _CameraPanel(HeadwaterPanel):
    bl_context = "data"

    @classmethod
    def applies(cls, context):
        return context.camera is not None


class HEADWATER_CAMERA_PT_dof(_CameraPanel, bpy.types.Panel):
    bl_label = "Depth of Field"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.camera.dof, "use_dof", text="")

    def draw(self, context):
        dof = context.camera.dof
        column = split(self.layout)
        column.active = dof.use_dof
        column.prop(dof, "focus_object", text="Focus on Object")
        if dof.focus_object is not None and dof.focus_object.type == "ARMATURE":
            column.prop_search(dof, "focus_subtarget", dof.focus_object.data, "bones", text="Bone")
        distance = column.column()
        distance.active = dof.focus_object is None
        distance.prop(dof, "focus_distance")


class HEADWATER_CAMERA_PT_aperture(_CameraPanel, bpy.types.Panel):
    bl_label = "Aperture"
    bl_parent_id = "HEADWATER_CAMERA_PT_dof"

    def draw(self, context):
        dof = context.camera.dof
        column = split(self.layout)
        column.active = dof.use_dof
        for name in ("aperture_fstop", "aperture_blades", "aperture_rotation", "aperture_ratio"):
            column.prop(dof, name)


register, unregister = bpy.utils.register_classes_factory((HEADWATER_CAMERA_PT_dof, HEADWATER_CAMERA_PT_aperture))
