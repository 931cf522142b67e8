# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: ours, and Blender's own that are made for every engine."""

from . import camera, header, inherited, light, log, material, object, render, statistics, view_layer, world

_modules = (render, statistics, log, view_layer, camera, light, material, object, world, header, inherited)


def register():
    for module in _modules:
        module.register()


def unregister():
    for module in reversed(_modules):
        module.unregister()
