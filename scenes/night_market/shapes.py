# SPDX-License-Identifier: Apache-2.0
"""Polygon shapes of the night market: boxes, turned profiles, tubes and sheets, gathered into Blender meshes.

Lengths are metres, Z up. Every shape carries UVs; planar ones at one unit a metre unless stated.
"""

import math

import bpy
import numpy as np


class Shape:
    """Faces gathered with UVs, a material slot and a smooth flag each."""

    def __init__(self):
        self.vertices, self.faces, self.uvs, self.slots, self.smooth = [], [], [], [], []
        self.groups = []  # a label for every vertex: whoever skins the mesh reads it

    def add(self, vertices, faces, uvs, slot=0, smooth=False, group=""):
        """vertices: (V, 3); faces: index tuples; uvs: one (u, v) for every corner, in face order."""
        base = len(self.vertices)
        self.vertices += [tuple(map(float, v)) for v in vertices]
        self.groups += [group] * len(vertices)
        self.faces += [tuple(base + i for i in face) for face in faces]
        self.uvs += [tuple(map(float, uv)) for uv in uvs]
        self.slots += [slot] * len(faces)
        self.smooth += [smooth] * len(faces)
        return self

    def box(self, center, size, slot=0, group="", uv_scale=1.0):
        c, h = np.asarray(center, float), np.asarray(size, float) / 2
        corners = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]) * h
        faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
        axes = [(0, 1), (0, 1), (0, 2), (0, 2), (1, 2), (1, 2)]
        uvs = [
            tuple((corners[i][list(pair)] + h[list(pair)]) * uv_scale)
            for face, pair in zip(faces, axes, strict=True)
            for i in face
        ]
        return self.add(corners + c, faces, uvs, slot, False, group)

    def quad(self, corners, slot=0, uvs=((0, 0), (1, 0), (1, 1), (0, 1))):
        """Four corners, counter-clockwise seen from the front."""
        return self.add(corners, [(0, 1, 2, 3)], uvs, slot)

    def sheet(self, points, slot=0, smooth=True, group="", uv_size=(1.0, 1.0)):
        """points: (rows, columns, 3); u runs along columns to uv_size[0], v along rows to uv_size[1]."""
        points = np.asarray(points, float)
        rows, columns = points.shape[:2]
        faces, uvs = [], []
        for r in range(rows - 1):
            for c in range(columns - 1):
                faces.append((r * columns + c, r * columns + c + 1, (r + 1) * columns + c + 1, (r + 1) * columns + c))
                for i, j in ((c, r), (c + 1, r), (c + 1, r + 1), (c, r + 1)):
                    uvs.append((i / (columns - 1) * uv_size[0], j / (rows - 1) * uv_size[1]))
        return self.add(points.reshape(-1, 3), faces, uvs, slot, smooth, group)

    def lathe(self, profile, segments=16, center=(0, 0, 0), slot=0, group="", squash=(1.0, 1.0), ribs=0.0):
        """profile: (radius, height) pairs from the bottom up, turned about Z. ribs: every other meridian drawn in."""
        angles = np.linspace(0, 2 * math.pi, segments + 1)
        rib = 1.0 - ribs * (np.arange(segments + 1) % 2)
        profile = np.asarray(profile, float)
        points = np.empty((len(profile), segments + 1, 3))
        points[..., 0] = profile[:, :1] * np.cos(angles) * rib * squash[0] + center[0]
        points[..., 1] = profile[:, :1] * np.sin(angles) * rib * squash[1] + center[1]
        points[..., 2] = profile[:, 1:] + center[2]
        return self.sheet(points, slot, ribs == 0.0, group)

    def tube(self, path, radius, sides=8, slot=0, group="", closed=False):
        """A pipe along path (N, 3); radius one number or N numbers."""
        path = np.asarray(path, float)
        if closed:
            path = np.vstack([path, path[:1]])
        radii = np.broadcast_to(np.asarray(radius, float), len(path))
        tangents = np.gradient(path, axis=0)
        if closed:
            tangents[0] = tangents[-1] = path[1] - path[-2]
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True) + 1e-12
        up = np.where(np.abs(tangents[:, 2:]) > 0.9, [[1.0, 0, 0]], [[0, 0, 1.0]])
        side = np.cross(tangents, up)
        side /= np.linalg.norm(side, axis=1, keepdims=True) + 1e-12
        for i in range(1, len(side)):  # a pipe that turns through vertical must not flip its frame
            if side[i] @ side[i - 1] < 0:
                side[i] = -side[i]
        top = np.cross(side, tangents)
        angles = np.linspace(0, 2 * math.pi, sides + 1)[None, :, None]
        ring = np.cos(angles) * side[:, None] + np.sin(angles) * top[:, None]
        return self.sheet(path[:, None] + ring * radii[:, None, None], slot, True, group)

    def mesh(self, name, materials):
        """A new bpy mesh with these material datablocks in its slots."""
        mesh = bpy.data.meshes.new(name)
        mesh.from_pydata(self.vertices, [], self.faces)
        layer = mesh.uv_layers.new(name="UVMap")
        layer.uv.foreach_set("vector", np.asarray(self.uvs, np.float32).ravel())
        mesh.polygons.foreach_set("material_index", np.asarray(self.slots, np.int32))
        mesh.polygons.foreach_set("use_smooth", np.asarray(self.smooth, bool))
        for material in materials:
            mesh.materials.append(material)
        mesh.update()
        return mesh


