# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender says changed since the last sync.

`depsgraph.updates` can be believed only when this sync and the last one saw the same dependency graph (persistent data,
viewport): a new graph says that everything changed. Otherwise arrays are compared by digest (mesh.py), but for those
that time does not change in an animation that is being rendered: only an artist can edit those meanwhile, and a
handler notes it.
"""

import bpy
from bpy.app.handlers import persistent

from .. import handlers

_SHARED = -1  # stands for all node groups and images: no data-block has this session_uid
_edits: dict[int, int] = {}  # session_uid → number of its last edit that can matter
_edit_count = 0


class Updates:
    """Identifiers (`session_uid`) of what changed. `trusted` False: unknown, compare.

    `next_frame`: nothing but time has passed since the last sync, so only what is animated may have changed, and what
    was edited since `last_edit` (edits_so_far() then).
    """

    def __init__(self, depsgraph, trusted: bool, next_frame: bool = False, last_edit: int = 0):
        self.trusted = trusted
        self._last_edit = last_edit
        self.next_frame = next_frame and not trusted and not _handlers()
        self.geometry: set[int] = set()
        self.materials: set[int] = set()
        self.images: set[int] = set()
        self.worlds: set[int] = set()
        self.blocks: set[int] = set()  # data-blocks of any kind, changed in any way
        self.unnamed = False  # Blender says that something changed, not what: before 5.0 painting comes so
        self.groups = False  # a collection changed: who is in it, what it says about its objects
        self.moved: set[int] = set()  # objects whose transform changed
        self.only_moved = False  # nothing is known to have changed but these transforms
        self.any_material = not trusted
        if not trusted:
            return
        self.unnamed = self.any_material = not len(depsgraph.updates)
        self.only_moved = not self.unnamed
        for update in depsgraph.updates:
            block = update.id
            uid = block.original.session_uid
            self.blocks.add(uid)
            if isinstance(block, bpy.types.Material):
                self.materials.add(uid)
            elif isinstance(block, bpy.types.World):
                self.worlds.add(uid)
            elif isinstance(block, bpy.types.Image):
                self.images.add(uid)
                self.any_material = True
            elif isinstance(block, bpy.types.Collection):
                self.groups = True
            elif isinstance(block, bpy.types.NodeTree):
                # A group or a texture's tree: who uses it is not said.
                if not block.is_embedded_data:
                    self.any_material = True
            if update.is_updated_geometry:
                self.geometry.add(uid)
            if isinstance(block, bpy.types.Object) and update.is_updated_transform:
                self.moved.add(uid)
                self.only_moved &= not (update.is_updated_geometry or update.is_updated_shading)
            else:
                self.only_moved = False

    @classmethod
    def nothing(cls) -> "Updates":
        """Nothing in Blender's data changed."""
        empty = cls(None, False)
        empty.trusted, empty.any_material, empty.only_moved = True, False, True
        return empty

    def joined(self, later: "Updates") -> "Updates":
        """What either says, for a sync that comes after both."""
        both = self.nothing()
        both.trusted = self.trusted and later.trusted
        both.any_material = self.any_material or later.any_material
        both.groups = self.groups or later.groups
        both.unnamed = self.unnamed or later.unnamed
        both.only_moved = self.only_moved and later.only_moved
        for kind in ("moved", "blocks", "geometry", "materials", "images", "worlds"):
            setattr(both, kind, getattr(self, kind) | getattr(later, kind))
        return both

    def untouched(self, *uids: int) -> bool:
        """Whether none of these data-blocks changed at all, nor a collection or node group that may concern them."""
        return self.trusted and not self.groups and not self.any_material and self.blocks.isdisjoint(uids)

    def geometry_changed(self, still: bool, *uids: int) -> bool:
        """Whether the geometry of any of these data-blocks may have changed. `still`: time does not change it."""
        if self.next_frame and still:
            return self._edited(*uids)
        return not self.trusted or any(uid in self.geometry for uid in uids)

    def material_changed(self, material) -> bool:
        """Whether an evaluated material may compile to something else than at the last sync."""
        original = material.original
        if self.next_frame:
            return changes_with_time(original) or self._edited(original.session_uid, _SHARED)
        return self.any_material or original.session_uid in self.materials

    def image_changed(self, uid: int, in_memory: bool) -> bool:
        """Whether an image's pixels may have changed. `in_memory`: there is no file that they could be read from."""
        if self.trusted:
            return uid in self.images or (in_memory and self.unnamed)
        return self._edited(uid) or (in_memory and not self.next_frame)

    def _edited(self, *uids: int) -> bool:
        return any(_edits.get(uid, 0) > self._last_edit for uid in uids)

    def world_changed(self, world) -> bool:
        """The same for an evaluated world, or None."""
        if world is None:
            return False
        if self.next_frame:
            return changes_with_time(world.original) or self._edited(world.original.session_uid, _SHARED)
        return self.any_material or world.original.session_uid in self.worlds


def edits_so_far() -> int:
    """Number of the last edit that the handler saw."""
    return _edit_count


@persistent
def _note_edits(_scene, depsgraph):
    global _edit_count
    for update in depsgraph.updates:
        block = update.id
        if isinstance(block, (bpy.types.NodeTree, bpy.types.Image)):
            uid = _SHARED  # who uses it is not said
        elif update.is_updated_geometry or isinstance(block, (bpy.types.Material, bpy.types.World)):
            uid = block.original.session_uid
        else:
            continue
        _edit_count += 1
        _edits[uid] = _edit_count
        if uid == _SHARED and isinstance(block, bpy.types.Image):
            _edits[block.original.session_uid] = _edit_count


_noted = (("depsgraph_update_post", _note_edits),)


def register():
    handlers.add(_noted)


def unregister():
    handlers.remove(_noted)
    _edits.clear()


def _handlers() -> bool:
    """Whether other scripts run at a frame change: they may write anything."""
    lists = bpy.app.handlers
    names = ("frame_change_pre", "frame_change_post", "depsgraph_update_pre", "depsgraph_update_post", "render_pre")
    return any(handler is not _note_edits for name in names for handler in getattr(lists, name))


def _is_driven(block) -> bool:
    animation = block.animation_data
    return animation is not None and bool(animation.action or len(animation.drivers) or len(animation.nla_tracks))


def changes_with_time(block) -> bool:
    """Whether a material or world, its node groups or their images are animated."""
    if _is_driven(block):
        return True
    stack, seen = [getattr(block, "node_tree", None)], set()
    while stack:
        tree = stack.pop()
        if tree is None or tree.session_uid in seen:
            continue
        seen.add(tree.session_uid)
        if _is_driven(tree):
            return True
        for node in tree.nodes:
            stack.append(getattr(node, "node_tree", None))
            image = getattr(node, "image", None)
            if image is not None and image.source in {"SEQUENCE", "MOVIE"}:
                return True
    return False
