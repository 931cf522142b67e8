# SPDX-License-Identifier: Apache-2.0
"""Render results on disk: multilayer OpenEXR in and out, PNG out.

EXR layers are named as Blender names them, "<view layer>.<pass>.<channel>", in one part, so that compositors and
`compare` find Cycles' names. Arrays in memory are float32 (H, W, C), scene-linear Rec. 709, with the top row first
unless a function says otherwise. Which libraries are used, and why: docs/decisions/0004-image-io.md.
"""

import os
import struct
import zlib
from dataclasses import dataclass, field

import numpy as np

from headwater.errors import UserError, first_line
from headwater.exr_structure import MAGIC, exr_damage
from headwater.output import atomic_path
from headwater.quiet import captured_output

MAX_PIXELS = 1 << 29  # a size no render has: a corrupt header must not make us allocate the machine's memory
HALF_MAX = 65504.0
PLAIN = ""  # name of the layer that holds an EXR's bare R, G, B, A channels

# Channel letters of passes that hold data; these stay 32-bit in half files, as in Blender. Everything else is colour.
DATA_CHANNELS = {
    "Depth": "Z",
    "Mist": "Z",
    "Denoising Depth": "Z",
    "Position": "XYZ",
    "Normal": "XYZ",
    "Denoising Normal": "XYZ",
    "Vector": "XYZW",
    "UV": "UVA",
    "Object Index": "X",
    "Material Index": "X",
}
_CHANNEL_ORDER = {letter: i for i, letter in enumerate("RGBXYZWUVA")}


@dataclass
class ExrFile:
    """What an EXR holds: arrays by layer name ("" for bare RGBA), their channel letters, and text attributes."""

    path: str
    layers: dict = field(default_factory=dict)  # name -> (H, W, C) float32, top row first
    channels: dict = field(default_factory=dict)  # name -> "RGBA" and the like
    attributes: dict = field(default_factory=dict)

    @property
    def size(self):
        """(width, height) in pixels."""
        height, width = next(iter(self.layers.values())).shape[:2]
        return width, height


def pass_channels(name: str, count: int) -> str:
    """Channel letters of the pass `name` with `count` channels."""
    letters = DATA_CHANNELS.get(name, {1: "X", 2: "XY", 3: "RGB", 4: "RGBA"}.get(count, ""))
    if len(letters) != count:
        raise ValueError(f"pass '{name}' has {count} channels, not {len(letters)}")
    return letters


def _openexr():
    try:
        import OpenEXR
    except ImportError as error:
        raise UserError("EXR files need the Python package OpenEXR: pip install OpenEXR") from error
    return OpenEXR


def read_exr(path: str) -> ExrFile:
    """Reads all parts and channels of an EXR. Raises UserError naming the file and the reason."""
    openexr = _openexr()
    if not os.path.isfile(path):
        raise UserError(f"'{path}': {'is a folder' if os.path.isdir(path) else 'no such file'}")
    try:
        with open(path, "rb") as file:
            if file.read(4) != MAGIC:
                raise UserError(f"'{path}' is not an EXR file")
        if damage := exr_damage(path):
            raise UserError(f"'{path}' is damaged or truncated: {damage}")
        for part in openexr.File(path, separate_channels=True, header_only=True).parts:
            lower, upper = part.header["dataWindow"]
            width, height = (int(upper[i]) - int(lower[i]) + 1 for i in (0, 1))
            if width < 1 or height < 1 or width * height > MAX_PIXELS:
                raise UserError(f"'{path}': bad size {width} x {height}")
        with captured_output() as captured:  # the library tells of broken chunks on stderr and goes on
            parts = openexr.File(path, separate_channels=True).parts
            complaint = captured()
        if "EXR_ERR" in complaint:
            raise UserError(f"'{path}' is damaged or truncated: {complaint.split(') ', 1)[-1].strip().splitlines()[0]}")
    except UserError:
        raise
    except Exception as error:  # the binding throws RuntimeError, ValueError, MemoryError and its own types
        raise UserError(f"'{path}' is damaged or truncated: {first_line(error)}") from error
    return _collect_layers(path, parts)


def _collect_layers(path, parts) -> ExrFile:
    result = ExrFile(path)
    grouped = {}
    for part in parts:
        for key, value in part.header.items():
            if isinstance(value, (str, int, float)):
                result.attributes.setdefault(key, value)
        for full_name, channel in part.channels.items():
            pixels = channel.pixels
            if channel.xSampling != 1 or channel.ySampling != 1:
                raise UserError(f"'{path}': channel '{full_name}' is subsampled, which Headwater does not read")
            if pixels is None or pixels.ndim != 2 or not pixels.size:
                raise UserError(f"'{path}': channel '{full_name}' has no pixels")
            layer, _, letter = full_name.rpartition(".")
            grouped.setdefault(layer, {})[letter] = pixels
    if not grouped:
        raise UserError(f"'{path}' holds no channels")
    for layer, by_letter in grouped.items():
        letters = sorted(by_letter, key=lambda c: (_CHANNEL_ORDER.get(c.upper(), 99), c))
        if len({by_letter[c].shape for c in letters}) != 1:
            raise UserError(f"'{path}': channels of layer '{layer}' differ in size")
        result.layers[layer] = np.stack([by_letter[c].astype(np.float32) for c in letters], axis=2)
        result.channels[layer] = "".join(letters) if all(len(c) == 1 for c in letters) else ",".join(letters)
    return result


