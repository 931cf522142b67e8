# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept from frame to frame: a scene sync and a session for each view layer that is being rendered.

Kept over frames in animations and with persistent data, so that only what changed is synced, uploaded and rebuilt.
Freed when the render ends (unless data is persistent), when another file is loaded, and when the add-on is turned off.
"""

from bpy.app.handlers import persistent

from . import handlers, native
from .sync import decoded_files
from .sync.state import SceneSync


class Kept:
    """One view layer's scene on one device."""

    def __init__(self, context):
        self.context = context
        self.sync = SceneSync(native.core())
        self.session = native.core().Session(context, self.sync.scene)
        self.graph = None  # token of the render engine whose dependency graph was synced last
        self.frame = None  # (frame, part of a frame) that was synced last
        self.busy = False
        self.reservoirs_of = None  # the frame that was rendered last, and whole

    def continues(self, scene) -> bool:
        """Whether the scene's frame is the next one of the animation that was rendered last."""
        step = max(scene.frame_step, 1)
        return self.reservoirs_of is not None and 0 < scene.frame_current - self.reservoirs_of <= step


_kept: dict[tuple, Kept] = {}


def get(key: tuple, context) -> Kept:
    """What is kept under the key, on that context; new where there is none that can go on."""
    found = _kept.get(key)
    if found is None or found.context is not context or not found.sync.usable:
        for other in [other for other, kept in _kept.items() if kept.context is not context and not kept.busy]:
            drop(other)  # the device changed
        found = _kept[key] = Kept(context)
    return found


def drop(key: tuple) -> None:
    """Frees what is kept under the key; a render that still runs there is cancelled."""
    kept = _kept.pop(key, None)
    if kept is not None:
        kept.session.cancel()


def drop_all() -> None:
    for key in list(_kept):
        drop(key)


@persistent
def _render_starts_or_ends(scene, *_):
    if scene is None or not scene.render.use_persistent_data:
        drop_all()


@persistent
def _file_loaded(*_):
    drop_all()
    decoded_files.forget_all()


_handlers = (
    ("render_init", _render_starts_or_ends),
    ("render_complete", _render_starts_or_ends),
    ("render_cancel", _render_starts_or_ends),
    ("load_pre", _file_loaded),
)


def register():
    handlers.add(_handlers)


def unregister():
    handlers.remove(_handlers)
    drop_all()
    decoded_files.forget_all()
    native.release()
