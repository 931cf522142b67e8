# SPDX-License-Identifier: Apache-2.0
"""References: long renders by both engines, how far they disagree, and what the two say together.

Each is the mean of two halves with seeds of their own (far from those of the measured pictures), whose difference
tells its own error: a picture can't tell it, as where it missed what is rare it does not know so. They are kept in
DIR/references under a hash of the .blend's bytes and of all that changes them.
"""

import hashlib
import json
import os
from dataclasses import dataclass

import numpy as np

from headwater import __version__
from headwater.bench.contestants import Contestant
from headwater.metrics import error_metrics
from headwater.output import atomic_path

SEEDS = 1_000_003  # the first one; those of the measured pictures count from 1
PARTS = 4  # renders that a reference is the mean of, by turns of its halves


@dataclass(frozen=True)
class Reference:
    """One engine's pictures, (F, H, W, 3) float32, and the trimmed relMSE of their mean's own noise, by frame."""

    pixels: np.ndarray
    error: np.ndarray  # (F,)
    samples: int
    seconds: float


def content_key(file: str, args, frames, contestant: Contestant, seconds: float) -> str:
    """Hash of all that a reference depends on. Nothing of it names a folder."""
    digest = hashlib.sha256()
    with open(file, "rb") as blend:
        for block in iter(lambda: blend.read(1 << 20), b""):
            digest.update(block)
    what = [__version__, args.size, args.max_bounces, list(frames or ()), contestant.settings(), seconds]
    digest.update(json.dumps(what, sort_keys=True).encode())
    return digest.hexdigest()[:16]


def make(engines, contestant: Contestant, seconds: float, folder: str, key: str, label: str) -> Reference:
    """The reference of one engine, about `seconds` of sampling a frame, from the folder if it is there."""
    path = os.path.join(folder, f"{contestant.engine}-{key}.npz")
    kept = _load(path)
    if kept is not None:
        return kept
    samples = _samples(engines, contestant, seconds / PARTS, label)
    halves, spent = [0.0, 0.0], 0.0
    for part in range(PARTS):
        pictures, costs = engines.render(
            contestant, SEEDS + part, samples, f"{label} {part + 1}/{PARTS}", reference=True
        )
        stack = np.stack(pictures).astype(np.float64)
        stack[~np.isfinite(stack)] = 0.0
        halves[part % 2] = halves[part % 2] + stack / (PARTS // 2)
        spent += sum(cost["sampling_seconds"] for cost in costs)
    error = np.array([own_error(a, b) for a, b in zip(*halves, strict=True)])
    made = Reference(((halves[0] + halves[1]) / 2).astype(np.float32), error, samples * PARTS, spent)
    os.makedirs(folder, exist_ok=True)
    with atomic_path(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(file, **vars(made))
    return made


def _load(path: str) -> Reference | None:
    try:
        with np.load(path) as kept:
            return Reference(kept["pixels"], kept["error"], int(kept["samples"]), float(kept["seconds"]))
    except (OSError, ValueError, KeyError):
        return None


def _samples(engines, contestant, seconds: float, label: str) -> int:
    """Samples that take about this long: counts grow until a render takes a fair part of it."""
    samples = 1
    while True:
        _, costs = engines.render(
            contestant, SEEDS - 1, samples, f"{label}, {samples} samples to see its pace", reference=True
        )
        longest = max(cost["sampling_seconds"] for cost in costs)
        if longest > seconds / 8 or samples >= 1 << 20:
            return max(1, int(samples * seconds / max(longest, 1e-6)))
        samples *= 4


def own_error(a: np.ndarray, b: np.ndarray) -> float:
    """Trimmed relMSE of the noise in the mean of two independent halves: a quarter of that between them."""
    return (error_metrics(a, b)["relmse_trimmed"] + error_metrics(b, a)["relmse_trimmed"]) / 8


def agree(a: Reference, b: Reference) -> tuple[Reference, list]:
    """Both together, and a dictionary a frame that says how far they disagree.

    Weights are the inverse of each whole picture's own error: weights by pixel, from few renders, would favour pixels
    that happened to come out dark. `expected`: the trimmed relMSE that noise alone would show between them.
    """
    pixels, errors, facts = [], [], []
    for x, y, ex, ey in zip(a.pixels, b.pixels, a.error, b.error, strict=True):
        share = ey / (ex + ey) if ex + ey > 0 else 0.5
        mean = share * x + (1 - share) * y
        found, turned = error_metrics(x, y), error_metrics(y, x)
        pixels.append(mean)
        errors.append(share**2 * ex + (1 - share) ** 2 * ey)
        facts.append(
            {
                "mean_signed_error_percent": found["mean_signed_error_percent"],
                "relmse_trimmed": (found["relmse_trimmed"] + turned["relmse_trimmed"]) / 2,
                "expected": float(ex + ey),
                "share": float(share),
            }
        )
    both = Reference(np.stack(pixels), np.array(errors), a.samples + b.samples, a.seconds + b.seconds)
    return both, facts
