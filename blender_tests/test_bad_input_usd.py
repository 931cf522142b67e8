# SPDX-License-Identifier: GPL-3.0-or-later
"""Bad USD stages through the command and the real core: a correct picture with a warning that names the prim, or one
error line, status not 0 and the old picture kept. All of them are rendered by one process, which must survive.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("pxr")
OpenEXR = pytest.importorskip("OpenEXR")
pytest.importorskip("bpy")  # bad_scenes.py, whose broken images are used here
HERE = os.path.dirname(os.path.abspath(__file__))

HEAD = '#usda 1.0\n(\n    upAxis = "Z"\n    metersPerUnit = 1\n)\n'
CAMERA = """def Camera "camera"
{
    double3 xformOp:translate = (0, 0, 6)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
SKY = 'def DomeLight "sky"\n{\n}\n'
CUBE = 'def Cube "cube"\n{\n}\n'
GOOD = CAMERA + SKY + CUBE
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]


def mesh(name, points, indices=(0, 1, 2, 3), counts=None, extra=""):
    points = ", ".join(str(p).replace("'", "") for p in points)
    return f"""def Mesh "{name}" (prepend apiSchemas = ["MaterialBindingAPI"])
{{
    uniform token subdivisionScheme = "none"
    point3f[] points = [{points}]
    int[] faceVertexCounts = {list(counts or [len(indices)])}
    int[] faceVertexIndices = {list(indices)}
    {extra}
}}
"""


def scaled(scale):
    order = 'uniform token[] xformOpOrder = ["xformOp:scale"]'
    return mesh("odd", SQUARE, extra=f"double3 xformOp:scale = ({scale})\n    {order}")


def light(kind, attribute):
    return f'def {kind} "lamp"\n{{\n    {attribute}\n}}\n'


def material(connection, shaders=""):
    return f"""def Material "paint"
{{
    token outputs:surface.connect = </paint/surface.outputs:surface>
    def Shader "surface"
    {{
        uniform token info:id = "UsdPreviewSurface"
        {connection}
        token outputs:surface
    }}
    {shaders}
}}
"""


def textured(file):
    shaders = f"""def Shader "map"
    {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{file}@
        float3 outputs:rgb
    }}"""
    square = mesh("square", SQUARE, extra="rel material:binding = </paint>")
    return CAMERA + SKY + square + material("color3f inputs:diffuseColor.connect = </paint/map.outputs:rgb>", shaders)


def dome(file):
    return CAMERA + CUBE + light("DomeLight", f"asset inputs:texture:file = @{file}@")


def many(count):
    places = np.random.default_rng(1).uniform(-1.5, 1.5, (count, 3)).round(3)
    places = ", ".join("(%g, %g, %g)" % tuple(p) for p in places)
    return f"""def PointInstancer "many"
{{
    int[] protoIndices = [{", ".join(["0"] * count)}]
    point3f[] positions = [{places}]
    rel prototypes = </many/grain>
    def Cube "grain"
    {{
        double size = 0.004
    }}
}}
"""


SLIVER = mesh("sliver", [(0, 0, 2), (1, 0, 2), (2, 0, 2)], (0, 1, 2))
GLOW = "color3f inputs:emissiveColor = (1, 1, 1)"
IMAGES = ("missing.png", "zero.png", "half.png", "junk.png", "empty.png", "huge.png", "half.exr", "junk.exr",
          "junk.hdr", "zero.hdr", "head.hdr")  # fmt: skip
