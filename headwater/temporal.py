# SPDX-License-Identifier: Apache-2.0
"""Pictures of a view carried on to the next one: arrays in, arrays out, no Blender data, no core.

A picture of few samples is averaged with the last one, moved to where its surfaces are now (the Vector pass). How many
samples a pixel of the last picture counts as is bounded, none where another surface was seen (depth and albedo), and
less where the two pictures differ by more than their noise: there light has changed, and what was seen before would be
a ghost.
The difference is judged over a small neighbourhood against the noise of that very difference, so that texture and
gradients, which both pictures have, do not count. With more samples of its own a picture needs the last one less, and
when it has all it is to have, at the latest `ALONE`, not at all: it ends as what it would be without.

Follows the idea of Schied et al. 2017, "Spatiotemporal Variance-Guided Filtering" (reprojection, disocclusion) with a
test of significance in place of its colour clamp (Yang et al. 2020, "A Survey of Temporal Antialiasing Techniques").
"""

from dataclasses import dataclass

import numpy as np

GUIDES = ("Vector", "Denoising Depth", "Denoising Albedo")  # passes that a picture needs beside its colour
MOST = 32.0  # samples that the past counts as, at most
ALONE = 128  # samples from which on a picture has no past
DEPTH_SLACK = 0.02  # of the depth, beyond what a pixel's neighbours have, for one surface in two frames
ALBEDO_SLACK = 0.1  # the same of the albedo
REACH = 3  # pixels to each side of the neighbourhood in which light is compared
SURE = 2.0  # variances of the mean difference that are taken for noise
BRIGHTER = 2.0  # times the brightest of its neighbours: brighter pixels of the past are what light has left behind
STILL = 1e-3  # pixels of motion that are none


@dataclass(frozen=True)
class _Past:
    """A picture, and how many samples each of its pixels stands for."""

    values: np.ndarray  # (H, W, 4 + C): depth and albedo of what was seen, its colour, averaged alike
    count: np.ndarray  # (H, W)


def box_mean(values: np.ndarray, reach: int) -> np.ndarray:
    """The mean over (2 reach + 1)² pixels about each, (H, W); the picture ends at its border."""

    def along(a):
        sums = np.cumsum(a, axis=0, dtype=np.float64)
        padded = np.concatenate([np.zeros((1, a.shape[1])), sums])
        at = np.arange(len(a))
        low, high = np.maximum(at - reach, 0), np.minimum(at + reach + 1, len(a))
        return (padded[high] - padded[low]) / (high - low)[:, None]

    return along(along(values).T).T.astype(np.float32)


def _luminance(color: np.ndarray) -> np.ndarray:
    return color[..., :3] @ np.array((0.2126729, 0.7151522, 0.0721750), np.float32)


def spread_over(values: np.ndarray, most: bool) -> np.ndarray:
    """The most, or the least, of each pixel and its eight neighbours; values: (H, W) or (H, W, C)."""
    choose = np.maximum if most else np.minimum
    for axis in (0, 1):
        found = values.copy()
        inner, outer = np.moveaxis(values, axis, 0), np.moveaxis(found, axis, 0)
        choose(outer[1:], inner[:-1], out=outer[1:])
        choose(outer[:-1], inner[1:], out=outer[:-1])
        values = found
    return values


