# SPDX-License-Identifier: Apache-2.0
"""Frames of Tracers on the device: recorded ahead, in few submissions, with the same bits however they are cut."""

import statistics
import time

import core_scenes
import numpy as np
import pytest
import reuse_scenes as rs
from core_scenes import placed

pytestmark = pytest.mark.ray_query
TRACERS = ("ray_query", "ray_pipeline")
SHEET = 20


def sheet(scene, number=SHEET, share=0.75):
    """Upserts a material that lets a share of the light through, and scatters none."""
    rs.material(scene, number, lambda g, s: s.let_through(g.const(share)))


@pytest.fixture(scope="module")
def own_memory(core):
    """own_memory(tracer) -> Context that treats the device's memory as its own: staging, readback, no mapped queues."""
    contexts = {}

    def make(tracer):
        if tracer not in contexts:
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("HEADWATER_OWN_MEMORY", "1")
                contexts[tracer] = core.Context(tracer=tracer)
        return contexts[tracer]

    yield make
    contexts.clear()


@pytest.fixture(scope="module")
def lamps_and_sheets(core):
    """Lamps of every shape, glass, and sheets that cast coloured transparent shadows."""
    scene = core.Scene()
    rs.room(scene)
    rs.lamps(scene, 24)
    sheet(scene)
    for i, z in enumerate((0.9, 1.0, 1.1)):
        scene.upsert_instance(30 + i, 1, placed(0.2 * i, 0, z, scale=0.8, turn=0.3 * i), materials=[SHEET])
    return scene


@pytest.mark.parametrize("integrator", ["path", "restir", "wssr-kd", "wssr-grid-reproject"])
def test_the_same_bits_in_own_memory(core, make_context, own_memory, lamps_and_sheets, integrator):
    settings = {"samples": 3, "max_bounces": 2, "seed": 4, "tile_pixels": 192}
    contexts = [make(tracer) for tracer in TRACERS for make in (make_context, own_memory)]
    pictures = [rs.render(core, core.Session(c, lamps_and_sheets), integrator, **settings) for c in contexts]
    assert pictures[0].mean() > 0
    assert np.array_equal(pictures[0], pictures[1]) and np.array_equal(pictures[2], pictures[3])
    if contexts[0].device["kind"] == "cpu":  # lavapipe walks the structures of both in the same way
        assert np.array_equal(pictures[0], pictures[2])


@pytest.mark.parametrize("integrator", ["path", "restir", "wssr-grid"])
def test_a_frame_is_a_submission(own_memory, core, lamps_and_sheets, integrator):
    """Beside it: film emptied, root and lights' changes uploaded, picture fetched. Sixteen passes would be more."""
    session = core.Session(own_memory("ray_pipeline"), lamps_and_sheets)
    counts = []
    for frame in range(4):
        before = time.perf_counter()
        rs.render(core, session, integrator, samples=16, max_bounces=2, seed=frame, continue_history=frame > 0)
        stats = session.stats()
        assert stats["host_waits"] <= stats["submissions"]
        counts.append((stats["submissions"], time.perf_counter() - before))
    for submissions, seconds in counts[1:]:
        # A submission is cut at a tenth of a second: a busy machine stretches it.
        assert submissions <= 5 + 15 * seconds, counts


@pytest.mark.parametrize("limit", [8, 39, 64])
def test_more_transparent_bounces_than_are_recorded_ahead(core, make_context, own_memory, limit):
    """The sky through 40 sheets: all of it or nothing, as Embree has it, which is asked after every bounce."""
    scene = core.Scene()
    scene.upsert_mesh(1, "quad", core_scenes.QUAD, core_scenes.QUAD_TRIANGLES)
    sheet(scene, share=0.95)
    for i in range(40):
        scene.upsert_instance(1 + i, 1, placed(z=0.05 * i, scale=4), materials=[SHEET])
    scene.upsert_instance(50, 1, placed(x=5, z=-1, scale=4))  # and a shadow through them
    scene.upsert_light(1, "sun", "sun", core_scenes.EYE, power=2.0)
    scene.set_world("sky", (0.5, 1, 2))
    scene.set_camera("perspective", placed(z=4), (-0.7, 0.7, -0.7, 0.7))
    contexts = [make_context("embree"), make_context("ray_query"), own_memory("ray_query"), own_memory("ray_pipeline")]
    settings = {"size": 16, "samples": 4, "transparent_bounces": limit, "max_bounces": 2}
    embree, *device = [core_scenes.picture(core, c, scene, **settings)["Combined"][..., :3] for c in contexts]
    assert (embree.max() > 0) == (limit >= 39)
    for picture in device:
        assert np.allclose(picture, embree, rtol=1e-4, atol=1e-5)


def test_more_bounces_than_are_counted(core, make_context, own_memory):
    """Bounces without a bound, in a closed box of half-grey walls that glow: radiance 1 / (1 - 0.5)."""
    scene = core.Scene()
    scene.upsert_mesh(1, "quad", core_scenes.QUAD, core_scenes.QUAD_TRIANGLES)

    def add(g, s):
        rs.closures.add_diffuse(s, g.one, g.const(0.5), g.zero, g.normal)
        s.emit(g.one)
        return (1.0, 1.0, 1.0)

    rs.material(scene, 1, add)
    axes = np.eye(3)
    for k in range(3):
        for side in (-1, 1):
            x, y = axes[(k + 1) % 3], axes[(k + 2) % 3]
            scene.upsert_instance(1 + 2 * k + (side > 0), 1, rs.frame(x, y, axes[k], side * axes[k]), materials=[1])
    scene.set_camera("perspective", placed(), (-0.5, 0.5, -0.5, 0.5))
    bounces = {f"{kind}_bounces": 1024 for kind in ("max", "diffuse", "glossy", "transmission")}
    for context in (make_context("embree"), own_memory("ray_query")):
        picture = core_scenes.picture(core, context, scene, 16, samples=64, **bounces)["Combined"][..., :3]
        assert picture.mean() == pytest.approx(2.0, rel=0.02)


@pytest.mark.alone
@pytest.mark.parametrize("tracer", TRACERS)
def test_cancelled_in_half_a_second(core, own_memory, lamps_and_sheets, tracer):
    session = core.Session(own_memory(tracer), lamps_and_sheets)
    session.sync()
    seconds = []
    for wait in (0.4, 0.7, 1.0):
        session.start({"width": 640, "height": 360, "samples": 4096, "max_bounces": 32})
        time.sleep(wait)
        before = time.perf_counter()
        session.cancel()
        while not session.wait(5):
            pass
        seconds.append(time.perf_counter() - before)
        session.finish()
    assert statistics.median(seconds) <= 0.5, seconds
