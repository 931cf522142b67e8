# SPDX-License-Identifier: GPL-3.0-or-later
"""The mean radiance of Cycles' Hosek-Wilkie skies, for addon/headwater/nodes/hosek_wilkie.py, and beside it ours.

    python blender_tests/measure_sky.py cycles|both

cycles: the numbers of that file, plain means and those weighed by the cosine to the zenith. both: ours over Cycles' at
places between those that were tabulated.
"""

import math
import os
import sys
import tempfile

import bpy
import numpy as np

import headwater.blender
from headwater.image_io import read_exr

WIDTH, HEIGHT = 64, 32
TABLE = [(turbidity, 0.3, height) for turbidity in (1, 2, 3, 4.5, 7, 10) for height in (0.5, 3, 8, 15, 25, 40, 60, 85)]
TABLE += [(turbidity, albedo, height) for turbidity in (2, 4.5) for albedo in (0, 1) for height in (3, 25, 60)]
BETWEEN = [(1.5, 0.3, 5), (2.2, 0.3, 20), (2.2, 0.3, 50), (2.2, 0.8, 50), (3.5, 0.0, 10), (6, 0.3, 30), (9, 0.3, 70)]


def picture(engine: str, turbidity: float, albedo: float, degrees: float, folder: str) -> np.ndarray:
    """The whole sky, equirectangular, top row first."""
    scene = bpy.context.scene
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.data.type, camera.data.panorama_type = "PANO", "EQUIRECTANGULAR"
    camera.rotation_euler.x = math.pi / 2
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type, sky.turbidity, sky.ground_albedo = "HOSEK_WILKIE", turbidity, albedo
    height = math.radians(degrees)
    sky.sun_direction = (0.6 * math.cos(height), 0.8 * math.cos(height), math.sin(height))
    tree.links.new(sky.outputs[0], tree.nodes["Background"].inputs[0])
    render = scene.render
    render.engine, render.resolution_x, render.resolution_y = engine, WIDTH, HEIGHT
    render.resolution_percentage = 100
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 4, False, False
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = os.path.join(folder, "sky.exr")
    bpy.ops.render.render(write_still=True)
    (pixels,) = read_exr(render.filepath).layers.values()
    return np.asarray(pixels, np.float64)[..., :3]


def mean(pixels: np.ndarray, power: int = 0) -> np.ndarray:
    """Over the directions above the horizon, weighed by a power of the cosine to the zenith."""
    above = pixels[: HEIGHT // 2].mean(1)
    theta = (np.arange(HEIGHT // 2) + 0.5) / HEIGHT * math.pi
    weights = np.sin(theta) * np.cos(theta) ** power
    return (above * weights[:, None]).sum(0) / weights.sum()


def main() -> None:
    headwater.blender.register()
    with tempfile.TemporaryDirectory() as folder:
        for place in BETWEEN if sys.argv[1] == "both" else TABLE:
            theirs = picture("CYCLES", *place, folder)
            ours = picture("HEADWATER", *place, folder) if sys.argv[1] == "both" else None
            line = f"turbidity {place[0]:4}, albedo {place[1]}, sun at {place[2]:4}:"
            for power in (0, 1):
                line += f" {mean(theirs, power).round(4).tolist()}"
                if ours is not None:
                    line += f", ours over it {(mean(ours, power) / mean(theirs, power)).round(3).tolist()};"
            print(line, flush=True)
    sys.stdout.flush()
    os._exit(0)  # some versions of bpy hang or crash at exit


if __name__ == "__main__":
    main()
