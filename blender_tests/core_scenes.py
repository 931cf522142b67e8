# SPDX-License-Identifier: Apache-2.0
"""Small scenes made straight in the core, and the picture of one: for tests of tracers, determinism and statistics."""

import numpy as np

EYE = np.eye(4, dtype=np.float32)[:3].copy()
QUAD = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
QUAD_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
PASSES = ["Combined", "Depth", "Position", "Normal", "UV", "Object Index", "Mist"]


def placed(x=0.0, y=0.0, z=0.0, scale=1.0, turn=0.0):
    """Object to world: scaled, turned about Z, moved."""
    c, s = np.cos(turn) * scale, np.sin(turn) * scale
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, scale, z]], np.float32)


def bumpy(count=24, seed=3):
    """A grid with random heights: positions and triangles."""
    v, u = np.mgrid[0 : count + 1, 0 : count + 1] / count * 2 - 1
    heights = np.random.default_rng(seed).uniform(0, 0.25, u.shape)
    positions = np.stack([u, v, heights], -1).reshape(-1, 3).astype(np.float32)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    corners = np.stack([first, first + 1, first + count + 2, first + count + 1], 1)
    return positions, corners[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.uint32)


def open_scene(core):
    """A rough ground, a swarm of instances, lamps of each kind, a grey sky."""
    scene = core.Scene()
    scene.upsert_mesh(1, "ground", *bumpy())
    scene.upsert_mesh(2, "quad", QUAD, QUAD_TRIANGLES)
    # Turned, so that no pixel's centre lies on an edge, where rounding would say which side is seen.
    scene.upsert_instance(1, 1, placed(scale=2.0, turn=0.1), object_index=1)
    rng = np.random.default_rng(5)
    places = [placed(*rng.uniform((-1.5, -1.5, 0.4), (1.5, 1.5, 1)), 0.2, rng.uniform(0, 6)) for _ in range(20)]
    scene.upsert_instances(10, 2, np.stack(places), object_index=2)
    scene.upsert_light(1, "point", "point", placed(1, 0, 2), power=60.0, radius=0.2)
    scene.upsert_light(2, "area", "area", placed(-1, 0, 2), power=40.0, color=(1.0, 0.5, 0.2))
    scene.upsert_light(3, "sun", "sun", EYE, power=0.4, angle=0.1)
    scene.set_world("sky", (0.1, 0.2, 0.3))
    scene.set_camera("perspective", placed(z=4), (-0.5, 0.5, -0.5, 0.5))
    return scene


def picture(core, context, scene, size=48, session=None, **settings):
    """{pass: pixels} of one render. `settings`: of Session.start."""
    session = session or core.Session(context, scene)
    session.sync()
    session.start({"width": size, "height": size, "samples": 4, "max_bounces": 4, "passes": PASSES, **settings})
    while not session.wait(1000):
        pass
    session.finish()
    return {name: np.array(session.read(name), np.float64) for name, _ in session.passes()}
