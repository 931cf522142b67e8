# SPDX-License-Identifier: Apache-2.0
"""What a stage sync has to tell the user: each thing once, naming the prim path."""


class Report:
    """Collects warnings; `emit` is called once with each new text."""

    def __init__(self, emit=None):
        self.warnings = []
        self._seen = set()
        self._emit = emit

    def warn(self, path, text: str) -> None:
        """`path`: the prim it is about (anything with a USD path as its text)."""
        message = f"{path}: {text}"
        if message not in self._seen:
            self._seen.add(message)
            self.warnings.append(message)
            if self._emit:
                self._emit(message)

    def once(self, key: str, text: str) -> None:
        """A warning about a whole kind of thing, given once however many prims it concerns."""
        if key not in self._seen:
            self._seen.add(key)
            self.warnings.append(text)
            if self._emit:
                self._emit(text)
