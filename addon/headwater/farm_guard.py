# SPDX-License-Identifier: GPL-3.0-or-later
"""Ends Blender with status 3 where a file could not be rendered by Headwater here: a script for render farms.

  blender -b shot.blend -P farm_guard.py -a
  blender -b shot.blend -E HEADWATER -P farm_guard.py -a

Without the add-on Blender renders a file of ours with another engine, without an error. Keep a copy of this file where
the farm keeps its scripts: the one in the extension is missing exactly where it is needed.
"""

import importlib
import os
import sys

import bpy

STATUS = 3


def complaint() -> str:
    """Why the current scene would not be rendered by Headwater; "" when it would."""
    engines = bpy.types.RenderEngine.__subclasses__()
    engine = next((c for c in engines if getattr(c, "bl_idname", "") == "HEADWATER"), None)
    if engine is None:
        return "the extension is not installed or not enabled in this Blender"
    scene = bpy.context.scene
    if scene.render.engine != "HEADWATER":
        return f'scene "{scene.name}" is set to render with {scene.render.engine or "an unknown engine"} (see -E)'
    native = importlib.import_module(engine.__module__.rpartition(".")[0] + ".native")
    try:
        devices = native.devices()
    except Exception as error:
        return str(error)
    if not any(device.get("usable", True) for device in devices):
        return native.failure() or native.no_devices() or "no Vulkan device can be used"
    return ""


def main():
    """Blender goes on to render after an exception in a script: whatever goes wrong here ends the process."""
    try:
        text = complaint()
    except Exception as error:
        text = f"{type(error).__name__}: {error}"
    if text:
        print(f"farm_guard: Headwater cannot render this file here: {text}", file=sys.stderr)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(STATUS)


main()
