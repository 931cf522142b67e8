# SPDX-License-Identifier: Apache-2.0
"""`path` as an estimator: variance falls as 1/samples, direct light equals a sum over the lamps, light is linear."""

import core_scenes
import numpy as np
import pytest

from headwater.materials import Graph, Surface, closures
from headwater.tile_test import tile_test


def matte(scene, number, albedo):
    """Upserts a Lambertian material."""
    graph = Graph()
    surface = Surface(graph)
    closures.add_diffuse(surface, graph.one, graph.const(*albedo), graph.zero, graph.normal)
    compiled = surface.finish([], [], [])
    scene.upsert_material(number, "matte", compiled.program, compiled.constants, flags=compiled.flags)


def glowing(scene, number, radiance):
    """Upserts a material that only emits."""
    graph = Graph()
    surface = Surface(graph)
    surface.emit(graph.const(*radiance))
    compiled = surface.finish([], [], [])
    scene.upsert_material(
        number, "glow", compiled.program, compiled.constants, flags=compiled.flags, emission=tuple(radiance)
    )


@pytest.mark.parametrize("lights", ["uniform", "power", "tree"])
def test_variance_falls_as_one_over_samples(core, make_context, lights):
    """Independent renders of n samples; the slope of log variance over log n is -1 within 0.05 for plain Monte Carlo.

    Sobol points do better where the integrand is smooth, so a slope steeper than that is no fault; the seeds' pictures
    of a few samples are averaged instead, which is Monte Carlo again: their variance must fall as 1/n, not slower.
    """
    scene, context = core_scenes.open_scene(core), make_context()
    session = core.Session(context, scene)

    def pictures(samples, runs, first):
        made = [
            core_scenes.picture(
                core, context, scene, 24, session, samples=samples, seed=first + i, lights=lights, passes=["Combined"]
            )["Combined"][..., :3]
            for i in range(runs)
        ]
        return np.minimum(np.stack(made), 4.0)

    runs = pictures(1, 256, 1)
    counts = np.array([1, 2, 4, 8, 16])
    variance = [runs.reshape(-1, n, *runs.shape[1:]).mean(1).var(0, ddof=1).mean() for n in counts]
    slope = np.polyfit(np.log(counts), np.log(variance), 1)[0]
    assert abs(slope + 1) < 0.05, "seeds are independent of each other"
    inside = [pictures(int(n), 24, 1000 * int(n)).var(0, ddof=1).mean() for n in (1, 4, 16)]
    slope = np.polyfit(np.log([1, 4, 16]), np.log(inside), 1)[0]
    assert -2.2 < slope < -0.95, "samples of one render are at least as good as independent ones"
    many = pictures(64, 6, 50000)
    assert tile_test(list(runs[:64]), list(many), 4).p_family > 1e-4, "1 and 64 samples have the same expectation"


LAMPS = [((0.7, 0.2, 1.0), 30.0), ((-0.8, 0.5, 1.5), 50.0), ((0.1, -0.9, 0.6), 12.0), ((-0.3, -0.2, 2.2), 80.0)]
ALBEDO = np.array([0.7, 0.5, 0.2])


@pytest.mark.parametrize("lights", ["uniform", "power", "tree"])
def test_direct_light_is_the_sum_over_the_lamps(core, make_context, tracer, lights):
    """Point lamps over a matte square and a smaller one: every pixel against a loop over lamps in double precision."""
    scene = core.Scene()
    matte(scene, 1, ALBEDO)
    scene.upsert_mesh(1, "quad", core_scenes.QUAD, core_scenes.QUAD_TRIANGLES)
    scene.upsert_instance(1, 1, core_scenes.placed(), materials=[1])
    blocker = np.array([0.15, 0.1, 0.3])
    scene.upsert_instance(2, 1, core_scenes.placed(*blocker, scale=0.2), materials=[1])
    for i, (place, power) in enumerate(LAMPS):
        scene.upsert_light(i + 1, f"lamp {i}", "point", core_scenes.placed(*place), power=power)
    scene.set_camera("orthographic", core_scenes.placed(z=3), (-1, 1, -1, 1))
    size = 32
    # A filter so narrow that a pixel shows its centre.
    made = core_scenes.picture(
        core,
        make_context(tracer),
        scene,
        size,
        samples=512,
        max_bounces=0,
        lights=lights,
        filter="BOX",
        filter_width=0.01,
    )
    centres = (np.arange(size) + 0.5) / size * 2 - 1
    P = np.stack([*np.meshgrid(centres, centres), np.zeros((size, size))], -1)
    on_top = np.abs(P[..., :2] - blocker[:2]).max(-1) < 0.2
    P[on_top, 2] = blocker[2]
    expected = np.zeros((size, size, 3))
    near_edge = np.abs(np.abs(P[..., :2] - blocker[:2]).max(-1) - 0.2) < 0.02
    for place, power in LAMPS:
        to = np.array(place) - P
        distance2 = (to**2).sum(-1)
        cosine = np.maximum(to[..., 2], 0) / np.sqrt(distance2)
        crossing = P + to * ((blocker[2] - P[..., 2]) / to[..., 2])[..., None]
        reach = np.abs(crossing[..., :2] - blocker[:2]).max(-1)
        lit = on_top | (reach > 0.2)
        near_edge |= ~on_top & (np.abs(reach - 0.2) < 0.01)
        # A point lamp sends its watts out evenly: radiant intensity power / (4 pi).
        expected += (lit * cosine / distance2 * power / (4 * np.pi))[..., None] * ALBEDO / np.pi
    assert np.array_equal(made["Position"][on_top & ~near_edge][:, 2] > 0.2, np.ones((on_top & ~near_edge).sum(), bool))
    image, keep = made["Combined"][..., :3], ~near_edge
    assert keep.mean() > 0.7 and 0.005 < on_top.mean()
    error = image[keep] / expected[keep] - 1
    assert abs(error.mean()) < 0.004, error.mean()
    assert np.quantile(np.abs(error), 0.99) < 0.15, "noise of the choice of a lamp"
    assert np.sqrt((error**2).mean()) < 0.05


def test_light_is_linear(core, make_context):
    """Twice the emission of lamps, sky and meshes is twice the picture, bit by bit: paths do not depend on it."""

    def scene(factor):
        made = core_scenes.open_scene(core)
        glowing(made, 9, np.array([1.0, 0.6, 0.2]) * factor)
        made.upsert_instance(99, 2, core_scenes.placed(0.3, 0.4, 1.5, 0.3), materials=[9])
        made.upsert_light(1, "point", "point", core_scenes.placed(1, 0, 2), power=60.0 * factor, radius=0.2)
        made.upsert_light(2, "area", "area", core_scenes.placed(-1, 0, 2), power=40.0 * factor, color=(1.0, 0.5, 0.2))
        made.upsert_light(3, "sun", "sun", core_scenes.EYE, power=0.4 * factor, angle=0.1)
        made.set_world("sky", (0.1 * factor, 0.2 * factor, 0.3 * factor))
        return made

    for lights in ("uniform", "power", "tree"):
        once, twice = (
            core_scenes.picture(core, make_context(), scene(f), 32, seed=3, lights=lights)["Combined"] for f in (1, 2)
        )
        assert once[..., :3].mean() > 0.1
        assert np.allclose(twice[..., :3], 2 * once[..., :3], rtol=1e-5, atol=1e-7)
        assert np.array_equal(twice[..., 3], once[..., 3])
