# SPDX-License-Identifier: Apache-2.0
"""Measures of the artefacts that the paper's figures show, from a picture, its reference and the surfaces' places.

Pictures are (H, W, 3) float, linear, top row first; places (H, W, 3) in metres, world space; lit (H, W) says which
pixels count: those that show surfaces only. Where a lamp's edge crosses a pixel, few samples err by how often they hit
the lamp, whatever chooses the lights; that would hide what the figures are about. The error of a pixel here is
e = mean over channels of (t − r) / sqrt(r² + ε): relMSE's error with its sign.
"""

import numpy as np

from headwater.metrics import EPSILON, TRIM

BLOCK = 4  # pixels
OUTLIERS = 0.995  # quantile of |e| at which errors are cut: one firefly must not decide a correlation


def signed_error(test, reference) -> np.ndarray:
    """e, (H, W); 0 where a pixel is not finite."""
    test, reference = np.asarray(test, float), np.asarray(reference, float)
    with np.errstate(invalid="ignore", over="ignore"):
        error = ((test - reference) / np.sqrt(np.square(reference) + EPSILON)).mean(axis=2)
    return np.where(np.isfinite(error), error, 0.0)


def _cut(error, lit):
    limit = np.quantile(np.abs(error[lit]), OUTLIERS) if lit.any() else 0.0
    return np.clip(error, -limit, limit)


def neighbour_correlation(error, lit) -> float:
    """Correlation of e between lit pixels side by side: 0 when pixels are independent, 1 when neighbours err alike.

    The quantisation measure: pixels that are shaded from one reservoir share its error. 0 where e does not vary.
    """
    if not lit.any():
        return 0.0
    error = _cut(error, lit)
    error = np.where(lit, error - error[lit].mean(), 0.0)
    variance = np.mean(np.square(error[lit]))
    pairs = neighbour_pairs(lit)
    if variance <= 0 or not pairs:
        return 0.0
    products = (error[:, 1:] * error[:, :-1]).sum() + (error[1:] * error[:-1]).sum()
    return float(products / pairs / variance)


def neighbour_pairs(lit) -> int:
    """How many pairs of lit pixels side by side there are."""
    return int((lit[:, 1:] & lit[:, :-1]).sum() + (lit[1:] & lit[:-1]).sum())


