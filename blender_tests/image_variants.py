# SPDX-License-Identifier: Apache-2.0
"""PNG and JPEG files of every kind: name → (contents, whether the core reads them itself and not Blender)."""

import io
import struct
import zlib

import numpy as np
from PIL import Image

_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # of PNG's colour types
_ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


def pixels(height: int, width: int, channels: int, seed: int = 0) -> np.ndarray:
    """(H, W, C) uint8: slopes, an edge and some noise, so that filters and cosines have something to do."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:height, :width]
    found = np.stack([(3 * x + 5 * y * (c + 1)) % 256 for c in range(channels)], axis=-1)
    found[x > y] = 255 - found[x > y]
    found += random.integers(-9, 9, found.shape)
    return np.clip(found, 0, 255).astype(np.uint8)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _filtered(rows: np.ndarray, step: int, kind) -> bytes:
    """rows: (H, bytes) uint8. kind: 0 to 4, or None for one after the other."""
    out = bytearray()
    above = np.zeros(rows.shape[1], np.int32)
    for y, row in enumerate(rows.astype(np.int32)):
        use = y % 5 if kind is None else kind
        left = np.concatenate([np.zeros(step, np.int32), row[:-step]])[: len(row)]
        corner = np.concatenate([np.zeros(step, np.int32), above[:-step]])[: len(row)]
        guess = left + above - corner
        a, b, c = abs(guess - left), abs(guess - above), abs(guess - corner)
        paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, above, corner))
        prediction = (0 * row, left, above, (left + above) // 2, paeth)[use]
        out.append(use)
        out += ((row - prediction) % 256).astype(np.uint8).tobytes()
        above = row
    return bytes(out)


def png(
    image: np.ndarray, kind: int, *, filters=None, bits=8, before=(), between=b"", interlaced=False, pieces=1
) -> bytes:
    """image: (H, W, C) uint8. kind: PNG's colour type. before, between: chunks before and within the pixels."""
    height, width, channels = image.shape
    assert channels == _CHANNELS[kind]
    step = channels * bits // 8
    data = b""
    passes = _ADAM7 if interlaced else ((0, 0, 1, 1),)
    for x, y, dx, dy in passes:
        part = image[y::dy, x::dx]
        if part.size:
            wide = part.repeat(2, axis=2) if bits == 16 else part
            data += _filtered(wide.reshape(part.shape[0], -1), step, filters)
    packed = zlib.compress(data)
    cuts = np.linspace(0, len(packed), pieces + 1).astype(int)
    idat = [_chunk(b"IDAT", packed[a:b]) for a, b in zip(cuts, cuts[1:], strict=False)]
    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, int(interlaced))
    parts = [_chunk(b"IHDR", header), *before, idat[0], between, *idat[1:], _chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def jpeg(image: np.ndarray, mode: str = "RGB", **settings) -> bytes:
    out = io.BytesIO()
    Image.fromarray(image[..., 0] if mode == "L" else image, mode).save(out, "JPEG", **({"quality": 80} | settings))
    return out.getvalue()


def _pngs() -> dict:
    found = {}
    for kind, name in ((0, "grey"), (2, "rgb"), (6, "rgba")):
        channels = _CHANNELS[kind]
        for filters in (0, 1, 2, 3, 4, None):
            found[f"{name} filter {filters}"] = (png(pixels(19, 23, channels), kind, filters=filters), True)
        for height, width in ((1, 1), (1, 9), (9, 1), (2, 257)):
            found[f"{name} {width}x{height}"] = (png(pixels(height, width, channels), kind), True)
        found[f"{name} in pieces"] = (png(pixels(40, 30, channels), kind, pieces=7), True)
        found[f"{name} 16 bit"] = (png(pixels(8, 9, channels), kind, bits=16), False)
        found[f"{name} interlaced"] = (png(pixels(21, 13, channels), kind, interlaced=True), False)
    rgb = pixels(12, 11, 3)
    gamma, srgb = _chunk(b"gAMA", struct.pack(">I", 100000)), _chunk(b"sRGB", b"\0")
    profile = _chunk(b"iCCP", b"x\0\0" + zlib.compress(b"no profile at all"))
    sizes = _chunk(b"pHYs", struct.pack(">IIB", 99, 33, 1)) + _chunk(b"tEXt", b"Comment\0words")
    found["rgb gamma 1"] = (png(rgb, 2, before=(gamma,)), True)
    found["rgba gamma 1"] = (png(pixels(12, 11, 4), 6, before=(gamma,)), True)
    found["rgb sRGB"] = (png(rgb, 2, before=(srgb,)), True)
    found["rgb profile"] = (png(rgb, 2, before=(profile,)), True)
    found["rgb text"] = (png(rgb, 2, before=(sizes,)), True)
    found["rgb significant bits"] = (png(rgb, 2, before=(_chunk(b"sBIT", b"\5\6\5"),)), True)
    found["rgb background"] = (png(rgb, 2, before=(_chunk(b"bKGD", b"\0\1\0\2\0\3"),)), True)
    found["rgb suggested palette"] = (png(rgb, 2, before=(_chunk(b"PLTE", bytes(range(12))),)), True)
    key = struct.pack(">HHH", *(int(v) for v in rgb[3, 3]))
    found["rgb transparent colour"] = (png(rgb, 2, before=(_chunk(b"tRNS", key),)), False)
    found["grey transparent"] = (png(rgb[..., :1], 0, before=(_chunk(b"tRNS", b"\0\x20"),)), False)
    found["grey alpha"] = (png(pixels(12, 11, 2), 4), False)
    palette = _chunk(b"PLTE", np.random.default_rng(2).integers(0, 256, 768).astype(np.uint8).tobytes())
    found["palette"] = (png(rgb[..., :1], 3, before=(palette,)), False)
    found["rgba opaque"] = (png(np.concatenate([rgb, np.full_like(rgb[..., :1], 255)], axis=2), 6), True)
    return {f"png {name}": value for name, value in found.items()}


def _jpegs() -> dict:
    found = {}
    for subsampling in (0, 1, 2):
        for quality in (20, 90):
            for progressive in (False, True):
                name = f"sampling {subsampling} quality {quality} progressive {progressive}"
                settings = dict(subsampling=subsampling, quality=quality, progressive=progressive)
                found[name] = (jpeg(pixels(67, 83, 3), **settings), True)
    for height, width in ((1, 1), (1, 17), (17, 1), (8, 8), (15, 33)):
        found[f"{width}x{height}"] = (jpeg(pixels(height, width, 3)), True)
        found[f"grey {width}x{height}"] = (jpeg(pixels(height, width, 1), "L"), True)
    found["optimized"] = (jpeg(pixels(50, 40, 3), optimize=True), True)
    found["restarts"] = (jpeg(pixels(50, 40, 3), restart_marker_blocks=2), True)
    found["grey progressive"] = (jpeg(pixels(50, 40, 1), "L", progressive=True), True)
    found["kept rgb"] = (jpeg(pixels(50, 40, 3), keep_rgb=True), True)
    found["cmyk"] = (jpeg(pixels(20, 30, 4), "CMYK"), False)
    turned = Image.Exif()
    turned[0x0112] = 6
    found["orientation"] = (jpeg(pixels(20, 30, 3), exif=turned), True)
    found["profile"] = (jpeg(pixels(20, 30, 3), icc_profile=b"no profile at all"), True)
    found["comment"] = (jpeg(pixels(20, 30, 3), comment=b"words"), True)
    found["more after the end"] = (jpeg(pixels(20, 30, 3)) + b"more", True)
    return {f"jpeg {name}": value for name, value in found.items()}


def _others() -> dict:
    found = {}
    for kind in ("BMP", "TIFF", "TGA", "WEBP"):
        out = io.BytesIO()
        Image.fromarray(pixels(9, 8, 3)).save(out, kind)
        found[kind] = (out.getvalue(), False)
    return found


def variants() -> dict[str, tuple[bytes, bool]]:
    return _pngs() | _jpegs() | _others()
