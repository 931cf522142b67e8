# SPDX-License-Identifier: Apache-2.0
"""Kernels that read by texel where all buffers lie in one window (core/gpu/memory_window.cpp): the same bits as by
address, and by address again once a buffer found no place."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes


@pytest.fixture(scope="module")
def contexts():
    """Those of no window and of a large one, kept: kernels take long to make."""
    kept = {}
    yield kept
    kept.clear()


@pytest.fixture
def render(core, monkeypatch, contexts):
    def render(window, scene, **settings):
        monkeypatch.setenv("HEADWATER_MEMORY_WINDOW", str(window))
        context = contexts.get(window) or core.Context(tracer="embree")
        if window in (0, 512):
            contexts[window] = context
        session = core.Session(context, scene)
        passes = core_scenes.picture(core, None, None, 32, session, **settings)
        return passes, session.stats()["memory"]["window"]

    return render


@pytest.mark.parametrize("integrator", ["path", "restir", "wssr-kd", "wssr-hash"])
def test_the_same_bits_by_texel_and_by_address(core, render, integrator):
    given = {"integrator": integrator, "samples": 2}
    if integrator == "wssr-hash":
        given["reservoir_memory"] = 8
    scene = reuse_scenes.many_lights(core)
    by_address, none = render(0, scene, **given)
    by_texel, whole = render(512, scene, **given)
    assert whole and not none, "both ways must have been tried"
    for name in by_address:
        assert np.array_equal(by_address[name], by_texel[name]), name


@pytest.mark.parametrize("window", [1, 9, 13])
def test_a_window_that_is_too_small_changes_nothing(core, render, window):
    """Whether it is the scene, the wave or, last, the cells of an integrator that find no place."""
    given = {"integrator": "wssr-hash", "reservoir_memory": 8, "samples": 2}
    scene = core_scenes.open_scene(core)
    reuse_scenes.lamps(scene, 12)
    by_address, _ = render(0, scene, **given)
    full, whole = render(window, scene, **given)
    assert not whole
    for name in by_address:
        assert np.array_equal(by_address[name], full[name]), name


def test_frames_after_a_full_window_go_on(core, monkeypatch):
    """A mesh that is added between frames ends the window: kernels of the frames before are not used again."""
    monkeypatch.setenv("HEADWATER_MEMORY_WINDOW", "40")
    scene = core_scenes.open_scene(core)
    session = core.Session(core.Context(tracer="embree"), scene)
    core_scenes.picture(core, None, None, 32, session, samples=2)
    assert session.stats()["memory"]["window"]
    big = np.random.default_rng(1).uniform(-1, 1, (3_000_000, 3)).astype(np.float32)
    scene.upsert_mesh(77, "dust", big, np.arange(len(big), dtype=np.uint32).reshape(-1, 3))
    after = core_scenes.picture(core, None, None, 32, session, samples=2)
    assert not session.stats()["memory"]["window"]
    monkeypatch.setenv("HEADWATER_MEMORY_WINDOW", "0")
    alone = core_scenes.picture(core, core.Context(tracer="embree"), scene, 32, samples=2)
    for name in alone:
        assert np.array_equal(after[name], alone[name]), name
