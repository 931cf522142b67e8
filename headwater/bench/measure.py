# SPDX-License-Identifier: Apache-2.0
"""The measurement of one .blend: references, then renders of growing sample counts by every contestant in turn."""

import os
from dataclasses import dataclass, field

import numpy as np

from headwater.bench import reference
from headwater.bench.curves import beyond, comparison, median_curve
from headwater.bench.engines import Engines, Stopped
from headwater.errors import UserError
from headwater.metrics import error_metrics

GROWTH = 2  # of sample counts from one render to the next
WITH_SYNC, SAMPLING, CPU = "seconds", "sampling_seconds", "cpu_seconds"  # ways in which time counts


@dataclass
class Point:
    """One picture: what it cost and how far it is off."""

    samples: int
    seconds: float  # of everything: sync, build, sampling
    sampling_seconds: float
    sync_build_seconds: float
    cpu_seconds: float  # of all threads and everything
    errors: dict  # metrics.error_metrics
    lead: list = field(default_factory=list)  # frames before it: [frame, seconds, those of sync and build]


@dataclass
class Measured:
    """What was found of a file, as far as it came. `points`: contestant -> seed -> frame index -> points by samples."""

    file: str
    frames: list
    contestants: list
    points: dict = field(default_factory=dict)
    pictures: dict = field(default_factory=dict)  # (contestant, samples) -> pixels of the first seed's last frame
    references: dict = field(default_factory=dict)  # engine -> Reference; "together" where both were made
    disagreement: list = field(default_factory=list)
    failures: dict = field(default_factory=dict)  # contestant's or engine's name -> reason
    blender: str = ""
    stopped: bool = False

    def curves(self, name: str, time: str, frame: int = -1) -> list:
        """(seconds, trimmed relMSE) curves of a contestant, one a seed. time: WITH_SYNC, SAMPLING or CPU."""
        found = []
        for frames in self.points.get(name, {}).values():
            points = frames[frame] if frames else []
            found.append([(getattr(p, time), p.errors["relmse_trimmed"]) for p in points])
        return [[(t, e) for t, e in curve if t > 0 and e > 0] for curve in found]

    def median(self, name: str, time: str, frame: int = -1) -> list:
        """The median curve over seeds."""
        return median_curve([curve for curve in self.curves(name, time, frame) if curve])

    def median_points(self, name: str, time: str, frame: int = -1) -> list:
        """(seconds, error, samples): medians over seeds by samples."""
        by_samples = {}
        for frames in self.points.get(name, {}).values():
            for p in frames[frame] if frames else []:
                by_samples.setdefault(p.samples, []).append((getattr(p, time), p.errors["relmse_trimmed"]))
        return [
            (*(float(np.median(v)) for v in zip(*found, strict=True)), n) for n, found in sorted(by_samples.items())
        ]

    def bars(self, name: str, frame: int = -1) -> list:
        """Of each sample count over seeds: samples, median seconds, and the median, least and largest error."""
        rows = []
        for seconds, error, samples in self.median_points(name, WITH_SYNC, frame):
            all_ = [
                p.errors["relmse_trimmed"]
                for frames in self.points[name].values()
                for p in frames[frame]
                if p.samples == samples
            ]
            facts = {"samples": samples, "seconds": seconds, "error": error, "seeds": len(all_)}
            rows.append(facts | {"least": min(all_), "largest": max(all_)})
        return rows

    def beyond(self, name: str, other: str, time: str, frame: int = -1):
        """beyond() of two contestants' medians."""
        return beyond(self.median_points(name, time, frame), self.median_points(other, time, frame))

    def against(self, name: str, other: str, time: str, frame: int = -1) -> dict | None:
        """comparison() of two contestants."""
        return comparison(self.curves(name, time, frame), self.curves(other, time, frame))


def measure(file: str, args, contestants: list, references: list, progress) -> Measured:
    """Measures a file. Ctrl-C ends it with what there is; a contestant that fails is left out from then on.

    contestants: all of them, the one they are compared with too. references: who makes the references.
    UserError when no reference could be made.
    """
    found = Measured(file, [], contestants)
    with Engines(file, args, args.frames, progress) as engines:
        try:
            _make_references(found, engines, args, references, progress)
            _race(found, engines, args, progress)
        except Stopped:
            found.stopped = True
        found.blender = engines.blender
    return found


