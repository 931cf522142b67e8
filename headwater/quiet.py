# SPDX-License-Identifier: Apache-2.0
"""Keeps what native libraries print off the user's terminal while our own lines still reach it."""

import os
import sys
import tempfile
from contextlib import contextmanager


@contextmanager
def captured_output():
    """Sends file descriptors 1 and 2 to a temporary file for a while; sys.stdout and sys.stderr keep the terminal.

    Gives a function that returns the text captured so far. HEADWATER_DEBUG=1 leaves everything on the terminal.
    """
    if os.environ.get("HEADWATER_DEBUG", "0") not in ("", "0"):
        yield lambda: ""
        return
    sys.stdout.flush()
    sys.stderr.flush()
    saved = os.dup(1), os.dup(2)
    streams = sys.stdout, sys.stderr
    with tempfile.TemporaryFile() as sink:
        os.dup2(sink.fileno(), 1)
        os.dup2(sink.fileno(), 2)
        sys.stdout = open(saved[0], "w", encoding="utf-8", errors="replace", closefd=False, buffering=1)
        sys.stderr = open(saved[1], "w", encoding="utf-8", errors="replace", closefd=False, buffering=1)

        def text() -> str:
            size = os.fstat(sink.fileno()).st_size
            return os.pread(sink.fileno(), min(size, 1 << 20), max(0, size - (1 << 20))).decode("utf-8", "replace")

        try:
            yield text
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            sys.stdout, sys.stderr = streams
            for number, copy in enumerate(saved, 1):
                os.dup2(copy, number)
                os.close(copy)
