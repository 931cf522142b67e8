# SPDX-License-Identifier: Apache-2.0
"""Holds the unbiased integrators against `path` over the scenes of scenes/benchmark: the table of
docs/measurements/unbiased.md.

    python blender_tests/measure_unbiased.py -o DIRECTORY [--scenes rooms neon] [--tracers embree ray_query]
        [--contestants wssr-hash restir] [--bounces 0 4] [--checks z slope oracle linear]
        [--runs 16] [--samples 6] [--size 64x36] [--lights 24]

Each scene, made small, is asked in a process of its own:

  z       pictures of independent seeds against `path`'s, as a whole and by tiles that have a thousandth of its
          mean or more; twice where they seem to differ, then the tile most apart alone
  slope   variance over seeds at 8, 16 and 32 samples: the exponent of the count, -1 for independent samples, beside
          `path`'s
  oracle  direct light alone against the sum of pictures with one light each, in which no light is ever chosen
  linear  every emission twice: the picture of the same seed over that of before

Prints a row a combination and writes DIRECTORY/SCENE.json. Status 1 where any does not hold.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
SCENES = ("heads", "sun", "sky", "streets", "city", "rooms", "shades", "neon")
TRACERS = ("embree", "ray_query", "ray_pipeline")
CONTESTANTS = ("path", "wssr-hash", "restir", "restir-reproject", "wssr-kd", "wssr-grid", "wssr-grid-reproject")
BIASED = ("restir:paper", "wssr-kd:paper", "wssr-grid:paper")  # for the asking: to be seen failing
CHECKS = ("z", "slope", "oracle", "linear")
SLOPE_COUNTS = (8, 16, 32)
TILES = 6  # across and up
TILE_RUNS, TILE_SAMPLES = 16, 2048  # of a tile alone, where pictures leave a doubt
TILE_SEEN = 0.25  # the bias of a tile that they must be able to see, else they decide nothing


def settings_of(contestant: str) -> dict:
    """Settings of Session.start of a contestant."""
    integrator, _, estimator = contestant.partition(":")
    if integrator in ("path", "wssr-hash"):
        return {"integrator": integrator}
    return {"integrator": integrator, "estimator": estimator or "unbiased"}


class Lights:
    """Every light of a bpy scene, the world's background among them, with a switch and a strength."""

    def __init__(self, bpy, scene):
        self.bpy = bpy
        self.lights = []  # of each: [(owner, attribute, value)]
        for thing in scene.objects:
            if thing.type == "LIGHT":
                thing.data = thing.data.copy()
                self.lights.append([(thing.data, "energy", thing.data.energy)])
            elif thing.type == "MESH":
                sockets = self._own_sockets(thing)
                if sockets:
                    self.lights.append([(s, "default_value", s.default_value) for s in sockets])
        background = []
        if scene.world and scene.world.node_tree:
            strengths = [n.inputs["Strength"] for n in scene.world.node_tree.nodes if n.type == "BACKGROUND"]
            background = [(s, "default_value", s.default_value) for s in strengths]
        if background:
            self.lights.append(background)

    @staticmethod
    def _own_sockets(thing) -> list:
        """Emission strengths of the object's materials, which become its own where it has any."""

        def found(material):
            nodes = material.node_tree.nodes if material and material.node_tree else ()
            all_ = [node.inputs.get("Emission Strength") for node in nodes]
            return [socket for socket in all_ if socket is not None and socket.default_value > 0]

        if not any(found(m) for m in thing.data.materials):
            return []
        thing.data = thing.data.copy()
        for i, material in enumerate(thing.data.materials):
            thing.data.materials[i] = material.copy()
        return [socket for material in thing.data.materials for socket in found(material)]

    def set(self, only: int | None = None, factor: float = 1.0) -> None:
        """All lights, or one of them, at `factor` of their strength."""
        for i, light in enumerate(self.lights):
            for owner, name, value in light:
                setattr(owner, name, value * factor if only in (None, i) else 0.0)


