# SPDX-License-Identifier: GPL-3.0-or-later
"""A final frame: export in RenderEngine.update, render and hand out pixels in RenderEngine.render.

Errors reach the artist by `report`, `error_set` (Blender only logs exceptions of an engine) and the log, are kept in
`last_error`, and give the process status 1 in background mode or where the command line says --headwater-strict.
"""

import atexit
import json
import os
import sys
import time
import traceback
from dataclasses import dataclass, field

import bpy
import numpy as np

from headwater import denoiser

from . import denoising, kept, log, motion, native, options, passes, preferences, render_settings
from .sync.problems import Cancelled, SyncError
from .sync.state import SENT
from .turns import turns

PICTURE_EVERY = 0.7  # seconds between intermediate pictures
WAIT_MS = 50
PREVIEW_SAMPLES, PREVIEW_SECONDS = 32, 2.0  # of material, world and light previews: whichever ends first

last_error = ""
last_facts: dict | None = None  # what _facts() said of the last picture of a scene: for the statistics panel

# Called as observer(event, facts) while rendering: "progress" with the core's progress, about 20 times a second (a true
# answer cancels the render), and "frame" with what _facts() says after each picture. For scripts and the command line.
observers = []


@dataclass
class Job:
    """One view layer of one frame, from export to pixels."""

    key: tuple
    place: dict  # names of scene and view layer, number of the frame
    kept: object
    frame: render_settings.Frame
    settings: dict
    passes: list
    options: options.Options
    persistent: bool
    export: dict = field(default_factory=dict)
    denoise: denoiser.Recipe | None = None


def fail(engine, text: str, cause: Exception | None = None) -> None:
    """Tells the artist, ends an animation, and remembers for headless callers."""
    global last_error
    if engine.is_preview:
        print(text)
        return
    last_error = text
    log.error(text.removeprefix("Headwater: "), cause)
    engine.report({"ERROR"}, text)
    engine.error_set(text)
    try:
        strict = options.current().strict
    except ValueError:
        strict = True  # what failed may be the command line itself
    if strict is None:
        # A farm must see a failed frame. A program that imports bpy has a status of its own to give.
        strict = bpy.app.background and bool(bpy.app.binary_path)
    if strict:
        atexit.unregister(_exit_failed)
        atexit.register(_exit_failed)


def _exit_failed():
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(1)  # Blender ignores the status of sys.exit at this point


def _guarded(work):
    """Runs a step of a render; whatever goes wrong becomes one message. Returns None then."""

    def step(engine, *arguments):
        try:
            return work(engine, *arguments)
        except Cancelled:
            return None
        except (SyncError, native.NativeError, ValueError, RuntimeError, MemoryError) as error:
            if not isinstance(error, (SyncError, native.NativeError, MemoryError, *native.expected_errors())):
                traceback.print_exc()
            if type(error).__name__ == "DeviceLost":  # the core's; a new context is needed to go on
                kept.drop_all()
                native.release()
            fail(engine, f"Headwater: {str(error) or type(error).__name__}", error)
        except Exception as error:
            traceback.print_exc()
            fail(engine, f"Headwater: unexpected {type(error).__name__}: {error}", error)
        return None

    return step


def _key(engine, depsgraph) -> tuple:
    if engine.is_preview:  # a sphere of the material tab and the like: has nothing to do with what is kept of scenes
        return ("preview", engine.token)
    return (depsgraph.scene.original.session_uid, depsgraph.view_layer.name)


@_guarded
def export(engine, depsgraph) -> Job:
    """Syncs a view layer to the core's scene. Called by RenderEngine.update."""
    global last_error
    if not engine.is_preview:
        last_error = ""
    with turns.take(final=True, keep_waiting=lambda: not engine.test_break()) as ours:
        return _export(engine, depsgraph) if ours else None


