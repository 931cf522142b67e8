# SPDX-License-Identifier: Apache-2.0
"""UsdGeom's implicit shapes (cube, sphere, cylinder, cone, capsule, plane) as triangle meshes."""

import math

import numpy as np

from headwater.usd_scene.mesh import FACE, VERTEX, Mesh, MeshError, as_float_rows

SEGMENTS = 96  # around; a sphere's silhouette is then off by 0.05 % of its radius
_KINDS = ("Cube", "Sphere", "Cylinder", "Cone", "Capsule", "Plane")


def is_shape(prim) -> bool:
    """Whether `prim` is one of the implicit shapes."""
    return str(prim.GetTypeName()) in _KINDS


def shape_varies(prim) -> bool:
    """Whether the shape may change over time."""
    names = ("size", "radius", "height", "axis", "width", "length", "primvars:displayColor")
    return any(prim.GetAttribute(name).ValueMightBeTimeVarying() for name in names if prim.HasAttribute(name))


def shape_mesh(prim, time) -> Mesh:
    """The shape at `time` in its own space. Raises MeshError for sizes that are no lengths."""

    def length(name):
        value = float(prim.GetAttribute(name).Get(time))
        if not (math.isfinite(value) and value > 0):
            raise MeshError(f"its {name} {value:g} is not positive")
        return value

    kind = str(prim.GetTypeName())
    if kind == "Cube":
        mesh = _cube(length("size") / 2)
    elif kind == "Plane":
        mesh = _plane(length("width") / 2, length("length") / 2)
    elif kind == "Sphere":
        radius = length("radius")
        mesh = _revolve([_arc(radius, 0.0, -90, 90)])
    elif kind == "Cylinder":
        radius, half = length("radius"), length("height") / 2
        mesh = _revolve(
            [
                _line((0, -half), (radius, -half)),
                _line((radius, -half), (radius, half)),
                _line((radius, half), (0, half)),
            ]
        )
    elif kind == "Cone":
        radius, half = length("radius"), length("height") / 2
        mesh = _revolve([_line((0, -half), (radius, -half)), _line((radius, -half), (0, half))])
    else:
        radius, half = length("radius"), length("height") / 2
        mesh = _revolve(
            [_arc(radius, -half, -90, 0), _line((radius, -half), (radius, half)), _arc(radius, half, 0, 90)]
        )
    axis = str(prim.GetAttribute("axis").Get(time)) if prim.HasAttribute("axis") else "Z"
    _turn(mesh, axis)
    color = prim.GetAttribute("primvars:displayColor")
    rows = as_float_rows(color.Get(time)) if color and color.HasValue() else None
    if rows is not None and len(rows) == 1 and rows.shape[1] == 3:
        mesh.attributes.append(("displayColor", FACE, np.repeat(rows, len(mesh.tri_vertices), axis=0)))
    return mesh


def _turn(mesh, axis):
    """From z to the shape's axis, by the cyclic swap that keeps handedness."""
    shift = {"X": 1, "Y": 2}.get(axis, 0)
    mesh.positions = np.ascontiguousarray(np.roll(mesh.positions, shift, axis=1))
    if mesh.normals is not None:
        mesh.normals = np.ascontiguousarray(np.roll(mesh.normals, shift, axis=1))


def _line(start, end):
    """A straight piece of a profile: (radius, z) points and their normals."""
    points = np.array([start, end], float)
    along = points[1] - points[0]
    normal = np.array([along[1], -along[0]]) / np.linalg.norm(along)
    return points, np.stack([normal, normal])


def _arc(radius, height, first, last):
    angles = np.radians(np.linspace(first, last, max(2, int(SEGMENTS * abs(last - first) / 360)) + 1))
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return normals * radius + [0, height], normals


def _revolve(pieces) -> Mesh:
    """Turns profile pieces about z, each with its own normals. UV: around and along each piece."""
    turn = np.linspace(0, 2 * math.pi, SEGMENTS + 1)
    cos, sin = np.cos(turn), np.sin(turn)
    positions, normals, uvs, triangles = [], [], [], []
    base = 0
    for points, directions in pieces:
        rows = len(points)
        for row in range(rows):
            for source, target in ((points, positions), (directions, normals)):
                target.append(
                    np.stack([source[row, 0] * cos, source[row, 0] * sin, np.full(len(turn), source[row, 1])], axis=1)
                )
            uvs.append(np.stack([turn / (2 * math.pi), np.full(len(turn), row / (rows - 1))], axis=1))
        a = base + np.arange(rows - 1)[:, None] * len(turn) + np.arange(SEGMENTS)[None]
        b, c, d = a + 1, a + len(turn) + 1, a + len(turn)
        triangles += [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
        base += rows * len(turn)
    positions, triangles = np.concatenate(positions), np.concatenate(triangles)
    corners = positions[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    triangles = triangles[area > 1e-12 * area.max()]  # at the poles one of the two triangles is empty
    return Mesh(
        positions.astype(np.float32),
        triangles.astype(np.uint32),
        normals=np.concatenate(normals).astype(np.float32),
        attributes=[("st", VERTEX, np.concatenate(uvs).astype(np.float32))],
        default_uv=0,
    )


def _cube(half) -> Mesh:
    faces, uvs = [], np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (6, 1))
    for axis in range(3):
        for sign in (-1.0, 1.0):
            corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)[:: int(sign)]
            face = np.zeros((4, 3))
            face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = sign, corners[:, 0], corners[:, 1]
            faces.append(face * half)
    return _quads(np.concatenate(faces), uvs)


def _plane(half_width, half_length) -> Mesh:
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float) * [half_width, half_length, 0]
    return _quads(corners, np.array([[0, 0], [1, 0], [1, 1], [0, 1]]))


def _quads(positions, uvs) -> Mesh:
    first = np.arange(0, len(positions), 4)[:, None]
    triangles = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]], axis=1).reshape(-1, 3)
    return Mesh(
        positions.astype(np.float32),
        triangles.astype(np.uint32),
        attributes=[("st", VERTEX, uvs.astype(np.float32))],
        default_uv=0,
    )
