# SPDX-License-Identifier: Apache-2.0
"""`headwater bench-speed`: arguments it refuses, quotients worked out by hand, and the tables. No picture is
rendered: the processes' reports are made up.
"""

import json

import pytest

from headwater import bench_speed
from headwater.cli import build_parser, main

SAMPLES = (2, 10)


def process(start, per_sample, *, first=9.0, core=False):
    """A report as a worker writes it: one first picture, then two rounds of renders with few and with many samples."""
    renders = []
    for number, samples in enumerate([SAMPLES[0], *SAMPLES, *SAMPLES]):
        seconds = start + per_sample * samples
        renders.append(
            {
                "samples": samples,
                "seconds": seconds,
                "cpu_seconds": 2 * seconds,
                "sync_build_seconds": 0.5 if number else 4.0,
            }
        )
        if core:
            renders[-1]["core"] = {"stages": {"shade": 1 + 0.25 * samples, "film": 0.5}}
    return {"renders": renders, "first_image_seconds": first, "peak_rss_bytes": 3 << 20}


@pytest.fixture
def blend(tmp_path):
    path = tmp_path / "scene.blend"
    path.write_bytes(b"BLENDER")
    return str(path)


@pytest.fixture
def reports(monkeypatch):
    """Puts made-up reports in the place of processes; returns the engines in the order in which they were asked."""
    asked = []

    def use(**found):
        def measure(args, file, engine):
            asked.append(engine)
            return found[engine]

        monkeypatch.setattr(bench_speed, "_measure", measure)
        return asked

    return use


@pytest.mark.parametrize(
    "arguments, reason",
    [
        (["--samples", "4", "4"], "FEW must be less than MANY"),
        (["--samples", "0", "4"], "--samples"),
        (["--repeats", "0"], "--repeats"),
        (["--max-ratio", "0"], "no number above 0"),
        (["--max-ratio", "nan"], "no number above 0"),
        (["--max-ratio", "half"], "no number above 0"),
        (["--max-ratio", "1", "--mode", "script"], "does not measure"),
        (["--tracer", "crayon"], "--tracer"),
        (["--mode", "dream"], "--mode"),
    ],
)
def test_refused_arguments(blend, reports, capsys, arguments, reason):
    asked = reports()
    assert main(["bench-speed", blend, *arguments]) == 2
    assert reason in capsys.readouterr().err
    assert asked == []


def test_refused_files(tmp_path, capsys):
    picture = tmp_path / "scene.png"
    picture.write_bytes(b"PNG")
    assert main(["bench-speed", str(picture)]) == 2
    assert "is not a .blend file" in capsys.readouterr().err
    assert main(["bench-speed", str(tmp_path / "missing.blend")]) != 0
    assert "missing.blend" in capsys.readouterr().err


def test_seconds_a_sample_leave_out_what_does_not_grow_with_samples():
    summary = bench_speed._stills_summary([process(3, 0.25, core=True), process(7, 0.25, core=True)], SAMPLES)
    assert summary["sample_seconds"] == pytest.approx(0.25)
    assert summary["sample_cpu_seconds"] == pytest.approx(0.5)
    assert summary["sync_build_seconds"] == 0.5
    assert summary["first_sync_build_seconds"] == 4.0
    assert summary["peak_mib"] == 3
    assert summary["stage_seconds_per_sample"] == pytest.approx({"shade": 0.25, "film": 0})


def test_medians_over_rounds_and_processes():
    runs = [process(1, cost) for cost in (0.1, 0.3, 100)]
    runs[0]["renders"][0]["seconds"] = 1e6  # the first picture compiles: it does not count
    assert bench_speed._stills_summary(runs, SAMPLES)["sample_seconds"] == pytest.approx(0.3)


@pytest.mark.parametrize(
    "ours, theirs, expected", [(1, 4, 0.25), (-1, 4, None), (1, -4, None), (0, 4, None), (1, 0, None)]
)
def test_a_quotient_needs_two_times_above_zero(ours, theirs, expected):
    assert bench_speed._quotient(ours, theirs) == expected
    assert bench_speed._quotient(float("nan"), 1.0) is None


def test_table_and_report(blend, reports, tmp_path, capsys):
    asked = reports(headwater=process(1, 0.25, first=6.0), cycles=process(1, 0.5, first=3.0))
    report = tmp_path / "report.json"
    assert main(["bench-speed", blend, "--samples", "2", "10", "--repeats", "3", "--json", str(report)]) == 0
    assert asked == ["headwater", "cycles", "cycles", "headwater", "headwater", "cycles"]  # they take turns at leading
    name, head, ours, theirs, ratio = capsys.readouterr().out.splitlines()
    assert name == "scene.blend"
    assert head.split()[0] == "s/sample"
    assert ours.split()[:3] == ["headwater", "0.250", "0.500"]
    assert theirs.split()[:3] == ["cycles", "0.500", "1.000"]
    assert ratio.split() == ["ratio", "0.500", "0.500", "1.000", "1.000", "2.000", ratio.split()[6], "1.000"]
    assert len({len(line) for line in (head, ours, theirs, ratio)}) == 1
    written = json.loads(report.read_text())
    assert written["settings"]["samples"] == [2, 10]
    assert written["files"][0]["ratio"]["sample_seconds"] == pytest.approx(0.5)


@pytest.mark.parametrize("ours, theirs, status", [(0.25, 0.5, 0), (0.5, 0.25, 1), (-0.1, 0.5, 1), (0.1, -0.5, 1)])
def test_max_ratio(blend, reports, capsys, ours, theirs, status):
    reports(headwater=process(5, ours), cycles=process(5, theirs))
    assert main(["bench-speed", blend, "--max-ratio", "1"]) == status
    assert ("n/a" in capsys.readouterr().out) == (ours < 0 or theirs < 0)


def test_frames(blend, reports, capsys):
    def frames(*seconds):
        return {"renders": [{"sync_build_seconds": s} for s in seconds]}

    reports(headwater=frames(2.0, 0.05, 0.04), cycles=frames(1.0, 0.0, 0.5))
    assert main(["bench-speed", blend, "--mode", "script"]) == 0
    _, head, ours, theirs = capsys.readouterr().out.splitlines()
    assert head.endswith("frame 2 / frame 1")
    assert ours.split() == ["headwater", "2.0000", "0.0500", "0.0400", "2.50%"]
    assert theirs.split() == ["cycles", "1.0000", "0.0000", "0.5000", "n/a"]


def test_defaults_measure_direct_light():
    args = build_parser().parse_args(["bench-speed", "scene.blend"])
    assert (args.max_bounces, args.mode, args.max_ratio) == (0, "stills", None)
