# SPDX-License-Identifier: Apache-2.0
"""`headwater figures`: its table is whole, its measures measure, its sentences follow its numbers."""

import dataclasses
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from headwater import figures
from headwater.cli import build_parser, main
from headwater.errors import UserError
from headwater.figures import claims, display, make, measures, pictures, report, scenes, table

SCRIPT = Path(__file__).resolve().parents[1] / "scenes" / "figures" / "make_figure_scene.py"


# The table


def test_every_figure_of_the_paper_with_its_counts():
    found = {figure.id: (figure.samples, figure.bounces, figure.scene) for figure in table.FIGURES}
    assert found == {
        "1": (16, 0, "room"),
        "3": (4, 0, "garden"),
        "4": (16, 10, "room"),
        "5": (16, 0, "room"),
        "6": (16, 0, "room"),
        "7": (16, 0, "room"),
        "8": (16, 0, "town"),
        "9a": (16, 0, "room"),
        "9b": (16, 0, "town"),
    }
    assert [v.options["ascension"] for v in table.chosen([6])[0].variants] == [1, 10, 100]
    assert [v.integrator for v in table.chosen([1])[0].variants] == ["path", "restir", "wssr-kd", "wssr-grid"]


def test_what_variants_ask_for_is_an_option_of_render():
    parser = build_parser()
    for figure in table.FIGURES:
        names = [variant.name for variant in figure.variants]
        assert len(set(names)) == len(names)
        for variant in figure.variants:
            parser.parse_args(["render", "scene.blend", *variant.arguments()])
            assert "uniform" in variant.arguments()


def test_only():
    assert [figure.id for figure in table.chosen([9, 3])] == ["3", "9a", "9b"]
    with pytest.raises(UserError, match="no figure 2; choose from: 1, 3, 4"):
        table.chosen([2])


# The measures


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def test_independent_errors_do_not_correlate_and_shared_ones_do(rng):
    grain = rng.normal(size=(120, 160))
    blocks = np.repeat(np.repeat(rng.normal(size=(30, 40)), 4, 0), 4, 1)
    every = np.ones((120, 160), bool)
    assert abs(measures.neighbour_correlation(grain, every)) < 0.02 and abs(measures.block_share(grain, every)) < 0.02
    assert measures.neighbour_correlation(blocks, every) == pytest.approx(
        0.75, abs=0.05
    )  # 3 of 4 neighbours share a block
    assert measures.block_share(blocks, every) == pytest.approx(1, abs=0.02)
    half = measures.block_share(grain + blocks, every)
    assert half == pytest.approx(0.5, abs=0.05)
    left = every & (np.arange(160) < 80)
    mixed = np.where(left, blocks, grain)
    assert measures.block_share(mixed, left) > 0.9 and abs(measures.block_share(mixed, ~left)) < 0.03
    assert (
        measures.neighbour_correlation(mixed, left) > 0.6 and abs(measures.neighbour_correlation(mixed, ~left)) < 0.03
    )
    for flat, lit in ((np.zeros((8, 8)), np.ones((8, 8), bool)), (grain, ~every)):
        assert measures.neighbour_correlation(flat, lit) == 0 and measures.block_share(flat, lit) == 0


def test_one_firefly_decides_no_correlation(rng):
    error = rng.normal(size=(120, 160))
    error[50, 50:52] = 1e6
    assert measures.neighbour_correlation(error, np.ones(error.shape, bool)) < 0.05


def test_reference_error_is_that_of_the_mean(rng):
    halves = [1 + rng.normal(scale=0.1, size=(200, 200, 3)) for _ in range(2)]
    known = np.square(np.mean(halves, axis=0) - 1).mean() / 1.01
    assert measures.reference_error(*halves, np.ones((200, 200), bool))["relmse"] == pytest.approx(known, rel=0.05)


