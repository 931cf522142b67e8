# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D viewport's header: the button that pauses rendering, at the right of the shading modes."""

import bpy

from .panel import ENGINE


def _draw_pause(self, context):
    if context.engine == ENGINE and context.space_data.shading.type == "RENDERED":
        own = context.scene.headwater
        self.layout.prop(own, "preview_pause", text="", icon="PLAY" if own.preview_pause else "PAUSE")


def register():
    bpy.types.VIEW3D_HT_header.append(_draw_pause)


def unregister():
    bpy.types.VIEW3D_HT_header.remove(_draw_pause)
