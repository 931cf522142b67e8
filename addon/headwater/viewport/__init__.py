# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendered shading in 3D viewports.

`view.View` is one viewport, on Blender's main thread: it syncs what changed and draws finished pictures. Its
`worker.Worker` renders on a thread of its own, from coarse to fine as `refinement` says. `camera` turns the viewport's
matrices into the core's camera, `draw` puts pixels on the screen, `shading` adds the switches of the shading popover.
"""

from . import shading, view

close_all = view.close_all
update, draw = view.update, view.draw


def register():
    shading.register()
    view.register()


def unregister():
    view.unregister()
    shading.unregister()
