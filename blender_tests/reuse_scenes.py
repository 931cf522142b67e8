# SPDX-License-Identifier: Apache-2.0
"""Scenes with many lights for the tests of reservoir integrators, made straight in the core, and their pictures."""

import core_scenes
import numpy as np
from core_scenes import QUAD, QUAD_TRIANGLES, placed

from headwater.materials import Graph, Surface, closures

WIDTH, HEIGHT = 32, 18
INTEGRATORS = ["path", "restir", "restir-reproject", "wssr-kd", "wssr-grid", "wssr-grid-reproject"]
RESERVOIRS = INTEGRATORS[1:]
# Ids: materials and meshes below 100, instances and lamps as they come.
MATTE, GLOSSY, GLASS, GLOW = 1, 2, 3, 4
ROOM = 2.0  # half the side of the floor


def material(scene, number, add):
    """Upserts the material whose closures `add(graph, surface)` adds."""
    graph = Graph()
    surface = Surface(graph)
    emission = add(graph, surface) or (0.0, 0.0, 0.0)
    compiled = surface.finish([], [], [])
    scene.upsert_material(
        number, f"material {number}", compiled.program, compiled.constants, flags=compiled.flags, emission=emission
    )


def matte(scene, number=MATTE, albedo=(0.7, 0.6, 0.5)):
    """Upserts a Lambertian material."""
    material(scene, number, lambda g, s: closures.add_diffuse(s, g.one, g.const(*albedo), g.zero, g.normal))


def glossy(scene, number=GLOSSY, roughness=0.35):
    """Upserts GGX reflection over a little diffuse."""

    def add(g, s):
        closures.add_diffuse(s, g.const(0.3), g.const(0.8, 0.4, 0.3), g.zero, g.normal)
        closures.add_glossy(s, g.const(0.7), g.one, g.const(roughness), g.zero, g.zero, g.normal, g.zero, 0)

    material(scene, number, add)


def glass(scene, number=GLASS):
    """Upserts rough glass and what shines through paper."""

    def add(g, s):
        closures.add_glass(s, g.const(0.5), g.one, g.const(0.5), g.const(1.4), g.normal, 0)
        closures.add_translucent(s, g.const(0.5), g.const(0.9, 0.8, 0.6), g.normal)

    material(scene, number, add)


def glowing(scene, number=GLOW, radiance=(4.0, 3.0, 1.0)):
    """Upserts a material that only emits."""

    def add(g, s):
        s.emit(g.const(*radiance))
        return tuple(radiance)

    material(scene, number, add)


def frame(x, y, z, at):
    """Object to world of three column vectors and a place."""
    return np.stack([*(np.asarray(v, np.float32) for v in (x, y, z, at))], 1).astype(np.float32)


def looking(eye, target):
    """Matrix of a camera at `eye` that looks at `target`."""
    eye, target = np.asarray(eye, float), np.asarray(target, float)
    z = (eye - target) / np.linalg.norm(eye - target)
    x = np.cross((0, 0, 1), z)
    x /= np.linalg.norm(x)
    return frame(x, np.cross(z, x), z, eye)


def camera(scene, eye=(0.4, -4.2, 2.4), target=(0, 0, 0.5)):
    """A perspective camera of the shape of the tests' pictures."""
    half = 0.45
    scene.set_camera("perspective", looking(eye, target), (-half, half, -half * HEIGHT / WIDTH, half * HEIGHT / WIDTH))


