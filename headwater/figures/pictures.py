# SPDX-License-Identifier: Apache-2.0
"""The figures' pictures, each by a process of `headwater render`: what the report shows can be repeated by its command,
and a crash costs one picture.

Figures that ask for the same picture share it. References are kept in DIR/references under a hash of scene, size,
bounces, samples and seed; they are the mean of two independent renders, whose difference tells their own error.
"""

import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass

import numpy as np

from headwater import __version__, interrupt
from headwater.compare import load_colour
from headwater.errors import UserError
from headwater.figures.measures import reference_error
from headwater.image_io import write_exr
from headwater.output import write_text
from headwater.progress import format_seconds

REFERENCE_SEEDS = (1_000_003, 2_000_003)  # added to the pictures' seed: independent of every one of them

BRIGHT = ("Emission", "Environment")  # passes of light that reaches the camera straight from lamps and sky


class Stopped(Exception):
    """The user pressed Ctrl-C: what is done is kept, what was being rendered is not."""


@dataclass(frozen=True)
class Picture:
    """A rendered picture with what it cost."""

    pixels: np.ndarray  # (H, W, 3) float32, linear, top row first
    seconds: float  # of rendering, without reading and building the scene
    reservoir_bytes: int | None
    command: str  # that made it
    stats: dict


@dataclass(frozen=True)
class Reference:
    """A converged picture, its own error and the surfaces it shows."""

    pixels: np.ndarray
    places: np.ndarray  # (H, W, 3) world space
    lit: np.ndarray  # (H, W) whether a pixel shows surfaces only: no part of a lamp or of the sky in any sample
    error: dict  # measures.reference_error
    samples: int
    seconds: float
    command: str


