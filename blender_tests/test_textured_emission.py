# SPDX-License-Identifier: Apache-2.0
"""Light whose emission an image gives: the expectation of BSDF rays alone, from all integrators; noise no worse than
that of the same light made of small squares; what an edit of the image does."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes as rs
from expectation import assert_same_light
from reuse_scenes import frame

from headwater.materials import Graph, Surface, opcodes, textures

SIGN, BRIGHT, SIZE = 30, 31, 32  # materials; texels along a side of the sign
UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
WALL = ((0, 1.2, 0), (0, 0, 0.8), (1, 0, 0), (-1.9, 0.0, 1.0))  # columns of the sign's matrix: on the left


def letters():
    """(SIZE, SIZE) of zeros and ones: a few strokes, 5 % of the sign."""
    lit = np.zeros((SIZE, SIZE), bool)
    lit[8:24, 4:5] = lit[8:9, 4:10] = lit[20:28, 24:26] = lit[4:5, 20:28] = True
    return lit


def sign_material(scene, radiance, lit, nee=True):
    """A black material that emits `radiance` where `lit`; without next-event estimation for the asking."""
    texels = np.zeros((SIZE, SIZE, 4), np.float32)
    texels[..., 3] = 1
    texels[lit, :3] = (1.0, 0.4, 0.15)
    scene.upsert_image(1, "letters", texels)
    graph = Graph()
    surface = Surface(graph)
    colour = textures.image(graph, 0, graph.uv, "Closest", "EXTEND")
    surface.emit(graph.scale(colour, radiance))
    compiled = surface.finish([1], [], [])
    flags = compiled.flags | (0 if nee else opcodes.MATERIAL_NO_MIS)
    scene.upsert_material(SIGN, "sign", compiled.program, compiled.constants, flags=flags, images=[1])


def sign_room(core, radiance=30.0, lit=None, nee=True, lamps=40):
    """The room with a large dark sign on its left and dim lamps; smooth things see the sign too."""
    scene = core.Scene()
    rs.room(scene)
    rs.lamps(scene, lamps, factor=0.04, mixed=False)
    sign_material(scene, radiance, letters() if lit is None else lit, nee)
    attributes = [("UVMap", "vertex", UV)]
    scene.upsert_mesh(40, "sign", core_scenes.QUAD, core_scenes.QUAD_TRIANGLES, attributes=attributes, default_uv=0)
    scene.upsert_instance(400, 40, frame(*WALL), name="sign", materials=[SIGN])
    return scene


def squares_room(core, radiance=30.0, lamps=40):
    """The same light from a square for each lit texel."""
    scene = sign_room(core, radiance, np.zeros((SIZE, SIZE), bool), lamps=lamps)
    rs.glowing(scene, BRIGHT, radiance=tuple(radiance * c for c in (1.0, 0.4, 0.15)))
    y, x = np.nonzero(letters())
    corner = np.stack([x, y], -1)[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    positions = np.concatenate([corner / SIZE * 2 - 1, np.full((*corner.shape[:2], 1), 1e-3)], -1)
    triangles = (4 * np.arange(len(x))[:, None, None] + core_scenes.QUAD_TRIANGLES).reshape(-1, 3)
    scene.upsert_mesh(41, "squares", positions.reshape(-1, 3).astype(np.float32), triangles.astype(np.uint32))
    scene.upsert_instance(410, 41, frame(*WALL), name="squares", materials=[BRIGHT])
    return scene


WAYS = {
    "uniform": {"lights": "uniform"},
    "power": {"lights": "power"},
    "tree": {"lights": "tree"},
    "several": {"lights": "tree", "light_samples": 3},
    "restir": {"integrator": "restir", "estimator": "unbiased"},
    "kd": {"integrator": "wssr-kd", "estimator": "unbiased"},
    "hash": {"integrator": "wssr-hash"},
}


def noise(core, session, **settings):
    """Variance of independent pictures over their mean squared, as relMSE weighs it."""
    pictures = rs.renders(core, session, range(16), samples=8, **settings)
    return (np.var(pictures, axis=0) / (np.mean(pictures, axis=0) ** 2 + 1e-3)).mean()


@pytest.fixture(scope="module")
def reference(core, make_context):
    """Independent pictures of the light found by BSDF rays alone, which know nothing of maps."""
    blind = core.Session(make_context(), sign_room(core, nee=False))
    return rs.renders(core, blind, range(500, 524), samples=256, max_bounces=1)


@pytest.mark.parametrize("way", WAYS)
def test_expectation_is_that_of_bsdf_rays(core, make_context, reference, way):
    """Light samples by the map and BSDF rays weighed by its pdf: their shares make one whole."""
    ours = core.Session(make_context(), sign_room(core))
    pictures = rs.renders(core, ours, range(24), samples=24, max_bounces=1, **WAYS[way])
    assert_same_light(pictures, reference, 6, tiles=4)


@pytest.mark.parametrize("tracer", ["ray_query", "ray_pipeline"])
@pytest.mark.ray_query
def test_every_tracer_has_the_light(core, make_context, tracer):
    """Where a ray meets the sign is the Tracer's to say; the pdf there is the map's."""
    groups = [
        rs.renders(core, core.Session(make_context(name), sign_room(core)), seeds, samples=24, max_bounces=1)
        for name, seeds in ((tracer, range(16)), ("embree", range(100, 116)))
    ]
    assert_same_light(*groups, 8, tiles=4)


@pytest.mark.parametrize("way", ["tree", "hash", "restir"])
def test_noise_is_that_of_small_squares(core, make_context, way):
    """A map finds the strokes as well as a table of their squares does (without one: 30 times the variance)."""
    sign, squares = (
        noise(core, core.Session(make_context(), make(core)), **WAYS[way]) for make in (sign_room, squares_room)
    )
    assert sign < 2.5 * squares


def test_both_rooms_have_the_same_light(core, make_context):
    groups = [
        rs.renders(core, core.Session(make_context(), make(core)), range(12), samples=64, max_bounces=1, lights="tree")
        for make in (sign_room, squares_room)
    ]
    assert_same_light(*groups, 8, tiles=4)


def test_a_sign_takes_its_share_of_the_samples(core, make_context):
    """Among lamps that light little: by the sign's mean, not by a guess, most samples go to it."""
    session = core.Session(make_context(), sign_room(core, radiance=300.0))
    power, uniform = (noise(core, session, lights=lights) for lights in ("power", "uniform"))
    assert power < 0.4 * uniform


