# SPDX-License-Identifier: Apache-2.0
"""Meshes whose arrays are lent to the core: the same pictures without a copy, and the arrays are let go of."""

import gc
import weakref

import numpy as np
import pytest
from core_scenes import EYE, bumpy, picture, placed


class Watched(np.ndarray):
    """An array that a weak reference can watch."""


def _arrays():
    positions, triangles = bumpy()
    corners = np.arange(triangles.size, dtype=np.uint32).reshape(-1, 3)
    random = np.random.default_rng(1)
    normals = np.tile(np.float32([0, 0, 1]), (corners.size, 1)) + random.uniform(-0.2, 0.2, (corners.size, 3))
    normals = (normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    uv = random.random((corners.size, 2), np.float32)
    slots = (np.arange(len(triangles)) % 2).astype(np.uint8)
    return [a.view(Watched) for a in (positions, triangles, corners, normals, uv, slots)]


def _scene(core, lend, arrays):
    positions, triangles, corners, normals, uv, slots = arrays
    scene = core.Scene()
    scene.upsert_mesh(
        1, "ground", positions, triangles, tri_corners=corners, normals=normals, tri_slots=slots,
        attributes=[("UVMap", "corner", uv)], default_uv=0, lend=lend,
    )  # fmt: skip
    scene.upsert_instance(1, 1, placed(scale=2.0, turn=0.1))
    scene.upsert_light(1, "point", "point", placed(1, 0, 2), power=60.0, radius=0.2)
    scene.set_camera("perspective", placed(z=4), (-0.5, 0.5, -0.5, 0.5))
    return scene


def test_lent_arrays_give_the_same_picture_and_are_let_go_of(core, make_context):
    context = make_context()
    copied = picture(core, context, _scene(core, False, _arrays()))
    arrays = _arrays()
    watched = [weakref.ref(array) for array in arrays]
    scene = _scene(core, True, arrays)
    del arrays
    gc.collect()
    assert all(ref() is not None for ref in watched), "nobody has read them yet"
    session = core.Session(context, scene)
    lent = picture(core, context, scene, session=session)
    assert all(np.array_equal(lent[name], copied[name]) for name in copied) and lent["Combined"].any()
    gc.collect()
    if context.device["kind"] == "cpu":
        assert all(ref() is None for ref in watched), "they are on the device"
    # The scene outlives the device's copy.
    del session
    again = picture(core, context, scene)
    assert all(np.array_equal(again[name], copied[name]) for name in copied)


def _spoil(arrays):
    for array in arrays:
        array[...] = 77


@pytest.mark.parametrize("built", [False, True])
def test_what_the_scene_keeps_may_be_written_to(core, make_context, built):
    """Kept before any device has it, and after: on one with memory of its own a Tracer may still read what was lent."""
    context = make_context()
    expected = picture(core, context, _scene(core, False, _arrays()))
    arrays = _arrays()
    arrays[3][5] = np.nan  # a normal that the scene repairs: a copy already
    scene = _scene(core, True, arrays)
    session = core.Session(context, scene)
    if built:
        session.sync()
    scene.keep_lent()
    _spoil(arrays)
    kept = picture(core, context, scene, session=session)
    assert all(np.isfinite(kept[name]).all() for name in kept)
    assert np.abs(kept["Combined"] - expected["Combined"]).mean() < 0.01 * expected["Combined"].mean()
    watched = [weakref.ref(array) for array in arrays]
    del arrays
    gc.collect()
    assert all(ref() is None for ref in watched)


def test_lent_arrays_go_with_their_mesh(core):
    for end in (lambda s: s.remove_mesh(1), lambda s: s.clear(), lambda s: _scene_edit(s)):
        arrays = _arrays()
        watched = [weakref.ref(array) for array in arrays]
        scene = _scene(core, True, arrays)
        del arrays
        scene.remove_instance(1)
        end(scene)
        del scene
        gc.collect()
        assert all(ref() is None for ref in watched)


def _scene_edit(scene):
    scene.upsert_mesh(1, "other", *bumpy())


def test_lent_images_are_let_go_of(core, make_context):
    context, scene = make_context(), core.Scene()
    scene.upsert_mesh(1, "ground", *bumpy())
    scene.upsert_instance(1, 1, EYE)
    scene.set_camera("perspective", placed(z=4), (-0.5, 0.5, -0.5, 0.5))
    kinds = [np.zeros((4, 4, 4), np.uint8), np.zeros((4, 4), np.uint8)]
    kinds += [np.zeros((4, 4, 3), np.uint8), np.zeros((4, 4, 4), np.float32)]  # converted: nothing is lent
    kinds = [kind.view(Watched) for kind in kinds]
    watched = [weakref.ref(kind) for kind in kinds]
    for number, kind in enumerate(kinds):
        scene.upsert_image(1 + number, "lent", kind, lend=True)
    del kind, kinds
    gc.collect()
    assert [ref() is not None for ref in watched] == [True, True, False, False]
    picture(core, context, scene)
    gc.collect()
    if context.device["kind"] == "cpu":
        assert all(ref() is None for ref in watched), "they are on the device"


def test_what_is_repaired_is_not_the_caller_s(core, make_context):
    arrays = _arrays()
    arrays[3][7], arrays[4][3] = np.nan, np.inf
    context = make_context()
    before = [array.copy() for array in arrays]
    lent = picture(core, context, _scene(core, True, arrays))
    assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(arrays, before, strict=True))
    copied = picture(core, context, _scene(core, False, arrays))
    assert all(np.isfinite(lent[name]).all() and np.array_equal(lent[name], copied[name]) for name in copied)


def test_a_refused_mesh_keeps_nothing(core):
    scene, arrays = core.Scene(), _arrays()
    arrays[1][0, 0] = 10**6
    watched = weakref.ref(arrays[1])
    with pytest.raises(core.SceneError, match="names vertex"):
        scene.upsert_mesh(1, "bad", arrays[0], arrays[1], lend=True)
    assert not scene.has_mesh(1)
    del arrays
    gc.collect()
    assert watched() is None
    scene.upsert_mesh(1, "good", *bumpy(), lend=True)  # arrays that nobody else holds
    scene.upsert_instance(1, 1, EYE)
