# SPDX-License-Identifier: Apache-2.0
"""A scene of 4 million triangles in 3,600 objects: what the main thread pays for its sync, and for one moved object.

Beside Cycles in the same Blender: the time that each engine's view_update takes when the viewport turns to Rendered.
"""

import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import driver

MESHES, EACH, SIDE = 36, 100, 236  # 2 * SIDE^2 triangles a mesh
MOVES = 8


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


def timed(cls, name: str, seconds: list):
    """Notes what a method of an engine's class takes; returns the way back."""
    before = getattr(cls, name)

    def method(self, context, depsgraph):  # Blender looks at the names
        begun = time.perf_counter()
        try:
            return before(self, context, depsgraph)
        finally:
            seconds.append(time.perf_counter() - begun)

    setattr(cls, name, method)
    return lambda: setattr(cls, name, before)


def engine_class(identifier: str):
    return next(c for c in bpy.types.RenderEngine.__subclasses__() if getattr(c, "bl_idname", "") == identifier)


def measure(session, engine: str):
    scene, space = session.scene, session.space
    update, draw = [], []
    undo = [timed(engine_class(engine), "view_update", update), timed(engine_class(engine), "view_draw", draw)]
    space.shading.type = "SOLID"
    scene.render.engine = engine
    yield 1.0
    space.shading.type = "RENDERED"
    yield from session.until(lambda: len(draw) >= 2, 120, f"{engine} draws")
    yield 8.0
    first = sum(update) + draw[0]
    update.clear()
    moved, seconds = bpy.data.objects["Wave 3.7"], []
    for _ in range(MOVES):
        moved.location.z += 0.1
        count = len(update)
        yield from session.until(lambda count=count: len(update) > count, 20, f"{engine} updates")
        seconds.append(update[-1])
        yield 0.5
    for back in undo:
        back()
    session.facts.setdefault(engine, []).append(
        {"first_sync_seconds": first, "move_ms_p95": 1e3 * float(np.percentile(seconds, 95))}
    )


def steps(session):
    driver.addon()
    build()
    yield 2.0
    session.scene.headwater.use_cycles_settings = False
    for _ in range(2):
        for engine in ("CYCLES", "HEADWATER"):
            yield from measure(session, engine)
    session.facts["core_sync"] = session.views[0].core_sync
    yield from session.settled(1, 60)
    session.shot("01_big")
    first = lambda engine: min(each["first_sync_seconds"] for each in session.facts[engine])  # noqa: E731
    session.facts["sync_ratio"] = first("HEADWATER") / first("CYCLES")


driver.Session(steps)
