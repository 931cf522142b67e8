# SPDX-License-Identifier: Apache-2.0
"""The one place that imports the native core, so that a missing or unloadable module is one clear error."""

from headwater.errors import UserError, first_line


def load():
    """The module `headwater._core`. Raises UserError saying why it can't be loaded."""
    try:
        from headwater import _core
    except ImportError as error:
        raise UserError(f"the rendering core can't be loaded: {first_line(error)}") from error
    return _core
