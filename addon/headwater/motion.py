# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames before and after this one, synced where the Vector pass is asked for, as Cycles does for every frame.

The core's motion is from the last commit to this one. Animations come by the frame before by themselves; a still, the
first frame of an animation and frames that are further than one apart do not. The frame after is nobody's last commit:
it is committed once the picture is made, then this one again, and what moved meanwhile is rendered as a pass of its
own.
"""

import numpy as np

SAMPLES = 64  # of the motion to the next frame, at most: it has no noise but at edges
# Settings of the picture that hold for it too: they decide which surface a camera ray ends on.
_KEPT = (
    *("width", "height", "region", "seed", "first_sample", "filter", "filter_width"),
    *("transparent_bounces", "transparent_film", "pass_alpha_threshold"),
)
_WAIT_MS = 20


def _commit(engine, state, depsgraph, set_camera, breathe) -> None:
    """Brings the core to the frame that the dependency graph is at."""
    state.sync.sync(depsgraph, False, breathe, build=state.session.sync, borrow=state.context.shared_memory)
    set_camera()
    state.session.sync()


def sync_frame_before(engine, state, depsgraph, frame, breathe) -> bool:
    """Commits the scene as it was a frame ago, unless that is what was committed last. Leaves Blender at this frame.

    `state`: kept.Kept; `frame`: render_settings.Frame. Returns whether it did.
    """
    scene = depsgraph.scene_eval
    now, part = scene.frame_current, scene.frame_subframe
    if state.frame == (now - 1, part):
        return False

    def set_camera():
        camera = engine.camera_override or depsgraph.scene_eval.camera
        if camera is not None:
            camera = camera.evaluated_get(depsgraph)
        state.sync.camera.sync(depsgraph, camera, depsgraph.scene_eval.render, frame)

    engine.update_stats("", "Synchronizing the frame before")
    try:
        engine.frame_set(now - 1, part)
        _commit(engine, state, depsgraph, set_camera, breathe)
    finally:
        engine.frame_set(now, part)
    return True


def motion_to_next(engine, job, depsgraph, set_camera) -> np.ndarray | None:
    """The Vector pass's Z and W, (H, W, 2) pixels: from where things are in the next frame to where they are now.

    After the picture is made and read: the session renders anew. `set_camera()` gives the core the camera of the frame
    that Blender is at. Leaves the core and Blender at this frame. None when the artist cancelled.
    """
    state, session = job.kept, job.kept.session
    now, part = state.frame
    stopped = engine.test_break

    def breathe():
        if stopped():
            raise _Stopped

    engine.update_stats("", "Motion to the next frame")
    try:
        try:
            engine.frame_set(now + 1, part)
            _commit(engine, state, depsgraph, set_camera, breathe)
        finally:
            engine.frame_set(now, part)
        _commit(engine, state, depsgraph, set_camera, lambda: None)
    except _Stopped:
        state.frame = None  # what was committed last is in between
        return None
    settings = {name: job.settings[name] for name in _KEPT if name in job.settings}
    samples = min(job.settings["samples"], SAMPLES)
    # What the integrator has learned is for the next frame: path leaves it alone.
    settings.update(integrator="path", continue_history=True, max_bounces=0, samples=samples, passes=["Vector"])
    session.start(settings)
    while not session.wait(_WAIT_MS):
        if stopped():
            session.cancel()
    session.finish()
    # Last commit's place minus this one's: the other way round than to the next frame.
    return None if stopped() else -session.read("Vector")[..., :2]


class _Stopped(Exception):
    """Esc during the sync of another frame."""
