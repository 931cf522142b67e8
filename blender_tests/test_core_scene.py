# SPDX-License-Identifier: Apache-2.0
"""headwater._core from Python: scene edits with arrays, settings, errors by kind, syncs that send what changed."""

import gc
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

EYE = np.eye(4, dtype=np.float32)[:3].copy()
QUAD = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
LAMPS = np.array([10, 11, 12], np.uint64)
LOST = np.stack([EYE, EYE, EYE * np.float32(np.nan)])


def moved(x=0.0, y=0.0, z=0.0):
    matrix = EYE.copy()
    matrix[:, 3] = x, y, z
    return matrix


@pytest.fixture
def scene(core):
    """A lit square seen from above."""
    scene = core.Scene()
    scene.upsert_mesh(1, "quad", QUAD, TRIANGLES)
    scene.upsert_instance(1, 1, EYE, name="square")
    scene.upsert_light(1, "lamp", "point", moved(z=2), power=100.0, radius=0.1)
    scene.set_camera("perspective", moved(z=3), (-0.5, 0.5, -0.5, 0.5))
    return scene


@pytest.mark.parametrize(
    ("error", "words", "edit"),
    [
        (
            TypeError,
            'mesh "m" (id 2): positions must have type float32, not float64',
            lambda s: s.upsert_mesh(2, "m", QUAD.astype(np.float64), TRIANGLES),
        ),
        (
            TypeError,
            'mesh "m" (id 2): positions must be an array, not list',
            lambda s: s.upsert_mesh(2, "m", [[0, 0, 0]], TRIANGLES),
        ),
        (TypeError, "incompatible function arguments", lambda s: s.upsert_mesh(2, "m", None, TRIANGLES)),
        (
            ValueError,
            "positions must have shape (N, 3), not (4, 2)",
            lambda s: s.upsert_mesh(2, "m", QUAD[:, :2].copy(), TRIANGLES),
        ),
        (ValueError, "positions must be C-contiguous", lambda s: s.upsert_mesh(2, "m", QUAD[::-1], TRIANGLES)),
        (
            TypeError,
            "tri_vertices must have type uint32, not int64",
            lambda s: s.upsert_mesh(2, "m", QUAD, TRIANGLES.astype(np.int64)),
        ),
        (
            TypeError,
            "tri_slots must have type uint8",
            lambda s: s.upsert_mesh(2, "m", QUAD, TRIANGLES, tri_slots=np.zeros(2, np.int32)),
        ),
        (
            TypeError,
            "(name, domain, array)",
            lambda s: s.upsert_mesh(2, "m", QUAD, TRIANGLES, attributes=[("uv", QUAD)]),
        ),
        (
            ValueError,
            "the domain must be",
            lambda s: s.upsert_mesh(2, "m", QUAD, TRIANGLES, attributes=[("uv", "edge", QUAD)]),
        ),
        (
            ValueError,
            "1 to 4",
            lambda s: s.upsert_mesh(
                2, "m", QUAD, TRIANGLES, attributes=[("uv", "vertex", np.zeros((4, 5), np.float32))]
            ),
        ),
        (
            "SceneError",
            "the position of vertex 0 is not finite",
            lambda s: s.upsert_mesh(2, "m", QUAD * np.float32(np.nan), TRIANGLES),
        ),
        ("SceneError", "names vertex 13 of 4", lambda s: s.upsert_mesh(2, "m", QUAD, TRIANGLES + np.uint32(10))),
        ("SceneError", "no mesh has id 9", lambda s: s.upsert_instance(2, 9, EYE)),
        (ValueError, "matrix must have shape (3, 4), not (4, 4)", lambda s: s.upsert_instance(2, 1, np.eye(4))),
        (
            ValueError,
            "matrices must have shape (N, 3, 4)",
            lambda s: s.upsert_instances(2, 1, np.zeros((2, 4, 4), np.float32)),
        ),
        (
            ValueError,
            "random_ids must have shape (2,)",
            lambda s: s.upsert_instances(2, 1, np.zeros((2, 3, 4), np.float32), random_ids=np.zeros(3, np.uint32)),
        ),
        ("SceneError", 'unknown kind "laser"', lambda s: s.upsert_light(2, "l", "laser", EYE)),
        ("SceneError", "radius is -1", lambda s: s.upsert_light(2, "l", "point", EYE, radius=-1.0)),
        ("SceneError", 'light "l" (id 12): its matrix', lambda s: s.upsert_lights(LAMPS, "l", "point", LOST)),
        (TypeError, 'lights "l": ids must', lambda s: s.upsert_lights(LAMPS.astype(np.int64), "l", "point", LOST)),
        (ValueError, "matrices must have shape (3, 3, 4)", lambda s: s.upsert_lights(LAMPS, "l", "point", LOST[:2])),
        ("SceneError", "no light has id 10", lambda s: s.remove_lights(np.array([1, 10], np.uint64))),
        (
            "SceneError",
            "its program can't be used",
            lambda s: s.upsert_material(2, "m", np.arange(16, dtype=np.uint32), np.zeros((0, 4), np.float32)),
        ),
        (
            ValueError,
            "constants must have shape (N, 4)",
            lambda s: s.upsert_material(2, "m", np.zeros(0, np.uint32), np.zeros((1, 3), np.float32)),
        ),
        (ValueError, "(H, W, 3)", lambda s: s.upsert_image(1, "i", np.zeros((2, 2, 2), np.uint8))),
        (TypeError, "uint8, float16 or float32", lambda s: s.upsert_image(1, "i", np.zeros((2, 2, 4), np.float64))),
        ("SceneError", "no area", lambda s: s.set_camera("perspective", EYE, (0, 0, -1, 1))),
        ("SceneError", "clip_end", lambda s: s.set_camera("perspective", EYE, (-1, 1, -1, 1), clip=(2, 1))),
        ("SceneError", "unknown kind", lambda s: s.set_camera("fisheye", EYE, (-1, 1, -1, 1))),
        ("SceneError", 'mesh "quad" (id 1) is used by instance "square" (id 1)', lambda s: s.remove_mesh(1)),
        (TypeError, "incompatible function arguments", lambda s: s.upsert_instance("one", 1, EYE)),
    ],
)
def test_bad_edits_name_the_object_and_change_nothing(core, scene, error, words, edit):
    error = getattr(core, error) if isinstance(error, str) else error
    with pytest.raises(error) as caught:
        edit(scene)
    assert words in str(caught.value)
    assert scene.has_mesh(1) and not scene.has_mesh(2)
    scene.remove_light(1)  # the one lamp there was
    with pytest.raises(core.SceneError):
        scene.remove_light(10)


