# SPDX-License-Identifier: GPL-3.0-or-later
"""Edits of the core's scene on a first sync, with uploads and BVH builds beside them on another thread.

The core's scene belongs to one thread at a time: while a build runs, edits wait in a queue. The main thread never waits
for a build but at the end, so that Blender computes normals and decodes images meanwhile.
"""

import threading

FIRST_BATCH = 100_000  # triangles that are worth a build of their own; doubles each time, so that builds stay few
LAST_BATCH = 20_000  # triangles for which the last build is begun before the images are decoded


class Worker:
    """Runs a function of the core, which releases the GIL, on its own thread."""

    def __init__(self, work):
        self._work, self._result, self._error = work, {}, None
        self._thread = threading.Thread(target=self._run, name="Headwater build")
        self._thread.start()

    def _run(self):
        try:
            self._result = self._work()
        except BaseException as error:
            self._error = error

    @property
    def busy(self) -> bool:
        return self._thread.is_alive()

    def join(self) -> dict:
        """What the function returned; raises what it raised."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._result


class Edits:
    """Takes the core scene's edits of meshes and instances. `build`: Session.sync; None: edits pass straight on."""

    def __init__(self, scene, build=None):
        self._scene, self._build = scene, build
        self._waiting: list = []
        self._triangles, self._batch = 0, FIRST_BATCH
        self._worker: Worker | None = None
        self.built: list[dict] = []  # what the builds returned

    @property
    def early(self) -> bool:
        """Whether edits are of use before all of them are known."""
        return self._build is not None

    def upsert_mesh(self, number, name, positions, tri_vertices, **rest) -> None:
        self._edit(self._scene.upsert_mesh, number, name, positions, tri_vertices, **rest)
        self._triangles += len(tri_vertices)
        if self.early and self._triangles >= self._batch and not self._is_busy():
            self._start()

    def upsert_instance(self, *arguments, **settings) -> None:
        self._edit(self._scene.upsert_instance, *arguments, **settings)

    def upsert_instances(self, *arguments, **settings) -> None:
        self._edit(self._scene.upsert_instances, *arguments, **settings)

    def finish(self) -> None:
        """Waits for the build and sends what waited: the scene is the main thread's again."""
        self._flush()

    def start_last(self) -> None:
        """Begins a build of everything so far; `finish` ends it."""
        if self.early and self._triangles >= LAST_BATCH:
            self._start()

    def abandon(self) -> None:
        """After an error or Esc: ends the build, forgets the rest."""
        self._waiting = []
        if self._worker is not None:
            try:
                self._worker.join()
            except Exception:
                pass  # the error that brought us here is the one to tell
            self._worker = None

    def _edit(self, call, *arguments, **settings) -> None:
        if self._is_busy():
            self._waiting.append((call, arguments, settings))
            return
        self._flush()
        call(*arguments, **settings)

    def _is_busy(self) -> bool:
        return self._worker is not None and self._worker.busy

    def _flush(self) -> None:
        if self._worker is not None:
            worker, self._worker = self._worker, None
            self.built.append(worker.join())
        waiting, self._waiting = self._waiting, []
        for call, arguments, settings in waiting:
            call(*arguments, **settings)

    def _start(self) -> None:
        self._flush()
        self._triangles = 0
        self._batch *= 2
        self._worker = Worker(self._build)
