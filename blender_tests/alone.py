# SPDX-License-Identifier: Apache-2.0
"""Tests side by side (pytest -n), but those marked `alone` with no other beside them: they measure time.

Tests that are alone come first, in one worker. The others share a lock on a file, which a test that is alone has for
itself. Who wants it waits in turn, holding another: no stream of tests keeps one that is alone waiting for ever. Locks
end with the process that has them.

A test that is alone has as many threads of Mesa's lavapipe as there are processors. The others have none: a kernel runs
where it is submitted. Pictures of tests are small, and waking threads took three quarters of their time and more. What
may depend on threads names a number, Context(threads=3), which rules.
"""

import fcntl
import os
import tempfile

import pytest

FOLDER = "HEADWATER_TESTS_LOCKS"  # told to the workers by the process that starts them
DRIVER = "LP_NUM_THREADS"  # read by lavapipe whenever a device is opened


class Alone:
    """The hooks."""

    def __init__(self, config):
        self._driver_given = DRIVER in os.environ
        self._room = self._turn = None
        self._kept = False  # whether the lock is held since the test before, which was alone too
        worker = hasattr(config, "workerinput")
        if not worker and getattr(config.option, "numprocesses", None):
            folder = tempfile.TemporaryDirectory()
            config.add_cleanup(folder.cleanup)
            os.environ[FOLDER] = folder.name
        elif worker:
            self._room, self._turn = (open(os.path.join(os.environ[FOLDER], name), "w") for name in ("room", "turn"))

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items):
        if self._room is not None:
            items.sort(key=lambda item: not _is_alone(item))

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item, nextitem):
        if not self._driver_given:
            os.environ[DRIVER] = "0"
            if _is_alone(item):
                del os.environ[DRIVER]
        if self._room is None:
            return (yield)
        if not self._kept:
            fcntl.flock(self._turn, fcntl.LOCK_EX)
            fcntl.flock(self._room, fcntl.LOCK_EX if _is_alone(item) else fcntl.LOCK_SH)
            fcntl.flock(self._turn, fcntl.LOCK_UN)
        try:
            return (yield)
        finally:
            self._kept = _is_alone(item) and nextitem is not None and _is_alone(nextitem)
            if not self._kept:
                fcntl.flock(self._room, fcntl.LOCK_UN)


def _is_alone(item) -> bool:
    return item.get_closest_marker("alone") is not None
