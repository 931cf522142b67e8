# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender materials → material programs in the core. Slots become lists of the core's ids."""

from dataclasses import dataclass

import bpy

from headwater.materials import Graph, Surface, closures

from .problems import naming

_DEFAULT = 0  # no data-block has this session_uid


@dataclass
class _Material:
    id: int
    state: tuple  # what the core was given
    attributes: frozenset
    images: tuple  # keys of the images in use
    seen: int = -1


class MaterialSync:
    """Materials the core has, by `session_uid`."""

    def __init__(self, scene, ids, notes, images, compile_material):
        self._scene, self._ids, self._notes, self._images = scene, ids, notes, images
        self._compile = compile_material
        self._known: dict[int, _Material] = {}
        self._updates = None
        self._override = None
        self._sync = 0
        self.attributes: frozenset = frozenset()  # names that any material of this sync reads

    def begin(self, updates, override) -> None:
        """`override`: the view layer's material for everything, or None."""
        self._updates, self._sync = updates, self._sync + 1
        self._override = override.original.session_uid if override is not None else None

    def sync(self, depsgraph) -> None:
        """Compiles the materials of the dependency graph, so that meshes are exported with what they read."""
        for block in depsgraph.ids:
            if isinstance(block, bpy.types.Material) and not getattr(block, "is_grease_pencil", False):
                uid = block.original.session_uid
                if self._override is None or uid == self._override:
                    self._require(block, uid)
        if _DEFAULT in self._known:
            self._default()
        self._collect()

    def _collect(self) -> None:
        used = [m.attributes for m in self._known.values() if m.seen == self._sync]
        self.attributes = frozenset().union(*used) if used else frozenset()

    def slots(self, obj, mesh) -> list[int]:
        """The core's material id of each slot of an evaluated object; one for an object without slots."""
        if self._override is not None:
            known = self._known.get(self._override)
            return [known.id if known else self._default()] * max(len(mesh.materials), 1)
        own = obj.material_slots
        found = []
        for i, material in enumerate(mesh.materials):
            if i < len(own) and own[i].link == "OBJECT":
                material = own[i].material
            if material is None:
                found.append(self._default())
            else:
                found.append(self._require(material, material.original.session_uid).id)
        return found or [self._default()]

    def _default(self) -> int:
        """The material of an empty slot: a Principled BSDF as it comes, as in Cycles."""
        known = self._known.get(_DEFAULT)
        if known is None:
            surface = Surface(Graph())
            closures.add_principled(surface, surface.graph.one, closures.Principled.defaults(surface.graph))
            compiled = surface.finish([], (), [])
            number = self._ids.get(("material", _DEFAULT))
            self._scene.upsert_material(number, "Default", compiled.program, compiled.constants, flags=compiled.flags)
            known = self._known[_DEFAULT] = _Material(number, (), frozenset(), ())
        known.seen = self._sync
        return known.id

    def _require(self, material, uid: int) -> _Material:
        known = self._known.get(uid)
        if known is not None and known.seen == self._sync:
            return known
        if known is not None and not self._updates.material_changed(material):
            known.seen = self._sync
            self._images.keep(known.images)
            return known
        with naming("Material", material.name):
            known = self._upsert(material, uid, known)
        known.seen = self._sync
        return known

    def _upsert(self, material, uid: int, known: _Material | None) -> _Material:
        compiled = self._compile(material)
        self._notes.add_unsupported(compiled.unsupported)
        required = [self._images.require(request) for request in compiled.images]
        image_ids = [number for number, _ in required]
        state = (
            compiled.program.tobytes(),
            compiled.constants.tobytes(),
            tuple(image_ids),
            compiled.flags,
            tuple(compiled.emission),
            material.pass_index,
            material.name,
        )
        if known is None or known.state != state:
            number = known.id if known else self._ids.get(("material", uid))
            self._scene.upsert_material(
                number,
                material.name,
                compiled.program,
                compiled.constants,
                images=image_ids,
                flags=compiled.flags,
                emission=tuple(compiled.emission),
                pass_index=max(material.pass_index, 0),
            )
            known = _Material(number, state, frozenset(), ())
            self._known[uid] = known
        known.attributes = frozenset(compiled.attributes)
        known.images = tuple(key for _, key in required)
        return known

    def remove_unseen(self) -> None:
        """Removes materials that nothing of this sync uses. Instances of them must be gone."""
        for uid in [uid for uid, known in self._known.items() if known.seen != self._sync]:
            self._scene.remove_material(self._known.pop(uid).id)
            self._ids.forget(("material", uid))
