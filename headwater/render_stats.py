# SPDX-License-Identifier: Apache-2.0
"""The `--stats` report of a render. Schema: docs/manual/stats.md."""

import json
import platform
import resource
import time

from headwater import __version__
from headwater.output import write_text

SCHEMA = 1
SYNC_PARTS = ("scene", "commit", "upload", "lights")  # everything before rendering but the build


def peak_rss_bytes() -> int:
    """Largest resident memory this process has had (Linux counts ru_maxrss in KiB, macOS in bytes)."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if platform.system() == "Darwin" else peak * 1024


class RenderStats:
    """Collects one record a frame and writes the whole report."""

    def __init__(self, file: str, settings: dict):
        self._start = time.perf_counter()
        self._report = {
            "schema": SCHEMA,
            "headwater": __version__,
            "python": platform.python_version(),
            "platform": platform.platform(),
            "file": file,
            "settings": settings,
            "device": None,
            "tracer": None,
            "threads": None,
            "load_seconds": 0.0,
            "frames": [],
        }

    def set(self, **values) -> None:
        """Top-level entries: device, tracer, threads, load_seconds, engine, versions …"""
        self._report.update(values)

    def add_frame(self, frame, output: str, layers: list, seconds: float, *, cancelled: bool = False) -> None:
        """`layers`: one {"view_layer", "sync", "render"} each; `render` is what Session.stats() returned, `sync` what
        Session.sync() returned with the caller's `scene_seconds` (reading the file's scene into edits) added."""
        self._report["frames"].append(
            {
                "frame": frame,
                "output": output,
                "seconds": seconds,
                "cancelled": cancelled,
                "layers": layers,
                "peak_rss_bytes": peak_rss_bytes(),
            }
        )

    def report(self, status: str) -> dict:
        """The whole report. status: "done", "cancelled" or "failed"."""
        frames = self._report["frames"]
        layers = [layer for frame in frames for layer in frame["layers"]]
        stages = {}
        for layer in layers:
            for name, seconds in (layer["render"].get("stages") or {}).items():
                stages[name] = stages.get(name, 0.0) + seconds
        rays, render_seconds = _total(layers, "render", "rays"), _total(layers, "render", "seconds")
        totals = {
            "frames": len(frames),
            "wall_seconds": time.perf_counter() - self._start,
            "sync_seconds": sum(_total(layers, "sync", f"{part}_seconds") for part in SYNC_PARTS),
            "build_seconds": _total(layers, "sync", "build_seconds"),
            "render_seconds": render_seconds,
            "rays": int(rays),
            "mrays_per_second": rays / render_seconds / 1e6 if render_seconds > 0 else 0.0,
            "stage_seconds": stages,
            "peak_rss_bytes": peak_rss_bytes(),
            "peak_device_bytes": max(
                (layer["render"].get("memory", {}).get("device_peak_bytes", 0) for layer in layers), default=0
            ),
        }
        reservoirs = [layer["render"]["reservoir_bytes"] for layer in layers if "reservoir_bytes" in layer["render"]]
        if reservoirs:
            totals["reservoir_bytes"] = max(reservoirs)
        return self._report | {"status": status, "totals": totals}

    def write(self, path: str, status: str) -> None:
        """Writes the report as JSON, all or nothing."""
        write_text(path, json.dumps(self.report(status), indent=2, default=str) + "\n")


def _total(layers, record, key) -> float:
    return sum(layer[record].get(key, 0) for layer in layers)
