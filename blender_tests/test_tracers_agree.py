# SPDX-License-Identifier: Apache-2.0
"""All Tracers give the same picture: data passes to float tolerance, light within noise."""

import os
from pathlib import Path

import core_scenes
import numpy as np
import pytest
from bpy_process import run

from headwater.tile_test import tile_test

pytestmark = pytest.mark.ray_query
DEVICE = ("ray_query", "ray_pipeline")
EDGES = 0.004  # share of pixels whose centre lies so near an edge that rounding decides which surface is met


def assert_passes_agree(a, b):
    for name in ("Depth", "Position", "Object Index", "Normal", "UV", "Mist"):
        difference = np.abs(a[name] - b[name]).max(-1) / (1 + np.abs(a[name]).max(-1))
        assert (difference > 2e-5).mean() < EDGES, name


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_core_scene(core, make_context, kind):
    scene = core_scenes.open_scene(core)
    if kind == "orthographic":
        scene.set_camera("orthographic", core_scenes.placed(z=4), (-2, 2, -2, 2))
    runs = {}
    for tracer in ("embree", *DEVICE):
        context = make_context(tracer)
        runs[tracer] = [core_scenes.picture(core, context, scene, 48, seed=s, samples=8) for s in (1, 2, 3, 4, 5, 6)]
    light = {tracer: [p["Combined"][..., :3] for p in pictures] for tracer, pictures in runs.items()}
    for tracer in DEVICE:
        assert_passes_agree(runs["embree"][0], runs[tracer][0])
        # The same seeds give the same paths, until rounding parts them: nearly all pixels are equal.
        a, b = light["embree"][0], light[tracer][0]
        assert (np.abs(a - b).max(-1) > 1e-3 * (1 + a.max(-1))).mean() < 0.05
        # With other seeds for one of them, the expectation is tested.
        assert tile_test(light["embree"][:3], light[tracer][3:], 4).p_family > 1e-3
        assert tile_test([1.05 * x for x in light["embree"]], light[tracer], 4).p_family < 1e-3, "the test can fail"


def _files():
    folder = os.environ.get("HEADWATER_TEST_SCENES")
    return sorted(Path(folder).rglob("*.blend")) if folder else []


BLEND = """
import engine_pictures as ep
{fill}
ep.passes(scene.view_layers[0], ("z", "position", "normal", "uv", "object_index", "mist"), False)
import headwater.blender as hb
pictures = dict()
for tracer in ("embree", {tracer!r}):
    {choose}
    pictures[tracer] = ep.picture("HEADWATER", tmp, 16)
a, b = pictures["embree"], pictures[{tracer!r}]
found = dict()
for name in a:
    limit = 1e-3 if name == "Combined" else 5e-5
    d = np.abs(a[name] - b[name]).max(-1) / (1 + np.abs(a[name]).max(-1))
    found[name] = float((d > limit).mean())
signed = float(a["Combined"].mean() / max(b["Combined"].mean(), 1e-9) - 1) if a["Combined"].any() else 0.0
show(found=found, signed=signed)
"""
OPEN = """
bpy.ops.wm.open_mainfile(filepath={path!r})
scene = bpy.context.scene
ep.settings(scene, 40, 40, scene.cycles.max_bounces)
"""
CHOOSE = "scene.headwater.tracer = tracer"


def check(facts):
    assert len(facts["found"]) >= 7
    for name, share in facts["found"].items():
        assert share < (0.05 if name == "Combined" else 0.008), (name, share)
    assert abs(facts["signed"]) < 0.01


@pytest.mark.parametrize("tracer", DEVICE)
def test_blender_scene_with_every_material(tmp_path, tracer):
    fill = "import pass_scene; pass_scene.build(scene)"
    check(run(BLEND.format(fill=fill, choose=CHOOSE, tracer=tracer), tmp_path, fake=False, timeout=300))


@pytest.mark.skipif(not _files(), reason="HEADWATER_TEST_SCENES names no folder with .blend files")
@pytest.mark.parametrize("path", _files(), ids=lambda p: p.stem)
@pytest.mark.parametrize("tracer", DEVICE)
def test_files(tmp_path, path, tracer):
    code = BLEND.format(fill=OPEN.format(path=str(path)), choose=CHOOSE, tracer=tracer)
    check(run(code, tmp_path, fake=False, timeout=300))
