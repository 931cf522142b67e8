# SPDX-License-Identifier: GPL-3.0-or-later
"""Who renders now. One picture at a time is rendered on the device: views take turns, final pictures go before them.

Everything that renders or syncs a session of the shared context does it within `turns.take`.
"""

import collections
import contextlib
import threading

POLL = 0.05  # seconds between looks at what may end a wait


class Turns:
    """A queue for one device. Safe from any thread."""

    def __init__(self):
        self._changed = threading.Condition()
        self._finals: collections.deque = collections.deque()
        self._views: collections.deque = collections.deque()
        self._busy = False
        self._give_way = None

    @contextlib.contextmanager
    def take(self, *, final: bool, give_way=None, keep_waiting=lambda: True):
        """Waits for the turn and holds it within the `with`; gives whether it came.

        `final`: before all views, whose `give_way()` is called so that they end early. `keep_waiting()` is asked often
        while waiting; the turn does not come when it says False.
        """
        came = self._wait(self._finals if final else self._views, final, give_way, keep_waiting)
        try:
            yield came
        finally:
            if came:
                with self._changed:
                    self._busy, self._give_way = False, None
                    self._changed.notify_all()

    @property
    def final_waits_or_renders(self) -> bool:
        with self._changed:
            return bool(self._finals) or (self._busy and self._give_way is None)

    def _wait(self, queue, final, give_way, keep_waiting) -> bool:
        ticket = object()
        with self._changed:
            queue.append(ticket)
            try:
                if final and self._give_way is not None:
                    self._give_way()
                while self._busy or queue[0] is not ticket or (not final and self._finals):
                    self._changed.wait(POLL)
                    if not keep_waiting():
                        return False
                self._busy, self._give_way = True, give_way
                return True
            finally:
                queue.remove(ticket)
                self._changed.notify_all()


turns = Turns()
