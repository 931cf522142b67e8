# SPDX-License-Identifier: Apache-2.0
"""What the paper says with each figure, and whether our numbers say so too.

A claim's sentence is made of the measured numbers and its verdict follows from them: True, False, or None where a
picture is missing or the picture can't tell.
"""

from dataclasses import dataclass

VISIBLE = 0.05  # a neighbour correlation above this is seen as blotches or blocks rather than as grain
MINOR = 1.25  # an error ratio up to this is "minor"
SIGMAS = 4.0  # standard errors from which on a mean error is a bias, a difference is one
JUMP = 1.10  # a jump of squared errors at cell edges above this shows
NOISE = 0.02  # error ratios closer to 1 than this are not told apart


@dataclass(frozen=True)
class Verdict:
    """What the paper says, what is measured here, and whether they agree (None: can't be told)."""

    paper: str
    ours: str
    agrees: bool | None


def verdicts(figure, numbers: dict) -> list:
    """The figure's verdicts. numbers: variant name -> its measures (absent where its picture failed)."""
    return [_CLAIMS[figure.id][i](numbers) for i in range(len(_CLAIMS[figure.id]))]


def _missing(paper, numbers, *names):
    absent = [name for name in names if name not in numbers]
    return Verdict(paper, f"not measured: no picture of {', '.join(absent)}", None) if absent else None


def _error(numbers, name) -> float:
    return numbers[name]["lit_relmse_trimmed"] or 0.0


def _ratio(above: float, below: float) -> float:
    return above / below if below > 0 else float("inf")


def _cleaner(paper, better: str, worse: str, at_least=1 + NOISE, measure="lit_relmse_trimmed", where=" of surfaces"):
    """`better` has less error than `worse`, at least by a factor."""

    def check(numbers):
        if missing := _missing(paper, numbers, better, worse):
            return missing
        good, bad = (_measure(numbers[name], measure) for name in (better, worse))
        if good is None or bad is None:
            return Verdict(paper, f"can't be told: no pixels{where}", None)
        factor = _ratio(bad, good)
        ours = f"trimmed relMSE{where} {good:.3g} ({better}) against {bad:.3g} ({worse}): {_times(factor)}"
        return Verdict(paper, ours, factor >= at_least)

    return check


def _times(factor: float) -> str:
    return f"{factor:.2f} times less" if factor >= 1 else f"{_ratio(1, factor):.2f} times more"


def _measure(record, path):
    """A number at "key" or "key.key" of a record; None where it is missing."""
    for key in path.split("."):
        record = record.get(key) if isinstance(record, dict) else None
    return record


def _order(paper, expected: tuple):
    """Errors fall along `expected`."""

    def check(numbers):
        if missing := _missing(paper, numbers, *expected):
            return missing
        found = sorted(expected, key=lambda name: -_error(numbers, name))
        ours = "from most error to least: " + ", ".join(f"{name} {_error(numbers, name):.3g}" for name in found)
        return Verdict(paper, ours, tuple(found) == expected)

    return check


def _correlated(paper, name: str, against: str):
    """Errors of neighbours go together in `name`: visibly, and more than in `against`."""

    def check(numbers):
        if missing := _missing(paper, numbers, name, against):
            return missing
        mine, other = (numbers[n]["neighbour_correlation"] for n in (name, against))
        share = numbers[name]["block_share"]
        ours = (
            f"neighbouring pixels' errors correlate by {mine:.2f} ({name}) against {other:.2f} ({against}); "
            f"{100 * max(share, 0):.0f} % of {name}'s error variance is common to blocks of 4 x 4 pixels"
        )
        return Verdict(paper, ours, mine > VISIBLE and mine > other)

    return check


def _minor(paper, better: str, worse: str):
    """`better` improves on `worse`, a little."""

    def check(numbers):
        if missing := _missing(paper, numbers, better, worse):
            return missing
        factor = _ratio(_error(numbers, worse), _error(numbers, better))
        size = "an improvement, more than minor" if factor > MINOR else "a minor improvement"
        if factor < 1 + NOISE:
            size = "no difference to be told" if factor > 1 / (1 + NOISE) else "worse"
        numbers_said = f"{_error(numbers, better):.3g} against {_error(numbers, worse):.3g}"
        ours = f"trimmed relMSE of surfaces {numbers_said}: {_times(factor)}, {size}"
        return Verdict(paper, ours, 1 + NOISE <= factor <= MINOR)

    return check


def _biased(paper, name: str):
    """The picture carries a bias that noise does not explain."""

    def check(numbers):
        if missing := _missing(paper, numbers, name):
            return missing
        signed, sigmas = numbers[name]["lit_signed_percent"], numbers[name]["bias_sigmas"]
        if signed is None:
            return Verdict(paper, "can't be told: no pixels of surfaces", None)
        beyond = abs(sigmas) > SIGMAS
        ours = (
            f"{name}: mean signed error {signed:+.1f} % of the surfaces' mean, {sigmas:+.1f} standard errors from 0; "
        )
        ours += "noise does not explain it" if beyond else "noise may explain it"
        return Verdict(paper, ours, True if beyond else None)

    return check


