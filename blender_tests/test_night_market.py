# SPDX-License-Identifier: Apache-2.0
"""The demo's scene holds what it promises: lights of every kind, motion, a skinned mesh, instances, a size limit."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[1] / "scenes" / "night_market" / "make_night_market.py"

INSPECT = """
import json, sys
import bpy
import numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
scene = bpy.context.scene

def emissive(mesh):
    return any(
        slot and slot.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value > 0
        for slot in mesh.materials
    )

def look(frame):
    scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    out = {"lamps": {}, "emissive": 0, "triangles": 0, "instances": 0, "shapes": set(), "places": {}}
    for item in graph.object_instances:
        thing = item.object
        if thing.type == "LIGHT":
            kind = thing.data.type + ("/" + thing.data.shape if thing.data.type == "AREA" else "")
            out["lamps"][kind] = out["lamps"].get(kind, 0) + 1
            out["places"][thing.name] = list(item.matrix_world.translation)
        elif thing.type == "MESH":
            out["instances"] += item.is_instance
            out["triangles"] += len(thing.data.loop_triangles)
            out["emissive"] += emissive(thing.data)
    carp = scene.objects["Carp body"].evaluated_get(graph).to_mesh()
    points = np.empty(len(carp.vertices) * 3, np.float32)
    carp.vertices.foreach_get("co", points)
    banner = scene.objects["Banner"].evaluated_get(graph).to_mesh()
    cloth = np.empty(len(banner.vertices) * 3, np.float32)
    banner.vertices.foreach_get("co", cloth)
    out["carp"], out["banner"] = points, cloth
    out["eye"] = np.array(scene.camera.matrix_world)
    return out

a, b = look(1), look(scene.frame_end // 2)
moved = [n for n in a["places"] if np.abs(np.subtract(a["places"][n], b["places"][n])).max() > 0.01]
print("REPORT", json.dumps({
    "frames": [scene.frame_start, scene.frame_end], "fps": scene.render.fps, "lamps": a["lamps"],
    "emissive": a["emissive"], "triangles": a["triangles"], "instances": a["instances"], "moving_lamps": len(moved),
    "carp": float(np.abs(a["carp"] - b["carp"]).max()), "banner": float(np.abs(a["banner"] - b["banner"]).max()),
    "eye": float(np.abs(a["eye"] - b["eye"]).max()),
    "unpacked": [i.name for i in bpy.data.images if i.type == "IMAGE" and not i.packed_file],
}))
"""


def run(*command):
    return subprocess.run([sys.executable, *map(str, command)], capture_output=True, text=True, timeout=300)


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    blend = tmp_path_factory.mktemp("night market") / "scene.blend"
    made = run(SCRIPT, "-o", blend, "--frames", "24")
    assert made.returncode == 0, made.stdout + made.stderr
    looked = run("-c", INSPECT, blend)
    lines = [line for line in looked.stdout.splitlines() if line.startswith("REPORT ")]
    assert lines, looked.stdout + looked.stderr
    return json.loads(lines[0].removeprefix("REPORT "))


def test_lights_of_every_kind(report):
    lamps = report["lamps"]
    assert sum(lamps.values()) + report["emissive"] >= 500
    assert {"POINT", "SPOT", "SUN", "AREA/RECTANGLE", "AREA/SQUARE", "AREA/DISK", "AREA/ELLIPSE"} <= set(lamps)
    assert lamps["SUN"] == 1
    assert report["emissive"] >= 200


def test_what_moves(report):
    assert report["frames"] == [1, 24] and report["fps"] == 24
    assert report["eye"] > 0.1, "the camera stands still"
    assert report["moving_lamps"] >= 10
    assert report["carp"] > 0.05, "the skinned carp does not bend"
    assert report["banner"] > 0.05, "the banners do not ripple"


def test_size_and_wholeness(report):
    assert report["instances"] > 2000
    assert report["triangles"] < 1_500_000
    assert report["unpacked"] == []


@pytest.mark.slow
def test_same_seed_same_scene(tmp_path):
    """Byte-equal files are Blender's business; the numbers that describe the scene must not change."""
    first, second = (run(SCRIPT, "-o", tmp_path / f"{i}.blend", "--frames", "2", "--seed", "3") for i in range(2))
    said = [" ".join(line.split()[1:5]) for r in (first, second) for line in r.stdout.splitlines() if "lights," in line]
    assert len(said) == 2 and said[0] == said[1]


@pytest.mark.parametrize("bad", [["--frames", "0"], ["--size", "0x9"], ["--size", "wide"], ["--lights", "many"]])
def test_bad_requests(tmp_path, bad):
    result = run(SCRIPT, "-o", tmp_path / "x.blend", *bad)
    assert result.returncode == 2 and "error:" in result.stderr
    assert not (tmp_path / "x.blend").exists()
