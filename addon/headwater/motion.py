# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame before this one, synced first where the Vector pass is asked for.

The core's motion is from the last commit to this one. Animations come by it by themselves, frame by frame; a still, the
first frame of an animation and frames that are further than one apart do not. Cycles does it for every frame, and for
the one after this too, which the core does not know.
"""


def sync_frame_before(engine, state, depsgraph, frame, breathe) -> bool:
    """Commits the scene as it was a frame ago, unless that is what was committed last. Leaves Blender at this frame.

    `state`: kept.Kept; `frame`: render_settings.Frame. Returns whether it did.
    """
    scene = depsgraph.scene_eval
    now, part = scene.frame_current, scene.frame_subframe
    if state.frame == (now - 1, part):
        return False
    engine.update_stats("", "Synchronizing the frame before")
    try:
        engine.frame_set(now - 1, part)
        borrow = state.context.shared_memory
        state.sync.sync(depsgraph, False, breathe, build=state.session.sync, borrow=borrow)
        scene = depsgraph.scene_eval
        camera = engine.camera_override or scene.camera
        if camera is not None:
            camera = camera.evaluated_get(depsgraph)
        state.sync.camera.sync(depsgraph, camera, scene.render, frame)
        state.session.sync()
    finally:
        engine.frame_set(now, part)
    return True
