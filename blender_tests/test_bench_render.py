# SPDX-License-Identifier: Apache-2.0
"""`headwater bench` on small pictures: a still beside Cycles, an animation whose cells live on, the report of a device;
and the scripts of the many-light scenes."""

import json
import os
import signal
import subprocess
import sys
import time
import types
from pathlib import Path

import bpy_process
import cli_process
import numpy as np
import pytest

from headwater.bench import contestants
from headwater.bench.engines import Engines
from headwater.cli import main
from headwater.compare import load_colour
from headwater.progress import Progress

ROOT = Path(__file__).resolve().parent.parent
SCENES = ROOT / "scenes" / "benchmark"

_LAMPS = """
import math
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
bpy.ops.mesh.primitive_plane_add(size=12)
bpy.ops.mesh.primitive_cube_add(size=1.5, location=(0, 0, 0.75))
cube = bpy.context.object
for frame in (1, 4):
    cube.location.x = 0.1 * frame
    cube.keyframe_insert("location", frame=frame)
for i in range(40):
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy, lamp.shadow_soft_size = 20, 0.1
    placed = bpy.data.objects.new("Lamp", lamp)
    placed.location = (6 * math.cos(i * 2.4), 6 * math.sin(i * 2.4), 0.6 + 0.05 * i)
    scene.collection.objects.link(placed)
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location, camera.rotation_euler = (0, -9, 5), (math.radians(62), 0, 0)
scene.collection.objects.link(camera)
scene.camera = camera
bpy.ops.wm.save_as_mainfile(filepath=tmp + "/lamps.blend")
"""


