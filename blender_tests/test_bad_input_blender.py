# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad input through Blender and the real core: one error that names the thing, or a correct picture, and Blender lives.

The scenes are in bad_scenes.py; one process renders them all, so each case also shows that those before it left
nothing broken.
"""

import json
import os
import re
import subprocess
import sys

import pytest
from bpy_process import run

pytest.importorskip("bpy")
pytest.importorskip("OpenEXR")
HERE = os.path.dirname(os.path.abspath(__file__))


@pytest.fixture(scope="module")
def results(core, tmp_path_factory):
    """What bad_scenes.py tells, by case."""
    assert core
    folder = tmp_path_factory.mktemp("bad")
    command = [sys.executable, os.path.join(HERE, "bad_scenes.py"), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, f"Blender died ({done.returncode})\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    line = next(line for line in done.stdout.splitlines() if line.startswith("BAD_SCENES:"))
    return json.loads(line.removeprefix("BAD_SCENES:"))


def same_picture(facts, other, tolerance=0.02):
    assert facts["mean"] == pytest.approx(other["mean"], abs=tolerance)
    assert facts["normal"] == pytest.approx(other["normal"], abs=tolerance)


def test_every_picture_is_finite_and_nothing_printed_a_traceback(results):
    for name, facts in results.items():
        assert facts.get("finite", True), name
        assert not facts["traces"], (name, facts["traces"])


@pytest.mark.parametrize(
    "case, words",
    [
        ("camera is a mesh", ["Cube", "no camera"]),
        ("flat camera", ["Camera 'Camera'", "scale"]),
        ("camera nowhere", ["Camera 'Camera'", "no number"]),
        ("camera clips nothing", ["Camera 'Camera'", "clip_end"]),
        ("lamp of no number", ['"Lamp"', "power", "not finite"]),
        ("unknown device", ["No Such Card", "Devices:"]),
        ("memory limit", ["Out of memory", "2.0 MiB", "buffer"]),
    ],
)
def test_errors_name_the_thing_and_the_next_render_is_right(results, case, words):
    facts = results[case]
    assert "mean" not in facts, "a picture was written"
    for word in words:
        assert word in facts["error"], facts["error"]
        assert word in facts["raised"], "the artist is told too"
    same_picture(facts["after"], results["good"], 1e-6)


@pytest.mark.parametrize(
    "case, word",
    [("no camera", "no camera"), ("picture 1x1", "small"), ("unwritable output", "/proc/none/picture.exr")],
)
def test_what_blender_refuses(results, case, word):
    assert word in results[case]["raised"] and "mean" not in results[case]


@pytest.mark.parametrize(
    "case, note",
    [
        ("empty mesh", None),
        ("loose mesh", None),
        ("zero area", None),
        ("nan vertex", "broken"),
        ("infinite vertex", "broken"),
        ("huge vertex", None),
        ("nan normals", None),
        ("scale 0", None),
        ("scale flat", None),
        ("scale tiny", None),
        ("scale huge", None),
        ("nan place", "nowhere"),
        ("mirrored", None),
        ("mirrored thrice", None),
        ("lamp without size", None),
        ("lamp nowhere", None),
        ("lamp of scale 0", None),
        ("lamp of less than nothing", None),
        ("node loop", None),
    ],
)
def test_what_is_bad_is_left_out_and_the_rest_is_right(results, case, note):
    facts = results[case]
    assert facts["error"] == facts["raised"] == ""
    if note:
        assert any(note in text for text in facts["notes"]), facts["notes"]
    same_picture(facts, results["good"])


def test_nothing_to_see(results):
    for case in ("no lights", "no world"):
        assert results[case]["mean"] == [0, 0, 0] and results[case]["error"] == ""
    assert results["only empty mesh"]["mean"] == pytest.approx([1, 1, 1], abs=1e-3)


BROKEN = ("missing.png", "zero.png", "half.png", "short.png", "junk.png", "empty.png", "huge.png",
          "half.exr", "junk.exr", "junk.hdr", "zero.hdr", "head.hdr")  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_images_are_pink_and_named(results, name):
    """Cycles' colour of a missing image."""
    facts = results[f"image {name}"]
    red, green, blue = facts["middle"]
    assert min(red, blue) > 0.9 and green < 0.1, facts["middle"]
    assert len(facts["notes"]) == 1 and name in facts["notes"][0] and "can't be read" in facts["notes"][0]
    assert facts["error"] == ""


