# SPDX-License-Identifier: Apache-2.0
"""The validation layers are on, in every way to render, and what they say fails the test in which it is said.

Only where the tests run with HEADWATER_VALIDATION=1, as ./dev test does.
"""

import os
import subprocess
import sys
from pathlib import Path

import bpy_process
import pytest
from pxr import Usd, UsdGeom

pytestmark = pytest.mark.skipif(
    os.environ.get("HEADWATER_VALIDATION") != "1", reason="HEADWATER_VALIDATION=1 is not set"
)

LAYER = "VkLayer_khronos_validation"


def test_layers_are_loaded_in_blender(tmp_path):
    facts = bpy_process.run(
        f"""
        bpy.ops.render.render()
        show(loaded={LAYER!r} in open("/proc/self/maps").read())
        """,
        tmp_path,
        fake=False,
    )
    assert facts["loaded"]


def test_layers_are_loaded_by_the_command(tmp_path):
    stage = Usd.Stage.CreateNew(str(tmp_path / "scene.usda"))
    UsdGeom.Camera.Define(stage, "/camera")
    stage.GetRootLayer().Save()
    code = f"""
import headwater.render_usd as render_usd
from headwater.cli import main
make_context, loaded = render_usd.make_context, []
def looked_at(*args):
    context = make_context(*args)
    loaded.append({LAYER!r} in open("/proc/self/maps").read())
    return context
render_usd.make_context = looked_at
status = main(["render", {str(tmp_path / "scene.usda")!r}, "-o", {str(tmp_path / "out.exr")!r},
               "--size", "8x8", "--samples", "1", "--quiet"])
assert not status, status
assert loaded == [True], loaded
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("speaks", [False, True])
def test_a_message_of_any_process_fails_the_test(tmp_path, speaks):
    child = "import os; open(os.environ['HEADWATER_VALIDATION_LOG'], 'a').write('Vulkan validation error: spoken')"
    call = f"{speaks} and subprocess.run([sys.executable, '-c', {child!r}])"
    test = f"import subprocess, sys\n\ndef test_it():\n    {call}\n"
    (tmp_path / "test_it.py").write_text(test)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "conftest", "-c", os.devnull, "--rootdir", str(tmp_path)]
        + ["-p", "no:cacheprovider", str(tmp_path / "test_it.py")],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent)},
    )
    assert done.returncode == (1 if speaks else 0), done.stdout + done.stderr
    assert ("Vulkan validation error: spoken" in done.stdout) == speaks
