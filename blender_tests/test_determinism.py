# SPDX-License-Identifier: Apache-2.0
"""Same seed, same bits: for any number of threads, any wave size, region or full frame, first or second session."""

import core_scenes
import numpy as np
import pytest

SIZE = 48


@pytest.fixture(scope="module")
def scene(core):
    return core_scenes.open_scene(core)


@pytest.fixture(scope="module")
def reference(core, make_context, tracer, scene):
    return core_scenes.picture(core, make_context(tracer), scene, SIZE, seed=7)


def assert_same_bits(test, reference):
    assert test.keys() == reference.keys() and len(test) == len(core_scenes.PASSES)
    for name, pixels in test.items():
        assert np.array_equal(pixels, reference[name]), f"{name}: {np.abs(pixels - reference[name]).max()}"


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads(core, make_context, tracer, scene, reference, threads):
    test = core_scenes.picture(core, make_context(tracer, threads=threads), scene, SIZE, seed=7)
    assert_same_bits(test, reference)


@pytest.mark.parametrize("tile_pixels", [100, 333, 2048])
def test_wave_sizes(core, make_context, tracer, scene, reference, tile_pixels):
    test = core_scenes.picture(core, make_context(tracer), scene, SIZE, seed=7, tile_pixels=tile_pixels)
    assert_same_bits(test, reference)


def test_region_of_the_frame(core, make_context, tracer, scene, reference):
    x0, y0, x1, y1 = region = (5, 11, 40, 30)
    test = core_scenes.picture(core, make_context(tracer), scene, SIZE, seed=7, region=region)
    assert_same_bits(test, {name: pixels[y0:y1, x0:x1] for name, pixels in reference.items()})


def test_one_session_twice_and_again_after_another_seed(core, make_context, tracer, scene, reference):
    session = core.Session(make_context(tracer), scene)
    first = core_scenes.picture(core, None, scene, SIZE, session, seed=7)
    other = core_scenes.picture(core, None, scene, SIZE, session, seed=8)
    again = core_scenes.picture(core, None, scene, SIZE, session, seed=7)
    assert_same_bits(first, reference)
    assert_same_bits(again, reference)
    assert not np.array_equal(other["Combined"], reference["Combined"]), "another seed, other noise"
    assert np.array_equal(other["Depth"], reference["Depth"]), "pixels' centres know no seed"
