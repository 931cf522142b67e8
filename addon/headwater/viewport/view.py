# SPDX-License-Identifier: GPL-3.0-or-later
"""One 3D viewport in Rendered shading, on Blender's main thread: what changed goes to the core, pictures to the screen.

Nothing here waits for rendering. When the worker holds the scene (it is building), the changes stay noted and are
synced at the next draw.
"""

import atexit
import time
import traceback
import weakref

import bpy
from bpy.app.handlers import persistent

from headwater import temporal

from .. import denoising, handlers, log, native, options, preferences, render_settings, reuse_properties
from ..sync.camera import lens_settings, panorama_settings, rigid
from ..sync.problems import SyncError
from ..sync.state import SceneSync
from ..sync.updates import Updates
from . import camera as view_camera
from .draw import Drawer
from .shading import shown_pass
from .worker import Picture, Request, Worker, close_workers

SCENE_WAIT = 0.005  # seconds that a sync waits for the worker to let go of the scene
RESIZE_REST = 0.2  # seconds a viewport keeps its size before it is rendered at that size
CLOSE_SECONDS = 10.0

_views: weakref.WeakSet = weakref.WeakSet()


class View:
    """What one RenderEngine instance of a viewport holds."""

    def __init__(self, engine):
        self._sync = SceneSync(native.core())
        self._worker = Worker(self._sync.scene, engine)
        self._drawer = Drawer()
        self._edition = 0
        self._waiting: Updates | None = Updates(None, False)  # changes that are not synced yet; at first everything
        self._compare = False  # what changed is not known: compare everything
        self._shown_objects = None
        self._size, self._size_since = (0, 0), 0.0
        self._request: Request | None = None
        self._problem = ""
        self.closed = False
        self.sync_seconds = 0.0
        self.draw_seconds = 0.0
        self.draws = 0
        self.synced_at = 0.0  # time.perf_counter() of the last sync's end
        _views.add(self)
        weakref.finalize(self, self._worker.close).atexit = False  # before Blender 4.4 views are freed without a word
        # Blender quits without a word to add-ons. Before the core's own end, which comes first where it came last.
        atexit.unregister(close_all)
        atexit.register(close_all)

    def close(self) -> None:
        self.closed = True
        self._worker.close()

    def compare_everything(self) -> None:
        """After undo and the like: Blender's data may be another's."""
        self._compare = True

    def update(self, context, depsgraph) -> None:
        """Blender says that something changed."""
        updates = Updates(depsgraph, not self._compare)
        self._waiting = updates if self._waiting is None else self._waiting.joined(updates)
        self._compare = False
        self._worker.void()
        self._sync_now(context, depsgraph)

    def draw(self, engine, context, depsgraph) -> None:
        begun = time.perf_counter()
        self._worker.seen()
        objects = _hidden_here(context.space_data)
        if self._shown_objects is None:
            self._shown_objects = objects
        if objects != self._shown_objects and self._waiting is None:
            self._waiting = Updates.nothing()
        if self._waiting is not None:
            self._sync_now(context, depsgraph)
        self._ask(engine, context, depsgraph)
        picture = self._worker.picture
        region = context.region
        if picture is not None:
            self._drawer.draw(engine, depsgraph.scene_eval, picture, region.width, region.height)
        engine.update_stats("Headwater", self.status)
        self.draw_seconds = time.perf_counter() - begun
        self.draws += 1

    def _sync_now(self, context, depsgraph) -> None:
        lock = self._worker.scene_lock
        if not lock.acquire(timeout=SCENE_WAIT):
            return  # at the next draw
        begun = time.perf_counter()
        try:
            updates, self._waiting = self._waiting, None
            self._shown_objects = _hidden_here(context.space_data)
            space = context.space_data if self._shown_objects else None
            self._sync.sync(depsgraph, True, updates=updates, space=space)
            self._problem = ""
        except Exception as error:
            self._compare = True
            if not isinstance(error, (SyncError, *native.expected_errors())):
                traceback.print_exc()
            self._problem = str(error) or type(error).__name__
            log.error(self._problem, error)
        finally:
            lock.release()
        self._edition += 1
        self.synced_at = time.perf_counter()
        self.sync_seconds = self.synced_at - begun
        for note in self._sync.notes.take():
            log.note(note)

    def _ask(self, engine, context, depsgraph) -> None:
        """Asks the worker for the picture of this moment."""
        region, space = context.region, context.space_data
        # The originals: settings of ours that a script writes do not reach the evaluated copies by themselves.
        scene, view_layer = depsgraph.scene, depsgraph.view_layer
        self._worker.pause(bool(scene.headwater.preview_pause))
        size, now = (region.width, region.height), time.perf_counter()
        if size != self._size:
            first = self._size == (0, 0)
            self._size, self._size_since = size, 0.0 if first else now
        if now - self._size_since < RESIZE_REST:
            _draw_later(engine)
            return
        if self._waiting is not None or self._problem:
            return
        try:
            request = self._describe(context, space, scene, view_layer, depsgraph, size)
        except ValueError as error:
            self._problem = str(error)
            log.error(self._problem, error)
            return
        if request != self._request:
            self._request = request
            self._worker.ask(request)

    def _describe(self, context, space, scene, view_layer, depsgraph, size) -> Request:
        rv3d = context.region_data
        through = rv3d.view_perspective == "CAMERA"
        camera_object = (space.camera if space.use_local_camera else scene.camera) if through else None
        if camera_object is not None and camera_object.type == "CAMERA":
            camera_object = camera_object.evaluated_get(depsgraph)
        camera = _camera(space, rv3d, scene, camera_object, size)
        frame = render_settings.Frame(size[0], size[1], 0, 0, *size)
        channel = shown_pass(space)
        given = options.current()
        recipe, denoise_from = (denoising.viewport_recipe(scene) if channel == "Combined" else None) or (None, 0)
        carried = channel == "Combined" and scene.headwater.use_preview_history
        passes = [channel, *(recipe.guides if recipe else ()), *(temporal.GUIDES if carried else ())]
        passes = list(dict.fromkeys(passes))
        settings = render_settings.build(scene, view_layer, frame, passes, given)
        for name in ("width", "height", "region", "samples", "first_sample"):
            settings.pop(name, None)
        source = render_settings.cycles_of(scene) or scene.headwater
        settings.update(seed=source.seed, time_limit=0.0, adaptive_sampling=False)
        # Pictures that come soon before those that are clean per second: paths are split where that was asked for.
        if "bounce_samples" in reuse_properties.group_of(scene.headwater)[1]:
            settings.setdefault("bounce_samples", 1)
        return Request(
            edition=self._edition,
            frame=depsgraph.scene_eval.frame_current_final,
            width=size[0],
            height=size[1],
            region=_region(space, rv3d, scene, camera_object, size),
            camera=camera,
            settings=tuple(sorted((name, _frozen(value)) for name, value in settings.items())),
            samples=source.preview_samples or 2**20,
            channel=channel,
            carried=carried,
            denoise=recipe,
            denoise_from=denoise_from,
            device=render_settings.device_choice(scene, preferences.chosen_device(), given),
        )

    @property
    def picture(self) -> Picture | None:
        return self._worker.picture

    @property
    def core_sync(self) -> dict:
        """What Session.sync said last: seconds and counts."""
        return self._worker.synced

    def is_current(self, picture: Picture) -> bool:
        """Whether a picture shows what the viewport shows."""
        return picture.request == self._request and picture.request.edition == self._edition and self._waiting is None

    @property
    def statistics(self) -> dict | None:
        """What the newest slice of the picture cost, as Session.stats says it; None before the first."""
        return self._worker.statistics

    @property
    def status(self) -> str:
        """One line for the viewport's corner."""
        worker, picture = self._worker, self._worker.picture
        problem = self._problem or worker.error
        if problem:
            return problem
        parts = []
        if picture is not None:
            samples = f"Sample {picture.samples}/{picture.request.samples}"
            parts.append(samples if picture.divider == 1 else f"{samples} at 1/{picture.divider}")
            if picture.denoised:
                parts.append("Denoised")
        progress = worker.progress
        if progress.get("mrays"):
            parts.append(f"{progress['mrays']:.1f} Mrays/s")
        if progress.get("memory"):
            parts.append(f"Memory {progress['memory'] / 2**20:.0f} MiB")
        if worker.state:
            parts.append(worker.state)
        if worker.not_denoised:
            parts.append(f"Not denoised: {worker.not_denoised}")
        return " | ".join(parts)


