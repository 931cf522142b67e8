# SPDX-License-Identifier: Apache-2.0
"""The denoiser by itself, on pictures made here: error, colour, alpha, bad pixels, tiny pictures, cancel, absence."""

import importlib.util
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from headwater import denoiser


@pytest.fixture(scope="module")
def oidn():
    try:
        denoiser.version()
    except denoiser.DenoiserUnavailable as error:
        pytest.skip(str(error))
    return denoiser


def scene(height=96, width=128, seed=1):
    """A checkered gradient, the same with multiplicative noise of mean 1, and its guides."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    albedo = np.where(((x // 16 + y // 16) % 2 == 0)[..., None], [0.8, 0.5, 0.3], [0.2, 0.3, 0.6]).astype(np.float32)
    clean = albedo * (0.5 + x / width)[..., None]
    noise = np.random.default_rng(seed).exponential(1.0, clean.shape)
    alpha = np.random.default_rng(2).random((height, width, 1), np.float32)
    normal = np.zeros_like(albedo)
    normal[..., 2] = 1.0
    noisy = np.concatenate([clean * noise, alpha], axis=2).astype(np.float32)
    return clean, noisy, albedo, normal


def relmse(picture, reference):
    return float(np.mean((picture[..., :3] - reference) ** 2 / (reference**2 + 1e-2)))


@pytest.mark.parametrize("prefilter", denoiser.PREFILTERS)
def test_error_falls_and_alpha_stays(oidn, prefilter):
    clean, noisy, albedo, normal = scene()
    before = noisy.copy()
    picture = oidn.denoise(noisy, albedo, normal, prefilter=prefilter)
    assert relmse(picture, clean) * 3 < relmse(noisy, clean)
    assert np.array_equal(noisy, before)
    assert np.array_equal(picture[..., 3], noisy[..., 3])


@pytest.mark.parametrize("prefilter", denoiser.PREFILTERS)
def test_colour_stays_at_sixteen_samples(oidn, prefilter):
    # At one such sample the network darkens a channel by up to 7 %: docs/measurements/denoising.md.
    clean, noisy, albedo, normal = scene()
    noisy[..., :3] = clean * np.random.default_rng(3).gamma(16, 1 / 16, clean.shape)
    picture = oidn.denoise(noisy, albedo, normal, prefilter=prefilter)
    assert np.allclose(picture[..., :3].mean((0, 1)), clean.mean((0, 1)), rtol=0.02)


def test_bad_pixels_do_not_spread(oidn):
    clean, noisy, albedo, normal = scene()
    noisy[40, 40, :3], noisy[50, 60, :3] = np.nan, np.inf
    picture = oidn.denoise(noisy, albedo, normal)
    assert np.isfinite(picture).all()
    assert relmse(picture, clean) < 0.3


@pytest.mark.parametrize("size", [(1, 1), (3, 5)])
def test_tiny_pictures(oidn, size):
    picture = oidn.denoise(np.full((*size, 4), 0.5, np.float32))
    assert picture.shape == (*size, 4) and np.isfinite(picture).all()


@pytest.mark.alone
def test_cancel_is_quick(oidn):
    _, noisy, albedo, normal = scene(720, 1280)
    asked = []

    def cancelled():
        asked.append(time.monotonic())
        return True

    with pytest.raises(denoiser.DenoiseCancelled):
        oidn.denoise(noisy, albedo, normal, cancelled=cancelled)
    assert time.monotonic() - asked[0] < 0.5


def test_absent_library_names_what_was_searched(monkeypatch):
    monkeypatch.setattr(denoiser, "_candidates", lambda library: iter(["/nowhere/libOpenImageDenoise.so.2"]))
    denoiser._load.cache_clear()
    try:
        with pytest.raises(denoiser.DenoiserUnavailable, match="was not found: tried /nowhere/lib"):
            denoiser.denoise(np.ones((2, 2, 3), np.float32))
    finally:
        denoiser._load.cache_clear()


def test_the_copy_that_blender_links_with_is_taken():
    """Any other would take symbols from it: but for the package's, whose symbols have names of their own."""
    bpy = importlib.util.find_spec("bpy")
    folder = Path(bpy.submodule_search_locations[0]) / "lib" if bpy else Path("absent")
    theirs, tbb = folder / denoiser.SONAME, folder / "libtbb.so.12"
    if not theirs.exists() or (Path(denoiser.__file__).parent / "oidn").exists():
        pytest.skip("no bpy with Open Image Denoise, or a copy of the package's own")
    code = """
import numpy as np
from headwater import denoiser
noise = np.random.default_rng(1).random((64, 64, 3), np.float32)
assert denoiser.denoise(noise).std() < 0.5 * noise.std()
paths = {line.split()[-1] for line in open("/proc/self/maps") if "OpenImageDenoise" in line}
print(*{path.rpartition("/")[0] for path in paths})
"""
    environment = dict(os.environ, LD_PRELOAD=f"{theirs} {tbb}", PYTHONPATH=str(Path(__file__).parent.parent))
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.split() == [str(folder)]


def test_wrong_shapes_are_named():
    with pytest.raises(ValueError, match="albedo has the shape"):
        denoiser.denoise(np.ones((2, 2, 3), np.float32), np.ones((3, 2, 3), np.float32))
