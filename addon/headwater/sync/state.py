# SPDX-License-Identifier: GPL-3.0-or-later
"""SceneSync: the core's scene of one view layer, and what Blender's data looked like when it was last synced."""

import time
from dataclasses import dataclass

import numpy as np

from ..nodes import compile_lamp, compile_material, compile_world
from . import instance as instances
from .build import Edits
from .camera import CameraSync
from .image import ImageSync
from .instance import Group, InstanceSync
from .light import LightSync
from .material import MaterialSync
from .mesh import MAX_SLOTS, MeshSync
from .moves import plain_moves
from .problems import Notes, naming
from .updates import Updates, edits_so_far
from .world import WorldSync

SENT = ("meshes_uploaded", "instances_uploaded", "bytes_uploaded")  # counts of a session's sync
_NOT_YET = {
    "CURVES": "hair curves",
    "POINTCLOUD": "point clouds",
    "VOLUME": "volumes",
    "GREASEPENCIL": "grease pencil",
    "GPENCIL": "grease pencil",
}


class Ids:
    """Stable numbers for keys, never used twice."""

    def __init__(self):
        self._numbers: dict[tuple, int] = {}
        self._next = 1

    def get(self, key: tuple) -> int:
        number = self._numbers.get(key)
        if number is None:
            number = self._numbers[key] = self._next
            self._next += 1
        return number

    def forget(self, key: tuple) -> None:
        self._numbers.pop(key, None)


