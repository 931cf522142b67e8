# SPDX-License-Identifier: Apache-2.0
"""`headwater bench` without rendering: contestants, curves, references, order of renders, reports, dying processes."""

import json
import sys
import types
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from headwater import interrupt
from headwater.bench import contestants, curves, measure, plot, process, reference, report
from headwater.bench.curves import Reached, Speedup, comparison, shown, speedup, time_to_error
from headwater.bench.engines import Stopped
from headwater.cli import main
from headwater.errors import UserError
from headwater.progress import Progress

# Contestants


def test_contestants(core):
    found = contestants.parse("restir:candidates=16,reuse-weights=mis,temporal-reuse=off,lights=uniform", core)
    assert (found.engine, found.integrator, found.lights) == ("headwater", "restir", "uniform")
    assert found.parameters == {"candidates": 16, "reuse_weights": "mis", "temporal_reuse": False}
    assert contestants.parse("cycles:light-tree=off", core).light_tree is False
    assert contestants.parse("cycles", core).settings()["engine"] == "cycles"
    for name in core.integrators():  # whatever the core lists
        assert contestants.parse(name, core).integrator == name


@pytest.mark.parametrize(
    "text, reason",
    [
        ("eevee", "unknown integrator 'eevee'"),
        ("path:candidates=4", "candidates"),
        ("restir:candidates=many", "no whole number"),
        ("restir:candidates=0", "candidates"),
        ("restir:speed=9", "unknown option 'speed'"),
        ("restir:candidates", "not OPTION=VALUE"),
        ("cycles:samples=4", "light-tree"),
    ],
)
def test_contestants_refused(core, text, reason):
    with pytest.raises(UserError, match=reason):
        contestants.parse(text, core)


# Curves


def power_law(error_at_one_second, slope=-1.0, times=(1, 2, 4, 8)):
    return [(t, error_at_one_second * t**slope) for t in times]


def test_time_to_error():
    assert time_to_error(power_law(0.8), 0.3).seconds == pytest.approx(0.8 / 0.3)
    assert time_to_error(power_law(0.8), 0.8) == Reached(1)
    assert time_to_error(power_law(0.8), 0.9) == Reached(1, "most")
    assert time_to_error(power_law(0.8), 0.09) == Reached(8, "least")
    assert time_to_error([(4, 0.5), (1, 1.0), (2, 0.1)], 0.1).seconds == pytest.approx(2)  # the first crossing counts
    with pytest.raises(ValueError):
        time_to_error([], 0.1)


def test_speedup_and_its_bounds():
    assert speedup(power_law(0.2), power_law(0.8), 0.15) == Speedup(pytest.approx(4))
    assert speedup(power_law(0.01), power_law(0.8), 0.2).bound == "least"  # ours begins below
    assert speedup(power_law(0.01), power_law(0.8), 0.05).bound == "least"  # and theirs never comes there
    assert speedup(power_law(0.8), power_law(0.01), 0.05).bound == "most"
    assert speedup(power_law(0.8), power_law(0.8), 0.01).bound == "none"
    assert speedup(power_law(0.8), power_law(0.8), 0.9).bound == "none"


def test_comparison_over_seeds():
    ours = [power_law(e) for e in (0.2, 0.1, 0.4)]
    theirs = [power_law(e) for e in (0.8, 0.8, 0.8)]
    found = comparison(ours, theirs)
    assert found["error"] == pytest.approx(0.1)  # where the slower one ends
    assert found["ratio"] == pytest.approx(4)
    assert found["spread"] == pytest.approx([2, 8])
    assert shown(found) == "4x (2 to 8)"
    assert comparison([[]], theirs) is None and shown(None) == "n/a"


def test_curves_that_do_not_overlap_give_a_bound():
    found = comparison([power_law(0.001)], [power_law(0.8)])
    assert found["bound"] == "least" and found["ratio"] == pytest.approx(8)
    assert shown(found) == "> 8x"
    assert shown(comparison([power_law(0.8)], [power_law(0.001)])).startswith("< 0.125")


