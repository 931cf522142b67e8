# SPDX-License-Identifier: Apache-2.0
"""A part of what measure_unbiased.py asks over all benchmark scenes (docs/measurements/unbiased.md): every kind of
integrator and every Tracer once, under emissive meshes, area lamps, lamps in shades. And that the checks can fail."""

import json
import subprocess
import sys
from pathlib import Path

import expectation
import numpy as np
import pytest

HERE = Path(__file__).resolve().parent


def asked(folder, scene, *arguments):
    """The rows of one scene."""
    command = [sys.executable, str(HERE / "measure_unbiased.py"), "-o", str(folder), "--scenes", scene, "--here",
               "--runs", "12", "--samples", "4", "--lights", "12", *arguments]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return json.loads((folder / f"{scene}.json").read_text())


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene, contestants, tracers, checks",
    [
        ("rooms", ["wssr-hash"], ["embree"], ["z", "oracle", "linear"]),
        ("shades", ["restir-reproject"], ["embree"], ["z", "linear"]),
        pytest.param(
            "heads", ["wssr-kd", "wssr-hash"], ["ray_query", "ray_pipeline"], ["z"], marks=pytest.mark.ray_query
        ),
    ],
)
def test_light_of_path_in_a_benchmark_scene(tmp_path, scene, contestants, tracers, checks):
    given = ("--contestants", *contestants, "--tracers", *tracers, "--checks", *checks, "--bounces", "4")
    rows = asked(tmp_path, scene, *given)
    assert len(rows) == len(checks) * len(contestants) * len(tracers)
    assert all(row["holds"] for row in rows), rows
    assert all(row.get("seen", 0) < 0.12 for row in rows), rows


def pictures(rng, count, bias=0.0, samples=1, plateau=0.0):
    """Pictures of noise about one, with a bias in a corner; of variance 1 / samples + plateau."""
    made = 1 + rng.normal(size=(count, 18, 32, 3)) * 0.3 * np.sqrt(1 / samples + plateau)
    made[:, :6, :8] += bias
    return list(made)


def test_agreement_sees_what_it_says_it_sees():
    rng = np.random.default_rng(1)
    truth = pictures(rng, 16)
    even = expectation.agreement(pictures(rng, 16), truth)
    assert even.holds and even.seen < 0.02
    assert not expectation.agreement(pictures(rng, 16, bias=0.2), truth).holds
    everywhere = expectation.agreement([p + 1.5 * even.seen for p in pictures(rng, 16)], truth)
    assert not everywhere.holds and everywhere.z > 4
    with pytest.raises(AssertionError):
        expectation.assert_same_light(pictures(rng, 16), truth, 0.1)


def test_slope_tells_a_plateau():
    rng = np.random.default_rng(2)
    counts = (8, 16, 32)
    fitted, error = expectation.slope(counts, [pictures(rng, 12, samples=n) for n in counts], 12)
    assert abs(fitted + 1) < 3 * error < 0.2
    fitted, error = expectation.slope(counts, [pictures(rng, 12, samples=n, plateau=0.05) for n in counts], 12)
    assert fitted - 2 * error > -0.95
