# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps → core lights, with Cycles' meaning of every property."""

import numpy as np

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


class LightSync:
    """Lamps the core has; each is sent again only when something of it changed."""

    def __init__(self, scene, ids, notes, flags: dict, compile_lamp):
        self._scene, self._ids, self._notes = scene, ids, notes
        self._flags, self._compile = flags, compile_lamp
        self._last: dict[tuple, tuple] = {}
        self._seen: set[tuple] = set()

    @property
    def count(self) -> int:
        return len(self._seen)

    def begin(self) -> None:
        self._seen = set()

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

    def place(self, key: tuple, name: str, settings: dict, matrix: np.ndarray) -> None:
        """One instance of a prepared lamp. `matrix`: object to world, (3, 4)."""
        if not np.isfinite(matrix).all():
            self._notes.add(f"Light '{name}' left out: its transform is no number", "Light", name)
            return
        now = (matrix.tobytes(), tuple(settings.items()))
        self._seen.add(key)
        if self._last.get(key) == now:
            return
        rest = {name: value for name, value in settings.items() if name != "kind"}
        self._scene.upsert_light(self._ids.get(("light", *key)), name, settings["kind"], matrix, **rest)
        self._last[key] = now

    def remove_unseen(self) -> None:
        for key in [key for key in self._last if key not in self._seen]:
            self._scene.remove_light(self._ids.get(("light", *key)))
            self._ids.forget(("light", *key))
            del self._last[key]
