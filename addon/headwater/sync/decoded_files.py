# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that the core decoded, kept for renders that begin anew: F12 without persistent data reads the scene again.

Blender keeps the images that it loads itself. These take their place, and go when another file is loaded.
"""

import dataclasses
import os
import stat

MOST_BYTES = 256 << 20  # of pixels; beyond it those kept longest go first

_kept: dict[tuple, tuple] = {}  # key of nodes/images.py → state of the file, LoadedImage
_bytes = 0


def state(file: bytes | str) -> bytes | tuple:
    """What differs where a file's contents do. OSError when it can't be reached or is no regular file."""
    if isinstance(file, bytes):
        return file
    found = os.stat(file)
    if not stat.S_ISREG(found.st_mode):
        raise OSError(f"{file} is no file")  # reading a pipe may take forever
    return file, found.st_size, found.st_mtime_ns


def find(key: tuple, now, name: str):
    """The image kept under a key, if its file's state is that of now; None otherwise."""
    then, loaded = _kept.get(key, (None, None))
    return dataclasses.replace(loaded, name=name) if loaded is not None and then == now else None


def keep(key: tuple, now, loaded) -> None:
    """Keeps an image, whose pixels nobody writes to any more."""
    global _bytes
    _forget(key)
    if loaded.pixels.nbytes > MOST_BYTES:
        return
    _kept[key] = (now, loaded)
    _bytes += loaded.pixels.nbytes
    while _bytes > MOST_BYTES:
        _forget(next(iter(_kept)))


def forget_all() -> None:
    for key in list(_kept):
        _forget(key)


def _forget(key: tuple) -> None:
    global _bytes
    _, loaded = _kept.pop(key, (None, None))
    if loaded is not None:
        _bytes -= loaded.pixels.nbytes
