# SPDX-License-Identifier: Apache-2.0
"""Several paths that go on from the first surface: the light of one, in every pass; less noise where bounces differ."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes
from core_scenes import QUAD, QUAD_TRIANGLES, placed
from expectation import assert_same_light
from reuse_scenes import MATTE

from headwater.materials import closures

MIRROR, VEIL = 11, 12
LIGHT = ("Diffuse Direct", "Diffuse Indirect", "Glossy Direct", "Glossy Indirect", "Transmission Direct", "Emission")


def rich_room(core):
    """Matte, glossy, rough glass, a mirror, a sheet that lets half straight through, a glow, a sky."""
    scene = core.Scene()
    reuse_scenes.room(scene)
    reuse_scenes.material(
        scene,
        MIRROR,
        lambda g, s: closures.add_glossy(s, g.one, g.const(0.9), g.zero, g.zero, g.zero, g.normal, g.zero, 0),
    )

    def veil(g, s):
        s.let_through(g.const(0.5))
        closures.add_diffuse(s, g.const(0.5), g.const(0.2, 0.7, 0.3), g.zero, g.normal)

    reuse_scenes.material(scene, VEIL, veil)
    scene.upsert_instance(
        6, 1, reuse_scenes.frame((0.4, 0, 0), (0, 0.1, 0.4), (0, -1, 0), (0.1, -0.9, 0.5)), materials=[MIRROR]
    )
    scene.upsert_instance(
        7, 1, reuse_scenes.frame((0.4, 0, 0), (0, 0, 0.4), (0, -1, 0), (-0.3, -1.2, 0.4)), materials=[VEIL]
    )
    reuse_scenes.lamps(scene, 12, 0.5)
    reuse_scenes.glowing_quads(scene, 3)
    scene.set_world("sky", (0.2, 0.25, 0.3))
    return scene


def pictures(core, session, seeds, **given):
    """{pass: (seeds, H, W, channels)}"""
    found = [core_scenes.picture(core, None, None, 24, session, seed=int(seed), **given) for seed in seeds]
    return {name: np.stack([f[name] for f in found]) for name in found[0]}


@pytest.mark.parametrize("integrator", ["path", "wssr-hash"])
def test_every_pass_has_the_light_of_one_path(core, make_context, integrator):
    session = core.Session(make_context(), rich_room(core))
    given = {
        "max_bounces": 3,
        "transparent_film": True,
        "passes": ["Combined", "Denoising Albedo", *LIGHT],
        "samples": 8,
    }
    one = pictures(core, session, range(24), integrator="path", bounce_samples=1, **given)
    more = pictures(core, session, range(100, 124), integrator=integrator, bounce_samples=3, **given)
    for name in one:
        if one[name].any():
            assert_same_light(more[name], one[name], 40, tiles=4)


def test_clamped_light_is_clamped_alike(core, make_context):
    """The bound is on what a whole path brings, whichever share of the sample it has. Not of direct light, of which
    split paths find another share."""
    session = core.Session(make_context(), rich_room(core))
    given = {"samples": 16, "max_bounces": 3, "clamp_indirect": 0.1, "passes": ["Combined"]}
    one = pictures(core, session, range(24), integrator="path", bounce_samples=1, **given)["Combined"][..., :3]
    more = pictures(core, session, range(50, 74), integrator="path", bounce_samples=4, **given)["Combined"][..., :3]
    assert_same_light(more, one, 10, tiles=4)


def test_what_the_camera_sees_is_the_same_to_the_bit(core, make_context):
    """Data passes are of the camera's path, which is not split."""
    session = core.Session(make_context(), rich_room(core))
    one = core_scenes.picture(core, None, None, 32, session, integrator="path", bounce_samples=1)
    more = core_scenes.picture(core, None, None, 32, session, integrator="path", bounce_samples=5)
    for name in core_scenes.PASSES[1:]:
        assert np.array_equal(one[name], more[name]), name


