# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the log: go to what an entry is about; empty it; copy it."""

import bpy
from bpy.props import IntProperty

from .log import Entry, log


class HEADWATER_OT_show_log_item(bpy.types.Operator):
    """Select the object that an entry of the log is about"""

    bl_idname = "headwater.show_log_item"
    bl_label = "Show Log Item"
    bl_options = {"REGISTER", "UNDO"}

    number: IntProperty(name="Entry", description="Number of the log's entry", options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def description(cls, _context, properties):
        entry = log.find(properties.number)
        return f"Select the object that this is about: {entry.text}" if entry is not None else cls.__doc__

    def execute(self, context):
        entry = log.find(self.number)
        if entry is None:
            return self._refuse("This entry is no longer in the log")
        if not entry.name:
            return self._refuse("This entry names nothing that could be selected")
        if entry.kind == "World":
            return self._show_world(context, entry)
        materials = _materials(entry)
        if materials is not None and not materials:
            return self._refuse(f"{entry.kind} '{entry.name}' is gone, or no material uses it")
        objects = _users(materials) if materials is not None else _objects(entry)
        if not objects:
            what = f"{entry.kind} '{entry.name}'"
            return self._refuse(f"No object uses {what}" if materials is not None else f"{what} is gone")
        here = [obj for obj in objects if context.view_layer.objects.get(obj.name) == obj]
        if not here:
            return self._refuse(f"Object '{objects[0].name}' is not in view layer '{context.view_layer.name}'")
        obj = next((obj for obj in here if obj.visible_get()), here[0])
        _activate(context, obj)
        if materials is not None:
            _show_material(obj, materials, entry.node)
        hidden = "" if obj.visible_get() else ", which is hidden"
        self.report({"INFO"}, f"Selected '{obj.name}'{hidden}")
        return {"FINISHED"}

    def _show_world(self, context, entry: Entry):
        world = bpy.data.worlds.get(entry.name)
        if world is None:
            return self._refuse(f"World '{entry.name}' is gone")
        _activate_node(world.node_tree, entry.node)
        where = "the scene's world" if world == context.scene.world else "not the world of this scene"
        self.report({"INFO"}, f"World '{entry.name}' is {where}: see the World properties")
        return {"FINISHED"}

    def _refuse(self, why: str):
        self.report({"WARNING"}, why)
        return {"CANCELLED"}


def _objects(entry: Entry) -> list:
    """Objects of that name, else those whose data has it."""
    found = [obj for obj in bpy.data.objects if obj.name == entry.name]
    if entry.kind == "Mesh" or not found:
        found = [obj for obj in bpy.data.objects if obj.data is not None and obj.data.name == entry.name] or found
    return found


def _materials(entry: Entry) -> list | None:
    """Materials an entry is about; None when it is about objects."""
    if entry.kind == "Image":
        return [material for material in bpy.data.materials if _uses(material.node_tree, entry.name, set())]
    if entry.kind == "Material":
        material = bpy.data.materials.get(entry.name)
        return [material] if material is not None else []
    return None


def _uses(tree, image: str, seen: set) -> bool:
    """Whether a node tree, or a group within, has a node with the image of that name."""
    if tree is None or tree.as_pointer() in seen:
        return False
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        held = getattr(node, "image", None)
        if (held is not None and held.name == image) or _uses(getattr(node, "node_tree", None), image, seen):
            return True
    return False


def _users(materials: list) -> list:
    """Objects with one of the materials in a slot."""
    return [obj for obj in bpy.data.objects if any(slot.material in materials for slot in obj.material_slots)]


def _activate(context, obj) -> None:
    """Makes it the only selected object and the active one, in object mode."""
    if context.mode != "OBJECT" and bpy.ops.object.mode_set.poll():
        bpy.ops.object.mode_set(mode="OBJECT")
    for other in context.view_layer.objects:
        other.select_set(other == obj)
    context.view_layer.objects.active = obj


def _show_material(obj, materials: list, node: str) -> None:
    for index, slot in enumerate(obj.material_slots):
        if slot.material in materials:
            obj.active_material_index = index
            _activate_node(slot.material.node_tree, node)
            return


def _activate_node(tree, name: str) -> None:
    """For shader editors that show the tree. Nodes within groups are not looked for."""
    node = tree.nodes.get(name) if tree is not None and name else None
    if node is not None:
        for other in tree.nodes:
            other.select = other == node
        tree.nodes.active = node


class HEADWATER_OT_clear_log(bpy.types.Operator):
    """Empty the log. What is still wrong is said again by the next render"""

    bl_idname = "headwater.clear_log"
    bl_label = "Clear"

    def execute(self, context):
        log.clear()
        context.window_manager.headwater_log_page = 1
        return {"FINISHED"}


class HEADWATER_OT_copy_log(bpy.types.Operator):
    """Copy the whole log to the clipboard"""

    bl_idname = "headwater.copy_log"
    bl_label = "Copy"

    def execute(self, context):
        context.window_manager.clipboard = log.as_text()
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory(
    (HEADWATER_OT_show_log_item, HEADWATER_OT_clear_log, HEADWATER_OT_copy_log)
)
