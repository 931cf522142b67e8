# SPDX-License-Identifier: Apache-2.0
"""The paper's figures (SivaramWSSR in docs/references.bib) as data: which scene, which variants, how many samples.

Sample counts, bounces and the varied parameter are the captions'; what a variant does not name is the integrator's
default, the paper's section 5. The paper's scenes are not ours to ship: each figure has one of scenes/figures in its
place. What each figure claims is checked in claims.py.
"""

from dataclasses import dataclass, field

from headwater.errors import EXIT_USAGE, UserError


@dataclass(frozen=True)
class Variant:
    """One picture of a figure. `options` are options of `headwater render` without their dashes."""

    name: str  # unique in its figure; a file name
    label: str
    integrator: str
    options: dict = field(default_factory=dict)

    @property
    def rides(self) -> bool:
        """Whether its grid's cells ride with the camera."""
        return self.options.get("grid-follow") == "camera"

    def arguments(self) -> list:
        """What `headwater render` is to be told of this variant."""
        # Canonical samples of all variants choose lights uniformly, as the paper's code does.
        given = ["--integrator", self.integrator, "--lights", "uniform"]
        if self.integrator != "path":
            given += ["--estimator", "paper"]
        for name, value in self.options.items():
            given += [f"--{name}", str(value)]
        return given


@dataclass(frozen=True)
class Grid:
    """The grid whose boundary and cells a figure is about: half its side in metres, cells along each axis."""

    extent: float = 50.0
    resolution: int = 100


@dataclass(frozen=True)
class Figure:
    """One figure, or one part of one. Insets are (x, y, width, height) as parts of the picture, from its top left."""

    number: int
    part: str
    title: str
    caption: str  # the paper's
    scene: str  # of scenes/figures
    samples: int
    bounces: int
    variants: tuple
    insets: tuple
    grid: Grid | None = None

    @property
    def id(self) -> str:
        """ "4", "9a"."""
        return f"{self.number}{self.part}"


MONTE_CARLO = Variant("path", "Monte Carlo", "path")
RESTIR = Variant("restir", "ReSTIR", "restir")
KD = Variant("wssr-kd", "WSSR, k-d tree", "wssr-kd")
GRID = Variant("wssr-grid", "WSSR, grid", "wssr-grid")
# The paper names neither size nor resolution of its grid: in a room, one that just holds it, with cells of 28 cm.
ROOM_GRID = Variant("wssr-grid", "WSSR, grid", "wssr-grid", {"grid-extent": 14})
ROOM_INSETS = ((0.44, 0.58, 0.14, 0.16), (0.74, 0.30, 0.14, 0.16), (0.16, 0.36, 0.14, 0.16))
GARDEN_INSETS = ((0.42, 0.60, 0.14, 0.16), (0.14, 0.45, 0.14, 0.16), (0.70, 0.75, 0.14, 0.16))
TOWN_INSETS = ((0.42, 0.44, 0.14, 0.16), (0.44, 0.70, 0.14, 0.16), (0.76, 0.36, 0.14, 0.16))

FIGURES = (
    Figure(
        1,
        "",
        "Monte Carlo, ReSTIR and the two world-space algorithms",
        "Comparison of Monte Carlo with ReSTIR and our world space resampling algorithms "
        "(16 spp, direct lighting only)",
        "room",
        16,
        0,
        (MONTE_CARLO, RESTIR, KD, ROOM_GRID),
        ROOM_INSETS,
    ),
    Figure(
        3,
        "",
        "Spatio-temporal reuse off and on",
        "Effect of spatio-temporal reuse (bottom) in a scene with many lights and environment lighting "
        "(4 spp, direct lighting only)",
        "garden",
        4,
        0,
        (
            Variant("restir-off", "without reuse", "restir", {"temporal-reuse": "off", "spatial-reuse": "off"}),
            Variant("restir-on", "with reuse", "restir", {"temporal-reuse": "on", "spatial-reuse": "on"}),
        ),
        GARDEN_INSETS,
    ),
    Figure(
        4,
        "",
        "ReSTIR with reprojection of indirect hits",
        "Minor improvements in indirect lighting using reprojection (10 bounce, 16 spp)",
        "room",
        16,
        10,
        (RESTIR, Variant("restir-reproject", "ReSTIR + reprojection", "restir-reproject")),
        ROOM_INSETS,
    ),
    Figure(
        5,
        "",
        "The k-d tree: more significant samples, and quantisation",
        "While WSSR using k-d trees (bottom) indeed gathers more significant "
        "direct lighting samples than ReSTIR (top), "
        "it suffers from quantization artifacts (16 spp, direct lighting only)",
        "room",
        16,
        0,
        (RESTIR, KD, ROOM_GRID, MONTE_CARLO),
        ROOM_INSETS,
    ),
    Figure(
        6,
        "",
        'Spatial reuse of the k-d tree at varying "radii"',
        "(a) L = 1; High quantization  (b) L = 10; Best of both worlds  (c) L = 100; Low resampling rate",
        "room",
        16,
        0,
        tuple(Variant(f"ascension-{n}", f"L = {n}", "wssr-kd", {"ascension": n}) for n in (1, 10, 100)),
        ROOM_INSETS,
    ),
    Figure(
        7,
        "",
        "World-space reuse with a grid",
        "World Space Spatio-Temporal Reuse with Uniform Grids (16 spp, direct lighting only)",
        "room",
        16,
        0,
        (MONTE_CARLO, ROOM_GRID),
        ROOM_INSETS,
    ),
    Figure(
        8,
        "",
        "The grid, with positions beyond it projected onto it",
        "WSSR with Grids improved with reprojection (16 spp, direct lighting only)",
        "town",
        16,
        0,
        (GRID, Variant("wssr-grid-reproject", "WSSR, grid + reprojection", "wssr-grid-reproject")),
        TOWN_INSETS,
        Grid(),
    ),
    Figure(
        9,
        "a",
        "Limitations: quantisation of the k-d tree",
        "WSSR using k-d trees; yields visible quantization artifacts",
        "room",
        16,
        0,
        (Variant("ascension-1", "k-d tree, L = 1", "wssr-kd", {"ascension": 1}), MONTE_CARLO),
        ROOM_INSETS,
    ),
    Figure(
        9,
        "b",
        "Limitations: the grid's boundary and cell edges",
        "WSSR using grids; displays odd shading at boundaries of the grid as well as aliasing artifacts at cell edges",
        "town",
        16,
        0,
        (
            Variant(
                "grid-rides",
                "grid, riding, empty cells black",
                "wssr-grid",
                {"grid-follow": "camera", "empty-cells": "black"},
            ),
            Variant("grid-stays", "grid, canonical where empty", "wssr-grid"),
        ),
        TOWN_INSETS,
        Grid(),
    ),
)


def chosen(only) -> list:
    """The figures of the numbers `only` (None: all). Raises UserError for a number that is not in the table."""
    known = sorted({figure.number for figure in FIGURES})
    for number in only or ():
        if number not in known:
            raise UserError(
                f"--only: there is no figure {number}; choose from: {', '.join(map(str, known))}", EXIT_USAGE
            )
    return [figure for figure in FIGURES if not only or figure.number in only]
