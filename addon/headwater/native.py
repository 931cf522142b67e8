# SPDX-License-Identifier: GPL-3.0-or-later
"""The way to the native core: loaded by the first use, with the reason kept when it cannot be; one device context.

A Context (Vulkan device and Tracer) is expensive, so the last one is kept for the next render that asks for the same.
"""

import importlib
import threading

import headwater

_lock = threading.Lock()
_core = None
_failure = ""
_context = None  # (key, Context)
_devices = None
_no_devices = ""


class NativeError(Exception):
    """The core cannot be used; the text says why, for the artist."""


def core():
    """The module `headwater._core`. Raises NativeError with the reason when it cannot be loaded."""
    global _core, _failure
    if _core is None:
        _failure = _stale()
        if _failure:
            raise NativeError(_failure)
        try:
            _core = importlib.import_module("headwater._core")
            _failure = ""
        except Exception as error:  # a broken driver or library may raise anything while loading
            _failure = f"Headwater's core did not load: {error}"
            raise NativeError(_failure) from error
    return _core


def _stale() -> str:
    """Says to restart when the extension was updated after this process had loaded the package; "" otherwise.

    A compiled module cannot be loaded twice, and a core of another version may not understand this add-on.
    """
    on_disk = headwater.build_on_disk()
    if headwater.build == on_disk or not on_disk:
        return ""
    return f"Headwater was updated from {headwater.build} to {on_disk} while Blender ran: restart Blender to use it"


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
    global _devices, _no_devices
    if _devices is None or refresh:
        try:
            _devices, _no_devices = list(core().devices()), ""
            if not _devices:
                core().Context()  # says what is missing
        except NativeError:
            return []
        except Exception as error:
            _devices, _no_devices = [], str(error)
    return _devices


def no_devices() -> str:
    """Why `devices` last found none, in the core's words; "" where it was not asked or found some."""
    return _no_devices


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
