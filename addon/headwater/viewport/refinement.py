# SPDX-License-Identifier: GPL-3.0-or-later
"""From coarse to fine: which picture a view renders next. No Blender data, no core.

While the artist orbits, a coarse picture comes quickly and nothing interrupts it; then the resolution doubles until it
is the viewport's, and samples are added in slices that grow. A new frame of the timeline starts at full resolution when
that is quick enough, since what reservoirs of the screen learned is of that resolution.
"""

import math
from dataclasses import dataclass

COARSE_SECONDS = 0.07  # for the first picture after the camera moved
FRAME_SECONDS = 0.35  # a full picture of a new frame that takes no longer is not preceded by coarse ones
SLICE_SECONDS = (0.2, 1.0)  # of the first and of late slices
FIRST_PIXELS = 1 << 14  # of the first picture, before the speed is known
LARGEST_DIVIDER = 16


@dataclass(frozen=True)
class Slice:
    """One call of the core: a picture of 1/divider of the resolution, until it has `samples` in all."""

    divider: int
    samples: int
    resume: bool  # the picture goes on
    interruptible: bool  # a newer request may cancel it


class Speed:
    """Pixels times samples a second, as last seen."""

    def __init__(self):
        self.rate = 0.0

    def note(self, pixel_samples: float, seconds: float) -> None:
        if seconds <= 0 or pixel_samples <= 0:
            return
        now = pixel_samples / seconds
        self.rate = now if self.rate == 0 else 0.5 * (self.rate + now)

    def pixels(self, seconds: float) -> float:
        return self.rate * seconds if self.rate else FIRST_PIXELS


class Refinement:
    """The slices of one picture of a view.

    pixels: of the full resolution; samples: the limit; least: dividers below it do not fit into memory.
    moving: only the camera moved (False: another frame or an edit).
    """

    def __init__(self, pixels: int, samples: int, speed: Speed, *, moving: bool, least: int = 1):
        self._pixels, self._limit, self._speed, self._least = pixels, samples, speed, least
        self._seconds = 0.0
        self.samples = 0  # of the full picture
        self._resumable = False
        budget = COARSE_SECONDS
        if not moving and speed.rate and speed.pixels(FRAME_SECONDS) >= pixels / least**2:
            budget = FRAME_SECONDS
        self._divider = least
        while self._divider < LARGEST_DIVIDER and pixels / self._divider**2 > speed.pixels(budget):
            self._divider *= 2
        self._first = True

    @property
    def finished(self) -> bool:
        return self._divider == self._least and self.samples >= self._limit

    def next(self) -> Slice:
        if self._divider > self._least or self.samples == 0:
            return Slice(self._divider, 1, False, not self._first)
        pixels = max(self._pixels / self._least**2, 1)
        seconds = min(SLICE_SECONDS[0] + 0.1 * self._seconds, SLICE_SECONDS[1])
        more = max(1, math.floor(self._speed.pixels(seconds) / pixels))
        total = min(self._limit, self.samples + more) if self._resumable else 1
        return Slice(self._divider, total, self._resumable, True)

    def done(self, slice_: Slice, seconds: float) -> None:
        """The slice was rendered in full."""
        before = self.samples if slice_.resume else 0
        self._speed.note(self._pixels / slice_.divider**2 * (slice_.samples - before), seconds)
        self._first = False
        if self._divider > self._least:
            self._divider = max(self._divider // 2, self._least)
            return
        self.samples, self._resumable = slice_.samples, True
        self._seconds += seconds

    def interrupted(self, slice_: Slice) -> None:
        """The slice ended early: what the film holds can't be gone on with."""
        if slice_.divider == self._least:
            self.samples, self._resumable = 0, False
