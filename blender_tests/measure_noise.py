# SPDX-License-Identifier: Apache-2.0
"""Variance and seconds of several contestants on one .blend, taking turns: other settings, other builds, Cycles.

    python blender_tests/measure_noise.py FILE NAME=INTEGRATOR[,SETTING=VALUE...][@CHECKOUT]... [--size 320x180]
        [--samples 8] [--seeds 8]

INTEGRATOR: one of ours, or "cycles". SETTING: of it, as path_reuse=false. CHECKOUT: the folder of another
built checkout with a .venv; by default this one.
Variance is that of a picture over seeds, relative to the square of the mean (+ 0.01), the largest 0.1 % of pixels left
out.

Cycles' seeds do not move its first samples within a pixel (5.0.1): its variance at few samples leaves that noise out,
and `headwater bench`, which measures against a reference, does not.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(HERE))
from headwater.compare import load_colour  # noqa: E402


class Contestant:
    """A process of `headwater bench` that renders the file; its pictures and what they cost."""

    def __init__(self, text: str, args):
        self.name, _, rest = text.partition("=")
        integrator, _, root = rest.partition("@")
        self.cycles = integrator == "cycles"
        self.integrator, *settings = integrator.split(",")
        self.parameters = {key: json.loads(value) for key, value in (each.split("=") for each in settings)}
        self.root = Path(root).resolve() if root else HERE
        self.pictures, self.costs = [], []
        self.process = subprocess.Popen(
            [self.root / ".venv/bin/python", "-m", "headwater.bench.worker"],
            cwd=self.root,
            env=dict(os.environ, PYTHONPATH=str(self.root)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._send(
            file=str(Path(args.file).resolve()),
            engine="cycles" if self.cycles else "headwater",
            size=[int(n) for n in args.size.split("x")],
            bounces={"max_bounces": args.max_bounces},
            threads=os.cpu_count(),
            device=None,
            tracer="auto",
            persistent=True,
        )

    def _send(self, **question):
        self.process.stdin.write(json.dumps(question) + "\n")
        self.process.stdin.flush()

    def render(self, seed: int, samples: int, folder: str) -> None:
        wanted = {"light_tree": True}
        if not self.cycles:
            wanted = {"integrator": self.integrator, "lights": None, "estimator": "paper", "noise_threshold": None}
            wanted["parameters"] = self.parameters
        path = f"{folder}/{self.name}_{seed}_####.exr"
        self._send(
            contestant=wanted, seed=seed, samples=samples, frames=[1], output=path, lead=[], lead_samples=samples
        )
        for line in self.process.stdout:
            if line.startswith('{"error"'):
                sys.exit(f"{self.name}: {json.loads(line)['error']}")
            if line.startswith('{"renders"'):
                self.costs.append(json.loads(line)["renders"][0])
                self.pictures.append(load_colour(path.replace("####", "0001")))
                return
        sys.exit(f"{self.name}: its process ended")

    def line(self, mean: np.ndarray, first: dict) -> str:
        relative = (np.var(self.pictures, axis=0, ddof=1) / (mean**2 + 0.01)).mean(-1).ravel()
        relative.sort()
        noise = relative[: relative.size - max(1, relative.size // 1000)].mean()
        # Without the first render, which makes kernels.
        cpu, sampling = (float(np.median([c[k] for c in self.costs[1:]])) for k in ("cpu_seconds", "sampling_seconds"))
        for key, value in (("noise", noise), ("cpu", cpu), ("sampling", sampling)):
            first.setdefault(key, value)
        signed = np.mean(self.pictures) / mean.mean() - 1
        return (
            f"{self.name:16} variance {noise:.4f} ({noise / first['noise']:.2f})  "
            f"CPU {cpu:.2f} s ({cpu / first['cpu']:.2f})  "
            f"sampling {sampling:.2f} s ({sampling / first['sampling']:.2f})  mean {signed:+.2%}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("contestants", nargs="+", metavar="NAME=INTEGRATOR[,SETTING=VALUE...][@CHECKOUT]")
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--max-bounces", type=int, default=0)
    args = parser.parse_args()
    contestants = [Contestant(text, args) for text in args.contestants]
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(args.seeds):
            for contestant in contestants:
                contestant.render(seed, args.samples, folder)
    mean = np.mean([np.mean(c.pictures, axis=0) for c in contestants], axis=0)
    first = {}
    for contestant in contestants:
        print(contestant.line(mean, first))


if __name__ == "__main__":
    main()