def _boundary(paper, name: str):
    """Brightness is off by different amounts inside the grid and beyond, more than noise explains."""

    def check(numbers):
        if missing := _missing(paper, numbers, name):
            return missing
        grid = numbers[name].get("grid") or {}
        inside, beyond = (grid.get(f"signed_percent_{where}") for where in ("inside", "beyond"))
        if inside is None or beyond is None:
            return Verdict(paper, "can't be told: the boundary is not in the picture", None)
        spread = 0.0  # variance of the difference, from both sides' standard errors
        for where, signed in (("inside", inside), ("beyond", beyond)):
            sigmas = grid.get(f"bias_sigmas_{where}") or 0.0
            spread += (signed / sigmas) ** 2 if sigmas else 0.0
        apart = abs(inside - beyond) / spread**0.5 if spread > 0 else 0.0
        ours = (
            f"{name}: mean signed error {inside:+.1f} % inside the grid, {beyond:+.1f} % beyond, {apart:.1f} standard "
            f"errors apart; trimmed relMSE {grid['relmse_trimmed_inside']:.3g} inside, "
            f"{grid['relmse_trimmed_beyond']:.3g} beyond"
        )
        return Verdict(paper, ours, True if apart > SIGMAS else None)

    return check


def _edges(paper, name: str):
    """Error jumps between neighbouring pixels where they lie in different cells."""

    def check(numbers):
        if missing := _missing(paper, numbers, name):
            return missing
        jump = _measure(numbers[name], "grid.edge_jump")
        if jump is None:
            return Verdict(paper, "can't be told: too few pixels on both sides of cell edges", None)
        ours = (
            f"{name}: errors differ {jump:.2f} times as much (squared) across cell edges as across lines between them"
        )
        return Verdict(paper, ours, jump > JUMP)

    return check


def _shares_less(paper, less: str, more: str):
    """Neighbours' errors go together less in `less`: its pixels share fewer samples."""

    def check(numbers):
        if missing := _missing(paper, numbers, less, more):
            return missing
        low, high = (numbers[n]["neighbour_correlation"] for n in (less, more))
        # Of independent pixels a correlation varies by one over the root of the number of pairs.
        error = sum(1 / max(numbers[n]["neighbour_pairs"], 1) for n in (less, more)) ** 0.5
        ours = (
            f"neighbouring pixels' errors correlate by {low:.3f} ({less}) against {high:.3f} ({more}), "
            f"{(high - low) / error:+.1f} standard errors apart"
        )
        return Verdict(paper, ours, high - low > SIGMAS * error)

    return check


def _black(paper, name: str, against: str):
    def check(numbers):
        if missing := _missing(paper, numbers, name, against):
            return missing
        a, b = (numbers[n]["black_share"] for n in (name, against))
        return Verdict(
            paper, f"{100 * a:.1f} % of the lit pixels are black ({name}), {100 * b:.1f} % ({against})", a > b
        )

    return check


_CLAIMS = {
    "1": (
        _order(
            "noise falls from Monte Carlo to ReSTIR (section 4) to the k-d tree (figure 5)",
            ("path", "restir", "wssr-kd"),
        ),
        _cleaner("ReSTIR is cleaner than Monte Carlo", "restir", "path"),
        _cleaner("the k-d tree is cleaner than Monte Carlo", "wssr-kd", "path"),
        _cleaner("the grid is cleaner than Monte Carlo", "wssr-grid", "path"),
        _biased("the k-d tree carries some bias (section 6)", "wssr-kd"),
        _biased("the grid carries some bias (section 6)", "wssr-grid"),
    ),
    "3": (
        _cleaner("reuse gives a significant boost in sample efficiency (section 3)", "restir-on", "restir-off", MINOR),
    ),
    "4": (_minor("reprojection brings only marginal improvements to indirect light", "restir-reproject", "restir"),),
    "5": (
        _cleaner("the k-d tree gathers more significant samples than ReSTIR", "wssr-kd", "restir"),
        _correlated("the k-d tree suffers from quantisation", "wssr-kd", "path"),
        _correlated("its quantisation is more than ReSTIR's blotches", "wssr-kd", "restir"),
    ),
    "6": (
        _correlated("L = 1: high quantisation", "ascension-1", "ascension-10"),
        _cleaner("L = 10 is the best of both worlds: better than L = 1", "ascension-10", "ascension-1"),
        _cleaner("L = 10 is the best of both worlds: better than L = 100", "ascension-10", "ascension-100"),
        _shares_less(
            "L = 100: low resampling rate: neighbours share less than at L = 10", "ascension-100", "ascension-10"
        ),
    ),
    "7": (_cleaner("the grid is cleaner than Monte Carlo", "wssr-grid", "path"),),
    "8": (
        _cleaner("reprojection improves the picture", "wssr-grid-reproject", "wssr-grid"),
        _cleaner(
            "it does so beyond the grid",
            "wssr-grid-reproject",
            "wssr-grid",
            measure="grid.relmse_trimmed_beyond",
            where=" beyond the grid",
        ),
    ),
    "9a": (_correlated("the k-d tree yields visible quantisation", "ascension-1", "path"),),
    "9b": (
        _boundary("odd shading at the grid's boundary", "grid-rides"),
        _edges("aliasing at cell edges", "grid-rides"),
        _black("cells that hold no sample shade black (in the paper's code)", "grid-rides", "grid-stays"),
    ),
}