def test_linear_and_the_same_bits(core, make_context):
    given = {"samples": 4, "max_bounces": 2}
    once = rs.render(core, core.Session(make_context(), sign_room(core)), **given)
    again = rs.render(core, core.Session(make_context(threads=3), sign_room(core)), tile_pixels=64, **given)
    assert np.array_equal(once, again)
    dark = [rs.render(core, core.Session(make_context(), sign_room(core, f, lamps=0)), **given) for f in (30.0, 60.0)]
    assert dark[0].mean() > 0.01
    assert np.allclose(dark[1], 2 * dark[0], rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("way", ["tree", "hash", "restir"])
def test_an_image_that_changes_is_measured_anew(core, make_context, way):
    """The same session before and after: other strokes, another mean, the same expectation as a fresh one."""
    scene = sign_room(core)
    session = core.Session(make_context(), scene)
    rs.render(core, session, samples=2, **WAYS[way])
    turned = letters().T[::-1].copy()
    sign_material(scene, 60.0, turned)
    session.sync()
    assert_same(core, make_context, session, sign_room(core, 60.0, turned), way)
    scene.upsert_instance(400, 40, frame(*WALL[:3], (-1.8, 0.3, 1.1)), name="sign", materials=[SIGN])
    moved = sign_room(core, 60.0, turned)
    moved.upsert_instance(400, 40, frame(*WALL[:3], (-1.8, 0.3, 1.1)), name="sign", materials=[SIGN])
    assert_same(core, make_context, session, moved, way)


def assert_same(core, make_context, session, scene, way):
    """The session's pictures have the expectation, and no more than 1.3 times the noise, of a fresh one's."""
    kept = rs.renders(core, session, range(12), samples=16, **WAYS[way])
    fresh = rs.renders(core, core.Session(make_context(), scene), range(100, 112), samples=16, **WAYS[way])
    assert_same_light(kept, fresh, 15, tiles=4)
    assert np.median(np.var(kept, axis=0)) < 1.3 * np.median(np.var(fresh, axis=0))


def test_a_sign_that_is_dark_harms_nothing(core, make_context):
    dark = core.Session(make_context(), sign_room(core, lit=np.zeros((SIZE, SIZE), bool)))
    lamps = rs.renders(core, dark, range(8), samples=8, lights="tree")
    blind = core.Session(make_context(), sign_room(core, lit=np.zeros((SIZE, SIZE), bool), nee=False))
    alone = rs.renders(core, blind, range(8), samples=8, lights="tree")
    # Of the median pixel: the mean is of the few that a rare sample met.
    assert np.median(np.var(lamps, axis=0)) < 2 * np.median(np.var(alone, axis=0))
