# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes of records in GLSL are never written out, since C++ alone checks them: a stale one bent all normal maps."""

import re
from pathlib import Path

_SHADERS = Path(__file__).parents[1] / "shaders"
# Arrays of plain words and vectors: no struct to fall out of step with.
_PLAIN = {"0", "4", "8", "16"}


def test_no_stride_is_written_out():
    found = []
    for path in sorted([*_SHADERS.glob("lib/*"), *_SHADERS.glob("stages/*")]):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            for literal in re.findall(r"\b(\d+)ul\b", line.split("//")[0]):
                # The two words of a packed triple's pair (words.glsl).
                if literal not in _PLAIN and not (path.name == "words.glsl" and literal in ("3", "24")):
                    found.append(f"{path.name}:{number}: {line.strip()}")
    assert not found, "\n".join(found)
