# SPDX-License-Identifier: GPL-3.0-or-later
"""The way to the native core: loaded by the first use, with the reason kept when it cannot be; one device context.

A Context (Vulkan device and Tracer) is expensive, so the last one is kept for the next render that asks for the same.
"""

import importlib
import threading

_lock = threading.Lock()
_core = None
_failure = ""
_context = None  # (key, Context)
_devices = None


class NativeError(Exception):
    """The core cannot be used; the text says why, for the artist."""


def core():
    """The module `headwater._core`. Raises NativeError with the reason when it cannot be loaded."""
    global _core, _failure
    if _core is None:
        try:
            _core = importlib.import_module("headwater._core")
            _failure = ""
        except Exception as error:  # a broken driver or library may raise anything while loading
            _failure = f"Headwater's core did not load: {error}"
            raise NativeError(_failure) from error
    return _core


def expected_errors() -> tuple:
    """Types of the core's errors whose text is meant for the artist: bad scene data, and what the device can't do."""
    names = ("SceneError", "DeviceError")
    return tuple(getattr(_core, name) for name in names if hasattr(_core, name))


def failure() -> str:
    """Why the core did not load, or an empty text. Tries to load it."""
    try:
        core()
    except NativeError:
        pass
    return _failure


def devices(refresh: bool = False) -> list[dict]:
    """The core's devices (see docs/architecture.md); an empty list when there is no core or no Vulkan."""
    global _devices
    if _devices is None or refresh:
        try:
            _devices = list(core().devices())
        except NativeError:
            return []
        except Exception as error:
            print(f"Headwater: no devices: {error}")
            _devices = []
    return _devices


def context(device: str = "", tracer: str = "auto", threads: int = 0):
    """A Context for the device of that name ("": the best one). Raises NativeError naming device and reason."""
    global _context
    key = (device, tracer, threads)
    with _lock:
        if _context is not None and _context[0] == key:
            return _context[1]
        module = core()
        _context = None  # let go of the old device first: two at once may not fit in memory
        try:
            made = module.Context(device=device, tracer=tracer, threads=threads)
        except Exception as error:
            raise NativeError(str(error)) from error
        _context = (key, made)
        return made


def release():
    """Lets go of the context and of the loaded module's device list."""
    global _context, _devices
    with _lock:
        _context = None
        _devices = None
