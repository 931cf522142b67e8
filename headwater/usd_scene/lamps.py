# SPDX-License-Identifier: Apache-2.0
"""Lamps of a stage → the core's scene: those that changed, together where they differ in nothing but their place."""

import numpy as np

from headwater.errors import first_line


class LampSync:
    """Lamps the scene has. Each time: `begin`, `add` for each lamp that shines, `send`."""

    def __init__(self, scene, report, flags: int):
        self._scene, self._report, self._flags = scene, report, flags
        self._sent: dict[int, tuple] = {}  # id → settings and matrix
        self.begin()

    def begin(self) -> None:
        self._seen: set[int] = set()
        self._changed: dict[tuple, list] = {}  # settings → (id, name, matrix) of lamps that have them

    def add(self, identifier: int, name: str, lamp) -> None:
        """lamp: light.Lamp."""
        self._seen.add(identifier)
        matrix = np.ascontiguousarray(lamp.matrix, np.float32)
        settings = (lamp.kind, lamp.color, lamp.power, tuple(sorted(lamp.options.items())))
        if self._sent.get(identifier) != (settings, matrix.tobytes()):
            self._changed.setdefault(settings, []).append((identifier, name, matrix))

    def send(self) -> None:
        """Sends the lamps that changed and removes those that were not added."""
        for settings, lamps in self._changed.items():
            try:
                self._upsert(settings, lamps)
            except ValueError:  # the core's SceneError: whose, is found one by one
                for lamp in lamps:
                    self._send_alone(settings, lamp)
        for identifier in self._sent.keys() - self._seen:
            del self._sent[identifier]
            self._scene.remove_light(identifier)

    def _upsert(self, settings: tuple, lamps: list) -> None:
        kind, color, power, options = settings
        lamps = sorted(lamps, key=lambda lamp: lamp[0])
        numbers, names, matrices = zip(*lamps, strict=True)
        self._scene.upsert_lights(
            np.array(numbers, np.uint64),
            names[0],
            kind,
            np.stack(matrices),
            color=color,
            power=power,
            flags=self._flags,
            **dict(options),
        )
        self._sent |= {number: (settings, matrix.tobytes()) for number, _, matrix in lamps}

    def _send_alone(self, settings: tuple, lamp: tuple) -> None:
        try:
            self._upsert(settings, [lamp])
        except ValueError as error:
            identifier, name, _ = lamp
            self._seen.discard(identifier)
            self._report.warn(name, f"{first_line(error)}; it is left out")
