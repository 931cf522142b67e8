# SPDX-License-Identifier: Apache-2.0
"""`headwater compare`: each metric against values worked out by hand, the tile test's rates, and bad input."""

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest

from headwater import metrics
from headwater.compare import heat_map
from headwater.image_io import read_exr, select_layer, to_half, write_exr, write_png
from headwater.texture_io import decode_radiance, load_texture
from headwater.tile_test import incomplete_beta, normal_score, student_two_sided, tile_means, tile_test

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def headwater(*arguments):
    """Runs the command in a process of its own."""
    environment = dict(os.environ, PYTHONPATH=ROOT)
    return subprocess.run(
        [sys.executable, "-m", "headwater", *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment,
        timeout=120,
    )


def picture(value, height=8, width=12):
    return np.full((height, width, 4), value, np.float32)


def save(path, pixels, **options):
    write_exr(str(path), {"Combined": pixels}, depth="float", **options)
    return path


def test_metrics_of_constant_images():
    result = metrics.error_metrics(np.full((4, 4, 3), 1.1), np.full((4, 4, 3), 1.0))
    assert result["relmse"] == pytest.approx(0.01 / 1.01)
    assert result["mape"] == pytest.approx(0.1 / 1.01)
    assert result["smape"] == pytest.approx(0.2 / 2.11)
    assert result["mse"] == pytest.approx(0.01)
    assert result["mean_signed_error"] == pytest.approx(0.1)
    assert result["mean_signed_error_percent"] == pytest.approx(10)


def test_trimmed_relmse_leaves_out_exactly_the_worst_pixels():
    reference = np.ones((40, 50, 3))
    test = reference.copy()
    test[3, 4] = 1001  # two of 2000 pixels are 0.1 %
    test[5, 6] = 501
    result = metrics.error_metrics(test, reference)
    assert result["relmse"] > 100
    assert result["relmse_trimmed"] == 0
    test[7, 8] = 2
    assert metrics.error_metrics(test, reference)["relmse_trimmed"] == pytest.approx(1 / 1.01 / 1998)


def test_non_finite_pixels_are_counted_and_left_out():
    test, reference = np.ones((4, 4, 3)), np.ones((4, 4, 3))
    test[0, 0, 1] = np.nan
    test[0, 1] = np.inf
    reference[2, 2] = -np.inf
    assert metrics.count_non_finite(test) == metrics.NonFinite(nan=1, inf=1)
    assert metrics.error_metrics(test, reference)["mse"] == 0


def test_flip_bounds_and_order():
    pytest.importorskip("flip_evaluator")
    rng = np.random.default_rng(1)
    reference = rng.random((24, 24, 3)).astype(np.float32)
    same, _ = metrics.flip(reference, reference)
    near, _ = metrics.flip(reference * 1.02, reference)
    far, error_map = metrics.flip(reference * 3, reference)
    assert same == pytest.approx(0, abs=1e-5)
    assert same < near < far <= 1
    assert error_map.shape == (24, 24)


def test_incomplete_beta_and_student_against_tables():
    assert incomplete_beta(2, 3, 0.4) == pytest.approx(0.5248, rel=1e-9)
    assert incomplete_beta(5, 1, 0.3) == pytest.approx(0.3**5)
    # 97.5 % and 99.5 % points of Student's t from printed tables
    for t, freedom, p in ((12.7062, 1, 0.05), (2.77645, 4, 0.05), (4.03214, 5, 0.01), (2.75000, 30, 0.01)):
        assert student_two_sided(t, freedom) == pytest.approx(p, rel=1e-4)
    assert normal_score(0.05, -1) == pytest.approx(-1.959964, rel=1e-5)


def test_tile_means_cover_every_pixel_once():
    image = np.arange(7 * 10 * 2, dtype=float).reshape(7, 10, 2)
    means = tile_means(image, 3)
    assert means.shape == (3, 3, 2)
    assert tile_means(image, 1)[0, 0] == pytest.approx(image.mean(axis=(0, 1)))
    assert tile_means(image, 99).shape == image.shape


def test_tile_test_keeps_its_error_rate_on_equal_means():
    """Family p-values of equal-mean sets are below 5 % in about 5 % of 200 trials (binomial, 4 sigma: under 12 %)."""
    rng = np.random.default_rng(7)
    low = 0
    for _ in range(200):
        runs = rng.exponential(1.0, (9, 16, 16, 1))  # skewed, and more runs on one side
        low += tile_test(list(runs[:4]), list(runs[4:]), 4).p_family < 0.05
    assert low / 200 < 0.12


def test_tile_test_finds_a_small_bias_in_one_tile():
    rng = np.random.default_rng(8)
    test = list(rng.normal(1, 0.1, (8, 32, 32, 3)))
    reference = list(rng.normal(1, 0.1, (8, 32, 32, 3)))
    assert abs(tile_test(test, reference, 4).worst_z) < 4
    for image in test:
        image[8:16, 24:32, 1] += 0.04
    result = tile_test(test, reference, 4)
    assert result.worst_tile == (1, 3, 1)
    assert result.worst_z > 4
    assert result.p_family < 0.01


def test_tile_test_takes_equal_constants_as_equal_and_different_ones_as_different():
    ones = [np.ones((4, 4, 3))] * 3
    assert tile_test(ones, ones, 2).p_family == 1
    assert tile_test([image * 1.01 for image in ones], ones, 2).p_family == 0


def test_command_prints_json_and_writes_a_heat_map(tmp_path):
    a = save(tmp_path / "a.exr", picture(0.9))
    b = save(tmp_path / "b.exr", picture(1.0))
    result = headwater("compare", a, b, "--heatmap", tmp_path / "heat.png")
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["mean_signed_error_percent"] == pytest.approx(-10, abs=0.01)
    assert report["channels"] == 3, "alpha is no colour"
    assert load_texture(str(tmp_path / "heat.png")).pixels.shape == (8, 12, 3)
    assert headwater("compare", a, b, "--max-relmse", "0.5").returncode == 0
    assert headwater("compare", a, b, "--max-relmse", "0.001").returncode == 1


def test_command_tiles_from_several_runs(tmp_path):
    rng = np.random.default_rng(3)
    sides = {"a": 0.0, "b": 0.0, "c": 0.5}
    for side, offset in sides.items():
        for run in range(4):
            save(tmp_path / f"{side}{run}.exr", rng.normal(1 + offset, 0.1, (16, 16, 4)).astype(np.float32))
    runs = {side: [tmp_path / f"{side}{run}.exr" for run in range(4)] for side in sides}
    equal = headwater("compare", *runs["a"], "--against", *runs["b"], "--tiles", 4, "--max-z", 5)
    assert equal.returncode == 0, equal.stdout + equal.stderr
    different = headwater("compare", *runs["c"], "--against", *runs["b"], "--tiles", 4, "--max-z", 5)
    assert different.returncode == 1
    assert json.loads(different.stdout)["tiles"]["worst_z"] > 5


def test_layers_are_found_by_pass_name(tmp_path):
    path = str(tmp_path / "multi.exr")
    passes = {"Combined": picture(1), "Depth": picture(3)[..., :1], "Diffuse Color": picture(0.5)[..., :3]}
    write_exr(path, passes, view_layer="Layer.001", depth="half")
    exr = read_exr(path)
    assert select_layer(exr) == "Layer.001.Combined"
    assert select_layer(exr, "Layer.001", "Depth") == "Layer.001.Depth"
    assert exr.channels["Layer.001.Depth"] == "Z"
    assert exr.layers["Layer.001.Depth"][0, 0, 0] == 3
    result = headwater("compare", path, path, "--pass", "Diffuse Color")
    assert json.loads(result.stdout)["mean_reference"] == pytest.approx(0.5)
    missing = headwater("compare", path, path, "--pass", "Diffuse Colour")
    assert missing.returncode != 0
    assert "Layer.001.Diffuse Color" in missing.stderr


def test_rows_run_top_down_in_files(tmp_path):
    pixels = picture(0)
    pixels[0] = 1  # bottom row
    path = str(save(tmp_path / "up.exr", pixels))
    layer = read_exr(path).layers[""]
    assert layer[-1].all() and not layer[0].any()
    write_png(str(tmp_path / "up.png"), pixels)
    assert load_texture(str(tmp_path / "up.png")).pixels[0].all(), "textures come bottom row first"


def test_half_clamps_instead_of_making_infinities():
    half = to_half(np.array([1e9, -1e9, np.inf, 1.5], np.float32))
    assert half[0] == 65504 and half[1] == -65504 and np.isinf(half[2]) and half[3] == 1.5


def test_heat_map_marks_non_finite_pixels():
    test = np.ones((2, 2, 3))
    test[1, 1] = np.nan
    colours = heat_map(test, np.ones((2, 2, 3)))
    assert tuple(colours[1, 1]) == (0, 255, 0)
    assert tuple(colours[0, 0]) == (0, 0, 4)


@pytest.mark.parametrize("content", [b"", b"not an image", b"\x76\x2f\x31\x01\x02\0\0\0rest"])
def test_unreadable_images_are_one_line(tmp_path, content):
    good = save(tmp_path / "good.exr", picture(1))
    bad = tmp_path / "bad.exr"
    bad.write_bytes(content)
    result = headwater("compare", bad, good)
    assert result.returncode != 0
    assert "bad.exr" in result.stderr and len(result.stderr.strip().splitlines()) == 1, result.stderr


def test_truncated_exr_pixels_are_an_error(tmp_path):
    good = save(tmp_path / "good.exr", np.random.default_rng(0).random((64, 64, 4)).astype(np.float32))
    bad = tmp_path / "bad.exr"
    bad.write_bytes(good.read_bytes()[:20000])
    result = headwater("compare", bad, good)
    assert result.returncode != 0
    assert "bad.exr" in result.stderr and len(result.stderr.strip().splitlines()) == 1, result.stderr


def test_sizes_must_match(tmp_path):
    a, b = save(tmp_path / "a.exr", picture(1)), save(tmp_path / "b.exr", picture(1, width=13))
    result = headwater("compare", a, b)
    assert result.returncode != 0
    assert "12 x 8" in result.stderr and "13 x 8" in result.stderr


def test_usage_errors(tmp_path):
    a = save(tmp_path / "a.exr", picture(1))
    for arguments in ((a,), (a, tmp_path / "none.exr"), (a, a, "--tiles", 4), (a, a, "--heatmap", tmp_path / "x.jpg")):
        result = headwater("compare", *arguments)
        assert result.returncode != 0
        assert "Traceback" not in result.stderr and result.stderr.startswith("headwater: error:")


def radiance(body, height, width, axes="-Y {h} +X {w}"):
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + axes.format(h=height, w=width).encode() + b"\n" + body


def test_radiance_flat_and_run_length_agree():
    rng = np.random.default_rng(2)
    rgbe = rng.integers(2, 255, (3, 16, 4)).astype(np.uint8)
    rgbe[:, 4:9] = rgbe[:, 4:5]  # a run
    flat = decode_radiance(radiance(rgbe.tobytes(), 3, 16), "flat")
    coded = b""
    for row in rgbe:
        coded += bytes([2, 2, 0, 16])
        for c in range(4):
            coded += bytes([4]) + row[:4, c].tobytes() + bytes([128 + 5, row[4, c]]) + bytes([7]) + row[9:, c].tobytes()
    assert np.array_equal(decode_radiance(radiance(coded, 3, 16), "runs"), flat)
    expected = rgbe[1, 2, 0] * math.ldexp(1.0, int(rgbe[1, 2, 3]) - 136)
    assert flat[1, 2, 0] == pytest.approx(expected)
    flipped = decode_radiance(radiance(rgbe.tobytes(), 3, 16, "+Y {h} -X {w}"), "flipped")
    assert np.array_equal(flipped, flat[::-1, ::-1])


@pytest.mark.parametrize("body", [b"", b"\2\2\0\x10" + bytes([200, 7]), b"\2\2\0\x10" + bytes([0, 0])])
def test_broken_radiance_is_refused(body):
    with pytest.raises(Exception, match="broken.hdr"):
        decode_radiance(radiance(body, 3, 16), "broken.hdr")
