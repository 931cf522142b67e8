# SPDX-License-Identifier: Apache-2.0
"""`headwater render` in a process of its own, for tests."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = str(Path(__file__).resolve().parent.parent)


def start(*arguments, **options) -> subprocess.Popen:
    """The command with these arguments, under way; its output comes as text through pipes."""
    command = [sys.executable, "-m", "headwater", "render", *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, env=dict(os.environ, PYTHONPATH=ROOT), **pipes, **options)


def finish(*arguments, timeout: float = 300) -> tuple[int, str, str]:
    """Status, stdout and stderr of the command."""
    process = start(*arguments)
    out, err = process.communicate(timeout=timeout)
    return process.returncode, out, err
