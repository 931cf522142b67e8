# SPDX-License-Identifier: Apache-2.0
"""Integrators and the parameters of those that reuse light samples, as the command line and Blender show them.

The core (core/session/reuse_settings.cpp) decides what is valid. It is not needed to import this module, so that help
can be printed and the add-on registered without it; blender_tests/test_reuse_settings.py holds the two tables against
each other: names, texts, who reads what, defaults, ranges, choices. M, k and L are the letters of the paper (Sivaram,
"World Space Spatio-Temporal Reuse"). docs/manual/reuse.md says more of each.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A setting of the core, None or absent for the integrator's own default."""

    name: str  # of the core's setting and of Blender's property
    label: str
    summary: str  # what it is, without the final full stop
    effect: str  # what it does to the picture: noise, bias, time, memory
    section: str = "reuse"  # of Blender's panel: "candidates", "reuse" or "cells"
    needs: str = ""  # the switch without which it changes nothing
    by_scene: bool = False  # its default depends on the scene: sent to the core only where it was set

    @property
    def flag(self) -> str:
        """Its option on the command line."""
        return "--" + self.name.replace("_", "-")

    def to_property(self, value):
        """The core's value as Blender's property holds it."""
        return value

    def from_property(self, value):
        """What Blender's property holds as the core's value; None: as the integrator's default."""
        return value


@dataclass(frozen=True, kw_only=True)
class Whole(Parameter):
    """A whole number. `soft_most`: where sliders end; `unbiased`: least and most where unbiased estimators differ."""

    least: int
    most: int
    soft_most: int
    unbiased: tuple[int, int] | None = None

    def range(self, estimator: str) -> tuple[int, int]:
        """Least and most value with an estimator."""
        return self.unbiased if estimator == "unbiased" and self.unbiased else (self.least, self.most)


@dataclass(frozen=True, kw_only=True)
class Number(Parameter):
    """A number. `unit`: "share" or "metres"."""

    least: float
    most: float
    soft_most: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Switch(Parameter):
    """On or off. `automatic`: what decides while neither is asked for, where that is more than a default; Blender's
    property is then one of AUTO, ON and OFF, so that it shows what is rendered."""

    automatic: str = ""

    def to_property(self, value):
        return value if not self.automatic else "AUTO" if value is None else "ON" if value else "OFF"

    def from_property(self, value):
        return value if not self.automatic else {"AUTO": None, "ON": True, "OFF": False}[value]


@dataclass(frozen=True, kw_only=True)
class Choice(Parameter):
    """One of several: (value, label, what it does to the picture)."""

    choices: tuple[tuple[str, str, str], ...]


