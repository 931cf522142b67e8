# SPDX-License-Identifier: Apache-2.0
"""The interpreter ends while a render runs, its session is held, a thread waits for it: the process ends well."""

import subprocess
import sys
from pathlib import Path

import pytest

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
{beside}
while {while_} and session.progress()["sample"] == 0:
    session.wait(5)
"""


# Threads that the interpreter leaves behind, nearly always within a call that gave up the interpreter's lock.
THREADS = """
import threading
def forever(call):
    while True:
        try: call()
        except (RuntimeError, ValueError): pass
for call in (lambda: session.wait(5), lambda: session.read("Combined"), session.finish):
    threading.Thread(target=forever, args=(call,), daemon=True).start()
"""


def _run(while_, beside=""):
    here = Path(__file__).resolve().parent
    code = CODE.format(root=str(here.parent), here=str(here), while_=while_, beside=beside)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=400)


def test_while_rendering(core):
    done = _run(True)
    assert done.returncode == 0 and "finished: True" in done.stdout, (done.stdout, done.stderr)


def test_while_compiling(core):
    done = _run(False)
    assert done.returncode == 0 and "finished: True" in done.stdout, (done.stdout, done.stderr)


@pytest.mark.parametrize("turn", range(4))
def test_while_other_threads_wait_for_the_render(core, turn):
    done = _run(True, THREADS)
    assert done.returncode == 0 and "finished: True" in done.stdout, (done.stdout, done.stderr)
    assert not done.stderr
