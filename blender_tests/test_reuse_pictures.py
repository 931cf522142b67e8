# SPDX-License-Identifier: Apache-2.0
"""Reservoir integrators as estimators: unbiased where they say so, linear in the light, the same bits in any order."""

import numpy as np
import pytest
import reuse_scenes as rs
from reuse_scenes import INTEGRATORS, RESERVOIRS

from headwater.tile_test import tile_test


@pytest.fixture(scope="module")
def session(core, make_context):
    return core.Session(make_context(), rs.many_lights(core))


@pytest.fixture(scope="module")
def truth(core, session):
    """16 independent pictures of `path`, direct light, 256 samples."""
    return rs.renders(core, session, range(1000, 1016), samples=256)


@pytest.mark.parametrize(
    "settings",
    [
        {"temporal_reuse": False, "spatial_reuse": False, "visibility_reuse": False},
        {"reuse_weights": "mis", "temporal_reuse": False},
        {"reuse_weights": "mis", "history": 4},
        {"reuse_weights": "mis", "spatial_reuse": False},
    ],
    ids=["resampling alone", "mis spatial", "mis", "mis temporal"],
)
def test_unbiased(core, session, truth, settings):
    runs = rs.renders(core, session, range(64), "restir", samples=8, **settings)
    assert tile_test(runs, truth, 6).p_family > 1e-3
    means = np.array([run.mean() for run in runs])
    expected = np.array([picture.mean() for picture in truth])
    error = np.hypot(means.std(ddof=1) / 8, expected.std(ddof=1) / 4)
    assert abs(means.mean() - expected.mean()) < 4 * error, "the whole picture's mean"
    assert error < 0.01 * expected.mean(), "the test would see a bias of four percent"


def test_unbiased_after_bounces(core, session):
    expected = rs.renders(core, session, range(1000, 1012), samples=128, max_bounces=3)
    settings = {"samples": 8, "max_bounces": 3, "reuse_weights": "mis", "history": 4}
    for integrator in ("restir", "restir-reproject"):
        runs = rs.renders(core, session, range(48), integrator, **settings)
        assert tile_test(runs, expected, 9).p_family > 1e-3, integrator


def test_a_test_that_can_fail(core, session, truth):
    """The paper's weights are biased, and the same test sees it."""
    runs = rs.renders(core, session, range(64), "restir", samples=8, reuse_weights="1/M", visibility_reuse=True)
    assert tile_test(runs, truth, 6).p_family < 1e-3


def test_variance_falls_as_one_over_samples(core, session):
    counts = (2, 8, 32)
    variance = [
        np.stack(
            rs.renders(
                core, session, range(24), "restir", samples=n, reuse_weights="mis", temporal_reuse=False, neighbours=3
            )
        )
        .var(0, ddof=1)
        .mean()
        for n in counts
    ]
    slope = np.polyfit(np.log(counts), np.log(variance), 1)[0]
    assert -2.0 < slope < -0.9


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("bounces", [0, 3])
def test_linear_in_the_light(core, make_context, integrator, bounces):
    """Twice every emission, twice the picture: to the bit, as two is a power of two."""
    context = make_context()
    pictures = [
        rs.render(core, core.Session(context, rs.many_lights(core, factor)), integrator, samples=4, max_bounces=bounces)
        for factor in (1.0, 2.0)
    ]
    assert pictures[0].mean() > 0
    assert np.array_equal(pictures[1], 2 * pictures[0])


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_same_bits_for_any_tiles_and_threads(core, make_context, session, integrator):
    settings = {"samples": 3, "max_bounces": 2, "seed": 9}
    reference = rs.render(core, session, integrator, **settings)
    assert np.array_equal(rs.render(core, session, integrator, **settings), reference), "again"
    for tile_pixels in (64, 130):
        assert np.array_equal(rs.render(core, session, integrator, tile_pixels=tile_pixels, **settings), reference)
    for threads in (1, 3):
        other = core.Session(make_context(threads=threads), rs.many_lights(core))
        assert np.array_equal(rs.render(core, other, integrator, **settings), reference), threads


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_tracers_agree(core, make_context, tracer, session, integrator):
    settings = {"samples": 8, "max_bounces": 1}
    other = core.Session(make_context(tracer), rs.many_lights(core))
    runs = [rs.renders(core, s, range(8), integrator, **settings) for s in (session, other)]
    assert tile_test(*runs, 9).p_family > 1e-4


@pytest.mark.parametrize("integrator", RESERVOIRS)
@pytest.mark.parametrize("count", [0, 1, 4])
def test_few_lights_are_left_to_path(core, make_context, integrator, count):
    scene = core.Scene()
    rs.room(scene)
    rs.lamps(scene, count)
    session = core.Session(make_context(), scene)
    settings = {"samples": 4, "max_bounces": 2}
    assert np.array_equal(rs.render(core, session, integrator, **settings), rs.render(core, session, **settings))


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_memory_is_as_computed(core, session, integrator):
    rs.render(core, session, integrator, samples=1)
    expected = core.reservoir_bytes({"width": rs.WIDTH, "height": rs.HEIGHT, "integrator": integrator})
    held = session.stats()["reservoir_bytes"]
    # Pixels without a surface give the tree no points: it may be a level lower.
    assert 0.45 * expected < held <= 1.01 * expected if integrator == "wssr-kd" else abs(held / expected - 1) < 0.01


BAD = [
    ("restir", {"candidates": 0}, "candidates"),
    ("wssr-grid", {"grid_resolution": 0}, "grid_resolution"),
    ("wssr-kd", {"grid_radius": 3}, "grid_radius"),
    ("restir", {"reuse_weights": "2/M"}, "2/M"),
    ("wssr-kd", {"estimator": "none"}, "estimator"),
]


@pytest.mark.parametrize("integrator, settings, named", BAD)
def test_bad_parameters_are_named(core, session, integrator, settings, named):
    with pytest.raises(ValueError, match=named):
        rs.render(core, session, integrator, **settings)


EXTREMES = [
    ("restir", {"neighbours": 0}),
    ("restir-reproject", {"reuse_radius": 1.0}),
    ("wssr-kd", {"ascension": 1000}),
    ("wssr-kd", {"points_per_leaf": 1 << 20}),
    ("wssr-kd", {"neighbours": 0, "reservoirs_per_cell": 16}),
    ("wssr-grid", {"grid_resolution": 1}),
    ("wssr-grid", {"grid_extent": 0.01}),
    ("wssr-grid-reproject", {"grid_extent": 0.01, "grid_follow": "camera"}),
    ("wssr-grid", {"cell_inputs": 1, "reservoirs_per_cell": 4, "temporal_reuse": False}),
]


@pytest.mark.parametrize("integrator, settings", EXTREMES)
def test_extremes_give_pictures(core, session, truth, integrator, settings):
    picture = np.mean(rs.renders(core, session, range(8), integrator, samples=8, **settings), 0)
    assert np.isfinite(picture).all()
    assert 0.6 < picture.mean() / np.mean(truth) < 1.4


def test_black_cells_only_where_asked(core, session, truth):
    """The paper's code leaves surfaces black whose neighbours hold nothing: most, where cells are large."""
    asked, usual = (
        np.mean(rs.renders(core, session, range(16), "wssr-grid", empty_cells=what), 0)
        for what in ("black", "canonical")
    )
    assert asked.mean() < 0.75 * np.mean(truth)
    assert abs(usual.mean() / np.mean(truth) - 1) < 0.25
