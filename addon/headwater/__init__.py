# SPDX-License-Identifier: GPL-3.0-or-later
"""Headwater for Blender: registers the render engine, its settings, panels and operators. Nothing else happens here."""

from . import engine, kept, log, log_operators, operators, preferences, presets, properties, ui, viewport
from .sync import updates

_modules = (log, preferences, properties, operators, log_operators, presets, engine, kept, updates, viewport, ui)


def register():
    """Makes the engine available in this Blender. The native core is loaded by the first use, not here."""
    done = []
    try:
        for module in _modules:
            module.register()
            done.append(module)
    except Exception:
        for module in reversed(done):
            module.unregister()
        raise


def unregister():
    """Takes everything back, ends running renders and frees what they kept."""
    for module in reversed(_modules):
        module.unregister()
