# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine as Blender sees it. Final frames and animations are made by final.py, viewports by viewport/.

`last_error` is the text of the last render's error, "" when it went well: for headless callers, since Blender's render
operator tells only some failures.
"""

import itertools

import bpy

from . import final, passes, viewport

_tokens = itertools.count(1)


class HeadwaterRenderEngine(bpy.types.RenderEngine):
    bl_idname = "HEADWATER"
    bl_label = "Headwater"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_eevee_viewport = True  # material preview shading is EEVEE's
    bl_use_shading_nodes_custom = False
    bl_use_gpu_context = False  # True would turn persistent data off
    bl_use_spherical_stereo = True
    bl_use_custom_freestyle = False

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.token = next(_tokens)  # tells this engine's dependency graph from another's
        self.job = None
        self.view = None  # of a viewport's engine: viewport.view.View

    def __del__(self):
        try:
            view = getattr(self, "view", None)
        except ReferenceError:  # before Blender 4.4 the engine is gone by now, and what Python kept on it
            return
        if view is not None:
            view.close()

    def update(self, data, depsgraph):
        """Export: the only place where Blender's data may be read safely (it holds the draw lock)."""
        self.job = final.export(self, depsgraph)

    def render(self, depsgraph):
        if self.job is not None:
            final.render(self, self.job, depsgraph)
            self.job = None

    def view_update(self, context, depsgraph):
        viewport.update(self, context, depsgraph)

    def view_draw(self, context, depsgraph):
        viewport.draw(self, context, depsgraph)

    def update_render_passes(self, scene=None, renderlayer=None):
        passes.register(self, scene, renderlayer)


def __getattr__(name):
    if name == "last_error":
        return final.last_error
    raise AttributeError(name)


register, unregister = bpy.utils.register_classes_factory((HeadwaterRenderEngine,))
