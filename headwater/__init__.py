# SPDX-License-Identifier: Apache-2.0
"""Headwater: a render engine for Blender and USD. The Python package around the core `headwater._core`.

Set HEADWATER_MODULE_DIR to a build folder to use the `_core` module built there instead of the installed one.
"""

import os as _os

__version__ = "0.1.0"

if _os.environ.get("HEADWATER_MODULE_DIR"):
    __path__.insert(0, _os.path.abspath(_os.environ["HEADWATER_MODULE_DIR"]))