class Workshop:
    """Renders for all figures of one run, with one count of what is left to do."""

    def __init__(self, folder: str, size, seed: int, reference_samples: int, device: list, progress):
        self.folder, self.size, self.seed = folder, size, seed
        self.reference_samples, self.device, self.progress = reference_samples, device, progress
        self._pictures, self._references = {}, {}
        self._steps, self._done = {}, 0.0  # work by step, work done; in samples times bounces
        self._number, self._started = 0, time.monotonic()

    def plan(self, figures) -> None:
        """Counts the work of the figures, shared pictures once, references that are kept not at all."""
        for scene, figure in figures:
            key = self._reference_key(scene, figure.bounces)
            if not os.path.isfile(self._reference_path(key)):
                self._steps[key] = self._samples(figure.bounces) * _work(figure.bounces)
            for variant in figure.variants:
                self._steps[self._key(scene, figure, variant)] = figure.samples * _work(figure.bounces)

    def picture(self, scene, figure, variant) -> Picture:
        """The variant's picture. Raises UserError with the render's reason, Stopped."""
        key = self._key(scene, figure, variant)
        if key not in self._pictures:
            self._number += 1
            options = [*variant.arguments(), "--samples", str(figure.samples)]
            try:
                self._pictures[key] = self._render(
                    scene,
                    figure.bounces,
                    options,
                    self.seed,
                    f"figure {figure.id}, {variant.label}",
                    self._steps.get(key, 0),
                )
            except UserError as error:
                self._pictures[key] = error
        found = self._pictures[key]
        if isinstance(found, UserError):
            raise found
        return found

    def reference(self, scene, bounces: int) -> Reference:
        """The scene's reference, rendered or found. Raises as `picture`."""
        key = self._reference_key(scene, bounces)
        if key not in self._references:
            path = self._reference_path(key)
            if not os.path.isfile(path):
                self._number += 1
                self._make_reference(scene, bounces, path, self._steps.get(key, 0))
            self._references[key] = _read_reference(path)
        return self._references[key]

    def _samples(self, bounces: int) -> int:
        """A reference's: bounces spread light, so that its noise is less, and cost several times as much."""
        return self.reference_samples if bounces == 0 else max(2, self.reference_samples // 2)

    def machine(self) -> dict:
        """Device and tracer of the pictures rendered so far; empty where there are none."""
        for found in self._pictures.values():
            if isinstance(found, Picture):
                return {name: found.stats.get(name) for name in ("device", "tracer")}
        return {}

    def _make_reference(self, scene, bounces, path, work):
        half = max(1, self._samples(bounces) // 2)
        options = ["--integrator", "path", "--lights", "power", "--samples", str(half)]
        options += ["--passes", ",".join(["Combined", *BRIGHT])]
        label = f"reference of {scene.name}, {bounces} bounces"
        halves = [
            self._render(scene, bounces, options, self.seed + seed, label, work / 2, BRIGHT) for seed in REFERENCE_SEEDS
        ]
        # One sample: places must be of surfaces, not means of several.
        guide = ["--integrator", "path", "--samples", "1", "--passes", "Combined,Position"]
        seen = self._render(scene, 0, guide, self.seed, f"surfaces of {scene.name}", 0, ("Position",))
        mean = (halves[0].pixels + halves[1].pixels) / 2
        passes = {"Combined": np.dstack([mean, np.ones(mean.shape[:2], np.float32)])}
        passes |= {name: np.mean([half.stats["passes"][name] for half in halves], axis=0) for name in BRIGHT}
        passes["Position"] = seen.stats["passes"]["Position"]
        facts = {
            "error": reference_error(halves[0].pixels, halves[1].pixels, _lit(mean, *(passes[b] for b in BRIGHT))),
            "samples": 2 * half,
            "seconds": halves[0].seconds + halves[1].seconds,
            "command": halves[0].command,
        }
        os.makedirs(os.path.dirname(path), exist_ok=True)
        write_text(os.path.splitext(path)[0] + ".json", json.dumps(facts, indent=1) + "\n")
        # Last, as its presence says that the reference is whole.
        write_exr(path, {name: pixels[::-1] for name, pixels in passes.items()}, depth="float")

    def _render(self, scene, bounces, options, seed, label, work, more=()) -> Picture:
        command = ["render", scene.blend, *options, "--max-bounces", str(bounces), "--seed", str(seed)]
        command += ["--size", f"{self.size[0]}x{self.size[1]}", "--no-clamp", *self.device]
        environment = dict(os.environ)
        root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, (root, environment.get("PYTHONPATH"))))
        with tempfile.TemporaryDirectory(prefix="headwater-figures-") as folder:
            exr, stats_path = os.path.join(folder, "picture.exr"), os.path.join(folder, "stats.json")
            self._run(
                [sys.executable, "-m", "headwater", *command, "-o", exr, "--stats", stats_path],
                environment,
                label,
                work,
            )
            with open(stats_path, encoding="utf-8") as file:
                stats = json.load(file)
            pixels = load_colour(exr)
            if more:
                stats["passes"] = {name: load_colour(exr, pass_name=name) for name in more}
        self._done += work
        said = " ".join(["headwater", *(os.path.basename(word) if word == scene.blend else word for word in command)])
        return Picture(pixels, stats["totals"]["render_seconds"], _find(stats, "reservoir_bytes"), said, stats)

    def _run(self, command, environment, label, work):
        """Runs a render while showing its progress. Raises UserError with its last words, Stopped."""
        started = time.monotonic()
        # A session of its own: a terminal's Ctrl-C reaches this process only, which then ends the render.
        child = subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        said = []
        reader = threading.Thread(target=lambda: said.extend(child.stderr), daemon=True)
        try:
            reader.start()
            while child.poll() is None:
                if interrupt.requested():
                    raise Stopped
                self._show(label, work, started, said)
                time.sleep(0.05)
        finally:
            if child.poll() is None:
                child.terminate()  # ends the render after the sample it is at; its picture is not used
                try:
                    child.wait(5)
                except subprocess.TimeoutExpired:
                    child.kill()
                    child.wait()
            reader.join(5)
            child.stderr.close()
        if child.returncode != 0:
            words = [line.strip() for line in said if line.strip()]
            last = next((w for w in reversed(words) if "error:" in w), words[-1] if words else "")
            reason = last.split("error: ", 1)[-1] or "no reason given"
            raise UserError(f"{label}: {reason} (status {child.returncode})")

    def _show(self, label, work, started, said):
        """One line: which step, how far it is, how long all steps will take yet."""
        part = 0.0
        for line in reversed(said):
            if found := re.search(r"(\d+)/(\d+)", line):
                part = int(found[1]) / max(int(found[2]), 1)
                break
        total, done = sum(self._steps.values()), self._done + work * min(part, 1.0)
        passed = time.monotonic() - self._started
        left = f"all {format_seconds(passed * (total - done) / done)} left" if done > 0 and total > done else ""
        text = f"{format_seconds(time.monotonic() - started)}  {left}"
        self.progress.update_text(f"[{self._number}/{len(self._steps)}] {label}", part, text.strip())

    def _key(self, scene, figure, variant) -> str:
        return json.dumps([scene.blend, figure.samples, figure.bounces, variant.arguments()])

    def _reference_key(self, scene, bounces) -> str:
        what = [__version__, scene.digest, self.size, bounces, self._samples(bounces), self.seed]
        return f"{scene.name}-{hashlib.sha256(json.dumps(what).encode()).hexdigest()[:12]}"

    def _reference_path(self, key) -> str:
        return os.path.join(self.folder, "references", f"{key}.exr")


def _work(bounces: int) -> float:
    """Cost of a sample in samples of direct light: most paths end long before ten bounces."""
    return 1 + min(bounces, 4)


def _read_reference(path) -> Reference:
    with open(os.path.splitext(path)[0] + ".json", encoding="utf-8") as file:
        facts = json.load(file)
    pixels, places, *bright = (load_colour(path, pass_name=name) for name in ("Combined", "Position", *BRIGHT))
    return Reference(pixels, places, _lit(pixels, *bright), **facts)


def _lit(pixels, *bright) -> np.ndarray:
    """Reference.lit from the picture and its passes of light that comes straight from lamps and sky."""
    return (pixels > 0).any(axis=2) & ~(np.concatenate(bright, axis=2) > 0).any(axis=2)


def _find(report, key: str):
    """The largest value under `key` anywhere in a JSON object; None where it does not occur."""
    if isinstance(report, dict):
        found = [report[key]] if isinstance(report.get(key), (int, float)) else []
        found += [_find(value, key) for value in report.values()]
    elif isinstance(report, list):
        found = [_find(value, key) for value in report]
    else:
        return None
    found = [value for value in found if value is not None]
    return max(found) if found else None
