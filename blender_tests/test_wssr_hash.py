# SPDX-License-Identifier: Apache-2.0
"""`wssr-hash`: the expectation of `path`, much less noise once its cells know the lights, the same bits for any tiles,
knowledge that lasts from frame to frame and is never wrong after edits."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes
from expectation import assert_same_light
from test_light_tree import lit_room

HASH = "wssr-hash"


def hidden_lamps(core, count=300):
    """Lamps over a room, most of them shut in under boxes that let nothing out."""
    scene = core.Scene()
    reuse_scenes.room(scene)
    rng = np.random.default_rng(5)
    scene.upsert_mesh(50, "lid", core_scenes.QUAD, core_scenes.QUAD_TRIANGLES)
    lid = core_scenes.placed(0.0, 0.9, 0.6, 0.8)
    scene.upsert_instance(500, 50, lid, name="lid", materials=[reuse_scenes.MATTE])
    for i in range(count):
        hidden = i % 8 != 0
        low, high = ((-0.7, 0.2, 0.65), (0.7, 1.6, 0.9)) if hidden else ((-1.9, -1.9, 0.1), (1.9, 1.9, 0.4))
        place = core_scenes.placed(*rng.uniform(low, high))
        scene.upsert_light(100 + i, f"lamp {i}", "point", place, power=float(rng.uniform(0.2, 1)), radius=0.02)
    return scene


def relative_noise(pictures):
    """Variance of independent pictures over their mean squared, as relMSE weighs it."""
    return (np.var(pictures, axis=0) / (np.mean(pictures, axis=0) ** 2 + 0.01)).mean()


@pytest.mark.parametrize(("bounces", "light_samples"), [(0, 1), (4, 4)])
def test_expectation_is_that_of_path(core, make_context, tracer, bounces, light_samples):
    """Cells learn between the samples of a render, and are used as soon: no sample may be the worse for it."""
    session = core.Session(make_context(tracer), lit_room(core))
    path = reuse_scenes.renders(core, session, range(100, 120), "path", samples=16, max_bounces=bounces)
    given = {"samples": 16, "max_bounces": bounces, "light_samples": light_samples}
    ours = reuse_scenes.renders(core, session, range(100, 120), HASH, **given)
    assert_same_light(ours, path, 6)


@pytest.mark.parametrize("samples", [1, 3])
def test_light_samples_of_path_share_a_surface(core, make_context, samples):
    """Several light samples of the first surface: the same expectation, with the MIS weights of as many."""
    session = core.Session(make_context(), lit_room(core))
    one = reuse_scenes.renders(core, session, range(100, 124), "path", samples=12, max_bounces=2)
    more = reuse_scenes.renders(
        core, session, range(200, 224), "path", samples=12, max_bounces=2, light_samples=samples
    )
    assert_same_light(more, one, 10)
    if samples > 1:
        assert np.var(more, axis=0).mean() < 0.8 * np.var(one, axis=0).mean()


def test_cells_learn_which_lights_arrive(core, make_context):
    session = core.Session(make_context(), hidden_lamps(core))
    noise = {}
    for name, given in (("path", {"lights": "tree"}), (HASH, {"light_samples": 1})):
        pictures = reuse_scenes.renders(core, session, range(12), name, samples=16, **given)
        noise[name] = relative_noise(pictures)
    assert noise[HASH] < 0.75 * noise["path"]


def test_error_falls_as_independent_samples_do(core, make_context):
    """What is known is kept, samples are not: variance of the mean falls as 1 / n or faster, with no plateau."""
    session = core.Session(make_context(), hidden_lamps(core))
    counts = np.array([16, 32, 64])
    variance = [
        np.var(reuse_scenes.renders(core, session, range(16), HASH, samples=int(n)), axis=0).mean() for n in counts
    ]
    slope = np.polyfit(np.log(counts), np.log(variance), 1)[0]
    assert -1.5 < slope < -0.8, variance


def test_the_same_bits_for_any_tiles(core, make_context):
    scene = lit_room(core)
    given = {"samples": 6, "max_bounces": 3}
    once = reuse_scenes.render(core, core.Session(make_context(), scene), HASH, **given)
    session = core.Session(make_context(threads=3), scene)
    for tile in (0, 64, 192):
        assert np.array_equal(once, reuse_scenes.render(core, session, HASH, tile_pixels=tile, **given))


def test_linear_in_the_light(core, make_context):
    once, twice = (
        reuse_scenes.render(core, core.Session(make_context(), lit_room(core, f)), HASH, samples=6, max_bounces=2)
        for f in (1, 2)
    )
    assert once.mean() > 0.01
    assert np.array_equal(twice, 2 * once)


def test_knowledge_lasts_over_frames_and_edits(core, make_context):
    """A second frame is cleaner than the first; one after lamps moved, came and went has the right expectation."""
    context = make_context()

    def next_frame(session, seed, **given):
        return reuse_scenes.render(core, session, HASH, seed=seed, samples=1, **given)

    scene = hidden_lamps(core)
    session = core.Session(context, scene)
    first = [reuse_scenes.render(core, session, HASH, seed=s, samples=1) for s in range(24)]
    reuse_scenes.render(core, session, HASH, seed=99, samples=16)
    later = [next_frame(session, 100 + s, continue_history=True) for s in range(24)]
    assert relative_noise(later) < 0.92 * relative_noise(first)  # which have learned from some paths of their own

    for edit in (
        lambda s: s.upsert_light(100, "lamp 0", "point", core_scenes.placed(0.5, -0.8, 0.3), power=9.0, radius=0.02),
        lambda s: s.remove_light(108),
        lambda s: s.upsert_light(900, "new", "point", core_scenes.placed(-0.9, -0.5, 0.4), power=9.0, radius=0.02),
    ):
        edit(scene)
        session.sync()
        kept = [next_frame(session, 200 + s, continue_history=True) for s in range(48)]
        path = reuse_scenes.renders(core, session, range(48), "path", samples=16)
        assert_same_light(kept, path, 20)


@pytest.mark.parametrize("memory", [1, 16])
def test_memory_is_bounded_and_too_little_of_it_only_noisy(core, make_context, memory):
    settings = {"width": 64, "height": 36, "integrator": HASH, "reservoir_memory": memory}
    assert 0.9 * memory * 2**20 < core.reservoir_bytes(settings) <= memory * 2**20
    session = core.Session(make_context(), hidden_lamps(core))
    path = reuse_scenes.renders(core, session, range(24), "path", samples=24)
    ours = reuse_scenes.renders(core, session, range(24), HASH, samples=8, reservoir_memory=memory)
    assert_same_light(ours, path, 20)


def test_few_lights_are_left_to_the_tree(core, make_context):
    scene = core.Scene()
    reuse_scenes.room(scene)
    reuse_scenes.lamps(scene, 4)
    session = core.Session(make_context(), scene)
    ours = reuse_scenes.render(core, session, HASH, samples=2)
    path = reuse_scenes.render(core, session, "path", samples=2, light_samples=4)
    assert np.array_equal(ours, path)


def under_lamps(core, hidden):
    """A floor like a blurred mirror under glowing squares; or 300 lamps, most of them shut in."""
    if hidden:
        return hidden_lamps(core)
    scene = core.Scene()
    reuse_scenes.glossy(scene, roughness=0.1)
    scene.upsert_mesh(1, "quad", core_scenes.QUAD, core_scenes.QUAD_TRIANGLES)
    scene.upsert_instance(1, 1, core_scenes.placed(scale=2.0), materials=[reuse_scenes.GLOSSY])
    reuse_scenes.glowing_quads(scene, 12, scale=0.3)
    reuse_scenes.camera(scene)
    return scene


@pytest.mark.parametrize("hidden", [False, True])
def test_cells_that_would_not_pay_are_left_alone(core, make_context, hidden):
    """Found by rounds before the first sample, kept with the cells, found anew where those begin again."""
    session = core.Session(make_context(), under_lamps(core, hidden))

    def frame(size=256, **given):
        found = core_scenes.picture(
            core, None, None, size, session, integrator=HASH, samples=1, passes=["Combined"], max_bounces=0, **given
        )
        return found["Combined"], session.stats()["lights_by_tree"]

    first, by_tree = frame()
    assert by_tree is not hidden
    again, same = frame()
    assert np.array_equal(again, first) and same == by_tree
    # For eight frames that go on nothing is measured, then it is again.
    assert {frame(continue_history=True)[1] for _ in range(9)} == {by_tree}
    assert not frame(size=64)[1]  # too small a picture to tell by


def test_the_light_is_the_same_when_the_tree_draws(core, make_context):
    session = core.Session(make_context(), under_lamps(core, False))
    given = dict(size=256, samples=1, passes=["Combined"], max_bounces=2)

    def runs(integrator):
        found = [
            core_scenes.picture(
                core, None, None, session=session, integrator=integrator, light_samples=4, seed=s, **given
            )
            for s in range(8)
        ]
        return [p["Combined"][..., :3] for p in found]

    ours = runs(HASH)
    assert session.stats()["lights_by_tree"]
    assert_same_light(ours, runs("path"), 5)


def test_no_light_at_all_is_dark(core, make_context):
    scene = core.Scene()
    reuse_scenes.room(scene)
    assert not reuse_scenes.render(core, core.Session(make_context(), scene), HASH, samples=2).any()


def test_cells_in_use_are_counted(core, make_context):
    """None more than there is place for, more where more is seen, none for integrators that have none."""
    scene = hidden_lamps(core)
    session = core.Session(make_context(), scene)

    def stats(integrator, size, samples):
        core_scenes.picture(core, None, scene, size, session, integrator=integrator, samples=samples)
        return session.stats()

    few, many = stats(HASH, 8, 1), stats(HASH, 64, 4)
    assert few["light_cells"] == many["light_cells"]
    assert 0 < few["light_cells_used"] < many["light_cells_used"] <= many["light_cells"]
    assert "light_cells" not in stats("restir", 8, 1)
