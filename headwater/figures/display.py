# SPDX-License-Identifier: Apache-2.0
"""Pictures for eyes: tone mapping, insets, and a contact sheet with labels. 8-bit arrays (H, W, 3), top row first."""

import numpy as np

from headwater.errors import UserError
from headwater.image_io import srgb_encode

INSET_COLOURS = ((255, 196, 0), (0, 200, 255), (255, 90, 160))
_BACK, _INK, _FAINT = (24, 24, 27), (236, 236, 236), (160, 160, 168)
_GAP, _LINE = 8, 17  # pixels
_LEAST = 320  # width of a sheet's column: its labels must fit


def exposure_of(reference) -> float:
    """The factor that brings the reference's middle tones to middle grey; lamps seen directly don't count."""
    grey = np.asarray(reference, float).mean(axis=2)
    lit = grey[np.isfinite(grey) & (grey > 0)]
    if not lit.size:
        return 1.0
    typical = np.quantile(lit, 0.75)
    return float(0.30 / typical) if typical > 0 else 1.0


def tone_map(pixels, exposure: float) -> np.ndarray:
    """Extended Reinhard by the brightest channel, so that hues stay, then sRGB. White from 16 times the exposure on."""
    light = np.clip(np.nan_to_num(np.asarray(pixels, float), nan=0.0, posinf=1e9, neginf=0.0), 0, 1e9) * exposure
    top = np.maximum(light.max(axis=2, keepdims=True), 1e-12)
    shown = light * ((1 + top / 256) / (1 + top))
    return (srgb_encode(shown) * 255 + 0.5).astype(np.uint8)


def crop(picture, inset) -> np.ndarray:
    """The part of a picture that an inset (x, y, width, height in parts) shows: at least 4 x 4 pixels."""
    top, bottom, left, right = _bounds(picture, inset)
    return picture[top:bottom, left:right]


def _bounds(picture, inset):
    height, width = picture.shape[:2]
    x, y, w, h = inset
    wide, tall = min(max(4, round(w * width)), width), min(max(4, round(h * height)), height)
    left, top = min(round(x * width), width - wide), min(round(y * height), height - tall)
    return top, top + tall, left, left + wide


def magnify(picture, width: int) -> np.ndarray:
    """Nearest-neighbour enlargement to `width` pixels: every pixel stays a square."""
    height = max(1, round(picture.shape[0] * width / picture.shape[1]))
    rows = np.arange(height) * picture.shape[0] // height
    columns = np.arange(width) * picture.shape[1] // width
    return picture[rows][:, columns]


def framed(picture, insets) -> np.ndarray:
    """The picture with the insets' outlines in their colours."""
    out = picture.copy()
    for inset, colour in zip(insets, INSET_COLOURS, strict=False):
        top, bottom, left, right = _bounds(picture, inset)
        out[top:bottom, [left, right - 1]] = colour
        out[[top, bottom - 1], left:right] = colour
    return out


def overlay(picture, mask, colour=(255, 255, 255)) -> np.ndarray:
    """The picture with the pixels of a mask (H, W) in a colour."""
    out = picture.copy()
    out[mask] = colour
    return out


def contact_sheet(title: str, columns: list) -> np.ndarray:
    """One picture of a figure. columns: dictionaries of "lines" (text) and "rows": lists of pictures side by side, each
    row as wide as the column's first picture."""
    width = max(columns[0]["rows"][0][0].shape[1], _LEAST)
    blocks = []
    for column in columns:
        parts = [_text(line, width, _INK if i == 0 else _FAINT) for i, line in enumerate(column["lines"])]
        for row in column["rows"]:
            each = (width - 4 * (len(row) - 1)) // len(row)
            cells = [magnify(picture, width if len(row) == 1 else each) for picture in row]
            parts += [_side_by_side(cells, width, 4), _blank(4, width)]
        blocks.append(np.concatenate(parts))
    tall = max(block.shape[0] for block in blocks)
    blocks = [np.concatenate([block, _blank(tall - block.shape[0], width)]) for block in blocks]
    body = _side_by_side(blocks, len(blocks) * width + (len(blocks) - 1) * _GAP, _GAP)
    head = _text(title, body.shape[1], _INK, 15)
    sheet = np.concatenate([head, _blank(4, body.shape[1]), body])
    return np.pad(sheet, ((_GAP, _GAP), (_GAP, _GAP), (0, 0)), constant_values=_BACK[0])


def _blank(height, width):
    return np.broadcast_to(np.array(_BACK, np.uint8), (height, width, 3))


def _side_by_side(pictures, width, gap):
    tall = max(p.shape[0] for p in pictures)
    out = np.array(_blank(tall, width))
    x = 0
    for picture in pictures:
        out[: picture.shape[0], x : x + picture.shape[1]] = picture[:, : width - x]
        x += picture.shape[1] + gap
    return out


def _text(text, width, colour, size=12):
    image, draw, fonts = _pillow()
    strip = image.new("RGB", (width, _LINE + (size - 12)), _BACK)
    pen = draw.Draw(strip)
    font = fonts.load_default(size)
    while text and pen.textlength(text, font=font) > width:
        text = text[:-2].rstrip(" …") + "…" if len(text) > 2 else ""
    pen.text((0, 1), text, fill=colour, font=font)
    return np.asarray(strip)


def _pillow():
    """Pillow's modules; UserError where it is not installed."""
    try:
        from PIL import Image, ImageDraw, ImageFont
    except ImportError as error:
        raise UserError("figures needs the Python package Pillow, for its labels: pip install Pillow") from error
    return Image, ImageDraw, ImageFont


def check_labels() -> None:
    """Raises UserError, before any work, where labels can't be drawn."""
    _pillow()