PARAMETERS = {
    parameter.name: parameter
    for parameter in (
        Whole(
            name="candidates",
            label="Candidates",
            summary="Light samples drawn at the first surface, of which one is kept (M)",
            effect="More: less noise in a pass, more time; no bias",
            section="candidates",
            least=1,
            most=1024,
            soft_most=128,
        ),
        Whole(
            name="indirect_candidates",
            label="Indirect Candidates",
            summary="Light samples drawn at each surface after a bounce",
            effect="More: less noise in indirect light, more time; no bias",
            section="candidates",
            least=1,
            most=1024,
            soft_most=128,
        ),
        Whole(
            name="light_samples",
            label="Light Samples",
            summary="Light samples of each surface that the camera sees first",
            effect="More: less noise in direct light for a shadow ray each, which is cheaper than another sample of "
            "the pixel; edges and blur get none of it",
            by_scene=True,
            section="candidates",
            least=1,
            most=64,
            soft_most=16,
        ),
        Whole(
            name="bounce_samples",
            label="Bounce Samples",
            summary="Paths that go on from the first surface that scatters light; 0: as many as pay, one for path",
            effect="More: less noise in indirect light and reflections, for the rest of a path each, which is cheaper "
            "than another sample of the pixel; edges, blur and direct light get little of it",
            by_scene=True,
            section="candidates",
            least=0,
            most=64,
            soft_most=16,
        ),
        Switch(
            name="path_reuse",
            label="Path Reuse",
            summary="Pixels near each other share the light that their paths found at the surface after the first",
            effect="Much less noise where bounces light the picture, for some shadow rays; no bias",
            automatic="Where it pays in World-Space Hash, off in Path Tracing",
        ),
        Whole(
            name="reservoir_memory",
            label="Memory",
            summary="Memory for all cells, in MiB",
            effect="Less: fewer surroundings are known at a time, and noise grows where they are not",
            section="cells",
            least=1,
            most=1 << 16,
            soft_most=1024,
        ),
        Switch(
            name="temporal_reuse",
            label="Temporal Reuse",
            summary="Keep reservoirs from one pass over the picture to the next",
            effect="Much less noise in a pass; passes resemble each other, so that more samples remove less of it",
        ),
        Whole(
            name="history",
            label="History",
            summary="Most passes over the picture that a reservoir remembers; 0: all (not where it must be unbiased)",
            effect="Longer: less noise in the first passes, then blotches that more samples do not remove, and light "
            "that lags behind what moves",
            needs="temporal_reuse",
            least=0,
            most=1 << 20,
            soft_most=100,
            unbiased=(1, 1000),
        ),
        Switch(
            name="spatial_reuse",
            label="Spatial Reuse",
            summary="Merge reservoirs of the surroundings",
            effect="Noise becomes fainter and blotchy; biased where the surroundings are lit differently, as at edges",
        ),
        Whole(
            name="neighbours",
            label="Neighbors",
            summary="Reservoirs of the surroundings merged at each surface (k)",
            effect="More: less noise, more time, more of the bias of spatial reuse",
            needs="spatial_reuse",
            least=0,
            most=64,
            soft_most=16,
        ),
        Number(
            name="reuse_radius",
            label="Radius",
            summary="Distance from which reservoirs are taken, as a share of the picture's smaller side",
            effect="Larger: wider and fainter blotches, more bias at edges",
            needs="spatial_reuse",
            least=0.0,
            most=1.0,
            soft_most=1.0,
            unit="share",
        ),
        Whole(
            name="ascension",
            label="Ascension",
            summary="Levels climbed in the tree, below which reservoirs are taken (L); from its height on: all of it",
            effect="Few: the cells show as blocks; many: reservoirs from afar, which help little and leave noise",
            needs="spatial_reuse",
            least=0,
            most=1000,
            soft_most=30,
        ),
        Whole(
            name="grid_radius",
            label="Radius",
            summary="Distance in cells, along each axis, from which reservoirs are taken (L)",
            effect="Small: the cells show as blocks; large: reservoirs from afar, which help little and leave noise",
            needs="spatial_reuse",
            least=0,
            most=1000,
            soft_most=50,
        ),
        Choice(
            name="reuse_weights",
            label="Weights",
            summary="How merged reservoirs are weighed against each other",
            effect="Decides whether reuse is biased",
            choices=(
                (
                    "1/M",
                    "1/M",
                    "As the paper: quick, but biased: too dark, most along edges and shadow borders",
                ),
                (
                    "1/Z",
                    "1/Z",
                    "By the reservoirs that could have made the sample: less bias, more noise, with fireflies",
                ),
                ("mis", "MIS", "Balance weights: no bias and less noise than 1/Z, more time"),
            ),
        ),
        Choice(
            name="mis_weights",
            label="Weights",
            summary="How merged reservoirs are weighed against each other and the surface's own sample",
            effect="Changes noise and time only: both are unbiased",
            choices=(
                ("pairwise", "Pairwise", "Each reservoir against the surface's own sample, which always has a share"),
                ("balance", "Balance", "Each against all: less noise with few neighbors, time grows with their square"),
            ),
        ),
        Switch(
            name="visibility_reuse",
            label="Visibility Reuse",
            summary="Test the kept candidate for occlusion before others reuse it",
            effect="Less noise in shadows; biased: shadow borders and contacts come out too dark",
            automatic="On, but off with MIS weights, which it would make biased",
        ),
        Choice(
            name="empty_cells",
            label="Empty Cells",
            summary="What lights a surface where the reservoirs taken hold no sample",
            effect="Decides whether light is lost there",
            choices=(
                ("canonical", "Own Sample", "The surface's own light sample: noise, but no light is lost"),
                ("black", "Black", "Nothing, as the paper's code: black speckles, and a picture that is too dark"),
            ),
        ),
        Whole(
            name="points_per_leaf",
            label="Points per Leaf",
            summary="Surface points of the first pass that share a leaf of the tree",
            effect="More: larger cells that show more, filled sooner; less memory",
            section="cells",
            least=1,
            most=1 << 20,
            soft_most=64,
        ),
        Whole(
            name="grid_resolution",
            label="Resolution",
            summary="Cells of the grid along each axis",
            effect="More: smaller cells that show less but fill later; memory grows with its cube",
            section="cells",
            least=1,
            most=512,
            soft_most=256,
        ),
        Number(
            name="grid_extent",
            label="Extent",
            summary="Half the side of the grid around the camera",
            effect="Larger: reuse reaches farther, with larger cells at the same resolution",
            section="cells",
            least=1e-3,
            most=1e6,
            soft_most=1000.0,
            unit="metres",
        ),
        Choice(
            name="grid_follow",
            label="Follow",
            summary="What cells keep to when the camera moves",
            effect="Matters in animations only",
            section="cells",
            choices=(
                ("world", "World", "Cells stay where they are in the world and keep what they have learned"),
                ("camera", "Camera", "Cells ride along, as in the paper's code: light lags and smears in the picture"),
            ),
        ),
        Whole(
            name="cell_inputs",
            label="Inputs per Cell",
            summary="Samples that a cell takes in one pass over the picture; 0: all",
            effect="Fewer: less time where many pixels share a cell, and more noise there",
            section="cells",
            least=0,
            most=1 << 20,
            soft_most=1000,
        ),
        Whole(
            name="reservoirs_per_cell",
            label="Reservoirs per Cell",
            summary="Reservoirs in a leaf or cell, each for the samples nearest to it",
            effect="More: the cells show less but fill later; memory grows in proportion",
            section="cells",
            least=1,
            most=16,
            soft_most=16,
        ),
    )
}


