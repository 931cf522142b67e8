# SPDX-License-Identifier: Apache-2.0
"""Drives a Blender with a window from inside it: a session is a generator of waits, run by a timer.

A session's file is given to Blender by `--python`, its artefact folder after `--`. It yields seconds to wait (0: the
next turn of the event loop), keeps facts in `Session.facts`, and takes pictures of the X screen by `Session.shot`. The
process ends with status 0 when the generator ends, 4 when it raises (the message is the last line of the log).
"""

import json
import os
import struct
import sys
import time
import traceback
import zlib
from pathlib import Path

import bpy
import numpy as np

EXTENSION = "bl_ext.user_default.headwater"


def arguments() -> list[str]:
    return sys.argv[sys.argv.index("--") + 1 :]


def addon():
    """The add-on's package: enables the installed extension, or the source tree named by HEADWATER_SOURCE."""
    source = os.environ.get("HEADWATER_SOURCE")
    if source:
        if source not in sys.path:
            sys.path.insert(0, source)
        import headwater.blender

        return headwater.blender.register()
    if EXTENSION not in bpy.context.preferences.addons:
        bpy.ops.preferences.addon_enable(module=EXTENSION)
    return sys.modules[EXTENSION]


def submodule(name: str):
    """A module of the add-on, e.g. "viewport.view"."""
    return sys.modules[f"{addon().__name__}.{name}"]


def resident_bytes() -> int:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) << 10
    return 0


def _png(path: Path, rgb: np.ndarray) -> None:
    height, width = rgb.shape[:2]
    rows = np.concatenate([np.zeros((height, 1), np.uint8), rgb.reshape(height, width * 3)], 1).tobytes()

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 3)) + chunk(b"IEND", b"")
    )


class Session:
    """What a session has at hand: its folder, the first window's 3D viewport, the viewport's View, pictures of it."""

    def __init__(self, steps):
        self.folder = Path(arguments()[0])
        self.folder.mkdir(parents=True, exist_ok=True)
        self.facts: dict = {}
        self._steps, self._running = steps, None
        bpy.context.preferences.view.show_splash = False
        bpy.app.timers.register(self._tick, first_interval=0.5, persistent=True)

    def _tick(self):
        try:
            if self._running is None:
                self._running = self._steps(self)
            return max(next(self._running), 0.001)
        except StopIteration:
            self._finish("")
            bpy.ops.wm.quit_blender()
            return None
        except BaseException as error:
            traceback.print_exc()
            self.shot("error")
            self.facts["at_error"] = {"engine": self.scene.render.engine, "shading": self.space.shading.type}
            self._finish(f"{type(error).__name__}: {error}")
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(4)

    def _finish(self, error: str) -> None:
        self.facts["error"] = error
        self.facts["blender"] = bpy.app.version_string
        (self.folder / "facts.json").write_text(json.dumps(self.facts, indent=1))

    @property
    def window(self):
        return bpy.context.window_manager.windows[0]

    @property
    def area(self):
        return next(area for area in self.window.screen.areas if area.type == "VIEW_3D")

    @property
    def space(self):
        return self.area.spaces.active

    @property
    def region_3d(self):
        return self.space.region_3d

    @property
    def scene(self):
        return self.window.scene

    def context(self):
        """A context as if the pointer were over the 3D viewport: for operators."""
        region = next(region for region in self.area.regions if region.type == "WINDOW")
        return bpy.context.temp_override(window=self.window, area=self.area, region=region)

    def shot(self, name: str) -> None:
        """The X screen as artefact NAME.png (Blender's own screenshot is black with OpenGL)."""
        data = (Path(os.environ["XVFB_FB"]) / "Xvfb_screen0").read_bytes()
        header = struct.unpack(">25I", data[:100])  # of an XWD file
        width, height, line = header[4], header[5], header[12]
        pixels = np.frombuffer(data, np.uint8, line * height, header[0] + 12 * header[19]).reshape(height, line)
        _png(self.folder / f"{name}.png", pixels[:, : width * 4].reshape(height, width, 4)[:, :, 2::-1])

    @property
    def views(self) -> list:
        """The add-on's open views."""
        return [view for view in submodule("viewport.view")._views if not view.closed]

    def picture(self):
        """The newest worker.Picture that belongs to what the viewport asked for last, else None."""
        for view in self.views:
            picture = view.picture
            if picture is not None and view.is_current(picture):
                return picture
        return None

    def until(self, condition, seconds: float, what: str):
        """Waits until condition() is true; AssertionError naming `what` when that takes longer."""
        end = time.perf_counter() + seconds
        while not condition():
            assert time.perf_counter() < end, f"{what}: not within {seconds} s; {[v.status for v in self.views]}"
            yield 0.02

    def settled(self, samples: int = 4, seconds: float = 20.0, after=None):
        """Waits for a picture of this moment at full resolution with that many samples.

        `after`: the Request of the picture before an edit; the edit must lead to another.
        """
        for _ in range(2):  # Blender's own turn: the edit reaches the dependency graph, and the viewport is drawn
            drawn = sum(view.draws for view in self.views)
            self.area.tag_redraw()
            yield from self.until(
                lambda drawn=drawn: sum(view.draws for view in self.views) != drawn, seconds, "a draw"
            )

        def ready() -> bool:
            picture = self.picture()
            if picture is None or picture.divider > 1 or picture.samples < samples:
                return False
            return after is None or picture.request != after

        yield from self.until(ready, seconds, f"a{'nother' if after else ''} picture of {samples} samples")

    def no_render(self, seconds: float = 20.0):
        """Waits until no final render runs: Blender begins none beside another."""
        yield from self.until(lambda: not bpy.app.is_job_running("RENDER"), seconds, "the render's end")