def test_errors_are_the_kinds_that_python_knows(core):
    assert issubclass(core.SceneError, ValueError)
    assert issubclass(core.DeviceError, RuntimeError)
    assert issubclass(core.DeviceLost, core.DeviceError) and issubclass(core.OutOfMemory, core.DeviceError)
    with pytest.raises(core.DeviceError, match="no such thing"):
        core.Context(device="no such thing")
    with pytest.raises(ValueError, match="threads"):
        core.Context(threads=-1)


def test_constants(core):
    assert core.flags["HW_MASK_CAMERA"] == 1 and core.flags["HW_MATERIAL_TRANSPARENT"] == 4
    assert "HW_OP_DIFFUSE" in core.material_ops and len(set(core.material_ops.values())) == len(core.material_ops)
    assert core.integrators()[0] == "path" and len(set(core.integrators())) == 7
    names = [name for name, _ in core.all_passes()]
    assert names[0] == "Combined" and len(names) == len(set(names)) == 23


@pytest.mark.parametrize(
    ("error", "words", "settings"),
    [
        (ValueError, 'unknown setting "sampels"', {"sampels": 4}),
        (TypeError, 'setting "samples" must be a whole number, not float', {"samples": 4.0}),
        (ValueError, 'setting "samples" must be from 0', {"samples": -4}),
        (TypeError, 'setting "exposure" must be a number, not str', {"exposure": "1"}),
        (ValueError, 'setting "exposure" must be a finite number', {"exposure": float("nan")}),
        (TypeError, 'setting "transparent_film" must be True or False', {"transparent_film": "no"}),
        (TypeError, 'setting "passes" must be a list of names', {"passes": "Combined"}),
        (ValueError, 'setting "region" must be four whole numbers', {"region": (0, 1)}),
        (ValueError, "(start, depth, falloff)", {"mist": (1, 2)}),
        (TypeError, "names of settings", {1: 2}),
        (ValueError, "integrator", {"integrator": "photon"}),
        (ValueError, "pass", {"passes": ["Sparkle"]}),
        (ValueError, "", {"width": 0}),
    ],
)
def test_bad_settings_are_named(core, make_context, scene, error, words, settings):
    session = core.Session(make_context(), scene)
    session.sync()
    with pytest.raises(error) as caught:
        session.start({"width": 4, "height": 4, **settings})
    assert words in str(caught.value)


