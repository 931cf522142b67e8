# SPDX-License-Identifier: Apache-2.0
"""The estimator `unbiased` of the reservoir integrators: the light of `path`, at every bounce and on every Tracer; an
error that falls as that of independent samples; the same bits in any order; lights and scenes at their limits.

Biased pictures with little noise pass tests of means on few seeds: the tests ask for the precision they claim, and
test_the_papers_estimator_is_seen shows that they would see a bias."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes as rs
from core_scenes import placed
from expectation import agreement, assert_same_light
from reuse_scenes import RESERVOIRS

GRID = {"grid_resolution": 24, "grid_extent": 3.0}


def settings_of(integrator, **settings):
    """Settings of an unbiased render; grids of cells as small as the test scenes' surfaces."""
    return {"estimator": "unbiased", **(GRID if "grid" in integrator else {}), **settings}


@pytest.fixture(scope="module")
def session(core, make_context):
    return core.Session(make_context(), rs.many_lights(core))


@pytest.fixture(scope="module")
def truths(core, session):
    """{bounces: independent pictures of `path`}."""
    return {
        0: rs.renders(core, session, range(1000, 1016), samples=256),
        4: rs.renders(core, session, range(1000, 1016), samples=96, max_bounces=4),
    }


@pytest.mark.parametrize("bounces", [0, 4])
@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_same_light_as_path(core, make_context, tracer, truths, integrator, bounces):
    """Under 41 lights of every kind, some behind things, on matte, glossy and clear surfaces."""
    session = core.Session(make_context(tracer), rs.many_lights(core))
    runs = rs.renders(core, session, range(36), integrator, **settings_of(integrator, samples=6, max_bounces=bounces))
    assert_same_light(runs, truths[bounces], 2.5)


@pytest.mark.parametrize(
    "integrator, settings",
    [
        ("restir-reproject", {"mis_weights": "balance"}),
        ("wssr-kd", {"mis_weights": "balance", "points_per_leaf": 1, "ascension": 20}),
        ("wssr-grid", {"mis_weights": "balance", "reservoirs_per_cell": 3}),
        ("wssr-grid-reproject", {"grid_extent": 0.7, "neighbours": 8}),  # most surfaces lie outside
        ("wssr-kd", {"temporal_reuse": True, "history": 3}),
        ("wssr-grid", {"temporal_reuse": True, "history": 3, "neighbours": 1}),
    ],
)
def test_same_light_however_it_is_weighed(core, session, truths, integrator, settings):
    given = settings_of(integrator, samples=6, max_bounces=4, **settings)
    assert_same_light(rs.renders(core, session, range(40), integrator, **given), truths[4], 4)


def test_the_papers_estimator_is_seen(core, session, truths):
    runs = rs.renders(core, session, range(64), "restir", samples=8)
    assert agreement(runs, truths[0]).p < 1e-3


