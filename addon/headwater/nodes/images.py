# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of Blender images as the core takes them, in Cycles' conventions.

8-bit images stay 8-bit with a flag for sRGB, decoded after filtering. Colour with alpha is premultiplied (so that
filtering does not bleed), but for data and for the channel-packed and "none" alpha modes.
"""

import os
import re
from dataclasses import dataclass, field

import bpy
import numpy as np

from headwater.exr_structure import exr_damage

_LINEAR = {"Linear Rec.709", "Linear", "scene_linear", "Raw", "Non-Color", "Generic Data"}
_SRGB = {"sRGB", "Filmic sRGB", "AgX Base sRGB"}
_PIECE = 1 << 15


@dataclass(frozen=True, eq=False)
class ImageRequest:
    """An image a material reads; `frame`: of a sequence or movie, else 0."""

    image: bpy.types.Image
    frame: int = 0


@dataclass
class LoadedImage:
    """pixels: (H, W, C) uint8, float16 or float32, bottom row first; None: the image is missing."""

    name: str
    pixels: np.ndarray | None
    srgb: bool = False
    premultiplied: bool = False
    notes: list = field(default_factory=list)


def image_key(request: ImageRequest) -> tuple:
    """Equal for requests that load the same pixels. Stable over undo and renaming."""
    img = request.image
    return (img.original.session_uid, request.frame, img.colorspace_settings.name, img.alpha_mode)


def plain_file(request: ImageRequest) -> bytes | str | None:
    """The file that Blender would read an image's pixels from, its contents or its path; None: ask Blender for them.

    Blender's memory counts where it has the pixels, and they may have been edited there; sequences, movies, tiles and
    stereo pictures are more than a file.
    """
    img = request.image
    if img.source != "FILE" or img.type != "IMAGE" or img.has_data or img.is_dirty or img.use_multiview:
        return None
    if len(img.packed_files):
        return img.packed_files[0].packed_file.data if len(img.packed_files) == 1 else None
    path = bpy.path.abspath(img.filepath, library=img.library)
    try:
        path.encode()
    except UnicodeEncodeError:  # a name that is no UTF-8
        return None
    return path


def decoded(request: ImageRequest, pixels: np.ndarray, opaque: bool) -> LoadedImage | None:
    """An image whose file the core decoded; None: Blender changes such pixels when it loads them.

    pixels: (H, W, 4) uint8, bottom row first, may be written to. opaque: its alpha is 255 everywhere.
    """
    img = request.image
    if img.alpha_mode == "PREMUL" and not opaque:
        return None
    return _finish_bytes(img, pixels, LoadedImage(img.name, None), opaque)


def _is_data(img) -> bool:
    return bool(getattr(img.colorspace_settings, "is_data", img.colorspace_settings.name == "Non-Color"))


def load_pixels(request: ImageRequest) -> LoadedImage:
    """Loads an image. Never raises for a bad file: the result is then missing, with a note."""
    img = request.image
    loaded = LoadedImage(img.name, None)
    try:
        if img.source == "SEQUENCE":
            return _load_sequence(request, loaded)
        if img.source == "MOVIE":
            loaded.notes.append(f"Image '{img.name}': movies are not supported; the loaded frame is used")
        if damage := _exr_damage(img):
            loaded.notes.append(f"Image '{img.name}': it can't be read: {damage} ({img.filepath or 'packed'})")
            return loaded
        pixels = _read(img)
    except (OSError, RuntimeError, ValueError, MemoryError) as error:
        loaded.notes.append(f"Image '{img.name}': it can't be read ({error})")
        return loaded
    if pixels is None:
        path = img.filepath or "no file"
        loaded.notes.append(f"Image '{img.name}': it is missing or can't be read ({path})")
        return loaded
    return _finish(img, pixels, img.is_float, loaded)


def _exr_damage(img) -> str:
    """What is wrong with the EXR that Blender is about to load; its reader crashes on some truncated ones (5.0.1)."""
    if img.has_data or img.source not in ("FILE", "TILED"):
        return ""
    if img.packed_file is not None:
        return exr_damage(img.packed_file.data)
    path = bpy.path.abspath(img.filepath, library=img.library)
    tiles = [path.replace("<UDIM>", str(tile.number)) for tile in img.tiles] if img.source == "TILED" else [path]
    return next((damage for tile in tiles if os.path.isfile(tile) and (damage := exr_damage(tile))), "")


def _read(img):
    """(H, W, C) float32 as Blender's `pixels` gives them, or None."""
    width, height = img.size
    channels = img.channels
    if width == 0 or height == 0 or channels == 0:
        return None
    pixels = np.empty(width * height * channels, np.float32)
    img.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, channels) if img.has_data or img.source == "GENERATED" else None


