# SPDX-License-Identifier: Apache-2.0
"""Where results go: names with frame numbers, the check before rendering, writes that are all or nothing."""

import os
import re
import tempfile
from contextlib import contextmanager

from headwater.errors import EXIT_USAGE, UserError, first_line

EXTENSIONS = (".exr", ".png")


def frame_path(pattern: str, frame: int, *, animated: bool) -> str:
    """`pattern` with its last run of # replaced by the frame number, zero-padded, as Blender does.

    An animation whose pattern has no # gets four digits before the extension.
    """
    folder, name = os.path.split(pattern)
    runs = list(re.finditer("#+", name))
    if runs:
        start, end = runs[-1].span()
        number = f"{'-' if frame < 0 else ''}{abs(frame):0{end - start}d}"
        return os.path.join(folder, name[:start] + number + name[end:])
    if not animated:
        return pattern
    stem, extension = os.path.splitext(name)
    return os.path.join(folder, f"{stem}{'-' if frame < 0 else ''}{abs(frame):04d}{extension}")


def check_output(path: str, extensions=EXTENSIONS) -> str:
    """Absolute path of an output that can be written: its folder exists (made if need be) and takes new files.

    Raises UserError, before any work is done, naming the reason.
    """
    path = os.path.abspath(path)
    extension = os.path.splitext(path)[1].lower()
    if extensions and extension not in extensions:
        raise UserError(f"output '{path}': the name must end in {' or '.join(extensions)}", EXIT_USAGE)
    if os.path.isdir(path):
        raise UserError(f"output '{path}' is a folder", EXIT_USAGE)
    folder = os.path.dirname(path)
    try:
        os.makedirs(folder, exist_ok=True)
        handle, probe = tempfile.mkstemp(prefix=".headwater-", dir=folder)
        os.close(handle)
        os.unlink(probe)
    except OSError as error:
        raise UserError(f"output '{path}' can't be written: {error.strerror or error}", EXIT_USAGE) from error
    if os.path.exists(path) and not os.access(path, os.W_OK):
        raise UserError(f"output '{path}' is write-protected", EXIT_USAGE)
    return path


@contextmanager
def atomic_path(path: str):
    """Gives a temporary path beside `path` (same extension) and moves it over `path` when the block ends well.

    On any exception the temporary file is removed and `path` keeps what it had.
    """
    path = os.path.abspath(path)
    extension = os.path.splitext(path)[1]
    try:
        handle, temporary = tempfile.mkstemp(prefix=".headwater-", suffix=extension, dir=os.path.dirname(path))
    except OSError as error:
        raise UserError(f"output '{path}' can't be written: {error.strerror or error}") from error
    os.close(handle)
    try:
        yield temporary
        mask = os.umask(0)  # mkstemp makes private files; results get the permissions any new file would
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        with open(temporary, "rb") as written:
            os.fsync(written.fileno())
        os.replace(temporary, path)
    except OSError as error:
        raise UserError(f"output '{path}' can't be written: {error.strerror or first_line(error)}") from error
    finally:
        if os.path.exists(temporary):
            os.unlink(temporary)


def write_text(path: str, text: str) -> None:
    """Writes UTF-8 text to `path`, all or nothing."""
    with atomic_path(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.write(text)
