# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions among `bpy.app.handlers` that come and go with the add-on."""

import bpy


def add(handlers) -> None:
    """Appends each function of (name of the list, function)."""
    for name, handler in handlers:
        getattr(bpy.app.handlers, name).append(handler)


def remove(handlers) -> None:
    """Takes them out again; one that is not there (another script emptied the list) is no error."""
    for name, handler in handlers:
        found = getattr(bpy.app.handlers, name)
        if handler in found:
            found.remove(handler)