def test_what_is_past_a_curve_is_extrapolated_and_says_so():
    ours = [(1.0, 0.1, 1), (1.5, 0.05, 2)]
    theirs = [(3.0, 2.0, 1), (5.0, 1.0, 2), (9.0, 0.5, 4)]  # 2 s a sample and 1 s before
    found = curves.beyond(ours, theirs)
    assert found.past == pytest.approx(10) and found.seconds == pytest.approx((1.5, 1 + 2 * 40))
    assert curves.shown_beyond(found) == "~54x at 0.05, 10 times past its last"
    assert curves.beyond(theirs, ours) is None and curves.shown_beyond(None) == ""
    assert curves.beyond(ours, theirs[:1]) is None  # nothing says what a sample costs


def test_median_curve_ends_with_the_shortest():
    found = curves.median_curve([[(1, 3), (2, 2)], [(3, 5), (4, 1)], [(2, 4)]])
    assert found == [(2, 4)]


# References


def noisy(mean, noise, parts, seed):
    rng = np.random.default_rng(seed)
    runs = mean + rng.normal(0, noise, (parts, *mean.shape))
    own = [reference.own_error(runs[::2].mean(axis=0)[0], runs[1::2].mean(axis=0)[0])]
    return reference.Reference(runs.mean(axis=0), np.array(own), 1, 1.0)


def test_references_agree_within_noise():
    mean = np.full((1, 40, 60, 3), 0.5)
    both, (facts,) = reference.agree(noisy(mean, 0.02, 4, 1), noisy(mean, 0.08, 4, 2))
    assert not measure.systematic(facts)
    assert facts["relmse_trimmed"] == pytest.approx(facts["expected"], rel=0.25)
    assert facts["share"] == pytest.approx(16 / 17, abs=0.02)  # by inverse variance
    error = np.mean(np.square(both.pixels - mean) / 0.26)
    assert error == pytest.approx(both.error[0], rel=0.25)


def test_a_reference_knows_what_it_missed():
    """Rare bright samples: most pixels have none, and their scatter says 0."""
    rng = np.random.default_rng(3)
    mean = np.full((1, 60, 80, 3), 0.5)

    def rare(seed):
        runs = (np.random.default_rng(seed).random((4, 1, 60, 80, 1)) < 0.05) / 0.05 * mean
        own = [reference.own_error(runs[::2].mean(axis=0)[0], runs[1::2].mean(axis=0)[0])]
        return reference.Reference(runs.mean(axis=0), np.array(own), 1, 1.0)

    _, (facts,) = reference.agree(rare(rng.integers(99)), rare(rng.integers(100, 199)))
    assert not measure.systematic(facts)


def test_references_that_differ_are_told():
    mean = np.full((1, 40, 60, 3), 0.5)
    _, (facts,) = reference.agree(noisy(mean * 1.1, 0.02, 4, 1), noisy(mean, 0.02, 4, 2))
    assert measure.systematic(facts)
    assert facts["mean_signed_error_percent"] == pytest.approx(10, abs=0.5)
    assert "more than noise" in measure.disagreement_line(facts)


def test_reference_key_follows_content(tmp_path, core):
    args = types.SimpleNamespace(size=(8, 8), max_bounces=0)
    path = contestants.parse("path", core)
    a, b, c = (tmp_path / name for name in "abc")
    a.write_bytes(b"one")
    b.write_bytes(b"one")
    c.write_bytes(b"two")
    keys = [reference.content_key(str(file), args, None, path, 4.0) for file in (a, b, c)]
    assert keys[0] == keys[1] != keys[2]
    assert reference.content_key(str(a), args, None, path, 5.0) != keys[0]
    args.max_bounces = 1
    assert reference.content_key(str(a), args, None, path, 4.0) != keys[0]


# The race


class FakeEngines:
    """Renders noise about a picture: `speeds` are seconds a sample by contestant; error falls with samples."""

    asked = []
    speeds = {"path": 0.1, "cycles": 0.4}
    noise = {"path": 0.2, "cycles": 0.2}
    fail = {}
    bias = {}

    def __init__(self, file, args, frames, progress):
        self.frames, self.blender = frames, "5.0"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return False

    def render(self, contestant, seed, samples, label, reference=False):
        name = contestant.text
        self.asked.append((name, seed, samples))
        if self.fail.get(name) == (seed, samples):
            raise UserError(f"'scene.blend' by {name}: the process ended with status -11: bang")
        if self.fail.get("stop") == (name, seed, samples):
            raise Stopped
        rng = np.random.default_rng(seed * 100_003 + samples * 7 + len(name))
        count = len(self.frames) if self.frames is not None else 1
        pictures = [
            0.5 + self.bias.get(name, 0) + rng.normal(0, self.noise[name] / np.sqrt(samples), (36, 64, 3))
            for _ in range(count)
        ]
        seconds = self.speeds[name] * samples
        cost = {"seconds": 1 + seconds, "sampling_seconds": seconds, "sync_build_seconds": 1.0, "cpu_seconds": seconds}
        return pictures, [cost] * count


