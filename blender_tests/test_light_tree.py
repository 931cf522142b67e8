# SPDX-License-Identifier: Apache-2.0
"""`path` with lights chosen by the light tree: the same expectation as by power, less noise, the same bits again."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes
from expectation import assert_same_light

from headwater.materials import Graph, compile_background


def gradient_sky(scene, factor=1.0):
    """A world whose radiance a program gives: bright to one side, dark on the other. It is a light of the table."""
    graph = Graph()
    bright = graph.max(graph.dot(graph.position, graph.const(0.6, 0.0, 0.8)), graph.zero)
    radiance = graph.mul(graph.mul(bright, bright), graph.const(0.5 * factor, 0.8 * factor, factor))
    compiled = compile_background(graph, radiance, [], [])
    scene.upsert_material(90, "sky", compiled.program, compiled.constants, flags=compiled.flags)
    scene.set_world("sky", (0, 0, 0), 90, importance_width=16)


def smooth_hill(scene):
    """A coarse grid with normals that are not its faces': light reaches parts that face away from it."""
    positions, triangles = core_scenes.bumpy(6)
    normals = positions[triangles.ravel()] * (1.5, 1.5, 0) + (0, 0, 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    scene.upsert_mesh(2, "hill", positions, triangles, normals=normals.astype(np.float32))
    place = core_scenes.placed(-0.2, -1.0, 0.02, 0.6)
    scene.upsert_instance(20, 2, place, name="hill", materials=[reuse_scenes.GLOSSY])


def lit_room(core, factor=1.0):
    """Lamps of every kind, a sun, glowing squares and a sky, over matte, glossy, smooth and translucent surfaces."""
    scene = reuse_scenes.many_lights(core, factor)
    gradient_sky(scene, factor)
    smooth_hill(scene)
    return scene


@pytest.mark.parametrize("bounces", [0, 4])
def test_the_tree_has_the_expectation_of_choice_by_power(core, make_context, tracer, bounces):
    session = core.Session(make_context(tracer), lit_room(core))
    power, tree = (
        reuse_scenes.renders(core, session, range(100, 124), lights=lights, samples=24, max_bounces=bounces)
        for lights in ("power", "tree")
    )
    assert not np.array_equal(power[0], tree[0])
    assert_same_light(tree, power, 4)


def test_many_lamps_are_less_noisy_by_the_tree(core, make_context):
    scene = core.Scene()
    reuse_scenes.room(scene)
    rng = np.random.default_rng(3)
    for i in range(400):
        place = core_scenes.placed(*rng.uniform((-1.9, -1.9, 0.1), (1.9, 1.9, 0.3)))
        scene.upsert_light(100 + i, f"lamp {i}", "point", place, power=float(rng.uniform(0.2, 1)), radius=0.02)
    session = core.Session(make_context(), scene)
    noise = {
        lights: np.stack(reuse_scenes.renders(core, session, range(64), lights=lights, samples=4)).var(0).mean()
        for lights in ("power", "tree", "auto")
    }
    assert noise["tree"] < 0.4 * noise["power"]
    assert noise["auto"] == noise["tree"]


def test_the_choice_is_made_by_the_number_of_lights(core, make_context):
    """One light needs no tree; reservoirs draw by power."""
    scene = core.Scene()
    reuse_scenes.room(scene)
    reuse_scenes.lamps(scene, 1)
    session = core.Session(make_context(), scene)
    auto, power = (reuse_scenes.render(core, session, lights=lights) for lights in ("auto", "power"))
    assert np.array_equal(auto, power)
    reuse_scenes.lamps(scene, 20)
    auto, power, tree = (reuse_scenes.render(core, session, lights=lights) for lights in ("auto", "power", "tree"))
    assert np.array_equal(auto, tree)
    assert not np.array_equal(auto, power)
    auto, power = (reuse_scenes.render(core, session, "restir", lights=lights) for lights in ("auto", "power"))
    assert np.array_equal(auto, power)


def test_the_tree_gives_the_same_bits_for_any_tiles(core, make_context):
    scene = lit_room(core)
    once = reuse_scenes.render(core, core.Session(make_context(), scene), lights="tree", samples=4, max_bounces=3)
    session = core.Session(make_context(threads=3), scene)
    for tile in (0, 64, 192):
        again = reuse_scenes.render(core, session, lights="tree", samples=4, max_bounces=3, tile_pixels=tile)
        assert np.array_equal(once, again)


def test_the_tree_follows_lamps_that_move_and_come_and_go(core, make_context):
    """One session through edits (the tree is refitted, then built anew) and between choices, against fresh sessions."""
    context = make_context()
    scene = lit_room(core)
    session = core.Session(context, scene)
    reuse_scenes.render(core, session, lights="tree")

    def check(edit):
        edit(scene)
        session.sync()
        given = {"lights": "tree", "samples": 16}
        kept = reuse_scenes.renders(core, session, range(200, 216), **given)
        fresh_scene = lit_room(core)
        for past in done:
            past(fresh_scene)
        edit(fresh_scene)
        fresh = reuse_scenes.renders(core, core.Session(make_context(), fresh_scene), range(300, 316), **given)
        done.append(edit)
        assert_same_light(kept, fresh, 10)
        assert np.mean(kept) > 0.01

    done = []
    check(lambda s: s.upsert_light(100, "lamp 0", "point", core_scenes.placed(0.3, -0.6, 0.4), power=40.0))
    check(lambda s: s.remove_light(103))
    reuse_scenes.render(core, session, lights="uniform")
    check(lambda s: reuse_scenes.glowing(s, radiance=(1.0, 9.0, 1.0)))
    check(lambda s: gradient_sky(s, 4.0))


@pytest.mark.parametrize("bounces", [0, 4])
def test_light_is_linear_under_the_tree(core, make_context, bounces):
    once, twice = (
        reuse_scenes.render(
            core, core.Session(make_context(), lit_room(core, f)), lights="tree", samples=4, max_bounces=bounces
        )
        for f in (1, 2)
    )
    assert once.mean() > 0.01
    assert np.allclose(twice, 2 * once, rtol=1e-4, atol=1e-6)


def test_lights_that_cannot_shine_leave_the_tree_alone(core, make_context):
    scene = core.Scene()
    reuse_scenes.room(scene)
    session = core.Session(make_context(), scene)
    assert not reuse_scenes.render(core, session, lights="tree").any()
    for i, power in enumerate((0.0, -5.0, -3e38)):
        scene.upsert_light(100 + i, f"lamp {i}", "point", core_scenes.placed(0, 0, 2), power=power)
    assert not reuse_scenes.render(core, session, lights="tree").any()
    scene.upsert_light(200, "lamp", "point", core_scenes.placed(0, 0, 2), power=50.0)
    tree, power = (reuse_scenes.render(core, session, lights=lights, samples=16) for lights in ("tree", "power"))
    assert np.allclose(tree, power)
    assert tree.any()


def test_integrators_that_reuse_refuse_the_tree(core, make_context):
    session = core.Session(make_context(), lit_room(core))
    with pytest.raises(ValueError, match="restir.*tree"):
        reuse_scenes.render(core, session, "restir", lights="tree")