@dataclass(frozen=True)
class Integrator:
    """An integrator, and the parameters it reads with their defaults, in the order in which panels show them: with the
    estimator `paper`, and with `unbiased`. Without the latter it has one estimator, whatever its name."""

    name: str
    label: str
    description: str
    defaults: dict
    unbiased: dict = field(default_factory=dict)

    def parameters(self, estimator: str) -> dict:
        """What it reads with an estimator, with defaults."""
        return self.unbiased if estimator == "unbiased" and self.unbiased else self.defaults

    def group(self, estimator: str) -> str:
        """Name of the property group in `scene.headwater` that holds its parameters with an estimator."""
        name = self.name.replace("-", "_")
        return name + "_unbiased" if estimator == "unbiased" and self.unbiased else name


_RESTIR = {
    "candidates": 32,
    "indirect_candidates": 8,
    "temporal_reuse": True,
    "history": 20,
    "spatial_reuse": True,
    "neighbours": 5,
    "reuse_radius": 0.1,
    "reuse_weights": "1/M",
    "visibility_reuse": True,
}
_WORLD = {
    "candidates": 1,
    "indirect_candidates": 1,
    "temporal_reuse": True,
    "history": 0,
    "spatial_reuse": True,
    "neighbours": 3,
}
_GRID = _WORLD | {
    "grid_radius": 10,
    "empty_cells": "canonical",
    "grid_resolution": 100,
    "grid_extent": 50.0,
    "grid_follow": "world",
    "cell_inputs": 100,
    "reservoirs_per_cell": 1,
}

