# SPDX-License-Identifier: Apache-2.0
"""Per-tile test of whether two sets of independent renders have the same expectation.

For each tile and channel the tile means of the runs are compared by Welch's t-test (Welch 1947: unequal variances,
Satterthwaite's degrees of freedom). p-values are put on the scale of a standard normal, so that "|z| < 4" means the
same with 4 runs and with 400, and the family of all tiles is judged by Šidák's correction. The use of such a test as a
gate for renderers follows Subr and Arvo 2007 and Mitsuba 3's tests.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

# Tile means closer than this share of their size are the same number rounded differently, not a statistical matter.
ROUNDING = 1e-6


@dataclass(frozen=True)
class TileTest:
    """z: (rows, columns, C) signed normal scores of test minus reference; p_family: Šidák-corrected smallest p."""

    z: np.ndarray
    p_worst: float
    p_family: float
    worst_tile: tuple  # row (from the top), column, channel
    mean_test: np.ndarray
    mean_reference: np.ndarray

    @property
    def worst_z(self) -> float:
        return float(self.z[self.worst_tile])


def incomplete_beta(a: float, b: float, x: float) -> float:
    """Regularised incomplete beta function I_x(a, b), by its continued fraction (DLMF 8.17.22, modified Lentz)."""
    if x <= 0:
        return 0.0
    if x >= 1:
        return 1.0
    if x > (a + 1) / (a + b + 2):
        return 1.0 - incomplete_beta(b, a, 1.0 - x)
    # fraction = 1 / (1 + d1 / (1 + d2 / (1 + ...))), evaluated from the front
    tiny = 1e-300
    fraction, c, d = tiny, tiny, 0.0
    for j in range(500):
        m = j // 2
        if j == 0:
            term = 1.0
        elif j % 2:
            term = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        else:
            term = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        d = 1.0 + term * d
        d = 1.0 / (d if abs(d) > tiny else tiny)
        c = 1.0 + term / c
        c = c if abs(c) > tiny else tiny
        fraction *= c * d
        if abs(c * d - 1.0) < 1e-14:
            break
    log_front = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log1p(-x)
    return math.exp(log_front) / a * fraction


def student_two_sided(t: float, freedom: float) -> float:
    """P(|T| >= |t|) of Student's t distribution."""
    if math.isinf(t):
        return 0.0
    return incomplete_beta(freedom / 2, 0.5, freedom / (freedom + t * t))


def normal_score(p: float, sign: float) -> float:
    """The standard normal value whose two-sided p-value is `p`, with the given sign; ±38 stands for p = 0."""
    if p >= 1:
        return 0.0
    return math.copysign(-NormalDist().inv_cdf(p / 2) if p > 1e-300 else 38.0, sign)


def tile_means(image, tiles: int) -> np.ndarray:
    """Means (rows, columns, C) of an image (H, W, C) over a grid of at most tiles × tiles nearly equal tiles."""
    image = np.asarray(image, np.float64)
    height, width, channels = image.shape
    rows = np.linspace(0, height, min(tiles, height) + 1).round().astype(int)
    columns = np.linspace(0, width, min(tiles, width) + 1).round().astype(int)
    sums = np.add.reduceat(np.add.reduceat(image, rows[:-1], axis=0), columns[:-1], axis=1)
    return sums / (np.diff(rows)[:, None, None] * np.diff(columns)[None, :, None])


def welch(test, reference):
    """t and degrees of freedom of samples along axis 0 of two arrays. One side may hold a single exact sample."""
    n, m = len(test), len(reference)
    difference = test.mean(axis=0) - reference.mean(axis=0)
    variance_n = test.var(axis=0, ddof=1) / n if n > 1 else np.zeros_like(difference)
    variance_m = reference.var(axis=0, ddof=1) / m if m > 1 else np.zeros_like(difference)
    variance = variance_n + variance_m
    same = np.abs(difference) <= ROUNDING * np.maximum(np.abs(test).max(axis=0), np.abs(reference).max(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(same, 0.0, difference / np.sqrt(variance))
        denominator = np.square(variance_n) / max(n - 1, 1) + np.square(variance_m) / max(m - 1, 1)
        freedom = np.where(denominator > 0, np.square(variance) / denominator, n + m - 2)
    return t, np.maximum(freedom, 1.0)


def tile_test(test_runs, reference_runs, tiles: int = 16) -> TileTest:
    """Tests two lists of (H, W, C) images for equal expectation in each tile and channel.

    Raises ValueError when shapes differ, a run has values that are not finite, or both sides have only one run. A side
    with one run is taken as exact (a converged reference).
    """
    shapes = {np.shape(image) for image in [*test_runs, *reference_runs]}
    if len(shapes) != 1:
        raise ValueError(f"shapes differ: {', '.join(map(str, sorted(shapes)))}")
    if not test_runs or not reference_runs or len(test_runs) + len(reference_runs) < 3:
        raise ValueError("the tile test needs two or more independent runs on at least one side")
    if tiles < 1:
        raise ValueError("the tile test needs at least one tile")
    test = np.stack([tile_means(image, tiles) for image in test_runs])
    reference = np.stack([tile_means(image, tiles) for image in reference_runs])
    if not (np.isfinite(test).all() and np.isfinite(reference).all()):
        raise ValueError("a run has pixels that are not finite")
    t, freedom = welch(test, reference)
    p = np.vectorize(student_two_sided, otypes=[float])(t, freedom)
    z = np.vectorize(normal_score, otypes=[float])(p, np.where(t == 0, 1.0, t))
    worst = tuple(int(i) for i in np.unravel_index(np.argmin(p), p.shape))
    p_worst = float(p[worst])
    p_family = -math.expm1(p.size * math.log1p(-p_worst)) if p_worst < 1 else 1.0
    return TileTest(z, p_worst, p_family, worst, test.mean(axis=0), reference.mean(axis=0))