@pytest.fixture
def fake(monkeypatch):
    monkeypatch.setattr(measure, "Engines", FakeEngines)
    for name, value in (("asked", []), ("fail", {}), ("bias", {})):
        monkeypatch.setattr(FakeEngines, name, value)
    return FakeEngines


def settings(tmp_path, **values):
    blend = tmp_path / "scene.blend"
    blend.write_bytes(b"BLENDER")
    given = {"size": (64, 36), "max_bounces": 0, "frames": None, "output": str(tmp_path / "out"), "time": 4.0}
    given |= {"lead": [], "denoise": False, "seeds": 3, "reference": "together", "reference_time": 400.0}
    return str(blend), types.SimpleNamespace(**(given | values))


def race(core, tmp_path, **values):
    file, args = settings(tmp_path, **values)
    racers = [contestants.parse(name, core) for name in ("path", "cycles")]
    return measure.measure(file, args, racers, racers, Progress(quiet=True)), args


def test_race(core, tmp_path, fake):
    found, _ = race(core, tmp_path)
    runs = [(name, seed, samples) for name, seed, samples in fake.asked if seed < 1000]
    for seed in (1, 2, 3):
        assert [n for c, s, n in runs if (c, s) == ("path", seed)] == [1, 2, 4, 8, 16, 32]  # 64 would take 6.4 s
        assert [n for c, s, n in runs if (c, s) == ("cycles", seed)] == [1, 2, 4, 8]
    leaders = [runs[i][0] for i in (0, 2, 4, 6)]
    assert set(leaders) == {"path", "cycles"}  # by turns
    result = found.against("path", "cycles", measure.SAMPLING)
    assert result["bound"] == "" and result["ratio"] == pytest.approx(4, rel=0.25)
    whole = found.against("path", "cycles", measure.WITH_SYNC)  # a second more on both sides
    assert 1 < whole["ratio"] < result["ratio"]
    assert not measure.systematic(found.disagreement[0]) and not found.failures


def test_race_is_measured_against_the_reference_asked_for(core, tmp_path, fake):
    fake.bias = {"cycles": 0.25}
    apart, _ = race(core, tmp_path)
    own, _ = race(core, tmp_path, reference="own")
    last = [f.points["path"][1][0][-1].errors["relmse_trimmed"] for f in (apart, own)]
    assert measure.systematic(apart.disagreement[0])
    assert last[0] > 5 * last[1]


def test_references_are_kept(core, tmp_path, fake):
    first, _ = race(core, tmp_path)
    count = sum(seed > 1000 for _, seed, _ in fake.asked)
    again, _ = race(core, tmp_path)
    assert sum(seed > 1000 for _, seed, _ in fake.asked) == count > 0
    assert np.array_equal(first.references["together"].pixels, again.references["together"].pixels)


def test_one_that_fails_is_left_out(core, tmp_path, fake):
    fake.fail = {"cycles": (2, 2)}
    found, args = race(core, tmp_path)
    assert "bang" in found.failures["cycles"]
    assert ("path", 3, 32) in fake.asked and ("cycles", 2, 4) not in fake.asked
    assert found.against("path", "cycles", measure.SAMPLING)["ratio"] == pytest.approx(4, rel=0.4)
    assert "bang" in written(args, [found])["index.html"]


def test_ctrl_c_keeps_what_there_is(core, tmp_path, fake):
    fake.fail = {"stop": ("cycles", 2, 4)}
    found, args = race(core, tmp_path)
    assert found.stopped
    assert len(found.points["cycles"][1][0]) == 4 and len(found.points["cycles"][2][0]) == 2
    assert "Stopped" in written(args, [found])["index.html"]


def test_stopped_before_anything(core, tmp_path, fake):
    fake.fail = {"stop": ("path", 1, 1)}
    found, args = race(core, tmp_path)
    fake.fail = {"stop": ("path", reference.SEEDS, 1000)}
    assert "n/a" in written(args, [found])["index.html"]


