# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of the current scene by Cycles and by Headwater under the same settings, for tests that compare them.

Runs inside a process with bpy and the add-on (bpy_process.run with fake=False).
"""

import os

import bpy
import numpy as np

from headwater.image_io import read_exr

# Blender's layer names as read from multilayer files are "<view layer>.<pass>".
SWITCHES = (
    "z mist position normal vector uv object_index material_index diffuse_direct diffuse_indirect diffuse_color "
    "glossy_direct glossy_indirect glossy_color transmission_direct transmission_indirect transmission_color emit "
    "environment"
).split()


def settings(scene, width: int, height: int, bounces: int = 4):
    """Plain settings for both engines: no clamping, no adaptive sampling, no denoising, Cycles' properties rule."""
    scene.headwater.use_cycles_settings = True
    render, cycles = scene.render, scene.cycles
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.use_border = render.use_motion_blur = render.use_compositing = render.use_sequencer = False
    render.threads_mode = "AUTO"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    image = render.image_settings
    image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER"
    image.color_depth = "32"


def passes(view_layer, wanted=SWITCHES, denoising: bool = True):
    """Switches the view layer's passes: those named in `wanted` on, all others off."""
    for name in SWITCHES:
        setattr(view_layer, "use_pass_" + name, name in wanted)
    view_layer.cycles.denoising_store_passes = denoising


def picture(engine: str, folder: str, samples: int, seed: int = 1) -> dict:
    """{pass: (H, W, C) float64, top row first} of the first view layer."""
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.cycles.samples, scene.cycles.seed = samples, seed
    path = os.path.join(folder, "picture.exr")
    if os.path.exists(path):
        os.unlink(path)
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    prefix = scene.view_layers[0].name + "."
    found = read_exr(path)
    return {
        name.removeprefix(prefix): np.asarray(pixels, np.float64).reshape(*pixels.shape[:2], -1)
        for name, pixels in found.layers.items()
    }


def clear(scene):
    """Removes every object, and gives the scene a black world."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    scene.world = world
    sky((0.0, 0.0, 0.0))


def sky(color, strength: float = 1.0):
    """Sets the world's constant colour."""
    background = bpy.context.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*color, 1.0)
    background.inputs["Strength"].default_value = strength


def camera(location, target, kind: str = "PERSP", lens: float = 35.0):
    """Adds a camera that looks at a point and makes it the scene's."""
    from mathutils import Vector

    data = bpy.data.cameras.new("Camera")
    data.type, data.lens = kind, lens
    thing = bpy.data.objects.new("Camera", data)
    thing.location = location
    thing.rotation_euler = (Vector(target) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(thing)
    bpy.context.scene.camera = thing
    return thing


def lamp(kind: str, location, energy: float, rotation=(0, 0, 0), **values):
    """Adds a lamp; `values` are properties of its data."""
    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for name, value in values.items():
        setattr(data, name, value)
    thing = bpy.data.objects.new(kind, data)
    thing.location, thing.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(thing)
    return thing


def principled(name: str, **inputs):
    """A material of one Principled BSDF; `inputs` by socket name with _ for spaces."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    node = material.node_tree.nodes["Principled BSDF"]
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    return material


def shape(kind: str, location=(0, 0, 0), scale=(1, 1, 1), rotation=(0, 0, 0), material=None, smooth=False):
    """Adds a primitive mesh ("plane", "cube", "uv_sphere", "cone", "torus") with UVs."""
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(location=location, rotation=rotation)
    thing = bpy.context.object
    thing.scale = scale
    if material is not None:
        thing.data.materials.append(material)
    for polygon in thing.data.polygons:
        polygon.use_smooth = smooth
    return thing
