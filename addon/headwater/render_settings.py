# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render is asked for: the scene's settings as the dictionary that core.Session.start takes.

Cycles' settings are used where the Cycles add-on is there and `use_cycles_settings` is on; the meaning of each is in
docs/manual/settings.md.
"""

from typing import NamedTuple

from . import reuse_properties

# key of the core, property of ours, property of Cycles
_SHARED = (
    ("samples", "samples", "samples"),
    ("time_limit", "time_limit", "time_limit"),
    ("max_bounces", "max_bounces", "max_bounces"),
    ("diffuse_bounces", "diffuse_bounces", "diffuse_bounces"),
    ("glossy_bounces", "glossy_bounces", "glossy_bounces"),
    ("transmission_bounces", "transmission_bounces", "transmission_bounces"),
    ("transparent_bounces", "transparent_bounces", "transparent_max_bounces"),
    ("min_bounces", "min_bounces", "min_light_bounces"),
    ("clamp_direct", "clamp_direct", "sample_clamp_direct"),
    ("clamp_indirect", "clamp_indirect", "sample_clamp_indirect"),
    ("filter_glossy", "filter_glossy", "blur_glossy"),
    ("caustics_reflective", "caustics_reflective", "caustics_reflective"),
    ("caustics_refractive", "caustics_refractive", "caustics_refractive"),
    ("exposure", "exposure", "film_exposure"),
    ("transparent_glass", "transparent_glass", "film_transparent_glass"),
    ("filter", "filter_type", "pixel_filter_type"),
    ("filter_width", "filter_width", "filter_width"),
)


def cycles_of(scene):
    """The scene's Cycles settings when they are to be used, else None."""
    cycles = getattr(scene, "cycles", None)
    return cycles if cycles is not None and scene.headwater.use_cycles_settings else None


class Frame(NamedTuple):
    """Size of the picture in pixels, and the part of it that is rendered (border), bottom-left origin."""

    width: int
    height: int
    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def region_width(self) -> int:
        return self.x1 - self.x0

    @property
    def region_height(self) -> int:
        return self.y1 - self.y0


def frame_of(render) -> Frame:
    """Resolution with its percentage, and the border in whole pixels as Blender cuts it (rounded towards zero)."""
    scale = render.resolution_percentage / 100.0
    width, height = max(1, int(render.resolution_x * scale)), max(1, int(render.resolution_y * scale))
    if not render.use_border:
        return Frame(width, height, 0, 0, width, height)
    x0, x1 = int(render.border_min_x * width), int(render.border_max_x * width)
    y0, y1 = int(render.border_min_y * height), int(render.border_max_y * height)
    return Frame(width, height, x0, y0, x1, y1)


def _mix(a: int, b: int) -> int:
    """A 31-bit seed from two numbers, by a multiply-xorshift hash (the constants of splitmix64)."""
    x = ((a & 0xFFFFFFFF) << 32 | (b & 0xFFFFFFFF)) + 0x9E3779B97F4A7C15 & 0xFFFFFFFFFFFFFFFF
    x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9 & 0xFFFFFFFFFFFFFFFF
    x = (x ^ x >> 27) * 0x94D049BB133111EB & 0xFFFFFFFFFFFFFFFF
    return (x ^ x >> 31) & 0x7FFFFFFF


def _samples(scene, view_layer, cycles, samples: int) -> int:
    """The scene's samples, or the view layer's where it has some and the scene lets it."""
    own = view_layer.samples
    use = cycles.use_layer_samples if cycles else "USE"
    if own > 0 and use == "USE":
        return own
    if own > 0 and use == "BOUNDED":
        return min(own, samples)
    return samples


def build(scene, view_layer, frame: Frame, passes: list[str], options) -> dict:
    """The settings of one view layer's render. `options`: those of the command line, which win."""
    own, cycles = scene.headwater, cycles_of(scene)
    settings = {key: getattr(cycles, theirs) if cycles else getattr(own, ours) for key, ours, theirs in _SHARED}
    source = cycles or own
    settings["samples"] = _samples(scene, view_layer, cycles, settings["samples"])
    if cycles and getattr(cycles, "use_sample_subset", False):  # Blender 4.3 has none
        settings["first_sample"] = cycles.sample_offset
        settings["samples"] = max(1, min(settings["samples"] - cycles.sample_offset, cycles.sample_subset_length))
    if options.samples is not None:
        settings["samples"] = options.samples
    settings["seed"] = _mix(scene.frame_current, source.seed) if source.use_animated_seed else source.seed
    if settings["filter"] == "BOX":
        settings["filter_width"] = 1.0  # Cycles' box is always one pixel wide
    settings.update(
        width=frame.width,
        height=frame.height,
        region=(frame.x0, frame.y0, frame.x1, frame.y1),
        lights=own.light_choice,
        adaptive_sampling=own.use_adaptive_sampling,
        noise_threshold=own.adaptive_threshold,
        adaptive_min_samples=own.adaptive_min_samples,
        transparent_film=scene.render.film_transparent,
        pass_alpha_threshold=view_layer.pass_alpha_threshold,
        passes=passes,
        **reuse_properties.settings(own),
    )
    world = scene.world
    if world is not None:
        mist = world.mist_settings
        settings.update(mist_start=mist.start, mist_depth=mist.depth, mist_falloff=mist.falloff)
    return settings


def device_choice(scene, preference: str, options) -> tuple[str, str, int]:
    """Device name ("": the best one), tracer and host threads (0: all) for native.context."""
    own, render = scene.headwater, scene.render
    device = options.device if options.device is not None else (own.device or preference)
    tracer = options.tracer or own.tracer
    threads = options.threads or (render.threads if render.threads_mode == "FIXED" else 0)
    return device, tracer, threads
