# SPDX-License-Identifier: Apache-2.0
"""What the add-on's syncs cost in bpy, in CPU seconds.

    python blender_tests/measure_sync.py FILE.blend [MOVED_OBJECT]

FILE.blend, or "waves": 4 million triangles in 3,600 objects. First what Blender itself takes to list its instances,
then a first sync, the build of the core, a second sync that compares everything, and the median sync of one moved
object.
"""

import importlib
import os
import sys
import time
from pathlib import Path

import bpy
import numpy as np

import headwater._core as core
import headwater.blender

MOVES = 10


def cpu(name: str, work):
    begun = time.process_time()
    result = work()
    print(f"{name:42} {1e3 * (time.process_time() - begun):10.1f} ms CPU", flush=True)
    return result


def main() -> None:
    headwater.blender.register()
    state = importlib.import_module(headwater.blender.MODULE + ".sync.state")
    if sys.argv[1] == "waves":
        sys.path.insert(0, str(Path(__file__).parent / "real"))
        import waves

        bpy.ops.wm.read_factory_settings(use_empty=True)
        waves.build()
    else:
        bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
    graph = bpy.context.evaluated_depsgraph_get()
    for shown in graph.object_instances:  # as a viewport in Solid has drawn them
        if shown.object.type == "MESH" and len(shown.object.data.loop_triangles):
            shown.object.data.corner_normals[0]
    count = cpu("Blender: count instances", lambda: len(graph.object_instances))
    cpu("Blender: an empty loop over them", lambda: [None for _ in graph.object_instances] and None)
    matrices = np.empty(16 * count, np.float32)
    cpu("Blender: their matrices", lambda: graph.object_instances.foreach_get("matrix_world", matrices))
    sync = state.SceneSync(core)
    report = cpu("first sync", lambda: sync.sync(graph, False))
    print({name: report[name] for name in ("objects", "instances", "lights", "meshes_uploaded")}, report["parts"])
    session = core.Session(core.Context(), sync.scene)
    cpu("upload, build, lights", session.sync)
    cpu("second sync, comparing everything", lambda: sync.sync(graph, False))
    seconds = []

    def moved(_scene, graph):
        begun = time.thread_time()
        sync.sync(graph, True)
        seconds.append(time.thread_time() - begun)

    objects = bpy.context.scene.objects
    named = sys.argv[2:] and objects[sys.argv[2]]
    movable = named or next(o for o in objects if o.type == "MESH" and o.visible_get() and o.parent is None)
    bpy.app.handlers.depsgraph_update_post.append(moved)
    for _ in range(MOVES):
        movable.location.x += 0.05
        bpy.context.view_layer.update()
    print(f"one moved object ({movable.name}), median {1e3 * float(np.median(seconds)):19.1f} ms CPU", flush=True)
    os._exit(0)  # some versions of bpy hang or crash at exit


main()
