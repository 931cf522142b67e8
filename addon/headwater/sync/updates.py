# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender says changed since the last sync.

`depsgraph.updates` can be believed only when this sync and the last one saw the same dependency graph (persistent data,
viewport): a new graph says that everything changed. Otherwise arrays are compared by digest (mesh.py).
"""

import bpy


class Updates:
    """Identifiers (`session_uid`) of what changed. `trusted` False: unknown, compare.

    `next_frame`: nothing but time has passed since the last sync, so only what is animated may have changed. Meshes are
    compared all the same: their data may be written by handlers and caches.
    """

    def __init__(self, depsgraph, trusted: bool, next_frame: bool = False):
        self.trusted = trusted
        self.next_frame = next_frame and not trusted and not _handlers()
        self.geometry: set[int] = set()
        self.materials: set[int] = set()
        self.images: set[int] = set()
        self.any_material = not trusted
        if not trusted:
            return
        for update in depsgraph.updates:
            block = update.id
            uid = block.original.session_uid
            if isinstance(block, bpy.types.Material):
                self.materials.add(uid)
            elif isinstance(block, bpy.types.Image):
                self.images.add(uid)
                self.any_material = True
            elif isinstance(block, bpy.types.NodeTree):
                # A group or a texture's tree: who uses it is not said.
                if not block.is_embedded_data:
                    self.any_material = True
            if update.is_updated_geometry:
                self.geometry.add(uid)

    def geometry_changed(self, *uids: int) -> bool:
        """Whether the geometry of any of these data-blocks may have changed."""
        return not self.trusted or any(uid in self.geometry for uid in uids)

    def material_changed(self, material) -> bool:
        """Whether an evaluated material may compile to something else than at the last sync."""
        original = material.original
        if self.next_frame:
            return changes_with_time(original)
        return self.any_material or original.session_uid in self.materials


def _handlers() -> bool:
    """Whether scripts run at a frame change: they may write anything."""
    handlers = bpy.app.handlers
    names = ("frame_change_pre", "frame_change_post", "depsgraph_update_pre", "depsgraph_update_post", "render_pre")
    return any(len(getattr(handlers, name)) for name in names)


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