def surface_range(surface: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and most (H, W, 4) that depth and albedo of a pixel's surface may have been, by its and its neighbours'."""
    low, high = spread_over(surface, False), spread_over(surface, True)
    slack = np.full_like(surface, ALBEDO_SLACK)
    slack[..., 0] = DEPTH_SLACK * high[..., 0]
    return low - slack, high + slack


def reproject(past: _Past, vector: np.ndarray, surface: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The past's values (H, W, 4 + C) and counts (H, W) where pixels come from: bilinear, over taps of one surface.

    vector: (H, W, 2), pixels from where a pixel's surface is to where it was; surface: (H, W, 4), its depth and albedo.
    Counts are 0 where it was not seen.
    """
    height, width = past.count.shape
    low, high = surface_range(surface)
    values, count = past.values.copy(), past.count.copy()
    same = ((values[..., :4] >= low) & (values[..., :4] <= high)).all(-1) & (surface[..., 0] > 0)  # 0: nothing was hit
    count[~same] = 0
    rows, columns = np.nonzero(np.abs(vector).max(-1) >= STILL)
    count[rows, columns] = 0
    x, y = columns + vector[rows, columns, 0], rows + vector[rows, columns, 1]
    seen = (x > -0.5) & (x < width - 0.5) & (y > -0.5) & (y < height - 0.5)
    rows, columns, x, y = rows[seen], columns[seen], x[seen], y[seen]
    x0, y0 = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = (x - x0).astype(np.float32), (y - y0).astype(np.float32)
    low, high = low[rows, columns], high[rows, columns]
    total = np.zeros(len(rows), np.float32)
    sums = np.zeros((len(rows), values.shape[2]), np.float32)
    counts = np.zeros(len(rows), np.float32)
    for dx, dy, weight in ((0, 0, (1 - fx) * (1 - fy)), (1, 0, fx * (1 - fy)), (0, 1, (1 - fx) * fy), (1, 1, fx * fy)):
        tx, ty = np.clip(x0 + dx, 0, width - 1), np.clip(y0 + dy, 0, height - 1)
        there = past.values[ty, tx]
        same = ((there[:, :4] >= low) & (there[:, :4] <= high)).all(-1)
        weight = np.where(same, weight, 0)
        total += weight
        sums += weight[:, None] * there
        counts += weight * past.count[ty, tx]
    known = total > 1e-3
    scale = np.where(known, 1 / np.maximum(total, 1e-3), 0)
    values[rows, columns] = sums * scale[:, None]
    count[rows, columns] = counts * scale
    return values, count


def trusted(now: np.ndarray, samples: int, past: np.ndarray, count: np.ndarray) -> np.ndarray:
    """How many samples (H, W) the past still counts as, given what the picture of `samples` samples says of it.

    now, past: (H, W, C). Where light has changed by c beyond doubt, n past samples of variance v are worth
    v / (v / n + c²).
    """
    most = BRIGHTER * spread_over(spread_over(now[..., :3], True), True)
    count = count * np.minimum(most / np.maximum(past[..., :3], 1e-12), 1).min(-1) ** 2
    bright, before = _luminance(now), _luminance(past)
    known = count > 0
    each = np.where(known, 1 / samples + 1 / np.maximum(count, 1e-3), 0)  # variance of the difference, in a sample's
    difference = np.where(known, bright - before, 0)
    share = np.maximum(box_mean(known.astype(np.float32), REACH), 1e-6)
    mean = box_mean(difference, REACH) / share
    spread = np.maximum(box_mean(difference * difference, REACH) / share - mean * mean, 0)
    pixels = share * (2 * REACH + 1) ** 2
    change = np.maximum(mean * mean - SURE * spread / np.maximum(pixels - 1, 1), 0)
    variance = spread / np.maximum(box_mean(each, REACH) / share, 1e-6)
    return np.where(known, count / (1 + count * change / np.maximum(variance, 1e-12)), 0)


class History:
    """The past of one view. `advance` when another picture begins, `blend` for each look at it."""

    def __init__(self):
        self._past: _Past | None = None
        self._moved: tuple[np.ndarray, np.ndarray] | None = None  # the past at this picture's pixels
        self._latest: _Past | None = None

    def advance(self) -> None:
        """Another picture begins: the newest one is the past now. Without one, there is no past."""
        self._past, self._latest, self._moved = self._latest, None, None

    def clear(self) -> None:
        """Another picture begins that has nothing in common with the last."""
        self._past = self._latest = self._moved = None

    def blend(self, color, samples: int, vector, depth, albedo, alone: int = ALONE) -> np.ndarray:
        """The picture (H, W, C) float32, averaged with the past. A new array, or `color` itself where there is no past.

        samples: of each of its pixels, of which it is to have `alone` in all; then the passes GUIDES: (H, W, 4),
        (H, W, 1), (H, W, 3). Pictures of another size have no past in common.
        """
        values = np.concatenate([depth, albedo, color], axis=2)
        past, fade = self._past, 1 - samples / min(alone, ALONE)
        if past is None or past.values.shape != values.shape or fade <= 0:
            self._latest = _Past(values, np.full(depth.shape[:2], min(samples, MOST), np.float32))
            return color
        if self._moved is None:
            self._moved = reproject(past, vector[..., :2], values[..., :4])
        before, count = self._moved
        count = trusted(color, samples, before[..., 4:], count) * np.float32(fade)
        values += (count / (count + samples))[..., None] * (before - values)
        self._latest = _Past(values, np.minimum(count + samples, np.float32(MOST)))
        return values[..., 4:]