@pytest.mark.parametrize("integrator", ["restir", "wssr-kd", "wssr-grid"])
def test_variance_falls_as_one_over_samples(core, session, integrator):
    """No plateau: a pass knows of the one before it and of none before that."""
    counts = (2, 8, 32)
    variance = [
        np.stack(rs.renders(core, session, range(16), integrator, **settings_of(integrator, samples=n)))
        .var(0, ddof=1)
        .mean()
        for n in counts
    ]
    slope = np.polyfit(np.log(counts), np.log(variance), 1)[0]
    assert -1.6 < slope < -0.9


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_direct_light_is_the_sum_over_the_lamps(core, make_context, integrator):
    """Twelve lamps over a matte square, each cut off by a screen from a part of it: every pixel against a loop over
    lamps in double precision."""
    scene = core.Scene()
    albedo = np.array([0.7, 0.5, 0.2])
    rs.matte(scene, albedo=tuple(albedo))
    scene.upsert_mesh(1, "quad", core_scenes.QUAD, core_scenes.QUAD_TRIANGLES)
    scene.upsert_instance(1, 1, placed(), materials=[rs.MATTE])
    screen = np.array([0.15, 0.1, 0.3])
    scene.upsert_instance(2, 1, placed(*screen, scale=0.2), materials=[rs.MATTE])
    rng = np.random.default_rng(4)
    lamps = [((*rng.uniform(-1, 1, 2), rng.uniform(0.6, 2.2)), rng.uniform(1, 30)) for _ in range(12)]
    for i, (place, power) in enumerate(lamps):
        scene.upsert_light(i + 1, f"lamp {i}", "point", placed(*place), power=power)
    scene.set_camera("orthographic", placed(z=3), (-1, 1, -1, 1))
    size = 24
    session = core.Session(make_context(), scene)
    made = rs.render(core, session, integrator, width=size, height=size, filter="BOX", filter_width=0.01,
                     **settings_of(integrator, samples=192))  # fmt: skip
    centres = (np.arange(size) + 0.5) / size * 2 - 1
    P = np.stack([*np.meshgrid(centres, centres), np.zeros((size, size))], -1)
    on_top = np.abs(P[..., :2] - screen[:2]).max(-1) < 0.2
    P[on_top, 2] = screen[2]
    expected = np.zeros((size, size, 3))
    edge = np.abs(np.abs(P[..., :2] - screen[:2]).max(-1) - 0.2) < 0.02
    for place, power in lamps:
        to = np.array(place) - P
        distance2 = (to**2).sum(-1)
        crossing = P + to * ((screen[2] - P[..., 2]) / to[..., 2])[..., None]
        reach = np.abs(crossing[..., :2] - screen[:2]).max(-1)
        edge |= ~on_top & (np.abs(reach - 0.2) < 0.01)
        light = (on_top | (reach > 0.2)) * to[..., 2] / distance2**1.5 * power / (4 * np.pi)
        expected += light[..., None] * albedo / np.pi
    assert (~edge).mean() > 0.4
    error = made[~edge] / expected[~edge] - 1
    assert abs(error.mean()) < 0.004
    assert np.sqrt((error**2).mean()) < 0.06


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_linear_and_the_same_bits(core, make_context, session, integrator):
    """Twice every emission, twice the picture, to the bit; the same bits again, for any tiles and threads."""
    settings = settings_of(integrator, samples=3, max_bounces=4, seed=9)
    reference = rs.render(core, session, integrator, **settings)
    assert reference.mean() > 0
    bright = core.Session(make_context(), rs.many_lights(core, 2.0))
    assert np.array_equal(rs.render(core, bright, integrator, **settings), 2 * reference)
    for tile_pixels in (0, 64, 130):
        again = rs.render(core, session, integrator, tile_pixels=tile_pixels, **settings)
        assert np.array_equal(again, reference)
    for threads in (1, 3):
        other = core.Session(make_context(threads=threads), rs.many_lights(core))
        assert np.array_equal(rs.render(core, other, integrator, **settings), reference), threads


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_memory_is_as_computed(core, session, integrator):
    settings = settings_of(integrator)
    rs.render(core, session, integrator, **settings)
    expected = core.reservoir_bytes({"width": rs.WIDTH, "height": rs.HEIGHT, "integrator": integrator, **settings})
    held = session.stats()["reservoir_bytes"]
    # Pixels without a surface give the tree no points: it may be a level lower.
    assert 0.45 * expected < held <= 1.01 * expected if integrator == "wssr-kd" else abs(held / expected - 1) < 0.01


# Frames that change


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_frames_have_the_light_of_their_scene(core, make_context, integrator):
    """A camera that goes round, a box that moves, lamps that move, come on and go out: each frame's mean is its own.
    After a cut to another place too."""
    scene = rs.many_lights(core)
    session = core.Session(make_context(), scene)
    settings = settings_of(integrator, samples=12, max_bounces=1)
    if integrator == "restir":
        settings |= {"temporal_reuse": True, "history": 4}
    ratios = []
    for number in range(8):
        turn = 0.15 * number if number < 6 else 2.5
        rs.camera(scene, eye=(4.2 * np.sin(turn), -4.2 * np.cos(turn), 2.4), target=(0, 0, 0.5))
        scene.upsert_instance(5, 1, placed(-0.65 + 0.2 * number, -0.2, 0.35, 0.3), name="box", materials=[rs.MATTE])
        if number >= 3:  # before, lights stay and records live on
            power = 0.0 if number == 4 else 400.0
            scene.upsert_light(100, "lamp 0", "point", placed(0.3 * number - 1, 0.5, 1.5), power=power)
        made = rs.render(core, session, integrator, seed=number, continue_history=number > 0, **settings)
        expected = rs.render(core, core.Session(make_context(), scene), samples=384, max_bounces=1)
        ratios.append(made.mean() / expected.mean())
    assert np.abs(np.array(ratios) - 1).max() < 0.06, ratios
    assert abs(np.mean(ratios) - 1) < 0.015, ratios