def test_bias_in_standard_errors(rng):
    reference = np.ones((96, 128, 3))
    noise, lit = rng.normal(scale=0.2, size=reference.shape), np.ones((96, 128), bool)
    assert abs(measures.bias_sigmas(reference + noise, reference, lit)) < 4
    assert measures.bias_sigmas(reference + noise + 0.02, reference, lit) > 10
    assert abs(measures.bias_sigmas(reference + noise + 0.02, reference, ~lit)) == 0
    assert measures.bias_sigmas(reference[:5, :3], reference[:5, :3], lit[:5, :3]) == 0


def floor(height=90, width=160):
    """A floor 1.5 m below a camera at the origin, seen along +Y: places, and where there is floor."""
    down = (np.arange(height) + 0.5) / height * 0.3 + 0.005
    distance = 1.5 / down
    side = (np.arange(width) - width / 2 + 0.5) / width
    places = np.stack(np.broadcast_arrays(distance[:, None] * side, distance[:, None], -1.5), axis=2)
    return places, np.ones((height, width), bool)


def test_grid_measures_tell_inside_from_beyond(rng):
    places, surface = floor()
    grid = table.Grid(50, 100)
    reference = np.ones((*surface.shape, 3))
    beyond = np.abs(places).max(axis=2) >= 50
    test = reference + np.where(beyond, 0.5, 0.1)[..., None] * rng.choice([-1, 1], size=(*surface.shape, 1))
    found = measures.grid_measures(test, reference, places, surface, (0, 0, 0), grid)
    assert found["inside_share"] == pytest.approx(1 - beyond.mean())
    assert found["relmse_trimmed_inside"] == pytest.approx(0.01 / 1.01, rel=1e-3)
    assert found["relmse_trimmed_beyond"] == pytest.approx(0.25 / 1.01, rel=1e-3)
    assert found["edge_jump"] == pytest.approx(1, abs=0.2)
    edge = measures.boundary(places, surface, (0, 0, 0), grid)
    assert edge.any() and np.abs(places[edge]).max() <= 50
    everything_inside = measures.grid_measures(test, reference, places, surface, (0, 0, 0), table.Grid(1e4, 100))
    assert everything_inside["relmse_trimmed_beyond"] is None


def test_cell_edges_show_as_jumps(rng):
    places, surface = floor()
    grid = table.Grid(50, 40)
    cell = measures.cells(places, (0, 0, 0), grid, False)
    own = rng.normal(size=(41, 41))
    test = (
        1 + 0.1 * own[cell[..., 0].clip(0, 40), cell[..., 1].clip(0, 40)] + rng.normal(scale=0.02, size=surface.shape)
    )
    test = np.repeat(test[..., None], 3, 2)
    found = measures.grid_measures(test, np.ones_like(test), places, surface, (0, 0, 0), grid)
    assert found["edge_jump"] > 3


def test_cells_are_those_of_the_engine():
    """Riding: multiples of the size from the camera's corner. In the world: multiples from the origin."""
    grid, camera = table.Grid(4, 8), (0.3, 0, 0)
    places = np.array([[[0.2, 0.2, 0.2], [-3.8, 0, 0], [-3.6, 0, 0], [np.nan, 0, 0]]])
    assert measures.cells(places, camera, grid, True)[0, :, 0].tolist() == [3, -1, 0, -1]
    assert measures.cells(places, camera, grid, False)[0, :, 0].tolist() == [4, 0, 0, -1]
    assert measures.cells(places, camera, grid, False, 0.5)[0, :3, 0].tolist() == [4, 0, 0]


def test_black_share():
    reference = np.ones((4, 4, 3))
    reference[0] = 0
    lit = reference[..., 0] > 0
    test = reference.copy()
    test[1, 0] = 0
    assert measures.black_share(test, lit) == pytest.approx(1 / 12)
    assert measures.black_share(test, ~lit & lit) == 0


# The claims


def numbers(**errors):
    base = {"neighbour_correlation": 0.0, "block_share": 0.0, "black_share": 0.0, "lit_signed_percent": 0.0}
    base |= {"bias_sigmas": 0.0, "neighbour_pairs": 10_000}
    return {name.replace("_", "-"): base | {"lit_relmse_trimmed": error} for name, error in errors.items()}


def figure(id):
    return next(f for f in table.FIGURES if f.id == id)


