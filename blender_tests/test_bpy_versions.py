# SPDX-License-Identifier: Apache-2.0
"""Other bpy modules than this environment's: they enable the add-on, render a still and an animation to the same bits.

HEADWATER_BPYS has a line "VERSION COMMAND" for each; `./dev test --bpy` gets them from PyPI. Without, all is skipped.
"""

import os
import shlex

import numpy as np
import pytest
from bpy_process import BPY, run

from headwater.image_io import read_exr

pytest.importorskip("bpy")

VERSIONS = dict(line.split(None, 1) for line in os.environ.get("HEADWATER_BPYS", "").splitlines())

# Nothing of the startup file, which differs: all sockets are set, or have had one default since Blender 4.0.
_SCENE = """
D = bpy.data
for obj in list(D.objects): D.objects.remove(obj)
def material(name, **inputs):
    made = D.materials.new(name)
    made.use_nodes = True
    node = next(n for n in made.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    for socket, value in inputs.items(): node.inputs[socket.replace("_", " ")].default_value = value
    return made
def add(name, data, place, *materials):
    made = D.objects.new(name, data)
    made.location = place
    scene.collection.objects.link(made)
    for one in materials: data.materials.append(one)
    return made
def grid(name, size, n, height):
    mesh = D.meshes.new(name)
    side = range(n + 1)
    points = [(size * (x / n - .5), size * (y / n - .5), height(x / n, y / n)) for y in side for x in side]
    corners = [y * (n + 1) + x for y in range(n) for x in range(n)]
    mesh.from_pydata(points, [], [(i, i + 1, i + n + 2, i + n + 1) for i in corners])
    return mesh
wave = grid("wave", 3, 12, lambda x, y: .3 * np.sin(9 * x) * np.cos(7 * y))
wave.polygons.foreach_set("use_smooth", [True] * len(wave.polygons))
add("floor", grid("floor", 9, 1, lambda x, y: -.5), (0, 0, 0), material("floor", Roughness=.4))
moving = add("wave", wave, (0, 0, .4), material("wave", Base_Color=(.2, .4, .8, 1), Metallic=.6, Roughness=.25))
cube = grid("card", 1, 1, lambda x, y: 0)
bevelled = add("card", cube, (1.6, -.6, .6), material("card", Base_Color=(.8, .2, .1, 1), Alpha=.7))
bevelled.rotation_euler = (1, .4, 0)
bevelled.modifiers.new("a", "ARRAY").count = 3
for name, kind, place, power in (("point", "POINT", (2, -2, 3), 300), ("area", "AREA", (-2, -1, 3), 90)):
    lamp = D.lights.new(name, kind)
    lamp.energy = power
    add(name, lamp, place)
camera = D.cameras.new("camera")
scene.camera = add("camera", camera, (0, -7, 3))
scene.camera.rotation_euler = (1.2, 0, 0)
scene.world = D.worlds.new("w")
scene.world.use_nodes = True
sky = next((n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND"), None)
sky = sky or scene.world.node_tree.nodes.new("ShaderNodeBackground")
sky.inputs["Color"].default_value, sky.inputs["Strength"].default_value = (.3, .4, .6, 1), .4
out = next((n for n in scene.world.node_tree.nodes if n.type == "OUTPUT_WORLD"), None)
out = out or scene.world.node_tree.nodes.new("ShaderNodeOutputWorld")
scene.world.node_tree.links.new(sky.outputs[0], out.inputs[0])
scene.render.resolution_x, scene.render.resolution_y = 96, 64
scene.headwater.samples, scene.headwater.seed = 16, 3
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
moving.keyframe_insert("location", frame=1)
moving.location.x += 1
moving.keyframe_insert("location", frame=3)
scene.frame_start, scene.frame_end = 1, 3
scene.frame_set(1)
from headwater_addon import engine
scene.render.filepath = tmp + "/still.exr"
bpy.ops.render.render(write_still=True)
assert not engine.last_error, engine.last_error
scene.render.filepath = tmp + "/frame_####.exr"
bpy.ops.render.render(animation=True)
assert not engine.last_error, engine.last_error
show(version=bpy.app.version_string, core=core.__file__)
hb.addon().unregister()
show(left=[name for name in dir(bpy.types.Scene) if "headwater" in name])
"""
PICTURES = ("still", "frame_0001", "frame_0002", "frame_0003")


def _combined(path):
    (pixels,) = read_exr(str(path)).layers.values()
    return np.asarray(pixels, float)[..., :3]


def _pictures(tmp, command=None):
    tmp.mkdir()
    facts = run(_SCENE, tmp, fake=False, timeout=300, bpy=command or BPY)
    return facts, {name: _combined(tmp / f"{name}.exr") for name in PICTURES}


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return _pictures(tmp_path_factory.mktemp("bpy") / "own")[1]


@pytest.mark.parametrize("version", VERSIONS or [None])
def test_pictures_are_those_of_this_bpy(version, reference, tmp_path):
    if version is None:
        pytest.skip("HEADWATER_BPYS names no other bpy: ./dev test --bpy gets some")
    facts, pictures = _pictures(tmp_path / "other", shlex.split(VERSIONS[version]))
    assert facts["version"].startswith(version) and facts["left"] == []
    for name in PICTURES:
        assert pictures[name].std() > 0.05, name
        assert np.array_equal(pictures[name], reference[name]), (name, np.abs(pictures[name] - reference[name]).max())
    assert np.abs(pictures["frame_0003"] - pictures["frame_0001"]).mean() > 0.01