def block_share(error, lit) -> float:
    """Share of e's variance that the pixels of a block of BLOCK² have in common (intraclass correlation); 0 for
    independent pixels, whose block means vary with 1 / BLOCK² of their variance. Of blocks that are all lit."""
    height, width = (n // BLOCK * BLOCK for n in error.shape)
    shape = (height // BLOCK, BLOCK, width // BLOCK, BLOCK)
    whole = lit[:height, :width].reshape(shape).all(axis=(1, 3))
    if whole.sum() < 2:
        return 0.0
    blocks = _cut(error, lit)[:height, :width].reshape(shape).swapaxes(1, 2)[whole]  # (blocks, BLOCK, BLOCK)
    variance = blocks.var()
    if variance <= 0:
        return 0.0
    count = BLOCK * BLOCK
    return float((blocks.mean(axis=(1, 2)).var() * count / variance - 1) / (count - 1))


def black_share(test, lit) -> float:
    """Share of the lit pixels that are exactly black in the picture."""
    return float((np.asarray(test)[lit] == 0).all(axis=1).mean()) if lit.any() else 0.0


def signed_percent(test, reference, lit) -> float | None:
    """Mean of t − r over lit pixels, in percent of the reference's mean there; None where that is not above 0."""
    if not lit.any():
        return None
    mean = float(np.asarray(reference, float)[lit].mean())
    return 100 * float((np.asarray(test, float)[lit] - reference[lit]).mean()) / mean if mean > 0 else None


def trimmed(squares) -> float | None:
    """Mean of per-pixel squared errors without the worst TRIM of them; None for no pixels."""
    squares = np.sort(np.ravel(squares))
    if not len(squares):
        return None
    return float(squares[: max(1, len(squares) - int(round(TRIM * len(squares))))].mean())


def squared_error(test, reference) -> np.ndarray:
    """Per-pixel relative squared error (H, W), mean over channels: relMSE before its mean."""
    test, reference = np.asarray(test, float), np.asarray(reference, float)
    return (np.square(test - reference) / (np.square(reference) + EPSILON)).mean(axis=2)


def reference_error(first, second, lit) -> dict:
    """Error of the mean of two independent pictures of equal samples, from their difference d: its variance is
    E[d²] / 4. "relmse" and "relmse_trimmed" of all pixels, "lit_relmse_trimmed" of the lit ones (None: there are none).
    """
    mean = (np.asarray(first, float) + second) / 2
    squares = (np.square(np.asarray(first, float) - second) / 4 / (np.square(mean) + EPSILON)).mean(axis=2)
    return {
        "relmse": float(squares.mean()),
        "relmse_trimmed": trimmed(squares),
        "lit_relmse_trimmed": trimmed(squares[lit]),
    }


def cells(places, camera, grid, rides: bool, shift: float = 0.0) -> np.ndarray:
    """Cell (H, W, 3) of each surface, from 0 to resolution − 1 in the grid, else outside of it; as
    shaders/lib/world_grid.h has them: riding cells keep their place relative to the camera, others are multiples of
    their size in the world. shift: moves all cell edges, in cells."""
    size = 2 * grid.extent / grid.resolution
    camera = np.asarray(camera, float)
    if rides:
        origin = camera - grid.extent
    else:
        origin = (np.floor(camera / size + (0.5 if grid.resolution % 2 == 0 else 0)) - grid.resolution // 2) * size
    with np.errstate(invalid="ignore"):
        at = np.floor((places - origin) / size + shift)
    return np.nan_to_num(at, nan=-1.0, posinf=-1.0, neginf=-1.0).clip(-(2**30), 2**30).astype(np.int64)


def _inside(places, lit, camera, grid, rides):
    cell = cells(places, camera, grid, rides)
    return ((cell >= 0) & (cell < grid.resolution)).all(axis=2) & lit


def _pairs(pixels, axis):
    """Pixels and their neighbours along an axis."""
    return (pixels[:-1], pixels[1:]) if axis == 0 else (pixels[:, :-1], pixels[:, 1:])


def grid_measures(test, reference, places, lit, camera, grid, rides: bool = False) -> dict:
    """How error goes with the grid.

    inside_share: of the lit pixels, those in the grid; relmse_trimmed, signed_percent, bias_sigmas and black_share of
    those inside and beyond. edge_jump: mean squared difference of e between neighbours on two sides of a cell's edge,
    over the same at edges moved by half a cell, where nothing but the scene makes errors differ: 1 when cells don't
    show; None where fewer than 100 pairs tell.
    """
    inside = _inside(places, lit, camera, grid, rides)
    beyond = lit & ~inside
    squares, error = squared_error(test, reference), _cut(signed_error(test, reference), lit)
    out = {"inside_share": float(inside.sum() / max(lit.sum(), 1))}
    for name, mask in (("inside", inside), ("beyond", beyond)):
        out[f"relmse_trimmed_{name}"] = trimmed(squares[mask])
        out[f"signed_percent_{name}"] = signed_percent(test, reference, mask)
        out[f"bias_sigmas_{name}"] = bias_sigmas(test, reference, mask)
        out[f"black_share_{name}"] = black_share(test, mask)
    own, moved = (cells(places, camera, grid, rides, shift) for shift in (0.0, 0.5))
    jumps = {"own": [], "moved": []}
    for axis in (0, 1):
        both = np.logical_and(*_pairs(inside, axis))
        across = [np.not_equal(*_pairs(cell, axis)).any(axis=2) for cell in (own, moved)]
        difference = np.square(np.subtract(*_pairs(error, axis)))
        jumps["own"].append(difference[both & across[0] & ~across[1]])
        jumps["moved"].append(difference[both & across[1] & ~across[0]])
    found = {name: np.concatenate(values) for name, values in jumps.items()}
    usable = all(len(values) >= 100 for values in found.values()) and found["moved"].mean() > 0
    out["edge_jump"] = float(found["own"].mean() / found["moved"].mean()) if usable else None
    return out


def boundary(places, lit, camera, grid, rides: bool = False) -> np.ndarray:
    """(H, W) whether a pixel lies at the grid's boundary: inside it, with a neighbour beyond."""
    inside = _inside(places, lit, camera, grid, rides)
    beyond = lit & ~inside
    edge = np.zeros_like(inside)
    edge[:-1] |= inside[:-1] & beyond[1:]
    edge[1:] |= inside[1:] & beyond[:-1]
    edge[:, :-1] |= inside[:, :-1] & beyond[:, 1:]
    edge[:, 1:] |= inside[:, 1:] & beyond[:, :-1]
    return edge


def bias_sigmas(test, reference, lit, side: int = 16) -> float:
    """Mean of t − r over lit pixels in standard errors, from the spread of its means over blocks of side² pixels: those
    are nearly independent also where neighbouring pixels are not. What the bias itself varies makes it smaller, never
    larger."""
    error = np.where(lit, (np.asarray(test, float) - reference).mean(axis=2), 0.0)
    height, width = (max(n // side, 1) * min(n, side) for n in error.shape)
    rows, columns = height // min(error.shape[0], side), width // min(error.shape[1], side)
    means = error[:height, :width].reshape(rows, height // rows, columns, width // columns).mean(axis=(1, 3))
    spread = means.std(ddof=1) / np.sqrt(means.size) if means.size > 1 else 0.0
    return float(means.mean() / spread) if spread > 0 else 0.0