def test_every_figure_has_claims():
    for each in table.FIGURES:
        said = claims.verdicts(each, {})
        assert said and all(v.agrees is None and "not measured" in v.ours for v in said)


def test_verdicts_follow_the_numbers():
    good = numbers(path=1.0, restir=0.5, wssr_kd=0.3, wssr_grid=0.2)
    said = claims.verdicts(figure("1"), good)
    assert [v.agrees for v in said] == [True, True, True, True, None, None]
    assert "0.5 (restir) against 1 (path): 2.00 times less" in said[1].ours
    swapped = numbers(path=1.0, restir=2.0, wssr_kd=0.3, wssr_grid=0.2)
    said = claims.verdicts(figure("1"), swapped)
    assert [v.agrees for v in said] == [False, False, True, True, None, None]
    assert "2.00 times more" in said[1].ours and said[0].ours.index("restir") < said[0].ours.index("path")


@pytest.mark.parametrize(
    "factor, agrees, word", [(1.1, True, "minor"), (2, False, "more than minor"), (0.8, False, "worse")]
)
def test_minor_means_minor(factor, agrees, word):
    (verdict,) = claims.verdicts(figure("4"), numbers(restir=factor, restir_reproject=1.0))
    assert verdict.agrees is agrees and word in verdict.ours
    (verdict,) = claims.verdicts(figure("4"), numbers(restir=1.0, restir_reproject=1.0))
    assert verdict.agrees is False and "no difference" in verdict.ours


def test_a_bias_is_more_than_noise():
    found = numbers(wssr_kd=1.0)
    found["wssr-kd"] |= {"lit_signed_percent": -3.0, "bias_sigmas": -8.0}
    verdict = claims.verdicts(figure("1"), found)[4]
    assert verdict.agrees is True and "-3.0 %" in verdict.ours and "-8.0" in verdict.ours


def test_a_significant_boost_is_more_than_minor():
    assert claims.verdicts(figure("3"), numbers(restir_on=1.0, restir_off=1.1))[0].agrees is False
    assert claims.verdicts(figure("3"), numbers(restir_on=1.0, restir_off=2.0))[0].agrees is True


def test_quantisation_needs_correlation_that_shows():
    found = numbers(ascension_1=1.0, path=1.0)
    assert claims.verdicts(figure("9a"), found)[0].agrees is False
    found["ascension-1"] |= {"neighbour_correlation": 0.4, "block_share": 0.3}
    verdict = claims.verdicts(figure("9a"), found)[0]
    assert verdict.agrees is True and "0.40" in verdict.ours and "30 %" in verdict.ours


def test_sharing_less_is_more_than_noise():
    found = numbers(ascension_1=2.0, ascension_10=1.0, ascension_100=2.0)
    found["ascension-10"] |= {"neighbour_correlation": 0.04}
    assert claims.verdicts(figure("6"), found)[3].agrees is False  # 0.014 is the difference's standard error
    found["ascension-10"] |= {"neighbour_correlation": 0.08}
    assert [v.agrees for v in claims.verdicts(figure("6"), found)] == [False, True, True, True]


def test_grid_claims():
    found = numbers(wssr_grid=1.0, wssr_grid_reproject=0.5)
    assert [v.agrees for v in claims.verdicts(figure("8"), found)] == [True, None]
    found["wssr-grid"]["grid"] = {"relmse_trimmed_beyond": 2.0}
    found["wssr-grid-reproject"]["grid"] = {"relmse_trimmed_beyond": 1.0}
    verdict = claims.verdicts(figure("8"), found)[1]
    assert verdict.agrees is True and "beyond the grid 1 (" in verdict.ours
    found = numbers(grid_rides=1.0, grid_stays=1.0)
    found["grid-rides"] |= {"black_share": 0.1}
    sides = {"relmse_trimmed_inside": 1.0, "relmse_trimmed_beyond": 1.1, "edge_jump": 1.5}
    sides |= {"signed_percent_inside": -20.0, "bias_sigmas_inside": -10.0}
    noisy = sides | {"signed_percent_beyond": 5.0, "bias_sigmas_beyond": 0.5}
    found["grid-rides"]["grid"] = noisy
    assert [v.agrees for v in claims.verdicts(figure("9b"), found)] == [None, True, True]
    found["grid-rides"]["grid"] = noisy | {"bias_sigmas_beyond": 2.0, "edge_jump": 1.05}
    assert [v.agrees for v in claims.verdicts(figure("9b"), found)] == [True, False, True]


