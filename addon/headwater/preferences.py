# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences: the device that renders, and why the core cannot be used when it cannot."""

import bpy
from bpy.props import EnumProperty, IntProperty

from headwater import denoiser

from . import native

_items = []  # Blender keeps no reference to the texts of a dynamic enum: they must stay alive here

INSTALL = (
    "Install your GPU's driver or, to render on the CPU, lavapipe:",
    "Debian, Ubuntu: sudo apt install mesa-vulkan-drivers · Fedora: sudo dnf install mesa-vulkan-drivers",
    "Arch: sudo pacman -S vulkan-swrast · then press Refresh Devices or restart Blender",
)

_KINDS = {"discrete": "GPU", "integrated": "Integrated GPU", "virtual": "Virtual GPU", "cpu": "CPU"}


def _device_items(_self, _context):
    global _items
    items = [("AUTO", "Automatic", "The most able device: discrete GPU, integrated GPU, CPU", 0)]
    seen = {"AUTO"}
    for device in native.devices():
        name = device["name"]
        if not device.get("usable", True) or name in seen:
            continue
        seen.add(name)
        kind = _KINDS.get(str(device.get("kind", "")).lower(), str(device.get("kind", "")))
        # The number is what Blender stores: derived from the name so that another device list does not shift it.
        number = sum((i + 1) * ord(c) for i, c in enumerate(name)) % 0x7FFFFFFF
        items.append((name, f"{name} ({kind})" if kind else name, str(device.get("driver", "")), number))
    _items = items
    return _items


class HeadwaterPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    device: EnumProperty(name="Device", description="Device that renders", items=_device_items)
    memory_limit: IntProperty(
        name="Memory Limit",
        description="Most device memory in MiB that a render may take; one that needs more ends with an error. "
        "0: no limit",
        default=0,
        min=0,
        soft_max=1 << 16,
    )

    def draw(self, _context):
        layout = self.layout
        layout.use_property_split = True
        why = native.failure()
        if why:
            column = layout.column()
            column.alert = True
            lines = _wrapped(why)
            for line in lines:
                column.label(text=line, icon="ERROR" if line == lines[0] else "NONE")
            return
        layout.prop(self, "device")
        layout.prop(self, "memory_limit")
        box = layout.box().column()
        found = native.devices()
        if not found:
            box.label(text="No Vulkan device found", icon="ERROR")
            for line in _wrapped(native.no_devices()):
                box.label(text=line)
        if not any(device.get("usable", True) for device in found):
            for line in INSTALL:
                box.label(text=line)
        for device in found:
            row = box.row()
            usable = device.get("usable", True)
            memory = device.get("memory", 0) / 2**30
            text = f"{device['name']} · {device.get('driver', '')} · Vulkan {device.get('api', '')} · {memory:.1f} GiB"
            row.label(text=text, icon="CHECKMARK" if usable else "X")
            if not usable:
                box.label(text=f"Not usable: {device.get('why_not', 'unknown reason')}")
        layout.operator("headwater.refresh_devices")
        missing = denoiser.unavailable()
        for line in _wrapped(missing) if missing else ():
            layout.label(text=line, icon="ERROR" if missing.startswith(line) else "BLANK1")


def _wrapped(text: str, width: int = 100) -> list[str]:
    import textwrap

    return [line for part in text.splitlines() for line in textwrap.wrap(part, width)]


def _own():
    addon = bpy.context.preferences.addons.get(__package__)
    return getattr(addon, "preferences", None)


def memory_limit() -> int:
    """The most device memory a render may take, in bytes; 0: no limit."""
    return getattr(_own(), "memory_limit", 0) << 20


def chosen_device() -> str:
    """The preferred device's name; "" for the most able one, or where the add-on has no preferences."""
    device = getattr(_own(), "device", "AUTO")
    return "" if device in ("AUTO", "") else device


def register():
    bpy.utils.register_class(HeadwaterPreferences)


def unregister():
    bpy.utils.unregister_class(HeadwaterPreferences)
    native.release()
