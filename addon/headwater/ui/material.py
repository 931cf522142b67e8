# SPDX-License-Identifier: GPL-3.0-or-later
"""Material properties: slots, surface, settings."""

import bpy

from .panel import HeadwaterPanel, split


class _MaterialPanel(HeadwaterPanel):
    bl_context = "material"

    @classmethod
    def applies(cls, context):
        return context.material is not None


class HEADWATER_MATERIAL_PT_slots(HeadwaterPanel, bpy.types.Panel):
    bl_label = ""
    bl_context = "material"
    bl_options = {"HIDE_HEADER"}

    @classmethod
    def applies(cls, context):
        return context.material is not None or context.object is not None

    def draw(self, context):
        layout, obj, slot = self.layout, context.object, context.material_slot
        if obj is not None:
            rows = 5 if len(obj.material_slots) > 1 else 3
            row = layout.row()
            row.template_list(
                "MATERIAL_UL_matslots", "", obj, "material_slots", obj, "active_material_index", rows=rows
            )
            column = row.column(align=True)
            column.operator("object.material_slot_add", icon="ADD", text="")
            column.operator("object.material_slot_remove", icon="REMOVE", text="")
            column.separator()
            column.menu("MATERIAL_MT_context_menu", icon="DOWNARROW_HLT", text="")
            if len(obj.material_slots) > 1:
                column.separator()
                column.operator("object.material_slot_move", icon="TRIA_UP", text="").direction = "UP"
                column.operator("object.material_slot_move", icon="TRIA_DOWN", text="").direction = "DOWN"
            if obj.mode == "EDIT":
                row = layout.row(align=True)
                row.operator("object.material_slot_assign", text="Assign")
                row.operator("object.material_slot_select", text="Select")
                row.operator("object.material_slot_deselect", text="Deselect")
            row = layout.row()
            row.template_ID(obj, "active_material", new="material.new")
            if slot is not None:
                row.prop(slot, "link", icon="OBJECT_DATA" if slot.link == "OBJECT" else "MESH_DATA", icon_only=True)
        elif context.material is not None:
            layout.template_ID(context.space_data, "pin_id")


class HEADWATER_MATERIAL_PT_surface(_MaterialPanel, bpy.types.Panel):
    bl_label = "Surface"

    def draw(self, context):
        material = context.material
        self.layout.use_property_split = True
        if not material.use_nodes or material.node_tree is None:
            self.layout.operator("headwater.use_nodes", icon="NODETREE")
            self.layout.prop(material, "diffuse_color", text="Base Color")
            return
        tree = material.node_tree
        output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
        if output is None:
            self.layout.label(text="No output node")
        else:
            self.layout.template_node_view(tree, output, output.inputs["Surface"])


def _owner(material, name: str):
    """Where a setting lives: Cycles' group, the material itself (from Blender 4.2 on for some), or ours; else None."""
    owners = (getattr(material, "cycles", None), material, material.headwater)
    return next((owner for owner in owners if hasattr(owner, name)), None)


class HEADWATER_MATERIAL_PT_settings(_MaterialPanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        material = context.material
        column = split(self.layout)
        column.prop(material, "pass_index")
        column.prop(_owner(material, "emission_sampling"), "emission_sampling")
        for name, text in (
            ("use_transparent_shadow", "Transparent Shadows"),
            ("use_bump_map_correction", "Bump Map Correction"),
        ):
            owner = _owner(material, name)
            if owner is not None:
                column.prop(owner, name, text=text)


register, unregister = bpy.utils.register_classes_factory(
    (HEADWATER_MATERIAL_PT_slots, HEADWATER_MATERIAL_PT_surface, HEADWATER_MATERIAL_PT_settings)
)
