# SPDX-License-Identifier: GPL-3.0-or-later
"""The world → the core's world: a constant colour, or a material program that ends in a background."""

_RAYS = ("camera", "diffuse", "glossy", "transmission")


def world_flags(world, flags: dict) -> int:
    """HW_LIGHT_* of a world: which rays see it. `flags`: the core's constants."""
    bits = flags["HW_LIGHT_USE_MIS"] | flags["HW_LIGHT_CAST_SHADOW"]
    seen = getattr(world, "cycles_visibility", None) or getattr(world, "headwater", None)
    for ray in _RAYS:
        if seen is None or getattr(seen, ray):
            bits |= flags[f"HW_LIGHT_{ray.upper()}"]
    return bits


def sampling(world) -> tuple[bool, int]:
    """Whether the world is sampled as a light, and the width of its importance map (0: automatic)."""
    source = getattr(world, "cycles", None) or getattr(world, "headwater", None)
    method = getattr(source, "sampling_method", "AUTOMATIC")
    return method != "NONE", source.sample_map_resolution if method == "MANUAL" else 0


class WorldSync:
    """Sets the core's world when it changed."""

    def __init__(self, scene, ids, notes, flags: dict, images, compile_world):
        self._scene, self._notes, self._flags, self._images = scene, notes, flags, images
        self._compile = compile_world
        self._material = ids.get(("world-material",))
        self._has_material = False
        self._last = None
        self._next = None
        self._uid = -1
        self._image_keys: tuple = ()

    def prepare(self, world, updates) -> None:
        """Compiles a world (evaluated, or None for darkness) and asks for its images. `apply` then sends it."""
        uid = world.original.session_uid if world is not None else 0
        if self._next is not None and uid == self._uid and not updates.world_changed(world):
            self._images.keep(self._image_keys)
            return
        self._uid, self._image_keys = uid, ()
        if world is None:
            self._next = ("World", (0.0, 0.0, 0.0), None, (), True, 0, self._flags["HW_LIGHT_CAMERA"])
            return
        sample, width = sampling(world)
        compiled = self._compile(world)
        self._notes.add_unsupported(compiled.unsupported, "World")
        required = [self._images.require(request) for request in compiled.images]
        self._image_keys = tuple(key for _, key in required)
        program = compiled.program if compiled.program is not None and len(compiled.program) else None
        self._next = (
            world.name,
            tuple(float(c) for c in compiled.emission),
            None if program is None else (program, compiled.constants, compiled.flags),
            tuple(number for number, _ in required),
            sample,
            width,
            world_flags(world, self._flags),
        )

    @property
    def name(self) -> str:
        return self._next[0]

    def apply(self) -> None:
        """Sends what was prepared, once its images are there: the importance map is made from them."""
        self._set(*self._next)

    def _set(self, name, color, program, images, sample, width, flags) -> None:
        parts = None if program is None else (program[0].tobytes(), program[1].tobytes(), program[2])
        now = (name, color, parts, images, sample, width, flags)
        if now == self._last:
            return
        if program is not None:
            self._scene.upsert_material(
                self._material, name, program[0], program[1], images=list(images), flags=program[2]
            )
        self._scene.set_world(
            name,
            color,
            material=self._material if program is not None else 0,
            importance_width=width,
            sample=sample,
            flags=flags,
        )
        if program is None and self._has_material:
            self._scene.remove_material(self._material)
        self._has_material = program is not None
        self._last = now
