# SPDX-License-Identifier: Apache-2.0
"""Runs a piece of Python in a fresh process with bpy, the add-on and (mostly) the fake core: bpy holds one state each.

The code finds `bpy`, `np`, `core` (the fake), `hb` (headwater.blender), `scene`, `tmp` (a folder) and `show(**facts)`;
what it shows comes back as a dictionary.
"""

import json
import os
import shlex
import subprocess
import sys
import textwrap
from pathlib import Path

HERE = Path(__file__).resolve().parent
MARK = "FACTS:"
# Another than this interpreter's bpy: the command of a Python with a bpy of its own, or "BLENDER -b --python".
BPY = shlex.split(os.environ.get("HEADWATER_BPY", "")) or [sys.executable]

_PRELUDE = """
import json, sys
sys.path[:0] = [{root!r}, {here!r}]
import bpy
import numpy as np
tmp = {tmp!r}
def show(**facts):
    print("\\n" + {mark!r} + json.dumps(facts, default=str), flush=True)
import headwater.blender as hb
{core}
hb.register()
scene = bpy.context.scene
scene.render.engine = "HEADWATER"
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 32, 24, 100
scene.render.filepath = tmp + "/frame_"
scene.headwater.use_cycles_settings = False
scene.headwater.samples = 4
"""
_FAKE = "import fake_core\ncore = fake_core.install()"
_REAL = "import headwater._core as core"


def run(code: str, tmp, *, fake: bool = True, arguments=(), timeout: float = 400, check: bool = True, bpy=BPY) -> dict:
    """All facts shown by the code, with "stdout", "stderr" and "status". AssertionError when the process fails.

    bpy: a command that runs a script where there is a bpy.
    """
    prelude = _PRELUDE.format(
        root=str(HERE.parent), here=str(HERE), tmp=str(tmp), mark=MARK, core=_FAKE if fake else _REAL
    )
    # os._exit: some versions of bpy hang or crash at exit after rendering; what is tested came before.
    ending = "" if "# normal exit" in code else "\nsys.stdout.flush(); import os; os._exit(0)\n"
    script = Path(tmp) / "script.py"
    script.write_text(prelude + textwrap.dedent(code) + ending, encoding="utf-8")
    done = subprocess.run(
        [*bpy, str(script), *arguments],
        capture_output=True,
        text=True,
        timeout=timeout,
        env=dict(os.environ, PYTHONDONTWRITEBYTECODE="1"),
    )
    if check:
        assert done.returncode == 0, f"status {done.returncode}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    facts = {"stdout": done.stdout, "stderr": done.stderr, "status": done.returncode}
    for line in done.stdout.splitlines():
        if line.startswith(MARK):
            facts.update(json.loads(line[len(MARK) :]))
    return facts
