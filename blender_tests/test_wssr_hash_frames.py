# SPDX-License-Identifier: Apache-2.0
"""`wssr-hash` in renders that go on from others: what its cells keep decides how random numbers are used, so that it
must come of other numbers, and of the lights as they are now. In parts of pictures and in films that go on, too.

The scene is made to show it: every pixel looks at a step of its own height, and so has cells that no other pixel asks.
What a cell learns from its one pixel is then as far from an average as it can be.
"""

import core_scenes
import numpy as np
import pytest
import reuse_scenes
from expectation import agreement

SIDE = 8  # pixels
SUNS = 16
STEP = 4.0  # between heights [m]; cells are 2 m wide


def sun(scene, number, azimuth, elevation):
    """A sun in that direction [rad]."""
    towards = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    matrix = reuse_scenes.looking(towards, (0, 0, 0))
    scene.upsert_light(100 + number, f"sun {number}", "sun", matrix, power=1.0, angle=0.02)


def suns(scene, up=1.0):
    """Suns all around, at heights that differ; up: -1 puts them below the ground."""
    for i in range(SUNS):
        sun(scene, i, 2 * np.pi * (i + 0.5) / SUNS, up * (0.4 + 0.03 * i))


def steps(core):
    """A small square in every pixel, each at its own height, beside a wall that hides half of the suns."""
    scene = core.Scene()
    reuse_scenes.matte(scene)
    scene.upsert_mesh(1, "quad", core_scenes.QUAD, core_scenes.QUAD_TRIANGLES)
    for i in range(SIDE * SIDE):
        x, y = 0.1 * (i % SIDE - SIDE / 2 + 0.5), 0.1 * (i // SIDE - SIDE / 2 + 0.5)
        scene.upsert_instance(1 + i, 1, core_scenes.placed(x, y, STEP * i, 0.05), materials=[reuse_scenes.MATTE])
    wall = reuse_scenes.frame((0, 900, 0), (0, 0, 900), (1, 0, 0), (0.6, 0, 0))
    scene.upsert_instance(1000, 1, wall, name="wall", materials=[reuse_scenes.MATTE])
    suns(scene)
    half = 0.05 * SIDE
    scene.set_camera("orthographic", core_scenes.placed(z=STEP * SIDE**2 + 10), (-half, half, -half, half))
    return scene


def picture(core, session, integrator="wssr-hash", **settings):
    given = {"width": SIDE, "height": SIDE, "reservoir_memory": 4, "light_samples": 1} if integrator != "path" else {}
    given = {"width": SIDE, "height": SIDE, "filter": "BOX", "filter_width": 0.1, **given, **settings}
    return reuse_scenes.render(core, session, integrator, **given)


def assert_light_of(runs, truth, seen):
    """As many pictures, whose pixels have the light of the truth's; seen: the bias that would be noticed."""
    found = agreement(runs, truth, tiles=2)
    assert found.seen < seen, f"the test would not see a bias: {found}"
    assert found.holds, found


@pytest.fixture(scope="module")
def session(core, make_context):
    return core.Session(make_context(), steps(core))


@pytest.fixture(scope="module")
def truth(core, session):
    """Light of the steps under their suns."""
    return [picture(core, session, "path", seed=10_000 + s, samples=256) for s in range(8)]


def test_frames_of_one_seed_are_independent(core, session, truth):
    """An animation whose seed is not animated: cells must not know what this very number brought in the last frame."""
    runs = []
    for seed in range(60):
        frames = [picture(core, session, seed=seed, samples=4, continue_history=frame > 0) for frame in range(7)]
        runs.append(frames[-1])
    assert_light_of(runs, truth, 0.04)


def test_a_film_that_goes_on(core, session, truth):
    """Resumed thrice, and once in another frame's session: every part draws from what the parts before it taught."""
    runs = []
    for seed in range(80):
        for samples in (1, 2, 4):
            last = picture(
                core, session, seed=seed, samples=samples, resume=samples > 1, continue_history=seed % 2 == 0
            )
        runs.append(last)
    assert_light_of(runs, truth, 0.06)


def test_parts_of_the_picture(core, session, truth):
    """A region renders the light of its part of the whole."""
    part = (2, 3, 7, 6)
    runs = [picture(core, session, seed=s, samples=2, region=part) for s in range(240)]
    assert runs[0].shape[:2] == (3, 5)
    assert_light_of(runs, [t[3:6, 2:7] for t in truth], 0.06)


def test_lights_that_turn_are_found_at_once(core, make_context):
    """Suns that shone from below now shine from above: cells that held them for hidden know better in that frame."""
    scene = steps(core)
    session = core.Session(make_context(), scene)
    truth = [picture(core, session, "path", seed=10_000 + s, samples=256) for s in range(8)]
    runs = []
    for seed in range(60):
        suns(scene, up=-1.0)
        dark = picture(core, session, seed=seed, samples=2)
        assert not dark.any()
        suns(scene)
        runs.append(picture(core, session, seed=seed, samples=1, continue_history=True))
    assert_light_of(runs, truth, 0.1)


def test_a_picture_of_path_between_two_frames_leaves_knowledge_alone(core, make_context):
    """As the motion to the next frame is rendered, where the Vector pass is asked for."""
    scene = reuse_scenes.many_lights(core)

    def second(*between):
        session = core.Session(make_context(), scene)
        given = {"integrator": "wssr-hash", "samples": 2, "passes": ["Combined"]}
        core_scenes.picture(core, None, None, 32, session, **given)
        for settings in between:
            core_scenes.picture(core, None, None, 32, session, passes=["Vector"], samples=1, **settings)
        return core_scenes.picture(core, None, None, 32, session, continue_history=True, **given)["Combined"]

    alone = second()
    assert np.array_equal(second({"integrator": "path", "continue_history": True}), alone)
    assert not np.array_equal(second({"integrator": "path"}), alone)
