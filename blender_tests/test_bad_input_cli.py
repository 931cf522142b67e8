# SPDX-License-Identifier: Apache-2.0
"""The command's answers to what users get wrong: one clear line, non-zero status, no traceback, nothing overwritten."""

import os
import subprocess
import sys
import types

import pytest

from headwater import cli

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CUBE = """#usda 1.0
(
    upAxis = "Z"
    metersPerUnit = 1
)
def Camera "camera"
{
    double3 xformOp:translate = (0, 0, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Cube "cube" {}
def DomeLight "sky" {}
"""


def headwater(*arguments, **environment):
    """Runs the command in a process of its own."""
    environment = dict(os.environ, PYTHONPATH=ROOT, **environment)
    return subprocess.run(
        [sys.executable, "-m", "headwater", *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment,
        timeout=400,
    )


@pytest.fixture
def here(capsys):
    """Runs the command in this process, for errors that come before anything native is opened."""

    def run(*arguments):
        status = cli.main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return types.SimpleNamespace(returncode=status, stdout=out, stderr=err)

    return run


def refused(result, *words, status=None):
    """Asserts one error line that holds every word."""
    assert result.returncode != 0
    if status is not None:
        assert result.returncode == status, result.stderr
    lines = [line for line in result.stderr.splitlines() if line.startswith("headwater: error:")]
    assert len(lines) == 1, result.stderr
    for word in words:
        assert word in lines[0], lines[0]
    assert "Traceback" not in result.stdout + result.stderr


@pytest.fixture
def cube(tmp_path):
    path = tmp_path / "cube.usda"
    path.write_text(CUBE)
    return path


def test_no_command_and_unknown_command():
    refused(headwater(), status=2)
    refused(headwater("rendr"), "render", status=2)
    refused(headwater("render"), "FILE", status=2)


@pytest.mark.parametrize(
    "options",
    [
        ("--size", "64"),
        ("--size", "0x64"),
        ("--size", "99999999x1"),
        ("--samples", "0"),
        ("--samples", "many"),
        ("--samples", "-1"),
        ("--time-limit", "0"),
        ("--time-limit", "nan"),
        ("--frames", "5-1"),
        ("--frames", "1-5x0"),
        ("--frames", "1-999999999"),
        ("--frames", "all"),
        ("--seed", "-1"),
        ("--region", "0,0,0,5"),
        ("--region", "1,2,3"),
        ("--max-bounces", "x"),
        ("--exr-depth", "quarter"),
        ("--passes", ","),
        ("--frobnicate",),
    ],
)
def test_bad_options(here, cube, tmp_path, options):
    refused(here("render", cube, "-o", tmp_path / "x.exr", *options), status=2)
    assert not (tmp_path / "x.exr").exists()


@pytest.mark.parametrize(
    "options, words",
    [
        (("--integrator", "magic"), ("magic", "path")),
        (("--estimator", "magic"), ("magic", "paper")),
        (("--candidates", "4"), ("wssr-hash", "candidates")),
        (("--tracer", "magic"), ("magic", "embree", "ray_query")),
        (("--lights", "magic"), ("magic", "auto", "uniform", "power", "tree")),
        (("--passes", "Combined,Magic"), ("Magic", "Combined", "Depth")),
        (("--device", "no such device"), ("no such device",)),
        (("--camera", "nobody"), ("nobody", "/camera")),
        (("--region", "0,0,999,5", "--size", "8x8"), ("8x8",)),
        (("--engine", "cycles"), (".blend",)),
    ],
)
def test_unknown_names_list_the_valid_ones(core, here, cube, tmp_path, options, words):
    refused(here("render", cube, "-o", tmp_path / "x.exr", *options), *words, status=2)


@pytest.mark.parametrize(
    "tracer, extension", [("ray_query", "VK_KHR_ray_query"), ("ray_pipeline", "VK_KHR_ray_tracing_pipeline")]
)
def test_a_tracer_that_the_device_lacks(core, here, cube, tmp_path, monkeypatch, tracer, extension):
    """The error and `headwater info` name what is missing: the extension, or what it is built on."""
    monkeypatch.setenv("HEADWATER_HIDE_EXTENSION", extension)
    refused(here("render", cube, "-o", tmp_path / "x.exr", "--tracer", tracer), tracer, extension, status=2)
    said = headwater("info", HEADWATER_HIDE_EXTENSION=extension).stdout
    assert any(f"no tracer {tracer}: " in line and extension in line for line in said.splitlines())


def test_unwritable_outputs_are_found_before_rendering(cube, tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.exr").mkdir()
    for output in (tmp_path / "file" / "x.exr", tmp_path / "folder.exr", tmp_path / "x.jpeg", "/proc/none/x.exr"):
        # So many samples that the test would time out if rendering began.
        refused(headwater("render", cube, "-o", output, "--samples", 1000000), str(output), status=2)
    refused(headwater("render", cube, "-o", tmp_path / "x.exr", "--stats", "/proc/none/x.json"), "/proc/none", status=2)


BLEND_STARTS = {
    "empty": b"",
    "text": b"not a blend file",
    "truncated": b"BLENDER-v500",
    "zstd": b"\x28\xb5\x2f\xfdrest",
}


@pytest.mark.parametrize("kind", [*BLEND_STARTS, "missing", "folder"])
def test_broken_blend_files(core, tmp_path, kind):
    path = tmp_path / "broken.blend"
    if kind == "folder":
        path.mkdir()
    elif kind != "missing":
        path.write_bytes(BLEND_STARTS[kind])
    refused(headwater("render", path, "-o", tmp_path / "x.exr"), "broken.blend")
    assert not (tmp_path / "x.exr").exists()


@pytest.mark.parametrize("extension", ["usda", "usdc", "usdz", "usd"])
@pytest.mark.parametrize("content", [b"", b"not usd", b"PXR-USDC\0\0\0", b"#usda 1.0\ndef Mesh {", b"PK\3\4junk", None])
def test_broken_usd_files(core, here, tmp_path, extension, content):
    pytest.importorskip("pxr")
    path = tmp_path / f"broken.{extension}"
    if content is not None:
        path.write_bytes(content)
    refused(here("render", path, "-o", tmp_path / "x.exr"), f"broken.{extension}")
    assert not (tmp_path / "x.exr").exists()


def test_truncated_crate_file(core, tmp_path):
    pxr = pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    assert pxr
    whole = str(tmp_path / "whole.usdc")
    stage = Usd.Stage.CreateNew(whole)
    mesh = UsdGeom.Mesh.Define(stage, "/mesh")
    mesh.CreatePointsAttr([(i, i * i, 0) for i in range(1000)])
    stage.GetRootLayer().Save()
    data = (tmp_path / "whole.usdc").read_bytes()
    path = tmp_path / "half.usdc"
    path.write_bytes(data[: len(data) // 2])
    refused(headwater("render", path, "-o", tmp_path / "x.exr"), "half.usdc")


def test_unknown_kind_of_file(tmp_path):
    path = tmp_path / "scene.obj"
    path.write_text("v 0 0 0")
    refused(headwater("render", path), ".blend", ".usda", status=2)


def test_reference_cycles_and_missing_references_are_told_by_prim(core, tmp_path):
    pytest.importorskip("pxr")
    (tmp_path / "a.usda").write_text('#usda 1.0\ndef Xform "a" (references = @./b.usda@</b>) {}\n')
    (tmp_path / "b.usda").write_text('#usda 1.0\ndef Xform "b" (references = @./a.usda@</a>) {}\n')
    from headwater.usd_scene import open_stage

    opened = open_stage(str(tmp_path / "a.usda"))
    assert any("cycle" in text.lower() for text in opened.warnings), opened.warnings
    (tmp_path / "c.usda").write_text('#usda 1.0\ndef Xform "c" (references = @./nowhere.usda@</b>) {}\n')
    opened = open_stage(str(tmp_path / "c.usda"))
    assert any("nowhere.usda" in text for text in opened.warnings), opened.warnings


def test_debug_shows_where(tmp_path):
    result = headwater("render", tmp_path / "none.blend", HEADWATER_DEBUG="1")
    assert result.returncode != 0
    assert "Traceback" in result.stderr


def test_no_vulkan_device_at_all(core, cube, tmp_path):
    """No driver to be found: rendering and info say so; the process lives."""
    empty = tmp_path / "empty.json"
    empty.write_text("{}")
    nothing = {"VK_ICD_FILENAMES": str(empty), "VK_DRIVER_FILES": str(empty)}
    refused(headwater("render", cube, "-o", tmp_path / "x.exr", **nothing))
    result = headwater("info", **nothing)
    assert result.returncode == 1
    assert "Can't render" in result.stdout
