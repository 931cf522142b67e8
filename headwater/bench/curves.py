# SPDX-License-Identifier: Apache-2.0
"""Error against time: medians over seeds, the time at which a curve reaches an error, and ratios of such times.

A curve is a list of (seconds, error), both above 0. Between its points both are interpolated in their logarithms, since
error falls as a power of time.
"""

import math
import statistics
from dataclasses import dataclass


@dataclass(frozen=True)
class Reached:
    """When a curve reaches an error. `bound`: "" where it does; "most": its first point is already below, so that the
    time is at most this; "least": its last point is still above."""

    seconds: float
    bound: str = ""


def time_to_error(curve, error: float) -> Reached:
    """The first time at which the curve is at or below `error`. ValueError for an empty curve."""
    points = sorted(curve)
    if not points:
        raise ValueError("an empty curve")
    if points[0][1] <= error:
        return Reached(points[0][0], "" if points[0][1] == error else "most")
    for (t0, e0), (t1, e1) in zip(points, points[1:], strict=False):
        if e1 <= error:
            part = (math.log(e0) - math.log(error)) / (math.log(e0) - math.log(e1))
            return Reached(math.exp(math.log(t0) + part * (math.log(t1) - math.log(t0))))
    return Reached(points[-1][0], "least")


@dataclass(frozen=True)
class Speedup:
    """How many times sooner one curve is at an error than another. `bound`: "" measured, "least": at least this,
    "most": at most this, "none": nothing can be said."""

    ratio: float
    bound: str = ""


def speedup(ours, theirs, error: float) -> Speedup:
    """`theirs`' time to the error over `ours`'."""
    a, b = time_to_error(ours, error), time_to_error(theirs, error)
    # ours at most a makes the ratio at least; theirs at least b does so too
    says = {("", ""): "", ("most", ""): "least", ("", "least"): "least", ("most", "least"): "least"}
    says |= {("least", ""): "most", ("", "most"): "most", ("least", "most"): "most"}
    return Speedup(b.seconds / a.seconds, says.get((a.bound, b.bound), "none"))


def median_curve(curves: list) -> list:
    """Point by point medians of curves of the same sample counts, as far as the shortest goes."""
    count = min(map(len, curves), default=0)
    return [tuple(statistics.median(curve[i][axis] for curve in curves) for axis in (0, 1)) for i in range(count)]


def common_error(ours: list, theirs: list) -> float:
    """The smallest error that two median curves both reach; where the one begins below the other's end, the geometric
    mean of that gap's ends, so that both times are bounds."""
    low_a, low_b = min(e for _, e in ours), min(e for _, e in theirs)
    high_a, high_b = max(e for _, e in ours), max(e for _, e in theirs)
    target = max(low_a, low_b)
    if target > min(high_a, high_b):
        return math.sqrt(target * min(high_a, high_b))
    return target


def comparison(ours: list, theirs: list) -> dict | None:
    """Speedup of curves `ours` over `theirs`, each a list with one curve a seed, paired by seed: at the smallest error
    both medians reach. None where a side has no points. `ratio`: median of the seeds'; `bound`: of the medians.

    {"error", "seconds": (ours, theirs) of the medians, "ratio", "bound", "ratios": one a seed, "spread": (least, most)}
    """
    ours, theirs = [c for c in ours if c], [c for c in theirs if c]
    if not ours or not theirs:
        return None
    a, b = median_curve(ours), median_curve(theirs)
    error = common_error(a, b)
    if not error > 0:
        return None
    by_seed = [speedup(x, y, error) for x, y in zip(ours, theirs, strict=False)]
    ratios = [each.ratio for each in by_seed]
    return {
        "error": error,
        "seconds": [time_to_error(a, error).seconds, time_to_error(b, error).seconds],
        "ratio": statistics.median(ratios),
        "bound": speedup(a, b, error).bound,
        "ratios": ratios,
        "bounds": [each.bound for each in by_seed],
        "spread": [min(ratios), max(ratios)],
    }


@dataclass(frozen=True)
class Beyond:
    """What a line, not a render, says of an error of ours below all that the other was rendered to: the other's curve
    carried on from its last point as that of independent samples, error by 1 / samples, at what its last samples cost.
    `past`: how many times its last render that is."""

    error: float
    seconds: tuple  # ours, theirs
    past: float

    @property
    def ratio(self) -> float:
        return self.seconds[1] / self.seconds[0]


def beyond(ours: list, theirs: list) -> Beyond | None:
    """At the last point of ours; points are (seconds, error, samples) of growing samples. None where the other was
    rendered as far, or to so few points that nothing says what a sample costs it."""
    if not ours or len(theirs) < 2:
        return None
    seconds, error, _ = ours[-1]
    (t0, _, n0), (t1, last, n1) = theirs[-2:]
    if not 0 < error < last or not n1 > n0 or not t1 > t0:
        return None
    past = last / error
    return Beyond(error, (seconds, t1 + (past - 1) * n1 * (t1 - t0) / (n1 - n0)), past)


def shown_beyond(found: Beyond | None) -> str:
    """As tables show it: "~43x at 0.0366 (cycles 21.8 times past its last render)" without the name."""
    return "" if found is None else f"~{found.ratio:.3g}x at {found.error:.3g}, {found.past:.3g} times past its last"


def shown(found: dict | None) -> str:
    """A comparison as tables show it: "12.3x (10.1 to 14.0)", "> 50x" where it is a bound."""
    if found is None or found["bound"] == "none":
        return "n/a"
    sign = {"": "", "least": "> ", "most": "< "}[found["bound"]]
    low, high = found["spread"]
    spread = f" ({low:.3g} to {high:.3g})" if len(found["ratios"]) > 1 else ""
    return f"{sign}{found['ratio']:.3g}x{spread}"
