# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist should know: notes of syncs and errors of renders and viewports, for the panel "Headwater Log".

Bounded, each text once, safe from any thread (viewports render on threads of their own). Emptied when a file is loaded.
"""

import re
import threading
import time
from dataclasses import dataclass, replace

from bpy.app.handlers import persistent

from . import handlers

CAPACITY = 200
_NAMED = re.compile(r"""\b(object|instance|mesh|light|material|image|camera|world) ["'](.+?)["']""", re.IGNORECASE)
_KINDS = {"instance": "Object"}  # other names for what the core and the artist call differently


@dataclass(frozen=True)
class Entry:
    number: int  # never used twice
    severity: str  # "ERROR" or "WARNING"
    text: str
    kind: str  # of the data-block it is about, as in sync.problems.Note; "" for none
    name: str
    node: str
    at: float  # time.time() when it was said last
    times: int = 1  # how often it was said


class Log:
    """Entries by severity and text; the one said last is the last one."""

    def __init__(self, capacity: int = CAPACITY):
        self._lock = threading.Lock()
        self._entries: dict[tuple[str, str], Entry] = {}
        self._capacity, self._next = capacity, 1

    def add(self, severity: str, text: str, kind: str = "", name: str = "", node: str = "") -> None:
        now = time.time()
        with self._lock:
            said = self._entries.pop((severity, text), None)
            if said is None:
                entry = Entry(self._next, severity, text, kind, name, node, now)
                self._next += 1
            else:
                entry = replace(said, at=now, times=said.times + 1)
            self._entries[severity, text] = entry
            while len(self._entries) > self._capacity:
                del self._entries[next(iter(self._entries))]

    def entries(self) -> tuple[Entry, ...]:
        """All of them, what was said last first."""
        with self._lock:
            return tuple(reversed(self._entries.values()))

    def find(self, number: int) -> Entry | None:
        return next((entry for entry in self.entries() if entry.number == number), None)

    def clear(self) -> None:
        with self._lock:
            self._entries.clear()

    def as_text(self) -> str:
        """One line an entry, what was said first first: for the clipboard."""
        lines = []
        for entry in reversed(self.entries()):
            when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(entry.at))
            often = f" ({entry.times} times)" if entry.times > 1 else ""
            lines.append(f"{when} {entry.severity.lower()}: {entry.text}{often}\n")
        return "".join(lines)


log = Log()


def note(remark) -> None:
    """A sync.problems.Note."""
    log.add("WARNING", str(remark), remark.kind, remark.name, remark.node)


def error(text: str, cause: Exception | None = None) -> None:
    """An error that ended a render or keeps a viewport from rendering. `cause` may know what it is about."""
    kind, name = getattr(cause, "kind", ""), getattr(cause, "name", "")
    if not (kind and isinstance(name, str) and name):
        named = _NAMED.search(text)  # the core's errors name what they are about in their text only
        kind, name = named.groups() if named else ("", "")
        kind = _KINDS.get(kind.lower(), kind.capitalize())
    log.add("ERROR", text, kind, name)


@persistent
def _file_loaded(*_):
    log.clear()


_handlers = (("load_post", _file_loaded),)


def register():
    handlers.add(_handlers)


def unregister():
    handlers.remove(_handlers)
    log.clear()
