# SPDX-License-Identifier: Apache-2.0
"""Open Image Denoise, found and loaded at run time: a host picture and its guides in, a denoised picture out.

Called through the library's C API (version 2; oidn.h of Open Image Denoise 2.x). ctypes lets go of the GIL during
each call, so a thread that denoises does not hold up Blender's interface.
"""

import ctypes
import importlib.util
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

SONAME = "libOpenImageDenoise.so.2"
QUALITIES = {"FAST": 4, "BALANCED": 5, "HIGH": 6}  # OIDNQuality
# As Cycles': NONE trusts the guides as they are; FAST denoises colour and noisy guides together; ACCURATE denoises each
# guide first, then trusts it.
PREFILTERS = ("NONE", "FAST", "ACCURATE")
# Cycles' name for what guides the denoiser -> the render's passes that do, in the order of denoise().
GUIDES = {
    "RGB": (),
    "RGB_ALBEDO": ("Denoising Albedo",),
    "RGB_ALBEDO_NORMAL": ("Denoising Albedo", "Denoising Normal"),
}

_DEVICE_CPU = 1
_FLOAT3 = 3
_CANCELLED = 6

_Monitor = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.c_double)
_pointer, _size, _text = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p
_SIGNATURES = {
    "oidnNewDevice": (_pointer, [ctypes.c_int]),
    "oidnCommitDevice": (None, [_pointer]),
    "oidnReleaseDevice": (None, [_pointer]),
    "oidnGetDeviceInt": (ctypes.c_int, [_pointer, _text]),
    "oidnGetDeviceError": (ctypes.c_int, [_pointer, ctypes.POINTER(_text)]),
    "oidnNewFilter": (_pointer, [_pointer, _text]),
    "oidnReleaseFilter": (None, [_pointer]),
    "oidnSetSharedFilterImage": (None, [_pointer, _text, _pointer, ctypes.c_int] + [_size] * 5),
    "oidnSetFilterBool": (None, [_pointer, _text, ctypes.c_bool]),
    "oidnSetFilterInt": (None, [_pointer, _text, ctypes.c_int]),
    "oidnSetFilterProgressMonitorFunction": (None, [_pointer, _Monitor, _pointer]),
    "oidnCommitFilter": (None, [_pointer]),
    "oidnExecuteFilter": (None, [_pointer]),
}


@dataclass(frozen=True)
class Recipe:
    """How a picture is denoised, in Cycles' words: keys of GUIDES and QUALITIES, one of PREFILTERS."""

    input_passes: str = "RGB_ALBEDO_NORMAL"
    prefilter: str = "ACCURATE"
    quality: str = "HIGH"

    @property
    def guides(self) -> tuple[str, ...]:
        """Passes that the render must make beside Combined."""
        return GUIDES[self.input_passes]

    def run(self, read: Callable[[str], np.ndarray], cancelled: Callable[[], bool] | None = None) -> np.ndarray:
        """Combined, denoised. `read` gives a pass's pixels. Raises as denoise()."""
        guides = [read(name) for name in self.guides]
        return denoise(read("Combined"), *guides, prefilter=self.prefilter, quality=self.quality, cancelled=cancelled)


class DenoiserUnavailable(RuntimeError):
    """Open Image Denoise cannot be used here; the message names each place that was searched."""


class DenoiseCancelled(Exception):
    """The caller's `cancelled` asked to stop."""


def _candidates(library: str) -> Iterator[str | None]:
    """The package's own, what the process has for all (None), then the path given, PyPI's pyoidn, the system's.

    The package's symbols have names of their own (tools/collect_oidn.py). Any other copy would take symbols from the
    one that Blender links with, so that one is taken where there is one.
    """
    yield str(Path(__file__).parent / "oidn" / "lib" / SONAME)
    yield None
    if library:
        yield library
    pyoidn = importlib.util.find_spec("pyoidn")
    if pyoidn is not None and pyoidn.origin:
        yield str(Path(pyoidn.origin).parent / "oidn" / "lib" / SONAME)
    yield SONAME


@cache
def _load(library: str) -> ctypes.CDLL:
    # Not RTLD_DEEPBIND: with Blender's allocator in place of the C library's, one would free what the other allocated.
    failures = []
    for path in _candidates(library):
        try:
            api = ctypes.CDLL(path, mode=os.RTLD_NOW | os.RTLD_LOCAL)
            for name, (result, arguments) in _SIGNATURES.items():
                function = getattr(api, name)
                function.restype, function.argtypes = result, arguments
            return api
        except (OSError, AttributeError) as error:
            failures.append(f"{path or 'this process'} ({error})")
    raise DenoiserUnavailable("Open Image Denoise was not found: tried " + "; ".join(failures))


