# SPDX-License-Identifier: Apache-2.0
"""Texture files for USD scenes: EXR by OpenEXR, Radiance .hdr by the reader here, everything else by Pillow.

Files are untrusted: sizes are checked before pixels are read, and every failure is a UserError naming the file.
"""

from dataclasses import dataclass

import numpy as np

from headwater.errors import UserError, first_line
from headwater.image_io import MAX_PIXELS, PLAIN, read_exr


@dataclass
class Texture:
    """Pixels (H, W, C), bottom row first, C in 1, 3, 4: uint8 as stored, or float32 scene-linear."""

    path: str
    pixels: np.ndarray

    @property
    def is_float(self) -> bool:
        return self.pixels.dtype != np.uint8


def load_texture(path: str) -> Texture:
    """Loads an image file by its content, not its name."""
    try:
        with open(path, "rb") as file:
            magic = file.read(16)
    except OSError as error:
        raise UserError(f"image '{path}' can't be read: {error.strerror or error}") from error
    if not magic:
        raise UserError(f"image '{path}' is empty")
    return load_texture_bytes(path, magic)


def load_texture_bytes(path, magic) -> Texture:
    """As load_texture, with the file's first bytes known."""
    if magic.startswith(b"\x76\x2f\x31\x01"):
        pixels = _exr_pixels(path)
    elif magic.startswith((b"#?RADIANCE", b"#?RGBE")):
        with open(path, "rb") as file:
            pixels = decode_radiance(file.read(), path)
    else:
        pixels = _pillow_pixels(path)
    return Texture(path, np.ascontiguousarray(pixels[::-1]))


def _exr_pixels(path):
    exr = read_exr(path)
    name = PLAIN if PLAIN in exr.layers else next(iter(exr.layers))
    pixels = exr.layers[name]
    count = pixels.shape[2]
    if count == 2:
        return pixels[..., :1]
    return pixels[..., :4] if count > 4 else pixels


def _pillow_pixels(path):
    try:
        from PIL import Image
    except ImportError as error:
        raise UserError(f"image '{path}' needs the Python package Pillow: pip install Pillow") from error
    Image.MAX_IMAGE_PIXELS = None  # judged below, with an error instead of a warning
    try:
        with Image.open(path) as image:
            if not 0 < image.width * image.height <= MAX_PIXELS:
                raise UserError(f"image '{path}': bad size {image.width} x {image.height}")
            if image.mode in ("I;16", "I;16B", "I;16L", "I"):
                values = np.asarray(image).astype(np.float32)
                return (values / 65535.0)[..., None]
            if image.mode == "F":
                return np.asarray(image, np.float32)[..., None]
            alpha = "A" in image.getbands() or "transparency" in image.info
            grey = image.mode in ("L", "1")
            image = image.convert("RGBA" if alpha else "L" if grey else "RGB")
            pixels = np.asarray(image)
            return pixels[..., None] if pixels.ndim == 2 else pixels
    except UserError:
        raise
    except Exception as error:  # Pillow's decoders raise many types on broken files
        raise UserError(f"image '{path}' can't be read: {first_line(error)}") from error


def decode_radiance(data: bytes, path: str) -> np.ndarray:
    """Decodes a Radiance RGBE picture (Ward, "Real Pixels", 1991; Radiance's file format notes) to float32 (H, W, 3).

    Top row first. Handles flat, old and new run-length coded scanlines, and both vertical and horizontal directions.
    """
    try:
        header_end = data.index(b"\n\n") + 2
        line_end = data.index(b"\n", header_end)
        y_axis, height, x_axis, width = data[header_end:line_end].split()
        height, width = int(height), int(width)
        if y_axis not in (b"-Y", b"+Y") or x_axis not in (b"+X", b"-X"):
            raise ValueError("its axes are swapped")
    except ValueError as error:
        raise UserError(f"image '{path}': bad Radiance header ({first_line(error)})") from error
    if b"32-bit_rle_xyze" in data[:header_end]:
        raise UserError(f"image '{path}' is in XYZ, which Headwater does not read")
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise UserError(f"image '{path}': bad size {width} x {height}")
    rgbe = _radiance_scanlines(data, line_end + 1, width, height, path)
    exposure = 1.0
    for line in data[:header_end].split(b"\n"):
        if line.startswith(b"EXPOSURE="):
            try:
                exposure *= float(line[9:])
            except ValueError:
                continue
    scale = np.ldexp(np.float32(1), rgbe[..., 3].astype(np.int32) - 136)
    pixels = rgbe[..., :3].astype(np.float32) * np.where(rgbe[..., 3] > 0, scale, 0)[..., None]
    if exposure > 0 and np.isfinite(exposure):
        pixels /= np.float32(exposure)
    pixels = pixels[:, ::-1] if x_axis == b"-X" else pixels
    return pixels[::-1] if y_axis == b"+Y" else pixels


def _radiance_scanlines(data, position, width, height, path):
    rgbe = np.zeros((height, width, 4), np.uint8)
    raw = np.frombuffer(data, np.uint8)
    try:
        for y in range(height):
            new_coding = (
                8 <= width < 32768 and data[position] == 2 and data[position + 1] == 2 and data[position + 2] < 128
            )
            if new_coding:
                if (data[position + 2] << 8 | data[position + 3]) != width:
                    raise ValueError("a scanline's length is wrong")
                position = _new_runs(data, raw, position + 4, rgbe[y])
            else:
                position = _old_runs(data, raw, position, rgbe[y])
    except (IndexError, ValueError) as error:
        reason = "the file is truncated" if isinstance(error, IndexError) else first_line(error)
        raise UserError(f"image '{path}': {reason}") from error
    return rgbe


def _new_runs(data, raw, position, row):
    width = row.shape[0]
    for component in range(4):
        x = 0
        while x < width:
            count = data[position]
            if count > 128:
                count -= 128
                row[x : x + count, component] = data[position + 1]
                position += 2
            else:
                if position + 1 + count > len(data):
                    raise IndexError
                if not count:
                    raise ValueError("a scanline has an empty run")
                if x + count <= width:
                    row[x : x + count, component] = raw[position + 1 : position + 1 + count]
                position += 1 + count
            x += count
        if x != width:
            raise ValueError("a run goes past its scanline")
    return position


def _old_runs(data, raw, position, row):
    width = row.shape[0]
    # Without any repeat marker (1, 1, 1, n) the scanline is flat.
    flat = raw[position : position + 4 * width]
    if len(flat) == 4 * width:
        flat = flat.reshape(width, 4)
        if not (flat[:, :3] == 1).all(axis=1).any():
            row[:] = flat
            return position + 4 * width
    x, shift = 0, 0
    while x < width:
        pixel = data[position : position + 4]
        if len(pixel) < 4:
            raise IndexError
        position += 4
        if pixel[:3] == b"\x01\x01\x01":
            count = pixel[3] << shift
            if not x or x + count > width:
                raise ValueError("a run goes past its scanline")
            row[x : x + count] = row[x - 1]
            x += count
            shift += 8
        else:
            row[x] = list(pixel)
            x, shift = x + 1, 0
    return position
