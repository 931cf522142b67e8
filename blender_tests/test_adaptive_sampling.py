# SPDX-License-Identifier: Apache-2.0
"""Adaptive sampling on a device: the light of plain sampling, in every pass, with fewer rays; the same bits however it
is cut into waves; an early end where that was asked for."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes
from expectation import assert_same_light

SIZE = 34  # no multiple of a block's side
ADAPTIVE = {"adaptive_sampling": True}


@pytest.fixture(scope="module")
def session(core, make_context, tracer):
    return core.Session(make_context(tracer), reuse_scenes.many_lights(core))


def picture(core, session, **settings):
    return core_scenes.picture(core, None, None, SIZE, session, **{"max_bounces": 1, "samples": 16} | settings)


@pytest.mark.parametrize("integrator", ["path", "wssr-hash"])
def test_light_is_that_of_plain_sampling(core, session, integrator):
    runs, truth = (
        [picture(core, session, integrator=integrator, seed=seed, **given)["Combined"][..., :3] for seed in seeds]
        for given, seeds in ((ADAPTIVE, range(100, 116)), ({}, range(16)))
    )
    assert_same_light(runs, truth, 5)


def test_fewer_rays_for_about_the_same_noise(core, session):
    errors, rays = [], []
    truth = picture(core, session, seed=99, samples=256)["Combined"][..., :3]
    for given in ({}, ADAPTIVE):
        pictures = [picture(core, session, seed=seed, samples=32, **given)["Combined"][..., :3] for seed in range(4)]
        rays.append(session.progress()["rays"])
        errors.append(np.mean([((p - truth) ** 2 / (truth**2 + 0.01)).mean() for p in pictures]))
    assert rays[1] < 0.98 * rays[0]
    assert errors[1] < 1.5 * errors[0]


def test_bits_do_not_depend_on_waves(core, session):
    first = picture(core, session, seed=5, samples=7, **ADAPTIVE)
    for tile_pixels in (100, 512):
        again = picture(core, session, seed=5, samples=7, tile_pixels=tile_pixels, **ADAPTIVE)
        for name, pixels in first.items():
            assert np.array_equal(pixels, again[name]), name


def test_data_passes_are_those_of_plain_sampling(core, session):
    plain, adaptive = (picture(core, session, seed=5, samples=12, **given) for given in ({}, ADAPTIVE))
    for name in ("Depth", "Position", "Object Index"):
        assert np.array_equal(plain[name], adaptive[name]), name
    assert np.allclose(adaptive["Combined"][..., 3].mean(), plain["Combined"][..., 3].mean(), atol=0.01)


def test_two_samples_are_plain_ones(core, session):
    plain, adaptive = (picture(core, session, seed=5, samples=2, **given) for given in ({}, ADAPTIVE))
    for name, pixels in plain.items():
        assert np.allclose(pixels, adaptive[name], rtol=1e-5, atol=1e-6), name


def test_the_threshold_ends_a_render(core, session):
    picture(core, session, samples=256, noise_threshold=1.0, adaptive_min_samples=8, **ADAPTIVE)
    assert session.progress()["sample"] == 8
    picture(core, session, samples=16, noise_threshold=1e-6, **ADAPTIVE)
    assert session.progress()["sample"] == 16
    with pytest.raises(ValueError, match="noise threshold"):
        picture(core, session, noise_threshold=-1.0, **ADAPTIVE)


def test_integrators_that_reuse_pixels_take_all_samples(core, session):
    plain, asked = (picture(core, session, integrator="restir", samples=2, **given) for given in ({}, ADAPTIVE))
    assert np.array_equal(plain["Combined"], asked["Combined"])
