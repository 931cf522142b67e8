# SPDX-License-Identifier: Apache-2.0
"""Headwater in PyPI's `bpy`: makes the add-on's render engine available without Blender's extension system.

    import bpy, headwater.blender
    headwater.blender.register()
    bpy.context.scene.render.engine = "HEADWATER"

The add-on is taken from the installed wheel (headwater/_addon/headwater) or from the source tree (addon/headwater).
"""

import importlib.util
import sys
from pathlib import Path

MODULE = "headwater_addon"  # the add-on's module name here; as an extension it is bl_ext.<repository>.headwater

_registered = False


def addon_folder() -> Path:
    """The folder of the add-on's __init__.py. Raises ImportError naming the places that were looked at."""
    here = Path(__file__).resolve()
    places = [here.parents[1] / "_addon" / "headwater", here.parents[2] / "addon" / "headwater"]
    for place in places:
        if (place / "__init__.py").is_file():
            return place
    raise ImportError(f"the Blender add-on is not installed; looked in {', '.join(map(str, places))}")


def addon():
    """The add-on's package, imported but not registered."""
    module = sys.modules.get(MODULE)
    if module is None:
        folder = addon_folder()
        spec = importlib.util.spec_from_file_location(
            MODULE, folder / "__init__.py", submodule_search_locations=[str(folder)]
        )
        module = importlib.util.module_from_spec(spec)
        sys.modules[MODULE] = module
        try:
            spec.loader.exec_module(module)
        except BaseException:
            del sys.modules[MODULE]
            raise
    return module


def register():
    """Registers engine, settings, panels and preferences in this process's bpy. Does nothing the second time."""
    global _registered
    import bpy

    if _registered:
        return addon()
    module = addon()
    module.register()
    addons = bpy.context.preferences.addons
    if MODULE not in addons:
        addons.new().module = MODULE  # gives the add-on its preferences; in memory only
    _registered = True
    return module


def unregister():
    """Takes everything back."""
    global _registered
    import bpy

    if not _registered:
        return
    addon().unregister()
    addons = bpy.context.preferences.addons
    if MODULE in addons:
        addons.remove(addons[MODULE])
    _registered = False


def last_error() -> str:
    """The last render's error, "" when it went well. Blender's render operator does not raise for every failure."""
    return sys.modules[MODULE].engine.last_error if MODULE in sys.modules else ""
