# SPDX-License-Identifier: Apache-2.0
"""Pixels that share what their paths found at the surface after the first: the light of path tracing, whatever surfaces
are made of, with less noise where bounces light the picture."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes
from core_scenes import QUAD, QUAD_TRIANGLES, placed
from expectation import assert_same_light
from reuse_scenes import MATTE
from test_bounce_samples import LIGHT, lit_by_bounces, pictures, rich_room

from headwater.materials import closures

LAYERED, COATED, SHEEN, FACING, METAL, RED = 11, 12, 13, 14, 15, 16


def principled(scene, number, **given):
    """Upserts a Principled BSDF; `given`: functions of the graph for inputs that are not Blender's defaults."""

    def add(g, s):
        p = closures.Principled.defaults(g)
        for name, value in given.items():
            setattr(p, name, value(g))
        closures.add_principled(s, g.one, p)

    reuse_scenes.material(scene, number, add)


def box_of_layers(core):
    """A closed box, lit from behind shades, whose sides reflect more or less by where they are seen from: Blender's
    default surface, coat, sheen, a colour by the angle, a rough metal, pure red; a dome with smooth normals."""
    scene = lit_by_bounces(core)
    principled(scene, LAYERED)
    principled(scene, COATED, coat_weight=lambda g: g.one, coat_tint=lambda g: g.const(0.7, 0.8, 0.9))
    principled(scene, SHEEN, sheen_weight=lambda g: g.const(0.8), roughness=lambda g: g.const(0.3))
    principled(scene, METAL, metallic=lambda g: g.const(0.7), base_color=lambda g: g.const(0.9, 0.6, 0.3))
    reuse_scenes.matte(scene, RED, (0.8, 0.0, 0.0))

    def facing(g, s):
        side = g.abs(g.dot(g.incoming, g.normal))
        closures.add_diffuse(s, g.one, g.mul(side, g.const(0.9, 0.8, 0.6)), g.zero, g.normal)

    reuse_scenes.material(scene, FACING, facing)
    f = reuse_scenes.frame
    for i, (x, y, z, at, made_of) in enumerate((
        ((4, 0, 0), (0, 4, 0), (0, 0, 1), (0, 0, 0), LAYERED), ((4, 0, 0), (0, 4, 0), (0, 0, 1), (0, 0, 3), SHEEN),
        ((4, 0, 0), (0, 0, 3), (0, 1, 0), (0, 4, 1.5), COATED), ((0, 4, 0), (0, 0, 3), (1, 0, 0), (4, 0, 1.5), FACING),
        ((0, 4, 0), (0, 0, 3), (1, 0, 0), (-4, 0, 1.5), METAL),
        ((1, 0, 0), (0, 0, 0.8), (0, 1, 0), (1.2, 0, 0.6), RED),
    )):  # fmt: skip
        number = (1, 2, 3, 5, 6, 7)[i]
        scene.upsert_instance(number, 1, f(x, y, z, at), materials=[made_of])
    positions, triangles = core_scenes.bumpy(12)
    normals = positions * (0.6, 0.6, 0) + (0, 0, 1)
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    scene.upsert_mesh(2, "dome", positions, triangles, tri_corners=triangles, normals=normals)
    scene.upsert_instance(8, 2, placed(-0.9, -0.4, 0.1), materials=[LAYERED])
    return scene


@pytest.mark.parametrize("bounce_samples", [1, 3])
def test_layers_and_colours_by_the_angle_keep_their_light(core, make_context, bounce_samples):
    session = core.Session(make_context(), box_of_layers(core))
    given = {"integrator": "path", "max_bounces": 3, "samples": 16, "passes": ["Combined"], "clamp_indirect": 0.0}
    alone = pictures(core, session, range(48), bounce_samples=3, **given)["Combined"][..., :3]
    shared = pictures(
        core, session, range(100, 148), bounce_samples=bounce_samples, path_reuse=True, **given
    )["Combined"][..., :3]  # fmt: skip
    assert_same_light(shared, alone, 8, tiles=4)


@pytest.mark.parametrize("integrator", ["path", "wssr-hash"])
def test_every_pass_has_the_light_of_paths_alone(core, make_context, integrator, tracer):
    session = core.Session(make_context(tracer=tracer), rich_room(core))
    given = {"max_bounces": 3, "transparent_film": True, "passes": ["Combined", *LIGHT], "samples": 8}
    alone = pictures(core, session, range(20), integrator="path", bounce_samples=2, **given)
    shared = pictures(core, session, range(100, 120), integrator=integrator, path_reuse=True, bounce_samples=2, **given)
    for name in alone:
        if alone[name].any():
            assert_same_light(shared[name], alone[name], 40, tiles=4)


