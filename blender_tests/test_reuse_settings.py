# SPDX-License-Identifier: Apache-2.0
"""Integrators and their parameters outside the core: headwater.integrators against the core's table and the manual, the
command's options, and a render of each kind of file. Blender's properties: test_reuse_blender.py."""

import json
import os
import re
import subprocess
import sys
import types

import fake_core
import numpy as np
import pytest

from headwater import cli, render_reuse
from headwater.image_io import read_exr
from headwater.info import format_report
from headwater.integrators import ESTIMATORS, INTEGRATORS, PARAMETERS, Choice, Number, Whole, readers

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SCENE = """#usda 1.0
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
# Of each kind one, none at its default.
GRID_OPTIONS = {
    "--candidates": ("4", 4),
    "--neighbours": ("0", 0),
    "--grid-extent": ("12.5", 12.5),
    "--temporal-reuse": ("off", False),
    "--spatial-reuse": ("on", True),
    "--grid-follow": ("camera", "camera"),
    "--empty-cells": ("black", "black"),
}


def settings_of(integrator, **parameters):
    return {"width": 32, "height": 18, "integrator": integrator, **parameters}


def float32(value):
    return value if isinstance(value, (str, bool)) else np.float32(value)


# The table and the core


def test_integrators_are_the_cores(core):
    theirs = {each["name"]: each for each in core.integrator_table()}
    assert list(theirs) == list(INTEGRATORS) == core.integrators()
    for name, ours in INTEGRATORS.items():
        assert (ours.label, ours.description) == (theirs[name]["label"], theirs[name]["description"])
        for key, values in (("parameters", ours.defaults), ("unbiased_parameters", ours.unbiased)):
            defaults = {parameter: float32(value) for parameter, value in theirs[name][key].items()}
            assert defaults == {parameter: float32(value) for parameter, value in values.items()}, (name, key)
    assert set(PARAMETERS) == {
        key for each in theirs.values() for key in (*each["parameters"], *each["unbiased_parameters"])
    }


def a_reader(name):
    """(estimator, integrator) that reads the parameter."""
    return next((estimator, readers(name, estimator)[0]) for estimator, _, _ in ESTIMATORS if readers(name, estimator))


@pytest.mark.parametrize("estimator", [name for name, _, _ in ESTIMATORS])
def test_a_parameter_is_taken_by_its_readers_only(core, estimator):
    for integrator in INTEGRATORS.values():
        for name in PARAMETERS:
            by, reader = a_reader(name)
            value = integrator.parameters(estimator).get(name, reader.parameters(by)[name])
            settings = settings_of(integrator.name, estimator=estimator, **{name: value})
            if name in integrator.parameters(estimator):
                core.reservoir_bytes(settings)
            else:
                with pytest.raises(ValueError, match=f"'{integrator.name}' has no parameter '{name}'"):
                    core.reservoir_bytes(settings)


@pytest.mark.parametrize("estimator", [name for name, _, _ in ESTIMATORS])
@pytest.mark.parametrize("name", [name for name, each in PARAMETERS.items() if isinstance(each, (Whole, Number))])
def test_ranges_are_the_cores(core, name, estimator):
    parameter = PARAMETERS[name]
    if not readers(name, estimator):
        pytest.skip(f"no integrator reads {name} with {estimator}")
    integrator = readers(name, estimator)[0].name
    assert parameter.least <= parameter.soft_most <= parameter.most
    if isinstance(parameter, Whole):
        least, most = parameter.range(estimator)
        beyond = least - 1, most + 1
    else:
        least, most = parameter.least, parameter.most
        beyond = (float(np.nextafter(np.float32(least), np.float32(-1))),
                  float(np.nextafter(np.float32(most), np.float32(np.inf))))  # fmt: skip
    for value in (least, most):
        core.reservoir_bytes(settings_of(integrator, estimator=estimator, **{name: value}))
    for value in beyond:
        with pytest.raises(ValueError, match=name):
            core.reservoir_bytes(settings_of(integrator, estimator=estimator, **{name: value}))


def test_choices_and_estimators_are_the_cores(core):
    for name, parameter in PARAMETERS.items():
        if isinstance(parameter, Choice):
            with pytest.raises(ValueError, match="choices are ") as caught:
                estimator, integrator = a_reader(name)
                core.reservoir_bytes(settings_of(integrator.name, estimator=estimator, **{name: "magic"}))
            listed = str(caught.value).rpartition("choices are ")[2]
            assert listed == ", ".join(value for value, _, _ in parameter.choices)
    with pytest.raises(ValueError, match="estimators are ") as caught:
        core.reservoir_bytes(settings_of("restir", estimator="magic"))
    assert str(caught.value).rpartition("estimators are ")[2] == ", ".join(value for value, _, _ in ESTIMATORS)


def test_the_manual_has_every_parameter_with_its_option():
    with open(os.path.join(ROOT, "docs", "manual", "reuse.md"), encoding="utf-8") as file:
        text = file.read()
    for name, parameter in PARAMETERS.items():
        assert f"`{name}`" in text and f"`{parameter.flag}`" in text, name
    for name in INTEGRATORS:
        assert f"`{name}`" in text, name


# The command


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "scene.usda"
    path.write_text(SCENE)
    return str(path)


@pytest.fixture
def fake(monkeypatch):
    """The double of the core behind the command, in this process."""
    pytest.importorskip("pxr")
    from headwater import render_usd

    module = types.SimpleNamespace(**{k: v for k, v in vars(fake_core).items() if not k.startswith("__")})
    module.all_passes = lambda: list(fake_core.PASSES.items())
    monkeypatch.setattr("headwater.core.load", lambda: module)
    monkeypatch.setattr(render_usd, "load", lambda: module)
    monkeypatch.setattr(fake_core, "render_seconds", 0.0)
    fake_core.sessions.clear()
    return module


def render(scene, *options):
    return cli.main(["render", scene, "--size", "32x18", *map(str, options)])


def test_options_reach_the_core_and_others_stay_away(scene, fake, tmp_path):
    given = [word for flag, (text, _) in GRID_OPTIONS.items() for word in (flag, text)]
    assert render(scene, "-o", tmp_path / "x.exr", "--integrator", "wssr-grid", "--estimator", "paper", *given) == 0
    (settings,) = fake_core.sessions[-1].settings
    assert settings["integrator"] == "wssr-grid" and settings["estimator"] == "paper"
    expected = {flag[2:].replace("-", "_"): value for flag, (_, value) in GRID_OPTIONS.items()}
    assert {name: settings[name] for name in PARAMETERS if name in settings} == expected


@pytest.mark.parametrize("estimator", [name for name, _, _ in ESTIMATORS])
def test_every_parameter_has_an_option_that_takes_its_default(scene, fake, tmp_path, estimator):
    for integrator in INTEGRATORS.values():
        words = {True: "on", False: "off"}
        given = ["--estimator", estimator]
        for name, value in integrator.parameters(estimator).items():
            given += [PARAMETERS[name].flag, words[value] if isinstance(value, bool) else value]
        assert render(scene, "-o", tmp_path / "x.exr", "--integrator", integrator.name, *given) == 0
        settings = fake_core.sessions[-1].settings[-1]
        assert {name: settings[name] for name in PARAMETERS if name in settings} == integrator.parameters(estimator)


def test_nothing_is_sent_that_was_not_asked_for(scene, fake, tmp_path):
    assert render(scene, "-o", tmp_path / "x.exr", "--integrator", "restir") == 0
    assert not set(fake_core.sessions[-1].settings[-1]) & {*PARAMETERS, "estimator"}


@pytest.mark.parametrize(
    "options, words",
    [
        (("--integrator", "magic"), ("magic", *INTEGRATORS)),
        (("--integrator", "restir", "--estimator", "magic"), ("magic", "restir", "paper")),
        (("--estimator", "magic"), ("magic", "paper")),
        (("--candidates", "8"), ("wssr-hash", "candidates")),
        (
            ("--integrator", "restir", "--estimator", "unbiased", "--reuse-weights", "1/M"),
            ("reuse_weights", "unbiased"),
        ),
        (("--integrator", "restir", "--mis-weights", "pairwise"), ("mis_weights", "paper")),
        (("--integrator", "wssr-kd", "--estimator", "unbiased", "--history", "0"), ("history", "1 to 1000")),
        (("--integrator", "wssr-grid", "--estimator", "unbiased", "--cell-inputs", "9"), ("cell_inputs", "unbiased")),
        (("--integrator", "restir", "--candidates", "0"), ("candidates", "1 to 1024", "0")),
        (("--integrator", "restir", "--neighbours", "-1"), ("neighbours", "-1")),
        (("--integrator", "restir", "--neighbours", "65"), ("neighbours", "0 to 64", "65")),
        (("--integrator", "restir", "--neighbours", "many"), ("neighbours", "many")),
        (("--integrator", "restir", "--reuse-radius", "nan"), ("reuse_radius",)),
        (("--integrator", "restir", "--reuse-radius", "wide"), ("reuse-radius", "wide")),
        (("--integrator", "restir", "--grid-resolution", "64"), ("restir", "grid_resolution")),
        (("--integrator", "wssr-kd", "--grid-extent", "64"), ("wssr-kd", "grid_extent")),
        (("--integrator", "restir", "--reuse-weights", "2/M"), ("2/M", "1/M", "1/Z", "mis")),
        (("--integrator", "restir", "--temporal-reuse", "maybe"), ("temporal-reuse", "maybe", "on, off")),
        (("--integrator", "wssr-grid", "--grid-follow", "car"), ("car", "world", "camera")),
    ],
)
def test_refused_in_one_line_before_anything_is_rendered(core, scene, tmp_path, capsys, options, words):
    assert render(scene, "-o", tmp_path / "x.exr", "--samples", 1 << 30, *options) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("headwater: error: ")
    for word in words:
        assert word in line, line
    assert not (tmp_path / "x.exr").exists()


def test_help_says_who_reads_what_with_which_default(capsys):
    with pytest.raises(SystemExit):
        cli.main(["render", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    assert "reservoirs:" in text
    for name, parameter in PARAMETERS.items():
        assert f"{parameter.flag} " in text
        # argparse breaks lines at hyphens too.
        assert render_reuse.help_text(parameter).replace(" ", "").replace("-", "") in re.sub(r"[ -]", "", text), name
    assert "[restir: 5; restir-reproject, wssr-kd, wssr-grid, wssr-grid-reproject: 3]" in render_reuse.help_text(
        PARAMETERS["neighbours"]
    )


def test_info_lists_integrators():
    report = {"headwater": "1", "python": "3", "platform": "x", "core": {}, "packages": {}, "denoiser": None}
    report |= {"devices": [], "chosen_device": None, "error": None, "integrators": fake_core.integrator_table()}
    lines = [line.strip() for line in format_report(report).splitlines()]
    for integrator in INTEGRATORS.values():
        assert any(re.fullmatch(rf"{integrator.name} +{re.escape(integrator.description)}", line) for line in lines)


def test_statistics_have_the_cores_reservoir_bytes(scene, fake, tmp_path, monkeypatch):
    path = tmp_path / "s.json"
    assert render(scene, "-o", tmp_path / "x.exr", "--integrator", "restir", "--stats", path) == 0
    report = json.loads(path.read_text())
    assert "reservoir_bytes" not in report["totals"], "a core that does not say it"
    stats = fake_core.Session.stats
    monkeypatch.setattr(fake_core.Session, "stats", lambda self: stats(self) | {"reservoir_bytes": 4711})
    assert render(scene, "-o", tmp_path / "x.exr", "--integrator", "restir", "--stats", path) == 0
    report = json.loads(path.read_text())
    assert report["totals"]["reservoir_bytes"] == 4711
    assert report["frames"][0]["layers"][0]["render"]["reservoir_bytes"] == 4711


# The real core


def test_usd_and_blend_render_with_parameters(core, scene, tmp_path):
    pytest.importorskip("pxr")
    pytest.importorskip("bpy")
    blend = tmp_path / "cube.blend"
    make = "import bpy, sys; bpy.ops.wm.read_factory_settings(); bpy.ops.wm.save_as_mainfile(filepath=sys.argv[-1])"
    subprocess.run([sys.executable, "-c", make, str(blend)], check=True, capture_output=True, timeout=120)
    wishes = {
        scene: ("wssr-grid", {"grid_resolution": 16, "neighbours": 2, "empty_cells": "canonical"}),
        str(blend): ("restir", {"candidates": 4, "spatial_reuse": False, "reuse_weights": "mis"}),
    }
    for file, (integrator, parameters) in wishes.items():
        output, stats = tmp_path / f"{integrator}.exr", tmp_path / f"{integrator}.json"
        command = [sys.executable, "-m", "headwater", "render", file, "-o", str(output), "--stats", str(stats)]
        command += ["--size", "32x18", "--samples", "2", "--integrator", integrator]
        for name, value in parameters.items():
            command += [PARAMETERS[name].flag, "off" if value is False else str(value)]
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=300, env=dict(os.environ, PYTHONPATH=ROOT)
        )
        assert done.returncode == 0, done.stderr
        (pixels,) = read_exr(str(output)).layers.values()
        assert pixels.shape == (18, 32, 4) and np.isfinite(pixels).all() and pixels[..., :3].mean() > 0.01
        report = json.loads(stats.read_text())
        assert report["settings"]["integrator"] == integrator and report["settings"]["reuse"] == parameters
        # 0: an integrator whose stages are not there yet renders as `path`.
        assert report["totals"]["reservoir_bytes"] in (0, core.reservoir_bytes(settings_of(integrator, **parameters)))