# Display


def test_tone_map_and_insets():
    reference = np.full((40, 60, 3), 0.2)
    assert 120 < display.tone_map(reference, display.exposure_of(reference)).mean() < 150
    odd = np.array([[[np.nan, np.inf, -1.0]]])
    assert display.tone_map(odd, 1.0).dtype == np.uint8
    assert display.exposure_of(np.zeros((2, 2, 3))) == 1
    assert display.crop(reference, (0.95, 0.95, 0.1, 0.1)).shape == (4, 6, 3)
    assert display.magnify(np.arange(12, dtype=np.uint8).reshape(2, 2, 3), 4)[0, :, 0].tolist() == [0, 0, 3, 3]


# The command, with renders replaced by quick pictures of known errors


@pytest.fixture
def quick_renders(monkeypatch):
    """Renders are noise on a fixed picture; asks for a variant of `broken` fail. Returns the commands asked for."""
    asked, broken = [], set()

    def render(self, scene, bounces, options, seed, label, work, more=()):
        asked.append([scene.name, bounces, *options, seed])
        if broken & set(options):
            raise UserError(f"{label}: out of luck")
        width, height = self.size
        rng = np.random.default_rng(seed + len(asked))
        pixels = np.linspace(0.1, 1, width)[None, :, None] * np.ones((height, width, 3))
        scale = 0.01 if "power" in options else 0.3
        pixels = (pixels * (1 + rng.normal(scale=scale, size=pixels.shape))).astype(np.float32)
        places, _ = floor(height, width)
        stats = {"device": "a device", "tracer": "embree", "totals": {"reservoir_bytes": 2**20}}
        stats["passes"] = {
            "Position": places.astype(np.float32),
            "Environment": np.zeros((height, width, 3), np.float32),
        }
        stats["passes"]["Emission"] = np.zeros((height, width, 3), np.float32)
        self._done += work
        return pictures.Picture(pixels, 0.5, 2**20, "headwater render scene.blend", stats)

    def scene(name, folder, seed=1, lights=None):
        facts = {"scene": name, "lights": 1000, "triangles": 5000, "camera": [0, 0, 0]}
        return scenes.Scene(name, f"{name}.blend", facts, "0123456789")

    monkeypatch.setattr(pictures.Workshop, "_render", render)
    monkeypatch.setattr(scenes, "make_scene", scene)
    return asked, broken


def run_figures(folder, *more):
    return main(["figures", "-o", str(folder), "--size", "48x27", "--reference-samples", "8", "--quiet", *more])


def test_whole_report(tmp_path, quick_renders):
    asked, _ = quick_renders
    assert run_figures(tmp_path) == 0
    written = json.loads((tmp_path / "figures.json").read_text())
    assert [record["id"] for record in written["figures"]] == [f.id for f in table.FIGURES]
    record = written["figures"][0]
    assert record["variants"][0]["numbers"]["relmse"] == pytest.approx(0.09, rel=0.2)
    assert record["variants"][0]["numbers"]["reservoir_bytes"] == 2**20
    assert record["reference"]["error"]["relmse"] < 1e-4
    page = (tmp_path / "index.html").read_text()
    links = set(re.findall(r'(?:src|href)="([^"#]+)"', page))
    assert len(links) > 100
    for link in links:
        assert not link.startswith("/") and (tmp_path / link).is_file(), link
    for verdict in record["verdicts"]:
        assert report._e(verdict["ours"]) in page
    for each in table.FIGURES:
        assert (tmp_path / f"figure-{each.id}.png").is_file()
    variants = [command for command in asked if "uniform" in command]
    assert len(variants) == len({str(command) for command in variants}), "a picture was rendered twice"
    references = [command for command in asked if "power" in command]
    assert len(references) == 2 * 4, "room at 0 and 10 bounces, garden, town: two halves each"
    asked.clear()
    assert run_figures(tmp_path, "--only", "3") == 0
    assert len(asked) == 2, "the reference is kept"
    assert len(json.loads((tmp_path / "figures.json").read_text())["figures"]) == len(table.FIGURES)