def _export(engine, depsgraph) -> Job:
    scene, view_layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    given = options.current()
    frame = render_settings.frame_of(scene.render)
    if frame.region_width <= 0 or frame.region_height <= 0:
        raise SyncError("The render border is empty: it covers no pixel")
    engine.update_stats("", "Loading the core")
    context = native.context(*render_settings.device_choice(scene, preferences.chosen_device(), given))
    context.set_memory_limit((given.memory_limit or 0) << 20 or preferences.memory_limit())
    key = _key(engine, depsgraph)
    persistent, again = scene.render.use_persistent_data, engine.is_animation
    if not (again or persistent):
        kept.drop(key)
    state = kept.get(key, context)

    def breathe():
        if engine.test_break():
            raise Cancelled

    wanted = passes.wanted(scene, view_layer, given)
    denoise = denoising.PREVIEW if engine.is_preview else denoising.recipe(scene, view_layer, given)
    if engine.is_preview and denoiser.unavailable():
        denoise = None  # Blender shows no report of a preview
    elif denoise is not None and denoiser.unavailable():
        engine.report({"WARNING"}, f"Headwater: not denoised: {denoiser.unavailable()}")
        denoise = None
    before = passes.has_motion(wanted) and motion.sync_frame_before(engine, state, depsgraph, frame, breathe)
    engine.update_stats("", "Synchronizing")
    report = state.sync.sync(
        depsgraph,
        state.graph == engine.token and not before,
        breathe,
        next_frame=before or (again and not persistent),
        once=not (again or persistent or passes.has_motion(wanted)),
        build=state.session.sync,
        borrow=context.shared_memory,
    )
    state.graph = engine.token
    for note in state.sync.notes.take():
        engine.report({"WARNING"}, f"Headwater: {note}")
        if not engine.is_preview:
            log.note(note)
    scene = depsgraph.scene_eval
    state.frame = (scene.frame_current, scene.frame_subframe)
    names = [item.core_name for item in wanted] + list(denoise.guides if denoise else ())
    settings = render_settings.build(scene, view_layer, frame, list(dict.fromkeys(names)), given)
    # Frames of an animation hand their reservoirs on. A picture rendered again starts anew, so that it comes out the
    # same; the eyes of a stereo render share a session, not a past.
    in_order = (again or persistent) and not scene.render.use_multiview
    settings["continue_history"] = in_order and state.continues(scene)
    if engine.is_preview:
        settings.update(integrator="path", samples=PREVIEW_SAMPLES, time_limit=PREVIEW_SECONDS)
    state.reservoirs_of = None
    place = {"scene": scene.name, "view_layer": view_layer.name, "frame": scene.frame_current}
    return Job(key, place, state, frame, settings, wanted, given, persistent, report, denoise)


@_guarded
def render(engine, job: Job, depsgraph) -> None:
    """Renders every view of the view layer. Called by RenderEngine.render, without Blender's draw lock."""
    job.kept.busy = True
    try:
        with turns.take(final=True, keep_waiting=lambda: not engine.test_break()) as ours:
            if ours:
                _render_views(engine, job, depsgraph)
    except BaseException:
        kept.drop(job.key)  # what the session holds is not to be trusted after an error
        raise
    finally:
        job.kept.busy = False
        if engine.is_preview:
            kept.drop(job.key)


def _render_views(engine, job: Job, depsgraph) -> None:
    render_of = depsgraph.scene_eval.render
    views = [view.name for view in render_of.views if view.use] if render_of.use_multiview else [""]
    for view in views:
        _set_camera(engine, job, depsgraph, view)
        if not _render_view(engine, job, depsgraph, view, view == views[-1]):
            break
    else:
        job.kept.reservoirs_of = job.place["frame"]


