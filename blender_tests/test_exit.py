# SPDX-License-Identifier: Apache-2.0
"""The interpreter ends while a render runs and its session is still held: the render ends first, the process well."""

import subprocess
import sys
from pathlib import Path

CODE = """
import atexit, ctypes, sys
sys.path[:0] = [{root!r}, {here!r}]
held = []
# Registered before the core's own handler, so it runs after it.
atexit.register(lambda: print("finished:", held[0].progress()["finished"], flush=True))
import core_scenes
import headwater._core as core
session = core.Session(core.Context(), core_scenes.open_scene(core))
held.append(session)
session.sync()
session.start(dict(width=256, height=256, samples=1 << 30))
ctypes.pythonapi.Py_IncRef(ctypes.py_object(session))  # as a module does that is never unloaded
while {while_} and session.progress()["sample"] == 0:
    session.wait(5)
"""


def _run(while_):
    here = Path(__file__).resolve().parent
    code = CODE.format(root=str(here.parent), here=str(here), while_=while_)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)


def test_while_rendering(core):
    done = _run(True)
    assert done.returncode == 0 and "finished: True" in done.stdout, (done.stdout, done.stderr)


def test_while_compiling(core):
    done = _run(False)
    assert done.returncode == 0 and "finished: True" in done.stdout, (done.stdout, done.stderr)