def room(scene, walls=True):
    """A matte floor, a glossy wall and a glossy box, a sheet of rough glass and paper, and the camera."""
    matte(scene)
    glossy(scene)
    glass(scene)
    scene.upsert_mesh(1, "quad", QUAD, QUAD_TRIANGLES)
    scene.upsert_instance(1, 1, placed(scale=ROOM), name="floor", materials=[MATTE])
    if walls:
        scene.upsert_instance(2, 1, frame((2, 0, 0), (0, 0, 1), (0, -1, 0), (0, ROOM, 1)), materials=[GLOSSY])
        scene.upsert_instance(3, 1, frame((0, 0.5, 0), (0, 0, 0.5), (1, 0, 0), (0.9, -0.3, 0.5)), materials=[GLASS])
    scene.upsert_instance(4, 1, frame((0.4, 0.1, 0), (-0.1, 0.4, 0), (0, 0, 1), (-0.7, 0.2, 0.7)), materials=[GLOSSY])
    scene.upsert_instance(5, 1, frame((0.4, 0.1, 0), (0, 0, 0.35), (0, -1, 0), (-0.65, -0.2, 0.35)), materials=[MATTE])
    camera(scene)


def lamps(scene, count, factor=1.0, first=100, seed=7, mixed=True):
    """Upserts `count` lamps of all kinds (else points) over the room; they send out some hundred watts in all."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        x, y = rng.uniform(-1.7, 1.7, 2)
        z = rng.uniform(1.2, 2.6)
        power = float(rng.uniform(0.2, 1) * 300 / count * factor)
        color = tuple(float(c) for c in rng.uniform(0.3, 1, 3))
        kind = i % 8 if mixed else 0
        given = {"color": color, "power": power}
        if kind in (1, 2):
            scene.upsert_light(
                first + i, f"lamp {i}", "point", placed(x, y, z), radius=0.15 * kind, flags=None, **given
            )
        elif kind == 3:
            scene.upsert_light(
                first + i, f"lamp {i}", "spot", placed(x, y, z), spot_size=1.2, spot_blend=0.3, radius=0.1, **given
            )
        elif kind == 4:
            scene.upsert_light(first + i, f"lamp {i}", "area", placed(x, y, z), size_x=0.5, size_y=0.3, **given)
        elif kind == 5:
            scene.upsert_light(
                first + i, f"lamp {i}", "area", placed(x, y, z), size_x=0.6, size_y=0.6, ellipse=True, **given
            )
        elif kind == 6 and i < 8:
            scene.upsert_light(
                first + i, f"lamp {i}", "sun", frame((1, 0, 0), (0, 0.8, 0.6), (0, -0.6, 0.8), (0, 0, 0)), color=color,
                power=0.2 * factor, angle=0.05,
            )  # fmt: skip
        else:
            scene.upsert_light(first + i, f"lamp {i}", "point", placed(x, y, z), **given)


def glowing_quads(scene, count, factor=1.0, first=500, seed=11, scale=0.15):
    """Places `count` glowing squares (two lights each) about the room, some near its surfaces."""
    glowing(scene, radiance=tuple(float(c) * factor for c in (6.0, 4.0, 2.0)))
    rng = np.random.default_rng(seed)
    for i in range(count):
        at = (*rng.uniform(-1.6, 1.6, 2), rng.uniform(0.15, 1.6))
        turn = rng.normal(size=(3, 3))
        q, _ = np.linalg.qr(turn)
        q *= scale
        scene.upsert_instance(first + i, 1, frame(q[0], q[1], q[2], at), name=f"glow {i}", materials=[GLOW])


def many_lights(core, factor=1.0):
    """The room under 24 lamps of every kind, 8 glowing squares and a dim sky: 41 lights."""
    scene = core.Scene()
    room(scene)
    lamps(scene, 24, factor)
    glowing_quads(scene, 8, factor)
    scene.set_world("sky", tuple(c * factor for c in (0.05, 0.07, 0.1)))
    return scene


def render(core, session, integrator="path", **settings):
    """Combined's colour (H, W, 3) of one render; 1 sample, direct light, unless `settings` say otherwise."""
    given = {"width": WIDTH, "height": HEIGHT, "samples": 1, "max_bounces": 0, "passes": ["Combined"]}
    made = core_scenes.picture(core, None, None, 0, session, **{**given, "integrator": integrator, **settings})
    return made["Combined"][..., :3]


def renders(core, session, seeds, integrator="path", **settings):
    """Independent pictures, one a seed."""
    return [render(core, session, integrator, seed=int(seed), **settings) for seed in seeds]
