# SPDX-License-Identifier: Apache-2.0
"""Reservoir integrators at their limits: a million lights, a camera inside an object, memory that does not suffice."""

import numpy as np
import pytest
import reuse_scenes as rs
from core_scenes import placed
from reuse_scenes import RESERVOIRS

COUNT = 1_000_000


@pytest.fixture(scope="module")
def swarm(core, make_context):
    """The room under a cloud of a million glowing triangles; `path`'s picture of it."""
    rng = np.random.default_rng(1)
    corner = rng.uniform((-1.9, -1.9, 1.5), (1.9, 1.9, 3.0), (COUNT, 1, 3))
    points = np.concatenate([corner, corner + rng.normal(size=(COUNT, 2, 3)) * 1e-3], 1).astype(np.float32)
    scene = core.Scene()
    rs.room(scene)
    rs.glowing(scene)
    scene.upsert_mesh(9, "swarm", points.reshape(-1, 3), np.arange(3 * COUNT, dtype=np.uint32).reshape(-1, 3))
    scene.upsert_instance(900, 9, placed(), name="swarm", materials=[rs.GLOW])
    session = core.Session(make_context(), scene)
    return session, rs.render(core, session, samples=64, max_bounces=1)


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_a_million_lights(core, swarm, integrator):
    session, expected = swarm
    picture = np.mean(rs.renders(core, session, range(8), integrator, samples=8, max_bounces=1), 0)
    assert session.sync()["lights"] == COUNT
    assert np.isfinite(picture).all() and abs(picture.mean() / expected.mean() - 1) < 0.25


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_camera_inside_an_object(core, make_context, integrator):
    scene = rs.many_lights(core)
    rs.camera(scene, eye=(-0.65, -0.05, 0.35), target=(0, 0, 0.35))
    session = core.Session(make_context(), scene)
    picture, expected = (
        np.mean(rs.renders(core, session, range(8), name, samples=16), 0) for name in (integrator, "path")
    )
    assert np.isfinite(picture).all() and abs(picture.mean() / expected.mean() - 1) < 0.4


def test_memory_that_does_not_suffice(core, make_context):
    context = make_context(threads=2)
    session = core.Session(context, rs.many_lights(core))
    before = rs.render(core, session, "path")
    context.set_memory_limit(context.memory + (32 << 20))
    with pytest.raises(core.OutOfMemory, match="reservoir cells"):
        rs.render(core, session, "wssr-grid", grid_resolution=200)
    context.set_memory_limit(0)
    assert np.array_equal(rs.render(core, session, "path"), before), "the session goes on"
