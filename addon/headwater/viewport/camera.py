# SPDX-License-Identifier: GPL-3.0-or-later
"""A viewport's camera and the part of it that is rendered, from its matrices. Arrays in, numbers out: no Blender data.

Blender's window matrix is OpenGL's projection (column vectors, depth from -1 to 1); the picture plane at distance 1 and
the clipping planes are read off it, so that zoom, offset, shift and sensor fit of the camera view come out as drawn.
"""

from typing import NamedTuple

import numpy as np


class ViewCamera(NamedTuple):
    """What Scene.set_camera takes. `rows`: (3, 4) float32 as bytes, so that cameras can be compared."""

    kind: str
    rows: bytes
    plane: tuple[float, float, float, float]
    settings: tuple  # of (name, value)

    def apply(self, scene) -> None:
        scene.set_camera(
            self.kind, np.frombuffer(self.rows, np.float32).reshape(3, 4), self.plane, **dict(self.settings)
        )


def from_matrices(window, view, clip: tuple[float, float], settings: dict | None = None) -> ViewCamera:
    """A viewport's camera.

    window: (4, 4) projection; view: (4, 4) world to camera; clip: metres, of a perspective camera (an orthographic
    one's is in its matrix, and begins behind the viewer in free views). ValueError when a matrix has no inverse.
    """
    p, view = np.array(window, np.float64), np.array(view, np.float64)
    if not (np.isfinite(p).all() and np.isfinite(view).all()) or p[0, 0] == 0 or p[1, 1] == 0:
        raise ValueError("the view has no size")
    try:
        matrix = np.linalg.inv(view)
    except np.linalg.LinAlgError:
        raise ValueError("the view's matrix has no inverse") from None
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    matrix[:3, :3] /= lengths
    if p[3, 2] != 0:  # perspective
        kind = "perspective"
        left, right = (p[0, 2] - 1) / p[0, 0], (p[0, 2] + 1) / p[0, 0]
        bottom, top = (p[1, 2] - 1) / p[1, 1], (p[1, 2] + 1) / p[1, 1]
    else:
        kind = "orthographic"
        left, right = (-1 - p[0, 3]) / p[0, 0], (1 - p[0, 3]) / p[0, 0]
        bottom, top = (-1 - p[1, 3]) / p[1, 1], (1 - p[1, 3]) / p[1, 1]
        near, far = (p[2, 3] + 1) / p[2, 2], (p[2, 3] - 1) / p[2, 2]
        matrix[:3, 3] -= matrix[:3, 2] * near  # the core's cameras see nothing behind themselves
        clip = (0.0, far - near)
    rows = np.ascontiguousarray(matrix[:3], np.float32).tobytes()
    plane = tuple(float(side) for side in (left, right, bottom, top))
    return ViewCamera(kind, rows, plane, (("clip", clip), *sorted((settings or {}).items())))


def from_panorama(matrix, rectangle, width: int, height: int, settings: dict) -> ViewCamera:
    """The view through a panoramic camera, whose picture fills its frame in the viewport.

    matrix: (4, 4) the camera's, without scale; rectangle: the frame as frame_rectangle gives it; width, height: of the
    viewport in pixels; settings: further arguments of Scene.set_camera. ValueError when the frame has no size.
    """
    x0, y0, x1, y1 = rectangle
    if not (np.isfinite(rectangle).all() and x1 > x0 and y1 > y0):
        raise ValueError("the camera's frame has no size")
    plane = (-x0 / (x1 - x0), (width - x0) / (x1 - x0), -y0 / (y1 - y0), (height - y0) / (y1 - y0))
    rows = np.ascontiguousarray(np.array(matrix, np.float64)[:3], np.float32).tobytes()
    return ViewCamera("panoramic", rows, plane, tuple(sorted(settings.items())))


def frame_rectangle(corners, perspective, width: int, height: int) -> tuple[float, float, float, float]:
    """Where the camera's frame lies in the viewport: (x0, y0, x1, y1) in pixels, bottom-left origin, unclipped.

    corners: (4, 3) the frame in world space; perspective: (4, 4) world to clip space.
    """
    points = np.c_[np.array(corners, np.float64), np.ones(4)] @ np.array(perspective, np.float64).T
    ndc = points[:, :2] / points[:, 3:4]
    pixels = (ndc * 0.5 + 0.5) * (width, height)
    return (*pixels.min(axis=0).tolist(), *pixels.max(axis=0).tolist())


def part(rectangle, border, width: int, height: int) -> tuple[int, int, int, int]:
    """A border (x0, y0, x1, y1 of 0 to 1) within a rectangle of the viewport, in whole pixels that lie in it.

    All of the viewport where nothing of the border does.
    """
    x0, y0, x1, y1 = rectangle
    left, right = x0 + border[0] * (x1 - x0), x0 + border[2] * (x1 - x0)
    bottom, top = y0 + border[1] * (y1 - y0), y0 + border[3] * (y1 - y0)
    if not np.isfinite((left, right, bottom, top)).all():
        return 0, 0, width, height
    region = (
        int(np.clip(round(left), 0, width)),
        int(np.clip(round(bottom), 0, height)),
        int(np.clip(round(right), 0, width)),
        int(np.clip(round(top), 0, height)),
    )
    return region if region[2] > region[0] and region[3] > region[1] else (0, 0, width, height)
