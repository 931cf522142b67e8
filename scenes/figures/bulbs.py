# SPDX-License-Identifier: Apache-2.0
"""Small lights that all figure scenes share: glowing spheres and strings of them. Emissive meshes, instanced."""

import bpy
import numpy as np
import surfaces
from shapes import Shape, catenary, place

WARM = ((1.0, 0.62, 0.30), (1.0, 0.72, 0.42), (1.0, 0.54, 0.22))
FESTIVE = (*WARM, (1.0, 0.25, 0.12), (0.25, 0.65, 1.0), (0.35, 1.0, 0.45), (1.0, 0.35, 0.75))


def sphere(name, radius, material, subdivisions=1):
    """A smooth icosphere mesh: 20 triangles, or 80 with two subdivisions."""
    bpy.ops.mesh.primitive_ico_sphere_add(radius=radius, subdivisions=subdivisions)
    made = bpy.context.object
    mesh = made.data
    bpy.data.objects.remove(made)
    mesh.name = name
    mesh.shade_smooth()
    mesh.materials.append(material)
    return mesh


def glows(prefix, colours, radius, strength):
    """One glowing sphere mesh a colour; strength: radiance in W·sr⁻¹·m⁻² of a white one."""
    return [
        sphere(f"{prefix} {i}", radius, surfaces.glow(f"{prefix} {i}", strength, colour))
        for i, colour in enumerate(colours)
    ]


def strings(name, spans, count, meshes, collection, rng, cord, sag=0.35):
    """`count` bulbs spread over hanging cords between the point pairs `spans`, in proportion to their lengths.

    Returns how many were made: `count`, none when it is not positive.
    """
    if count <= 0:
        return 0
    lengths = np.array([np.linalg.norm(np.subtract(a, b)) for a, b in spans])
    ends = np.round(np.cumsum(lengths) / lengths.sum() * count).astype(int)
    shares = np.diff(np.concatenate([[0], ends]))
    shape = Shape()
    for (a, b), share in zip(spans, shares, strict=True):
        shape.tube(catenary(a, b, sag, 14), 0.006, 4)
        for point in catenary(a, b, sag, share + 2)[1:-1]:
            place(name, meshes[int(rng.integers(len(meshes)))], collection, point - [0, 0, 0.045])
    place(f"{name} cords", shape.mesh(f"{name} cords", [cord]), collection)
    return int(count)
