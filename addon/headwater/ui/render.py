# SPDX-License-Identifier: GPL-3.0-or-later
"""Render properties: Sampling, Reservoirs, Light Paths, Film, Performance; Cycles' own where those are in use."""

import bpy
from bl_ui.utils import PresetPanel

from headwater import denoiser
from headwater.integrators import INTEGRATORS, PARAMETERS

from .. import native, reuse_properties
from ..render_settings import cycles_of, frame_of
from .panel import HeadwaterPanel, paragraph, split


class _RenderPanel(HeadwaterPanel):
    bl_context = "render"


class HEADWATER_PT_sampling_presets(PresetPanel, bpy.types.Panel):
    bl_label = "Sampling Presets"
    preset_subdir = "headwater/sampling"
    preset_operator = "script.execute_preset"
    preset_add_operator = "headwater.sampling_preset_add"
    COMPAT_ENGINES = {"HEADWATER"}


class HEADWATER_RENDER_PT_sampling(_RenderPanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw_header_preset(self, _context):
        HEADWATER_PT_sampling_presets.draw_panel_header(self.layout)

    def draw(self, context):
        scene = context.scene
        own = scene.headwater
        column = split(self.layout)
        column.prop(own, "integrator")
        if INTEGRATORS[own.integrator].unbiased:
            column.prop(own, "estimator")
        paragraph(self.layout, context, INTEGRATORS[own.integrator].description)
        if hasattr(scene, "cycles"):
            self.layout.prop(own, "use_cycles_settings")


class HEADWATER_RENDER_PT_sampling_viewport(_RenderPanel, bpy.types.Panel):
    bl_label = "Viewport"
    bl_parent_id = "HEADWATER_RENDER_PT_sampling"

    def draw(self, context):
        source = cycles_of(context.scene) or context.scene.headwater
        column = split(self.layout)
        column.prop(source, "preview_samples", text="Samples")
        column.prop(context.scene.headwater, "use_preview_history")


class HEADWATER_RENDER_PT_sampling_render(_RenderPanel, bpy.types.Panel):
    bl_label = "Render"
    bl_parent_id = "HEADWATER_RENDER_PT_sampling"

    def draw(self, context):
        source = cycles_of(context.scene) or context.scene.headwater
        layout = split(self.layout)
        own = context.scene.headwater
        adaptive = own.use_adaptive_sampling
        row = layout.column(align=True, heading="Noise Threshold").row(align=True)
        row.prop(own, "use_adaptive_sampling", text="")
        threshold = row.row()
        threshold.active = adaptive
        threshold.prop(own, "adaptive_threshold", text="")
        column = layout.column(align=True)
        column.prop(source, "samples", text="Max Samples" if adaptive else "Samples")
        if adaptive:
            column.prop(own, "adaptive_min_samples", text="Min Samples")
        column.prop(source, "time_limit")


class HEADWATER_RENDER_PT_reservoirs(_RenderPanel, bpy.types.Panel):
    bl_label = "Light Sampling"
    bl_parent_id = "HEADWATER_RENDER_PT_sampling"

    @classmethod
    def applies(cls, context) -> bool:
        return bool(INTEGRATORS[context.scene.headwater.integrator].defaults)

    def draw(self, context):
        group, names = reuse_properties.group_of(context.scene.headwater)
        layout = split(self.layout)
        section = None
        for name in names:
            parameter = PARAMETERS[name]
            if parameter.section != section:
                section, column = parameter.section, layout.column()
            row = column.row()
            row.active = not parameter.needs or getattr(group, parameter.needs)
            row.prop(group, name)
        text = memory_text(context.scene)
        if text:
            layout.label(text=text)


def memory_text(scene) -> str:
    """Memory of the scene's reservoirs at its resolution, or why the core refuses them; empty without a core or any."""
    frame = frame_of(scene.render)
    try:
        size = native.core().reservoir_bytes(
            {"width": frame.width, "height": frame.height, **reuse_properties.settings(scene.headwater)}
        )
    except native.NativeError:
        return ""
    except ValueError as error:
        return str(error)
    if not size:
        return ""
    return f"Memory: {size / 2**20:.1f} MiB at {frame.width} × {frame.height}"


class _DenoisePanel(_RenderPanel):
    """A switch in the header, and how it is done; `prefix`: of the properties' names, Cycles' and ours alike."""

    bl_label = "Denoise"
    bl_options = {"DEFAULT_CLOSED"}
    prefix = ""

    def draw_header(self, context):
        source = cycles_of(context.scene) or context.scene.headwater
        self.layout.prop(source, f"use_{self.prefix}denoising", text="")

    def draw(self, context):
        source = cycles_of(context.scene) or context.scene.headwater
        column = split(self.layout)
        column.active = getattr(source, f"use_{self.prefix}denoising")
        column.prop(source, f"{self.prefix}denoising_input_passes", text="Passes")
        if getattr(source, f"{self.prefix}denoising_input_passes") != "RGB":
            column.prop(source, f"{self.prefix}denoising_prefilter", text="Prefilter")
        column.prop(source, f"{self.prefix}denoising_quality", text="Quality")
        if self.prefix:
            column.prop(source, f"{self.prefix}denoising_start_sample", text="Start Sample")
        if denoiser.unavailable():
            self.layout.label(text="Open Image Denoise is missing: see the add-on's preferences", icon="ERROR")


class HEADWATER_RENDER_PT_denoise(_DenoisePanel, bpy.types.Panel):
    bl_parent_id = "HEADWATER_RENDER_PT_sampling_render"


class HEADWATER_RENDER_PT_viewport_denoise(_DenoisePanel, bpy.types.Panel):
    bl_parent_id = "HEADWATER_RENDER_PT_sampling_viewport"
    prefix = "preview_"


class HEADWATER_RENDER_PT_sampling_advanced(_RenderPanel, bpy.types.Panel):
    bl_label = "Advanced"
    bl_parent_id = "HEADWATER_RENDER_PT_sampling"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        own, cycles = context.scene.headwater, cycles_of(context.scene)
        column = split(self.layout)
        row = column.row(align=True)
        row.prop(cycles or own, "seed")
        row.prop(cycles or own, "use_animated_seed", text="", icon="TIME")
        column.prop(own, "light_choice")
        if cycles:
            if any(layer.samples > 0 for layer in context.scene.view_layers):
                column.prop(cycles, "use_layer_samples")
            if hasattr(cycles, "use_sample_subset"):  # Blender 4.3 has none
                column.prop(cycles, "use_sample_subset")
                if cycles.use_sample_subset:
                    column.prop(cycles, "sample_offset")
                    column.prop(cycles, "sample_subset_length")


class HEADWATER_RENDER_PT_light_paths(_RenderPanel, bpy.types.Panel):
    bl_label = "Light Paths"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        own, cycles = context.scene.headwater, cycles_of(context.scene)
        source = cycles or own
        column = split(self.layout)
        for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
            column.prop(source, name)
        column.prop(source, "transparent_max_bounces" if cycles else "transparent_bounces", text="Transparent")
        column.prop(source, "min_light_bounces" if cycles else "min_bounces")


class HEADWATER_RENDER_PT_clamping(_RenderPanel, bpy.types.Panel):
    bl_label = "Clamping"
    bl_parent_id = "HEADWATER_RENDER_PT_light_paths"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        own, cycles = context.scene.headwater, cycles_of(context.scene)
        column = split(self.layout)
        column.prop(cycles or own, "sample_clamp_direct" if cycles else "clamp_direct", text="Direct Light")
        column.prop(cycles or own, "sample_clamp_indirect" if cycles else "clamp_indirect", text="Indirect Light")


class HEADWATER_RENDER_PT_caustics(_RenderPanel, bpy.types.Panel):
    bl_label = "Caustics"
    bl_parent_id = "HEADWATER_RENDER_PT_light_paths"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        own, cycles = context.scene.headwater, cycles_of(context.scene)
        column = split(self.layout)
        column.prop(cycles or own, "blur_glossy" if cycles else "filter_glossy")
        column.prop(cycles or own, "caustics_reflective", text="Reflective")
        column.prop(cycles or own, "caustics_refractive", text="Refractive")


class HEADWATER_RENDER_PT_film(_RenderPanel, bpy.types.Panel):
    bl_label = "Film"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        own, cycles = context.scene.headwater, cycles_of(context.scene)
        source = cycles or own
        column = split(self.layout)
        column.prop(source, "film_exposure" if cycles else "exposure")
        column.prop(context.scene.render, "film_transparent")
        glass = column.column()
        glass.active = context.scene.render.film_transparent
        glass.prop(source, "film_transparent_glass" if cycles else "transparent_glass")
        kind = "pixel_filter_type" if cycles else "filter_type"
        column.prop(source, kind, text="Pixel Filter")
        if getattr(source, kind) != "BOX":
            column.prop(source, "filter_width", text="Width")


class HEADWATER_RENDER_PT_performance(_RenderPanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        render, own = context.scene.render, context.scene.headwater
        column = split(self.layout)
        column.prop(own, "tracer")
        column.prop(own, "device", text="Device Override")
        column.prop(render, "threads_mode", text="Threads")
        threads = column.column()
        threads.enabled = render.threads_mode == "FIXED"
        threads.prop(render, "threads", text="Count")
        column.prop(render, "use_persistent_data", text="Persistent Data")


_classes = (
    HEADWATER_PT_sampling_presets,
    HEADWATER_RENDER_PT_sampling,
    HEADWATER_RENDER_PT_sampling_viewport,
    HEADWATER_RENDER_PT_sampling_render,
    HEADWATER_RENDER_PT_reservoirs,
    HEADWATER_RENDER_PT_denoise,
    HEADWATER_RENDER_PT_viewport_denoise,
    HEADWATER_RENDER_PT_sampling_advanced,
    HEADWATER_RENDER_PT_light_paths,
    HEADWATER_RENDER_PT_clamping,
    HEADWATER_RENDER_PT_caustics,
    HEADWATER_RENDER_PT_film,
    HEADWATER_RENDER_PT_performance,
)
register, unregister = bpy.utils.register_classes_factory(_classes)