class Suite:
    """One benchmark scene in this process's bpy, its core scene, and sessions on each Tracer."""

    def __init__(self, kind: str, lights: int, size, seed: int = 1):
        sys.path[:0] = [str(HERE.parent), str(HERE.parent / "scenes" / "benchmark")]
        import bpy
        import make_benchmark
        import skies
        import surfaces

        import headwater._core as core
        import headwater.blender

        surfaces.Images.__init__.__defaults__ = (64,)  # what takes long and is no light
        skies.WIDTH = 256
        make_benchmark.make(kind, lights, size, seed)
        self.core, self.bpy, self.size = core, bpy, size
        self.scene = bpy.context.scene
        self.lights = Lights(bpy, self.scene)
        self.addon = headwater.blender.register()
        self.scene.render.engine = "HEADWATER"
        self.scene.headwater.use_cycles_settings = False
        self.scene.headwater.samples = 1
        self.scene.render.resolution_percentage = 100
        self.scene.render.use_persistent_data = True
        self.contexts = {}
        self.sessions = {}
        self.sync()

    def sync(self) -> None:
        """Brings the core's scene in line with Blender's."""
        import headwater.blender

        self.bpy.ops.render.render()
        if headwater.blender.last_error():
            raise RuntimeError(headwater.blender.last_error())
        kept = sys.modules[f"{self.addon.__name__}.kept"]
        (state,) = kept._kept.values()
        self.core_scene = state.sync.scene
        for session in self.sessions.values():
            session.sync()

    def session(self, tracer: str):
        """A session of the scene on a Tracer, kept."""
        if tracer not in self.sessions:
            self.contexts[tracer] = self.core.Context(tracer=tracer)
            self.sessions[tracer] = self.core.Session(self.contexts[tracer], self.core_scene)
            self.sessions[tracer].sync()
        return self.sessions[tracer]

    def render(self, tracer: str, contestant: str, seed: int, samples: int, bounces: int, **given) -> np.ndarray:
        """(H, W, 3) of one render."""
        session = self.session(tracer)
        settings = {"width": self.size[0], "height": self.size[1], "samples": samples, "seed": seed,
                    "max_bounces": bounces, "passes": ["Combined"], **settings_of(contestant), **given}  # fmt: skip
        session.start(settings)
        while not session.wait(1000):
            pass
        session.finish()
        return np.array(session.read("Combined"), np.float64)[..., :3]

    def renders(self, tracer, contestant, seeds, samples, bounces, **given) -> list:
        return [self.render(tracer, contestant, int(seed), samples, bounces, **given) for seed in seeds]


