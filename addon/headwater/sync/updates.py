# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender says changed since the last sync.

`depsgraph.updates` can be believed only when this sync and the last one saw the same dependency graph (persistent data,
viewport): a new graph says that everything changed. Otherwise arrays are compared by digest (mesh.py).
"""

import bpy


class Updates:
    """Identifiers (`session_uid`) of what changed. `trusted` False: unknown, compare."""

    def __init__(self, depsgraph, trusted: bool):
        self.trusted = trusted
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

    def material_changed(self, uid: int) -> bool:
        return self.any_material or uid in self.materials