def _frozen(value):
    return tuple(value) if isinstance(value, list) else value


def _hidden_here(space) -> tuple:
    """What decides about objects in this viewport alone; empty when it shows all that the scene does."""
    kinds = tuple(
        name
        for name in ("mesh", "curve", "surf", "meta", "font", "curves", "pointcloud", "volume", "light")
        if not getattr(space, f"show_object_viewport_{name}", True)
    )
    local = space.local_view.as_pointer() if space.local_view is not None else 0
    return (local, space.use_local_collections, kinds) if local or space.use_local_collections or kinds else ()


def _camera(space, rv3d, scene, camera_object, size) -> view_camera.ViewCamera:
    """What the viewport sees with; camera_object: the evaluated one that it looks through, None in free views."""
    if camera_object is None or camera_object.type != "CAMERA":
        return view_camera.from_matrices(rv3d.window_matrix, rv3d.view_matrix, (space.clip_start, space.clip_end))
    data, matrix = camera_object.data, rigid(camera_object.matrix_world)
    clip, lens = (data.clip_start, data.clip_end), lens_settings(camera_object, matrix)
    if data.type != "PANO":
        return view_camera.from_matrices(rv3d.window_matrix, rv3d.view_matrix, clip, lens)
    panorama = panorama_settings(data, scene.render, render_settings.frame_of(scene.render)) or {}
    rectangle = _frame(rv3d, scene, camera_object, size)
    return view_camera.from_panorama(matrix, rectangle, *size, {"clip": clip, **lens, **panorama})