def test_adaptive_sampling_keeps_the_light(core, make_context):
    session = core.Session(make_context(), lit_by_bounces(core))
    given = {"integrator": "path", "max_bounces": 3, "samples": 16, "passes": ["Combined"]}
    alone = pictures(core, session, range(32), **given)["Combined"][..., :3]
    shared = pictures(
        core, session, range(100, 132), path_reuse=True, adaptive_sampling=True, **given
    )["Combined"][..., :3]  # fmt: skip
    assert_same_light(shared, alone, 12, tiles=4)


@pytest.mark.parametrize("limit, left", [(0.05, 0.2), (0.5, 0.6)])
def test_clamped_light_is_about_as_bright_as_alone(core, make_context, limit, left):
    """The bound is on what a path brings its own pixel each time it finds light."""
    session = core.Session(make_context(), lit_by_bounces(core))
    given = {"integrator": "path", "max_bounces": 3, "samples": 16, "passes": ["Combined"]}

    def brightness(**more):
        return pictures(core, session, range(8), **given, **more)["Combined"][..., :3].mean()

    alone = brightness(clamp_indirect=limit)
    assert alone < left * brightness()
    assert 0.9 * alone < brightness(clamp_indirect=limit, path_reuse=True) < 1.1 * alone


def test_the_same_bits_for_any_waves_and_threads(core, make_context):
    scene = lit_by_bounces(core)
    given = {"samples": 3, "max_bounces": 3, "integrator": "wssr-hash", "path_reuse": True, "passes": ["Combined"]}
    once = core_scenes.picture(core, make_context(), scene, 40, bounce_samples=2, **given)["Combined"]
    session = core.Session(make_context(threads=3), scene)
    for tile in (64, 960):
        again = core_scenes.picture(core, None, None, 40, session, bounce_samples=2, tile_pixels=tile, **given)
        assert np.array_equal(once, again["Combined"])


def test_sharing_takes_noise_away_and_leaves_no_pattern(core, make_context):
    """A picture lit by bounces alone has less than half the variance, and its error at a pixel tells little of that of
    another, wherever it lies: those that share with it lie elsewhere in each tile and sample."""
    session = core.Session(make_context(), lit_by_bounces(core))
    given = {"integrator": "path", "max_bounces": 4, "samples": 4, "passes": ["Combined"], "bounce_samples": 1}
    noise = {}
    for reuse in (False, True):
        found = np.stack([
            core_scenes.picture(core, None, None, 64, session, seed=seed, path_reuse=reuse, **given)["Combined"]
            for seed in range(16)
        ])[..., :3].mean(-1)  # fmt: skip
        mean = found.mean(0)
        error = (found - mean) / (mean + 0.05 * mean.mean())
        noise[reuse] = float(np.median(np.var(error, axis=0, ddof=1)))
    assert noise[True] < noise[False] / 2
    error -= error.mean(axis=(1, 2), keepdims=True)
    error = np.clip(error, -2, 2)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (0, 4), (0, 8), (2, 0), (2, 4)):
        a = error[:, dy:, dx:]
        b = error[:, : error.shape[1] - dy, : error.shape[2] - dx]
        assert abs(np.mean(a * b)) < 0.15 * np.mean(error**2), (dy, dx)


def test_it_is_found_out_whether_pixels_share(core, make_context):
    """By rounds before the first sample; kept while cells are; what is asked for wins."""
    session = core.Session(make_context(), lit_by_bounces(core))

    def shares(session, **given):
        settings = {"integrator": "wssr-hash", "samples": 1, "max_bounces": 4, "passes": ["Combined"], **given}
        core_scenes.picture(core, None, None, 64, session, **settings)
        return session.stats()["path_reuse"]

    assert shares(session)
    assert shares(session, continue_history=True)
    assert not shares(session, path_reuse=False)
    assert not shares(session, max_bounces=0)

    sunny = core.Scene()  # a floor under lamps: nothing to share
    reuse_scenes.matte(sunny)
    sunny.upsert_mesh(1, "quad", QUAD, QUAD_TRIANGLES)
    sunny.upsert_instance(1, 1, placed(scale=2.0), materials=[MATTE])
    reuse_scenes.lamps(sunny, 12, mixed=False)
    reuse_scenes.camera(sunny)
    assert not shares(core.Session(make_context(), sunny))
    assert shares(core.Session(make_context(), sunny), path_reuse=True)