class SceneSync:
    """Keeps `scene` (a core.Scene) equal to what a dependency graph shows.

    Not tied to any Blender object: keys are `session_uid`s, so it outlives undo, file changes and frames.
    """

    def __init__(self, core):
        self.scene = core.Scene()
        self.notes = Notes()
        self.seconds: dict[str, float] = {}
        self._flags = core.flags
        self._ids = Ids()
        self._sync = 0
        edits, ids, notes = Edits(self.scene), self._ids, self.notes
        self._edits = edits  # none of the parts has the scene itself
        self.images = ImageSync(edits, ids, notes, core.ImageDecoder)
        self.materials = MaterialSync(edits, ids, notes, self.images, compile_material)
        self.meshes = MeshSync(edits, ids, notes)
        self.instances = InstanceSync(edits, ids, notes)
        self.lights = LightSync(
            edits, ids, notes, self._flags, lambda light: compile_lamp(light, notes.add_unsupported)
        )
        self.world = WorldSync(edits, ids, notes, self._flags, self.images, compile_world)
        self.camera = CameraSync(edits, notes)
        self.usable = True  # False: edits were forgotten, so the core's scene may lack what the parts believe it has
        self._complete = False
        self._last_edit = 0
        self._last: instances.Collected | None = None  # what the core's instances and lamps are
        self._last_space = False  # a 3D viewport decided what was seen
        self._groups: dict[tuple[int, int], _KnownGroup | None] = {}  # by session_uid of object and instancer
        self._layers = None  # what layer collections said about their objects

    def sync(
        self,
        depsgraph,
        same_graph: bool,
        breathe=lambda: None,
        *,
        next_frame=False,
        once=False,
        build=None,
        borrow=False,
        updates=None,
        space=None,
    ) -> dict:
        """Brings the core's scene up to date, all but the camera. Returns counts and seconds.

        `same_graph`: the dependency graph is the one of the last sync, so its `updates` tell what changed since.
        `next_frame`: nothing but time has passed since the last sync. `once`: there will be no other.
        `build()`: Session.sync. On the first sync it is called on another thread while Blender's data is read, and the
        result's "early" is the sum of what it returned (seconds that lie within the export's).
        `borrow`: what `build` takes onto the device it need not have as a copy, as where the device shares the host's
        memory: meshes' arrays are read where Blender has them.
        `updates`: what changed, in place of what the graph says now. `space`: the 3D viewport that decides what is
        seen, besides the scene.
        `breathe()` is called often and may raise Cancelled; the next sync then compares everything, or is another
        SceneSync's, if this one is no longer `usable`.
        """
        start = time.perf_counter()
        if updates is None or not self._complete:
            trusted = same_graph and self._complete and updates is None
            updates = Updates(depsgraph, trusted, next_frame and self._complete, self._last_edit)
        self._last_edit = edits_so_far()
        self._complete = False
        self._sync += 1
        # With nothing synced before, further commits in this frame cannot take motion away.
        self._edits.begin(build if self._sync == 1 else None)
        self.meshes.uploaded, self.meshes.compare = 0, not once
        self.meshes.borrow = borrow and self._edits.early
        view_layer = depsgraph.view_layer_eval
        self.images.begin(updates)
        self.materials.begin(updates, view_layer.material_override)
        world = getattr(view_layer, "world_override", None) or depsgraph.scene_eval.world
        with naming("World", world.name if world is not None else "none"):
            self.world.prepare(world, updates)
        last, self._last = self._last, None  # until all of it was sent
        moved = self._moved(depsgraph, updates, space, last)
        if moved is None:
            self.materials.sync(depsgraph)
        after_materials = time.perf_counter()

        try:
            collected, still = moved or self._walk(depsgraph, updates, space, breathe, last)
            return self._send(collected, still, moved is None, space, breathe, (start, after_materials))
        except BaseException:
            self.usable = not self._edits.early
            self._edits.abandon()
            self.images.abandon()
            raise
        finally:
            if self.meshes.borrow:
                self.scene.keep_lent()  # what is not on the device yet: Blender may free it from now on

    def _send(self, collected, still, walked: bool, space, breathe, times) -> dict:
        """Sends what `_walk` or `_moved` found."""
        start, after_materials = times
        after_meshes = time.perf_counter()
        self.instances.sync(collected, still, breathe)
        self.images.send_decoded(breathe)
        self._edits.start_last()
        found = self.images.load(breathe)
        after_images = time.perf_counter()
        self._edits.finish()
        self.images.send(found)
        with naming("World", self.world.name):
            self.world.apply()
        self.lights.sync(collected, still)
        if walked:  # otherwise all is still in use, and not marked so
            self._remove_unseen()
        self._complete, self._last, self._last_space = True, collected, space is not None
        end = time.perf_counter()
        self.seconds = {
            "materials": after_materials - start,
            "meshes": after_meshes - after_materials,
            "images": after_images - after_meshes,
            "instances": end - after_images,
        }
        return {
            "seconds": end - start,
            "parts": dict(self.seconds),
            "objects": len(collected.groups),
            "instances": self.instances.count,
            "lights": self.lights.count,
            "meshes_uploaded": self.meshes.uploaded,
            "early": _sum(self._edits.built),
        }

    def _walk(self, depsgraph, updates, space, breathe, last):
        """All instances, and which of their groups need not be looked at (instance.Collected, Collected.still)."""
        frame = _Frame(self, updates, depsgraph.view_layer)
        layers = _layer_flags(depsgraph.view_layer.layer_collection)
        if layers != self._layers:
            self._groups, self._layers = {}, layers

        def breathe_and_send():
            breathe()
            self.images.send_decoded()

        collected = instances.collect(depsgraph, frame.enter, breathe_and_send, space)
        self._groups = frame._remembered
        return collected, collected.still(last)

    def _moved(self, depsgraph, updates, space, last):
        """The same without looking at all of them, where only plain objects moved; otherwise None."""
        if last is None or space is not None or self._last_space:
            return None
        moves = plain_moves(depsgraph, updates, last)
        if moves is None:
            return None
        frame, groups = _Frame(self, updates, depsgraph.view_layer), []
        for move in moves:
            number = last.index[move.row]
            if number < 0:  # not shown
                continue
            before = last.groups[number]
            group = frame.enter(last.row(move.row), move.object, move.object.data, None)
            if (group.kind, group.key) != (before.kind, before.key) or group.mesh is not before.mesh:
                return None  # its mesh's name depends on other objects
            groups.append((move, group))
        still = np.ones(len(last.groups), bool)
        for move, group in groups:
            obj = move.object
            still[last.move(move.row, obj.matrix_world, instances.name_hash(obj.name), group)] = False
        self._groups.update(frame._remembered)
        return last, still

    def _remove_unseen(self) -> None:
        """Removes what nothing of a walk used."""
        self.meshes.remove_unseen(self._sync)
        self.materials.remove_unseen()
        self.images.remove_unseen()