def select_layer(exr: ExrFile, layer: str | None = None, pass_name: str | None = None) -> str:
    """The full name of the one layer meant by a view layer's name and a pass's name; both may be left out.

    Without a pass, bare RGBA or the pass Combined is meant. Raises UserError listing what the file has.
    """
    names = list(exr.layers)
    if layer is None and pass_name is None and PLAIN in exr.layers:
        return PLAIN
    wanted = pass_name or ("Combined" if len(names) > 1 else None)
    found = []
    for name in names:
        head, _, tail = name.rpartition(".")
        if layer is not None and layer not in (head, name):
            continue
        if wanted is None or wanted in (tail, name) or (wanted == "Combined" and name == PLAIN) or layer == name:
            found.append(name)
    if len(found) == 1:
        return found[0]
    asked = ".".join(part for part in (layer, pass_name or wanted) if part) or "an image"
    listing = ", ".join(f"'{name}'" if name else "bare RGBA" for name in sorted(found or names))
    reason = f"'{asked}' is ambiguous" if found else f"has no '{asked}'"
    raise UserError(f"'{exr.path}' {reason}; it holds: {listing}")


def colour_channels(exr: ExrFile, name: str) -> np.ndarray:
    """A layer without its alpha channel."""
    letters = exr.channels[name]
    keep = [i for i, c in enumerate(letters) if c.upper() != "A" or len(letters) == 1]
    return exr.layers[name][..., keep]


def to_half(pixels: np.ndarray) -> np.ndarray:
    """float32 to half; finite values beyond half's range are clamped to it rather than turned into infinities."""
    clamped = np.where(np.isfinite(pixels), np.clip(pixels, -HALF_MAX, HALF_MAX), pixels)
    with np.errstate(over="ignore"):
        return clamped.astype(np.float16)


def write_exr(path, passes, *, view_layer="ViewLayer", depth="half", attributes=None) -> None:
    """Writes passes {name: (H, W, C) float32, bottom row first} to `path`, all or nothing, ZIP-compressed.

    Combined alone becomes bare RGBA channels; more passes become "<view_layer>.<pass>.<channel>". `depth` is "half" or
    "float"; data passes are float in both. `attributes`: text or numbers for the header.
    """
    openexr = _openexr()
    if depth not in ("half", "float"):
        raise ValueError(f"EXR depth '{depth}'")
    channels = {}
    for name, pixels in passes.items():
        letters = pass_channels(name, pixels.shape[2])
        prefix = "" if list(passes) == ["Combined"] else f"{view_layer}.{name}."
        half = depth == "half" and name not in DATA_CHANNELS
        for i, letter in enumerate(letters):
            plane = np.ascontiguousarray(pixels[::-1, :, i], np.float32)
            channels[prefix + letter] = to_half(plane) if half else plane
    header = {"compression": openexr.ZIP_COMPRESSION, "type": openexr.scanlineimage}
    header.update(attributes or {})
    with atomic_path(path) as temporary:
        try:
            openexr.File(header, channels).write(temporary)
        except Exception as error:
            raise UserError(f"output '{path}' can't be written: {first_line(error)}") from error


def srgb_encode(linear: np.ndarray) -> np.ndarray:
    """Linear to sRGB (IEC 61966-2-1), clipped to 0..1: Blender's "Standard" view transform."""
    linear = np.clip(np.nan_to_num(linear, nan=0.0), 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.power(linear, 1 / 2.4) - 0.055)


def write_png(path, combined, *, alpha=False) -> None:
    """Writes Combined (H, W, 4) float32, bottom row first, as 8-bit sRGB; with straight alpha where `alpha`."""
    colour = combined[::-1, :, :3]
    if alpha:
        coverage = np.clip(np.nan_to_num(combined[::-1, :, 3:4]), 0, 1)
        straight = np.divide(colour, coverage, out=np.zeros_like(colour), where=coverage > 0)
        write_png8(path, np.concatenate([_to_bytes(srgb_encode(straight)), _to_bytes(coverage)], axis=2))
    else:
        write_png8(path, _to_bytes(srgb_encode(colour)))


def _to_bytes(values):
    return (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)


def write_png8(path, pixels) -> None:
    """Writes uint8 (H, W, 3 or 4) pixels, top row first, as an sRGB PNG (ISO/IEC 15948), all or nothing."""
    height, width, channels = pixels.shape
    rows = np.ascontiguousarray(pixels, np.uint8).reshape(height, width * channels)
    # Filter 1 (Sub) on every row: renders compress better as differences from the pixel on the left.
    filtered = rows.copy()
    filtered[:, channels:] -= rows[:, :-channels]
    raw = np.concatenate([np.ones((height, 1), np.uint8), filtered], axis=1).tobytes()

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"sRGB", b"\0"))
        file.write(chunk(b"IDAT", zlib.compress(raw, 6)) + chunk(b"IEND", b""))