def _check(api: ctypes.CDLL, device: int | None) -> None:
    message = _text()
    code = api.oidnGetDeviceError(device, ctypes.byref(message))
    if code == _CANCELLED:
        raise DenoiseCancelled
    if code:
        raise RuntimeError(f"Open Image Denoise: {(message.value or b'unknown error').decode(errors='replace')}")


def _device(api: ctypes.CDLL) -> int:
    device = api.oidnNewDevice(_DEVICE_CPU)
    if not device:
        message = _text()
        api.oidnGetDeviceError(None, ctypes.byref(message))
        reason = (message.value or b"no CPU device").decode(errors="replace")
        raise DenoiserUnavailable(f"Open Image Denoise has no CPU device: {reason}")
    api.oidnCommitDevice(device)
    return device


def unavailable() -> str:
    """Why nothing can be denoised here and what to install, for people; "" where it can."""
    try:
        version()
        return ""
    except DenoiserUnavailable:
        return (
            f"Open Image Denoise is not here: {SONAME} is neither in the package nor on the system "
            "(pip install pyoidn, or your system's package of Open Image Denoise 2)"
        )


@cache
def version(library: str = "") -> str:
    """The version of the library found, as "2.5.1". Raises DenoiserUnavailable."""
    api = _load(library)
    device = _device(api)
    try:
        number = api.oidnGetDeviceInt(device, b"version")
        return f"{number // 10000}.{number // 100 % 100}.{number % 100}"
    finally:
        api.oidnReleaseDevice(device)


def _clean(name: str, image: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    if image.shape != shape:
        raise ValueError(f"denoise: {name} has the shape {image.shape}, not {shape}")
    # The network would spread one NaN over its whole neighbourhood.
    return np.ascontiguousarray(np.nan_to_num(image, nan=0.0, posinf=0.0, neginf=0.0), np.float32)


def denoise(
    combined: np.ndarray,
    albedo: np.ndarray | None = None,
    normal: np.ndarray | None = None,
    *,
    prefilter: str = "ACCURATE",
    quality: str = "HIGH",
    cancelled: Callable[[], bool] | None = None,
    library: str = "",
) -> np.ndarray:
    """A denoised copy of `combined`, height x width x 3 or 4 floats, scene linear; a fourth channel is kept.

    `albedo` (0..1) and `normal` (unit vectors) are height x width x 3; a normal needs an albedo. Any thread may call.
    Raises ValueError, DenoiserUnavailable, DenoiseCancelled, or RuntimeError with the library's own words.
    """
    if combined.ndim != 3 or combined.shape[2] not in (3, 4) or 0 in combined.shape:
        raise ValueError(f"denoise: a picture of shape {combined.shape} is not height x width x 3 or 4")
    if quality not in QUALITIES or prefilter not in PREFILTERS:
        raise ValueError(f"denoise: unknown quality {quality!r} or prefilter {prefilter!r}")
    if normal is not None and albedo is None:
        raise ValueError("denoise: a normal guide needs an albedo guide")
    height, width = combined.shape[:2]
    shape = (height, width, 3)
    color = _clean("combined", combined[..., :3], shape)
    guides = {n: _clean(n, g, shape) for n, g in (("albedo", albedo), ("normal", normal)) if g is not None}
    api = _load(library)
    device = _device(api)
    monitor = _Monitor(lambda _user, _done: not (cancelled is not None and cancelled()))

    def execute(images: dict[str, np.ndarray], hdr: bool, clean: bool) -> np.ndarray:
        output = np.empty(shape, np.float32)
        rt = api.oidnNewFilter(device, b"RT")
        try:
            for name, image in (*images.items(), ("output", output)):
                api.oidnSetSharedFilterImage(rt, name.encode(), image.ctypes.data, _FLOAT3, width, height, 0, 0, 0)
            if hdr:
                api.oidnSetFilterBool(rt, b"hdr", True)
            if clean:
                api.oidnSetFilterBool(rt, b"cleanAux", True)
            api.oidnSetFilterInt(rt, b"quality", QUALITIES[quality])
            api.oidnSetFilterProgressMonitorFunction(rt, monitor, None)
            api.oidnCommitFilter(rt)
            api.oidnExecuteFilter(rt)
            _check(api, device)
        finally:
            api.oidnReleaseFilter(rt)
        return output

    try:
        _check(api, device)
        if prefilter == "ACCURATE":
            guides = {name: execute({name: guide}, hdr=False, clean=False) for name, guide in guides.items()}
        clean = bool(guides) and prefilter != "FAST"
        color = execute({"color": color, **guides}, hdr=True, clean=clean)
    finally:
        api.oidnReleaseDevice(device)
    return np.concatenate([color, combined[..., 3:].astype(np.float32)], axis=2)
