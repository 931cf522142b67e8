# SPDX-License-Identifier: Apache-2.0
"""Processes that render for a measurement: the environment they get, and one that answers questions until it is closed.

Questions and answers are lines of JSON over the process's stdin and stdout; what it prints besides goes to a log, of
which the last words are told when it dies.
"""

import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time

from headwater.errors import UserError

POLL_SECONDS = 0.1


def environment(threads: int) -> dict:
    """Of a process that measures: finds this package, and lavapipe has as many threads as the rest (0: all)."""
    values = dict(os.environ)
    package_root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    values["PYTHONPATH"] = os.pathsep.join(filter(None, (package_root, values.get("PYTHONPATH"))))
    if threads:
        values["LP_NUM_THREADS"] = str(threads)
    return values


def last_words(log_path: str) -> str:
    """The last line of a log that says something."""
    with open(log_path, encoding="utf-8", errors="replace") as log:
        lines = [line.strip() for line in log if line.strip()]
    return lines[-1] if lines else "it said nothing"


def machine() -> dict:
    """CPU, cores and load, for reports."""
    cpu = ""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            cpu = next((line.split(":")[1].strip() for line in file if line.startswith("model name")), "")
    except OSError:
        pass
    return {"cpu": cpu, "cores": os.cpu_count(), "load_before": os.getloadavg()}


class Failed(UserError):
    """The process died, took too long, or answered with an error: it has to be started anew."""


class Worker:
    """`python -m MODULE` kept alive between questions. It has a session of its own, so that Ctrl-C reaches only us."""

    def __init__(self, module: str, label: str, threads: int = 0):
        self._label = label
        self._folder = tempfile.TemporaryDirectory(prefix="headwater-bench-")
        self._log_path = os.path.join(self._folder.name, "log")
        with open(self._log_path, "wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", module],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=environment(threads),
                text=True,
                start_new_session=True,
            )
        self._answers = queue.Queue()
        threading.Thread(target=self._read, args=(self._process.stdout,), daemon=True).start()

    def _read(self, stream) -> None:
        for line in stream:
            self._answers.put(line)
        self._answers.put(None)

    def ask(self, question: dict, timeout: float, waiting=lambda seconds: None) -> dict:
        """The answer. `waiting` is called ten times a second with the seconds since; what it raises goes through.

        Raises Failed.
        """
        started = time.monotonic()
        try:
            self._process.stdin.write(json.dumps(question) + "\n")
            self._process.stdin.flush()
        except OSError:
            raise self._dead() from None
        while True:
            try:
                line = self._answers.get(timeout=POLL_SECONDS)
                break
            except queue.Empty:
                passed = time.monotonic() - started
                if passed > timeout:
                    raise Failed(f"{self._label}: more than {timeout:.0f} s") from None
                waiting(passed)
        if line is None:
            raise self._dead()
        answer = json.loads(line)
        if "error" in answer:
            raise Failed(f"{self._label}: {answer['error']}")
        return answer

    def _dead(self) -> Failed:
        try:
            status = self._process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            status = "unknown"
        return Failed(f"{self._label}: the process ended with status {status}: {last_words(self._log_path)}")

    def close(self) -> None:
        """Ends the process."""
        if self._process.poll() is None:
            self._process.kill()  # it holds nothing worth saving, and bpy's own exit may take long
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            try:
                stream.close()
            except OSError:
                pass
        self._folder.cleanup()
