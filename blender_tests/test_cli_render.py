# SPDX-License-Identifier: Apache-2.0
"""`headwater render` on USD: outputs, statistics, passes, frames, regions, Ctrl-C. In process with a double of the core
where only the command is in question, with the real core where pixels are."""

import json
import os
import signal
import threading
import time
import types

import fake_core
import numpy as np
import pytest
from cli_process import start

pytest.importorskip("pxr")

from headwater import cli, image_io, interrupt, render_usd
from headwater.errors import UserError
from headwater.image_io import read_exr, write_exr
from headwater.output import atomic_path, frame_path
from headwater.progress import Progress, draw_bar, format_progress
from headwater.texture_io import load_texture

SCENE = """#usda 1.0
(
    upAxis = "Z"
    metersPerUnit = 1
    startTimeCode = 1
    endTimeCode = 3
)
def Camera "camera"
{
    double3 xformOp:translate = (0, 0, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Cube "cube"
{
    color3f[] primvars:displayColor = [(0.8, 0.3, 0.1)]
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 3: (1, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "sky" {}
def RectLight "lamp"
{
    float inputs:intensity = 5
    double3 xformOp:translate = (0, 2, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.usda"
    path.write_text(SCENE)
    return str(path)


@pytest.fixture
def fake(monkeypatch):
    """The double of the core behind the command, in this process."""
    module = types.SimpleNamespace(**{k: v for k, v in vars(fake_core).items() if not k.startswith("__")})
    module.all_passes = lambda: list(fake_core.PASSES.items())
    monkeypatch.setattr("headwater.core.load", lambda: module)
    monkeypatch.setattr(render_usd, "load", lambda: module)
    monkeypatch.setattr(fake_core, "render_seconds", 0.0)
    monkeypatch.setattr(fake_core, "fail_with", None)
    fake_core.sessions.clear()
    return module


def render(scene, *options):
    return cli.main(["render", scene, "--size", "12x8", *map(str, options)])


# Names and files


def test_frame_numbers_in_names():
    assert frame_path("a/shot.####.exr", 7, animated=True) == "a/shot.0007.exr"
    assert frame_path("shot.exr", 12, animated=True) == "shot0012.exr"
    assert frame_path("shot.exr", 12, animated=False) == "shot.exr"
    assert frame_path("v#/shot_##.exr", -3, animated=False) == "v#/shot_-03.exr"
    assert frame_path("####.png", 12345, animated=True) == "12345.png"


@pytest.mark.parametrize(
    "text, expected",
    [("7", [7]), ("1-4", [1, 2, 3, 4]), ("1-6x2", [1, 3, 5]), ("-2-1", [-2, -1, 0, 1]), ("-5--3", [-5, -4, -3])],
)
def test_frame_ranges(text, expected):
    from headwater.render import frames

    assert list(frames(text)) == expected


def test_failed_writes_keep_the_old_file(tmp_path):
    path = tmp_path / "result.exr"
    path.write_bytes(b"precious")
    with pytest.raises(RuntimeError), atomic_path(str(path)) as temporary:
        with open(temporary, "wb") as file:
            file.write(b"half")
        raise RuntimeError("the disk is gone")
    assert path.read_bytes() == b"precious"
    assert os.listdir(tmp_path) == ["result.exr"]


def test_failing_exr_writer_keeps_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "result.exr"
    write_exr(str(path), {"Combined": np.ones((2, 2, 4), np.float32)})
    before = path.read_bytes()

    def broken():
        module = __import__("OpenEXR")
        stand_in = types.SimpleNamespace(**{k: getattr(module, k) for k in ("ZIP_COMPRESSION", "scanlineimage")})

        class File:
            def __init__(self, *_):
                pass

            def write(self, name):
                with open(name, "wb") as file:
                    file.write(b"half an image")
                raise OSError(28, "No space left on device")

        stand_in.File = File
        return stand_in

    monkeypatch.setattr(image_io, "_openexr", broken)
    with pytest.raises(UserError, match="No space left"):
        write_exr(str(path), {"Combined": np.zeros((2, 2, 4), np.float32)})
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["result.exr"]


def test_frames_passes_and_statistics(scene, fake, tmp_path):
    output, stats = tmp_path / "out" / "f_##.exr", tmp_path / "stats.json"
    assert render(scene, "-o", output, "--frames", "1-3x2", "--passes", "Combined,Depth,UV", "--stats", stats) == 0
    assert sorted(os.listdir(tmp_path / "out")) == ["f_01.exr", "f_03.exr"]
    exr = read_exr(str(tmp_path / "out" / "f_01.exr"))
    assert exr.channels == {"ViewLayer.Combined": "RGBA", "ViewLayer.Depth": "Z", "ViewLayer.UV": "UVA"}
    assert exr.size == (12, 8)
    report = json.loads(stats.read_text())
    assert report["status"] == "done"
    assert [frame["frame"] for frame in report["frames"]] == [1, 3]
    for frame in report["frames"]:
        assert frame["peak_rss_bytes"] > 1 << 20 and frame["seconds"] > 0
        (layer,) = frame["layers"]
        assert {"scene_seconds", "build_seconds", "upload_seconds"} <= set(layer["sync"])
    assert report["device"] == "Fake"
    assert {"rays", "mrays_per_second", "sync_seconds", "build_seconds", "stage_seconds"} <= set(report["totals"])
    session = fake_core.sessions[-1]
    assert len(fake_core.sessions) == 1, "one session for all frames"
    assert [kind for kind, _ in session.edits[1] if kind in ("mesh", "material", "light")] == [], "only what moved"


def test_all_passes(scene, fake, tmp_path):
    assert render(scene, "-o", tmp_path / "x.exr", "--passes", "all") == 0
    assert len(read_exr(str(tmp_path / "x.exr")).layers) == len(fake_core.PASSES)


def test_options_reach_the_core(scene, fake, tmp_path):
    options = "--samples 7 --seed 3 --integrator path --lights uniform --time-limit 5 --region 2,1,6,5".split()
    options += "--max-bounces 0 --diffuse-bounces 1 --glossy-bounces 2 --transmission-bounces 3".split()
    assert render(scene, "-o", tmp_path / "x.exr", *options) == 0
    (settings,) = fake_core.sessions[-1].settings
    expected = {"samples": 7, "seed": 3, "lights": "uniform", "time_limit": 5.0, "region": (2, 1, 6, 5)}
    expected |= {"max_bounces": 0, "diffuse_bounces": 1, "glossy_bounces": 2, "transmission_bounces": 3}
    assert expected.items() <= settings.items()
    assert read_exr(str(tmp_path / "x.exr")).size == (4, 4)


def test_png_is_the_standard_view(scene, fake, tmp_path):
    assert render(scene, "-o", tmp_path / "x.png") == 0
    pixels = load_texture(str(tmp_path / "x.png")).pixels
    assert pixels.shape == (8, 12, 3)
    linear = 0.005  # the double's green at row 5 is 5 / 1000: above the linear part of sRGB's curve
    assert pixels[5, 0, 1] == round(255 * (1.055 * linear ** (1 / 2.4) - 0.055))


def test_float_depth(scene, fake, tmp_path):
    for depth, name in (("half", "float16"), ("float", "float32")):
        assert render(scene, "-o", tmp_path / "x.exr", "--exr-depth", depth) == 0
        import OpenEXR

        channels = OpenEXR.File(str(tmp_path / "x.exr"), separate_channels=True).channels()
        assert {str(channel.pixels.dtype) for channel in channels.values()} == {name}


def test_a_failing_render_keeps_the_old_picture(scene, fake, tmp_path, monkeypatch, capsys):
    path = tmp_path / "x.exr"
    assert render(scene, "-o", path) == 0
    before = path.read_bytes()
    monkeypatch.setattr(fake_core, "fail_with", RuntimeError("the device was lost"))
    assert render(scene, "-o", path, "--seed", 5) == 1
    assert "the device was lost" in capsys.readouterr().err
    assert path.read_bytes() == before


@pytest.mark.alone
def test_interrupt_keeps_the_partial_picture_and_ends_the_animation(scene, fake, tmp_path, monkeypatch):
    assert render(scene, "-o", tmp_path / "first.exr") == 0  # modules are loaded before the time counts
    monkeypatch.setattr(fake_core, "render_seconds", 30.0)
    threading.Timer(0.3, interrupt.request).start()
    started = time.perf_counter()
    status = render(scene, "-o", tmp_path / "f_#.exr", "--frames", "1-3", "--stats", tmp_path / "s.json")
    assert time.perf_counter() - started < 2
    assert status == 130
    assert read_exr(str(tmp_path / "f_1.exr")).size == (12, 8)
    assert not (tmp_path / "f_2.exr").exists()
    report = json.loads((tmp_path / "s.json").read_text())
    assert report["status"] == "cancelled" and report["frames"][0]["cancelled"]


# Progress


class _Terminal:
    def __init__(self, terminal):
        self.text, self._terminal = "", terminal

    def isatty(self):
        return self._terminal

    def write(self, text):
        self.text += text

    def flush(self):
        pass


def test_progress_on_a_terminal_and_elsewhere():
    values = {"sample": 3, "samples": 12, "mrays": 1.25, "seconds": 65.0, "remaining": 200.0, "memory": 3 << 20}
    line = format_progress("frame 1", values)
    for words in ("frame 1", "3/12", "1.25 Mrays/s", "3 MiB", "1:05", "3:20 left"):
        assert words in line
    assert draw_bar(0.25, 8) == "██░░░░░░"
    terminal, log = _Terminal(True), _Terminal(False)
    for stream in (terminal, log):
        progress = Progress(stream, every=0)
        progress.update("frame 1", values)
        progress.note("done")
    assert terminal.text.startswith("\r") and "\ndone\n" in terminal.text
    assert log.text == line + "\ndone\n"


# The real core


@pytest.mark.alone
def test_ctrl_c_stops_within_half_a_second_of_a_real_render(core, scene, tmp_path):
    path = tmp_path / "x.exr"
    process = start(scene, "-o", path, "--size", "64x48", "--samples", 1 << 20, "--stats", tmp_path / "s.json")
    try:
        for line in process.stderr:
            if "sample" in line and "sample 0/" not in line:
                break
        sent = time.perf_counter()
        process.send_signal(signal.SIGINT)
        rest = process.communicate(timeout=60)[1]
        took = time.perf_counter() - sent
    finally:
        process.kill()
    assert process.returncode == 130, rest
    assert "Traceback" not in rest
    report = json.loads((tmp_path / "s.json").read_text())
    assert report["status"] == "cancelled"
    pixels = read_exr(str(path)).layers[""]
    assert pixels[..., :3].mean() > 0.05, "the samples so far are in the picture"
    # Half a second, and as much again for writing and ending a Python process on a busy machine.
    assert took < 1.0


def test_seeds_regions_and_repeats_of_a_real_render(core, scene, tmp_path):
    """Same seed, same bits; another seed, other noise; a region holds the full picture's own pixels."""

    def picture(name, *options):
        path = str(tmp_path / name)
        arguments = [scene, "-o", path, "--size", "24x16", "--samples", 2, "--exr-depth", "float", "--quiet", *options]
        assert cli.main(["render", *map(str, arguments)]) == 0
        return read_exr(path).layers[""]

    first = picture("a.exr", "--seed", 1)
    assert np.array_equal(first, picture("b.exr", "--seed", 1, "--threads", 1))
    assert not np.array_equal(first, picture("c.exr", "--seed", 2))
    region = picture("d.exr", "--seed", 1, "--region", "6,2,18,10")
    assert np.array_equal(region, first[16 - 10 : 16 - 2, 6:18])


def test_vectors_of_a_still(core, scene, tmp_path):
    """A still moves from the frame before it: the cube by half a metre, to the right."""

    def vectors(frame):
        output = ["-o", str(tmp_path / "f#.exr"), "--frames", str(frame), "--passes", "Combined,Vector"]
        assert cli.main(["render", scene, *output, "--size", "24x16", "--samples", "1", "--quiet"]) == 0
        return read_exr(str(tmp_path / f"f{frame}.exr")).layers["ViewLayer.Vector"]

    second = vectors(2)
    assert second[..., 0].min() < -0.5 and abs(second[..., 1]).max() < 1e-3
    assert abs(vectors(1)).max() < 1e-3, "nothing moves before the first frame"