# Lights that are bad or extreme


def swarm(core, count, scale, spread):
    """The room under `count` glowing triangles of size `scale` in a cloud of size `spread`."""
    scene = core.Scene()
    rs.room(scene)
    rs.glowing(scene, radiance=(30.0, 20.0, 10.0))
    rng = np.random.default_rng(1)
    corner = (0.3, -0.5, 1.0) + rng.uniform(-spread, spread, (count, 1, 3))
    points = np.concatenate([corner, corner + rng.normal(size=(count, 2, 3)) * scale], 1).astype(np.float32)
    scene.upsert_mesh(9, "swarm", points.reshape(-1, 3), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3))
    scene.upsert_instance(900, 9, placed(), name="swarm", materials=[rs.GLOW])
    return scene


def lights_in_one_cell(core):
    return swarm(core, 100_000, 1e-3, 0.1)


def lights_below_a_pixel(core):
    return swarm(core, 40, 2e-3, 1.0)


def light_that_covers_everything(core):
    scene = rs.many_lights(core)
    scene.upsert_light(90, "all round", "point", placed(0, 0, 0), power=4000.0, radius=20.0)
    scene.upsert_light(91, "ceiling", "area", placed(0, 0, 3), power=2000.0, size_x=200.0, size_y=200.0)
    return scene


def lights_of_no_and_negative_power(core):
    scene = rs.many_lights(core)
    for i, power in enumerate((0.0, -0.0, -50.0, 1e-38)):
        scene.upsert_light(90 + i, f"dark {i}", "point", placed(0.2 * i, 0, 1), power=power, radius=0.1 * (i % 2))
    return scene


@pytest.mark.parametrize(
    "make, percent",
    [
        (lights_in_one_cell, 15),
        (lights_below_a_pixel, 25),
        (light_that_covers_everything, 15),
        (lights_of_no_and_negative_power, 10),
    ],
)
def test_extreme_lights(core, make_context, make, percent):
    session = core.Session(make_context(), make(core))
    truth = rs.renders(core, session, range(1000, 1006), samples=128)
    for integrator in RESERVOIRS[::2]:
        runs = rs.renders(core, session, range(16), integrator, **settings_of(integrator, samples=8))
        assert np.isfinite(runs).all()
        means, expected = (np.array([picture.mean() for picture in pictures]) for pictures in (runs, truth))
        error = np.hypot(means.std(ddof=1) / 4, expected.std(ddof=1) / 6**0.5)
        assert abs(means.mean() - expected.mean()) < max(4 * error, 0.002 * abs(expected.mean()))
        assert 4 * error < percent / 100 * expected.mean(), integrator


@pytest.mark.parametrize("power", [float("nan"), float("inf"), float("-inf")])
def test_a_power_that_is_no_number_is_refused(core, power):
    scene = rs.many_lights(core)
    with pytest.raises(ValueError, match="lamp 0.*power"):
        scene.upsert_light(100, "lamp 0", "point", placed(0, 0, 1), power=power)


BAD = [
    ("restir", {"reuse_weights": "mis"}, "reuse_weights"),
    ("restir", {"visibility_reuse": True}, "visibility_reuse"),
    ("wssr-kd", {"empty_cells": "canonical"}, "empty_cells"),
    ("wssr-grid", {"cell_inputs": 10}, "cell_inputs"),
    ("wssr-grid", {"mis_weights": "1/M"}, "mis_weights"),
    ("wssr-kd", {"history": 0}, "history"),
]


@pytest.mark.parametrize("integrator, settings, named", BAD)
def test_what_would_bias_is_refused(core, session, integrator, settings, named):
    with pytest.raises(ValueError, match=named):
        rs.render(core, session, integrator, estimator="unbiased", **settings)
