# SPDX-License-Identifier: Apache-2.0
"""UsdGeomMesh to the core's triangle meshes, checked: a file's indices and counts are not to be trusted.

Subdivision surfaces are rendered as their base mesh with smooth vertex normals; refinement is not done.
"""

from dataclasses import dataclass, field

import numpy as np

from headwater.usd_scene.triangulate import newell_normals, triangulate

VERTEX, CORNER, FACE = "vertex", "corner", "face"
MAX_ATTRIBUTES = 8  # HW_MAX_ATTRIBUTES
MAX_SLOTS = 256
TANGENT = ".tangent"  # ending of the names of tangents, behind the name of the UV map; alone: of the default one
UV_NAMES = ("st", "UVMap", "uv", "st0", "map1", "Texture_uv")


class MeshError(Exception):
    """Why a mesh can't be rendered."""


@dataclass
class Mesh:
    """Arguments of the core's upsert_mesh."""

    positions: np.ndarray  # (V, 3) float32
    tri_vertices: np.ndarray  # (T, 3) uint32
    tri_corners: np.ndarray | None = None  # (T, 3) uint32 into normals and corner attributes
    normals: np.ndarray | None = None  # (C, 3) float32
    tri_slots: np.ndarray | None = None  # (T,) uint8
    attributes: list = field(default_factory=list)  # (name, domain, (N, k) float32)
    tangents: list = field(default_factory=list)  # (name, index of a UV map among the attributes)
    default_uv: int = -1


@dataclass
class Topology:
    """Checked faces of a mesh, after triangulation."""

    counts: np.ndarray  # (F,)
    indices: np.ndarray  # (sum of counts,)
    triangles: np.ndarray  # (T, 3) into corners
    faces: np.ndarray  # (T,)


def read_mesh(prim, time, points, subsets, report) -> Mesh:
    """The mesh at `time`. `points` (V, 3): positions in place of the file's (skinned), or None.

    `subsets`: list of face index arrays, one for each material slot from 1 on. Raises MeshError.
    """
    from pxr import UsdGeom

    geometry = UsdGeom.Mesh(prim)
    if points is None:
        points = read_points(geometry.GetPointsAttr().Get(time))
        deformed = False
    else:
        deformed = True
    topology = read_topology(geometry, time, points, prim, report)
    mesh = Mesh(points, topology.indices[topology.triangles].astype(np.uint32))
    scheme = geometry.GetSubdivisionSchemeAttr().Get(time)
    if scheme != UsdGeom.Tokens.none:
        report.once(
            "subdivision", "subdivision surfaces are rendered as their base mesh with smooth normals, not refined"
        )
    _read_attributes(prim, time, topology, mesh, report)
    normals, per_corner = _read_normals(geometry, time, topology, points, scheme, deformed, report)
    uses_corners = per_corner or any(domain == CORNER for _, domain, _ in mesh.attributes)
    if uses_corners:
        mesh.tri_corners = topology.triangles.astype(np.uint32)
    if normals is not None:
        mesh.normals = normals if per_corner or not uses_corners else normals[topology.indices]
    if subsets:
        mesh.tri_slots = _slots(subsets, topology, prim, report)
    return mesh


def ask_tangents(mesh: Mesh, names) -> list[str]:
    """Asks the core for tangents by their names; returns those there is no room for. Maps that lack have none."""
    left_out = []
    for name in sorted(names):
        own = name.removesuffix(TANGENT)
        maps = [i for i, (n, _, _) in enumerate(mesh.attributes) if n == own] if own else [mesh.default_uv]
        if not maps or maps[0] < 0 or not _is_map(*mesh.attributes[maps[0]]):
            continue
        if len(mesh.attributes) + len(mesh.tangents) == MAX_ATTRIBUTES:
            left_out.append(name)
        else:
            mesh.tangents.append((name, maps[0]))
    if mesh.tangents and mesh.tri_corners is None:  # one vertex has several where the map is mirrored
        mesh.tri_corners = np.arange(mesh.tri_vertices.size, dtype=np.uint32).reshape(-1, 3)
        if mesh.normals is not None:
            mesh.normals = mesh.normals[mesh.tri_vertices.reshape(-1)]
    return left_out


def _is_map(_name, domain, values) -> bool:
    return domain != FACE and values.ndim == 2 and values.shape[1] >= 2


