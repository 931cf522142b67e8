# SPDX-License-Identifier: Apache-2.0
"""Memory and time of a mesh of emissive triangles that is instanced: the second table of
docs/measurements/light_tree.md.

    python blender_tests/measure_many_emitters.py [TRIANGLES [INSTANCES]]
"""

import resource
import sys
import time

import core_scenes
import numpy as np
import reuse_scenes as rs

import headwater._core as core


def resident() -> int:
    """Bytes of memory that this process holds."""
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize()


def main() -> None:
    """The sync, a render by each way of choosing, and a move of all instances."""
    triangles, instances = (int(a) for a in (*sys.argv[1:], *("100000", "20")[len(sys.argv) - 1 :]))
    rng = np.random.default_rng(1)
    scene = core.Scene()
    rs.room(scene)
    rs.glowing(scene)
    positions, corners = core_scenes.bumpy(int(np.ceil((triangles / 2) ** 0.5)))
    scene.upsert_mesh(9, "emitter", positions, corners[:triangles])
    low, high = (-1.9, -1.9, 1.5), (1.9, 1.9, 2.5)
    places = np.stack([core_scenes.placed(*rng.uniform(low, high), 0.05, rng.uniform(0, 6)) for _ in range(instances)])
    scene.upsert_instances(900, 9, places, materials=[rs.GLOW])
    context = core.Context(tracer="embree")
    session = core.Session(context, scene)
    began, before = time.process_time(), resident()
    lights = session.sync()["lights"]

    def told(what):
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        print(
            "%-22s %6.2f s of processor time; bytes a light: device %4.0f, resident %4.0f; peak %.2f GB"
            % (what, time.process_time() - began, context.memory / lights, (resident() - before) / lights, peak / 1e9),
            flush=True,
        )

    print(f"{lights} lights")
    told("sync")
    for what, given in (
        ("path, power", {"lights": "power"}),
        ("path, tree", {"lights": "tree"}),
        ("wssr-hash", {"integrator": "wssr-hash"}),
        ("restir, unbiased", {"integrator": "restir", "estimator": "unbiased"}),
    ):
        began = time.process_time()
        rs.render(core, session, **given)
        told(what)
    began = time.process_time()
    scene.upsert_instances(900, 9, places + np.float32(0.01), materials=[rs.GLOW])
    session.sync()
    told("all moved, by power")


if __name__ == "__main__":
    main()