def test_sync_sends_what_changed(core, make_context, scene):
    session = core.Session(make_context(), scene)
    report = session.sync()
    assert (report["meshes"], report["instances"], report["lights"], report["triangles"]) == (1, 1, 1, 2)
    assert (report["meshes_uploaded"], report["instances_uploaded"]) == (1, 1)
    report = session.sync()
    assert (report["meshes_uploaded"], report["instances_uploaded"], report["bytes_uploaded"]) == (0, 0, 0)
    scene.upsert_instance(1, 1, moved(x=1).astype(np.float64), name="square")
    report = session.sync()
    assert (report["meshes_uploaded"], report["instances_uploaded"]) == (0, 1)
    scene.upsert_mesh(1, "quad", QUAD * np.float32(2), TRIANGLES)
    assert session.sync()["meshes_uploaded"] == 1


def test_every_kind_of_edit_goes_through(core, make_context, scene):
    """Attributes on each domain, each texel type, a programmed world, groups of instances, removal, clear."""
    corners = np.arange(6, dtype=np.uint32).reshape(2, 3)
    scene.upsert_mesh(
        2,
        "all",
        QUAD,
        TRIANGLES,
        tri_corners=corners,
        normals=np.tile(np.float32([0, 0, 1]), (6, 1)),
        tri_slots=np.array([0, 1], np.uint8),
        default_uv=0,
        attributes=[
            ("UVMap", "corner", np.random.default_rng(1).random((6, 2), np.float32)),
            ("heat", "vertex", np.arange(4, dtype=np.float32)),
            ("id", "face", np.zeros((2, 1), np.float32)),
            ("color", core.flags["HW_DOMAIN_VERTEX"], np.ones((4, 4), np.float32)),
        ],
    )
    for number, (shape, kind) in enumerate(
        [
            ((2, 3), np.uint8),
            ((2, 3, 1), np.uint8),
            ((2, 3, 3), np.uint8),
            ((2, 3, 4), np.uint8),
            ((2, 3), np.float16),
            ((2, 3, 3), np.float16),
            ((2, 3, 4), np.float32),
            ((0, 0, 4), np.float32),
        ]
    ):
        scene.upsert_image(number + 1, "image", np.zeros(shape, kind), srgb=True)
    scene.upsert_image(20, "missing", None)
    scene.upsert_material(
        1, "empty", np.zeros(0, np.uint32), np.zeros((0, 4), np.float32), images=[1, 20, 0], pass_index=3
    )
    scene.upsert_instances(
        100,
        2,
        np.tile(EYE, (50, 1, 1)),
        random_ids=np.arange(50, dtype=np.uint32),
        materials=[1, 0],
        color=(1, 0, 0),
        visibility=core.flags["HW_MASK_CAMERA"],
        object_index=2,
        moves=True,
    )
    for kind in ("spot", "sun", "area"):
        scene.upsert_light(hash(kind) & 0xFFFF, kind, kind, moved(z=4), color=(1, 0.5, 0.2), power=3.0)
    scene.set_world("world", (0.1, 0.2, 0.3), sample=False)
    session = core.Session(make_context(), scene)
    report = session.sync()
    assert (report["instances"], report["images"], report["materials"]) == (51, 9, 1)
    with pytest.raises(core.SceneError, match="used by material"):
        scene.remove_image(20)
    scene.remove_instances(100, 49)
    scene.remove_instance(149)
    scene.remove_mesh(2)
    scene.remove_material(1)
    scene.remove_image(20)
    report = session.sync()
    assert (report["instances"], report["images"], report["materials"], report["meshes"]) == (1, 8, 0, 1)
    scene.clear()
    report = session.sync()
    assert report["instances"] == report["meshes"] == report["lights"] == 0


@pytest.mark.alone
def test_a_million_instances(core, make_context, scene):
    matrices = np.tile(EYE, (1_000_000, 1, 1))
    matrices[:, 0, 3] = np.arange(1_000_000)
    start = time.perf_counter()
    scene.upsert_instances(1000, 1, matrices)
    assert time.perf_counter() - start < 0.5
    scene.remove_instances(1000, 1_000_000)


