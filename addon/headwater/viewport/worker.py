# SPDX-License-Identifier: GPL-3.0-or-later
"""The thread on which a view is rendered. It never touches Blender's data.

The main thread publishes requests and takes finished pictures; both are single assignments. Edits of the core's scene
and Session.sync exclude each other by `scene_lock`, which the main thread tries for a few milliseconds only.
"""

import threading
import time
import traceback
import weakref
from dataclasses import dataclass, replace

import numpy as np

from headwater import denoiser, temporal

from .. import log, native
from ..turns import turns
from .camera import ViewCamera
from .refinement import LARGEST_DIVIDER, Refinement, Speed

WAIT_MS = 10
ORBIT_REST = 0.15  # seconds without a newer request after which a coarse picture is refined: orbits keep the processor
UNSEEN_SECONDS = 2.0  # a picture that is not drawn for so long is not improved: the viewport is covered or gone
DENOISE_SECONDS = 0.5  # between denoised pictures, but for the last
COARSE_DENOISE_SECONDS = 0.05  # coarse pictures are denoised where that takes no longer
COARSE_DENOISE_RATE = 5e5  # pixels a second, before it is known

_running: set["Worker"] = set()  # whose threads run: those of views that are gone may, for a moment


@dataclass(frozen=True)
class Request:
    """A picture to be rendered: compared as a whole, so that equal ones are not begun again."""

    edition: int  # of the scene
    frame: float  # of the timeline
    width: int
    height: int
    region: tuple[int, int, int, int]
    camera: ViewCamera
    settings: tuple  # sorted items of the core's settings, without size, region, samples
    samples: int
    channel: str  # the pass that is shown
    carried: bool  # whether it is averaged with the last picture
    denoise: denoiser.Recipe | None
    denoise_from: int  # the first sample that is denoised
    device: tuple  # arguments of native.context

    def same_place(self, other: "Request | None") -> bool:
        """Whether both are pictures of the same pixels, and both carried."""
        return other is not None and (self.carried, self.width, self.height, self.region) == (
            other.carried,
            other.width,
            other.height,
            other.region,
        )

    def only_camera_differs(self, other: "Request | None") -> bool:
        return other is not None and (self.edition, self.frame, self.settings) == (
            other.edition,
            other.frame,
            other.settings,
        )


@dataclass(frozen=True)
class Picture:
    """Pixels for the screen. They are never written to again."""

    request: Request
    pixels: np.ndarray  # (H, W, 4) float32, bottom row first, scene-linear, premultiplied
    divider: int
    samples: int
    at: float  # time.perf_counter() when it was ready
    denoised: bool = False


def four_channels(pixels: np.ndarray) -> np.ndarray:
    """A pass of any number of channels as RGBA; what is no colour is shown as one, as Blender does."""
    if pixels.shape[2] == 4:
        return pixels
    shown = np.ones((*pixels.shape[:2], 4), np.float32)
    shown[..., :3] = pixels[..., :1] if pixels.shape[2] == 1 else pixels[..., :3]
    if pixels.shape[2] == 2:
        shown[..., 2] = 0
    return shown