def test_the_same_bits_for_any_tiles_of_split_paths(core, make_context):
    scene = rich_room(core)
    given = {"samples": 3, "max_bounces": 3, "integrator": "wssr-hash", "passes": ["Combined"]}
    once = core_scenes.picture(core, make_context(), scene, 24, bounce_samples=3, **given)["Combined"]
    session = core.Session(make_context(threads=3), scene)
    for tile in (64, 192):
        again = core_scenes.picture(core, None, None, 24, session, bounce_samples=3, tile_pixels=tile, **given)
        assert np.array_equal(once, again["Combined"])


def lit_by_bounces(core):
    """A closed box whose lamps all shine at its ceiling through slits: what is seen is bounced light."""
    scene = core.Scene()
    reuse_scenes.matte(scene, albedo=(0.8, 0.8, 0.8))
    scene.upsert_mesh(1, "quad", QUAD, QUAD_TRIANGLES)
    f = reuse_scenes.frame
    for i, (x, y, z, at) in enumerate((
        ((4, 0, 0), (0, 4, 0), (0, 0, 1), (0, 0, 0)), ((4, 0, 0), (0, 4, 0), (0, 0, 1), (0, 0, 3)),
        ((4, 0, 0), (0, 0, 3), (0, 1, 0), (0, 4, 1.5)), ((4, 0, 0), (0, 0, 3), (0, 1, 0), (0, -5, 1.5)),
        ((0, 4, 0), (0, 0, 3), (1, 0, 0), (4, 0, 1.5)), ((0, 4, 0), (0, 0, 3), (1, 0, 0), (-4, 0, 1.5)),
    )):  # fmt: skip
        scene.upsert_instance(1 + i, 1, f(x, y, z, at), materials=[MATTE])
    for i in range(12):
        at = placed(-3 + i * 0.5, 3 - (i % 3), 2.2)
        scene.upsert_instance(50 + i, 1, placed(at[0, 3], at[1, 3], 2.1, 0.3), materials=[MATTE])
        scene.upsert_light(100 + i, f"lamp {i}", "point", at, power=20.0, radius=0.02)
    reuse_scenes.camera(scene)
    return scene


def test_paths_are_split_where_it_pays(core, make_context):
    """By what rounds before the first sample find; kept while cells are, whatever is asked for wins."""
    session = core.Session(make_context(), lit_by_bounces(core))

    def number(session, **given):
        core_scenes.picture(
            core, None, None, 64, session, integrator="wssr-hash", samples=1, passes=["Combined"], **given
        )
        return session.stats()["bounce_samples"]

    found = number(session, max_bounces=4)
    assert found > 1
    assert number(session, max_bounces=4, continue_history=True) == found
    assert number(session, max_bounces=4, bounce_samples=1) == 1

    sunny = core.Scene()  # a floor under lamps: bounces bring nothing
    reuse_scenes.matte(sunny)
    sunny.upsert_mesh(1, "quad", QUAD, QUAD_TRIANGLES)
    sunny.upsert_instance(1, 1, placed(scale=2.0), materials=[MATTE])
    reuse_scenes.lamps(sunny, 12, mixed=False)
    reuse_scenes.camera(sunny)
    assert number(core.Session(make_context(), sunny), max_bounces=4) == 1


def test_split_paths_have_less_noise_for_their_cost(core, make_context):
    session = core.Session(make_context(), lit_by_bounces(core))
    given = {"max_bounces": 4, "samples": 8, "passes": ["Combined"], "integrator": "wssr-hash"}
    noise = {}
    for number in (1, 4):
        found = pictures(core, session, range(12), bounce_samples=number, **given)["Combined"][..., :3]
        noise[number] = (np.var(found, axis=0) / (np.mean(found, axis=0) ** 2 + 1e-4)).mean()
    assert noise[4] < 0.5 * noise[1]
