# SPDX-License-Identifier: Apache-2.0
"""What viewports are made of, without Blender: cameras from matrices, coarse to fine, turns on a device.

Whole viewports are driven in real Blenders: blender_tests/real.
"""

import importlib.util
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

ADDON = Path(__file__).resolve().parents[1] / "addon" / "headwater"


def load(path: str):
    """A module of the add-on that needs neither Blender nor its package."""
    name = "alone_" + path.replace("/", "_")
    spec = importlib.util.spec_from_file_location(name, ADDON / f"{path}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look it up
    spec.loader.exec_module(module)
    return module


camera, refinement, turns = load("viewport/camera"), load("viewport/refinement"), load("turns")


def perspective(left, right, bottom, top, near, far):
    """OpenGL's frustum, sides at distance 1."""
    left, right, bottom, top = (near * side for side in (left, right, bottom, top))
    return np.array(
        [
            [2 * near / (right - left), 0, (right + left) / (right - left), 0],
            [0, 2 * near / (top - bottom), (top + bottom) / (top - bottom), 0],
            [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
            [0, 0, -1, 0],
        ]
    )


def orthographic(left, right, bottom, top, near, far):
    return np.array(
        [
            [2 / (right - left), 0, 0, -(right + left) / (right - left)],
            [0, 2 / (top - bottom), 0, -(top + bottom) / (top - bottom)],
            [0, 0, -2 / (far - near), -(far + near) / (far - near)],
            [0, 0, 0, 1],
        ]
    )


def placed() -> np.ndarray:
    """A camera to world matrix, turned and moved."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    matrix[:3, :3] *= np.linalg.det(matrix[:3, :3])
    matrix[:3, 3] = 3, -2, 5
    return matrix


def test_perspective_camera_is_read_off_the_window_matrix():
    plane = (-0.7, 0.5, -0.3, 0.4)  # shifted
    made = camera.from_matrices(perspective(*plane, 0.1, 100), np.linalg.inv(placed()), (0.1, 100), {"blades": 5})
    assert made.kind == "perspective"
    assert made.plane == pytest.approx(plane)
    assert np.frombuffer(made.rows, np.float32).reshape(3, 4) == pytest.approx(placed()[:3], abs=1e-5)
    assert dict(made.settings) == {"clip": (0.1, 100), "blades": 5}


def test_orthographic_camera_begins_at_the_near_plane_behind_the_viewer():
    plane = (-3, 5, -2, 4)
    made = camera.from_matrices(orthographic(*plane, -50, 100), np.linalg.inv(placed()), (0.1, 1))
    rows = np.frombuffer(made.rows, np.float32).reshape(3, 4)
    assert (made.kind, made.plane) == ("orthographic", pytest.approx(plane))
    assert rows[:, 3] == pytest.approx(placed()[:3, 3] + 50 * placed()[:3, 2], rel=1e-5)  # it looks along its -Z
    assert dict(made.settings)["clip"] == pytest.approx((0, 150))


@pytest.mark.parametrize("window", [np.zeros((4, 4)), np.full((4, 4), np.nan)])
def test_a_view_without_size_is_refused(window):
    with pytest.raises(ValueError, match="no size"):
        camera.from_matrices(window, np.eye(4), (0.1, 1))


def test_borders_are_whole_pixels_within_the_viewport():
    assert camera.part((0, 0, 100, 50), (0.25, 0.5, 0.75, 1), 100, 50) == (25, 25, 75, 50)
    assert camera.part((-50, -50, 150, 100), (0, 0, 0.5, 1), 100, 50) == (0, 0, 50, 50)
    assert camera.part((200, 0, 300, 50), (0, 0, 1, 1), 100, 50) == (0, 0, 100, 50)  # none of it: everything
    assert camera.part((0, 0, np.inf, 50), (0, 0, 1, 1), 100, 50) == (0, 0, 100, 50)


def test_camera_frame_in_the_viewport():
    corners = [(x, y, -2) for x in (-0.5, 0.5) for y in (-0.25, 0.25)]
    found = camera.frame_rectangle(corners, perspective(-1, 1, -0.5, 0.5, 0.1, 10), 200, 100)
    assert found == pytest.approx((75, 37.5, 125, 62.5))


def run(plan, rate: float, limit: int = 200) -> list:
    """Slices until the picture is finished, rendered at `rate` pixels times samples a second."""
    slices = []
    while not plan.finished and len(slices) < limit:
        each = plan.next()
        before = plan.samples if each.resume else 0
        plan.done(each, plan._pixels / each.divider**2 * (each.samples - before) / rate)
        slices.append(each)
    return slices


def speed(rate: float):
    known = refinement.Speed()
    known.note(rate, 1.0)
    return known


def test_orbits_begin_coarse_and_are_not_interrupted_before_there_is_a_picture():
    slices = run(refinement.Refinement(640 * 360, 64, speed(1e6), moving=True), 1e6)
    dividers = [each.divider for each in slices]
    assert dividers[0] == 2 and dividers == sorted(dividers, reverse=True) and dividers[-1] == 1
    assert not slices[0].interruptible and all(each.interruptible for each in slices[1:])
    full = [each for each in slices if each.divider == 1]
    assert full[0].samples == 1 and not full[0].resume and all(each.resume for each in full[1:])
    assert full[-1].samples == 64 and all(b.samples > a.samples for a, b in zip(full, full[1:], strict=False))


def test_a_new_frame_starts_at_full_resolution_where_that_is_quick():
    pixels = 640 * 360
    assert refinement.Refinement(pixels, 8, speed(1e6), moving=False).next().divider == 1
    assert refinement.Refinement(pixels, 8, speed(1e5), moving=False).next().divider > 1
    assert refinement.Refinement(pixels, 8, speed(1e6), moving=True).next().divider > 1


def test_what_does_not_fit_into_memory_stays_coarse():
    slices = run(refinement.Refinement(7680 * 4320, 4, speed(1e7), moving=False, least=4), 1e7)
    assert slices[-1].divider == 4 and slices[-1].samples == 4


def test_an_interrupted_picture_begins_anew():
    plan = refinement.Refinement(100, 8, speed(1e3), moving=False)
    plan.done(plan.next(), 0.1)
    plan.interrupted(plan.next())
    again = plan.next()
    assert (again.resume, again.samples) == (False, 1)


@pytest.mark.alone
def test_final_pictures_go_before_views_and_views_take_turns():
    queue, order = turns.Turns(), []
    gave_way = threading.Event()

    def view(name: str, rounds: int) -> None:
        for _ in range(rounds):
            with queue.take(final=False, give_way=gave_way.set) as came:
                assert came
                order.append(name)
                gave_way.wait(0.02)

    def final() -> None:
        with queue.take(final=True) as came:
            assert came and queue.final_waits_or_renders
            order.append("final")

    threads = [threading.Thread(target=view, args=(name, 4)) for name in "ab"]
    for thread in threads:
        thread.start()
    while len(order) < 3:
        time.sleep(0.001)
    final_thread = threading.Thread(target=final)
    final_thread.start()
    for thread in (*threads, final_thread):
        thread.join(10)
        assert not thread.is_alive()
    assert gave_way.is_set() and order.index("final") <= 5
    views = [name for name in order if name != "final"]
    both = next(i for i in range(len(views)) if len(set(views[: i + 1])) == 2)  # from here on both wait
    end = min(len(views) - views[::-1].index(name) for name in "ab")  # until one has had its turns
    assert all(len(set(views[i : i + 3])) == 2 for i in range(both, end - 2)), order


def test_waiting_ends_when_nothing_waits_any_more():
    queue = turns.Turns()
    with queue.take(final=True):
        begun = time.perf_counter()
        with queue.take(final=False, keep_waiting=lambda: time.perf_counter() - begun < 0.2) as came:
            assert not came
    with queue.take(final=False) as came:  # the one that gave up does not stand in the way
        assert came
    assert not queue.final_waits_or_renders


def test_panoramas_fill_the_cameras_frame():
    """The picture's corners lie in the frame's, however much more the viewport shows."""
    made = camera.from_panorama(placed(), (100, 50, 500, 250), 640, 480, {"clip": (0.1, 9), "panorama": "mirror_ball"})
    left, right, bottom, top = made.plane
    assert made.kind == "panoramic" and dict(made.settings)["panorama"] == "mirror_ball"
    for pixel, at, low, high, size in (
        (100, 0, left, right, 640),
        (500, 1, left, right, 640),
        (50, 0, bottom, top, 480),
    ):
        assert low + (high - low) * pixel / size == pytest.approx(at)
    assert np.frombuffer(made.rows, np.float32).reshape(3, 4) == pytest.approx(placed()[:3], abs=1e-6)
    with pytest.raises(ValueError, match="no size"):
        camera.from_panorama(placed(), (1, 1, 1, 2), 10, 10, {})
