# SPDX-License-Identifier: Apache-2.0
"""Measures the sheen of Blender's Cycles: writes core/materials/sheen_table.inc.

Sheen is a linearly transformed cosine (Zeltner, Burley and Chiang 2022) whose coefficients a and b and albedo depend on
roughness and viewing cosine; Cycles blends them between 32 x 32 points. Quads face the camera and take each point's
normal and roughness as attributes. The albedo is the diffuse colour pass. A sun in direction w, of coordinates x, y, z
about the normal with x towards the viewer, gives f|cos| = albedo / pi · z (a / ((a x + b z)^2 + (a y)^2 + z^2))^2. With
k = sqrt(z / (pi · f|cos| / albedo)) every sun says (a x + b z)^2 + (a y)^2 + z^2 = k a: least squares over the suns.

    python blender_tests/measure_sheen.py core/materials/sheen_table.inc
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from closure_reference import link_attribute, make_scene, node, point_sun, render

POINTS = 32
MIN_ROUGHNESS = 1e-3  # what Cycles raises roughness 0 to


def sun_directions() -> np.ndarray:
    """Twenty directions over the upper hemisphere, none at grazing angles."""
    i = np.arange(20)
    z = 0.15 + 0.83 * (i + 0.5) / 20
    phi = i * 2.399963
    r = np.sqrt(1 - z * z)
    return np.stack((r * np.cos(phi), r * np.sin(phi), z), -1)


def measure() -> np.ndarray:
    """(3, roughness, cosine): a, b, albedo at the points of Cycles' table."""
    cosine, roughness = np.meshgrid(np.linspace(0, 1, POINTS), np.linspace(0, 1, POINTS))
    sine = np.sqrt(1 - cosine**2)
    normal = np.stack((sine, np.zeros_like(sine), cosine), -1)
    facing = np.broadcast_to((0.0, 0.0, 1.0), normal.shape)
    sheen = node("ShaderNodeBsdfSheen", "MICROFIBER") | {"bump": True}
    scene = make_scene(facing, {"bumped": normal, "rough": roughness}, {"sheen": sheen})
    import bpy

    material = bpy.data.materials["sheen"]
    bsdf = next(n for n in material.node_tree.nodes if n.type == "BSDF_SHEEN")
    bsdf.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    link_attribute(material.node_tree, "rough", "Fac", bsdf.inputs["Roughness"])
    material.cycles.use_bump_map_correction = False  # nor softened terminators
    rows = []  # x, y, z, k of each sun
    for direction in sun_directions():
        point_sun(tuple(direction))
        passes = render(scene)
        albedo = passes["diffuse_color"][..., 0]
        x = -cosine * direction[0] + sine * direction[2]
        y = np.full_like(x, direction[1])
        # Facing the viewer the frame is arbitrary; Cycles then turns it by 45 degrees.
        x[:, -1] = (direction[0] - direction[1]) * np.sqrt(0.5)
        y[:, -1] = (direction[0] + direction[1]) * np.sqrt(0.5)
        z = normal @ direction
        with np.errstate(divide="ignore", invalid="ignore"):
            k = np.sqrt(z / (np.pi * passes["combined"][..., 0] / albedo))
        rows.append((x, y, z, k))
    x, y, z, k = np.moveaxis(np.array(rows), 1, 0)
    used = np.isfinite(k) & (z > 0.1)

    # Divided by a: a (x^2 + y^2) + 2 b x z + ((b^2 + 1) / a) z^2 = k, linear in three unknowns; then Gauss-Newton.
    table = np.zeros((3, POINTS, POINTS))
    table[2] = albedo
    for row, column in np.ndindex(POINTS, POINTS):
        u = used[:, row, column]
        if u.sum() < 4:
            # No sheen there: anything will do, best what blends well.
            table[:2, row, column] = table[:2, row, column - 1]
            continue
        px, py, pz, pk = (v[u, row, column] for v in (x, y, z, k))
        terms = np.stack((px**2 + py**2, 2 * px * pz, pz**2), -1) / pk[:, None]
        a, b = np.linalg.lstsq(terms, np.ones(len(pk)), rcond=None)[0][:2]
        for _ in range(20):
            residual = terms @ (a, b, (b * b + 1) / a) - 1
            slope = np.stack(
                (terms[:, 0] - (b * b + 1) / a**2 * terms[:, 2], terms[:, 1] + 2 * b / a * terms[:, 2]), -1
            )
            a, b = (a, b) - np.linalg.lstsq(slope, residual, rcond=None)[0]
        if np.abs(residual).max() > 1e-4:
            raise RuntimeError(f"no such lobe at roughness {row}/31, cosine {column}/31: {np.abs(residual).max()} off")
        table[:2, row, column] = a, b
    # Row 0 was seen at MIN_ROUGHNESS, between rows 0 and 1.
    t = MIN_ROUGHNESS * (POINTS - 1)
    seen = table[2, 0] >= 1e-5
    table[:, 0] = np.where(seen, (table[:, 0] - t * table[:, 1]) / (1 - t), table[:, 1])
    table[2, 0, ~seen] = 0.0
    return table


if __name__ == "__main__":
    # Five decimals are all there is: the values come out within 1e-6 of such numbers.
    values = measure().reshape(-1, POINTS)
    head = ["// SPDX-License-Identifier: Apache-2.0", "// Written by blender_tests/measure_sheen.py; not to be edited."]
    lines = [",".join(f"{v + 0.0:.5f}f" for v in row.round(5)) + "," for row in values]
    Path(sys.argv[1]).write_text("\n".join(head + lines) + "\n")
