# SPDX-License-Identifier: Apache-2.0
"""Pictures carried on to the next one: noise falls, light that changes is followed, what moves leaves no trace."""

import numpy as np
import pytest

from headwater import temporal

SHAPE = (40, 60)


def noisy(mean, rng, spread=0.3):
    """A picture of one sample, (H, W, 4): gamma noise of that relative spread about `mean`, (H, W)."""
    light = mean * rng.gamma(spread**-2, spread**2, mean.shape)
    return np.concatenate([np.repeat(light[..., None], 3, 2), np.ones((*mean.shape, 1))], 2).astype(np.float32)


def guides(vector=(0.0, 0.0), depth=10.0, albedo=0.5):
    """Vector, depth and albedo of a picture: numbers, or arrays of one value a pixel."""
    v = np.zeros((*SHAPE, 4), np.float32)
    v[..., :2] = vector
    planes = [np.broadcast_to(np.asarray(each, np.float32), SHAPE)[..., None] for each in (depth, albedo)]
    return v, planes[0], np.repeat(planes[1], 3, 2)


def carried(pictures, samples=1, alone=1024):
    """What is shown of each (color, guides)."""
    history, shown = temporal.History(), []
    for color, about in pictures:
        history.advance()
        shown.append(history.blend(color, samples, *about, alone=alone))
    return shown


def error(shown, mean) -> float:
    return float(np.mean((shown[..., 0] - mean) ** 2))


def test_noise_falls_and_the_mean_stays():
    rng, mean = np.random.default_rng(1), np.linspace(0.2, 2.0, 60)[None].repeat(40, 0)
    pictures = [(noisy(mean, rng), guides()) for _ in range(24)]
    shown = carried(pictures)
    assert shown[0] is pictures[0][0]
    assert error(shown[-1], mean) < error(pictures[-1][0], mean) / 8
    assert shown[-1][..., 0].mean() == pytest.approx(mean.mean(), rel=0.01)


def test_light_that_changes_is_followed_at_once():
    rng, before = np.random.default_rng(2), np.full(SHAPE, 1.0)
    after = before.copy()
    after[:, 30:] = 0.3  # a lamp goes out
    pictures = [(noisy(before, rng), guides()) for _ in range(16)] + [(noisy(after, rng), guides()) for _ in range(2)]
    shown = carried(pictures)
    dark, lit = np.s_[:, 36:, 0], np.s_[:, :24, 0]
    assert shown[16][dark].mean() == pytest.approx(0.3, rel=0.1)
    assert shown[17][dark].mean() == pytest.approx(0.3, rel=0.05)
    assert error(shown[17][lit[:2]], 1.0) < error(pictures[17][0][lit[:2]], 1.0) / 4  # elsewhere the past stays


def test_what_moves_leaves_nothing_behind():
    """A bright ball before a dark ground, three pixels a frame."""
    rng = np.random.default_rng(3)
    column = np.arange(60)[None].repeat(40, 0)
    pictures = []
    for frame in range(12):
        ball = np.abs(column - (5 + 3 * frame)) < 4
        mean, vector = np.where(ball, 5.0, 0.1), np.zeros((*SHAPE, 2))
        vector[ball, 0] = -3
        pictures.append((noisy(mean, rng), guides(vector, np.where(ball, 9.0, 10.0), np.where(ball, 0.8, 0.3))))
    shown, last = carried(pictures)[-1][..., 0], 5 + 3 * 11
    assert shown[:, last - 20 : last - 6].max() < 0.5  # where it was
    inside = np.s_[:, last - 2 : last + 3]
    noise = np.mean((pictures[-1][0][inside + (0,)] - 5) ** 2)
    assert np.mean((shown[inside] - 5) ** 2) < noise / 4  # its own past came with it


def test_a_lamp_that_is_seen_leaves_nothing_behind():
    """One bright pixel, with neither depth nor motion of its own, on a still ground."""
    rng, mean, pictures = np.random.default_rng(4), np.full(SHAPE, 0.2), []
    for frame in range(10):
        color = noisy(mean, rng)
        color[20, 10 + frame * 4, :3] = 50
        pictures.append((color, guides()))
    shown = carried(pictures)[-1]
    assert shown[20, 10:44, 0].max() < 1.0 and shown[20, 46, 0] > 2


@pytest.mark.parametrize("vector", [(0.0, 0.0), (0.5, 0.25)])
def test_what_was_uncovered_is_new(vector):
    """A card of the ground's brightness goes: nothing tells but depth, then nothing but albedo."""
    rng, mean = np.random.default_rng(8), np.full(SHAPE, 1.0)
    there = np.zeros(SHAPE, bool)
    there[10:30, 20:40] = True
    for before, after in ((dict(depth=np.where(there, 8.0, 10.0)), {}), (dict(albedo=np.where(there, 0.9, 0.5)), {})):
        first, second = noisy(mean, rng), noisy(mean, rng)
        shown = carried([(first, guides(**before)), (second, guides(vector, **after))])[1]
        inner = np.s_[11:29, 21:39]
        assert (shown[inner] == second[inner]).all() and (shown[~there] != second[~there]).any(-1).mean() > 0.9


def test_surfaces_are_followed_by_fractions_of_pixels():
    rng, pictures = np.random.default_rng(5), []
    for frame in range(16):
        mean = 1 + 0.5 * np.sin((np.arange(60) - 0.4 * frame) / 6)[None].repeat(40, 0)
        pictures.append((noisy(mean, rng), guides((-0.4, 0.0))))
    inner = np.s_[4:-4, 12:-4]
    assert error(carried(pictures)[-1][inner], mean[inner]) < error(pictures[-1][0][inner], mean[inner]) / 6


def test_a_whole_picture_has_nothing_of_another():
    rng, mean = np.random.default_rng(6), np.full(SHAPE, 1.0)
    history, first, second = temporal.History(), noisy(mean, rng), noisy(mean, rng)
    history.blend(first, 16, *guides(), alone=64)
    history.advance()
    early = history.blend(second, 16, *guides(), alone=64)
    assert error(early, mean) < 0.7 * error(second, mean)
    assert history.blend(second, 64, *guides(), alone=64) is second
    assert history.blend(second, temporal.ALONE, *guides(), alone=1024) is second


def test_pictures_of_another_size_and_cleared_ones_have_no_past():
    rng, mean = np.random.default_rng(7), np.full(SHAPE, 1.0)
    history, color = temporal.History(), noisy(mean, rng)
    history.blend(color, 1, *guides())
    history.advance()
    half = [each[::2, ::2] for each in (color, *guides())]
    assert history.blend(half[0], 1, *half[1:]) is half[0]
    assert history.blend(color, 1, *guides()) is not color
    history.clear()
    assert history.blend(color, 1, *guides()) is color
