# SPDX-License-Identifier: Apache-2.0
"""Copies of a few things at many places: objects of their own, or, where there are too many for Blender's lists,
instances on the vertices of meshes. A million lamps as objects take minutes and gigabytes; as instances, a second."""

import bpy
import numpy as np
from mathutils import Matrix

OBJECTS = 10_000  # most copies made as objects of their own


def spread(scene, name: str, things: list, which, places, parent=None, count: int = 0) -> None:
    """Puts thing `which[i]` at `places[i]`.

    things: each a list of parts (object data, 4 x 4 matrix in the thing's space); copies share the data. which: (N,)
    indices into things. places: (N, 3) metres, in the space of `parent`, an object that is neither turned nor scaled.
    count: of all copies that the scene has, where these are but a part of them.
    """
    which, places = np.asarray(which), np.asarray(places, np.float32)
    if max(len(places), count) <= OBJECTS:
        for thing, place in zip(which, places, strict=True):
            for data, matrix in things[thing]:
                made = bpy.data.objects.new(name, data)
                made.parent = parent
                made.matrix_basis = Matrix.Translation(place.tolist()) @ matrix
                scene.collection.objects.link(made)
        return
    for number, parts in enumerate(things):
        here = places[which == number]
        if not len(here):
            continue
        mesh = bpy.data.meshes.new(f"{name} places")
        mesh.vertices.add(len(here))
        mesh.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(here).ravel())
        holder = bpy.data.objects.new(f"{name} places", mesh)
        holder.parent = parent
        holder.instance_type = "VERTS"
        holder.show_instancer_for_render = holder.show_instancer_for_viewport = False
        scene.collection.objects.link(holder)
        for data, matrix in parts:
            made = bpy.data.objects.new(name, data)
            made.parent = holder
            made.matrix_basis = matrix
            scene.collection.objects.link(made)


def boxes(name: str, low, high, material):
    """A mesh of axis-aligned boxes between the corners `low` and `high`, (N, 3) each, metres."""
    low, high = np.asarray(low, np.float32), np.asarray(high, np.float32)
    corner = np.arange(8)
    bits = np.stack([corner & 1, corner >> 1 & 1, corner >> 2], 1)
    vertices = np.where(bits[None], high[:, None], low[:, None])
    quads = np.array([(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
    faces = quads[None] + 8 * np.arange(len(low))[:, None, None]
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(8 * len(low))
    mesh.attributes["position"].data.foreach_set("vector", vertices.astype(np.float32).ravel())
    mesh.loops.add(24 * len(low))
    mesh.loops.foreach_set("vertex_index", faces.astype(np.int32).ravel())
    mesh.polygons.add(6 * len(low))
    mesh.polygons.foreach_set("loop_start", np.arange(0, 24 * len(low), 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.materials.append(material)
    return mesh


def taken(made):
    """The data of an object that an operator made; the object itself is removed."""
    data = made.data
    bpy.data.objects.remove(made)
    return data
