# SPDX-License-Identifier: Apache-2.0
"""What goes wrong in an artist's hands leaves Blender alive and says why; ten rounds of work leave no memory behind."""

import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
import driver

ROUNDS = 10
GROWTH = 1.1  # memory after the last round over that after the second


class _Region:
    def __init__(self, width: int, height: int):
        self.width, self.height = width, height


class _Context:
    """A drawing context that says the viewport has another size."""

    def __init__(self, context, size):
        self._context, self.region = context, _Region(*size)

    def __getattr__(self, name):
        return getattr(self._context, name)


def sizes(session):
    """A viewport of one pixel, and of 8K."""
    view_class = driver.submodule("viewport.view").View
    draw = view_class.draw
    try:
        for size in ((1, 1), (7680, 4320)):
            view_class.draw = lambda self, engine, context, depsgraph, size=size: draw(
                self, engine, _Context(context, size), depsgraph
            )

            def drawn(size=size) -> bool:
                session.area.tag_redraw()
                picture = session.picture()
                return picture is not None and (picture.request.width, picture.request.height) == size

            yield from session.until(drawn, 60, f"a picture of {size}")
            session.facts[f"divider_{size[0]}"] = session.picture().divider
    finally:
        view_class.draw = draw
    yield from session.settled(1)


def lost_device(session):
    """The device stops working in a viewport: the viewport says so and comes back with the next edit."""
    worker = driver.submodule("viewport.worker").Worker
    render, core = worker._render, driver.submodule("native").core()

    def lose(self, request, slice_):
        raise core.DeviceLost("the device stopped working (a test says so)")

    worker._render = lose
    bpy.data.objects["Cube"].location.x += 0.1
    yield from session.until(lambda: any("stopped working" in view.status for view in session.views), 20, "the message")
    yield 0.3
    session.shot("10_device_lost")
    worker._render = render
    bpy.data.objects["Cube"].location.x += 0.1
    yield from session.settled(2)


def start_render(session, samples: int = 100000):
    session.scene.headwater.samples = samples
    with session.context():
        bpy.ops.render.render("INVOKE_DEFAULT")


def render_runs() -> bool:
    return bpy.app.is_job_running("RENDER")


def during_render(session, name: str, act):
    """Starts F12, does something to it, cancels it; Blender is alive and renders again."""
    final = driver.submodule("final")
    cancel = []
    observer = lambda event, data: bool(cancel)  # noqa: E731
    final.observers.append(observer)
    start_render(session)
    yield from session.until(render_runs, 10, f"{name}: a running render")
    yield 0.5
    act()
    yield 0.5
    session.shot(f"20_{name}")
    cancel.append(True)
    yield from session.until(lambda: not render_runs(), 20, f"{name}: the render's end")
    if observer in final.observers:
        final.observers.remove(observer)
    session.facts.setdefault("last_errors", {})[name] = final.last_error
    yield from session.until(lambda: session.window is not None, 5, "a window")


def set_up(session):
    scene = session.scene
    scene.render.engine = "HEADWATER"
    scene.headwater.use_cycles_settings = False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 64, 100
    scene.headwater.samples = 2
    session.space.shading.type = "RENDERED"


def steps(session):
    driver.addon()
    set_up(session)
    yield from session.settled(2)
    saved = str(session.folder / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=saved)
    yield from sizes(session)
    yield from lost_device(session)

    def delete_camera():
        bpy.data.objects.remove(bpy.data.objects["Camera"])

    def undo():
        with session.context():
            bpy.ops.ed.undo_push(message="one")
            bpy.data.objects["Cube"].location.z += 1
            bpy.ops.ed.undo_push(message="two")
            bpy.ops.ed.undo()

    def load():
        bpy.ops.wm.open_mainfile(filepath=saved)

    yield from during_render(session, "undo", undo)
    yield from during_render(session, "camera_deleted", delete_camera)
    try:
        start_render(session, 2)
        raise AssertionError("a render without a camera began")
    except RuntimeError as error:  # Blender's own message
        session.facts["no_camera"] = str(error)
    load()
    yield 0.5
    set_up(session)
    yield from during_render(session, "load", load)
    set_up(session)
    yield from session.settled(2)
    session.shot("30_after_trouble")

    memory = []
    for _ in range(ROUNDS):
        bpy.ops.wm.open_mainfile(filepath=saved)
        yield 0.3
        set_up(session)
        yield from session.settled(2)
        with session.context():
            bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128)
        yield from session.settled(2)
        with session.context():
            bpy.ops.object.delete()
        yield from session.settled(2)
        start_render(session, 2)
        yield from session.until(lambda: not render_runs(), 20, "F12")
        yield 0.3
        session.space.shading.type = "SOLID"
        yield 0.2
        memory.append(driver.resident_bytes())
    session.facts["memory_mib"] = [size >> 20 for size in memory]
    assert memory[-1] <= GROWTH * memory[1], f"memory grows: {session.facts['memory_mib']} MiB"


driver.Session(steps)
