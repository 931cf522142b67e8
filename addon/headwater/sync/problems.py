# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong in a sync: errors that end it, and notes that the artist is told once."""

from contextlib import contextmanager


class SyncError(Exception):
    """The scene cannot be rendered as it is; the text names the object and the reason."""


class Cancelled(Exception):
    """The artist pressed Esc during a sync."""


@contextmanager
def naming(kind: str, name: str):
    """Errors inside become SyncError naming the thing at hand; SyncError and Cancelled pass as they are."""
    try:
        yield
    except (SyncError, Cancelled):
        raise
    except Exception as error:
        text = str(error) or type(error).__name__
        # The core's SceneError names the object itself.
        named = f'"{name}"' in text or f"'{name}'" in text
        raise SyncError(text if named else f"{kind} '{name}': {text}") from error


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
