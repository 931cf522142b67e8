# SPDX-License-Identifier: Apache-2.0
"""`headwater render` on .blend files: the add-on's engine through bpy, in processes of their own, beside Cycles."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from cli_process import finish, start

pytest.importorskip("bpy")

from headwater.image_io import colour_channels, read_exr, select_layer
from headwater.metrics import error_metrics

MAKE = """
import bpy, sys
bpy.ops.wm.read_factory_settings()
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 64, 50
scene.cycles.samples = 4
scene.frame_start, scene.frame_end = 1, 3
cube = bpy.data.objects["Cube"]
cube.keyframe_insert("location", frame=1)
cube.location.x = 2
cube.keyframe_insert("location", frame=3)
other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
scene.collection.objects.link(other)
other.location = (0, 0, 8)
if "no-camera" in sys.argv:
    scene.camera = None
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1])
"""


def make(path, *options):
    command = [sys.executable, "-c", MAKE, *options, str(path)]
    subprocess.run(command, check=True, capture_output=True, timeout=120)
    return path


@pytest.fixture(scope="module")
def cube(tmp_path_factory):
    return make(tmp_path_factory.mktemp("blend") / "cube.blend")


def test_animation_with_passes_and_statistics(core, cube, tmp_path):
    options = ["--frames", "1-3x2", "--passes", "Combined,Depth,Object Index,Denoising Albedo", "--exr-depth", "float"]
    status, out, err = finish(cube, "-o", tmp_path / "f.####.exr", *options, "--stats", tmp_path / "s.json")
    assert status == 0, err
    assert out == "" and "Saved" not in err, "Blender's own messages stay away"
    assert sorted(os.listdir(tmp_path)) == ["f.0001.exr", "f.0003.exr", "s.json"]
    first, last = (read_exr(str(tmp_path / f"f.000{n}.exr")) for n in (1, 3))
    assert {"ViewLayer.Combined", "ViewLayer.Depth", "ViewLayer.Object Index"} <= set(first.layers)
    assert first.channels["ViewLayer.Depth"] == "Z" and first.size == (48, 32)
    assert "ViewLayer.Normal" not in first.layers
    assert not np.array_equal(first.layers["ViewLayer.Depth"], last.layers["ViewLayer.Depth"]), "the cube moved"
    report = json.loads((tmp_path / "s.json").read_text())
    assert report["status"] == "done" and report["engine"] == "headwater"
    assert [frame["frame"] for frame in report["frames"]] == [1, 3]
    for frame in report["frames"]:
        (layer,) = frame["layers"]
        assert layer["view_layer"] == "ViewLayer" and layer["render"]["rays"] > 48 * 32
        assert layer["render"]["samples"] == 4, "the file's own samples"
    assert report["frames"][1]["layers"][0]["sync"]["meshes_uploaded"] == 0, "the second frame sends no mesh again"
    assert report["totals"]["rays"] > 0 and report["totals"]["peak_device_bytes"] > 0


def test_options_win_over_the_file_and_cycles_agrees(core, cube, tmp_path):
    options = ["--size", "40x30", "--region", "5,3,35,28", "--camera", "Other", "--samples", 256, "--max-bounces", 1]
    images = {}
    for engine in ("headwater", "cycles"):
        path = tmp_path / f"{engine}.exr"
        status, _, err = finish(cube, "-o", path, "--engine", engine, "--no-clamp", *options)
        assert status == 0, err
        exr = read_exr(str(path))
        assert exr.size == (30, 25)
        images[engine] = colour_channels(exr, select_layer(exr))
    errors = error_metrics(images["headwater"], images["cycles"])
    assert errors["relmse_trimmed"] < 2e-3
    assert abs(errors["mean_signed_error_percent"]) < 1


def test_png_uses_the_files_view(core, cube, tmp_path):
    status, _, err = finish(cube, "-o", tmp_path / "x.png", "--samples", 1)
    assert status == 0, err
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.alone
def test_ctrl_c_keeps_the_partial_picture(core, cube, tmp_path):
    process = start(cube, "-o", tmp_path / "f#.exr", "--frames", "1-2", "--samples", 1 << 20, "--no-clamp")
    try:
        for line in process.stderr:
            if "Sample" in line and "Sample 0/" not in line:
                break
        sent = time.perf_counter()
        process.send_signal(signal.SIGINT)
        rest = process.communicate(timeout=60)[1]
        took = time.perf_counter() - sent
    finally:
        process.kill()
    assert process.returncode == 130, rest
    assert took < 1.5, "half a second, and the end of Blender on a busy machine"
    assert sorted(os.listdir(tmp_path)) == ["f1.exr"]
    exr = read_exr(str(tmp_path / "f1.exr"))
    assert colour_channels(exr, select_layer(exr)).max() > 0.05


@pytest.mark.parametrize(
    "options, words",
    [
        (("--camera", "nobody"), ("nobody", "Camera", "Other")),
        (("--region", "0,0,99,99"), ("48x32",)),
        (("--device", "no such device"), ("no such device",)),
        (("--neighbours", "2"), ("wssr-hash", "neighbours")),
        (("--integrator", "restir", "--neighbours", "65"), ("neighbours", "64")),
    ],
)
def test_wishes_the_file_cannot_meet(core, cube, tmp_path, options, words):
    status, _, err = finish(cube, "-o", tmp_path / "x.exr", *options)
    assert status == 2
    lines = [line for line in err.splitlines() if line.startswith("headwater: error:")]
    assert len(lines) == 1 and "Traceback" not in err
    assert all(word in lines[0] for word in words), lines


def test_no_camera_is_one_clear_line(core, tmp_path):
    path = make(tmp_path / "blind.blend", "no-camera")
    status, _, err = finish(path, "-o", tmp_path / "x.exr")
    assert status == 1
    assert "camera" in err and "Traceback" not in err
    assert not (tmp_path / "x.exr").exists()


def test_truncated_file_is_one_clear_line(core, cube, tmp_path):
    path = tmp_path / "half.blend"
    path.write_bytes(cube.read_bytes()[: cube.stat().st_size // 2])
    status, _, err = finish(path, "-o", tmp_path / "x.exr")
    assert status == 1
    assert "half.blend" in err and "Traceback" not in err
    assert not (tmp_path / "x.exr").exists()
