# SPDX-License-Identifier: Apache-2.0
"""Whether an OpenEXR file is whole, judged by its structure before any library decodes it.

Readers try to rebuild the chunk table of a truncated file, and some (Blender 5.0's among them) crash on the way. The
walk here follows the OpenEXR file layout: header attributes, the table of chunk offsets, each chunk's leader. Pixels
are not decompressed: a few reads a chunk, no dependencies.
"""

import io
import math
import struct

MAGIC = b"\x76\x2f\x31\x01"
_TILED, _DEEP, _MULTIPART = 0x200, 0x800, 0x1000
# Scanlines of a chunk by compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB, HTJ2K 256 and 32.
_LINES = (1, 1, 1, 16, 32, 16, 32, 32, 32, 256, 256, 32)
_MAX_CHUNKS = 1 << 24
_MAX_ATTRIBUTE = 1 << 26


class _Damaged(Exception):
    pass


def exr_damage(source) -> str:
    """What is wrong with the EXR at a path or in bytes; "" when its structure is whole, or when it is no EXR at all.

    OSError when the file can't be read.
    """
    file = io.BytesIO(source) if isinstance(source, bytes | bytearray | memoryview) else open(source, "rb")
    with file:
        length = file.seek(0, io.SEEK_END)
        file.seek(0)
        if file.read(4) != MAGIC:
            return ""
        try:
            _walk(file, length)
        except _Damaged as error:
            return str(error)
        except (struct.error, KeyError, IndexError):
            return "its header is damaged or cut off"
    return ""


def _walk(file, length):
    (version,) = struct.unpack("<I", _exactly(file, 4))
    if version & 0xFF > 2:
        raise _Damaged(f"it is of an unknown version ({version & 0xFF})")
    multipart = bool(version & _MULTIPART)
    headers = []
    while True:
        header = _header(file, length)
        if header is None:
            break
        headers.append(header)
        if not multipart:
            break
    if not headers:
        raise _Damaged("it has no header")
    counts = [_chunk_count(header, version) for header in headers]
    if sum(counts) > _MAX_CHUNKS or file.tell() + 8 * sum(counts) > length:
        raise _Damaged("its table of chunks is cut off")
    offsets = [struct.unpack(f"<{count}Q", _exactly(file, 8 * count)) for count in counts]
    start = file.tell()
    for header, table in zip(headers, offsets, strict=True):
        _check_chunks(file, header, table, version, start, length)


def _exactly(file, count):
    data = file.read(count)
    if len(data) != count:
        raise struct.error
    return data


def _name(file):
    name = b""
    while (byte := _exactly(file, 1)) != b"\0":
        name += byte
        if len(name) > 255:
            raise struct.error
    return name


def _header(file, length):
    """Attributes by name; None for the empty header that ends a multi-part file's."""
    attributes = {}
    while name := _name(file):
        _name(file)  # its type
        (size,) = struct.unpack("<i", _exactly(file, 4))
        if not 0 <= size <= min(_MAX_ATTRIBUTE, length - file.tell()):
            raise struct.error
        attributes[name] = _exactly(file, size)
    return attributes or None


def _chunk_count(header, version) -> int:
    if b"chunkCount" in header:
        (count,) = struct.unpack("<i", header[b"chunkCount"])
        if count < 0:
            raise struct.error
        return count
    x0, y0, x1, y1 = struct.unpack("<4i", header[b"dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    if width < 1 or height < 1:
        raise _Damaged(f"its size is {width} x {height}")
    if not _is_tiled(header, version):
        return -(-height // _LINES[header[b"compression"][0]])
    tile_x, tile_y, mode = struct.unpack("<IIB", header[b"tiles"])
    if not tile_x or not tile_y:
        raise struct.error
    levels, up = mode & 15, mode >> 4

    def tiles(size, tile, level):
        reduced = -(-size // (1 << level)) if up else size >> level
        return -(-max(reduced, 1) // tile)

    def count_levels(size):
        return (math.ceil(math.log2(size)) if up else size.bit_length() - 1) + 1

    if levels == 0:
        return tiles(width, tile_x, 0) * tiles(height, tile_y, 0)
    if levels == 1:
        return sum(tiles(width, tile_x, n) * tiles(height, tile_y, n) for n in range(count_levels(max(width, height))))
    columns = sum(tiles(width, tile_x, n) for n in range(count_levels(width)))
    return columns * sum(tiles(height, tile_y, n) for n in range(count_levels(height)))


def _is_tiled(header, version) -> bool:
    kind = header.get(b"type", b"")
    return kind.rstrip(b"\0") in (b"tiledimage", b"deeptile") if kind else bool(version & _TILED)


def _check_chunks(file, header, table, version, start, length):
    part = 4 if version & _MULTIPART else 0
    tiled = _is_tiled(header, version)
    deep = bool(version & _DEEP) or header.get(b"type", b"").startswith(b"deep")
    leader = part + (16 if tiled else 4)
    for number, offset in enumerate(table):
        where = f"chunk {number + 1} of {len(table)}"
        if offset == 0:
            raise _Damaged(f"it is incomplete: {where} was never written")
        if not start <= offset <= length - leader - (24 if deep else 4):
            raise _Damaged(f"it is cut off: {where} lies outside the file")
        file.seek(offset + leader)
        if deep:
            counts, samples, _ = struct.unpack("<3Q", _exactly(file, 24))
            size = counts + samples
        else:
            (size,) = struct.unpack("<i", _exactly(file, 4))
        if size < 0 or size > length - file.tell():
            raise _Damaged(f"it is cut off or damaged: {where} reaches past the end of the file")
