# SPDX-License-Identifier: GPL-3.0-or-later
"""Render properties: what the last final picture and the newest one of a viewport cost. Read when it is drawn."""

import bpy
from bpy.app.handlers import persistent

from headwater.integrators import INTEGRATORS

from .. import final
from ..viewport import view as viewport
from .panel import HeadwaterPanel

STAGES = 12  # most lines of stages; the rest is summed up
_TRACERS = {"embree": "Embree", "ray_query": "Vulkan Ray Query", "ray_pipeline": "Vulkan Ray Pipeline"}


class HEADWATER_RENDER_PT_statistics(HeadwaterPanel, bpy.types.Panel):
    bl_label = "Statistics"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, _context):
        facts, view = final.last_facts, viewport.newest()
        if facts is None and (view is None or view.statistics is None):
            self.layout.label(text="Nothing rendered yet")


class HEADWATER_RENDER_PT_statistics_render(HeadwaterPanel, bpy.types.Panel):
    bl_label = "Last Render"
    bl_context = "render"
    bl_parent_id = "HEADWATER_RENDER_PT_statistics"

    @classmethod
    def applies(cls, _context):
        return final.last_facts is not None

    def draw(self, _context):
        draw_rows(self.layout, render_rows(final.last_facts))


class HEADWATER_RENDER_PT_statistics_viewport(HeadwaterPanel, bpy.types.Panel):
    bl_label = "Viewport"
    bl_context = "render"
    bl_parent_id = "HEADWATER_RENDER_PT_statistics"

    @classmethod
    def applies(cls, _context):
        view = viewport.newest()
        return view is not None and view.statistics is not None

    def draw(self, _context):
        draw_rows(self.layout, viewport_rows(viewport.newest()))


def draw_rows(layout, rows) -> None:
    """(name, value) pairs in two columns; a pair without a value is a heading."""
    column = layout.column(align=True)
    for name, value in rows:
        line = column.row()
        if not value:
            line.label(text=name)
            continue
        parts = line.split(factor=0.5)
        left = parts.row()
        left.alignment = "RIGHT"
        left.label(text=name)
        parts.label(text=value)


def render_rows(facts: dict) -> list[tuple[str, str]]:
    """Rows for what final._facts() says of a picture."""
    view = f", {facts['view']}" if facts["view"] else ""
    export, synced = facts["export"], facts["sync"]
    samples = facts["core"].get("samples", facts["samples"])
    return [
        ("Picture", f"{facts['scene']}, {facts['view_layer']}{view}, frame {facts['frame']}"),
        ("Size", f"{facts['width']} × {facts['height']}"),
        ("Integrator", INTEGRATORS[facts["integrator"]].label),
        ("Samples", f"{samples}, cancelled" if facts["cancelled"] else str(samples)),
        ("Time", _time(facts["render_seconds"])),
        ("Reading the Scene", _time(export.get("seconds", 0.0))),
        ("Upload, Build, Lights", _time(_sync_seconds(synced))),
        *_core_rows(facts["core"], facts["integrator"]),
    ]


def viewport_rows(view) -> list[tuple[str, str]]:
    """Rows for an open View that has statistics."""
    picture = view.picture
    request = picture.request
    integrator = dict(request.settings)["integrator"]
    size = f"{request.width} × {request.height}"
    return [
        ("Size", size if picture.divider == 1 else f"{size}, at 1/{picture.divider}"),
        ("Integrator", INTEGRATORS[integrator].label),
        ("Samples", f"{picture.samples} / {request.samples}"),
        ("Reading Changes", _time(view.sync_seconds)),
        ("Upload, Build, Lights", _time(_sync_seconds(view.core_sync))),
        ("Drawing", _time(view.draw_seconds)),
        *_core_rows(view.statistics, integrator),
    ]


def _core_rows(stats: dict, integrator: str) -> list[tuple[str, str]]:
    """Rows for what core.Session.stats() says: docs/manual/stats.md."""
    rows = []
    if stats.get("device"):
        rows.append(("Device", stats["device"]))
        rows.append(("Ray Tracing", _TRACERS.get(stats.get("tracer", ""), "")))
    if stats.get("rays"):
        rows.append(("Rays", f"{stats['rays']:,}"))
        rows.append(("Speed", f"{stats.get('mrays_per_second', 0.0):.2f} Mrays/s"))
    memory = stats.get("memory", {})
    for name, key in (
        ("Device Memory", "device_bytes"),
        ("Peak", "device_peak_bytes"),
        ("Paths", "wave_bytes"),
        ("Acceleration Structures", "acceleration_bytes"),
    ):
        if memory.get(key):
            rows.append((name, _size(memory[key])))
    if stats.get("reservoir_bytes"):
        share = stats["reservoir_bytes"] / max(memory.get("device_bytes", 0), stats["reservoir_bytes"])
        rows.append(("Reservoirs", f"{_size(stats['reservoir_bytes'])}, {share:.0%} of device memory"))
        if stats.get("light_cells"):
            cells, used = stats["light_cells"], stats.get("light_cells_used", 0)
            rows.append(("Cells in Use", f"{used:,} of {cells:,}, {used / cells:.0%}"))
    elif integrator != "path":
        rows.append(("Reservoirs", "none: too few lights"))
    scene = stats.get("scene", {})
    if scene:
        rows.append(("Triangles", f"{scene['triangles']:,}"))
        rows.append(("Instances, Lights", f"{scene['instances']:,}, {scene['lights']:,}"))
    return rows + _stage_rows(stats.get("stages") or {})


def _stage_rows(stages: dict[str, float]) -> list[tuple[str, str]]:
    """The stages that took longest, in seconds and in parts of all."""
    total = sum(stages.values())
    if total <= 0:
        return []
    longest = sorted(stages.items(), key=lambda item: -item[1])
    shown, rest = longest[:STAGES], sum(seconds for _, seconds in longest[STAGES:])
    if rest > 0:
        shown.append(("others", rest))
    return [("Stages", ""), *((name, f"{_time(seconds)}, {seconds / total:.0%}") for name, seconds in shown)]


def _sync_seconds(synced: dict) -> float:
    return sum(synced.get(f"{part}_seconds", 0.0) for part in ("commit", "upload", "build", "lights"))


def _time(seconds: float) -> str:
    if seconds >= 60:
        return f"{int(seconds) // 60} min {seconds % 60:04.1f} s"
    return f"{seconds:.2f} s" if seconds >= 1 else f"{1e3 * seconds:.1f} ms"


def _size(size: int) -> str:
    return f"{size / 2**20:.1f} MiB" if size >= 2**20 else f"{size / 2**10:.1f} KiB"


@persistent
def _file_loaded(*_):
    final.last_facts = None


_classes = (
    HEADWATER_RENDER_PT_statistics,
    HEADWATER_RENDER_PT_statistics_render,
    HEADWATER_RENDER_PT_statistics_viewport,
)


def register():
    for each in _classes:
        bpy.utils.register_class(each)
    bpy.app.handlers.load_post.append(_file_loaded)


def unregister():
    if _file_loaded in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_file_loaded)
    final.last_facts = None
    for each in reversed(_classes):
        bpy.utils.unregister_class(each)
