# SPDX-License-Identifier: Apache-2.0
"""Makes scenes/night_market: a street of stalls on a wet night, 48 frames, lit by hundreds of small lamps.

    python make_night_market.py -o night_market.blend [--lights 700] [--frames 48] [--size 640x360] [--seed 7]

Runs in bpy (or in Blender: `blender -b -P make_night_market.py -- -o …`). Everything, pictures too, is made here and
packed. --lights counts light sources: lamps and emissive meshes; what the fixed ones do not fill is made of strings of
bulbs. The picture is one street seen in depth: warm goods at both sides, cold sky and neon above, a wet road between
that doubles all of it, a red umbrella as its middle.
"""

import argparse
import math
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))

import lamps
import life
import materials
import stalls
import street
import textures
from shapes import new_collection, place


def make(lights=700, frames=48, size=(640, 360), seed=7):
    """Builds the scene in an empty bpy session. Returns {"lights", "objects", "seconds"}."""
    started = time.perf_counter()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = "Night market"
    rng = np.random.default_rng(seed)
    m = materials.build()

    parts = {name: new_collection(name, scene.collection) for name in ("Street", "Stalls", "Lamps", "Life")}
    street.ground(m, parts["Street"])
    street.kerbs(m, parts["Street"], seed)
    made = street.houses(m, parts["Street"], rng)
    street.gate(m, parts["Street"])
    street.tower(m, parts["Street"])

    meshes = lamps.lantern_meshes(m)
    goods = stalls.Goods(m)
    frames_by_awning = {name: stalls.frame(f"Stall {name}", name, m) for name in materials.AWNINGS}
    fronts = []
    for index, y in enumerate(np.arange(-8.2, 30, 3.5)):
        for side in (-1, 1):
            awning = list(materials.AWNINGS)[(2 * index + (side > 0) * 3) % 5]
            turn = (0.0 if side < 0 else math.pi) + rng.normal(0, 0.025)
            where = (side * (2.62 + rng.uniform(0, 0.12)), y + (side > 0) * 0.9 + rng.uniform(-0.15, 0.15), 0)
            front = place(f"Stall {awning}", frames_by_awning[awning], parts["Stalls"], where, (0, 0, turn))
            kind = goods.KINDS[(index + (side > 0) * 2) % len(goods.KINDS)]
            goods.lay(kind, front, parts["Stalls"], rng)
            made += lamps.stall_lights(m, parts["Lamps"], meshes, front, index, side, rng, frames)
            fronts.append(front)

    made += lamps.garlands(m, parts["Lamps"], meshes, rng, frames)
    made += lamps.signs(m, parts["Lamps"], rng)
    made += lamps.neon(m, parts["Lamps"], rng)
    made += lamps.sky_lanterns(m, parts["Lamps"], rng, frames)
    made += lamps.gate_lights(m, parts["Lamps"], meshes)
    made += lamps.moon(parts["Lamps"])
    made += life.carp(m, parts["Life"], frames)
    life.people(m, parts["Life"], frames, rng)
    life.sellers(m, parts["Life"], fronts, rng)
    life.banners(m, parts["Life"], frames, rng)
    made += lamps.bulb_strings(m, parts["Lamps"], lights - made, rng)

    world(scene)
    camera(scene, frames)
    output(scene, frames, size)
    return {"lights": made, "objects": len(scene.objects), "seconds": round(time.perf_counter() - started, 2)}


def world(scene):
    """The night sky as environment."""
    scene.world = bpy.data.worlds.new("Night")
    if bpy.app.version < (5, 0):  # always true since 5.0
        scene.world.use_nodes = True
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexEnvironment")
    sky.image = textures.night_sky()
    tree.links.new(sky.outputs["Color"], tree.nodes["Background"].inputs["Color"])


def camera(scene, frames):
    """A slow push down the street at eye height, a little sway, focus on the umbrella."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width = 28, 36
    data.clip_start, data.clip_end = 0.05, 400
    data.dof.use_dof = True
    data.dof.focus_distance = 6.4
    data.dof.aperture_fstop = 2.4
    eye = place("Camera", data, scene.collection)
    for frame in range(1, frames + 6, 6):
        t = (frame - 1) / 47
        eye.location = (-0.45 + 0.35 * t, -11.4 + 1.9 * t, 1.22 + 0.012 * math.sin(t * 9))
        eye.rotation_euler = (math.radians(92.6) - 0.008 * t, 0.004 * math.sin(t * 6), math.radians(-3.2 + 2.2 * t))
        eye.keyframe_insert("location", frame=frame)
        eye.keyframe_insert("rotation_euler", frame=frame)
    scene.camera = eye


def output(scene, frames, size):
    """Size, length and view: AgX with more contrast, exposed for the lanterns."""
    scene.frame_start, scene.frame_end = 1, frames
    scene.frame_set(1)
    render = scene.render
    render.fps = 24
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Punchy"
    scene.view_settings.exposure = 0.5
    if hasattr(scene, "cycles"):
        render.engine = "CYCLES"
        scene.cycles.max_bounces = 6


def size(text):
    """WIDTHxHEIGHT, both above 0."""
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f'"{text}" is not WIDTHxHEIGHT') from None
    if width < 1 or height < 1:
        raise argparse.ArgumentTypeError("width and height must be above 0")
    return width, height


def main():
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="the .blend to write")
    parser.add_argument("--lights", type=int, default=700, help="light sources, at least the fixed ones (about 470)")
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--size", type=size, default=(640, 360), metavar="WxH")
    parser.add_argument("--seed", type=int, default=7)
    options = parser.parse_args(arguments)
    if options.frames < 1:
        parser.error("--frames must be 1 or more")
    report = make(options.lights, options.frames, options.size, options.seed)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(options.output.resolve()), compress=True)
    print(f"{options.output}: {report['lights']} lights, {report['objects']} objects, made in {report['seconds']} s")


if __name__ == "__main__":
    main()
