# SPDX-License-Identifier: Apache-2.0
"""Measures denoising on a scene: error and mean colour at few samples, and its time beside a sample's.

    python blender_tests/measure_denoising.py SCENE.blend [WIDTHxHEIGHT] [REFERENCE_SAMPLES]

Prints one row a sample count and prefilter. relMSE and FLIP are against the reference; the shift is the mean of the
denoised picture against that of the same picture before, in the channel where it is largest, so that noise has no part
in it. The time is that of denoising against that of one sample of `path`, both by the wall clock: on a quiet machine.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from cli_process import finish

from headwater import denoiser
from headwater.image_io import read_exr
from headwater.metrics import error_metrics, flip

PASSES = ("Combined", "Denoising Albedo", "Denoising Normal")


def rendered(scene, folder, size, samples, seed) -> tuple[list, float]:
    """The passes, and seconds a sample."""
    output, stats = Path(folder) / f"{samples}.exr", Path(folder) / "stats.json"
    status, _, err = finish(
        scene, "-o", output, "--size", size, "--samples", samples, "--seed", seed, "--integrator", "path",
        "--passes", ",".join(PASSES), "--stats", stats, "--quiet", timeout=3600,
    )  # fmt: skip
    if status:
        sys.exit(err)
    layers = read_exr(str(output)).layers
    seconds = json.loads(stats.read_text())["frames"][0]["layers"][0]["render"]["seconds"]
    return [next(pixels for name, pixels in layers.items() if name.endswith(p)) for p in PASSES], seconds / samples


def shift(picture, noisy) -> float:
    """Of the channel whose mean moved most, in per cent."""
    means = [image[..., :3].mean((0, 1), np.float64) for image in (picture, noisy)]
    change = 100 * (means[0] / means[1] - 1)
    return float(change[np.abs(change).argmax()])


def main() -> None:
    scene, size, most = [*sys.argv[1:], "240x136", "512"][:3] if len(sys.argv) == 2 else sys.argv[1:4]
    with tempfile.TemporaryDirectory() as folder:
        (reference, *_), _ = rendered(scene, folder, size, int(most), 7)
        print(
            "| samples | prefilter | relMSE | FLIP | shift | time in samples |\n| --- | --- | --- | --- | --- | --- |"
        )
        for samples in (1, 4, 16):
            (noisy, albedo, normal), sample_seconds = rendered(scene, folder, size, samples, 1)
            variants = {"noisy": None, "no guides": ((), "NONE")}
            variants |= {name.lower(): ((albedo, normal), name) for name in denoiser.PREFILTERS}
            for name, variant in variants.items():
                picture, ratio = noisy, 0.0
                if variant is not None:
                    guides, prefilter = variant
                    denoiser.denoise(noisy, *guides, prefilter=prefilter)
                    begun = time.perf_counter()
                    picture = denoiser.denoise(noisy, *guides, prefilter=prefilter)
                    ratio = (time.perf_counter() - begun) / sample_seconds
                error = error_metrics(picture[..., :3], reference[..., :3])["relmse"]
                seen, _ = flip(picture[..., :3], reference[..., :3])
                print(
                    f"| {samples} | {name} | {error:.4f} | {seen:.4f} | {shift(picture, noisy):+.1f} % | {ratio:.2f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
