# SPDX-License-Identifier: Apache-2.0
"""UsdGeomCamera to the core's camera, and a camera that sees everything for stages without one.

The picture plane is widened to the picture's shape so that it shows all of the camera's aperture (RenderSettings'
"expandAperture"). Lens sizes are tenths of stage units, as UsdGeomCamera has them.
"""

import math

import numpy as np

from headwater.errors import EXIT_USAGE, UserError
from headwater.usd_scene.stage import matrix_to_numpy

FRAME_ALL_ANGLE = math.radians(40)


def find_camera(stage, name: str | None):
    """The camera prim with the path or name `name`; without a name, the first camera. None when there is none."""
    from pxr import Usd, UsdGeom

    cameras = [
        prim
        for prim in stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))
        if prim.IsA(UsdGeom.Camera)
    ]
    if name is None:
        return cameras[0] if cameras else None
    for prim in cameras:
        if name in (str(prim.GetPath()), prim.GetName()):
            return prim
    listing = ", ".join(str(prim.GetPath()) for prim in cameras) or "none"
    raise UserError(f"no camera '{name}' in the stage; it has: {listing}", EXIT_USAGE)


def camera_arguments(prim, time, opened, aspect: float, report) -> dict:
    """Arguments of the core's set_camera for the camera `prim`; `aspect`: the picture's width over height."""
    from pxr import Gf, UsdGeom

    camera = UsdGeom.Camera(prim).GetCamera(time)
    metres = opened.meters_per_unit
    matrix = rigid(opened.to_world @ matrix_to_numpy(camera.transform))
    if matrix is None:
        raise UserError(f"camera {prim.GetPath()}: its transform is flat or not finite")
    orthographic = camera.projection == Gf.Camera.Orthographic
    tenth = Gf.Camera.APERTURE_UNIT
    # Lengths on the plane at distance 1 for perspective, in metres for orthographic cameras.
    scale = tenth * metres if orthographic else (1 / camera.focalLength if camera.focalLength > 0 else 0)
    half = np.array([camera.horizontalAperture, camera.verticalAperture]) * scale / 2
    centre = np.array([camera.horizontalApertureOffset, camera.verticalApertureOffset]) * scale
    if not (np.isfinite([*half, *centre]).all() and (half > 0).all()):
        raise UserError(f"camera {prim.GetPath()}: its aperture or focal length is zero or not finite")
    half = expand(half, aspect)
    near, far = (float(camera.clippingRange.min) * metres, float(camera.clippingRange.max) * metres)
    if not (0 <= near < far and math.isfinite(far)):
        report.warn(prim.GetPath(), f"its clipping range {near:g} to {far:g} m is no range; 0.001 m to 1e6 m is used")
        near, far = 1e-3, 1e6
    focus = float(camera.focusDistance) * metres
    radius = 0.0
    if camera.fStop > 0 and not orthographic:
        if focus > 0:
            radius = camera.focalLength * tenth * metres / (2 * camera.fStop)
        else:
            report.warn(prim.GetPath(), "it has an fStop but no focus distance; everything is in focus")
    return {
        "kind": "orthographic" if orthographic else "perspective",
        "matrix": matrix[:3],
        "plane": tuple(
            float(v) for v in (centre[0] - half[0], centre[0] + half[0], centre[1] - half[1], centre[1] + half[1])
        ),
        "clip": (near, far),
        "aperture_radius": float(radius),
        "focus_distance": focus if focus > 0 else 1.0,
    }


def aperture_aspect(prim, time) -> float | None:
    """Width over height of a camera's aperture; None when it has none."""
    from pxr import UsdGeom

    camera = UsdGeom.Camera(prim).GetCamera(time)
    aspect = camera.horizontalAperture / camera.verticalAperture if camera.verticalAperture > 0 else 0
    return aspect if math.isfinite(aspect) and aspect > 0 else None


def expand(half, aspect):
    """Half sizes of the window widened in one direction to `aspect`."""
    if half[0] < half[1] * aspect:
        return np.array([half[1] * aspect, half[1]])
    return np.array([half[0], half[0] / aspect])


def rigid(matrix):
    """A matrix without scale and shear (columns orthonormalised, forward kept), or None when that is not possible."""
    if not np.isfinite(matrix).all():
        return None
    z, y = matrix[:3, 2], matrix[:3, 1]
    if not np.linalg.norm(z) > 0:
        return None
    z = z / np.linalg.norm(z)
    y = y - z * (y @ z)
    if not np.linalg.norm(y) > 1e-9 * max(np.linalg.norm(matrix[:3, 1]), 1e-30):
        return None
    y = y / np.linalg.norm(y)
    result = np.eye(4)
    result[:3, 0], result[:3, 1], result[:3, 2], result[:3, 3] = np.cross(y, z), y, z, matrix[:3, 3]
    return result


def frame_all_arguments(bounds, aspect: float) -> dict:
    """A camera that sees the box `bounds` (2, 3) [metres, Z up] from the front, a little above and to the right."""
    low, high = bounds
    centre = (low + high) / 2
    radius = max(float(np.linalg.norm(high - low)) / 2, 1e-3)
    half_height = math.tan(FRAME_ALL_ANGLE / 2)
    half = np.array([half_height * aspect, half_height])
    distance = radius / math.sin(math.atan(min(half)))
    backward = np.array([0.45, -1.0, 0.45]) / np.linalg.norm([0.45, -1.0, 0.45])
    right = np.cross([0, 0, 1.0], backward)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, np.cross(backward, right), backward
    matrix[:3, 3] = centre + backward * distance
    return {
        "kind": "perspective",
        "matrix": matrix[:3],
        "plane": (-half[0], half[0], -half[1], half[1]),
        "clip": (max(distance - 2 * radius, distance * 1e-3), distance + 2 * radius),
        "aperture_radius": 0.0,
        "focus_distance": distance,
    }
