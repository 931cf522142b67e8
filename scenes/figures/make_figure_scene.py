# SPDX-License-Identifier: Apache-2.0
"""Makes the scenes on which `headwater figures` reproduces the paper's figures.

    python scenes/figures/make_figure_scene.py room   -o room.blend   [--lights 1400] [--seed 1] [--size 640x360]
    python scenes/figures/make_figure_scene.py garden -o garden.blend [--lights 700]
    python scenes/figures/make_figure_scene.py town   -o town.blend   [--lights 2600]

Runs in bpy. Everything, pictures too, is made here and packed; the same arguments make the same scene. --lights counts
light sources: lamps and emissive objects; what the fixed ones do not fill is made of small ones. --facts writes what
the figures have to know of a scene (lights, triangles, the camera's place) as JSON.

room: a classroom decked out for a feast, most of its lights hidden from any one point; garden: lanterns under the sky
of dusk; town: a boulevard 260 m long, more than a grid of 50 m about the camera reaches.
"""

import argparse
import json
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "night_market"))  # shapes, textures
sys.path.insert(0, str(Path(__file__).resolve().parent))

import garden
import room
import town

KINDS = {"room": (room.build, 1400), "garden": (garden.build, 700), "town": (town.build, 2600)}


def make(kind: str, lights: int | None = None, size=(640, 360), seed: int = 1) -> dict:
    """Builds a scene in an empty bpy session. Returns its facts, JSON-ready; places are in metres, world space."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = kind.title()
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.frame_start = scene.frame_end = 1
    build, default = KINDS[kind]
    made = build(scene, default if lights is None else lights, seed)
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.cycles.sample_clamp_indirect = 0.0
    graph = bpy.context.evaluated_depsgraph_get()
    triangles = 0
    for item in graph.object_instances:
        if item.object.type == "MESH":
            triangles += sum(len(polygon.vertices) - 2 for polygon in item.object.data.polygons)
    return {
        "scene": kind,
        "seed": seed,
        "lights": made,
        "objects": len(scene.objects),
        "triangles": triangles,
        "camera": list(scene.camera.matrix_world.translation),
    }


def main() -> int:
    """Parses the command line, makes the scene and saves it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=list(KINDS))
    parser.add_argument("-o", "--output", required=True, metavar="FILE.blend")
    parser.add_argument("--lights", type=int, metavar="N", help="light sources, at least the fixed ones")
    parser.add_argument("--size", default="640x360", metavar="WxH")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--facts", metavar="OUT.json")
    args = parser.parse_args(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else None)
    if args.lights is not None and args.lights < 0:
        parser.error("--lights must not be negative")
    if args.seed < 0:
        parser.error("--seed must not be negative")
    try:
        width, height = (int(n) for n in args.size.lower().split("x"))
    except ValueError:
        parser.error(f"'{args.size}' is no size WxH")
    if width < 1 or height < 1:
        parser.error("width and height must be above 0")
    facts = make(args.kind, args.lights, (width, height), args.seed)
    output = Path(args.output).resolve()
    output.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(output), compress=True)
    if args.facts:
        Path(args.facts).write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    print(f"{output.name}: {facts['lights']} lights, {facts['objects']} objects, {facts['triangles']} triangles")
    return 0


if __name__ == "__main__":
    sys.exit(main())
