# SPDX-License-Identifier: GPL-3.0-or-later
"""Hosek and Wilkie's sky: as bright and of the colour of Cycles' on average, wherever the sun stands."""

import pytest
from bpy_process import run

PLACES = [(1.5, 0.3, 5), (2.2, 0.3, 50), (2.2, 0.8, 50), (3.5, 0.0, 10), (6, 0.3, 30)]


@pytest.fixture(scope="module")
def ratios(tmp_path_factory):
    return run(
        f"""
        import measure_sky as sky
        skies = [[sky.picture(engine, *place, tmp) for engine in ("CYCLES", "HEADWATER")] for place in {PLACES}]
        theirs = sky.mean(skies[1][0])
        show(
            ratios=[[(sky.mean(b, power) / sky.mean(a, power)).tolist() for power in (0, 1)] for a, b in skies],
            blue=float(theirs[2] / theirs[0]),
        )
        """,
        tmp_path_factory.mktemp("sky"),
        fake=False,
        timeout=300,
    )


def test_mean_radiance(ratios):
    assert ratios["blue"] > 1.5  # there is a sky to compare
    for place, (mean, ground) in zip(PLACES, ratios["ratios"], strict=True):
        assert mean == pytest.approx([1, 1, 1], abs=0.06), place
        # The light that falls on the ground.
        assert ground[1] == pytest.approx(1, abs=0.2), place
