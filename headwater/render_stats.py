# SPDX-License-Identifier: Apache-2.0
"""The `--stats` report of a render. Schema: docs/manual/stats.md."""

import json
import platform
import resource
import time

from headwater import __version__
from headwater.output import write_text

SCHEMA = 1


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

    def add_frame(self, frame: int, output: str | None, *, sync: dict, render: dict, seconds: float, cancelled=False) -> None:
        """`sync`: what Session.sync() returned plus the caller's own parts; `render`: what Session.stats() returned."""
        self._report["frames"].append(
            {
                "frame": frame,
                "output": output,
                "seconds": seconds,
                "cancelled": cancelled,
                "sync": sync,
                "render": render,
                "peak_rss_bytes": peak_rss_bytes(),
            }
        )

    def report(self, status: str) -> dict:
        """The whole report. status: "done", "cancelled" or "failed"."""
        frames = self._report["frames"]
        rays = sum(_number(f["render"], "rays") for f in frames)
        render_seconds = sum(_number(f["render"], "seconds") for f in frames)
        stages = {}
        for frame in frames:
            for name, seconds in stage_seconds(frame["render"]).items():
                stages[name] = stages.get(name, 0.0) + seconds
        totals = {
            "frames": len(frames),
            "wall_seconds": time.perf_counter() - self._start,
            "sync_seconds": sum(_number(f["sync"], "sync_seconds") for f in frames),
            "build_seconds": sum(_number(f["sync"], "build_seconds") for f in frames),
            "render_seconds": render_seconds,
            "rays": int(rays),
            "mrays_per_second": rays / render_seconds / 1e6 if render_seconds > 0 else 0.0,
            "stage_seconds": stages,
            "peak_rss_bytes": peak_rss_bytes(),
            "peak_device_bytes": max((int(_number(f["render"], "peak_memory")) for f in frames), default=0),
        }
        return self._report | {"status": status, "totals": totals}

    def write(self, path: str, status: str) -> None:
        """Writes the report as JSON, all or nothing."""
        write_text(path, json.dumps(self.report(status), indent=2, default=str) + "\n")


def stage_seconds(render: dict) -> dict:
    """Seconds by stage out of Session.stats(), whose entries are {name: seconds} or [{name, seconds, calls}]."""
    stages = render.get("stages") or {}
    if isinstance(stages, dict):
        return {n: float(s["seconds"] if isinstance(s, dict) else s) for n, s in stages.items()}
    return {stage["name"]: float(stage["seconds"]) for stage in stages}


def _number(record, key) -> float:
    value = record.get(key, 0) if isinstance(record, dict) else 0
    return value if isinstance(value, (int, float)) else 0