def _set_camera(engine, job: Job, depsgraph, view: str) -> None:
    scene = depsgraph.scene_eval
    camera = engine.camera_override or scene.camera
    if camera is not None:
        camera = camera.evaluated_get(depsgraph)
    eye = {}
    if view and camera is not None and camera.type == "CAMERA":
        engine.active_view_set(view)
        spherical = engine.use_spherical_stereo(camera)
        matrix = engine.camera_model_matrix(camera, use_spherical_stereo=spherical)
        eye = {
            "matrix": np.array(matrix, np.float64).reshape(4, 4).T if np.ndim(matrix) == 1 else np.array(matrix),
            "shift_x": engine.camera_shift_x(camera, use_spherical_stereo=spherical),
        }
    job.kept.sync.camera.sync(depsgraph, camera, scene.render, job.frame, **eye)


def _free_blender_memory(engine) -> None:
    """Lets Blender free the dependency graph, which nobody may look at afterwards: the core has what it needs.

    As Cycles does: without a window nobody else asks for the evaluated scene; with persistent data the next frame does.
    """
    if bpy.app.background and not engine.is_preview:
        engine.free_blender_memory()


def _render_view(engine, job: Job, depsgraph, view: str, last: bool) -> bool:
    """One picture. Returns False when the artist cancelled. last: Blender's scene is not needed after it."""
    global last_facts
    session = job.kept.session
    engine.update_stats("", "Building")
    synced = session.sync()
    early = job.export["early"]
    for count in SENT:  # what was sent beside the export was sent for this picture too
        synced[count] = synced.get(count, 0) + early.pop(count, 0)
    result = engine.begin_result(
        0, 0, job.frame.region_width, job.frame.region_height, layer=job.place["view_layer"], view=view
    )
    moves = passes.has_motion(job.passes)
    if last and not job.persistent and not moves:
        _free_blender_memory(engine)
    started = time.perf_counter()
    try:
        session.start(job.settings)
        cancelled = _watch(engine, job, session, result, started)
        session.finish()
        for item in job.passes:
            _write_pass(session, result, item, job.frame)
    except BaseException:
        _rescue(session, result, job)
        engine.end_result(result)
        raise
    rendered = time.perf_counter()
    if job.denoise and not cancelled:
        cancelled = _denoise(engine, job, session, result)
    denoised = time.perf_counter()
    facts = _facts(job, view, synced, session, rendered - started, cancelled)
    try:
        if moves and not cancelled:
            _write_motion_to_next(engine, job, depsgraph, view, result)
    finally:
        engine.end_result(result)
    facts["denoise_seconds"] = denoised - rendered if job.denoise else 0.0
    if not engine.is_preview:
        last_facts = facts
    for observer in list(observers):
        observer("frame", facts)
    if job.options.stats:
        _append_line(job.options.stats, facts)
    return not cancelled


def _denoise(engine, job: Job, session, result) -> bool:
    """Denoises Combined in the result; Esc and errors leave it noisy. Returns whether it was cancelled."""
    engine.update_stats("", "Denoising")
    try:
        pixels = denoising.run(job.denoise, session.read, engine.test_break)
    except denoiser.DenoiseCancelled:
        return True
    except (RuntimeError, MemoryError) as error:  # the picture is worth more than its denoising
        engine.report({"WARNING"}, f"Headwater: not denoised: {error or type(error).__name__}")
        return False
    _fill(result, job.passes[0], pixels, job.frame)
    return False


def _write_motion_to_next(engine, job: Job, depsgraph, view: str, result) -> None:
    """Z and W of the Vector pass. Where they can't be had they stay what X and Y are."""
    item = next(item for item in job.passes if item.core_name == "Vector")
    vector = job.kept.session.read(item.core_name)
    to_next = motion.motion_to_next(engine, job, depsgraph, lambda: _set_camera(engine, job, depsgraph, view))
    if to_next is not None:
        vector[..., 2:] = to_next
        _fill(result, item, vector, job.frame)


