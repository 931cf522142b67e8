# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's own panels that hold for every engine: those made for BLENDER_RENDER but the ones that would mislead.

Cycles' panels of core settings (object visibility, film) are not taken: they read `scene.cycles` and need Cycles there.
"""

import bpy

from .panel import ENGINE

# Panels whose settings we don't read or show ourselves.
EXCLUDED = {
    "DATA_PT_light",
    "DATA_PT_preview",
    "MATERIAL_PT_preview",
    "NODE_DATA_PT_light",
    "OBJECT_PT_shading",  # light linking
    "RENDER_PT_freestyle",
    "RENDER_PT_gpencil",
    "RENDER_PT_simplify",
    "RENDER_PT_simplify_render",
    "RENDER_PT_simplify_viewport",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_freestyle",
    "VIEWLAYER_PT_freestyle_edge_detection",
    "VIEWLAYER_PT_freestyle_linestyle",
    "VIEWLAYER_PT_freestyle_lineset",
    "VIEWLAYER_PT_freestyle_style_modules",
    "VIEWLAYER_PT_layer_passes",
    "WORLD_PT_mist",
}

# Wanted though it is not marked for BLENDER_RENDER.
_EXTRA = {"MATERIAL_PT_custom_props", "DATA_PT_custom_props_light"}


def wanted_panels():
    """Registered panels of Blender that should show for this engine."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if not engines or panel.__name__ in EXCLUDED or panel.__module__.startswith(__package__):
            continue
        if "BLENDER_RENDER" in engines or panel.__name__ in _EXTRA:
            yield panel


def register():
    for panel in wanted_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister():
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines and ENGINE in engines and not panel.__module__.startswith(__package__):
            engines.remove(ENGINE)