def test_no_reference_is_an_error(core, tmp_path, fake):
    fake.fail = {"path": (reference.SEEDS - 1, 1), "cycles": (reference.SEEDS - 1, 1)}
    with pytest.raises(UserError, match="bang"):
        race(core, tmp_path)


def test_animation_has_a_curve_a_frame(core, tmp_path, fake):
    found, args = race(core, tmp_path, frames=range(3, 6), seeds=1)
    assert found.frames == [3, 4, 5]
    assert len(found.curves("path", measure.SAMPLING, 2)[0]) == 6
    page = written(args, [found])["index.html"]
    assert "frame 5, sampling alone" in page and page.count("<svg") == 6


@pytest.mark.parametrize(
    "given, reason",
    [
        (["--animation-from", "1"], "which --frame"),
        (["--frame", "8", "--animation-from", "8"], "not before frame 8"),
        (["--frame", "8", "--frames", "1-2"], "one of them"),
        (["--frame", "soon"], "no frame"),
    ],
)
def test_frames_that_make_no_animation(tmp_path, capsys, given, reason):
    blend = tmp_path / "scene.blend"
    blend.write_bytes(b"BLENDER")
    try:
        status = main(["bench", str(blend), "-o", str(tmp_path / "out"), *given])
    except SystemExit as stopped:
        status = stopped.code
    assert status == 2 and reason in capsys.readouterr().err


# Reports


def written(args, results):
    about = {"machine": process.machine(), "headwater": "0", "device": "d", "tracer": "t", "command": "headwater bench"}
    args.threads, args.reference = 2, args.reference
    args.__dict__.setdefault("max_bounces", 0)
    import os

    os.makedirs(args.output, exist_ok=True)
    report.write_report(args.output, about | {"settings": {**vars(args), "frames": None}}, results, "cycles")
    return {
        name: open(os.path.join(args.output, name), encoding="utf-8").read() for name in ("index.html", "bench.json")
    }


def test_report_stands_alone_and_has_every_number(core, tmp_path, fake):
    found, args = race(core, tmp_path, seeds=2)
    files = written(args, [found])
    page, facts = files["index.html"], json.loads(files["bench.json"])["files"][0]
    assert "src=" in page and all(part.startswith("data:image/png;base64,") for part in page.split('src="')[1:])
    assert "href=" not in page and str(tmp_path) not in page
    assert page.count("<svg") == 2 and page.count("<figure>") == 3
    assert len(facts["points"]["cycles"]["2"][0]) == 4
    bars = facts["error_bars"]["cycles"][0]
    assert [bar["samples"] for bar in bars] == [1, 2, 4, 8] and all(bar["seeds"] == 2 for bar in bars)
    assert all(bar["least"] < bar["error"] < bar["largest"] for bar in bars)
    assert page.count('class="bar"') == 2 * (6 + 4)
    past = facts["comparisons"][0]["extrapolated"]
    assert past["past"] > 2 and past["ratio"] > 1 and f"~{past['ratio']:.3g}x" in page
    assert facts["comparisons"][0]["result"]["spread"][0] > 1
    assert {"headwater", "cycles", "together"} == set(facts["references"])


def test_pictures_are_of_equal_time(core, tmp_path, fake):
    found, _ = race(core, tmp_path, seeds=1)
    chosen = report.equal_time(found)
    assert {name: point.samples for name, point in chosen.items()} == {"path": 32, "cycles": 8}


def test_plot_is_xml_with_its_points_in_place():
    text = plot.log_log("a & b", "seconds", "error", [("x <y>", "#fff", [(1, 0.1), (100, 0.001)], [[(1, 0.2)]])])
    svg = ElementTree.fromstring(text)
    dots = [(float(c.get("cx")), float(c.get("cy"))) for c in svg.iter() if c.tag.endswith("circle")]
    assert dots[0][0] < dots[1][0] and dots[0][1] < dots[1][1]  # later and lower
    labels = [t.text for t in svg.iter() if t.tag.endswith("text")]
    assert {"1", "10", "100", "0.1", "0.01", "0.001", "a & b"} <= set(labels)
    ElementTree.fromstring(plot.log_log("", "", "", []))
    ElementTree.fromstring(plot.log_log("", "", "", [("one", "#fff", [(1.0, 1.0)], [])]))


