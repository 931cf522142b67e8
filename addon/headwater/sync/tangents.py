# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents of a UV map at triangle corners, as normal maps are baked for.

After M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited" (2008): corners that agree in position, normal, UV and
handedness share one tangent, the mean of their triangles' tangents in the plane of the normal, weighted by the angle at
the corner. Corners that agree but do not hang together by edges share theirs too, which the reference keeps apart.
"""

import numpy as np


def _normalized(vectors: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0)


def _in_plane(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return _normalized(vectors - normals * np.einsum("...k,...k", vectors, normals)[..., None])


def face_normals(points: np.ndarray) -> np.ndarray:
    """Unit normals of triangles (T, 3, 3), (T, 3); zero for those without area."""
    return _normalized(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]))


def triangle_tangents(points: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Direction of growing u, unit, (T, 3), and whether the UV map keeps the triangle's orientation, (T,).

    points: (T, 3, 3); uv: (T, 3, 2). Zero for triangles without area in the map.
    """
    e1, e2 = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    d1, d2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    direction = e1 * d2[:, 1:] - e2 * d1[:, 1:]
    return _normalized(direction * np.sign(area)[:, None]), area >= 0


def corner_tangents(points: np.ndarray, normals: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Tangents at the corners of triangles, (T, 3, 4) float32: a unit vector (or zero) and the sign of the bitangent.

    points: (T, 3, 3) object space; normals: (T, 3, 3) unit; uv: (T, 3, 2).
    """
    count = len(points)
    tangents, keeps = triangle_tangents(points.astype(np.float64), uv.astype(np.float64))
    flat = normals.reshape(-1, 3).astype(np.float64)
    corner = np.concatenate([points.reshape(-1, 3), normals.reshape(-1, 3), uv.reshape(-1, 2)], axis=1)
    corner = np.ascontiguousarray(corner, np.float32) + np.float32(0)  # -0 and 0 are the same place
    _, place = np.unique(corner.view(np.dtype((np.void, corner.strides[0]))).reshape(-1), return_inverse=True)
    place = place.reshape(-1)

    # A triangle without area in the map goes with whichever handedness its neighbours at the corner have.
    kept = np.repeat(keeps, 3)
    empty = np.repeat(~tangents.any(axis=1), 3)
    has_kept = np.bincount(place[~empty & kept], minlength=place.max() + 1) > 0
    has_turned = np.bincount(place[~empty & ~kept], minlength=place.max() + 1) > 0
    kept[empty] = has_kept[place[empty]] | ~has_turned[place[empty]]
    group = 2 * place + kept

    here = points.astype(np.float64)
    to_next = _in_plane((np.roll(here, -1, axis=1) - here).reshape(-1, 3), flat)
    to_last = _in_plane((np.roll(here, 1, axis=1) - here).reshape(-1, 3), flat)
    angle = np.arccos(np.clip(np.einsum("ij,ij->i", to_next, to_last), -1.0, 1.0))
    shares = _in_plane(np.repeat(tangents, 3, axis=0), flat) * angle[:, None]
    sums = np.stack([np.bincount(group, shares[:, k]) for k in range(3)], axis=1)
    result = np.empty((count * 3, 4), np.float32)
    result[:, :3] = _normalized(sums)[group]
    result[:, 3] = np.where(kept, 1.0, -1.0)
    return result.reshape(count, 3, 4)
