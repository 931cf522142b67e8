#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Quits a real Blender with a window in each state of quitting.py, several times: it ends with status 0, in silence.

  quit.py LAUNCHER HOME FOLDER [TIMES [STATE…]]

LAUNCHER runs Blender with the arguments it is given, in a window after `--gui`; HOME is a profile in which the
extension is installed; logs stay in FOLDER. Status 1 and a line for each run that did not end well.
"""

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

SCRIPT = Path(__file__).resolve().with_name("quitting.py")
TIMES = 3
SECONDS = 120  # for the whole life of one Blender
QUIT_SECONDS = 15  # from the last word to the end: a build is waited for
SAID = re.compile(r"terminate called|Traceback|Segmentation fault|Fatal Python error|Error:|Aborted|nanobind:")


def states() -> list[str]:
    names = re.search(r"^STATES = \((.*)\)$", SCRIPT.read_text(), re.M).group(1)
    return [name.strip() for name in names.split(",")]


def run(launcher: str, home: str, folder: Path, state: str) -> str:
    """One life of a Blender; what was wrong with its end, "" where nothing was."""
    folder.mkdir(parents=True)
    command = [launcher, "--gui", "640x480", "--python-exit-code", "7", "--python", str(SCRIPT)]
    log, quits_at = [], None
    with subprocess.Popen(
        ["timeout", "--kill-after=5", str(SECONDS), *command, "--", str(folder), state],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        env=dict(os.environ, BL_HOME=home),
    ) as process:
        for line in process.stdout:
            log.append(line)
            if "quits now" in line:
                quits_at = time.monotonic()
        status = process.wait()
    seconds = time.monotonic() - quits_at if quits_at else 0.0
    (folder / "log.txt").write_text("".join(log))
    said = next((line.strip() for line in log if SAID.search(line)), "")
    if status != 0 or said:
        return f"status {status}; {said or ''.join(log[-1:]).strip()}"
    if quits_at is None:
        return "it ended before it was to quit"
    print(f"quit: {state}: in {seconds:.1f} s", flush=True)
    return f"took {seconds:.1f} s to quit" if seconds > QUIT_SECONDS else ""


def main(launcher: str, home: str, folder: str, times: str = str(TIMES), *wanted: str) -> None:
    place, failed = Path(folder).resolve(), 0
    shutil.rmtree(place, ignore_errors=True)
    for turn in range(int(times)):
        for state in wanted or states():
            wrong = run(launcher, home, place / f"{state}_{turn}", state)
            if wrong:
                failed += 1
                print(f"quit: {state}: {wrong} (log in {place / f'{state}_{turn}'})", flush=True)
    if failed:
        sys.exit(1)
    print(f"quit: passed in {Path(launcher).name}")


if __name__ == "__main__":
    main(*sys.argv[1:])