def test_images_of_one_pixel(results):
    for case in ("image 1x1", "image 1x1 exr"):
        red, green, blue = results[case]["middle"]
        assert green > 0.9 and max(red, blue) < 0.1, results[case]["middle"]
    assert results["environment 1x1"]["mean"][0] == 0 < results["environment 1x1"]["mean"][1]
    assert results["image slot empty"]["middle"][1] < 0.1 < results["image slot empty"]["middle"][0]
    for name in BROKEN[::4]:
        red, green, blue = results[f"environment {name}"]["mean"]
        assert min(red, blue) > 0.5 and green == 0


@pytest.mark.alone
def test_cancel_then_render_again(core, tmp_path):
    """A cancelled render ends at once with its picture, and the next one is complete."""
    facts = run(
        """
        import os, time
        final = sys.modules["headwater_addon.final"]
        seen, asked = [], []
        def watch(event, facts):
            if event == "frame":
                seen.append(facts)
            elif cancel and facts["sample"] > 0:
                asked.append(time.perf_counter())
                return True
        final.observers.append(watch)
        cancel, scene.headwater.samples = True, 1 << 20
        bpy.ops.render.render(write_still=True)
        took = time.perf_counter() - asked[0]
        cancel, scene.headwater.samples = False, 3
        bpy.ops.render.render(write_still=True)
        show(took=took, cancelled=[f["cancelled"] for f in seen], error=hb.last_error(),
             files=sorted(os.listdir(tmp)))
        """,
        tmp_path,
        fake=False,
    )
    assert facts["cancelled"] == [True, False] and facts["error"] == ""
    assert facts["took"] < 1.0, "half a second, and as much again to end on a busy machine"
    assert any(name.startswith("frame_") for name in facts["files"])


def test_without_any_vulkan_driver(core, tmp_path, monkeypatch):
    """The add-on registers, its preferences draw, and a render says what to install."""
    monkeypatch.setenv("VK_ICD_FILENAMES", str(tmp_path / "nothing.json"))
    monkeypatch.setenv("VK_DRIVER_FILES", str(tmp_path / "nothing.json"))
    facts = run(
        """
        from unittest.mock import MagicMock
        native = sys.modules["headwater_addon.native"]
        preferences = sys.modules["headwater_addon.preferences"]
        layout = MagicMock()
        own = MagicMock(layout=layout)
        preferences.HeadwaterPreferences.draw(own, bpy.context)
        labels = [call.kwargs.get("text") for call in layout.box().column().label.call_args_list]
        message = ""
        try:
            bpy.ops.render.render()
        except RuntimeError as error:
            message = str(error)
        show(devices=native.devices(), failure=native.failure(), labels=labels, message=message, last=hb.last_error(),
             device=bpy.context.preferences.addons["headwater_addon"].preferences.device,
             again=bpy.ops.headwater.refresh_devices())
        """,
        tmp_path,
        fake=False,
    )
    assert facts["devices"] == [] and facts["failure"] == "" and facts["device"] == "AUTO"
    assert "No Vulkan device found" in facts["labels"] and "mesa-vulkan-drivers" in facts["labels"][1]
    for text in (facts["message"], facts["last"]):
        assert "no Vulkan" in text and re.search("install.*mesa-vulkan-drivers", text), text
    assert "Traceback" not in facts["stdout"] + facts["stderr"]
