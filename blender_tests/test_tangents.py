# SPDX-License-Identifier: Apache-2.0
"""Tangents that the core makes of UV maps, against those of NumPy, in a picture of both; requests that are refused."""

import numpy as np
import pytest
from core_scenes import EYE, bumpy, placed

from headwater.materials import Graph, Surface
from headwater.materials import opcodes as op


def unit(vectors):
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, lengths, out=np.zeros_like(vectors), where=lengths > 0)


def reference(points, normals, uv):
    """Tangents at the corners of triangles, (T, 3, 4). points, normals: (T, 3, 3) float32; uv: (T, 3, 2) float32.

    Corners that agree in position, normal, UV and handedness share one, weighted by the angle at the corner.
    """
    p, n, m = (a.astype(np.float64) for a in (points, normals, uv))
    e1, e2, d1, d2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], m[:, 1] - m[:, 0], m[:, 2] - m[:, 0]
    area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    along = unit((e1 * d2[:, 1:] - e2 * d1[:, 1:]) * np.sign(area)[:, None])

    def in_plane(vectors):
        return unit(vectors - n * np.einsum("...k,...k", vectors, n)[..., None])

    keys = np.concatenate([points, normals, uv], axis=2).reshape(-1, 8) + np.float32(0)
    place = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    kept, empty = np.repeat(area >= 0, 3), np.repeat(~along.any(axis=1), 3)
    has = [np.bincount(place[~empty & (kept == k)], minlength=place.max() + 1) > 0 for k in (False, True)]
    kept[empty] = has[True][place[empty]] | ~has[False][place[empty]]
    group = 2 * place + kept
    angle = np.einsum("tck,tck->tc", in_plane(np.roll(p, -1, axis=1) - p), in_plane(np.roll(p, 1, axis=1) - p))
    shares = (in_plane(np.repeat(along[:, None], 3, axis=1)) * np.arccos(np.clip(angle, -1, 1))[..., None]).reshape(
        -1, 3
    )
    sums = np.stack([np.bincount(group, shares[:, k]) for k in range(3)], axis=1)
    return np.concatenate([unit(sums)[group], np.where(kept, 1.0, -1.0)[:, None]], axis=1).reshape(-1, 3, 4)


def shown(core, context, mesh, attributes, tangents, emission):
    """A picture from above of a mesh that emits `emission(graph)`."""
    positions, triangles, corners, normals = mesh
    scene = core.Scene()
    scene.upsert_mesh(
        1, "m", positions, triangles, tri_corners=corners, normals=normals, attributes=attributes, tangents=tangents
    )
    graph = Graph()
    surface = Surface(graph)
    surface.emit(emission(graph))
    made = surface.finish([], [], [])
    scene.upsert_material(1, "m", made.program, made.constants, flags=made.flags)
    scene.upsert_instance(1, 1, EYE, materials=[1])
    scene.set_camera("orthographic", placed(z=4), (-0.9, 0.9, -0.9, 0.9))
    session = core.Session(context, scene)
    session.sync()
    session.start({"width": 64, "height": 64, "samples": 1, "max_bounces": 0, "passes": ["Combined"]})
    while not session.wait(1000):
        pass
    session.finish()
    return np.array(session.read("Combined"), np.float64)[..., :3]


@pytest.mark.parametrize("smooth", [True, False])
def test_tangents_are_those_of_numpy(core, make_context, smooth):
    """A bumpy grid whose map is bent, mirrored in one half, of no area in one corner; quads share their corners."""
    positions, triangles = bumpy(16)
    vertex_normals = unit(np.stack([*(-positions[:, :2].T * 0.6), np.ones(len(positions))], axis=1)).astype(np.float32)
    quads = np.arange(len(triangles) // 2, dtype=np.uint32)[:, None] * 4
    corners = (quads + np.array([0, 1, 2, 0, 2, 3], np.uint32)).reshape(-1, 3)
    vertices = np.zeros(corners.max() + 1, np.int64)
    vertices[corners] = triangles
    x, y = positions[vertices, 0], positions[vertices, 1]
    uv = np.stack([np.abs(x - 0.1) + 0.2 * np.sin(3 * y), y + 0.3 * np.cos(2 * x)], axis=1).astype(np.float32)
    uv[(x > 0.6) & (y > 0.6)] = 0.25
    points = positions[triangles]
    flat = unit(np.cross(*(points[:, k].astype(np.float64) - points[:, 0] for k in (1, 2)))).astype(np.float32)
    at_corners = vertex_normals[triangles] if smooth else np.repeat(flat[:, None], 3, axis=1)
    expected = np.zeros((len(vertices), 4), np.float32)
    expected[corners] = reference(points, at_corners, uv[corners])
    attributes = [("uv", "corner", uv), ("expected", "corner", expected)]
    mesh = (positions, triangles, corners, vertex_normals[vertices] if smooth else None)

    def off(graph):  # by how much, about a middle of 2
        found, wanted = (graph.attribute(name, op.ATTRIBUTE_VALUE) for name in ("made", "expected"))
        sign = graph.sub(*(graph.attribute(name, op.ATTRIBUTE_ALPHA) for name in ("made", "expected")))
        return graph.add(graph.add(graph.sub(found, wanted), sign), graph.const(2.0))

    context = make_context()
    differs = np.abs(shown(core, context, mesh, attributes, [("made", 0)], off) - 2)
    seen = shown(
        core, context, mesh, attributes, [("made", 0)], lambda g: g.abs(g.attribute("made", op.ATTRIBUTE_VALUE))
    )
    assert differs.max() < 2e-5, np.argwhere(differs > 2e-5)[:5]
    assert 0.5 < np.linalg.norm(seen, axis=2).mean() < 1 and len(np.unique(seen.round(3))) > 50
    assert (np.linalg.norm(seen, axis=2) == 0).sum() > 9  # where the map has no area


@pytest.mark.parametrize(
    ("words", "tangents"),
    [
        ("attribute 1: there are 1", [("t", 1)]),
        ("given twice", [("uv", 0)]),
        ("9 attributes", [(f"t{i}", 0) for i in range(8)]),
    ],
)
def test_tangents_of_what_is_no_map_are_refused(core, words, tangents):
    positions, triangles = bumpy(2)
    scene = core.Scene()
    with pytest.raises(core.SceneError, match=words):
        attributes = [("uv", "vertex", positions[:, :2].copy())]
        scene.upsert_mesh(1, "m", positions, triangles, attributes=attributes, tangents=tangents)
    assert not scene.has_mesh(1)
    with pytest.raises(TypeError):
        scene.upsert_mesh(1, "m", positions, triangles, tangents=[("t", -1)])
