# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps → core lights, with Cycles' meaning of every property."""

from dataclasses import dataclass

import numpy as np

from .instance import find_rows
from .problems import naming

_KINDS = {"POINT": "point", "SPOT": "spot", "SUN": "sun", "AREA": "area"}


def tint(light) -> np.ndarray:
    """Linear colour of a lamp: its colour, its temperature's, and its exposure."""
    color = np.array(light.color, np.float64)
    if getattr(light, "use_temperature", False):
        color *= np.array(light.temperature_color, np.float64)
    return color * 2.0 ** getattr(light, "exposure", 0.0)


def light_flags(light, visibility: dict, flags: dict) -> int:
    """HW_LIGHT_* of a lamp. `visibility`: which rays see the object; `flags`: the core's constants."""
    cycles = getattr(light, "cycles", None)
    own = getattr(light, "headwater", None)
    mis = getattr(cycles, "use_multiple_importance_sampling", getattr(own, "use_mis", True))
    bits = 0
    for name, on in (
        ("HW_LIGHT_CAST_SHADOW", light.use_shadow),
        ("HW_LIGHT_USE_MIS", mis),
        ("HW_LIGHT_CAMERA", visibility["camera"]),
        ("HW_LIGHT_DIFFUSE", visibility["diffuse"]),
        ("HW_LIGHT_GLOSSY", visibility["glossy"]),
        ("HW_LIGHT_TRANSMISSION", visibility["transmission"]),
        ("HW_LIGHT_SOFT_FALLOFF", getattr(light, "use_soft_falloff", False)),
    ):
        if on:
            bits |= flags[name]
    return bits


def parameters(light) -> dict:
    """Shape of a lamp by its kind: metres and radians."""
    if light.type == "SUN":
        return {"angle": light.angle}
    if light.type == "AREA":
        square = light.shape in ("SQUARE", "DISK")
        return {
            "size_x": light.size,
            "size_y": light.size if square else light.size_y,
            "ellipse": light.shape in ("DISK", "ELLIPSE"),
            "spread": light.spread,
        }
    shape = {"radius": light.shadow_soft_size}
    if light.type == "SPOT":
        shape.update(spot_size=light.spot_size, spot_blend=light.spot_blend)
    return shape


@dataclass
class _Batch:
    """Lamps of one group (instance.Group) that the core has."""

    first: int  # id of slot 0
    top: int  # slots ever used: a new lamp never gets the id of one that is gone
    settings: tuple
    matrices: np.ndarray  # (N, 3, 4)
    keys: np.ndarray  # (N,)
    slots: np.ndarray  # (N,) slot of each lamp


class LightSync:
    """Lamps the core has, by group key; each is sent again only when something of it changed."""

    def __init__(self, scene, ids, notes, flags: dict, compile_lamp):
        self._scene, self._ids, self._notes = scene, ids, notes
        self._flags, self._compile = flags, compile_lamp
        self._batches: dict[tuple, _Batch] = {}
        self.count = 0

    def prepare(self, obj, visibility: dict) -> dict | None:
        """Everything of an evaluated light object but its place; None for a lamp that gives no light of its own."""
        light = obj.data
        if getattr(getattr(light, "cycles", None), "is_portal", False):
            return None  # a portal only guides the sampling of the world: the picture is the same without
        color = tint(light) * self._compile(light)
        return dict(
            kind=_KINDS[light.type],
            color=tuple(float(c) for c in color),
            power=float(light.energy),
            normalize=bool(getattr(light, "normalize", True)),
            flags=light_flags(light, visibility, self._flags),
            **parameters(light),
        )

    def sync(self, collected, still: np.ndarray) -> None:
        """Sends lamps that changed and removes those that are gone. collected, still: as InstanceSync.sync."""
        seen = set()
        self.count = 0
        for number, group in enumerate(collected.groups):
            if group.kind != "LIGHT":
                continue
            key = group.key
            if still[number] and key in self._batches and key not in seen:
                seen.add(key)
                self.count += len(self._batches[key].keys)
                continue
            while key in seen:  # two groups of one lamp under one parent: by order
                key = (*key, "next")
            seen.add(key)
            with naming("Light", group.name):
                self._sync_batch(key, group, collected, collected.members(number))
        for key in [key for key in self._batches if key not in seen]:
            self._remove(key)

    def _sync_batch(self, key: tuple, group, collected, members: np.ndarray) -> None:
        good = members[collected.finite[members]]
        if len(good) < len(members):
            self._notes.add(f"Light '{group.name}' left out: its transform is no number", "Light", group.name)
        self.count += len(good)
        matrices, keys = collected.matrices[good], collected.keys[good]
        settings = (group.name, *group.settings.items())
        batch = self._batches.get(key)
        if batch is None:
            first = self._ids.get(("light", *key)) << 32
            empty = np.zeros(0, np.uint64)
            batch = _Batch(first, 0, settings, matrices[:0], empty, empty.astype(np.int64))
            self._batches[key] = batch
        rows = np.arange(len(keys)) if np.array_equal(batch.keys, keys) else find_rows(batch.keys, keys)
        slots = np.where(rows >= 0, batch.slots[rows] if len(batch.slots) else 0, -1)
        new = np.flatnonzero(rows < 0)
        slots[new] = np.arange(batch.top, batch.top + len(new))
        gone = np.setdiff1d(batch.slots, slots, assume_unique=True)
        changed = rows < 0
        if settings != batch.settings:
            changed[:] = True
        elif len(batch.slots):
            changed |= (batch.matrices[rows] != matrices).any(axis=(1, 2))
        if len(gone):
            self._scene.remove_lights(batch.first + gone.astype(np.uint64))
        if changed.any():
            rest = {name: value for name, value in group.settings.items() if name != "kind"}
            self._scene.upsert_lights(
                batch.first + slots[changed].astype(np.uint64),
                group.name,
                group.settings["kind"],
                np.ascontiguousarray(matrices[changed]),
                **rest,
            )
        batch.top += len(new)
        batch.settings, batch.matrices, batch.keys, batch.slots = settings, matrices, keys, slots

    def _remove(self, key: tuple) -> None:
        batch = self._batches.pop(key)
        if len(batch.slots):
            self._scene.remove_lights(batch.first + batch.slots.astype(np.uint64))
        self._ids.forget(("light", *key))