def _load_sequence(request, loaded: LoadedImage) -> LoadedImage:
    from headwater.errors import UserError
    from headwater.texture_io import load_texture

    img = request.image
    path = bpy.path.abspath(img.filepath, library=img.library)
    folder, name = os.path.split(path)
    digits = list(re.finditer(r"\d+", name))
    if digits:
        last = digits[-1]
        name = f"{name[: last.start()]}{request.frame:0{len(last[0])}d}{name[last.end() :]}"
    try:
        texture = load_texture(os.path.join(folder, name))
    except UserError as error:
        loaded.notes.append(f"Image '{img.name}', frame {request.frame}: {error}")
        return loaded
    pixels = texture.pixels
    if not texture.is_float:
        pixels = pixels.astype(np.float32) * (1.0 / 255.0)
    return _finish(img, pixels, texture.is_float, loaded)


def _finish(img, pixels, is_float: bool, loaded: LoadedImage) -> LoadedImage:
    if pixels.shape[2] == 2:
        pixels = np.concatenate([np.repeat(pixels[..., :1], 3, axis=2), pixels[..., 1:]], axis=2)
    return _finish_floats(img, pixels, loaded) if is_float else _finish_bytes(img, to_bytes(pixels), loaded)


def _has_alpha(img, pixels, loaded: LoadedImage) -> bool:
    """Whether an image's alpha counts; tells `loaded` whether it is multiplied in."""
    alpha = pixels.shape[2] == 4 and img.alpha_mode != "NONE"
    loaded.premultiplied = alpha and not _is_data(img) and img.alpha_mode in ("STRAIGHT", "PREMUL")
    return alpha


def _finish_floats(img, pixels, loaded: LoadedImage) -> LoadedImage:
    # Blender keeps float images scene-linear; those with straight alpha are premultiplied when they are loaded.
    if not _has_alpha(img, pixels, loaded) and pixels.shape[2] == 4:
        pixels[..., 3] = 1.0
    if not np.isfinite(pixels).all():
        loaded.notes.append(f"Image '{img.name}': it has pixels that are not finite; they are taken as 0")
        pixels = np.nan_to_num(pixels, nan=0.0, posinf=0.0, neginf=0.0)
    half = img.depth <= 16 * img.channels and float(np.abs(pixels).max(initial=0.0)) < 65504.0
    loaded.pixels = pixels.astype(np.float16) if half and img.depth else pixels
    return loaded


def _finish_bytes(img, pixels, loaded: LoadedImage, opaque: bool = False) -> LoadedImage:
    data, space = _is_data(img), img.colorspace_settings.name
    alpha = _has_alpha(img, pixels, loaded)
    if not data and space not in _LINEAR and space not in _SRGB:
        loaded.notes.append(f"Image '{img.name}': colour space '{space}' is read as sRGB")
    loaded.srgb = not data and space not in _LINEAR
    loaded.pixels = pixels
    if loaded.premultiplied and not opaque and pixels[..., 3].min(initial=255) < 255:  # rounding down, as Cycles
        rgb, opacity = pixels[..., :3], pixels[..., 3:].astype(np.uint16)
        rgb[...] = (rgb * opacity // 255).astype(np.uint8)
    if pixels.shape[2] == 4 and not alpha:
        pixels[..., 3] = 255
    return loaded


def to_bytes(pixels: np.ndarray) -> np.ndarray:
    """Contiguous float32 from 0 to 1 as the nearest bytes, in pieces that stay in a core's cache."""
    flat = pixels.reshape(-1)
    found = np.empty(flat.shape, np.uint8)
    scaled = np.empty(min(len(flat), _PIECE), np.float32)
    for start in range(0, len(flat), _PIECE):
        piece = flat[start : start + _PIECE]
        work = scaled[: len(piece)]
        np.multiply(piece, np.float32(255.0), out=work)
        work += np.float32(0.5)
        np.copyto(found[start : start + _PIECE], work, casting="unsafe")
    return found.reshape(pixels.shape)