def read_points(values) -> np.ndarray:
    """(V, 3) float32 positions of a USD array. Raises MeshError when they are missing or not finite."""
    if values is None or not len(values):
        raise MeshError("it has no points")
    points = np.array(values, np.float32).reshape(-1, 3)
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise MeshError(f"point {bad[0]} is not finite ({len(bad)} such points)")
    return points


def read_topology(geometry, time, points, prim, report) -> Topology:
    """Faces that can be rendered. Faces with bad indices are left out with a warning; broken counts are a MeshError."""
    from pxr import UsdGeom

    counts = np.array(geometry.GetFaceVertexCountsAttr().Get(time) or [], np.int64)
    indices = np.array(geometry.GetFaceVertexIndicesAttr().Get(time) or [], np.int64)
    if not len(counts):
        raise MeshError("it has no faces")
    if counts.min() < 0 or counts.sum() != len(indices):
        raise MeshError(f"its face counts ask for {int(counts.sum())} indices and it has {len(indices)}")
    faces_of_corners = np.repeat(np.arange(len(counts)), counts)
    drop = np.zeros(len(counts), bool)
    bad = (indices < 0) | (indices >= len(points))
    if bad.any():
        drop[faces_of_corners[bad]] = True
        example = int(indices[np.flatnonzero(bad)[0]])
        report.warn(
            prim.GetPath(),
            f"{int(drop.sum())} faces are left out: point {example} is not one of its {len(points)} points",
        )
        indices = np.where(bad, 0, indices)
    holes = np.array(geometry.GetHoleIndicesAttr().Get(time) or [], np.int64)
    drop[holes[(holes >= 0) & (holes < len(counts))]] = True
    triangles, faces = triangulate(np.where(drop, 0, counts), _corner_points(points, indices, drop, counts))
    # Corners of dropped faces stay in the flat corner list, so that face-varying values keep their places.
    if drop.any():
        kept = np.flatnonzero(~np.repeat(drop, counts))
        triangles = kept[triangles] if len(triangles) else triangles
    if not len(triangles):
        raise MeshError("it has no faces that can be rendered")
    if geometry.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded:
        triangles = np.ascontiguousarray(triangles[:, [0, 2, 1]])
    return Topology(counts, indices, triangles, faces)


def _corner_points(points, indices, drop, counts):
    return points[indices[~np.repeat(drop, counts)]]


def _read_attributes(prim, time, topology, mesh, report):
    from pxr import Sdf, UsdGeom

    found = []
    for primvar in UsdGeom.PrimvarsAPI(prim).FindPrimvarsWithInheritance():
        name = primvar.GetPrimvarName()
        if name == "normals" or name.startswith("skel:") or not primvar.HasValue():
            continue
        kind = primvar.GetTypeName().scalarType
        is_uv = kind in (
            Sdf.ValueTypeNames.TexCoord2f,
            Sdf.ValueTypeNames.TexCoord2d,
            Sdf.ValueTypeNames.TexCoord2h,
        ) or (
            name in UV_NAMES
            and kind in (Sdf.ValueTypeNames.Float2, Sdf.ValueTypeNames.Double2, Sdf.ValueTypeNames.Half2)
        )
        try:
            values = primvar.ComputeFlattened(time)
        except Exception:
            values = None
        array = as_float_rows(values)
        if array is None:
            if is_uv or name in ("displayColor", "displayOpacity"):
                report.warn(prim.GetPath(), f"primvar '{name}' can't be read: its indices or values are broken")
            continue
        placed = place_primvar(primvar.GetInterpolation(), array, topology, len(mesh.positions))
        if placed is None:
            report.warn(
                prim.GetPath(),
                f"primvar '{name}' has {len(array)} values, which is wrong for {primvar.GetInterpolation()}",
            )
            continue
        rank = 0 if is_uv and name in UV_NAMES[:2] else 1 if is_uv else 2 if name.startswith("display") else 3
        found.append((rank, name, is_uv, *placed))
    found.sort(key=lambda entry: entry[:2])
    if len(found) > MAX_ATTRIBUTES:
        dropped = ", ".join(entry[1] for entry in found[MAX_ATTRIBUTES:])
        report.warn(prim.GetPath(), f"only {MAX_ATTRIBUTES} primvars can be used; left out: {dropped}")
    for index, (_, name, is_uv, domain, array) in enumerate(found[:MAX_ATTRIBUTES]):
        mesh.attributes.append((name, domain, array))
        if is_uv and mesh.default_uv < 0:
            mesh.default_uv = index