@pytest.fixture(scope="module")
def lamps(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    bpy_process.run(_LAMPS, folder)
    return str(folder / "lamps.blend")


def bench(*arguments):
    command = [sys.executable, "-m", "headwater", "bench", *map(str, arguments)]
    return subprocess.run(
        command, env=dict(os.environ, PYTHONPATH=str(ROOT)), capture_output=True, text=True, timeout=300
    )


def test_still_beside_cycles(lamps, tmp_path):
    out = tmp_path / "out"
    arguments = ("--time", "0.2", "--reference-time", "1", "--seeds", "2", "--size", "48x27", "--threads", "2")
    done = bench(lamps, "-o", out, *arguments, "--integrators", "path", "wssr-grid:candidates=4,lights=uniform")
    assert done.returncode == 0, done.stderr[-2000:]
    facts = json.loads((out / "bench.json").read_text())["files"][0]
    assert not facts["failures"]
    for name in ("path", "wssr-grid:candidates=4,lights=uniform", "cycles"):
        for seed in ("1", "2"):
            points = facts["points"][name][seed][0]
            assert [p["samples"] for p in points] == [2**i for i in range(len(points))]
            assert all(0 < p["sampling_seconds"] < p["seconds"] for p in points)
            assert all(p["sync_build_seconds"] > 0 for p in points)
        if len(points) > 3 and name != "wssr-grid:candidates=4,lights=uniform":
            assert points[-1]["errors"]["relmse_trimmed"] < 0.6 * points[0]["errors"]["relmse_trimmed"]
    first = [facts["points"]["path"][seed][0][0]["errors"]["relmse"] for seed in ("1", "2")]
    assert first[0] != first[1]  # seeds are seeds
    gap = facts["disagreement"][0]
    assert abs(gap["mean_signed_error_percent"]) < 5
    assert "lamps.blend" in done.stdout and "faster than cycles" in done.stdout
    assert (out / "index.html").read_text().count("<figure>") == 4


def test_animation_has_a_row_a_frame(lamps, tmp_path):
    out = tmp_path / "out"
    options = ("--time", "0.001", "--reference-time", "0.1", "--seeds", "1", "--size", "32x18", "--threads", "2")
    options = (*options, "--frames", "2-3", "--reference", "headwater", "--against", "path")
    done = bench(lamps, "-o", out, *options, "--integrators", "wssr-grid")
    assert done.returncode == 0, done.stderr[-2000:]
    facts = json.loads((out / "bench.json").read_text())["files"][0]
    assert facts["frames"] == [2, 3] and list(facts["references"]) == ["headwater"]
    assert [row["frame"] for row in facts["comparisons"]] == [2, 2, 2, 3, 3, 3]  # time counts in three ways
    assert "wssr-grid, frame 3" in done.stdout


def test_animation_keeps_cells_over_frames(lamps, tmp_path, core):
    """The pictures of a race are those of `headwater render --frames`, and the last one is not that of its frame alone:
    the second time round too, when the cells of the first are still there."""
    args = types.SimpleNamespace(
        size=(32, 18), max_bounces=0, threads=2, device="", tracer="auto", timeout=200, lead=[], denoise=False
    )
    grid = contestants.parse("wssr-grid", core)
    with Engines(lamps, args, range(1, 4), Progress(quiet=True)) as engines:
        first, costs = engines.render(grid, 5, 1, "")
        again, _ = engines.render(grid, 5, 1, "")
    options = ("--integrator", "wssr-grid", "--samples", 1, "--seed", 5, "--size", "32x18", "--max-bounces", 0)
    options = (*options, "--no-clamp", "--passes", "Combined", "--quiet", "--estimator", "paper")
    for frames, output in (("1-3", "all-#.exr"), ("3", "alone-#.exr")):
        status, _, said = cli_process.finish(lamps, "-o", tmp_path / output, "--frames", frames, *options)
        assert status == 0, said
    expected = [load_colour(str(tmp_path / f"all-{frame}.exr")) for frame in (1, 2, 3)]
    assert len(costs) == 3
    for pictures in (first, again):
        assert all(np.array_equal(a, b) for a, b in zip(pictures, expected, strict=True))
    assert not np.array_equal(load_colour(str(tmp_path / "alone-3.exr")), expected[2])


@pytest.mark.alone
def test_a_late_frame_of_an_animation(lamps, tmp_path):
    """The last frame alone is counted; the picture is that of the animation, with what cells learned before."""
    out = tmp_path / "out"
    options = ("--time", "0.001", "--reference-time", "0.1", "--seeds", "1", "--size", "32x18", "--threads", "2")
    options = (*options, "--frame", "3", "--animation-from", "1", "--reference", "headwater")
    done = bench(lamps, "-o", out, *options, "--integrators", "wssr-hash")
    assert done.returncode == 0, done.stderr[-2000:]
    facts = json.loads((out / "bench.json").read_text())
    assert facts["run"]["settings"]["lead"] == [1, 2] and facts["files"][0]["frames"] == [3]
    points = facts["files"][0]["points"]
    ours, theirs = points["wssr-hash"]["1"][0][0], points["cycles"]["1"][0][0]
    assert [frame for frame, _, _ in ours["lead"]] == [1, 2] and [frame for frame, _, _ in theirs["lead"]] == [2]
    assert ours["seconds"] < sum(seconds for _, seconds, _ in ours["lead"])
    assert "rendered from frame 1 on" in (out / "index.html").read_text()
    assert "wssr-hash, frame 3" in done.stdout


def test_late_frames_go_on_from_those_before(lamps, core):
    args = types.SimpleNamespace(size=(32, 18), max_bounces=0, threads=2, device="", tracer="auto", timeout=200)
    args.lead, args.denoise = [1, 2], False
    ours = contestants.parse("wssr-hash", core)
    with Engines(lamps, args, range(3, 4), Progress(quiet=True)) as engines:
        (late,), _ = engines.render(ours, 5, 1, "")
        (alone,), _ = engines.render(ours, 5, 1, "", reference=True)
        (again,), _ = engines.render(ours, 5, 1, "")
    with Engines(lamps, args, range(1, 4), Progress(quiet=True)) as engines:
        (_, _, whole), _ = engines.render(ours, 5, 1, "", reference=True)
    assert np.array_equal(late, again) and np.array_equal(late, whole)
    assert not np.array_equal(late, alone)


def test_denoised_pictures_are_nearer(lamps, tmp_path):
    """By both engines; the reference stays as it was rendered."""
    points = {}
    for name, more in (("noisy", ()), ("denoised", ("--denoise",))):
        options = ("--time", "0.001", "--reference-time", "2", "--seeds", "1", "--size", "64x36", "--threads", "2")
        done = bench(lamps, "-o", tmp_path / name, *options, "--integrators", "path", *more)
        assert done.returncode == 0, done.stderr[-2000:]
        points[name] = json.loads((tmp_path / name / "bench.json").read_text())["files"][0]["points"]
    for contestant in ("path", "cycles"):
        noisy, denoised = (points[name][contestant]["1"][0][0]["errors"]["relmse_trimmed"] for name in points)
        assert denoised < 0.6 * noisy, contestant


def test_engine_that_can_not_open_the_file(tmp_path):
    bad = tmp_path / "bad.blend"
    bad.write_bytes(b"BLENDER-v500" + b"\0" * 64)
    done = bench(bad, "-o", tmp_path / "out", "--time", "1", "--seeds", "1", "--reference", "headwater")
    assert done.returncode == 1
    assert "'bad.blend' by headwater" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.alone
def test_ctrl_c_writes_the_report(lamps, tmp_path):
    out = tmp_path / "out"
    options = (
        "--time",
        "600",
        "--reference-time",
        "0.5",
        "--seeds",
        "1",
        "--size",
        "48x27",
        "--reference",
        "headwater",
    )
    command = [sys.executable, "-m", "headwater", "bench", lamps, "-o", str(out), *options, "--against", "wssr-grid"]
    child = subprocess.Popen(
        command, env=dict(os.environ, PYTHONPATH=str(ROOT)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    seen = []
    for line in child.stderr:
        seen.append(line)
        if "path, seed 1/1, 4 samples:" in line:
            break
    child.send_signal(signal.SIGINT)
    said = time.monotonic()
    child.communicate(timeout=60)
    assert child.returncode == 130, seen
    assert time.monotonic() - said < 20
    facts = json.loads((out / "bench.json").read_text())["files"][0]
    assert facts["stopped"] and len(facts["points"]["path"]["1"][0]) >= 3


@pytest.mark.alone
def test_gpu_report(tmp_path, capsys):
    options = [
        "--gpu-report",
        "--size",
        "48x27",
        "--report-frames",
        "2",
        "--integrators",
        "path",
        "restir:candidates=4",
    ]
    assert main(["bench", *options, "-o", str(tmp_path / "report.json")]) == 0
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["device"]["name"] and report["device"]["driver"]
    opened = [t["tracer"] for t in report["tracers"] if "mrays_per_second" in t]
    assert opened
    for tracer in opened:
        rows = {r["integrator"]: r for r in report["integrators"] if r["tracer"] == tracer}
        assert set(rows) == {"path", "restir:candidates=4"}
        for row in rows.values():
            assert row["frames_per_second"] > 0 and row["mrays_per_second"] > 0
            assert 0 < sum(row["stage_milliseconds"].values()) < 1100 / row["frames_per_second"]
    said = capsys.readouterr().out
    assert report["device"]["name"] in said and "frames/s" in said
    from headwater.bench.gpu_report import as_text

    assert as_text(report).count("| path |") == len(opened)


def test_gpu_report_of_no_device(capsys):
    assert main(["bench", "--gpu-report", "--device", "abacus"]) == 1
    assert "abacus" in capsys.readouterr().err


_COUNTS = """
sys.path.insert(0, {scenes!r})
import heads, make_benchmark, spread, surfaces
def few(scene, seed):  # the forty heads take long and hold no light
    bpy.ops.mesh.primitive_cube_add()
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
heads.objects = few
surfaces.Images.__init__.__defaults__ = (16,)
class Counter(bpy.types.RenderEngine):  # a render's dependency graph: only there are instances' originals left out
    bl_idname, bl_label = "COUNTER", "Counter"
    def update(self, data, depsgraph):
        self.__class__.found = lights(depsgraph)
    def render(self, depsgraph):
        pass
bpy.utils.register_class(Counter)
def lights(graph):
    found = 0
    for item in graph.object_instances:
        data = item.object.data
        glows = item.object.type == "MESH" and any(
            m and any(n.bl_idname == "ShaderNodeBsdfPrincipled" and n.inputs["Emission Strength"].default_value > 0
                for n in m.node_tree.nodes) for m in data.materials)
        found += item.show_self and (item.object.type == "LIGHT" or glows)
    return found
counts, cars = {{}}, []
for kind in make_benchmark.KINDS:
    for limit in (10_000, 8):
        spread.OBJECTS = limit
        make_benchmark.make(kind, 24, (32, 18), 3)
        bpy.context.scene.render.engine = "COUNTER"
        bpy.ops.render.render()
        counts[f"{{kind}} {{limit}}"] = Counter.found
    if kind == "city":
        def places():
            graph = bpy.context.evaluated_depsgraph_get()
            return sorted(tuple(round(x, 3) for x in i.matrix_world.translation)
                for i in graph.object_instances if i.show_self and i.object.name.startswith("Car"))
        one = places()
        bpy.context.scene.frame_set(25)
        cars = [one[0], places()[0], len(one), bpy.context.scene.frame_end]
        moved = sum(a not in one for a in places())
    if kind == "sky":
        bright = [float(np.array(bpy.data.images["Sky"].pixels[:]).max())]
show(counts=counts, cars=cars, moved=moved, bright=bright)
"""


def test_scenes_have_their_lights_as_objects_and_as_instances(tmp_path):
    found = bpy_process.run(_COUNTS.format(scenes=str(SCENES)), tmp_path, timeout=200)
    expected = {
        f"{kind} {limit}": 0 if kind == "sky" else 24
        for kind in ("heads", "sun", "sky", "streets", "city", "rooms", "shades", "neon")
        for limit in (10_000, 8)
    }
    assert found["counts"] == expected
    assert found["moved"] == found["cars"][2] > 0 and found["cars"][3] >= 24
    assert found["bright"][0] > 1000


_MOVES = """
sys.path.insert(0, {scenes!r})
import heads, make_benchmark, surfaces
def few(scene, seed):
    bpy.ops.mesh.primitive_cube_add()
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.rotation_euler = (1.2, 0, 0)
    scene.collection.objects.link(scene.camera)
heads.objects = few
surfaces.Images.__init__.__defaults__ = (16,)
found = {{}}
for moves in ("camera", "lights", "both"):
    make_benchmark.make("heads", 24, (32, 18), 3, moves)
    scene = bpy.context.scene
    def places():
        graph = bpy.context.evaluated_depsgraph_get()
        return {{o.name: [round(x, 4) for x in o.evaluated_get(graph).matrix_world.translation] for o in scene.objects}}
    frames = []
    for frame in (1, 8, 15):
        scene.frame_set(frame)
        frames.append(places())
    moved = [n for n in frames[0] if frames[0][n] != frames[1][n]]
    even = all(abs(a + c - 2 * b) < 1e-3 for n in moved for a, b, c in zip(*(f[n] for f in frames)))
    found[moves] = [sum(n.startswith("Area") for n in moved), "Camera" in moved, even, scene.frame_end]
try:
    make_benchmark.make("sky", 1, (32, 18), 3, "lights")
    refused = ""
except ValueError as error:
    refused = str(error)
show(found=found, refused=refused)
"""


def test_scenes_that_move(tmp_path):
    """The camera, a tenth of the lights, or both, at one speed; where no light can move that is said."""
    said = bpy_process.run(_MOVES.format(scenes=str(SCENES)), tmp_path, timeout=200)
    assert said["found"] == {
        "camera": [0, True, True, 48],
        "lights": [3, False, True, 48],
        "both": [3, True, True, 48],
    }
    assert "no light of its own" in said["refused"]
