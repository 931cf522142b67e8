# SPDX-License-Identifier: Apache-2.0
"""Rendering a USD stage: stage → scene edits → session → EXR or PNG, frame by frame."""

import time

from headwater import __version__, denoiser, interrupt
from headwater.core import load
from headwater.errors import EXIT_USAGE, UserError, first_line
from headwater.image_io import write_exr, write_png
from headwater.integrators import DEFAULT_INTEGRATOR

DEFAULT_SAMPLES = 64
DEFAULT_HEIGHT = 720
UNLIMITED_SAMPLES = 1 << 16  # with --time-limit alone
WAIT_MS = 50


def make_context(core, request):
    """The core's Context for a request. Raises UserError (exit 2) when device or tracer can't serve."""
    try:
        context = core.Context(device=request.device, tracer=request.tracer, threads=request.threads)
        context.set_memory_limit(request.memory_limit << 20)
        return context
    except MemoryError:
        raise
    except Exception as error:  # DeviceError: its text lists the devices and why each can't be used
        status = EXIT_USAGE if request.device or request.tracer != "auto" else 1
        raise UserError(" ".join(str(error).split()), status) from error


def default_size(stage, camera, time_code):
    """(width, height): the stage's render settings, else the camera's aperture at DEFAULT_HEIGHT."""
    from pxr import UsdRender

    from headwater.usd_scene.camera import aperture_aspect

    settings = UsdRender.Settings.GetStageRenderSettings(stage)
    if settings and settings.GetResolutionAttr().HasAuthoredValue():
        width, height = settings.GetResolutionAttr().Get()
        if 0 < width <= 65536 and 0 < height <= 65536:
            return int(width), int(height)
    aspect = aperture_aspect(camera, time_code) if camera else None
    width = round(DEFAULT_HEIGHT * min(max(aspect or 16 / 9, 0.05), 20.0))
    return width, DEFAULT_HEIGHT


def render_settings(request, width, height, passes) -> dict:
    """The core's settings for a request; USD files have no sampling settings, so the rest is the core's default."""
    samples = request.samples or (UNLIMITED_SAMPLES if request.time_limit else DEFAULT_SAMPLES)
    settings = {"width": width, "height": height, "samples": samples, "passes": passes}
    settings |= request.bounces | request.reuse | (request.adaptive or {})
    settings["region"] = request.check_region(width, height) or (0, 0, width, height)
    settings["integrator"] = request.integrator or DEFAULT_INTEGRATOR
    for key, value in (
        ("time_limit", request.time_limit),
        ("seed", request.seed),
        ("lights", request.lights),
        ("estimator", request.estimator),
    ):
        if value is not None:
            settings[key] = value
    return settings


def render_usd(request, progress, stats) -> None:
    """Renders every frame of the request. Stops after the current picture when interrupted; it is then partial."""
    from headwater.usd_scene import StageSync, open_stage
    from headwater.usd_scene.camera import find_camera
    from headwater.usd_scene.stage import reading

    started = time.perf_counter()
    opened = open_stage(request.file)
    frames = request.frames if request.frames is not None else [opened.first_frame]
    first = frames[0]
    with reading(request.file):
        camera = find_camera(opened.stage, request.camera)
        width, height = request.size or default_size(opened.stage, camera, first)
    passes = request.passes or ["Combined"]
    recipe = _recipe(request, passes, progress)
    settings = render_settings(request, width, height, _core_passes(passes, recipe))
    core = load()
    context = make_context(core, request)
    scene = core.Scene()
    sync = StageSync(opened, scene, warn=progress.warn, flags=core.flags)
    session = core.Session(context, scene)
    stats.set(
        engine="headwater",
        device=context.device["name"],
        tracer=context.tracer,
        threads=request.threads,
        load_seconds=time.perf_counter() - started,
    )
    synced_last = None
    for frame in frames:
        if interrupt.requested():
            return
        started = time.perf_counter()
        if "Vector" in passes and synced_last != frame - 1:  # motion is from the last upload to this one
            with reading(request.file):
                sync.sync(frame - 1, aspect=width / height, camera=request.camera)
            _upload(session)
        synced_last = frame
        output = request.frame_output(int(frame))
        progress.update(f"frame {frame:g}", {"stage": "reading the stage"}, force=True)
        with reading(request.file):
            scene_seconds = sync.sync(frame, aspect=width / height, camera=request.camera)
        synced = {"scene_seconds": scene_seconds, **_upload(session)}
        settings["continue_history"] = frame != first  # reservoirs go on from frame to frame
        _render_frame(session, settings, f"frame {frame:g}", progress)
        pixels = {name: session.read(name) for name in passes}
        if recipe is not None and not interrupt.requested():
            progress.update_text(f"frame {frame:g}", 1.0, "denoising")
            pixels |= _denoised(recipe, session, progress)
        write(output, pixels, request)
        layer = {"view_layer": "ViewLayer", "sync": synced, "render": session.stats()}
        stats.add_frame(frame, output, [layer], time.perf_counter() - started, cancelled=interrupt.requested())
        progress.note(f"{output}  {time.perf_counter() - started:.1f}s")


def _recipe(request, passes, progress):
    """How pictures are denoised; None where they are not, or can't be."""
    if not request.denoise or "Combined" not in passes:
        return None
    if denoiser.unavailable():
        progress.warn(f"not denoised: {denoiser.unavailable()}")
        return None
    return denoiser.Recipe()


def _core_passes(passes, recipe) -> list:
    """The passes asked for, and those that denoising needs."""
    return passes if recipe is None else list(dict.fromkeys([*passes, *recipe.guides]))


def _denoised(recipe, session, progress) -> dict:
    """Combined, denoised, and the noisy picture as a pass. Combined stays as it is after Ctrl-C or an error."""
    try:
        return {"Combined": recipe.run(session.read, interrupt.requested), "Noisy Image": session.read("Combined")}
    except denoiser.DenoiseCancelled:
        return {}
    except (RuntimeError, MemoryError) as error:
        progress.warn(f"not denoised: {first_line(error)}")
        return {}


def _upload(session) -> dict:
    try:
        return session.sync()
    except RuntimeError as error:  # DeviceError, OutOfMemory: the core's own sentence
        raise UserError(first_line(error)) from error


def _render_frame(session, settings, label, progress):
    """Renders until done or interrupted; the pixels so far stay readable."""
    try:
        session.start(settings)
    except ValueError as error:
        raise UserError(first_line(error), EXIT_USAGE) from error
    cancelled = False
    while not session.wait(WAIT_MS):
        if interrupt.requested() and not cancelled:
            session.cancel()
            cancelled = True
        progress.update(label, session.progress())
    progress.update(label, session.progress(), force=True)
    try:
        session.finish()
    except (MemoryError, KeyboardInterrupt):
        raise
    except Exception as error:
        raise UserError(f"the render failed: {first_line(error)}") from error


def write(output, pixels, request) -> None:
    """One frame's passes to its file."""
    if request.is_png:
        name = "Combined" if "Combined" in pixels else next(iter(pixels))
        if pixels[name].shape[2] < 3:
            raise UserError(f"pass '{name}' is no picture: write it to an .exr", EXIT_USAGE)
        write_png(output, pixels[name])
    else:
        write_exr(output, pixels, depth=request.exr_depth, attributes={"Software": f"Headwater {__version__}"})