def test_a_failing_figure_is_named_and_the_others_stay(tmp_path, quick_renders, capsys):
    _, broken = quick_renders
    broken.add("wssr-kd")
    assert run_figures(tmp_path, "--only", "6,7") == 1
    said = capsys.readouterr().err
    assert "figure 6" in said and "out of luck" in said and "figure 7 (" not in said
    written = {r["id"]: r for r in json.loads((tmp_path / "figures.json").read_text())["figures"]}
    assert written["7"]["failures"] == [] and len(written["6"]["failures"]) == 3
    assert all(verdict["agrees"] is None for verdict in written["6"]["verdicts"])
    assert "out of luck" in (tmp_path / "index.html").read_text()


def test_ctrl_c_keeps_what_is_done(tmp_path, quick_renders, monkeypatch):
    original = make.make_figure

    def stop_at_four(each, *rest):
        if each.id == "4":
            raise pictures.Stopped
        return original(each, *rest)

    monkeypatch.setattr(figures, "make_figure", stop_at_four)
    assert run_figures(tmp_path) == 130
    assert [r["id"] for r in json.loads((tmp_path / "figures.json").read_text())["figures"]] == ["1", "3"]


@pytest.mark.parametrize(
    "bad, reason", [(["--only", "2"], "no figure 2"), (["--only", "x"], "no list"), (["--size", "0x1"], "size")]
)
def test_refused_requests(tmp_path, capsys, bad, reason):
    assert main(["figures", "-o", str(tmp_path / "out"), *bad]) == 2
    assert reason in capsys.readouterr().err


def test_a_file_in_the_folders_place(tmp_path, capsys):
    (tmp_path / "out").write_text("here")
    assert main(["figures", "-o", str(tmp_path / "out")]) == 2
    assert "can't be made a folder" in capsys.readouterr().err


# The real thing, tiny


@pytest.mark.slow
def test_a_real_figure(tmp_path, monkeypatch):
    small = dataclasses.replace(figure("7"), variants=figure("7").variants[:1], samples=2)
    monkeypatch.setattr(table, "FIGURES", (small,))
    assert main(["figures", "-o", str(tmp_path), "--size", "48x27", "--reference-samples", "16", "--quiet"]) == 0
    (record,) = json.loads((tmp_path / "figures.json").read_text())["figures"]
    assert record["scene"]["lights"] >= 1000
    found = record["variants"][0]["numbers"]
    assert record["reference"]["error"]["relmse_trimmed"] < found["relmse_trimmed"]
    assert abs(found["mean_signed_error_percent"]) < 60  # two samples a pixel: the right scene, no more
    reference = pictures._read_reference(str(next((tmp_path / "references").glob("*.exr"))))
    low, high = reference.places[reference.lit].min(axis=0), reference.places[reference.lit].max(axis=0)
    assert (low > [-1, -1, -1]).all() and (high < [10, 18, 4]).all() and high[1] > 10, "places of the room's surfaces"


@pytest.mark.slow
@pytest.mark.parametrize("kind, least", [("room", 1000), ("garden", 500), ("town", 1500)])
def test_scenes(tmp_path, kind, least):
    """Enough lights, few triangles, the asked-for number of lights, the same facts again."""
    facts = []
    for i in range(2):
        path = tmp_path / f"{i}.json"
        command = [
            sys.executable,
            str(SCRIPT),
            kind,
            "-o",
            str(tmp_path / "x.blend"),
            "--facts",
            str(path),
            "--seed",
            "3",
        ]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
        facts.append(json.loads(path.read_text()))
    assert facts[0] == facts[1]
    assert facts[0]["lights"] >= least and facts[0]["triangles"] < 300_000
