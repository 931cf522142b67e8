# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C as a flag that render loops look at, so that what was rendered so far can still be written.

Python runs signal handlers between two bytecodes of the main thread: every loop that waits for the core does so in
slices of at most 50 ms. A second Ctrl-C ends the process the ordinary way (KeyboardInterrupt).
"""

import signal
import threading

_requested = threading.Event()


def requested() -> bool:
    """True once the user has asked to stop."""
    return _requested.is_set()


def request() -> None:
    """Asks every render loop to stop, as Ctrl-C does."""
    _requested.set()


class Watch:
    """Context manager: SIGINT and SIGTERM set the flag while it is active; handlers are restored after.

    Outside the main thread, where Python allows no handlers, it only clears the flag.
    """

    def __enter__(self):
        _requested.clear()
        self._previous = {}
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._previous[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, *_):
        for number, handler in self._previous.items():
            signal.signal(number, handler)
        return False

    @staticmethod
    def _handle(number, _frame):
        if _requested.is_set() and number == signal.SIGINT:
            raise KeyboardInterrupt
        _requested.set()
