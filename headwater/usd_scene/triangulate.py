# SPDX-License-Identifier: Apache-2.0
"""Polygons to triangles. Convex polygons are fans; concave ones are cut by ear clipping (Meisters 1975).

Polygons in space are judged in the plane of their Newell normal (Sutherland, Sproull, Schumacker 1974).
"""

import numpy as np


def newell_normals(corners: np.ndarray) -> np.ndarray:
    """(F, n, 3) polygons' normals (F, 3), of twice the area's length."""
    following = np.roll(corners, -1, axis=1)
    return np.cross(corners, following).sum(axis=1)


def triangulate(counts: np.ndarray, points: np.ndarray):
    """Triangles of polygons with `counts` (F,) corners, whose corners' positions are `points` (sum(counts), 3).

    Returns corner indices (T, 3) into the flat corner list and each triangle's polygon (T,), in polygon order.
    Polygons with fewer than three corners give nothing. Positions must be finite.
    """
    counts = np.asarray(counts, np.int64)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]]) if len(counts) else counts
    triangles, faces = [], []
    for n in np.unique(counts):
        if n < 3:
            continue
        polygons = np.flatnonzero(counts == n)
        corners = starts[polygons, None] + np.arange(n)
        fan = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
        local = np.broadcast_to(fan, (len(polygons), n - 2, 3)).copy()
        if n > 3:
            positions = points[corners].astype(np.float64)
            for i in np.flatnonzero(_fan_folds(positions)):
                local[i] = clip_ears(positions[i])
        triangles.append((starts[polygons, None, None] + local).reshape(-1, 3))
        faces.append(np.repeat(polygons, n - 2))
    if not triangles:
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    triangles, faces = np.concatenate(triangles), np.concatenate(faces)
    order = np.argsort(faces, kind="stable")
    return triangles[order], faces[order]


def _fan_folds(positions) -> np.ndarray:
    """For each polygon (F, n, 3): whether its fan has a triangle facing against the polygon."""
    normals = newell_normals(positions)
    spokes = positions[:, 1:] - positions[:, :1]
    facing = np.einsum("fki,fi->fk", np.cross(spokes[:, :-1], spokes[:, 1:]), normals)
    return (facing < -1e-12 * np.square(normals).sum(axis=1)[:, None]).any(axis=1)


def clip_ears(polygon: np.ndarray) -> np.ndarray:
    """Triangles (n − 2, 3) of one simple polygon (n, 3). A polygon that crosses itself still gives n − 2 triangles."""
    normal = newell_normals(polygon[None])[0]
    axis = int(np.abs(normal).argmax())
    u, v = ((1, 2), (2, 0), (0, 1))[axis]
    flat = polygon[:, [u, v]] * (1 if normal[axis] >= 0 else [-1, 1])
    left = list(range(len(flat)))
    triangles = []
    while len(left) > 3:
        for place in range(len(left)):
            a, b, c = left[place - 1], left[place], left[(place + 1) % len(left)]
            if _cross(flat[a], flat[b], flat[c]) > 0 and not _any_inside(flat, a, b, c, left):
                break
        else:
            place = 0  # no ear: degenerate or self-crossing; cut anything so that the work ends
            a, b, c = left[-1], left[0], left[1]
        triangles.append((a, b, c))
        del left[place]
    triangles.append(tuple(left))
    return np.array(triangles)


def _cross(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _any_inside(flat, a, b, c, left):
    for i in left:
        if i in (a, b, c):
            continue
        p = flat[i]
        if _cross(flat[a], flat[b], p) >= 0 and _cross(flat[b], flat[c], p) >= 0 and _cross(flat[c], flat[a], p) >= 0:
            return True
    return False
