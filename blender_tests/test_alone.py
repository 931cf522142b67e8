# SPDX-License-Identifier: Apache-2.0
"""Tests marked alone run by themselves, with the driver's own threads; others side by side, without them (alone.py)."""

import json
import os
import subprocess
import sys
from pathlib import Path

import alone

TESTS = f"""
import json, os, time
import pytest

def spend(name):
    began = time.monotonic()
    time.sleep(0.3)
    facts = dict(name=name, began=began, ended=time.monotonic(), driver=os.environ.get({alone.DRIVER!r}))
    with open({{log!r}}, "a") as log:
        log.write(json.dumps(facts) + "\\n")

@pytest.mark.parametrize("turn", range(6))
def test_beside_others(turn):
    spend("beside")

@pytest.mark.alone
@pytest.mark.parametrize("turn", range(3))
def test_alone(turn):
    spend("alone")
"""


def test_nothing_runs_beside_a_test_that_is_alone(tmp_path):
    log = tmp_path / "log"
    (tmp_path / "test_it.py").write_text(TESTS.format(log=str(log)))
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent)}
    environment.pop(alone.DRIVER, None)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "2", "--dist", "worksteal", "-p", "conftest", "-c", os.devnull]
        + ["--rootdir", str(tmp_path), "-p", "no:cacheprovider", str(tmp_path / "test_it.py")],
        capture_output=True,
        text=True,
        timeout=120,
        env=environment,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    spent = [json.loads(line) for line in log.read_text().splitlines()]
    assert [s["name"] for s in spent].count("alone") == 3 and len(spent) == 9
    overlaps = [(a["name"], b["name"]) for a in spent for b in spent
                if a is not b and a["began"] < b["ended"] and b["began"] < a["ended"]]  # fmt: skip
    assert overlaps and all(pair == ("beside", "beside") for pair in overlaps)
    assert {s["driver"] for s in spent if s["name"] == "alone"} == {None}
    assert {s["driver"] for s in spent if s["name"] == "beside"} == {"0"}
