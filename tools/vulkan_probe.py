#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Lists the Vulkan devices that start on this machine, with nothing but Python and the Vulkan loader.

Used by ./dev before anything is built, to decide whether a driver is missing. Structures and numbers follow the Vulkan
1.2 specification: VkInstanceCreateInfo, VkPhysicalDeviceProperties, VkExtensionProperties.

    python3 tools/vulkan_probe.py                 # a line of JSON for each device
    python3 tools/vulkan_probe.py --ray-query     # only those with VK_KHR_ray_query and _ray_tracing_pipeline
Exit status: 0 when a device is listed, 1 when none is. A driver that crashes counts as none.
"""

import argparse
import ctypes
import json
import subprocess
import sys

API_1_2 = (1 << 22) | (2 << 12)
KINDS = ["other", "integrated", "discrete", "virtual", "cpu"]
PROPERTIES_BYTES = 824  # sizeof(VkPhysicalDeviceProperties)
EXTENSION_BYTES = 260  # sizeof(VkExtensionProperties)


class ApplicationInfo(ctypes.Structure):
    _fields_ = [
        ("sType", ctypes.c_int),
        ("pNext", ctypes.c_void_p),
        ("pApplicationName", ctypes.c_char_p),
        ("applicationVersion", ctypes.c_uint32),
        ("pEngineName", ctypes.c_char_p),
        ("engineVersion", ctypes.c_uint32),
        ("apiVersion", ctypes.c_uint32),
    ]


class InstanceCreateInfo(ctypes.Structure):
    _fields_ = [
        ("sType", ctypes.c_int),
        ("pNext", ctypes.c_void_p),
        ("flags", ctypes.c_uint32),
        ("pApplicationInfo", ctypes.POINTER(ApplicationInfo)),
        ("enabledLayerCount", ctypes.c_uint32),
        ("ppEnabledLayerNames", ctypes.c_void_p),
        ("enabledExtensionCount", ctypes.c_uint32),
        ("ppEnabledExtensionNames", ctypes.c_void_p),
    ]


def devices():
    """Vulkan 1.2 devices: dicts of name, kind, api ("1.3.2"), ray_query (and pipelines). OSError or RuntimeError."""
    vk = ctypes.CDLL("libvulkan.so.1")
    app = ApplicationInfo(sType=0, apiVersion=API_1_2)
    info = InstanceCreateInfo(sType=1, pApplicationInfo=ctypes.pointer(app))
    instance = ctypes.c_void_p()
    status = vk.vkCreateInstance(ctypes.byref(info), None, ctypes.byref(instance))
    if status != 0:
        raise RuntimeError(f"vkCreateInstance returned {status}")
    count = ctypes.c_uint32()
    vk.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    handles = (ctypes.c_void_p * max(count.value, 1))()
    vk.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), handles)
    found = []
    for handle in handles[: count.value]:
        device = ctypes.c_void_p(handle)
        raw = ctypes.create_string_buffer(PROPERTIES_BYTES + 1024)
        vk.vkGetPhysicalDeviceProperties(device, raw)
        api, _, _, _, kind = (ctypes.c_uint32 * 5).from_buffer(raw)
        name = raw.raw[20 : 20 + 256].split(b"\0")[0].decode(errors="replace")
        if api < API_1_2:
            continue
        extensions = ctypes.c_uint32()
        vk.vkEnumerateDeviceExtensionProperties(device, None, ctypes.byref(extensions), None)
        buffer = ctypes.create_string_buffer(EXTENSION_BYTES * max(extensions.value, 1))
        vk.vkEnumerateDeviceExtensionProperties(device, None, ctypes.byref(extensions), buffer)
        names = {
            buffer.raw[i * EXTENSION_BYTES : i * EXTENSION_BYTES + 256].split(b"\0")[0] for i in range(extensions.value)
        }
        found.append(
            {
                "name": name,
                "kind": KINDS[kind] if kind < len(KINDS) else "other",
                "api": f"{api >> 22 & 0x7F}.{api >> 12 & 0x3FF}.{api & 0xFFF}",
                "ray_query": {b"VK_KHR_acceleration_structure", b"VK_KHR_ray_query", b"VK_KHR_ray_tracing_pipeline"}
                <= names,
            }
        )
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ray-query", action="store_true", help="only devices with ray queries and ray pipelines")
    parser.add_argument("--quiet", action="store_true", help="print nothing: the exit status answers")
    parser.add_argument("--in-process", action="store_true", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if not args.in_process:
        # A broken driver may take its process down or hang: look from a process of its own.
        command = [sys.executable, __file__, "--in-process", *sys.argv[1:]]
        try:
            return 1 if subprocess.run(command, timeout=60).returncode else 0
        except subprocess.TimeoutExpired:
            print("a Vulkan driver did not answer within 60 s", file=sys.stderr)
            return 1
    try:
        found = [d for d in devices() if d["ray_query"] or not args.ray_query]
    except (OSError, RuntimeError) as error:
        if not args.quiet:
            print(f"no Vulkan: {error}", file=sys.stderr)
        return 1
    if not args.quiet:
        for device in found:
            print(json.dumps(device))
    return 0 if found else 1


if __name__ == "__main__":
    sys.exit(main())