class Checks:
    """The checks of one scene; each returns rows: dictionaries with `holds`."""

    def __init__(self, suite: Suite, args):
        self.suite, self.args = suite, args
        self._truths, self._slopes = {}, {}

    def truth(self, bounces: int) -> list:
        """Independent pictures of `path` by embree; much more of them than of what is held against them."""
        if bounces not in self._truths:
            seeds = range(10_000, 10_000 + self.args.runs)
            self._truths[bounces] = self.suite.renders("embree", "path", seeds, 16 * self.args.samples, bounces)
        return self._truths[bounces]

    def z(self, tracer, contestant, bounces) -> dict:
        return self.against(self.truth(bounces), tracer, contestant, bounces, 0)

    def against(self, truth, tracer, contestant, bounces, first_seed) -> dict:
        """Pictures against the truth's. Rare bright paths that few samples have not met look like a bias of a tile.
        Where the two disagree, other seeds with six times the samples are asked; where they still do, long renders of
        the tile most apart alone. A bias stays, chance does not."""
        from expectation import agreement

        samples, seeds = self.args.samples, range(first_seed, first_seed + self.args.runs)
        asked = {"tiles": TILES, "dark": 1e-3}
        found = agreement(self.suite.renders(tracer, contestant, seeds, samples, bounces), truth, **asked)
        again = not found.holds
        if again:
            seeds = range(first_seed + 5000, first_seed + 5000 + self.args.runs)
            found = agreement(
                self.suite.renders(tracer, contestant, seeds, 6 * samples, bounces), truth, TILES, dark=1e-3
            )
        row = {**asdict(found), "holds": found.holds, "again": again}
        if not found.holds and abs(found.z) < 4:
            row["tile_z"], row["tile_seen"] = self.tile(found.worst, truth, tracer, contestant, bounces)
            row["holds"] = abs(row["tile_z"]) < 4
            row["undecided"] = row["holds"] and row["tile_seen"] > TILE_SEEN
        return row

    def tile(self, worst, truth, tracer, contestant, bounces) -> tuple:
        """z of long renders of one tile, in the channel where it was most apart, and what they would see."""
        row, column, channel = (int(n) for n in worst[:3])
        width, height = self.suite.size
        across, up = (np.linspace(0, size, TILES + 1).round().astype(int) for size in (width, height))
        box = (across[column], up[row], across[column + 1], up[row + 1])
        part = tuple(int(n) for n in box)
        seeds = range(40_000, 40_000 + TILE_RUNS)
        long = self.suite.renders(tracer, contestant, seeds, TILE_SAMPLES, bounces, region=part)
        ours = np.array([picture[..., channel].mean() for picture in long])
        theirs = np.array([picture[part[1] : part[3], part[0] : part[2], channel].mean() for picture in truth])
        error = np.hypot(ours.std(ddof=1) / len(ours) ** 0.5, theirs.std(ddof=1) / len(theirs) ** 0.5)
        return float((ours.mean() - theirs.mean()) / error), float(4 * error / theirs.mean())

    def slope(self, tracer, contestant, bounces) -> dict:
        fitted, error = self.fitted(tracer, contestant, bounces)
        path, path_error = self.fitted(tracer, "path", bounces)
        # Steeper is learning: the first samples knew less. Flatter would be a plateau; but where rare bright paths are
        # most of the variance, few samples do not show it, and that of independent samples looks flatter too.
        flattest = max(-0.95 + 2 * error, path + 0.05 + 2 * np.hypot(error, path_error))
        return {"slope": fitted, "error": error, "path": path, "holds": bool(fitted < flattest)}

    def fitted(self, tracer, contestant, bounces) -> tuple:
        """Slope and its error, kept."""
        from expectation import slope

        key = (tracer, contestant, bounces)
        if key not in self._slopes:
            runs = [self.suite.renders(tracer, contestant, range(12), n, bounces) for n in SLOPE_COUNTS]
            self._slopes[key] = slope(SLOPE_COUNTS, runs, 12)
        return self._slopes[key]

    def linear(self, wanted) -> list:
        """Of all wanted (tracer, contestant, bounces) at once: the scene is synced twice."""
        given = {"samples": self.args.samples, "seed": 5}
        before = [self.suite.render(t, c, bounces=b, **given) for t, c, b in wanted]
        self.suite.lights.set(factor=2.0)
        self.suite.sync()
        after = [self.suite.render(t, c, bounces=b, **given) for t, c, b in wanted]
        self.suite.lights.set()
        self.suite.sync()
        rows = []
        for one, two in zip(before, after):
            lit = one > 1e-6
            off = float(np.abs(two[lit] / (2 * one[lit]) - 1).mean()) if lit.any() else 1.0
            mean = float(two.mean() / max(2 * one.mean(), 1e-30))
            rows.append({"off": off, "mean": mean, "holds": off == 0})
        return rows

    def oracle(self, wanted) -> list:
        """Direct light against the sum over lights, each alone. Runs of the sum are independent."""
        lights = len(self.suite.lights.lights)
        runs = 8
        sums = [0.0] * runs
        for light in range(lights):
            self.suite.lights.set(only=light)
            self.suite.sync()
            for run in range(runs):
                seed = 20_000 + light * runs + run
                sums[run] = sums[run] + self.suite.render(
                    "embree", "path", seed, 8 * self.args.samples, 0, lights="power"
                )
        self.suite.lights.set()
        self.suite.sync()
        rows = []
        for tracer, contestant in wanted:
            rows.append({**self.against(sums, tracer, contestant, 0, 500), "lights": lights})
        return rows


