# SPDX-License-Identifier: GPL-3.0-or-later
"""Render properties: what log.py holds, newest first; a click on a line selects what it is about."""

import time

import bpy
from bpy.props import IntProperty

from ..log import log
from .panel import ICON, HeadwaterPanel, lines_of

PAGE = 10  # entries shown at once
_ICONS = {"ERROR": "CANCEL", "WARNING": "ERROR"}  # "ERROR" is the name of Blender's warning sign


class HEADWATER_RENDER_PT_log(HeadwaterPanel, bpy.types.Panel):
    bl_label = "Headwater Log"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header_preset(self, _context):
        count = len(log.entries())
        if count:
            self.layout.label(text=str(count))

    def draw(self, context):
        layout, entries = self.layout, log.entries()
        if not entries:
            layout.label(text="Nothing to say", icon="CHECKMARK")
            return
        manager = context.window_manager
        pages = -(-len(entries) // PAGE)
        page = min(manager.headwater_log_page, pages)
        for entry in entries[(page - 1) * PAGE : page * PAGE]:
            _draw_entry(layout.column(align=True), context, entry)
        row = layout.row()
        if pages > 1:
            row.prop(manager, "headwater_log_page", text=f"Page of {pages}")
        row.operator("headwater.copy_log", icon="COPYDOWN")
        row.operator("headwater.clear_log", icon="TRASH")


def _draw_entry(column, context, entry) -> None:
    when = time.strftime("%H:%M:%S", time.localtime(entry.at))
    often = f" (× {entry.times})" if entry.times > 1 else ""
    first, *rest = lines_of(context, f"{when}  {entry.text}{often}", ICON)
    column.scale_y = 0.9
    row = column.row()
    row.alignment = "LEFT"
    icon = _ICONS[entry.severity]
    if not entry.name:
        row.label(text=first, icon=icon)
    else:
        row.operator("headwater.show_log_item", text=first, icon=icon, emboss=False).number = entry.number
    for line in rest:
        row = column.row()
        row.alignment = "LEFT"
        if not entry.name:
            row.label(text=line, icon="BLANK1")
        else:
            row.operator("headwater.show_log_item", text=line, icon="BLANK1", emboss=False).number = entry.number


def register():
    bpy.types.WindowManager.headwater_log_page = IntProperty(
        name="Page", description="Which entries of the log are shown; the first page has the newest", min=1, default=1
    )
    bpy.utils.register_class(HEADWATER_RENDER_PT_log)


def unregister():
    bpy.utils.unregister_class(HEADWATER_RENDER_PT_log)
    del bpy.types.WindowManager.headwater_log_page
