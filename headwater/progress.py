# SPDX-License-Identifier: Apache-2.0
"""Progress on stderr: one line redrawn in place on a terminal, a plain line now and then elsewhere."""

import sys
import time
from contextlib import contextmanager


class Progress:
    """Shows a render's progress; `every` is the least time between plain lines, in seconds."""

    def __init__(self, stream=None, every: float = 5.0, quiet: bool = False):
        self._stream = stream or sys.stderr
        self._terminal = bool(getattr(self._stream, "isatty", lambda: False)())
        self._every = 0.1 if self._terminal else every
        self._quiet = quiet
        self._shown = 0.0
        self._open_line = False

    def update(self, label: str, progress: dict, *, force: bool = False) -> None:
        """`progress`: sample, samples, mrays, seconds, remaining (< 0: unknown), memory, stage; all may be missing."""
        now = time.monotonic()
        if self._quiet or (now - self._shown < self._every and not force):
            return
        self._shown = now
        self._draw(format_progress(label, progress, bar=self._terminal))

    def update_text(self, label: str, part: float, text: str) -> None:
        """A line for a renderer that tells a part done (0..1) and a text of its own."""
        now = time.monotonic()
        if self._quiet or not text or now - self._shown < self._every:
            return
        self._shown = now
        self._draw("  ".join([label, *([draw_bar(part)] if self._terminal else []), text]))

    @contextmanager
    def redirected(self, stream):
        """Shows everything on another stream for the block's time."""
        previous, self._stream = self._stream, stream
        try:
            yield
        finally:
            self.close()
            self._stream = previous

    def note(self, text: str) -> None:
        """A line that stays: a frame's end, a warning."""
        if not self._quiet:
            self.close()
            print(text, file=self._stream, flush=True)

    def warn(self, text: str) -> None:
        """A warning that stays, shown even when quiet."""
        self.close()
        print(f"headwater: warning: {text}", file=self._stream, flush=True)

    def close(self) -> None:
        """Ends the line that is being redrawn."""
        if self._open_line:
            print(file=self._stream, flush=True)
            self._open_line = False

    def _draw(self, text):
        if self._terminal:
            self._stream.write("\r\x1b[K" + text)
            self._stream.flush()
            self._open_line = True
        else:
            print(text, file=self._stream, flush=True)


def format_progress(label: str, progress: dict, bar: bool = False) -> str:
    """One line: label, bar, samples, Mrays/s, memory, time taken and left."""
    sample, samples = progress.get("sample", 0), progress.get("samples", 0)
    part = sample / samples if samples else 0.0
    pieces = [label]
    if bar and samples:
        pieces.append(draw_bar(part))
    if samples:
        pieces.append(f"sample {sample}/{samples}")
    if progress.get("stage") and not sample:
        pieces.append(str(progress["stage"]))
    if progress.get("mrays"):
        pieces.append(f"{progress['mrays']:.2f} Mrays/s")
    if progress.get("memory"):
        pieces.append(f"{progress['memory'] / 2**20:.0f} MiB")
    pieces.append(format_seconds(progress.get("seconds", 0.0)))
    if progress.get("remaining", -1) is not None and progress.get("remaining", -1) >= 0 and samples:
        pieces.append(f"{format_seconds(progress['remaining'])} left")
    return "  ".join(pieces)


def draw_bar(part: float, width: int = 24) -> str:
    """A bar of which `part` (0..1) is filled."""
    filled = int(width * min(max(part, 0.0), 1.0) + 0.5)
    return "█" * filled + "░" * (width - filled)


def format_seconds(seconds: float) -> str:
    """12.3s, 4:05, 1:02:33."""
    if seconds < 60:
        return f"{seconds:.1f}s"
    whole = int(seconds + 0.5)
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"
