# SPDX-License-Identifier: Apache-2.0
"""USD stages as scene edits. `open_stage` checks and opens a file; `StageSync` keeps a core scene equal to the stage.

What is supported, and how USD's quantities map to the core's: docs/manual/usd.md.
"""

from headwater.usd_scene.stage import open_stage
from headwater.usd_scene.sync import StageSync

__all__ = ["StageSync", "open_stage"]
