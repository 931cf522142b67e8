# SPDX-License-Identifier: Apache-2.0
"""Headwater: a render engine for Blender and USD. The Python package around the core `headwater._core`.

Set HEADWATER_MODULE_DIR to a build folder to use the `_core` module built there instead of the installed one.
"""

import os as _os

__version__ = "0.1.0"

if _os.environ.get("HEADWATER_MODULE_DIR"):
    __path__.insert(0, _os.path.abspath(_os.environ["HEADWATER_MODULE_DIR"]))


def build_on_disk() -> str:
    """Which build of the extension lies where this package was loaded from; "" outside an extension."""
    try:
        with open(_os.path.join(_os.path.dirname(__file__), "build.txt"), encoding="utf-8") as file:
            return file.read()
    except OSError:
        return ""


build = build_on_disk()  # of what is loaded: an update in a running Blender changes only the one on disk
