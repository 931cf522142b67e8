# SPDX-License-Identifier: Apache-2.0
"""Denoised viewport in a window: switched on, after an orbit, switched off."""

import sys
import time
from math import radians
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from driver import Session, addon
from mathutils import Quaternion

SAMPLES = 8


def steps(session):
    addon()
    scene, own = session.scene, session.scene.headwater
    scene.render.engine = "HEADWATER"
    own.use_cycles_settings = False
    own.preview_samples = SAMPLES
    own.use_preview_denoising = True
    session.space.shading.type = "RENDERED"
    yield 0.5

    def denoised():
        picture = session.picture()
        return picture is not None and picture.denoised and picture.samples == SAMPLES

    def wait_denoised(what):
        end = time.perf_counter() + 90
        while not denoised():
            assert time.perf_counter() < end, f"{what}: {[view.status for view in session.views]}"
            session.area.tag_redraw()
            yield 0.02

    yield from wait_denoised("a denoised picture")
    yield 0.3
    session.shot("denoised")
    session.facts["status"] = session.views[0].status
    session.region_3d.view_rotation = Quaternion((0, 0, 1), radians(40)) @ session.region_3d.view_rotation
    yield 0.3
    yield from wait_denoised("a denoised picture after an orbit")
    yield 0.3
    session.shot("orbited")
    own.use_preview_denoising = False
    yield from session.settled(SAMPLES, 60.0)
    assert not session.picture().denoised
    session.shot("noisy")
    assert "Denoised" in session.facts["status"], session.facts


Session(steps)