def test_lamps_set_together_are_those_set_one_by_one(core, make_context):
    """The same bits, also after some moved, went and came."""
    random = np.random.default_rng(4)
    places = np.tile(EYE, (40, 1, 1))
    places[:, :, 3] = random.uniform((-1, -1, 0.5), (1, 1, 2), (40, 3))
    moved_places = places[:4] + np.float32(0.1)
    settings = {
        "point": dict(radius=0.1, power=5.0),
        "spot": dict(spot_size=1.0, power=9.0, color=(1, 0.5, 0.2)),
        "area": dict(size_x=0.3, size_y=0.1, power=4.0, flags=core.flags["HW_LIGHT_DIFFUSE"]),
    }

    def together(scene, ids, kind, matrices):
        scene.upsert_lights(np.array(ids, np.uint64), kind, kind, matrices, **settings[kind])

    def apart(scene, ids, kind, matrices):
        for number, matrix in zip(ids, matrices, strict=True):
            scene.upsert_light(int(number), kind, kind, matrix, **settings[kind])

    def removed_apart(scene, ids):
        for number in ids:
            scene.remove_light(int(number))

    pictures, counts = [], []
    for upsert, remove in (
        (together, lambda scene, ids: scene.remove_lights(np.array(ids, np.uint64))),
        (apart, removed_apart),
    ):
        scene = core.Scene()
        scene.upsert_mesh(1, "quad", QUAD * np.float32(4), TRIANGLES)
        scene.upsert_instance(1, 1, EYE)
        scene.set_camera("perspective", moved(z=3), (-0.5, 0.5, -0.5, 0.5))
        session = core.Session(make_context(), scene)
        for step in range(2):
            if step == 0:
                upsert(scene, range(100, 120), "spot", places[:20])
                upsert(scene, range(1, 11), "point", places[20:30])
                upsert(scene, range(50, 60), "area", places[30:])
            else:
                upsert(scene, (101, 105, 119, 300), "spot", moved_places)
                remove(scene, (3, 110, 1))
            counts.append(session.sync()["lights"])
            session.start({"width": 16, "height": 12, "samples": 4, "passes": ["Combined"], "seed": 3})
            session.finish()
            pictures.append(session.read("Combined").copy())
    assert counts == [40, 38, 40, 38]
    assert pictures[0].mean() > 0.01 and not np.array_equal(pictures[0], pictures[1])
    assert np.array_equal(pictures[0], pictures[2]) and np.array_equal(pictures[1], pictures[3])


def test_a_million_lamps(core, scene):
    """Each costs no more than each of a few thousand does, but for longer searches, and far less than one at a time."""

    def each(count, *, bulk=True):
        ids = np.arange(1000, 1000 + count, dtype=np.uint64)
        matrices = np.tile(EYE, (count, 1, 1))
        spent = []
        for _ in range(3 if count < 1_000_000 else 1):
            start = time.process_time()
            if bulk:
                scene.upsert_lights(ids, "Lamp", "point", matrices)
            for number in () if bulk else range(1000, 1000 + count):
                scene.upsert_light(number, "Lamp", "point", EYE)
            spent.append(time.process_time() - start)
            scene.remove_lights(ids)
        return min(spent) / count

    few = each(20_000)
    assert each(1_000_000) < 5 * few
    assert few < 0.4 * each(20_000, bulk=False)


@pytest.fixture(scope="module")
def rendered(core, make_context):
    """A finished 8 x 6 render of a lit square and its session."""
    scene = core.Scene()
    scene.upsert_mesh(1, "quad", QUAD * np.float32(4), TRIANGLES)
    scene.upsert_instance(1, 1, EYE)
    scene.upsert_light(1, "lamp", "point", moved(z=2), power=100.0, radius=0.1)
    scene.set_camera("perspective", moved(z=3), (-0.5, 0.5, -0.5, 0.5))
    session = core.Session(make_context(), scene)
    session.sync()
    session.start({"width": 8, "height": 6, "samples": np.int64(4), "passes": ["Combined", "Depth"], "seed": 3})
    session.finish()
    return session


def test_pixels_come_out(core, rendered):
    assert rendered.wait(0) is True
    progress = rendered.progress()
    assert progress["finished"] and not progress["cancelled"] and progress["sample"] == 4 and progress["error"] == ""
    assert rendered.passes() == [("Combined", 4), ("Depth", 1)]
    combined = rendered.read("Combined")
    assert combined.shape == (6, 8, 4) and combined.dtype == np.float32
    assert np.isfinite(combined).all() and combined[..., :3].min() > 0 and np.allclose(combined[..., 3], 1)
    depth = rendered.read("Depth")
    assert depth.shape == (6, 8, 1) and np.allclose(depth, 3, atol=0.5)
    out = np.full((6, 8, 4), -1, np.float32)
    assert rendered.read("Combined", out=out) is out and np.array_equal(out, combined)
    assert isinstance(rendered.stats(), dict)