def _make_references(found, engines, args, makers, progress) -> None:
    folder = os.path.join(args.output, "references")
    for maker in makers:
        label = f"reference by {maker.engine}"
        try:
            key = reference.content_key(found.file, args, args.frames, maker, args.reference_time)
            made = reference.make(engines, maker, args.reference_time, folder, key, label)
        except UserError as error:
            found.failures[label] = str(error)
            progress.warn(str(error))
            continue
        found.references[maker.engine] = made
        own = float(made.error.mean())
        progress.note(f"{label}: {made.samples} samples, {made.seconds:.1f} s, its own trimmed relMSE {own:.3g}")
    if not found.references:
        raise UserError(next(iter(found.failures.values())))
    if len(found.references) == 2:
        both, found.disagreement = reference.agree(found.references["headwater"], found.references["cycles"])
        found.references["together"] = both
        for facts in found.disagreement:
            progress.note(disagreement_line(facts))
    count = len(next(iter(found.references.values())).pixels)
    found.frames = list(args.frames) if args.frames is not None else [None] * count


def disagreement_line(facts: dict) -> str:
    """How far the engines' references differ, in one sentence."""
    signed = facts["mean_signed_error_percent"]
    said = f"ours against Cycles': mean signed error {'n/a' if signed is None else f'{signed:+.2f} %'}, "
    said += f"trimmed relMSE {facts['relmse_trimmed']:.3g}, by noise alone {facts['expected']:.3g}"
    return said + (": the engines differ by more than noise" if systematic(facts) else "")


def systematic(facts: dict) -> bool:
    """Whether noise does not explain the references' difference."""
    return facts["relmse_trimmed"] > 2 * facts["expected"]


def chosen_reference(found: Measured, choice: str, engine: str):
    """What pictures of an engine are measured against. choice: "together", "headwater", "cycles" or "own"."""
    wanted = engine if choice == "own" else choice
    return found.references.get(wanted) or next(iter(found.references.values()))


def _race(found: Measured, engines, args, progress) -> None:
    """Seed by seed, counts of samples from 1 on, the contestants taking turns at leading. A contestant's largest count
    is the last whose sampling took at most args.time with the first seed; other seeds have the same counts."""
    counts = {c.text: [1] for c in found.contestants}
    for seed in range(1, args.seeds + 1):
        step = 0
        engines.part = (seed - 1) / args.seeds
        while True:
            active = [c for c in found.contestants if step < len(counts[c.text]) and c.text not in found.failures]
            if not active:
                break
            turn = (seed + step) % len(active)
            for contestant in active[turn:] + active[:turn]:
                samples = counts[contestant.text][step]
                label = f"{contestant.text}, seed {seed}/{args.seeds}, {samples} samples"
                try:
                    pictures, costs = engines.render(contestant, seed, samples, label)
                except UserError as error:
                    found.failures[contestant.text] = str(error)
                    progress.warn(str(error))
                    continue
                _keep(found, args, contestant, seed, samples, pictures, costs)
                longest = max(cost[WITH_SYNC] for cost in costs)
                progress.note(f"{label}: {longest:.2f} s, error {_last(found, contestant, seed):.4g}")
                sampling = max(cost[SAMPLING] for cost in costs)
                if seed == 1 and GROWTH * sampling <= args.time and samples < 1 << 24:
                    counts[contestant.text].append(samples * GROWTH)
            step += 1


def _keep(found, args, contestant, seed, samples, pictures, costs) -> None:
    by_frame = found.points.setdefault(contestant.text, {}).setdefault(seed, [[] for _ in costs])
    target = chosen_reference(found, args.reference, contestant.engine)
    for points, picture, cost, expected in zip(by_frame, pictures, costs, target.pixels, strict=True):
        try:
            errors = error_metrics(picture, expected)
        except ValueError as error:
            raise UserError(f"'{os.path.basename(found.file)}' by {contestant.text}: {error}") from error
        times = {name: cost[name] for name in (WITH_SYNC, SAMPLING, "sync_build_seconds", CPU)}
        points.append(Point(samples, errors=errors, lead=cost.get("lead", []), **times))
    if seed == 1:
        found.pictures[contestant.text, samples] = np.asarray(pictures[-1], np.float32)


def _last(found, contestant, seed) -> float:
    return found.points[contestant.text][seed][-1][-1].errors["relmse_trimmed"]