def place(name, data, collection, location=(0, 0, 0), rotation=(0, 0, 0), scale=1.0):
    """A new object holding data, linked to collection. rotation: XYZ Euler angles in radians."""
    thing = bpy.data.objects.new(name, data)
    thing.location = location
    thing.rotation_euler = rotation
    thing.scale = (scale,) * 3 if np.isscalar(scale) else scale
    collection.objects.link(thing)
    return thing


def new_collection(name, parent=None):
    """A new collection; without a parent it is in no scene: a source of instances."""
    collection = bpy.data.collections.new(name)
    if parent is not None:
        parent.children.link(collection)
    return collection


def catenary(start, end, sag, count):
    """(count, 3) points of a hanging cord; sag: how far below the straight line its middle hangs."""
    t = np.linspace(0, 1, count)[:, None]
    points = (1 - t) * np.asarray(start, float) + t * np.asarray(end, float)
    points[:, 2] -= sag * 4 * (t * (1 - t))[:, 0]
    return points


def scatter(name, points, sources, collection, seed, scale=(0.9, 1.1), upright=False):
    """Instances of the objects of the collection `sources` on points (N, 3), turned at random, by geometry nodes."""
    rng = np.random.default_rng(seed)
    count = len(points)
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(np.asarray(points, float).tolist(), [], [])
    turn = rng.uniform(-math.pi, math.pi, (count, 3)).astype(np.float32)
    if upright:
        turn[:, :2] = rng.uniform(-0.06, 0.06, (count, 2))
    attributes = (
        ("turn", "FLOAT_VECTOR", "vector", turn),
        ("size", "FLOAT", "value", rng.uniform(*scale, count).astype(np.float32)),
        ("which", "INT", "value", rng.integers(0, max(len(sources.objects), 1), count).astype(np.int32)),
    )
    for label, kind, field, values in attributes:
        mesh.attributes.new(label, kind, "POINT").data.foreach_set(field, values.ravel())
    thing = place(name, mesh, collection)
    thing.modifiers.new("Scatter", "NODES").node_group = _scatter_group(sources)
    return thing


def _scatter_group(sources):
    name = f"Scatter {sources.name}"
    if name in bpy.data.node_groups:
        return bpy.data.node_groups[name]
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, links = tree.nodes, tree.links
    entry, leave = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    info = nodes.new("GeometryNodeCollectionInfo")
    info.inputs["Collection"].default_value = sources
    info.inputs["Separate Children"].default_value = True
    info.inputs["Reset Children"].default_value = True
    spread = nodes.new("GeometryNodeInstanceOnPoints")
    spread.inputs["Pick Instance"].default_value = True
    links.new(entry.outputs[0], spread.inputs["Points"])
    links.new(info.outputs[0], spread.inputs["Instance"])
    for label, kind, socket in (
        ("turn", "FLOAT_VECTOR", "Rotation"),
        ("size", "FLOAT", "Scale"),
        ("which", "INT", "Instance Index"),
    ):
        read = nodes.new("GeometryNodeInputNamedAttribute")
        read.data_type = kind
        read.inputs["Name"].default_value = label
        links.new(next(s for s in read.outputs if s.enabled), spread.inputs[socket])
    links.new(spread.outputs[0], leave.inputs[0])
    return tree
