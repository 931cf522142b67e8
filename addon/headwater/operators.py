# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: look for devices again; turn on nodes for worlds and lights that have none."""

import bpy

from . import native


class HEADWATER_OT_refresh_devices(bpy.types.Operator):
    """Look for Vulkan devices again"""

    bl_idname = "headwater.refresh_devices"
    bl_label = "Look Again"

    def execute(self, _context):
        native.release()
        found = native.devices(refresh=True)
        why = native.failure()
        if why:
            self.report({"ERROR"}, why)
            return {"CANCELLED"}
        self.report({"INFO"}, f"{len(found)} Vulkan device{'' if len(found) == 1 else 's'} found")
        return {"FINISHED"}


class HEADWATER_OT_use_nodes(bpy.types.Operator):
    """Give this data-block shader nodes"""

    bl_idname = "headwater.use_nodes"
    bl_label = "Use Nodes"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        block = context.material or context.world or context.light
        if block is None:
            self.report({"ERROR"}, "There is no material, world or light here to give nodes to")
            return {"CANCELLED"}
        block.use_nodes = True
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((HEADWATER_OT_refresh_devices, HEADWATER_OT_use_nodes))
