# SPDX-License-Identifier: Apache-2.0
"""Image error metrics of a test image against a reference. Definitions: docs/manual/compare.md.

Images are float arrays of shape (H, W, C), scene-linear, the same row order on both sides. Pixels that are not finite
in both images are left out of every mean and counted on their own. Sums are in double precision.

relMSE follows the usual form of Rousselle, Knaus, Zwicker 2011 (adaptive sampling), FLIP is NVIDIA's reference
implementation: Andersson et al. 2020 for display images, 2021 for high dynamic range.
"""

from dataclasses import dataclass

import numpy as np

EPSILON = 0.01  # keeps dark pixels from taking over the relative metrics
TRIM = 0.001  # share of the worst pixels that the trimmed relMSE leaves out


@dataclass(frozen=True)
class NonFinite:
    """Counts of pixels with at least one NaN or infinite channel."""

    nan: int
    inf: int


def count_non_finite(image) -> NonFinite:
    """Pixels of `image` (H, W, C) with a NaN, and with an infinity."""
    return NonFinite(int(np.isnan(image).any(axis=2).sum()), int(np.isinf(image).any(axis=2).sum()))


def finite_pixels(test, reference):
    """Both images as (N, C) float64 arrays, with only the pixels that are finite in both."""
    test = np.asarray(test, np.float64).reshape(-1, np.shape(test)[-1])
    reference = np.asarray(reference, np.float64).reshape(-1, np.shape(reference)[-1])
    keep = np.isfinite(test).all(axis=1) & np.isfinite(reference).all(axis=1)
    return test[keep], reference[keep]


def relative_squared_error(test, reference, epsilon=EPSILON):
    """(t − r)² / (r² + ε), element by element."""
    return np.square(test - reference) / (np.square(reference) + epsilon)


def error_metrics(test, reference, epsilon=EPSILON, trim=TRIM) -> dict:
    """All closed-form metrics of (H, W, C) images as plain floats.

    Raises ValueError when shapes differ or no pixel is finite in both.
    """
    if np.shape(test) != np.shape(reference):
        raise ValueError(f"shapes differ: {np.shape(test)} and {np.shape(reference)}")
    t, r = finite_pixels(test, reference)
    if not len(t):
        raise ValueError("no pixel is finite in both images")
    difference = t - r
    relative = relative_squared_error(t, r, epsilon)
    per_pixel = np.sort(relative.mean(axis=1))
    kept = per_pixel[: max(1, len(per_pixel) - int(round(trim * len(per_pixel))))]
    reference_mean = float(r.mean())
    return {
        "relmse": float(relative.mean()),
        "relmse_trimmed": float(kept.mean()),
        "mape": float((np.abs(difference) / (np.abs(r) + epsilon)).mean()),
        "smape": float((2 * np.abs(difference) / (np.abs(t) + np.abs(r) + epsilon)).mean()),
        "mse": float(np.square(difference).mean()),
        "rmse": float(np.sqrt(np.square(difference).mean())),
        "mean_signed_error": float(difference.mean()),
        "mean_signed_error_percent": 100 * float(difference.mean()) / reference_mean if reference_mean else None,
        "max_absolute_error": float(np.abs(difference).max()),
        "mean_test": float(t.mean()),
        "mean_reference": reference_mean,
    }


def flip(test, reference, *, high_dynamic_range=True):
    """FLIP mean (0 = same, 1 = as different as can be) and its (H, W) map; None when flip-evaluator is not installed.

    `high_dynamic_range`: scene-linear images (HDR-FLIP), else linear values of a display image in 0..1 (LDR-FLIP).
    Non-finite and negative values, which FLIP does not define, are taken as 0. Images of fewer than three channels are
    shown as grey.
    """
    try:
        import flip_evaluator
    except ImportError:
        return None
    pair = []
    for image in (reference, test):
        image = np.nan_to_num(np.asarray(image, np.float32), nan=0.0, posinf=65504.0, neginf=0.0)
        image = image[..., :3] if image.shape[2] >= 3 else np.repeat(image[..., :1], 3, axis=2)
        pair.append(np.ascontiguousarray(np.clip(image, 0, None if high_dynamic_range else 1)))
    # An all-black reference leaves HDR-FLIP's exposure range undefined; it is then judged as a display image.
    if high_dynamic_range and not pair[0].any():
        high_dynamic_range = False
        pair = [np.clip(image, 0, 1) for image in pair]
    kind = "HDR" if high_dynamic_range else "LDR"
    error_map, mean, _ = flip_evaluator.evaluate(pair[0], pair[1], kind, inputsRGB=False, applyMagma=False)
    error_map = np.asarray(error_map)
    return float(mean), error_map[..., 0] if error_map.ndim == 3 else error_map
