# SPDX-License-Identifier: Apache-2.0
"""`headwater bench-speed`: seconds of the same .blend by Headwater and by Cycles, in one run.

Each measurement is a process of its own; the engines take turns, so that a machine that is busy for a while is busy for
both. Seconds a sample are the difference quotient of renders with few and with many samples: loading, compiling and
synchronizing are apart. A quotient that is not above 0 says that the samples drowned in the machine's noise: the ratio
is then "n/a". Denoising, adaptive sampling and clamping are off; Cycles' light tree is on.
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import time

from headwater.bench.process import environment, last_words, machine
from headwater.bench.text import print_table
from headwater.errors import EXIT_FAILED, EXIT_USAGE, UserError
from headwater.render import BLEND, TRACERS, check_file, natural, positive, size

ENGINES = ("headwater", "cycles")
MODES = ("stills", "keyframes", "script")
_COLUMNS = (
    ("sample_seconds", "s/sample", "{:.3f}"),
    ("sample_cpu_seconds", "CPU s/sample", "{:.3f}"),
    ("sync_build_seconds", "sync+build s", "{:.3f}"),
    ("first_sync_build_seconds", "first", "{:.3f}"),
    ("first_image_seconds", "first image s", "{:.1f}"),
    ("first_image_cpu_seconds", "CPU s", "{:.1f}"),
    ("peak_mib", "peak MiB", "{:.0f}"),
)


def add_arguments(parser) -> None:
    """Options of the subcommand."""
    add = parser.add_argument
    add("files", nargs="+", metavar="FILE", help=".blend files")
    add("--size", type=size, default=(640, 360), metavar="WxH")
    add("--samples", type=positive, nargs=2, default=(2, 10), metavar=("FEW", "MANY"))
    add("--rounds", type=positive, default=2, help="renders with few and many samples in each process")
    add("--repeats", type=positive, default=3, help="processes of each engine; medians count")
    add("--max-bounces", type=natural, default=0, metavar="N", help="0: direct light only (default)")
    add("--threads", type=natural, default=0, help="0: all")
    add("--device", default="", metavar="NAME", help="of Headwater")
    add("--tracer", choices=TRACERS, default="auto", help="of Headwater")
    add("--cold", action="store_true", help="an empty cache folder for every process: no compiled kernels are found")
    add("--mode", choices=MODES, default="stills", help="keyframes, script: frames between which one object moves")
    add("--frames", type=positive, default=3, help="frames of the modes keyframes and script")
    add("--move", default="", metavar="OBJECT", help="which object moves (default: the last mesh)")
    add("--persistent", action="store_true", help="persistent data between frames (script: always)")
    add("--max-ratio", type=_ratio, metavar="X", help="fail when ours/Cycles' seconds a sample is larger, or n/a")
    add("--timeout", type=positive, default=1800, help="seconds a process may take")
    add("--json", metavar="OUT.json", help="write all measurements")


def run(args) -> int:
    """Runs the subcommand."""
    for file in args.files:
        check_file(file)
        if not file.endswith(BLEND):
            raise UserError(f"'{file}' is not a .blend file", EXIT_USAGE)
    if args.samples[0] >= args.samples[1]:
        raise UserError("--samples: FEW must be less than MANY", EXIT_USAGE)
    if args.max_ratio is not None and args.mode != "stills":
        raise UserError(f"--max-ratio is of seconds a sample, which mode {args.mode} does not measure", EXIT_USAGE)
    report = {"machine": machine(), "settings": _settings(args), "files": []}
    failed = False
    for file in args.files:
        results = {engine: [] for engine in ENGINES}
        for repeat in range(args.repeats):
            for engine in ENGINES if repeat % 2 == 0 else reversed(ENGINES):
                results[engine].append(_measure(args, file, engine))
                print(".", end="", file=sys.stderr, flush=True)
        print(file=sys.stderr)
        entry = {"file": os.path.basename(file), "processes": results}
        if args.mode == "stills":
            entry |= {engine: _stills_summary(results[engine], args.samples) for engine in ENGINES}
            ratio = _print_stills(entry)
            failed = failed or (args.max_ratio is not None and (ratio is None or ratio > args.max_ratio))
        else:
            entry |= {engine: _frames_summary(results[engine]) for engine in ENGINES}
            _print_frames(entry)
        report["files"].append(entry)
    report["machine"]["load_after"] = os.getloadavg()
    if args.json:
        with open(args.json, "w", encoding="utf-8") as out:
            json.dump(report, out, indent=1)
    return EXIT_FAILED if failed else 0


def _ratio(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f"'{text}' is no number above 0")
    return value


def _settings(args) -> dict:
    names = ("size", "samples", "rounds", "repeats", "max_bounces", "threads", "device", "tracer", "cold", "mode")
    return {name: getattr(args, name) for name in (*names, "frames", "move", "persistent")}


def _measure(args, file: str, engine: str) -> dict:
    """One process. Raises UserError with its reason when it failed."""
    bounces = dict.fromkeys(
        ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"), args.max_bounces
    )
    job = {
        "file": os.path.abspath(file),
        "engine": engine,
        "size": args.size,
        "samples": args.samples,
        "rounds": args.rounds,
        "threads": args.threads,
        "bounces": bounces,
        "device": args.device,
        "tracer": args.tracer,
        "mode": args.mode,
        "frames": args.frames,
        "move": args.move,
        "persistent": args.persistent or args.mode == "script",
    }
    variables = environment(args.threads)
    with tempfile.TemporaryDirectory(prefix="headwater-bench-") as folder:
        if args.cold:
            variables["XDG_CACHE_HOME"] = os.path.join(folder, "cache")
            variables.pop("MESA_SHADER_CACHE_DIR", None)
        job_path, result_path, log_path = (os.path.join(folder, n) for n in ("job.json", "result.json", "log"))
        with open(job_path, "w", encoding="utf-8") as out:
            json.dump(job, out)
        started = time.time()
        with open(log_path, "wb") as log:
            command = [sys.executable, "-m", "headwater.bench_speed_worker", job_path, result_path]
            try:
                status = subprocess.run(
                    command, env=variables, stdout=log, stderr=log, timeout=args.timeout, check=False
                ).returncode
            except subprocess.TimeoutExpired:
                raise UserError(f"'{file}' by {engine}: more than {args.timeout} s") from None
        if not os.path.exists(result_path):
            said = last_words(log_path)
            raise UserError(f"'{file}' by {engine}: the process ended with status {status}: {said}")
        with open(result_path, encoding="utf-8") as file_in:
            result = json.load(file_in)
    if "error" in result:
        raise UserError(f"'{file}' by {engine}: {result['error']}")
    result["first_image_seconds"] = result["renders"][0]["ended_at"] - started
    return result


def _per_sample(process: dict, key: str, samples) -> float:
    few, many = samples
    cost = {
        count: statistics.median(r[key] for r in process["renders"][1:] if r["samples"] == count) for count in samples
    }
    return (cost[many] - cost[few]) / (many - few)


def _stages_per_sample(renders: list, samples) -> dict:
    """Seconds a sample of each wavefront stage, by the same difference quotient."""
    few, many = ([r["core"]["stages"] for r in renders if r["samples"] == count] for count in samples)
    step = samples[1] - samples[0]
    return {
        name: (statistics.median(m[name] for m in many) - statistics.median(f.get(name, 0.0) for f in few)) / step
        for name in many[0]
    }


def _stills_summary(processes: list, samples) -> dict:
    """Medians over processes; the first picture of each is kept apart from the others."""
    median = statistics.median
    summary = {
        "sample_seconds": median(_per_sample(p, "seconds", samples) for p in processes),
        "sample_cpu_seconds": median(_per_sample(p, "cpu_seconds", samples) for p in processes),
        "sync_build_seconds": median(r["sync_build_seconds"] for p in processes for r in p["renders"][1:]),
        "first_sync_build_seconds": median(p["renders"][0]["sync_build_seconds"] for p in processes),
        "first_image_seconds": median(p["first_image_seconds"] for p in processes),
        "first_image_cpu_seconds": median(p["renders"][0]["cpu_seconds"] for p in processes),
        "peak_mib": median(p["peak_rss_bytes"] for p in processes) / 2**20,
    }
    stages = [_stages_per_sample(p["renders"][1:], samples) for p in processes if "core" in p["renders"][0]]
    if stages:
        summary["stage_seconds_per_sample"] = {
            name: median(found.get(name, 0.0) for found in stages) for name in stages[0]
        }
    return summary


def _frames_summary(processes: list) -> dict:
    frames = zip(*(p["renders"] for p in processes), strict=True)
    return {"sync_build_seconds": [statistics.median(r["sync_build_seconds"] for r in frame) for frame in frames]}


def _quotient(ours: float, theirs: float) -> float | None:
    """ours / theirs; None where either is not above 0, as a difference between two noisy times can be."""
    return ours / theirs if ours > 0 and theirs > 0 else None


def _print_stills(entry: dict) -> float | None:
    """The table of one file. Returns ours / Cycles' seconds a sample, None where that says nothing."""
    print(entry["file"])
    rows = [["", *(title for _, title, _ in _COLUMNS)]]
    for engine in ENGINES:
        rows.append([engine, *(form.format(entry[engine][key]) for key, _, form in _COLUMNS)])
    ratios = {key: _quotient(entry["headwater"][key], entry["cycles"][key]) for key, _, _ in _COLUMNS}
    entry["ratio"] = ratios
    rows.append(["ratio", *("n/a" if ratios[key] is None else f"{ratios[key]:.3f}" for key, _, _ in _COLUMNS)])
    print_table(rows)
    return ratios["sample_seconds"]


def _print_frames(entry: dict) -> None:
    print(entry["file"])
    count = len(entry["headwater"]["sync_build_seconds"])
    rows = [["sync+build s", *(f"frame {n + 1}" for n in range(count)), "frame 2 / frame 1"]]
    for engine in ENGINES:
        seconds = entry[engine]["sync_build_seconds"]
        share = _quotient(seconds[1], seconds[0]) if count > 1 else None
        rows.append([engine, *(f"{s:.4f}" for s in seconds), "n/a" if share is None else f"{share:.2%}"])
    print_table(rows)