def _coarse(request: Request, divider: int) -> tuple[int, int, tuple[int, int, int, int]]:
    """Size and region at 1/divider of the resolution; the region covers the full one."""
    if divider == 1:
        return request.width, request.height, request.region
    width, height = -(-request.width // divider), -(-request.height // divider)
    x0, y0, x1, y1 = request.region
    return width, height, (x0 // divider, y0 // divider, min(-(-x1 // divider), width), min(-(-y1 // divider), height))


def close_workers(seconds: float) -> None:
    """Ends all workers and waits for their threads, for so long at most."""
    workers, end = list(_running), time.perf_counter() + seconds
    for worker in workers:
        worker.close()
    for worker in workers:
        worker.join(max(end - time.perf_counter(), 0.0))


class Worker:
    """Renders what was asked for last. `scene`: the core.Scene; `engine`: told to redraw when there is a picture."""

    def __init__(self, scene, engine):
        self.scene_lock = threading.Lock()
        self.picture: Picture | None = None
        self.error = ""
        self.not_denoised = ""  # why, where a picture should have been
        self.progress: dict = {}
        self.synced: dict = {}
        self.statistics: dict | None = None  # of the last slice that was rendered in full
        self.paused = False
        self._scene, self._engine = scene, weakref.ref(engine)
        self._changed = threading.Condition()
        self._request: Request | None = None
        self._failed: Request | None = None
        self._closing = False
        self._void = False  # the scene is being edited: what is rendered now will not be shown
        self._orbits = False  # only the camera moved since the last picture
        self._refine_at = 0.0
        self._session = self._context = None
        self._speed, self._least = Speed(), 1
        self._unseen_since: float | None = None  # when the first picture was made that was not drawn
        self._ready: Request | None = None  # the core's tables hold this one's scene and camera
        self._refinement: Refinement | None = None
        self._history, self._first_sample = temporal.History(), 0
        self._coarse_rate = COARSE_DENOISE_RATE
        self._denoise_at = 0.0  # not before: time.perf_counter()
        self._thread = threading.Thread(target=self._run, name="Headwater viewport", daemon=True)
        _running.add(self)
        self._thread.start()

    def void(self) -> None:
        """The scene changes: rendering rests until `ask`, so that the edit has the processor."""
        with self._changed:
            self._void = True

    def ask(self, request: Request) -> None:
        with self._changed:
            if self._void or request != self._request:
                self._void = False
                self._request = request
                self._changed.notify_all()

    def seen(self) -> None:
        """The viewport was drawn."""
        idle, self._unseen_since = self._is_unseen(), None
        if idle:
            with self._changed:
                self._changed.notify_all()

    def _is_unseen(self) -> bool:
        since = self._unseen_since
        return since is not None and time.perf_counter() - since > UNSEEN_SECONDS

    def pause(self, paused: bool) -> None:
        if paused != self.paused:
            with self._changed:
                self.paused = paused
                self._changed.notify_all()

    @property
    def state(self) -> str:
        """For a status line."""
        refinement, request = self._refinement, self._request
        if self.paused:
            return "Paused"
        if self._ready is None and request is not None:
            return "Loading" if self._session is None else "Building"
        if turns.final_waits_or_renders:
            return "Waiting for a render"
        if refinement is not None and refinement.finished and self._ready == request:
            return "Done"
        return ""

    def close(self) -> None:
        """Ends rendering, soon."""
        with self._changed:
            self._closing = True
            self._changed.notify_all()
        session = self._session
        if session is not None:
            session.cancel()

    def join(self, seconds: float) -> None:
        """Waits for the thread's end."""
        if threading.current_thread() is not self._thread:
            self._thread.join(seconds)

    # On the worker's thread from here on.

    def _run(self) -> None:
        try:
            self._serve()
        finally:
            self._session = self._context = None
            _running.discard(self)

    def _serve(self) -> None:
        while True:
            with self._changed:
                while not self._closing and not self._has_work():
                    self._changed.wait(self._rest())
                if self._closing:
                    break
                request = self._request
            try:
                self._work(request)
                self.error = ""
            except Exception as error:
                self._fail(request, error)

    def _has_work(self) -> bool:
        request = self._request
        if request is None or self.paused or self._void or request == self._failed or self._is_unseen():
            return False
        return self._ready != request or (not self._refinement.finished and time.perf_counter() >= self._refine_at)

    def _rest(self) -> float | None:
        """Seconds until there may be work without anyone's word."""
        left = self._refine_at - time.perf_counter()
        return left if left > 0 else None

    def _fail(self, request: Request, error: Exception) -> None:
        kind = type(error).__name__
        self._ready = None
        if kind == "OutOfMemory" and self._least < LARGEST_DIVIDER:
            self._least *= 2  # a coarser picture may fit
            return
        if not isinstance(error, native.expected_errors() + (native.NativeError,)):
            traceback.print_exc()
        if kind == "DeviceLost":
            self._session = self._context = None
            native.release()
        self._failed = request  # until something changes
        self.error = str(error) or kind
        log.error(self.error, error)
        self._redraw()

    def _redraw(self) -> None:
        engine = self._engine()
        if self._unseen_since is None:
            self._unseen_since = time.perf_counter()
        try:
            if engine is not None:
                engine.tag_redraw()
                return
        except ReferenceError:
            pass  # Blender freed it
        self._closing = True

    def _open(self, request: Request) -> None:
        context = native.context(*request.device)
        if self._context is not context:
            self._session = None
            self._context, self._ready = context, None
            self._session = native.core().Session(context, self._scene)

    def _still_wanted(self) -> bool:
        return not self._closing and not self.paused

    def _give_way(self) -> None:
        session = self._session
        if session is not None:
            session.cancel()

    def _work(self, request: Request) -> None:
        """One slice of the picture, in this view's turn."""
        with turns.take(final=False, give_way=self._give_way, keep_waiting=self._still_wanted) as ours:
            if not ours:
                return
            self._open(request)
            if self._ready != request:
                self._prepare(request)
            slice_ = self._refinement.next()
            begun = time.perf_counter()
            whole = self._render(request, slice_)
            seconds = time.perf_counter() - begun
            if not whole:
                self._refinement.interrupted(slice_)
                return
            self._refinement.done(slice_, seconds)
            if self._orbits:
                self._refine_at, self._orbits = time.perf_counter() + ORBIT_REST, False
            due = self._denoising_due(request, slice_)
            names = [request.channel, *(request.denoise.guides if due else ())]
            names += temporal.GUIDES if request.carried else ()
            passes = {name: self._session.read(name) for name in dict.fromkeys(names)}
            self.statistics = self._session.stats()
        # Out of the turn: other views may render meanwhile.
        if request.carried:
            guides = [passes[name] for name in temporal.GUIDES]
            passes[request.channel] = self._history.blend(
                passes[request.channel], slice_.samples, *guides, alone=request.samples
            )
        if due and slice_.divider > 1:
            self._denoise_coarse(request, passes, slice_)
            return
        self._show(request, slice_, four_channels(passes[request.channel]))
        if due:
            self._denoise(request, passes, slice_)

    def _show(self, request: Request, slice_, pixels: np.ndarray, denoised: bool = False) -> None:
        """Puts a picture on the screen unless a better one of the same request is there."""
        shown = self.picture
        if shown is not None and shown.request == request:
            # A denoised picture stays until the next denoised one: noise does not flicker in.
            if slice_.divider > shown.divider or slice_.samples < shown.samples:
                return
            if shown.denoised and not denoised:
                return
        pixels = np.ascontiguousarray(pixels)
        self.picture = Picture(request, pixels, slice_.divider, slice_.samples, time.perf_counter(), denoised)
        self._redraw()

    def _denoising_due(self, request: Request, slice_) -> bool:
        if request.denoise is None or slice_.samples < request.denoise_from:
            return False
        if slice_.divider > 1:
            x0, y0, x1, y1 = request.region
            quick = (x1 - x0) * (y1 - y0) / slice_.divider**2 <= self._coarse_rate * COARSE_DENOISE_SECONDS
            if not quick:
                self._coarse_rate *= 1.05  # in time it is tried again
            return quick
        return self._refinement.finished or time.perf_counter() >= self._denoise_at

    def _denoise_coarse(self, request: Request, passes: dict, slice_) -> None:
        """Shows a coarse picture denoised at once. A newer request does not end it: an orbit makes one every draw."""
        begun = time.perf_counter()
        pixels, denoised = passes[request.channel], True
        try:
            quick = replace(request.denoise, prefilter="FAST", quality="FAST")
            pixels = quick.run(passes.__getitem__, lambda: self._closing)
        except denoiser.DenoiseCancelled:
            return
        except (RuntimeError, MemoryError):  # the full picture's denoising tells
            denoised = False
        else:
            rate = pixels.shape[0] * pixels.shape[1] / max(time.perf_counter() - begun, 1e-6)
            self._coarse_rate = 0.5 * (self._coarse_rate + rate)
        self._show(request, slice_, four_channels(pixels), denoised)

    def _denoise(self, request: Request, passes: dict, slice_) -> None:
        """Shows the picture denoised; a newer request ends it."""
        begun = time.perf_counter()
        try:
            pixels = request.denoise.run(passes.__getitem__, lambda: self._closing or self._request != request)
        except denoiser.DenoiseCancelled:
            return
        except (RuntimeError, MemoryError) as error:  # the noisy picture stays
            self.not_denoised = denoiser.unavailable() or str(error) or type(error).__name__
            self.picture = replace(self.picture, denoised=False)  # a coarse one gives way
            self._show(request, slice_, four_channels(passes[request.channel]))
            return
        finally:
            now = time.perf_counter()
            self._denoise_at = now + max(DENOISE_SECONDS, now - begun)  # rendering gets half of the time at least
        self.not_denoised = ""
        self._show(request, slice_, pixels, denoised=True)

    def _prepare(self, request: Request) -> None:
        """Brings the device in step with the scene and the camera."""
        moving = request.only_camera_differs(self._ready)
        with self.scene_lock:
            request.camera.apply(self._scene)
            self.synced = self._session.sync()
        self._begin_history(request)
        x0, y0, x1, y1 = request.region
        self._refinement = Refinement(
            (x1 - x0) * (y1 - y0), request.samples, self._speed, moving=moving, least=self._least
        )
        self._ready, self._orbits = request, moving
        self._denoise_at = 0.0  # the first full picture is denoised whenever the last one was

    def _begin_history(self, request: Request) -> None:
        """What was shown becomes the past, and the next samples are other ones; motion is that since the last sync."""
        if not request.carried or not request.same_place(self._ready):
            self._history.clear()
            self._first_sample = 0
            return
        self._history.advance()
        # After a finished picture nothing is to be gained by others: equal scenes give equal pictures.
        done = self._refinement.finished
        self._first_sample = 0 if done else (self._first_sample + max(self._refinement.samples, 1)) % 2**24

    def _render(self, request: Request, slice_) -> bool:
        """Whether the slice was rendered in full."""
        width, height, region = _coarse(request, slice_.divider)
        session = self._session
        session.start(
            dict(
                request.settings,
                width=width,
                height=height,
                region=region,
                samples=slice_.samples,
                first_sample=self._first_sample,
                resume=slice_.resume,
                continue_history=True,
            )
        )
        while not session.wait(WAIT_MS):
            stale = self._void or self._request != request
            if self._closing or self.paused or (slice_.interruptible and stale):
                session.cancel()
        session.finish()
        self.progress = session.progress()
        return not self.progress["cancelled"]