STAGES = {
    "good": GOOD,
    "no camera": SKY + CUBE,
    "no lights": CAMERA + CUBE,
    "nothing": "",
    "empty mesh": GOOD + mesh("empty", [], (), [0]),
    "no points": GOOD + mesh("pointless", []),
    "bad index": GOOD + mesh("wrong", SQUARE, (0, 1, 2, 9)),
    "bad counts": GOOD + mesh("wrong", SQUARE, counts=[4, 4]),
    "zero area": GOOD + SLIVER,
    "zero area, emissive": CAMERA
    + CUBE
    + mesh("dark", [(0, 0, 2)] * 3, (0, 1, 2), extra="rel material:binding = </paint>")
    + material(GLOW),
    "nan point": GOOD + mesh("broken", [("nan", 0, 0), *SQUARE[1:]]),
    "infinite point": GOOD + mesh("broken", [("inf", 0, 0), *SQUARE[1:]]),
    "huge point": GOOD + mesh("large", [("3e38", 0, -50), ("-3e38", 1, -50), (0, "3e38", -50)], (0, 1, 2)),
    "scale 0": GOOD + scaled("0, 0, 0"),
    "scale flat": GOOD + scaled("1, 0, 1"),
    "scale nan": GOOD + scaled("nan, 1, 1"),
    "scale tiny": GOOD + scaled("1e-30, 1e-30, 1e-30"),
    "mirrored": GOOD.replace(
        'def Cube "cube"\n{',
        'def Cube "cube"\n{\n double3 xformOp:scale = (-1, 1, 1)\n uniform token[] xformOpOrder = ["xformOp:scale"]',
    ),
    "lamp of no number": GOOD + light("SphereLight", "float inputs:intensity = nan"),
    "infinite lamp": GOOD + light("SphereLight", "float inputs:intensity = inf"),
    "lamp without size": GOOD + light("RectLight", "float inputs:width = 0"),
    "flat camera": GOOD.replace("translate", "scale").replace("(0, 0, 6)", "(0, 0, 0)"),
    "camera nowhere": GOOD.replace("(0, 0, 6)", "(nan, 0, 6)"),
    "image one.png": textured("one.png"),
    "image one.exr": textured("one.exr"),
    "sky one.exr": dome("one.exr"),
    "sky nan.exr": dome("nan.exr"),
    "a million": CAMERA + SKY + many(1_000_000),
    **{f"image {name}": textured(name) for name in IMAGES},
    **{f"sky {name}": dome(name) for name in IMAGES[::3]},
}

DRIVER = """
import contextlib, io, json, os, sys
sys.path[:0] = [{root!r}, {here!r}]
from headwater import cli
from headwater.image_io import read_exr
import numpy as np
results = {{}}
for name, options in json.load(open("list.json")):
    out = name + ".exr"
    with open(out, "wb") as file:
        file.write(b"the old picture")
    text = io.StringIO()
    with contextlib.redirect_stderr(text):
        status = cli.main(["render", name + ".usda", "-o", out, "--size", "16x16", "--samples", "2", *options])
    facts = {{"status": status, "lines": [l for l in text.getvalue().splitlines() if l.startswith("headwater:")],
             "traceback": "Traceback" in text.getvalue(), "kept": open(out, "rb").read(20) == b"the old picture"}}
    if not facts["kept"]:
        pixels = read_exr(out).layers[""]
        facts["mean"] = [float(v) for v in pixels[..., :3].mean(axis=(0, 1))]
        facts["middle"] = [float(v) for v in pixels[8, 8, :3]]
        facts["finite"] = bool(np.isfinite(pixels).all())
    results[name] = facts
print("FACTS:" + json.dumps(results))
"""


@pytest.fixture(scope="module")
def results(core, tmp_path_factory):
    """Status, lines and picture of every stage."""
    folder = tmp_path_factory.mktemp("stages")
    make_images = f"import sys; sys.path.insert(0, {HERE!r}); import bad_scenes; bad_scenes.write_files('.')"
    subprocess.run([sys.executable, "-c", make_images], cwd=folder, check=True, timeout=60, capture_output=True)
    low = ["--memory-limit", "1", "--size", "256x256"]
    listed = [(name, text, ["--quiet"]) for name, text in STAGES.items()]
    listed += [("low", GOOD, low), ("last", GOOD, [])]
    for name, text, _ in listed:
        (folder / f"{name}.usda").write_text(HEAD + text)
    listed = [(name, options) for name, _, options in listed]
    (folder / "list.json").write_text(json.dumps(listed))
    code = DRIVER.format(root=os.path.dirname(HERE), here=HERE)
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, f"died ({done.returncode})\n{done.stderr[-3000:]}"
    line = next(line for line in done.stdout.splitlines() if line.startswith("FACTS:"))
    assert not [name for name in os.listdir(folder) if name.startswith(".headwater")], "temporary files are left over"
    return json.loads(line.removeprefix("FACTS:"))


