# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's camera → the core's: the rectangle of the picture plane that the full frame covers.

Follows Blender's own rule (its manual, "Camera"): the sensor size spans the fitted side of the picture, shift is in
units of that side, and pixel aspect stretches pixels. The rectangle does not depend on the border.
"""

import math

import numpy as np

from .problems import SyncError, naming

# Cycles' aperture: radius = focal length / (2 f-number); orthographic cameras take 1 m as focal length.
_MIN_FSTOP = 1e-5


def picture_plane(
    camera, width: float, height: float, shift_x: float | None = None
) -> tuple[float, float, float, float]:
    """(left, right, bottom, top) at distance 1 (perspective) or in metres (orthographic).

    `width`, `height`: size of the full frame, each times its pixel aspect. `shift_x`: instead of the camera's (stereo).
    """
    horizontal = camera.sensor_fit == "HORIZONTAL" or (camera.sensor_fit == "AUTO" and width >= height)
    sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
    fitted = camera.ortho_scale if camera.type == "ORTHO" else sensor / camera.lens
    size_x = fitted if horizontal else fitted * width / height
    size_y = fitted * height / width if horizontal else fitted
    x = (camera.shift_x if shift_x is None else shift_x) * fitted
    y = camera.shift_y * fitted
    return x - 0.5 * size_x, x + 0.5 * size_x, y - 0.5 * size_y, y + 0.5 * size_y


def focus_distance(camera, matrix: np.ndarray) -> float:
    """Distance to the plane in focus along the viewing direction, metres."""
    dof = camera.dof
    target = dof.focus_object
    if target is None:
        return dof.focus_distance
    world = target.matrix_world
    bone = target.pose.bones.get(dof.focus_subtarget) if target.pose and dof.focus_subtarget else None
    point = np.array((world @ bone.matrix if bone else world).translation)
    forward = -matrix[:3, 2]
    return abs(float(np.dot(point - matrix[:3, 3], forward)))


def rigid(matrix: np.ndarray) -> np.ndarray:
    """A camera matrix without the object's scale, (4, 4). SyncError where an axis has no length."""
    matrix = np.array(matrix, np.float64)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.isfinite(matrix).all() or (lengths == 0).any():
        raise SyncError("the camera's transform has no direction (zero scale or no number)")
    matrix[:3, :3] /= lengths
    return matrix


def lens_settings(camera_object, matrix: np.ndarray) -> dict:
    """Scene.set_camera's depth of field of an evaluated camera object; empty where everything is in focus.

    matrix: (4, 4), where the camera is, without scale.
    """
    camera, dof = camera_object.data, camera_object.data.dof
    if not dof.use_dof:
        return {}
    focal = 1.0 if camera.type == "ORTHO" else camera.lens * 1e-3
    return dict(
        aperture_radius=focal / (2.0 * max(dof.aperture_fstop, _MIN_FSTOP)),
        focus_distance=max(focus_distance(camera, matrix), 1e-5),
        blades=dof.aperture_blades,
        rotation=dof.aperture_rotation,
        ratio=dof.aperture_ratio,
    )


def _sensor(camera, render, frame) -> tuple[float, float]:
    """Width and height of what of the sensor the full frame shows, millimetres."""
    width, height = frame.width * render.pixel_aspect_x, frame.height * render.pixel_aspect_y
    horizontal = camera.sensor_fit == "HORIZONTAL" or (camera.sensor_fit == "AUTO" and width > height)
    sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
    return (sensor, sensor * height / width) if horizontal else (sensor * width / height, sensor)


