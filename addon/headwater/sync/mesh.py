# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluated meshes → core meshes: arrays by `foreach_get`, uploaded only when their digest changed.

Reading is in two steps, because split normals are Blender's dearest array (measured on a million triangles: 0.46 s of a
0.9 s read): the digest covers what they are computed from, so an unchanged mesh is recognised without them.
"""

import zlib
from dataclasses import dataclass

import numpy as np

from ..nodes.tree import GENERATED
from . import arrays

MAX_ATTRIBUTES = 8  # HW_MAX_ATTRIBUTES of the core
ACTIVE_UV = ""  # the name by which materials ask for the UV map active for rendering
_TANGENT = ".tangent"  # ending of the names by which they ask for a UV map's tangents; alone: of the active one
MAX_SLOTS = 256  # slots are bytes

# Blender's attribute types: property to read, components, NumPy type
_TYPES = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "INT8": ("value", 1, np.int8),
    "BOOLEAN": ("value", 1, np.bool_),
    "FLOAT2": ("vector", 2, np.float32),
    "INT16_2D": ("value", 2, np.int16),
    "INT32_2D": ("value", 2, np.int32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),  # `color` is linear
    "QUATERNION": ("value", 4, np.float32),
}
_DOMAINS = {"POINT": "vertex", "CORNER": "corner", "FACE": "face"}
# What split normals depend on beside positions and topology.
_SHADING = ("sharp_face", "sharp_edge", "custom_normal")


@dataclass
class MeshRecord:
    """A mesh that the core has (or an empty one that it was not given)."""

    id: int
    digest: tuple = ()
    wanted: frozenset = frozenset()
    triangles: int = 0
    slots: int = 1  # highest material slot used, plus one
    seen: int = -1  # number of the sync that last met it
    read: int = -1  # number of the sync that last compared or read its arrays


def read_attribute(attribute, borrow: bool = False) -> np.ndarray | None:
    """Values of an attribute, (N, components), or None for a type without a picture (strings, matrices)."""
    how = _TYPES.get(attribute.data_type)
    if how is None:
        return None
    prop, components, dtype = how
    return arrays.read(attribute.data, prop, len(attribute.data), components, dtype, borrow)


def render_uv(mesh) -> str:
    """Name of the UV map that is active for rendering, or ""."""
    for layer in mesh.uv_layers:
        if layer.active_render:
            return layer.name
    return ""


def _chosen_attributes(mesh, wanted: frozenset, uv: str) -> list[str]:
    """Names to export: those materials ask for, the render UV map first, at most what the core takes."""
    names = [uv] if uv else []
    wanted = wanted | {name.removesuffix(_TANGENT) for name in _tangent_names(mesh, wanted, uv)}
    names += sorted(name for name in wanted if name and name != uv and name != "position" and name in mesh.attributes)
    return names


def _tangent_names(mesh, wanted: frozenset, uv: str) -> list[str]:
    """Of the names that materials ask for, those that are tangents of a UV map this mesh has."""
    maps = mesh.uv_layers
    tangents = sorted(name for name in wanted if name.endswith(_TANGENT) and name not in mesh.attributes)
    return [name for name in tangents if (name == _TANGENT and uv) or name.removesuffix(_TANGENT) in maps]


def generated_coordinates(mesh, positions: np.ndarray) -> np.ndarray:
    """Vertices in texture space, 0 to 1 over its box, from where they were before deformation, (V, 3)."""
    before = np.empty_like(positions)
    mesh.vertices.foreach_get("undeformed_co", before.reshape(-1))
    size = np.array(mesh.texspace_size, np.float32)
    low = np.array(mesh.texspace_location, np.float32) - size
    return (before - low) * np.divide(0.5, size, out=np.zeros_like(size), where=size != 0)


class _Reader:
    """One evaluated mesh's arrays, each read at most once. borrow: those that stay Blender's will do."""

    def __init__(self, mesh, wanted: frozenset, notes, borrow: bool = False):
        self.mesh, self.notes, self.borrow = mesh, notes, borrow
        self.vertices, self.corners = len(mesh.vertices), len(mesh.loops)
        self.faces = len(mesh.polygons)
        self.positions = np.empty((0, 3), np.float32)
        self.corner_verts = np.empty(0, np.int32)
        if self.vertices:
            self.positions = read_attribute(mesh.attributes["position"], borrow)
        if self.corners:
            self.corner_verts = read_attribute(mesh.attributes[".corner_vert"], borrow).reshape(-1)
        slots = mesh.attributes.get("material_index")
        self.face_slots = read_attribute(slots).reshape(-1) if slots is not None and slots.domain == "FACE" else None
        self.uv = render_uv(mesh)
        self.attributes = []
        for name in _chosen_attributes(mesh, wanted, self.uv):
            attribute = mesh.attributes[name]
            domain = _DOMAINS.get(attribute.domain)
            values = read_attribute(attribute, borrow)
            if domain is None or values is None:
                notes.add(
                    f"Mesh '{mesh.name}': attribute '{name}' is per {attribute.domain.lower()} "
                    f"of type {attribute.data_type.lower()}: not available to materials",
                    "Mesh",
                    mesh.name,
                )
                continue
            if len(self.attributes) == MAX_ATTRIBUTES:
                text = f"Mesh '{mesh.name}': more than {MAX_ATTRIBUTES} attributes used: '{name}' left out"
                notes.add(text, "Mesh", mesh.name)
                break
            self.attributes.append((name, domain, np.ascontiguousarray(values, np.float32)))
        if GENERATED in wanted and self.vertices and len(self.attributes) < MAX_ATTRIBUTES:
            self.attributes.append((GENERATED, "vertex", generated_coordinates(mesh, self.positions)))
        self.tangents = _tangent_names(mesh, wanted, self.uv)

    def digest(self) -> tuple:
        """Two checksums over everything the exported arrays are made of."""
        mesh = self.mesh
        parts = [self.positions, self.corner_verts]
        if self.face_slots is not None:
            parts.append(self.face_slots)
        parts += [values for _, _, values in self.attributes]
        for name in _SHADING:
            attribute = mesh.attributes.get(name)
            values = read_attribute(attribute) if attribute is not None else None
            if values is not None:
                parts.append(values)
        if mesh.has_custom_normals and "custom_normal" not in mesh.attributes:
            parts.append(self.normals())
        crc, xor = 0, 0
        for part in parts:
            crc = zlib.crc32(part, crc)
            words = part.reshape(-1).view(np.uint8)
            whole = words[: len(words) // 8 * 8].view(np.uint64)
            xor ^= int(np.bitwise_xor.reduce(whole)) if len(whole) else 0
        names = tuple((name, domain) for name, domain, _ in self.attributes)
        names += tuple(self.tangents)
        return (crc, xor, self.vertices, self.corners, self.faces, mesh.normals_domain, self.uv, names)

    def normals(self) -> np.ndarray:
        return arrays.read(self.mesh.corner_normals, "vector", self.corners, 3, np.float32, self.borrow)

    def shading_normals(self) -> tuple[np.ndarray | None, bool]:
        """Normals (C, 3), or None where all faces are flat; whether they are one a vertex and not one a corner.

        One a vertex where no edge is sharp and nothing else is said corner by corner: a third of the memory.
        """
        mesh = self.mesh
        if mesh.normals_domain == "FACE":
            return None, False
        corner_wise = self.tangents or any(domain == "corner" for _, domain, _ in self.attributes)
        if mesh.normals_domain != "POINT" or corner_wise:
            return self.normals(), False
        return arrays.read(mesh.vertex_normals, "vector", self.vertices, 3, np.float32, self.borrow), True

    def tangents_of(self) -> list[tuple[str, int]]:
        """Names of tangents that materials ask for, and the index of the UV map of each among the attributes."""
        found = []
        maps = {
            name: index
            for index, (name, domain, values) in enumerate(self.attributes)
            if domain == "corner" and values.shape[1] == 2
        }
        for name in self.tangents:
            uv = maps.get(name.removesuffix(_TANGENT) or self.uv)
            if uv is None or len(self.attributes) + len(found) == MAX_ATTRIBUTES:
                text = f"Mesh '{self.mesh.name}': no room for the tangents of a UV map ('{name}')"
                self.notes.add(text, "Mesh", self.mesh.name)
                continue
            found.append((name, uv))
        return found

    def triangles(self) -> tuple[np.ndarray, np.ndarray | None]:
        """Corners of the triangles (T, 3), and the face of each or None where triangle i is face i.

        Corners that belong to Blender are not writeable: to be copied where they are kept.
        """
        if self.corners == 3 * self.faces:
            return _in_order(self.corners).reshape(-1, 3), None
        triangles = self.mesh.loop_triangles
        count = len(triangles)
        corners = arrays.in_place(triangles, "loops", count, 3, np.int32) if count else None
        if corners is None:
            corners = np.empty((count, 3), np.int32)
            triangles.foreach_get("loops", corners.reshape(-1))
        faces = np.empty(count, np.int32)
        self.mesh.loop_triangle_polygons.foreach_get("value", faces)
        return corners.view(np.uint32), faces


_ordered = np.arange(0, dtype=np.uint32)


def _in_order(count: int) -> np.ndarray:
    """0, 1, … count - 1 as uint32, to be read only: all meshes share them."""
    global _ordered
    if len(_ordered) < count:
        _ordered = np.arange(max(count, 2 * len(_ordered)), dtype=np.uint32)
        _ordered.flags.writeable = False
    return _ordered[:count]


def _slots(reader: _Reader, faces: np.ndarray | None, slot_count: int) -> np.ndarray | None:
    """Material slot of each triangle as bytes, None where all use the first."""
    if reader.face_slots is None or slot_count <= 1:
        return None
    slots = reader.face_slots if faces is None else reader.face_slots[faces]
    # Blender draws faces of a missing slot with the last one.
    slots = np.clip(slots, 0, min(slot_count, MAX_SLOTS) - 1).astype(np.uint8)
    return slots if slots.any() else None


class MeshSync:
    """Meshes the core has, by key: ("mesh", uid) where objects share data, ("object", uid, ...) where they don't."""

    def __init__(self, scene, ids, notes):
        self._scene, self._ids, self._notes = scene, ids, notes
        self._records: dict[tuple, MeshRecord] = {}
        self.compare = True  # False: the scene is synced once only, so digests are not worth their time
        self.borrow = False  # the core takes arrays where Blender has them: until the sync ends, nobody changes them
        self.uploaded = 0

    def known(self, key: tuple, wanted: frozenset, slot_count: int, sync: int, changed: bool) -> MeshRecord | None:
        """The record of a mesh that need not be looked at again in this sync; marks it as met."""
        record = self._records.get(key)
        if record is None:
            return None
        fresh = record.read == sync or (not changed and record.wanted == wanted)
        if not fresh or slot_count < record.slots:
            return None
        record.seen = sync
        return record

    def upsert(self, key: tuple, mesh, slot_count: int, wanted: frozenset, sync: int, passing=False) -> MeshRecord:
        """Reads a mesh and uploads it if it differs from what the core has. Empty meshes get triangles == 0.

        passing: the mesh is gone before the sync ends.
        """
        record = self._records.get(key)
        if record is None:
            record = self._records[key] = MeshRecord(self._ids.get(("mesh-data", *key)))
        record.seen = record.read = sync
        reader = _Reader(mesh, wanted, self._notes, self.borrow and not passing)
        slots_read = 0 if reader.face_slots is None else min(slot_count, MAX_SLOTS)
        digest = (*reader.digest(), slots_read) if self.compare else ()
        record.wanted = wanted
        if digest and digest == record.digest:
            return record
        had = record.triangles > 0
        record.triangles = self._export(record, reader, mesh, slot_count)
        record.digest = digest
        if had and not record.triangles:
            record.digest = ()
        return record

    def _export(self, record: MeshRecord, reader: _Reader, mesh, slot_count: int) -> int:
        if not reader.faces:
            return 0
        corners, faces = reader.triangles()
        if not len(corners):
            return 0
        # Triangle i is face i: its corners are in order, and so are their vertices.
        vertices = (reader.corner_verts.reshape(-1, 3) if faces is None else reader.corner_verts[corners]).view(
            np.uint32
        )
        slots = _slots(reader, faces, slot_count)
        positions = reader.positions
        normals, at_vertices = reader.shading_normals()
        attributes = reader.attributes
        if faces is not None:
            attributes = [
                (name, domain, np.ascontiguousarray(values[faces]) if domain == "face" else values)
                for name, domain, values in attributes
            ]
        if not np.isfinite(positions).all():
            positions, keep = _without_bad(positions, vertices)
            self._notes.add(
                f"Mesh '{mesh.name}': {len(vertices) - int(keep.sum())} faces with coordinates that are no numbers "
                "left out",
                "Mesh",
                mesh.name,
            )
            vertices, corners = vertices[keep], np.ascontiguousarray(corners[keep])
            slots = slots[keep] if slots is not None else None
            attributes = [(n, d, np.ascontiguousarray(v[keep]) if d == "face" else v) for n, d, v in attributes]
            if not len(vertices):
                return 0
        names = [name for name, _, _ in attributes]
        if (normals is None or at_vertices) and all(domain != "corner" for _, domain, _ in attributes):
            corners = None
        elif faces is not None and not corners.flags.writeable and not reader.borrow:
            corners = corners.copy()
        self._scene.upsert_mesh(
            record.id,
            mesh.name,
            positions,
            np.ascontiguousarray(vertices),
            tri_corners=corners,
            normals=normals,
            tri_slots=slots,
            attributes=attributes,
            tangents=reader.tangents_of(),
            default_uv=names.index(reader.uv) if reader.uv in names else -1,
            lend=True,
        )
        record.slots = 1 if slots is None else int(slots.max()) + 1
        self.uploaded += 1
        return len(vertices)

    def remove_unseen(self, sync: int) -> None:
        """Removes meshes that this sync did not meet. Instances of them must be gone."""
        for key in [key for key, record in self._records.items() if record.seen != sync or not record.triangles]:
            record = self._records[key]
            if self._scene.has_mesh(record.id):
                self._scene.remove_mesh(record.id)
            if record.seen != sync:
                del self._records[key]
                self._ids.forget(("mesh-data", *key))


def _without_bad(positions: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions with non-finite ones set to 0, and which triangles touch none of them."""
    good = np.isfinite(positions).all(axis=1)
    return np.where(good[:, None], positions, np.float32(0)), good[vertices].all(axis=1)
