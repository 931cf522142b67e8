# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong in a sync: errors that end it, and notes that the artist is told once."""

from contextlib import contextmanager, nullcontext
from contextvars import ContextVar

_innermost: ContextVar = ContextVar("headwater_naming", default=None)  # (kind, name) of this thread's innermost naming


class SyncError(Exception):
    """The scene cannot be rendered as it is; the text names the object and the reason."""


class Cancelled(Exception):
    """The artist pressed Esc during a sync."""


@contextmanager
def naming(kind: str, name: str):
    """Errors inside become SyncError naming the thing at hand; SyncError and Cancelled pass as they are."""
    outer = _innermost.set((kind, name))
    try:
        yield
    except (SyncError, Cancelled):
        raise
    except Exception as error:
        text = str(error) or type(error).__name__
        # The core's SceneError names the object itself.
        named = f'"{name}"' in text or f"'{name}'" in text
        raise SyncError(text if named else f"{kind} '{name}': {text}") from error
    finally:
        _innermost.reset(outer)


def naming_as_here():
    """The innermost `naming` around the caller, to be entered once: later, or on another thread."""
    named = _innermost.get()
    return nullcontext() if named is None else naming(*named)


class Notes:
    """Remarks that don't end a sync (something left out or replaced), each kept once, in order."""

    def __init__(self):
        self._told = {}

    def add(self, text: str) -> None:
        self._told.setdefault(text, False)

    def take(self) -> list[str]:
        """Those not taken before."""
        fresh = [text for text, told in self._told.items() if not told]
        for text in fresh:
            self._told[text] = True
        return fresh