def as_float_rows(values) -> np.ndarray | None:
    """A primvar's value as (N, k) float32 with k in 1..4 and only finite numbers; None when it is not of that kind."""
    if values is None or isinstance(values, str):
        return None
    try:
        array = np.array(values, np.float32)
    except (TypeError, ValueError):
        return None
    if array.ndim < 2:
        array = array.reshape(-1, 1) if hasattr(values, "__len__") and array.ndim else array.reshape(1, -1)
    if array.ndim != 2 or not 1 <= array.shape[1] <= 4 or not len(array) or not np.isfinite(array).all():
        return None
    return np.ascontiguousarray(array)


def place_primvar(interpolation, array, topology, vertex_count):
    """(domain, array) of values by USD's interpolation; None when there are too few of them. Surplus values are cut."""
    corner_count, face_count = len(topology.indices), len(topology.counts)
    if interpolation == "constant" or (interpolation == "" and len(array) == 1):
        return FACE, np.broadcast_to(array[:1], (len(topology.faces), array.shape[1])).copy()
    if interpolation in ("vertex", "varying"):
        return (VERTEX, array[:vertex_count]) if len(array) >= vertex_count else None
    if interpolation == "faceVarying":
        return (CORNER, array[:corner_count]) if len(array) >= corner_count else None
    if interpolation == "uniform":
        return (FACE, np.ascontiguousarray(array[topology.faces])) if len(array) >= face_count else None
    return None


def _read_normals(geometry, time, topology, points, scheme, deformed, report):
    """((N, 3) normals or None, whether they are per corner)."""
    from pxr import UsdGeom

    if scheme != UsdGeom.Tokens.none:
        return smooth_normals(topology, points), False  # USD: authored normals do not count on subdivision surfaces
    primvar = UsdGeom.PrimvarsAPI(geometry.GetPrim()).GetPrimvar("normals")
    if primvar and primvar.HasValue():
        array, interpolation = as_float_rows(primvar.ComputeFlattened(time)), primvar.GetInterpolation()
    else:
        values = geometry.GetNormalsAttr().Get(time)
        array, interpolation = as_float_rows(values), geometry.GetNormalsInterpolation()
        if values is None or not len(values):
            return None, False
    if array is None or array.shape[1] != 3:
        report.warn(geometry.GetPath(), "its normals are broken; it is shaded flat")
        return None, False
    if deformed:
        return smooth_normals(topology, points), False
    placed = place_primvar(interpolation, array, topology, len(points))
    if placed is None:
        report.warn(geometry.GetPath(), f"its {len(array)} normals are too few for {interpolation}; it is shaded flat")
        return None, False
    domain, array = placed
    if domain == FACE:
        return None, False  # one normal a face: flat shading, from the geometry
    lengths = np.linalg.norm(array, axis=1, keepdims=True)
    array = np.divide(array, lengths, out=np.zeros_like(array), where=lengths > 0)
    fallback = np.flatnonzero(lengths[:, 0] == 0)
    if len(fallback):
        smooth = smooth_normals(topology, points)
        array[fallback] = smooth[topology.indices[fallback]] if domain == CORNER else smooth[fallback]
    return array, domain == CORNER


def smooth_normals(topology, points) -> np.ndarray:
    """(V, 3) float32 unit vertex normals: means of the triangles' normals, weighted by area."""
    vertices = topology.indices[topology.triangles]
    faces = newell_normals(points[vertices].astype(np.float64))
    normals = np.zeros((len(points), 3))
    for corner in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(vertices[:, corner], faces[:, axis], len(points))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.broadcast_to([0.0, 0.0, 1.0], normals.shape).copy(), where=lengths > 0)
    return normals.astype(np.float32)


def _slots(subsets, topology, prim, report):
    if len(subsets) >= MAX_SLOTS:
        raise MeshError(f"it has {len(subsets)} material subsets; at most {MAX_SLOTS - 1} are possible")
    by_face = np.zeros(len(topology.counts), np.uint8)
    for slot, faces in enumerate(subsets, 1):
        inside = faces[(faces >= 0) & (faces < len(by_face))]
        if len(inside) != len(faces):
            report.warn(prim.GetPath(), f"{len(faces) - len(inside)} faces of a material subset are not in the mesh")
        by_face[inside] = slot
    return by_face[topology.faces]