def panorama_settings(camera, render, frame) -> dict | None:
    """Scene.set_camera's panorama, range and lens for a camera of type PANO; None for a type that the core has not.

    render: the scene's; frame: render_settings.Frame of the picture, whose shape a fisheye's sensor takes.
    """
    source = camera if hasattr(camera, "panorama_type") else getattr(camera, "cycles", None)
    if source is None:
        return {}
    match source.panorama_type:
        case "EQUIRECTANGULAR":
            longitude = (source.longitude_min, source.longitude_max)
            return dict(panorama="equirectangular", range=(*longitude, source.latitude_min, source.latitude_max))
        case "FISHEYE_EQUIDISTANT":
            return dict(panorama="fisheye_equidistant", range=(source.fisheye_fov, 0.0, 0.0, 0.0))
        case "FISHEYE_EQUISOLID":
            size = _sensor(camera, render, frame)
            return dict(panorama="fisheye_equisolid", range=(source.fisheye_lens, source.fisheye_fov, *size))
        case "FISHEYE_LENS_POLYNOMIAL":
            first, *lens = (getattr(source, f"fisheye_polynomial_k{power}") for power in range(5))
            size = _sensor(camera, render, frame)
            return dict(panorama="fisheye_polynomial", range=(source.fisheye_fov, first, *size), lens=tuple(lens))
        case "MIRRORBALL":
            return dict(panorama="mirror_ball")
        case "EQUIANGULAR_CUBEMAP_FACE":
            return dict(panorama="cube_face")
        case "CENTRAL_CYLINDRICAL":
            names = [f"central_cylindrical_range_{side}_{end}" for side in "uv" for end in ("min", "max")]
            left, right, bottom, top = (getattr(source, name) for name in names)
            radius = source.central_cylindrical_radius
            return dict(panorama="cylindrical", range=(left, right, bottom / radius, top / radius))
    return None


class CameraSync:
    """Sets the core's camera when it changed."""

    def __init__(self, scene, notes):
        self._scene, self._notes = scene, notes
        self._last = None

    def sync(self, depsgraph, camera_object, render, frame, *, matrix=None, shift_x=None) -> bool:
        """`camera_object`: the evaluated camera; `frame`: render_settings.Frame; `matrix`, `shift_x`: a stereo eye's.

        Returns whether something changed. Raises SyncError where there is no usable camera.
        """
        if camera_object is None:
            raise SyncError(f"No camera: scene '{depsgraph.scene.name}' has no active camera to render from")
        if camera_object.type != "CAMERA":
            raise SyncError(
                f"'{camera_object.name}' is no camera: only camera objects can be rendered from",
                "Object",
                camera_object.name,
            )
        camera = camera_object.data
        name = camera_object.name
        try:
            matrix = rigid(camera_object.matrix_world if matrix is None else matrix)
        except SyncError as error:
            raise SyncError(f"Camera '{name}': {error}", "Camera", name) from None
        kind = {"PERSP": "perspective", "ORTHO": "orthographic", "PANO": "panoramic"}.get(camera.type)
        if kind is None:
            raise SyncError(f"Camera '{name}': camera type {camera.type} is not supported", "Camera", name)
        panorama = {}
        if kind == "panoramic":
            plane = (0.0, 1.0, 0.0, 1.0)
            panorama = panorama_settings(camera, render, frame)
            if panorama is None:
                self._notes.add(
                    f"Camera '{name}': this type of panorama is rendered as a full equirectangular sphere",
                    "Camera",
                    name,
                )
                panorama = {}
        else:
            plane = picture_plane(
                camera, frame.width * render.pixel_aspect_x, frame.height * render.pixel_aspect_y, shift_x
            )
        settings = {"clip": (camera.clip_start, camera.clip_end), **lens_settings(camera_object, matrix), **panorama}
        rows = np.ascontiguousarray(matrix[:3], np.float32)
        now = (kind, rows.tobytes(), plane, tuple(settings.items()))
        if now == self._last:
            return False
        if not all(math.isfinite(value) for value in plane):
            raise SyncError(f"Camera '{name}': its lens, sensor or shift gives no picture plane", "Camera", name)
        with naming("Camera", name):
            self._scene.set_camera(kind, rows, plane, **settings)
        self._last = now
        return True
