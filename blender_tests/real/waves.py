# SPDX-License-Identifier: Apache-2.0
"""A scene of 4 million triangles in 3,600 objects, to measure syncs: 36 meshes of 111,000 triangles.

    python blender_tests/real/waves.py waves.blend

writes it with a camera and a sun, for `headwater bench-speed`.
"""

import sys

import bpy
import numpy as np

MESHES, EACH, SIDE = 36, 100, 236  # 2 * SIDE^2 triangles a mesh


def build() -> None:
    x, y = np.meshgrid(np.linspace(-1, 1, SIDE + 1), np.linspace(-1, 1, SIDE + 1), indexing="ij")
    quads = np.arange(SIDE)[:, None] * (SIDE + 1) + np.arange(SIDE)[None, :]
    corners = np.stack([quads, quads + SIDE + 1, quads + SIDE + 2, quads + 1], -1).reshape(-1).astype(np.int32)
    for number in range(MESHES):
        mesh = bpy.data.meshes.new(f"Waves {number}")
        z = 0.1 * np.sin((3 + number % 5) * x) * np.cos((2 + number % 7) * y)
        mesh.vertices.add((SIDE + 1) ** 2)
        mesh.vertices.foreach_set("co", np.stack([x, y, z], -1).astype(np.float32).reshape(-1))
        mesh.loops.add(len(corners))
        mesh.loops.foreach_set("vertex_index", corners)
        mesh.polygons.add(SIDE * SIDE)
        mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 4, dtype=np.int32))
        mesh.update(calc_edges=True)
        for each in range(EACH):
            thing = bpy.data.objects.new(f"Wave {number}.{each}", mesh)
            thing.location = (2.2 * (each % 60), 2.2 * (number + MESHES * (each // 60)), 0)
            bpy.context.scene.collection.objects.link(thing)


def _write(path: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    build()
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    for thing in (camera, sun):
        scene.collection.objects.link(thing)
    scene.camera, camera.location, camera.data.clip_end = camera, (60, 70, 160), 1000
    bpy.ops.wm.save_as_mainfile(filepath=path)


if __name__ == "__main__":
    _write(sys.argv[1])
