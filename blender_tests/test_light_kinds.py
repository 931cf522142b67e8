# SPDX-License-Identifier: Apache-2.0
"""Kernels hold the kinds of light that a scene has: the picture is that of kernels that hold all, and kinds that come
and go while a session lives are in its next picture."""

import core_scenes
import numpy as np
import pytest
import reuse_scenes
from core_scenes import QUAD, QUAD_TRIANGLES, placed
from expectation import assert_same_light

LAMPS = {
    "point": ("point", dict(radius=0.0)),
    "soft": ("point", dict(radius=0.2, soft=True)),
    "ball": ("point", dict(radius=0.2)),
    "spot": ("spot", dict(radius=0.1, spot_size=1.2, spot_blend=0.3)),
    "rectangle": ("area", dict(size_x=0.8, size_y=0.4)),
    "ellipse": ("area", dict(size_x=0.8, size_y=0.4, ellipse=True)),
    "spread": ("area", dict(size_x=0.8, size_y=0.4, spread=0.8)),
    "sun": ("sun", dict(angle=0.3)),
}
EVERY = {**LAMPS, "world": None, "triangles": None}


def lamp(core, scene, number, kind, power=30.0):
    type, given = LAMPS[kind]
    given = dict(given)
    flags = core.flags
    if given.pop("soft", False):
        shines = ("CAST_SHADOW", "USE_MIS", "CAMERA", "DIFFUSE", "GLOSSY", "TRANSMISSION", "SOFT_FALLOFF")
        given["flags"] = sum(flags["HW_LIGHT_" + name] for name in shines)
    scene.upsert_light(
        number, f"{kind} {number}", type, placed(0.3, 0.2, 1.5), power=power / (10 if type == "sun" else 1), **given
    )


def world(scene, lit):
    scene.set_world("sky", (0.3, 0.4, 0.5) if lit else (0.0, 0.0, 0.0))


def emissive(scene, lit):
    if lit:
        scene.upsert_instance(7, 1, placed(-0.5, 0.3, 0.9, 0.2), materials=[reuse_scenes.GLOW])
    else:
        scene.remove_instance(7)


def light(core, scene, kind, lit):
    """Brings one kind of light, or takes it away."""
    if kind == "world":
        world(scene, lit)
    elif kind == "triangles":
        emissive(scene, lit)
    elif lit:
        lamp(core, scene, 1, kind)
    else:
        scene.remove_light(1)


def glossy_floor(core):
    """A floor whose BSDF rays find lamps about as often as light samples do."""
    scene = core.Scene()
    reuse_scenes.glossy(scene)
    reuse_scenes.glowing(scene)
    scene.upsert_mesh(1, "quad", QUAD, QUAD_TRIANGLES)
    scene.upsert_instance(1, 1, placed(scale=2.0, turn=0.1), materials=[reuse_scenes.GLOSSY])
    scene.set_camera("perspective", placed(z=4), (-0.5, 0.5, -0.5, 0.5))
    return scene


def lit_picture(core, session, **other):
    given = {"integrator": "path", "lights": "tree", "max_bounces": 1, "seed": 3, **other}
    return core_scenes.picture(core, None, None, 24, session, passes=["Combined"], **given)["Combined"]


@pytest.mark.parametrize("kind", EVERY)
def test_kernels_of_one_kind_give_the_picture_of_kernels_of_all(core, make_context, kind):
    scene = glossy_floor(core)
    session = core.Session(make_context(), scene)
    light(core, scene, kind, True)
    alone = lit_picture(core, session)
    assert alone[..., :3].mean() > 0.01
    # Lamps without power are of the table and never chosen.
    for i, other in enumerate(LAMPS):
        lamp(core, scene, 10 + i, other, power=0.0)
    among_others = lit_picture(core, session)
    np.testing.assert_allclose(among_others, alone, rtol=1e-4, atol=1e-5)


def test_kinds_that_come_and_go(core, make_context):
    """In one session each picture is that of a session that begins with it."""
    context = make_context()
    scene = glossy_floor(core)
    session = core.Session(context, scene)
    lamp(core, scene, 50, "point")
    for kind in ("rectangle", "ellipse", "spread", "sun", "spot", "ball", "world", "triangles"):
        light(core, scene, kind, True)
        seen = lit_picture(core, session)
        fresh = glossy_floor(core)
        lamp(core, fresh, 50, "point")
        light(core, fresh, kind, True)
        np.testing.assert_array_equal(seen, lit_picture(core, core.Session(context, fresh)), err_msg=kind)
        light(core, scene, kind, False)


@pytest.mark.parametrize("kind", ["ellipse", "triangles"])
def test_points_that_are_reused_have_the_light_of_path(core, make_context, kind):
    """Reused samples are points on lights, which kernels of one kind evaluate too."""
    scene = glossy_floor(core)
    for i in range(9):  # with fewer, restir is path
        at = placed(-1.2 + 0.3 * i, 0.4 * (i % 3), 1.4, 0.2)
        if kind == "triangles":
            scene.upsert_instance(100 + i, 1, at, materials=[reuse_scenes.GLOW])
        else:
            scene.upsert_light(100 + i, f"{kind} {i}", LAMPS[kind][0], at, power=8.0, **LAMPS[kind][1])
    session = core.Session(make_context(), scene)
    runs, truth = (
        [
            lit_picture(core, session, integrator=integrator, lights="auto", max_bounces=0, samples=samples, seed=seed)[
                ..., :3
            ]
            for seed in range(12)
        ]
        for integrator, samples in (("restir", 4), ("path", 16))
    )
    assert_same_light(runs, truth, percent=9)
