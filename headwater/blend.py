# SPDX-License-Identifier: Apache-2.0
"""Rendering a .blend in this process's bpy, through the add-on's engine: the same path as F12.

Blender itself writes the pictures, so compositing, view layers, colour management and EXR layer names are Blender's.
The engine is watched by wrapping its `update` and `render`: the wrapper answers Ctrl-C where Blender would answer Esc
(attributes set on the class do not do it: Blender looks up its own methods first).
"""

import json
import os
import sys
import tempfile
import time

from headwater import interrupt
from headwater.blend_overrides import apply
from headwater.core import load
from headwater.errors import UserError, first_line
from headwater.output import atomic_path
from headwater.quiet import captured_output
from headwater.render_usd import make_context

_MAGICS = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")  # plain, Zstandard, gzip


def render_blend(request, progress, stats) -> None:
    """Renders every frame of the request. Stops after the current picture when interrupted; it is then partial."""
    with open(request.file, "rb") as file:
        if not file.read(8).startswith(_MAGICS):
            raise UserError(f"'{request.file}' is not a .blend file")
    if request.engine == "headwater":
        core = load()
        context = make_context(core, request)  # an unknown device is told before Blender starts
        stats.set(device=context.device["name"], tracer=context.tracer)
        del context
    started = time.perf_counter()
    with captured_output() as captured, progress.redirected(sys.stderr):
        bpy = _import_bpy()
        _open(bpy, request)
        scene = bpy.context.scene
        watched = _register(bpy, request, progress) if request.engine == "headwater" else None
        apply(scene, request)
        stats.set(engine=request.engine, blender=bpy.app.version_string, threads=request.threads)
        stats.set(load_seconds=time.perf_counter() - started)
        frames = request.frames if request.frames is not None else [scene.frame_current]
        if len(frames) > 1:
            scene.frame_step = max(frames[1] - frames[0], 1)  # tells the engine which frame is the next one
        try:
            for frame in frames:
                if interrupt.requested():
                    return
                _render_frame(bpy, scene, frame, request, progress, stats, watched)
        except RuntimeError as error:
            raise UserError(_reason(watched, error, captured())) from error


def _import_bpy():
    try:
        import bpy
    except ImportError as error:
        raise UserError(f".blend files need Blender's Python module: pip install bpy ({first_line(error)})") from error
    return bpy


def _open(bpy, request):
    try:
        result = bpy.ops.wm.open_mainfile(
            filepath=os.path.abspath(request.file), load_ui=False, use_scripts=request.autoexec
        )
    except RuntimeError as error:
        reason = first_line(error).removeprefix("Error: ").split(" failed: ")[-1]
        raise UserError(f"'{request.file}' can't be read: {reason}") from error
    if "FINISHED" not in result or not bpy.context.scene:
        raise UserError(f"'{request.file}' can't be read as a .blend")


class _Watched:
    """Stands before the engine: passes everything on, shows progress, answers test_break for Ctrl-C."""

    def __init__(self, engine, watch):
        object.__setattr__(self, "_engine", engine)
        object.__setattr__(self, "_watch", watch)

    def __getattr__(self, name):
        return getattr(self._engine, name)

    def __setattr__(self, name, value):
        setattr(self._engine, name, value)

    def test_break(self):
        return interrupt.requested() or self._engine.test_break()

    def update_progress(self, part):
        self._watch.part = part
        self._engine.update_progress(part)

    def update_stats(self, stats, info):
        self._watch.show(info)
        self._engine.update_stats(stats, info)

    def report(self, kind, message):
        if "WARNING" in kind:
            self._watch.progress.warn(message.removeprefix("Headwater: "))
        self._engine.report(kind, message)


class _Watch:
    """What is known about the engine from outside."""

    def __init__(self, addon, progress, stats_file):
        self.addon = addon
        self.progress = progress
        self.stats_file = stats_file
        self.label, self.part = "", 0.0

    def show(self, text):
        self.progress.update_text(self.label, self.part, text)

    def last_error(self) -> str:
        return self.addon.engine.last_error

    def take_stats(self) -> list:
        """What the add-on wrote about the frame's view layers; the file is emptied."""
        self.stats_file.seek(0)
        lines = [json.loads(line) for line in self.stats_file.read().splitlines() if line.strip()]
        os.truncate(self.stats_file.fileno(), 0)
        return lines


def _register(bpy, request, progress) -> _Watch:
    """Registers the add-on with its engine watched, and hands it the options it reads from the command line."""
    import headwater.blender

    stats_file = tempfile.NamedTemporaryFile("r+", prefix="headwater-stats-", suffix=".jsonl")
    options = {"device": request.device, "tracer": request.tracer, "stats": stats_file.name}
    if request.threads:
        options["threads"] = str(request.threads)
    if request.memory_limit:
        options["memory-limit"] = str(request.memory_limit)
    sys.argv = ["headwater", "--", *(f"--headwater-{name}={value}" for name, value in options.items())]
    try:
        addon = headwater.blender.addon()
        watch = _Watch(addon, progress, stats_file)
        engine = addon.engine.HeadwaterRenderEngine
        update, render = engine.update, engine.render
        engine.update = lambda self, data, depsgraph: update(_Watched(self, watch), data, depsgraph)
        engine.render = lambda self, depsgraph: render(_Watched(self, watch), depsgraph)
        headwater.blender.register()
    except ImportError as error:
        raise UserError(f"the Blender add-on can't be loaded: {first_line(error)}") from error
    return watch


def _render_frame(bpy, scene, frame, request, progress, stats, watch):
    started = time.perf_counter()
    output = request.frame_output(frame)
    label = f"frame {frame}"
    progress.update_text(label, 0.0, "reading the scene")
    scene.frame_set(frame)
    if watch:
        watch.label, watch.part = label, 0.0
    layers = []
    try:
        with atomic_path(output) as temporary:
            os.unlink(temporary)  # Blender says nothing when it could not write: the file must be new
            scene.render.filepath = temporary
            bpy.ops.render.render(write_still=True)
            if watch:
                if watch.last_error():
                    raise UserError(watch.last_error().removeprefix("Headwater: "))
                layers = [_layer(line) for line in watch.take_stats()]
                if interrupt.requested() and not layers:
                    raise _NothingRendered
            if not os.path.exists(temporary) or os.path.getsize(temporary) == 0:
                raise UserError(f"output '{output}': Blender could not write it")
    except _NothingRendered:
        return
    seconds = time.perf_counter() - started
    stats.add_frame(frame, output, layers, seconds, cancelled=interrupt.requested())
    progress.note(f"{output}  {seconds:.1f}s")


class _NothingRendered(Exception):
    """Stopped before there was a picture: the output keeps what it had."""


def _layer(line: dict) -> dict:
    """A line of the add-on's statistics as a layer of ours."""
    export = line.get("export") or {}
    seconds = export.get("seconds", export.get("total", 0.0)) if isinstance(export, dict) else float(export)
    sync = {"scene_seconds": seconds, "export": export, **line["sync"]}
    return {"view_layer": line["view_layer"], "view": line["view"], "sync": sync, "render": line["core"]}


def _reason(watch, error, captured) -> str:
    """The best sentence for a failed render: the add-on's, else Blender's."""
    if watch and watch.last_error():
        return watch.last_error().removeprefix("Headwater: ")
    text = first_line(error).removeprefix("Error: ")
    if text and text != "RuntimeError":
        return text
    errors = [line for line in captured.splitlines() if line.startswith("Error")]
    return errors[-1] if errors else "Blender could not render the file"
