# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoising as a scene asks for it: Cycles' settings where they are in use, else ours of the same names."""

from concurrent.futures import ThreadPoolExecutor, TimeoutError
from threading import Event

from headwater.denoiser import Recipe

from .render_settings import cycles_of

_ASK_SECONDS = 0.05  # between two looks at Esc
PREVIEW = Recipe("RGB_ALBEDO", "FAST", "BALANCED")  # of material, world and light previews


def recipe(scene, view_layer, options) -> Recipe | None:
    """How a final picture of the view layer is denoised; None: not at all. `options` (command line) win."""
    cycles = cycles_of(scene)
    source = cycles or scene.headwater
    wanted = source.use_denoising and (cycles is None or view_layer.cycles.use_denoising)
    return _recipe(source, "") if (wanted if options.denoise is None else options.denoise) else None


def viewport_recipe(scene) -> tuple[Recipe, int] | None:
    """How a viewport's pictures are denoised, and the first sample that is; None where they are not."""
    source = cycles_of(scene) or scene.headwater
    if not source.use_preview_denoising:
        return None
    return _recipe(source, "preview_"), source.preview_denoising_start_sample


def _recipe(source, prefix: str) -> Recipe:
    names = ("denoising_input_passes", "denoising_prefilter", "denoising_quality")
    return Recipe(*(getattr(source, prefix + name) for name in names))


def run(recipe: Recipe, read, cancelled):
    """Recipe.run on a thread of its own; `cancelled` is asked on the caller's, since Blender's engine is not another's
    to ask. Raises as denoiser.denoise."""
    stop = Event()
    with ThreadPoolExecutor(1, "Headwater denoising") as pool:
        future = pool.submit(recipe.run, read, stop.is_set)
        while True:
            try:
                return future.result(_ASK_SECONDS)
            except TimeoutError:
                if future.done():
                    raise
                if cancelled():
                    stop.set()
