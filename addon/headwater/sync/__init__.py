# SPDX-License-Identifier: GPL-3.0-or-later
"""From Blender's evaluated dependency graph to edits of the core's scene: one file for each kind of thing.

`state.SceneSync` holds what persists from one sync to the next. Nothing here keeps a reference to Blender's data after
a sync: everything is keyed by `session_uid`.
"""