def run(args, scene: str) -> list:
    """All rows of a scene, in this process."""
    suite = Suite(scene, args.lights, args.size)
    checks = Checks(suite, args)
    combinations = [(t, c, b) for t in args.tracers for c in args.contestants for b in args.bounces]
    rows = []

    def add(check, tracer, contestant, bounces, found):
        row = {"scene": scene, "check": check, "tracer": tracer, "contestant": contestant, "bounces": bounces, **found}
        rows.append(row)
        print(text(row), flush=True)

    for check in ("z", "slope"):
        for combination in combinations if check in args.checks else ():
            if check == "slope" and combination[0] != args.tracers[0]:
                continue
            add(check, *combination, getattr(checks, check)(*combination))
    if "linear" in args.checks:
        for combination, found in zip(combinations, checks.linear(combinations)):
            add("linear", *combination, found)
    if "oracle" in args.checks:
        wanted = [(t, c) for t in args.tracers for c in args.contestants]
        for pair, found in zip(wanted, checks.oracle(wanted)):
            add("oracle", *pair, 0, found)
    return rows


def text(row: dict) -> str:
    """One line for people."""
    agreement = "p {p:.3f}, z {z:+.2f}, would see {seen:.1%}"
    what = {
        "z": agreement,
        "oracle": agreement + ", {lights} lights",
        "slope": "{slope:+.3f} ± {error:.3f}, of path {path:+.3f}",
        "linear": "off {off:.1e}, mean {mean:.6f}",
    }[row["check"]].format_map(row)
    where = f"{row['scene']:8} {row['check']:7} {row['contestant']:20} {row['tracer']:13} {row['bounces']} bounces"
    again = ", at the second asking" if row.get("again") else ""
    again += ", its tile alone z {tile_z:+.2f}, would see {tile_seen:.1%}".format_map(row) if "tile_z" in row else ""
    return f"{where}  {_verdict(row)}  {what}{again}"


def _verdict(row: dict) -> str:
    return ("undecided" if row.get("undecided") else "" if row["holds"] else "FAILED").ljust(9)


def parsed(arguments=None):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", required=True, metavar="DIRECTORY")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--tracers", nargs="+", choices=TRACERS, default=list(TRACERS))
    parser.add_argument("--contestants", nargs="+", choices=CONTESTANTS + BIASED, default=list(CONTESTANTS))
    parser.add_argument("--bounces", nargs="+", type=int, default=[0, 4])
    parser.add_argument("--checks", nargs="+", choices=CHECKS, default=list(CHECKS))
    parser.add_argument("--runs", type=int, default=16)
    parser.add_argument("--samples", type=int, default=6)
    parser.add_argument("--size", default="64x36", metavar="WxH")
    parser.add_argument("--lights", type=int, default=24, metavar="N")
    parser.add_argument("--here", action="store_true", help="the one scene given, in this process")
    args = parser.parse_args(arguments)
    args.size = tuple(int(n) for n in args.size.split("x"))
    return args


def main() -> int:
    """A process a scene; rows as they come, and into files."""
    args = parsed()
    folder = Path(args.output)
    folder.mkdir(parents=True, exist_ok=True)
    if args.here:
        rows = run(args, args.scenes[0])
        (folder / f"{args.scenes[0]}.json").write_text(json.dumps(rows, indent=1))
        sys.stdout.flush()
        os._exit(0)  # bpy may hang or crash on its way out
    failed = undecided = 0
    for scene in args.scenes:
        started = time.perf_counter()
        command = [sys.executable, __file__, *_without_scenes(sys.argv[1:]), "--scenes", scene, "--here"]
        status = subprocess.run(command, check=False).returncode
        file = folder / f"{scene}.json"
        rows = json.loads(file.read_text()) if status == 0 else [{"holds": False}]
        failed += sum(not row["holds"] for row in rows)
        undecided += sum(row.get("undecided", False) for row in rows)
        print(f"{scene}: {len(rows)} rows, {time.perf_counter() - started:.0f} s", flush=True)
    left = f", {undecided} undecided" if undecided else ""
    print((f"{failed} do not hold" if failed else "all hold" if not undecided else "none fails") + left)
    return 1 if failed else 0


def _without_scenes(arguments: list) -> list:
    kept, skipping = [], False
    for argument in arguments:
        skipping = argument == "--scenes" or (skipping and not argument.startswith("-"))
        if not skipping:
            kept.append(argument)
    return kept


if __name__ == "__main__":
    sys.exit(main())