@pytest.mark.parametrize(
    ("error", "words", "arguments"),
    [
        (ValueError, 'no pass "Mist"', ("Mist",)),
        (ValueError, "out must have shape (6, 8, 4), not (8, 6, 4)", ("Combined", np.zeros((8, 6, 4), np.float32))),
        (TypeError, "out must have type float32", ("Combined", np.zeros((6, 8, 4)))),
        (ValueError, "C-contiguous", ("Combined", np.zeros((6, 16, 4), np.float32)[:, ::2])),
    ],
)
def test_bad_reads(rendered, error, words, arguments):
    with pytest.raises(error) as caught:
        rendered.read(*arguments)
    assert words in str(caught.value)


def test_a_read_only_array_is_not_written(rendered):
    out = np.zeros((6, 8, 4), np.float32)
    out.flags.writeable = False
    with pytest.raises(ValueError, match="writable"):
        rendered.read("Combined", out)
    assert not out.any()


def test_pixels_outlive_their_session(core, make_context, scene):
    session = core.Session(make_context(), scene)
    session.sync()
    session.start({"width": 4, "height": 4, "samples": 1})
    session.finish()
    pixels = session.read("Combined")
    before = pixels.copy()
    del session
    gc.collect()
    assert np.array_equal(pixels, before)


@pytest.mark.alone
def test_progress_and_pixels_while_rendering(core, make_context, scene):
    """Other threads of Python run, and may look, while the core renders."""
    session = core.Session(make_context(), scene)
    session.sync()
    session.start({"width": 64, "height": 64, "samples": 100000})
    ticks = []
    ticker = threading.Thread(target=lambda: [ticks.append(time.sleep(0.01)) for _ in range(10)])
    ticker.start()
    assert session.wait(400) is False
    ticker.join()
    assert len(ticks) == 10
    assert session.read("Combined").shape == (64, 64, 4)
    with pytest.raises(RuntimeError):
        session.sync()
    session.cancel()
    start = time.perf_counter()
    session.finish()
    assert time.perf_counter() - start < 5
    assert session.progress()["cancelled"]


def test_two_sessions_take_turns_on_one_context(core, make_context, scene):
    other = core.Scene()
    other.set_camera("perspective", moved(z=3), (-0.5, 0.5, -0.5, 0.5))
    other.upsert_mesh(1, "quad", QUAD * np.float32(0.5), TRIANGLES)
    other.upsert_instance(1, 1, moved(z=1))
    context = make_context()
    first, second = core.Session(context, scene), core.Session(context, other)

    def depth(session):
        session.sync()
        session.start(
            {
                "width": 3,
                "height": 3,
                "samples": 1,
                "passes": ["Combined", "Depth"],
            }
        )
        session.finish()
        return session.read("Depth")[1, 1, 0]

    for _ in range(2):
        assert depth(first) == pytest.approx(3, abs=0.05)
        assert depth(second) == pytest.approx(2, abs=0.05)
    del second
    gc.collect()
    assert depth(first) == pytest.approx(3, abs=0.05)


def test_nothing_leaks():
    """nanobind reports at exit what it still holds: an interpreter of its own says nothing."""
    code = (
        "import numpy as np, headwater._core as core\n"
        "s = core.Scene(); e = np.eye(4, dtype=np.float32)[:3].copy()\n"
        "s.upsert_mesh(1, 'm', np.zeros((3, 3), np.float32), np.zeros((1, 3), np.uint32)); s.upsert_instance(1, 1, e)\n"
        "s.set_camera('perspective', e, (-1, 1, -1, 1))\n"
        "n = core.Session(core.Context(), s); n.sync(); n.start({'width': 2, 'height': 2, 'samples': 1}); n.finish()\n"
        "a = n.read('Combined')\n"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    assert "leak" not in result.stderr.lower() and "nanobind" not in result.stderr


@pytest.mark.parametrize("tracer", ["embree", "ray_query"])
def test_visibility_alone_is_an_edit(core, make_context, tracer):
    """An object that nothing else changes of is hidden from the camera and shown again, in one session."""
    scene = core.Scene()
    scene.upsert_mesh(1, "quad", QUAD, TRIANGLES)
    scene.set_world("sky", (1, 1, 1))
    scene.set_camera("perspective", moved(z=4), (-0.2, 0.2, -0.2, 0.2))
    session = core.Session(make_context(tracer=tracer), scene)
    everyone = sum(core.flags[f"HW_MASK_{name}"] for name in ("CAMERA", "DIFFUSE", "SHADOW_OPAQUE"))
    for visibility, seen in ((everyone, True), (everyone & ~core.flags["HW_MASK_CAMERA"], False), (everyone, True)):
        scene.upsert_instance(1, 1, EYE, name="quad", visibility=visibility)
        session.sync()
        session.start({"width": 8, "height": 8, "samples": 1, "passes": ["Combined", "Depth"]})
        session.finish()
        assert (session.read("Depth").max() < 100) == seen