# Processes


@pytest.fixture
def echo(tmp_path, monkeypatch):
    """A module that answers what it is told to do."""
    (tmp_path / "echo_worker.py").write_text(
        "import json, sys, time, os\n"
        "for line in sys.stdin:\n"
        "    q = json.loads(line)\n"
        "    print('chatter', file=sys.stderr, flush=True)\n"
        "    if q.get('die'):\n"
        "        print('out of paint', file=sys.stderr, flush=True); os._exit(7)\n"
        "    if q.get('sleep'): time.sleep(60)\n"
        "    print(json.dumps({'error': q['error']} if 'error' in q else {'got': q}), flush=True)\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    worker = process.Worker("echo_worker", "echo")
    yield worker
    worker.close()


def test_worker_answers(echo):
    assert echo.ask({"a": 1}, 30) == {"got": {"a": 1}}
    with pytest.raises(process.Failed, match="echo: no canvas"):
        echo.ask({"error": "no canvas"}, 30)
    assert echo.ask({"b": 2}, 30) == {"got": {"b": 2}}


def test_worker_that_dies_tells_its_last_words(echo):
    with pytest.raises(process.Failed, match="status 7: out of paint"):
        echo.ask({"die": True}, 30)
    with pytest.raises(process.Failed, match="status 7"):
        echo.ask({"a": 1}, 30)


def test_worker_that_takes_too_long(echo):
    with pytest.raises(process.Failed, match="more than 1 s"):
        echo.ask({"sleep": True}, 1)


def test_what_waiting_raises_goes_through(echo):
    def waiting(_seconds):
        raise Stopped

    with pytest.raises(Stopped):
        echo.ask({"sleep": True}, 30, waiting)


# The command


@pytest.mark.parametrize(
    "arguments, reason",
    [
        ([], "which .blend"),
        (["scene.blend"], "-o DIR"),
        (["missing.blend", "-o", "out"], "missing.blend"),
        (["--gpu-report", "scene.blend"], "no FILE"),
        (["--gpu-report", "--integrators", "cycles"], "no cycles"),
        (["--gpu-report", "--integrators", "path:noise-threshold=0.1"], "noise-threshold"),
        (["scene.blend", "-o", "out", "--integrators", "eevee"], "eevee"),
        (["scene.blend", "-o", "out", "--integrators", "path:lights=sideways"], "sideways"),
        (["scene.blend", "-o", "out", "--against", "path"], "no comparison"),
        (["scene.blend", "-o", "out", "--time", "0"], "--time"),
        (["scene.blend", "-o", "out", "--seeds", "0"], "--seeds"),
        (["scene.blend", "-o", "out", "--frames", "5-1"], "--frames"),
    ],
)
def test_refused(tmp_path, monkeypatch, capsys, arguments, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.blend").write_bytes(b"BLENDER")
    assert main(["bench", *arguments]) == 2
    assert reason in capsys.readouterr().err


def test_command_with_two_files_of_which_one_fails(tmp_path, monkeypatch, capsys, fake):
    for name in ("a.blend", "b.blend"):
        (tmp_path / name).write_bytes(b"BLENDER")

    class Second(FakeEngines):
        def render(self, contestant, seed, samples, label, reference=False):
            if self.bad:
                raise UserError("'a.blend' by path: can't be read: not a .blend")
            return super().render(contestant, seed, samples, label, reference)

        def __init__(self, file, args, frames, progress):
            super().__init__(file, args, frames, progress)
            self.bad = file.endswith("a.blend")

    monkeypatch.setattr(measure, "Engines", Second)
    out = tmp_path / "out"
    monkeypatch.setattr(sys, "argv", ["headwater", "bench", str(tmp_path / "a.blend")])
    files = [str(tmp_path / name) for name in ("a.blend", "b.blend")]
    assert main(["bench", *files, "-o", str(out), "--time", "1", "--seeds", "1", "--size", "64x36"]) == 1
    said = capsys.readouterr()
    assert "can't be read" in said.err and "b.blend" in said.out
    facts = json.loads((out / "bench.json").read_text())
    assert [each["file"] for each in facts["files"]] == ["b.blend"]
    assert str(tmp_path) not in (out / "bench.json").read_text()
    assert not interrupt.requested()