def _frame(rv3d, scene, camera_object, size) -> tuple[float, float, float, float]:
    """Where the frame of the camera that a viewport looks through lies in it, in pixels."""
    matrix = camera_object.matrix_world.normalized()
    corners = [matrix @ corner for corner in camera_object.data.view_frame(scene=scene)]
    return view_camera.frame_rectangle(corners, rv3d.perspective_matrix, *size)


def _region(space, rv3d, scene, camera_object, size) -> tuple[int, int, int, int]:
    """The render region in pixels: all of the viewport where there is none."""
    whole = (0, 0, *size)
    if camera_object is None:
        if not space.use_render_border:
            return whole
        border = (
            space.render_border_min_x,
            space.render_border_min_y,
            space.render_border_max_x,
            space.render_border_max_y,
        )
        return view_camera.part(whole, border, *size)
    render = scene.render
    if not render.use_border or camera_object.type != "CAMERA":
        return whole
    rectangle = _frame(rv3d, scene, camera_object, size)
    border = (render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y)
    return view_camera.part(rectangle, border, *size)


def _draw_later(engine) -> None:
    reference = weakref.ref(engine)

    def redraw():
        engine = reference()
        try:
            if engine is not None:
                engine.tag_redraw()
        except ReferenceError:
            pass

    bpy.app.timers.register(redraw, first_interval=RESIZE_REST)


def newest() -> View | None:
    """The open view whose picture is the newest: the one that renders now. None where no viewport has a picture."""
    drawn = [view for view in _views if not view.closed and view.picture is not None]
    return max(drawn, key=lambda view: view.picture.at, default=None)


def update(engine, context, depsgraph) -> None:
    """RenderEngine.view_update."""
    view = _view_of(engine)
    if view is not None:
        view.update(context, depsgraph)


def draw(engine, context, depsgraph) -> None:
    """RenderEngine.view_draw."""
    view = _view_of(engine)
    if view is not None:
        view.draw(engine, context, depsgraph)


def _view_of(engine) -> View | None:
    """The engine's view, a new one where it was closed; None when there is no core, which the viewport then says."""
    view = engine.view
    if view is None or view.closed:
        try:
            view = engine.view = View(engine)
        except native.NativeError as error:
            engine.update_stats("Headwater", str(error))
            log.error(str(error), error)
            return None
    return view


def close_all(seconds: float = CLOSE_SECONDS) -> None:
    """Ends all views; those that Blender still shows begin anew at the next draw."""
    for view in list(_views):
        view.close()
    close_workers(seconds)


@persistent
def _history_changed(*_):
    for view in list(_views):
        view.compare_everything()


_handlers = (("undo_post", _history_changed), ("redo_post", _history_changed), ("load_post", _history_changed))


def register():
    handlers.add(_handlers)


def unregister():
    handlers.remove(_handlers)
    close_all()
    atexit.unregister(close_all)
