# SPDX-License-Identifier: GPL-3.0-or-later
"""What goes wrong in a sync: errors that end it, and notes that the artist is told once."""

from contextlib import contextmanager, nullcontext
from contextvars import ContextVar

_innermost: ContextVar = ContextVar("headwater_naming", default=None)  # (kind, name) of this thread's innermost naming


class SyncError(Exception):
    """The scene cannot be rendered as it is; the text names the object and the reason.

    `kind` and `name`: the data-block it is about, as in Note.
    """

    def __init__(self, text: str, kind: str = "", name: str = ""):
        super().__init__(text)
        self.kind, self.name = kind, name


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
        raise SyncError(text if named else f"{kind} '{name}': {text}", kind, name) from error
    finally:
        _innermost.reset(outer)


def naming_as_here():
    """The innermost `naming` around the caller, to be entered once: later, or on another thread."""
    named = _innermost.get()
    return nullcontext() if named is None else naming(*named)


class Note(str):
    """A remark's text, and the data-block it is about.

    `kind`: "Object", "Light", "Camera", "Mesh", "Material", "World", "Image", or "" for none. `name`: of the object, or
    of the data where there is none of that name. `node`: of the node in its tree, or "".
    """

    __slots__ = ("kind", "name", "node")

    def __new__(cls, text: str, kind: str = "", name: str = "", node: str = ""):
        note = super().__new__(cls, text)
        note.kind, note.name, note.node = kind, name, node
        return note


class Notes:
    """Remarks that don't end a sync (something left out or replaced), each kept once, in order."""

    def __init__(self):
        self._told: dict[Note, bool] = {}

    def add(self, text: str, kind: str = "", name: str = "", node: str = "") -> None:
        """What it is about: see Note."""
        self._told.setdefault(Note(text, kind, name, node), False)

    def add_unsupported(self, problems, kind: str = "Material") -> None:
        """What a node tree has that is left out (headwater.materials.Unsupported), of a data-block of that kind."""
        for problem in problems:
            text = str(problem).replace("Material '", f"{kind} '", 1)
            self.add(text, kind, problem.material, problem.node_name)

    def take(self) -> list[Note]:
        """Those not taken before."""
        fresh = [text for text, told in self._told.items() if not told]
        for text in fresh:
            self._told[text] = True
        return fresh
