# SPDX-License-Identifier: Apache-2.0
"""The objects of `heads` outdoors: under suns, or under a sky that is one picture and the only light."""

import math

import bpy
import heads
import numpy as np
import surfaces

WIDTH = 2048  # pixels of the sky's picture, twice its height


def build_sun(scene, lights: int, seed: int) -> None:
    """`lights` suns around the zenith under a faint blue background; their power together is one sun's."""
    heads.objects(scene, seed)
    for i in range(lights):
        data = bpy.data.lights.new("Sun", "SUN")
        data.energy, data.angle = 4.0 / lights, math.radians(0.53)
        data.color = (1.0, 0.93, 0.8)
        sun = bpy.data.objects.new("Sun", data)
        sun.rotation_euler = (math.radians(48), 0, math.radians(40) + 2 * math.pi * i / lights)
        scene.collection.objects.link(sun)
    world = _world(scene)
    background = next(node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (0.35, 0.5, 0.8, 1.0)
    background.inputs["Strength"].default_value = 0.25


def build_sky(scene, lights: int, seed: int) -> None:
    """A high-dynamic-range sky with `lights` small bright discs, of one power together; the only light there is."""
    heads.objects(scene, seed)
    world = _world(scene)
    tree = world.node_tree
    picture = tree.nodes.new("ShaderNodeTexEnvironment")
    pixels = sky(lights, np.random.default_rng(seed))
    image = bpy.data.images.new("Sky", WIDTH, WIDTH // 2, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
    image.pack()
    picture.image = image
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    tree.links.new(picture.outputs["Color"], background.inputs["Color"])


def sky(lights: int, rng) -> np.ndarray:
    """(H, W, 4) radiance of an equirectangular sky, bottom row first: a gradient, clouds, discs of 0.6 degrees."""
    height, width = WIDTH // 2, WIDTH
    up = ((np.arange(height) + 0.5) / height - 0.5) * math.pi  # elevation of a row
    round_ = ((np.arange(width) + 0.5) / width - 0.5) * 2 * math.pi
    towards = np.clip(np.sin(up), 0, 1)[:, None, None]
    out = np.ones((height, width, 4))
    out[..., :3] = np.array([0.75, 0.8, 0.85]) * (1 - towards) ** 3 + np.array([0.12, 0.25, 0.6]) * towards
    noise = surfaces.smooth_noise(height, 6, 11)
    clouds = np.clip(np.concatenate([noise, noise], 1) * 3 - 1.7, 0, 1)[..., None]
    out[..., :3] += clouds * 0.6 * (np.sin(up) > 0)[:, None, None]
    out[up < 0, :, :3] = (0.09, 0.08, 0.07)
    radius = math.radians(0.3)
    radiance = 4.0 / (math.pi * radius**2) / max(lights, 1)  # 4 W per square metre together, seen at right angles
    for _ in range(lights):
        azimuth, elevation = rng.uniform(-math.pi, math.pi), math.asin(rng.uniform(0.25, 0.95))
        rows = np.flatnonzero(np.abs(up - elevation) <= radius)
        for row in rows:
            away = (round_ - azimuth + math.pi) % (2 * math.pi) - math.pi
            cosine = np.sin(up[row]) * math.sin(elevation) + np.cos(up[row]) * math.cos(elevation) * np.cos(away)
            out[row, cosine >= math.cos(radius), :3] += radiance * np.array([1.0, 0.92, 0.78])
    return out


def _world(scene):
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    scene.world = world
    return world
