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
import waves

MOVES = 8


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
    waves.build()
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
