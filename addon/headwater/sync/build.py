# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of the core's scene on a first sync, with uploads and BVH builds beside them on another thread.

The core's scene belongs to one thread at a time. From the first build until `finish` it is the builder's: edits wait in
a queue, which the builder makes before each build. The thread that syncs waits for it at the end only, so that Blender
computes normals and decodes what images the core does not, meanwhile.
"""

import queue
import threading
from collections import deque
from functools import partial

from .problems import naming_as_here

FIRST_BATCH = 20_000  # triangles that are worth a build of their own
GROWTH = 1.3  # of the next batch over the last: builds stay few
LAST_BATCH = 20_000  # triangles for which the last build is begun before the images are decoded


class _Builder:
    """A thread that makes batches of edits and calls `build` after each. The first error ends its work."""

    def __init__(self, build):
        self._build, self._error = build, None
        self._batches: queue.SimpleQueue = queue.SimpleQueue()  # deques of edits; None: the end
        self._given = self._done = 0
        self.built: list[dict] = []  # what the builds returned
        self._thread = threading.Thread(target=self._run, name="Headwater build")
        self._thread.start()

    @property
    def busy(self) -> bool:
        return self._done < self._given

    def give(self, edits: deque) -> None:
        self._given += 1
        self._batches.put(edits)

    def join(self) -> None:
        """Waits for all batches; raises what the first that failed raised."""
        self._batches.put(None)
        self._thread.join()
        if self._error is not None:
            raise self._error

    def stop(self) -> None:
        """Waits for the call that is under way; forgets the rest and all errors."""
        self._error = self._error or InterruptedError()
        self._batches.put(None)
        self._thread.join()

    def _run(self):
        while (edits := self._batches.get()) is not None:
            try:
                self._work(edits)
            except BaseException as error:
                self._error = self._error or error
            self._done += 1

    def _work(self, edits: deque) -> None:
        while edits and self._error is None:
            _make(*edits.popleft())  # forgotten once made: its arrays are as large as the core's own
        if self._error is None:
            self.built.append(self._build())


def _make(named, call, arguments, settings) -> None:
    with named:
        call(*arguments, **settings)


class Edits:
    """The core's scene as the parts of a sync have it: all their edits come here, so that none meets the builder's.

    Edits keep their order. What they return is lost; one that is refused while it waits raises in `finish`.
    """

    def __init__(self, scene):
        self._scene = scene
        self._builder: _Builder | None = None
        self.begin(None)

    def begin(self, build) -> None:
        """Before a sync. `build`: Session.sync, called on the other thread; None: edits pass straight on."""
        self._build = build
        self._waiting: deque = deque()
        self._triangles, self._batch = 0, FIRST_BATCH
        self.built: list[dict] = []  # what the builds returned, after `finish`

    @property
    def early(self) -> bool:
        """Whether edits are of use before all of them are known."""
        return self._build is not None

    def upsert_mesh(self, number, name, positions, tri_vertices, **rest) -> None:
        self._edit(self._scene.upsert_mesh, number, name, positions, tri_vertices, **rest)
        self._triangles += len(tri_vertices)
        if self.early and self._triangles >= self._batch and not (self._builder and self._builder.busy):
            self._start()
            self._batch *= GROWTH

    def has_mesh(self, number: int) -> bool:
        """Asked between `finish` and the next sync's first build."""
        assert self._builder is None, "the scene is the builder's"
        return self._scene.has_mesh(number)

    def __getattr__(self, name: str):
        """All other edits of core.Scene."""
        return partial(self._edit, getattr(self._scene, name))

    def start_last(self) -> None:
        """Asks for a build of everything so far, after the one that is under way; `finish` ends it."""
        if self.early and self._triangles >= LAST_BATCH:
            self._start()

    def finish(self) -> None:
        """Waits for the builds and sends what still waits: the scene is this thread's again."""
        builder, self._builder = self._builder, None
        if builder is not None:
            builder.join()
            self.built += builder.built
        while self._waiting:
            _make(*self._waiting.popleft())

    def abandon(self) -> None:
        """After an error or Esc: ends the build, forgets the rest. The scene may then lack what the sync sent."""
        self._waiting.clear()
        builder, self._builder = self._builder, None
        if builder is not None:
            builder.stop()  # the error that brought us here is the one to tell

    def _edit(self, call, *arguments, **settings) -> None:
        if self._builder is not None:
            self._waiting.append((naming_as_here(), call, arguments, settings))
        else:
            call(*arguments, **settings)

    def _start(self) -> None:
        if self._builder is None:
            self._builder = _Builder(self._build)
        edits, self._waiting = self._waiting, deque()
        self._triangles = 0
        self._builder.give(edits)