def _rescue(session, result, job: Job) -> None:
    """After an error: what was rendered until then goes into the picture, if it can still be read."""
    try:
        if session.progress()["sample"] > 0:
            for item in job.passes:
                _write_pass(session, result, item, job.frame)
    except Exception as error:
        print(f"Headwater: the unfinished picture is lost: {error}")


def _watch(engine, job: Job, session, result, started: float) -> bool:
    """Waits for the render, shows how it goes, looks at Esc. Returns whether it was cancelled."""
    picture_at, shown, cancelled = started, 0, False
    reservoirs = native.core().reservoir_bytes(job.settings)
    while not session.wait(WAIT_MS):
        progress = session.progress()
        asked = [observer("progress", progress) for observer in list(observers)]
        if not cancelled and (engine.test_break() or any(asked)):
            session.cancel()
            cancelled = True
        done = progress["sample"]
        if progress["samples"]:
            engine.update_progress(done / progress["samples"])
        engine.update_stats("", status_text(progress, time.perf_counter() - started, reservoirs))
        engine.update_memory_stats(memory_used=progress["memory"] / 2**20)
        now = time.perf_counter()
        if not bpy.app.background and done > shown and now - picture_at > PICTURE_EVERY:
            _write_pass(session, result, job.passes[0], job.frame)
            engine.update_result(result)
            picture_at, shown = time.perf_counter(), done
    return cancelled


def status_text(progress: dict, seconds: float, reservoirs: int) -> str:
    """One line for the render window: sample, speed, memory (and how much of it the reservoirs have), time left."""
    parts = [f"Sample {progress['sample']}/{progress['samples']}"]
    if progress.get("mrays"):
        parts.append(f"{progress['mrays']:.1f} Mrays/s")
    if progress["memory"]:
        parts.append(f"Memory {progress['memory'] / 2**20:.0f} MiB")
    if reservoirs:
        parts.append(f"Reservoirs {reservoirs / 2**20:.1f} MiB")
    left = progress.get("remaining", -1)
    if left is not None and left >= 0 and seconds > 0.5:
        minutes, rest = divmod(int(left + 0.5), 60)
        hours, minutes = divmod(minutes, 60)
        parts.append(f"Left {hours}:{minutes:02}:{rest:02}" if hours else f"Left {minutes:02}:{rest:02}")
    if progress.get("stage"):
        parts.append(str(progress["stage"]))
    return " | ".join(parts)


def _write_pass(session, result, item, frame) -> None:
    _fill(result, item, session.read(item.core_name), frame)


def _fill(result, item, pixels, frame) -> None:
    target = next((p for p in result.layers[0].passes if p.fullname == item.name or p.name == item.name), None)
    if target is None:
        return
    channels = len(item.channels)
    if pixels.shape != (frame.region_height, frame.region_width, channels):
        raise RuntimeError(
            f"pass {item.core_name}: the core gave {pixels.shape}, Blender expects "
            f"{(frame.region_height, frame.region_width, channels)}"
        )
    target.rect.foreach_set(np.ascontiguousarray(pixels, np.float32).reshape(-1))


def _facts(job: Job, view: str, synced: dict, session, seconds: float, cancelled: bool) -> dict:
    """What a picture cost, as JSON can hold it: schema in docs/manual/settings.md."""
    return {
        **job.place,
        "view": view,
        "width": job.frame.region_width,
        "height": job.frame.region_height,
        "samples": job.settings["samples"],
        "integrator": job.settings["integrator"],
        "cancelled": cancelled,
        "export": job.export,
        "sync": synced,
        "render_seconds": seconds,
        "core": session.stats(),
    }


def _append_line(path: str, facts: dict) -> None:
    """Appends one line of JSON to the file named by --headwater-stats."""
    try:
        with open(path, "a", encoding="utf-8") as file:
            file.write(json.dumps(facts, default=str) + "\n")
    except OSError as error:
        raise RuntimeError(f"cannot write statistics to '{path}': {error.strerror}") from error
