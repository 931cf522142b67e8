# SPDX-License-Identifier: Apache-2.0
"""Makes the .blend files that `headwater bench`, `headwater bench-speed` and the measurement pages use.

    python scenes/benchmark/make_benchmark.py heads   -o heads-4.blend       --lights 4
    python scenes/benchmark/make_benchmark.py streets -o streets-1000.blend  --lights 1000

| KIND    | --lights N counts                                         | default |
| ------- | --------------------------------------------------------- | ------- |
| heads   | large area lamps over a hundred objects                   | 4       |
| sun     | suns over the same objects                                | 1       |
| sky     | small bright discs in a sky's picture, the only light     | 1       |
| streets | lamps of all kinds in a town                              | 1,000   |
| city    | the same town; half the lamps are cars' and move          | 1,000   |
| rooms   | emissive spheres in a maze of rooms, mostly hidden        | 1,000   |
| shades  | lamps within shades of cloth, paper and metal in a hall   | 400     |
| neon    | neon tubes over a glossy street                           | 200     |

Up to 10^6 lights: above 10,000 they are instances (spread.py). Runs in bpy. Everything, pictures too, is made here and
packed. The same arguments make the same scene. With --animate there are 48 frames in which the camera walks, every
tenth light drifts off, or both; the city's cars always drive. Elsewhere frame 2 differs from frame 1 in the place of
one object (keyframes), to measure what a small change costs.
"""

import argparse
import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

import animation
import city
import heads
import neon
import rooms
import shades
import skies
import streets

KINDS = {
    "heads": (heads.build, 4),
    "sun": (skies.build_sun, 1),
    "sky": (skies.build_sky, 1),
    "streets": (streets.build, 1000),
    "city": (city.build, 1000),
    "rooms": (rooms.build, 1000),
    "shades": (shades.build, 400),
    "neon": (neon.build, 200),
}


def make(kind: str, lights: int | None = None, size=(640, 360), seed: int = 1, moves: str = "") -> None:
    """Builds a scene in an empty bpy session."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = kind.title()
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.frame_start, scene.frame_end = 1, 2
    build, default = KINDS[kind]
    build(scene, default if lights is None else lights, seed)
    if moves:
        animation.animate(scene, moves, seed)
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.sample_clamp_indirect = 0.0
    if scene.frame_end == 2:
        _move_one(scene)
    scene.frame_set(1)


def _move_one(scene) -> None:
    """Keys the place of the last mesh, not of one that holds instances' places or one among those."""
    moved = next(o for o in reversed(scene.objects) if o.type == "MESH" and o.instance_type == "NONE" and not o.parent)
    moved.keyframe_insert("location", frame=1)
    moved.location.x += 0.3
    moved.keyframe_insert("location", frame=2)


def main() -> int:
    """Parses the command line, makes the scene and saves it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=list(KINDS))
    parser.add_argument("-o", "--output", required=True, metavar="FILE.blend")
    parser.add_argument("--lights", type=int, metavar="N", help="what they are: see the table in this file")
    parser.add_argument("--size", default="640x360", metavar="WxH")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--animate", choices=("camera", "lights", "both"), default="", help="48 frames: what moves")
    args = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else None)
    if args.lights is not None and args.lights < 0:
        parser.error("--lights must not be negative")
    try:
        width, height = (int(n) for n in args.size.lower().split("x"))
    except ValueError:
        parser.error(f"'{args.size}' is no size WxH")
    started = time.perf_counter()
    try:
        make(args.kind, args.lights, (width, height), args.seed, args.animate)
    except ValueError as error:
        parser.error(str(error))
    output = Path(args.output).resolve()
    output.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(output), compress=True)
    print(f"{output}  {len(bpy.data.objects)} objects  {time.perf_counter() - started:.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
