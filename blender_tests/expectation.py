# SPDX-License-Identifier: Apache-2.0
"""Whether renders have the expectation of others, and whether their error falls as that of independent samples: what
the tests of every unbiased integrator ask."""

from dataclasses import dataclass

import numpy as np

from headwater.tile_test import tile_means, tile_test


@dataclass(frozen=True)
class Agreement:
    """p: of the tile most apart, after multiplicity; z: of the picture's mean; worst: (row, column, channel) and z of
    that tile; seen: four standard errors of the difference of means, as a share of the mean: what would be noticed."""

    p: float
    z: float
    worst: tuple
    seen: float

    @property
    def holds(self) -> bool:
        return self.p > 1e-3 and abs(self.z) < 4


def agreement(runs, truth, tiles: int = 6, dark: float = 0.0) -> Agreement:
    """Two sets of independent pictures (H, W, 3), tile by tile and as a whole. ValueError as tile_test.

    dark: tiles with less than this share of the picture's mean count for the whole alone. Where all light that there is
    comes by one sample in ten thousand, runs that have not met it have no spread to judge by."""
    ours, theirs = (np.stack([tile_means(picture, tiles) for picture in pictures]) for pictures in (runs, truth))
    lit = theirs.mean(0) >= dark * theirs.mean()
    result = tile_test(list(ours * lit), list(theirs * lit), tiles)
    means, expected = (np.array([np.mean(picture) for picture in pictures]) for pictures in (runs, truth))
    error = np.hypot(means.std(ddof=1) / len(runs) ** 0.5, expected.std(ddof=1) / len(truth) ** 0.5)
    apart = means.mean() - expected.mean()
    z = apart / error if error > 0 else 0.0 if apart == 0 else np.inf
    seen = 4 * error / expected.mean() if expected.mean() > 0 else np.inf
    return Agreement(float(result.p_family), float(z), (*result.worst_tile, result.worst_z), float(seen))


def assert_same_light(runs, truth, percent: float, tiles: int = 6) -> None:
    """The runs' mean is the truth's, tile by tile and as a whole, as far as four standard errors tell, which must be no
    more than `percent` of it."""
    found = agreement(runs, truth, tiles)
    assert found.holds, found
    assert found.seen < percent / 100, f"the test would not see a bias: {found}"


def variance(pictures) -> float:
    """Of independent pictures, the mean over pixels and channels."""
    return float(np.var(pictures, axis=0, ddof=1).mean())


def slope(counts, pictures, tiles: int = 6) -> tuple[float, float]:
    """Slope of the logarithm of variance over that of `counts`, and its standard error by leaving out one run after the
    other. pictures: for each count, as many independent runs. The mean over tiles of the logarithms is what falls: no
    firefly decides it."""
    log_n = np.log(np.asarray(counts, float))
    log_n -= log_n.mean()
    means = [np.stack([_tiles(picture, tiles) for picture in runs]) for runs in pictures]

    def fitted(keep):
        logs = [np.log(np.maximum(m[keep].var(axis=0, ddof=1), 1e-30)).mean() for m in means]
        return float((log_n * logs).sum() / (log_n**2).sum())

    n = min(map(len, means))
    left_out = np.array([fitted(np.arange(n) != i) for i in range(n)])
    return fitted(np.arange(n)), float(np.sqrt((n - 1) / n * ((left_out - left_out.mean()) ** 2).sum()))


def _tiles(picture, tiles):
    """Mean over the channels of each tile."""
    return tile_means(picture, tiles).mean(-1).ravel()
