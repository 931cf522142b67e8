# SPDX-License-Identifier: GPL-3.0-or-later
"""The Vector pass against Cycles': from where things were a frame ago and to where they will be, of what moves, deforms
and does neither under a moving camera."""

import pytest
from bpy_process import run

SCENE = """
import pass_scene, engine_pictures as ep
pass_scene.build(scene, card_seen=False)
# Not the same way back and on: what is on is faster.
ball = next(o for o in scene.objects if o.type == "MESH" and o.animation_data)
ball.location = (-1.2, 0.3, 1.9)
ball.keyframe_insert("location", frame=3)
scene.camera.location.x, scene.camera.rotation_euler.z = 0.7, 0.06
scene.camera.keyframe_insert("location", frame=3)
scene.camera.keyframe_insert("rotation_euler", frame=3)
scene.camera.rotation_euler.z = 0.0
scene.camera.keyframe_insert("rotation_euler", frame=2)
# A mesh that deforms.
soft = ep.shape("uv_sphere", (1.9, 1.2, 0.9), material=None)
soft.shape_key_add(name="Basis")
key = soft.shape_key_add(name="wide")
for point in key.data:
    point.co.x *= 2.0
for frame, value in ((1, 0.0), (2, 0.1), (3, 0.5)):
    key.value = value
    key.keyframe_insert("value", frame=frame)
scene.frame_set(2)
scene.headwater.integrator = "path"  # wssr-hash takes other numbers in every frame that goes on from another
"""
MEASURE = """
found = dict()
for name, channels in dict(back=slice(0, 2), on=slice(2, 4)).items():
    a, b = theirs["Vector"][..., channels], ours["Vector"][..., channels]
    apart = np.abs(a - b).max(-1)
    found[name] = dict(median=float(np.median(apart)), q95=float(np.quantile(apart, 0.95)),
                       length=float(np.abs(a).max()), moves=float((np.abs(a).max(-1) > 0.05).mean()))
a = theirs["Vector"]
found["unlike"] = float(np.abs(a[..., :2] - a[..., 2:]).max())
"""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return run(
        SCENE
        + """
theirs, ours = ep.picture("CYCLES", tmp, 64), ep.picture("HEADWATER", tmp, 64)
"""
        + MEASURE
        + """
scene.frame_start, scene.frame_end = 1, 2
scene.render.filepath = tmp + "/animated_"
bpy.ops.render.render(animation=True)
animated = ep.read_exr(tmp + "/animated_0002.exr").layers[scene.view_layers[0].name + ".Vector"]
found["animation"] = float(np.quantile(np.abs(animated - ours["Vector"]).max(-1), 0.99))
np.save(tmp + "/vectors.npy", np.concatenate([theirs["Vector"], ours["Vector"]], 1))
show(found=found)
""",
        tmp_path_factory.mktemp("motion"),
        fake=False,
        timeout=300,
    )["found"]


def test_motion_is_cycles(found):
    assert found["unlike"] > 1  # pixels: otherwise the test could not tell them apart
    for part in ("back", "on"):
        facts = found[part]
        assert facts["length"] > 2 and facts["moves"] > 0.5
        # Edges aside, where the two engines' samples fall on either side.
        assert facts["median"] < 1e-3 * facts["length"] and facts["q95"] < 0.03 * facts["length"], (part, facts)


def test_an_animation_has_the_same(found):
    assert found["animation"] < 1e-4
