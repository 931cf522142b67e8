# SPDX-License-Identifier: Apache-2.0
"""Reservoirs over frames: samples follow their lights, and the past is kept where it is right."""

import numpy as np
import pytest
import reuse_scenes as rs
from core_scenes import placed
from reuse_scenes import RESERVOIRS

FIRST = 100  # id of the first lamp


class Animation:
    """A room under 24 lamps in one session; frame() renders the scene as it is now, going on from the frame before."""

    def __init__(self, core, context, integrator, **settings):
        self.core, self.integrator, self.settings = core, integrator, settings
        self.scene = core.Scene()
        rs.room(self.scene)
        rs.lamps(self.scene, 24, first=FIRST, mixed=False)
        self.session = core.Session(context, self.scene)
        self.frames = 0

    def lamp(self, number, x, y, power, z=1.5):
        self.scene.upsert_light(FIRST + number, f"lamp {number}", "point", placed(x, y, z), power=power)

    def frame(self, **settings):
        given = {"samples": 4, "seed": 3, **self.settings, **settings}
        made = rs.render(self.core, self.session, self.integrator, continue_history=self.frames > 0, **given)
        self.frames += 1
        return made

    def expected(self, seeds=8):
        return np.mean(rs.renders(self.core, self.session, range(seeds), samples=256), 0)


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_a_light_goes_out(core, make_context, integrator):
    """All lamps but dim ones go out: nothing of their light is left in the frame that they go out in."""
    animation = Animation(core, make_context(), integrator)
    for _ in range(3):
        before = animation.frame()
    for i in range(24):
        animation.lamp(i, 0.1 * i - 1.2, 0.3, 1e-3 if i >= 12 else 0.0)
    after = animation.frame()
    assert before.mean() > 0.1 and 0 < after.max() < 1e-3 * before.max()


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_a_light_comes_on(core, make_context, integrator):
    """The mean reaches its converged value within eight frames, under weights that old samples could make dark."""
    animation = Animation(core, make_context(), integrator, samples=2, visibility_reuse=False)
    if not integrator.startswith("restir"):
        del animation.settings["visibility_reuse"]
    animation.lamp(0, 0.3, -0.2, 0.0)
    for _ in range(4):
        dark = animation.frame()
    animation.lamp(0, 0.3, -0.2, 600.0)
    pictures = [animation.frame() for _ in range(10)]
    expected = animation.expected(2).mean()
    assert dark.mean() < 0.5 * expected
    late = np.mean(pictures[7:]) / expected
    steady = Animation(core, make_context(), integrator, **animation.settings)
    steady.lamp(0, 0.3, -0.2, 600.0)
    usual = np.mean([steady.frame() for _ in range(14)][11:]) / expected
    assert abs(late - usual) < 0.2, f"{late:.2f} of the expected light, {usual:.2f} where it was always on"


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_lights_come_and_go_before_others_in_the_table(core, make_context, integrator):
    """Places in the table shift; the light of those that stay does not."""
    animation = Animation(core, make_context(), integrator, samples=8)
    for _ in range(2):
        animation.frame()
    for i in range(0, 12):
        animation.scene.remove_light(FIRST + i)
    for i in range(3):
        animation.scene.upsert_light(
            10 + i, f"sun {i}", "sun", np.eye(4, dtype=np.float32)[:3].copy(), power=1e-6, angle=0.1
        )
    pictures = [animation.frame() for _ in range(6)]
    assert abs(np.mean(pictures[2:]) / animation.expected(2).mean() - 1) < 0.3


def test_a_moving_light_is_where_it_is(core, make_context):
    """One strong lamp jumps from one side of the room to the other: so does its light, in that frame."""
    animation = Animation(core, make_context(), "restir", reuse_weights="mis", samples=16)
    animation.lamp(0, -1.5, 0.0, 3000.0, z=0.6)
    for _ in range(2):
        left = animation.frame()
    animation.lamp(0, 1.5, 0.0, 3000.0, z=0.6)
    right = animation.frame()
    expected = animation.expected(2)
    half = rs.WIDTH // 2
    assert left[:, :half].mean() > 1.5 * left[:, half:].mean()
    assert abs(right[:, half:].mean() / expected[:, half:].mean() - 1) < 0.05
    assert abs(right[:, :half].mean() / expected[:, :half].mean() - 1) < 0.4, "a tenth of the other side's light"


@pytest.mark.parametrize("integrator", RESERVOIRS)
def test_what_ends_a_history(core, make_context, integrator):
    """A cut of the camera, another size, an earlier frame: correct pictures; a still repeats its bits."""
    animation = Animation(core, make_context(), integrator, samples=8)
    first = animation.frame()
    rs.camera(animation.scene, eye=(3.0, -2.5, 1.5))
    assert abs(animation.frame().mean() / animation.expected(2).mean() - 1) < 0.35, "after a cut"
    wide = animation.frame(width=2 * rs.WIDTH, height=2 * rs.HEIGHT)
    assert np.isfinite(wide).all() and abs(wide.mean() / animation.expected(2).mean() - 1) < 0.35, "another size"
    rs.camera(animation.scene)
    assert abs(animation.frame().mean() / first.mean() - 1) < 0.3, "backwards"
    animation.frames = 0
    assert np.array_equal(animation.frame(), first), "a still"


def test_a_cancelled_frame_leaves_the_next_one_right(core, make_context):
    animation = Animation(core, make_context(), "wssr-grid", samples=8)
    animation.frame()
    session = animation.session
    session.start(
        {"width": 256, "height": 144, "samples": 1000, "max_bounces": 0, "integrator": "wssr-grid",
         "continue_history": True, "passes": ["Combined"]}
    )  # fmt: skip
    session.wait(200)
    session.cancel()
    session.finish()
    assert abs(animation.frame().mean() / animation.expected(2).mean() - 1) < 0.3