def test_every_picture_is_finite_and_every_failure_keeps_the_old_one(results):
    for name, facts in results.items():
        assert not facts["traceback"], name
        assert (facts["status"] == 0) == (not facts["kept"]), name
        assert facts.get("finite", True), name


@pytest.mark.parametrize(
    "case, words",
    [
        ("flat camera", ["/camera", "flat"]),
        ("camera nowhere", ["/camera", "not finite"]),
        ("low", ["Out of memory", "limit of 1.0 MiB"]),
    ],
)
def test_errors_are_one_line_and_keep_the_old_picture(results, case, words):
    facts = results[case]
    assert facts["status"] in (1, 2) and facts["kept"]
    errors = [line for line in facts["lines"] if line.startswith("headwater: error:")]
    assert len(errors) == 1 and all(word in errors[0] for word in words), facts["lines"]


def test_the_process_renders_on_after_all_of_it(results):
    assert results["last"]["mean"] == pytest.approx(results["good"]["mean"], abs=1e-6)


@pytest.mark.parametrize(
    "case, word",
    [
        ("empty mesh", "/empty"),
        ("no points", "/pointless"),
        ("bad index", "/wrong"),
        ("bad counts", "/wrong"),
        ("zero area", None),
        ("nan point", "/broken"),
        ("infinite point", "/broken"),
        ("huge point", None),
        ("scale 0", None),
        ("scale flat", None),
        ("scale nan", "/odd"),
        ("scale tiny", None),
        ("mirrored", None),
        ("lamp of no number", "/lamp"),
        ("infinite lamp", "/lamp"),
        ("lamp without size", "/lamp"),
    ],
)
def test_what_is_bad_is_left_out_and_the_rest_is_right(results, case, word):
    facts = results[case]
    assert facts["status"] == 0
    assert facts["mean"] == pytest.approx(results["good"]["mean"], abs=0.02)
    if word:
        assert any(word in line for line in facts["lines"]), facts["lines"]


def test_nothing_to_see(results):
    assert results["no lights"]["mean"] == results["zero area, emissive"]["mean"] == [0, 0, 0]
    assert results["nothing"]["mean"] == [0, 0, 0]
    for case in ("no camera", "nothing"):
        assert any("no camera" in line for line in results[case]["lines"])
    assert min(results["no camera"]["mean"]) > 0.3, "a camera that sees everything is used"


@pytest.mark.parametrize("name", IMAGES)
def test_broken_images_are_named_and_take_their_fallback(results, name):
    facts = results[f"image {name}"]
    assert facts["status"] == 0 and min(facts["middle"]) >= 0
    lines = [line for line in facts["lines"] if name in line]
    assert len(lines) == 1 and lines[0].startswith("headwater: warning: /paint"), facts["lines"]


def test_broken_skies_are_named(results):
    for name in IMAGES[::3]:
        facts = results[f"sky {name}"]
        assert facts["status"] == 0 and any("/lamp" in line for line in facts["lines"]), facts
    assert any("nan.exr" in line for line in results["sky nan.exr"]["lines"])


def test_images_of_one_pixel(results):
    for case in ("image one.png", "image one.exr", "sky one.exr"):
        red, green, blue = results[case]["middle"]
        assert green > 0.5 and max(red, blue) < 0.2, results[case]


def test_a_million_instances(results):
    facts = results["a million"]
    assert facts["status"] == 0
    assert 0.1 < facts["mean"][0] < 1.2


def test_a_cancelled_render_with_nothing_to_show_keeps_the_old_picture(core, tmp_path, monkeypatch, capsys):
    """Ctrl-C before there is a picture, and SIGTERM as Ctrl-C: status 130, nothing overwritten."""
    from headwater import cli, interrupt

    stage, out = tmp_path / "a.usda", tmp_path / "a.exr"
    stage.write_text(HEAD + GOOD)
    out.write_bytes(b"the old picture")
    opened = interrupt.Watch.__enter__
    monkeypatch.setattr(interrupt.Watch, "__enter__", lambda self: (opened(self), interrupt.request())[0])
    assert cli.main(["render", str(stage), "-o", str(out), "--quiet"]) == 130
    assert out.read_bytes() == b"the old picture"
    assert "Traceback" not in capsys.readouterr().err
