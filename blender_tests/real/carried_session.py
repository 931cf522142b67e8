# SPDX-License-Identifier: Apache-2.0
"""Pictures carried on while scrubbing with a moving lamp, and the view through a fisheye, in a window.

While the lamp moves every frame is looked at as soon as it is there. With pictures carried on they must be nearer to
what they become than without; a picture with all its samples must be the same within noise either way. Blender quits
while the viewport renders.
"""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from driver import Session, addon

FRAMES, SAMPLES = 12, 24


def shown(session) -> np.ndarray:
    return np.clip(session.picture().pixels[..., :3], 0, 2)


def scrub(session):
    """Early pictures of frames 2 to FRAMES, each looked at once."""
    session.early = []
    session.scene.frame_set(1)
    yield from session.settled(1, 60)
    for frame in range(2, FRAMES + 1):
        session.scene.frame_set(frame)
        yield from session.settled(1, 60)
        session.early.append(shown(session))


def scene_of(session) -> None:
    addon()
    scene = session.scene
    scene.render.engine = "HEADWATER"
    scene.headwater.use_cycles_settings = False
    scene.headwater.preview_samples = SAMPLES
    bpy.ops.mesh.primitive_plane_add(size=20, location=(0, 0, -1))
    lamp = bpy.data.objects["Light"]
    lamp.data.shadow_soft_size = 1.0
    for frame, x in ((1, -3.0), (FRAMES, 3.0)):
        lamp.location.x = x
        lamp.keyframe_insert("location", frame=frame)
    for number in range(12):  # several lamps: noise
        other = bpy.data.objects.new("Other", bpy.data.lights.new("Other", "POINT"))
        other.data.energy, other.location = 30, (4 * np.cos(number), 4 * np.sin(number), 1.5)
        scene.collection.objects.link(other)
    session.region_3d.view_perspective = "CAMERA"
    session.space.shading.type = "RENDERED"


def fisheye(session):
    """The circle of a fisheye fills the camera's frame; around it nothing is lit."""
    camera = session.scene.camera.data
    camera.type = "PANO"
    source = camera if hasattr(camera, "panorama_type") else camera.cycles
    source.panorama_type, source.fisheye_fov = "FISHEYE_EQUIDISTANT", 2.0
    session.scene.render.resolution_x = session.scene.render.resolution_y = 480
    yield from session.settled(4, 60)
    picture = shown(session).max(-1)
    session.shot("fisheye")
    height, width = picture.shape
    lit = picture > 0
    rows, columns = np.nonzero(lit)
    session.facts["fisheye"] = {
        "size": [width, height],
        "lit": [int(columns.min()), int(columns.max()), int(rows.min()), int(rows.max())],
        "share": float(lit.mean()),
    }
    across, up = np.ptp(columns) + 1, np.ptp(rows) + 1
    assert abs(across - up) <= 3 and across < width - 20, session.facts
    assert abs(lit.sum() / (across * up) - np.pi / 4) < 0.02, session.facts


def steps(session):
    scene_of(session)
    own = session.scene.headwater
    yield from session.settled(1, 60)
    early, whole = {}, {}
    for carried in (False, True):
        own.use_preview_history = carried
        yield from scrub(session)
        session.shot(f"scrub_{'carried' if carried else 'alone'}")
        early[carried] = session.early
        yield from session.settled(SAMPLES, 300)
        whole[carried] = shown(session)
    reference = 0.5 * (whole[False] + whole[True])
    error = {key: float(np.mean((pictures[-1] - reference) ** 2)) for key, pictures in early.items()}
    change = {key: float(np.mean((p[-1] - p[-2]) ** 2)) for key, p in early.items()}
    difference = whole[True] - whole[False]
    session.facts |= {
        "early_error": list(error.values()),
        "early_change": list(change.values()),
        "whole_mean": [float(each.mean()) for each in whole.values()],
        "whole_error": float(np.mean(difference**2)),
    }
    assert error[True] < error[False], session.facts
    assert abs(difference.mean()) < 4 * difference.std() / np.sqrt(difference.size / 3) + 1e-4, session.facts
    yield from fisheye(session)


Session(steps)
