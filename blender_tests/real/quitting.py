# SPDX-License-Identifier: Apache-2.0
"""Brings a Blender with a window into a state of work and quits it there: quit.py looks at how that ends.

After `--`: the folder for what is left, and the name of one of STATES.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
import driver

SIDE = 1200  # quads along a side of the mesh whose build takes a while


def add_large_mesh() -> None:
    x, y = np.meshgrid(np.linspace(-4, 4, SIDE + 1, dtype=np.float32), np.linspace(-4, 4, SIDE + 1, dtype=np.float32))
    points = np.stack([x, y, 0.2 * np.sin(3 * x) * np.cos(5 * y) - 1.5], -1)
    corner = np.arange(SIDE * (SIDE + 1)).reshape(SIDE, SIDE + 1)[:, :-1]
    quads = np.stack([corner, corner + 1, corner + SIDE + 2, corner + SIDE + 1], -1).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Large")
    mesh.vertices.add(points.size // 3)
    mesh.vertices.foreach_set("co", points.reshape(-1))
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.reshape(-1).astype(np.int32))
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    mesh.update()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("Large", mesh))


def viewport(session):
    """A viewport renders, and has shown a picture."""
    session.space.shading.type = "RENDERED"
    yield from session.until(lambda: session.picture() is not None, 60, "the first picture")


def viewport_build(session):
    """A viewport's worker builds, or compiles the first kernels."""

    def at_work(*stages):
        return any(view.status.startswith(stages) for view in session.views)

    for _ in range(5):  # a build may be over between two ticks: then another is begun
        add_large_mesh()
        yield 0.2
        session.space.shading.type = "RENDERED"
        yield from session.until(lambda: at_work("Loading", "Building", "Sample"), 60, "a viewport at work")
        if at_work("Loading", "Building"):
            return
        session.space.shading.type = "SOLID"
        yield from session.until(lambda: not session.views, 20, "the end of that viewport")
    raise AssertionError("no viewport was seen to build")


def two_viewports(session):
    """Two viewports take turns, one of a mesh that takes a while to build."""
    with session.context():
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    yield 0.5
    for area in session.window.screen.areas:
        if area.type == "VIEW_3D":
            area.spaces.active.shading.type = "RENDERED"
    yield from session.until(lambda: len([v for v in session.views if v.picture]) == 2, 60, "two pictures")
    add_large_mesh()
    yield 0.05


def _start_render(session, seen, **settings):
    driver.submodule("final").observers.append(lambda event, data: seen.append((event, data.get("sample"))) and None)
    session.scene.headwater.samples = 100000
    with session.context():
        assert bpy.ops.render.render("INVOKE_DEFAULT", **settings) == {"RUNNING_MODAL"}


def final(session):
    """F12 renders."""
    seen = []
    _start_render(session, seen)
    yield from session.until(lambda: any(sample for _, sample in seen), 60, "a first sample")


def final_build(session):
    """F12 reads Blender's data, and the core builds beside it."""
    add_large_mesh()
    yield 0.2
    begun = []
    builder = driver.submodule("sync.build")._Builder
    run = builder._run
    builder._run = lambda self: begun.append(self) or run(self)
    _start_render(session, [])
    yield from session.until(lambda: begun, 60, "a build")


def final_beside_viewport(session):
    """F12 renders while a viewport waits for it."""
    yield from viewport(session)
    yield from final(session)


def animation(session):
    """An animation renders."""
    session.scene.render.filepath = str(session.folder / "frame_")
    seen = []
    _start_render(session, seen, animation=True)
    yield from session.until(lambda: any(sample for _, sample in seen), 60, "a first sample")


STATES = (viewport, viewport_build, two_viewports, final, final_build, final_beside_viewport, animation)


def steps(session):
    driver.addon()
    scene = session.scene
    scene.render.engine = "HEADWATER"
    scene.headwater.use_cycles_settings = False
    scene.headwater.preview_samples = 0  # without end
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 320, 240, 100
    yield from next(state for state in STATES if state.__name__ == driver.arguments()[1])(session)
    print("quits now", flush=True)


if __name__ == "__main__":
    driver.Session(steps)