def _sum(reports: list[dict]) -> dict:
    """What several syncs of a session cost and sent."""
    names = ("upload_seconds", "build_seconds", "lights_seconds", *SENT)
    return {name: sum(report.get(name, 0) for report in reports) for name in names} if reports else {}


def _slot_count(obj, data) -> int:
    return max(len(obj.material_slots), len(data.materials), 1)


def _layer_flags(collection) -> tuple:
    """What a layer collection and those within say about their objects."""
    children = tuple(_layer_flags(child) for child in collection.children)
    return collection.holdout, collection.indirect_only, collection.exclude, children


@dataclass
class _KnownGroup:
    """The group of an object, as long as the object, its instancer and its data stay as they are."""

    group: Group
    uids: tuple[int, int, int]  # session_uid of the object, of its instancer (0: none) and of its data
    mesh_key: tuple
    slot_count: int


class _Frame:
    """One sync's walk over the instances: turns the first of each kind into a Group."""

    def __init__(self, state: SceneSync, updates: Updates, view_layer):
        self._state, self._updates = state, updates
        self._view_layer = view_layer  # the original: its bases are asked for by original objects
        self._wanted = state.materials.attributes
        self._keys: dict[int, tuple] = {}  # data pointer → mesh key, within this sync only
        self._taken: set[tuple] = set()
        self._remembered: dict[tuple[int, int], _KnownGroup | None] = {}

    def enter(self, row, obj, data, parent) -> Group:
        """The group of an instance seen for the first time (instance.Row); exports its mesh if need be."""
        kind = obj.type
        known = self._known(obj, data, parent)
        if known is not None:
            return known
        if kind in ("LIGHT", "MESH"):
            self._note_what_is_left_out(obj)
        if kind == "LIGHT":
            with naming("Light", obj.name):
                return self._remember(self._light(obj, parent), obj, data, parent)
        if kind == "MESH":
            with naming("Object", obj.name):
                return self._remember(self._geometry(row, obj, data, parent), obj, data, parent)
        # Curves, surfaces, text and metaballs come once as themselves and once as an instance of the mesh made of them.
        if kind in _NOT_YET:
            self._state.notes.add(f"Not rendered yet: {_NOT_YET[kind]} ('{obj.name}')", "Object", obj.name)
        return Group("")

    def _note_what_is_left_out(self, obj) -> None:
        """Object settings of Cycles that the picture does not follow yet."""
        linking, kind = obj.light_linking, "Light" if obj.type == "LIGHT" else "Object"
        if linking.receiver_collection is not None or linking.blocker_collection is not None:
            self._state.notes.add(
                f"{kind} '{obj.name}' lights everything: light linking is not followed yet", kind, obj.name
            )
        if kind == "Object" and obj.is_shadow_catcher:  # Blender's first lamp says it is one
            text = f"Object '{obj.name}' is rendered as any other: shadow catchers are not followed yet"
            self._state.notes.add(text, "Object", obj.name)

    def _known(self, obj, data, parent) -> Group | None:
        """The last sync's group of an object that Blender says is untouched since; None: look at it."""
        found = self._state._groups.get(self._uids(obj, parent))
        if found is None or not self._updates.untouched(*found.uids):
            return None
        group, meshes = found.group, self._state.meshes
        if group.kind == "MESH":
            key = found.mesh_key
            if meshes.known(key, self._wanted, found.slot_count, self._state._sync, False) is not group.mesh:
                return None
            self._taken.add(key)
            self._keys[data.as_pointer()] = key
        self._remembered[found.uids[:2]] = found
        return group

    def _remember(self, group: Group, obj, data, parent) -> Group:
        obj_uid, parent_uid = self._uids(obj, parent)
        # Geometry nodes make several parts of one object: nothing tells which is which.
        if obj_uid != parent_uid and (group.kind == "LIGHT" or group.mesh is not None):
            uids = (obj_uid, parent_uid, obj.original.data.session_uid)
            key, slot_count = (self._keys[data.as_pointer()], _slot_count(obj, data)) if group.mesh else ((), 0)
            again = uids[:2] in self._remembered  # two of one name: neither is known next time
            self._remembered[uids[:2]] = None if again else _KnownGroup(group, uids, key, slot_count)
        return group

    @staticmethod
    def _uids(obj, parent) -> tuple[int, int]:
        return obj.original.session_uid, parent.original.session_uid if parent is not None else 0

    def _light(self, obj, parent) -> Group:
        settings = self._state.lights.prepare(obj, instances.ray_visibility(obj, parent))
        if settings is None:
            return Group("")
        return Group("LIGHT", self._uids(obj, parent), obj.name, settings=settings)

    def _mesh_key(self, obj, data, parent) -> tuple:
        """Objects without modifiers share their data's mesh; others have their own; geometry nodes make parts."""
        pointer = data.as_pointer()
        key = self._keys.get(pointer)
        if key is not None:
            return key
        obj_uid, parent_uid = self._uids(obj, parent)
        plain = obj.type == "MESH" and not len(obj.modifiers) and data.shape_keys is None
        if parent is not None and obj_uid == parent_uid:
            key = ("part", parent_uid, 0)
        else:
            # Evaluated meshes are copies without an original: the original object knows the data-block.
            key = ("mesh", obj.original.data.session_uid) if plain else ("object", obj_uid)
        ordinal = 0
        while key in self._taken:
            ordinal += 1
            key = ("part", parent_uid or obj_uid, ordinal)
        self._taken.add(key)
        self._keys[pointer] = key
        return key

    def _geometry(self, row, obj, data, parent) -> Group:
        state, sync = self._state, self._state._sync
        key = self._mesh_key(obj, data, parent)
        obj_uid, parent_uid = self._uids(obj, parent)
        still = key[0] == "mesh" and obj.original.data.animation_data is None
        changed = self._updates.geometry_changed(still, obj_uid, parent_uid, obj.original.data.session_uid)
        slot_count = _slot_count(obj, data)
        record = state.meshes.known(key, self._wanted, slot_count, sync, changed)
        if record is None and data.is_editmode:
            # A file saved in edit mode: the data is a shell around the editor's mesh and has no arrays of its own.
            record = state.meshes.upsert(key, obj.to_mesh(), slot_count, self._wanted, sync, passing=True)
            obj.to_mesh_clear()
        elif record is None:
            record = state.meshes.upsert(key, data, slot_count, self._wanted, sync)
        group = Group(
            "MESH",
            (obj_uid, parent_uid, *key),
            obj.name,
            record,
            self._instance_settings(obj, data, parent),
            moves=instances.is_animated(obj.original)
            or (parent is not None and instances.is_animated(parent.original)),
            single=parent is None,
        )
        if parent is None and obj.original.data.users == 1:
            # Alone of its mesh: its place can be told before the other objects are looked at.
            state.instances.send_early(group, row)
        return group

    def _instance_settings(self, obj, data, parent) -> dict:
        state, flags = self._state, self._state._flags
        seen = instances.ray_visibility(obj, parent)
        # As in Cycles: holdout is asked of the object itself, the rest of what brings it into the view layer.
        holdout = obj.is_holdout or obj.original.holdout_get(view_layer=self._view_layer)
        owner = parent if parent is not None else obj
        if not holdout and owner.original.indirect_only_get(view_layer=self._view_layer):
            seen["camera"] = False
        bits = 0
        if holdout:
            bits |= flags["HW_INSTANCE_HOLDOUT"]
        if obj.is_shadow_catcher or (parent is not None and parent.is_shadow_catcher):
            bits |= flags["HW_INSTANCE_SHADOW_CATCHER"]
        return dict(
            materials=tuple(state.materials.slots(obj, data)[:MAX_SLOTS]),
            visibility=instances.visibility_mask(seen, flags),
            object_index=max(obj.pass_index, 0),
            flags=bits,
            color=tuple(owner.color[:3]),
            shadow_terminator_offset=_shadow_terminator_offset(obj),
        )


def _shadow_terminator_offset(obj) -> float:
    own = getattr(obj, "shadow_terminator_geometry_offset", None)
    return own if own is not None else getattr(getattr(obj, "cycles", None), "shadow_terminator_geometry_offset", 0.1)