_RESTIR_UNBIASED = {
    "candidates": 32,
    "indirect_candidates": 8,
    "temporal_reuse": False,
    "history": 20,
    "spatial_reuse": True,
    "neighbours": 5,
    "reuse_radius": 0.1,
    "mis_weights": "pairwise",
}
_WORLD_UNBIASED = {
    "candidates": 32,
    "indirect_candidates": 8,
    "temporal_reuse": False,
    "history": 20,
    "spatial_reuse": True,
    "neighbours": 5,
}
_GRID_UNBIASED = _WORLD_UNBIASED | {
    "grid_radius": 1,
    "mis_weights": "pairwise",
    "grid_resolution": 100,
    "grid_extent": 50.0,
    "reservoirs_per_cell": 1,
}

INTEGRATORS = {
    integrator.name: integrator
    for integrator in (
        Integrator(
            "path",
            "Path Tracing",
            "Light samples by a light tree and one bounce at each surface. Unbiased; the reference.",
            {"bounce_samples": 0, "light_samples": 1, "path_reuse": False},
        ),
        Integrator(
            "restir",
            "ReSTIR",
            "Reuses light samples of earlier passes and of nearby pixels at the first surface. Much cleaner under many "
            "lights; as the paper has it biased at edges.",
            _RESTIR,
            _RESTIR_UNBIASED,
        ),
        Integrator(
            "restir-reproject",
            "ReSTIR + Reprojection",
            "ReSTIR that also looks up the reservoirs of the picture for surfaces seen after a bounce.",
            _RESTIR | {"neighbours": 3},
            _RESTIR_UNBIASED | {"neighbours": 3},
        ),
        Integrator(
            "wssr-kd",
            "World-Space k-d Tree",
            "Keeps light samples in the leaves of a tree over the picture's surfaces, for every bounce. As the paper "
            "has it biased, with visible cells.",
            _WORLD | {"ascension": 10, "empty_cells": "canonical", "points_per_leaf": 1, "reservoirs_per_cell": 1},
            _WORLD_UNBIASED
            | {"ascension": 4, "mis_weights": "pairwise", "points_per_leaf": 4, "reservoirs_per_cell": 1},
        ),
        Integrator(
            "wssr-grid",
            "World-Space Grid",
            "Keeps light samples in a grid about the camera, for every bounce; no reuse beyond the grid. As the paper "
            "has it biased.",
            _GRID,
            _GRID_UNBIASED,
        ),
        Integrator(
            "wssr-grid-reproject",
            "World-Space Grid + Reprojection",
            "The grid, used also by surfaces beyond it through its nearest cells.",
            _GRID,
            _GRID_UNBIASED,
        ),
        Integrator(
            "wssr-hash",
            "World-Space Hash",
            "Learns in world space which lights arrive where, and samples those, at every bounce. Unbiased; path "
            "tracing where lights are few.",
            {"bounce_samples": 0, "light_samples": 4, "path_reuse": True, "reservoir_memory": 64},
        ),
    )
}
DEFAULT_INTEGRATOR = "wssr-hash"
ESTIMATORS = (
    ("paper", "Paper", "As the paper describes it, with its artefacts and its bias"),
    (
        "unbiased",
        "Unbiased",
        "With a light sample of its own at every surface and weights that sum to one: the same light as path tracing, "
        "at every bounce",
    ),
)


def readers(parameter: str, estimator: str = "") -> list[Integrator]:
    """The integrators that read the parameter: with an estimator, or with any."""
    estimators = (estimator,) if estimator else [name for name, _, _ in ESTIMATORS]
    return [each for each in INTEGRATORS.values() if any(parameter in each.parameters(name) for name in estimators)]
