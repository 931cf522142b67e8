# SPDX-License-Identifier: Apache-2.0
"""The add-on with the real core: a picture of the default cube, motion over frames, transparent film, cancelling."""

import numpy as np
import pytest
from bpy_process import run

OpenEXR = pytest.importorskip("OpenEXR")
pytest.importorskip("bpy")

FORMAT = """
if hasattr(scene.render.image_settings, "media_type"):
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
scene.render.image_settings.color_depth = "32"
layer = scene.view_layers[0]
"""


def read_exr(path) -> dict[str, np.ndarray]:
    """Channels by name without the layer's, top row first."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = {name: channel.pixels for part in file.parts for name, channel in part.channels.items()}
    return {name.removeprefix("ViewLayer."): pixels for name, pixels in channels.items()}


def test_default_cube_with_transparent_film(core, tmp_path):
    run(
        FORMAT
        + """
layer.use_pass_normal = layer.use_pass_object_index = layer.use_pass_z = True
bpy.data.objects["Cube"].pass_index = 5
scene.render.film_transparent = True
bpy.ops.render.render(write_still=True)
assert not hb.last_error()
""",
        tmp_path,
        fake=False,
        timeout=300,
    )
    pixels = read_exr(next(tmp_path.glob("frame_*.exr")))
    alpha = pixels["Combined.A"]
    assert alpha.shape == (24, 32) and alpha[12, 16] == pytest.approx(1) and alpha[0, 0] == pytest.approx(0)
    assert 0.02 < pixels["Combined.R"][12, 16] < 2
    index = pixels["Object Index.X"]
    assert index[12, 16] == 5 and index[0, 0] == 0
    length = np.sqrt(sum(pixels[f"Normal.{c}"][12, 16] ** 2 for c in "XYZ"))
    assert length == pytest.approx(1, abs=0.02)
    # The camera of the default scene stands 11.26 m from the cube's centre, a metre or more from its surface.
    assert 8.5 < pixels["Depth.Z"][12, 16] < 11.2
    assert all(np.isfinite(values).all() for values in pixels.values())


def test_moving_cube_has_motion_vectors_over_frames(core, tmp_path):
    run(
        FORMAT
        + """
layer.use_pass_vector = True
camera = scene.camera
camera.rotation_euler, camera.location = (0, 0, 0), (0, 0, 10)
cube = bpy.data.objects["Cube"]
cube.keyframe_insert("location", frame=1)
cube.location.x = 4
cube.keyframe_insert("location", frame=5)
for curve in cube.animation_data.action.fcurves if hasattr(cube.animation_data.action, "fcurves") else ():
    for point in curve.keyframe_points: point.interpolation = "LINEAR"
scene.frame_start, scene.frame_end = 1, 3
bpy.ops.render.render(animation=True)
assert not hb.last_error()
""",
        tmp_path,
        fake=False,
        timeout=300,
    )
    first, second, third = (read_exr(path) for path in sorted(tmp_path.glob("frame_*.exr")))
    assert not first["Vector.X"].any()
    moved = second["Vector.X"]
    assert np.abs(moved).max() > 0.5 and not moved[0, 0]
    columns = [
        np.flatnonzero(frame["Combined.R"].mean(axis=0) > frame["Combined.R"][0, 0] * 1.5) for frame in (first, third)
    ]
    assert columns[1].mean() > columns[0].mean()


def test_cancel_keeps_what_was_rendered(core, tmp_path):
    facts = run(
        FORMAT
        + """
import time
import headwater_addon.final as final
scene.headwater.samples = 1 << 20
began = []
def stop(event, facts):
    if event == "progress" and facts["sample"] > 0:
        began.append(time.time())
        return True
final.observers.append(stop)
bpy.ops.render.render(write_still=True)
show(seconds=time.time() - began[0], error=hb.last_error())
""",
        tmp_path,
        fake=False,
        timeout=300,
    )
    assert facts["error"] == "" and facts["seconds"] < 20
    assert read_exr(next(tmp_path.glob("frame_*.exr")))["Combined.R"].any()
