# SPDX-License-Identifier: Apache-2.0
"""`headwater bench --gpu-report`: what a device does a second, on a scene made by code.

For each Tracer that the device has: rays a second over an array of rays, and for each integrator frames a second (a
frame is one sample of every pixel and Combined back on the host, reservoirs kept) with the stages' milliseconds.
"""

import json
import os
import sys
import time

from headwater import __version__, interrupt
from headwater.bench import contestants
from headwater.bench.gpu_scene import build
from headwater.bench.process import machine
from headwater.bench.text import print_table
from headwater.core import load
from headwater.errors import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_USAGE, UserError, first_line
from headwater.output import check_output, write_text
from headwater.progress import Progress
from headwater.render import TRACERS

WAIT_MS = 20
TRIANGLES, RAYS, REPEATS = 320_000, 1 << 19, 3  # of the rays' benchmark
STAGES_SHOWN = 6


def run(args) -> int:
    """Runs the report; exit status 1 when not one integrator could be measured."""
    core = load()
    output = check_output(args.output, (".md", ".json")) if args.output else None
    size = args.size or (1920, 1080)
    progress = Progress()
    with interrupt.Watch():
        report = collect(core, args, size, progress)
    progress.close()
    text = as_text(report)
    if output:
        is_json = output.lower().endswith(".json")
        write_text(output, json.dumps(report, indent=1, default=str) + "\n" if is_json else text)
    _print(report)
    if interrupt.requested():
        return EXIT_INTERRUPTED
    return 0 if any(row.get("frames_per_second") for row in report["integrators"]) else EXIT_FAILED


def collect(core, args, size, progress) -> dict:
    """The report as a JSON-ready dictionary. UserError when the device can't be opened with any Tracer."""
    names = [args.tracer] if args.tracer != "auto" else [name for name in TRACERS if name != "auto"]
    chosen = args.integrators if args.integrators != ["path"] else list(core.integrators())
    racers = [contestants.parse(name, core) for name in chosen]
    for racer in racers:
        if racer.engine != "headwater":
            raise UserError("--gpu-report measures our integrators alone: no cycles", EXIT_USAGE)
        if racer.noise_threshold is not False:
            raise UserError(f"'{racer.text}': a frame of one sample has no use for noise-threshold", EXIT_USAGE)
    report = {"headwater": __version__, "size": list(size), "frames": args.report_frames, "machine": machine()}
    report |= {"max_bounces": args.max_bounces, "tracers": [], "integrators": [], "device": None}
    why = ""
    for tracer in names:
        try:
            context = core.Context(device=args.device, tracer=tracer, threads=args.threads)
        except Exception as error:
            why = first_line(error)
            report["tracers"].append({"tracer": tracer, "why_not": why})
            continue
        report["device"] = dict(context.device)
        progress.note(f"{context.device['name']}: {tracer}")
        report["tracers"].append({"tracer": tracer} | _rays(core, args, tracer, size))
        scene = build(core, size[0] / size[1])
        session = core.Session(context, scene)
        synced = session.sync()
        report["scene"] = {name: synced[name] for name in ("triangles", "instances", "lights", "meshes")}
        for racer in racers:
            if interrupt.requested():
                return report
            progress.note(f"  {racer.text}")
            report["integrators"].append(
                {"tracer": tracer, "integrator": racer.text} | _frames(session, racer, args, size)
            )
    if report["device"] is None:
        raise UserError(why)
    return report


def _rays(core, args, tracer: str, size) -> dict:
    """Mrays/s by kind of ray; or why there are none. Small pictures, as of tests, get few rays."""
    few = size[0] * size[1] < 1 << 18
    try:
        rows = core.tracer_benchmark(
            triangles=20_000 if few else TRIANGLES,
            rays=1 << 14 if few else RAYS,
            repeats=REPEATS,
            device=args.device,
            tracer=tracer,
            threads=args.threads,
        )
    except Exception as error:
        return {"why_not": first_line(error)}
    return {"mrays_per_second": [{k: v for k, v in row.items() if k in ("rays", "closest", "any")} for row in rows]}


def _frames(session, racer, args, size) -> dict:
    """Frames a second after a first one, which compiles; the stages' milliseconds in a frame."""
    settings = {"width": size[0], "height": size[1], "integrator": racer.integrator, "passes": ["Combined"]}
    settings |= {"max_bounces": args.max_bounces, "samples": 1, **racer.parameters}
    settings |= {name: value for name in ("lights", "estimator") if (value := getattr(racer, name)) is not None}
    try:
        started = time.perf_counter()
        _frame(session, settings)
        first = time.perf_counter() - started
        stages, calls, rays = {}, {}, 0
        started = time.perf_counter()
        for number in range(1, args.report_frames + 1):
            pixels = _frame(session, settings | {"seed": number, "continue_history": True})
            found = session.stats()
            for name, seconds in found["stages"].items():
                stages[name] = stages.get(name, 0.0) + 1000 * seconds / args.report_frames
                calls[name] = calls.get(name, 0) + found["stage_calls"].get(name, 0) / args.report_frames
            rays += found["rays"]
            if interrupt.requested():
                return {"why_not": "stopped"}
        passed = time.perf_counter() - started
    except Exception as error:
        return {"why_not": first_line(error)}
    if not pixels[..., :3].any():
        return {"why_not": "the picture is black"}
    return {
        "frames_per_second": args.report_frames / passed,
        "mrays_per_second": rays * 1e-6 / passed,
        "first_frame_seconds": first,
        "stage_milliseconds": stages,
        "stage_calls": calls,
        "device_bytes": found["memory"]["device_bytes"],
    }


def _frame(session, settings):
    session.start(settings)
    while not session.wait(WAIT_MS):
        if interrupt.requested():
            session.cancel()
    session.finish()
    return session.read("Combined")


def _rows(report) -> list:
    rows = [["integrator", "tracer", "frames/s", "Mrays/s", "first s", "ms by stage"]]
    for each in report["integrators"]:
        if "why_not" in each:
            continue
        stages = sorted(each["stage_milliseconds"].items(), key=lambda item: -item[1])
        numbers = [f"{each[k]:.3g}" for k in ("frames_per_second", "mrays_per_second", "first_frame_seconds")]
        shown = ", ".join(f"{name} {ms:.3g}" for name, ms in stages[:STAGES_SHOWN])
        rows.append([each["integrator"], each["tracer"], *numbers, shown])
    return rows


def _ray_rows(report) -> list:
    rows = [["tracer", "rays", "closest hit, Mrays/s", "any hit, Mrays/s"]]
    for each in report["tracers"]:
        for row in each.get("mrays_per_second", ()):
            rows.append([each["tracer"], str(row["rays"]), f"{row['closest']:.4g}", f"{row['any']:.4g}"])
    return rows


def _reasons(report) -> list:
    """A line for everything that could not be measured."""
    rows = [*report["tracers"], *report["integrators"]]
    return [
        f"{each['tracer']}{', ' + each['integrator'] if 'integrator' in each else ''}: {each['why_not']}"
        for each in rows
        if "why_not" in each
    ]


def _heading(report) -> str:
    device, size = report["device"], report["size"]
    bounces = report["max_bounces"]
    said = f"{device['name']}, driver {device['driver']}, Vulkan {device['api']}; {size[0]} x {size[1]} pixels, "
    said += "direct light" if not bounces else f"{bounces} bounces"
    if "scene" in report:
        said += f"; {report['scene']['lights']:,} lights, {report['scene']['triangles']:,} triangles"
    return said + f"; Headwater {report['headwater']}"


def as_text(report) -> str:
    """The report as Markdown."""
    parts = [f"# Speed report\n\n{_heading(report)}.\n"]
    for rows in (_ray_rows(report), _rows(report)):
        head, *body = ([cell.replace("|", "/") for cell in row] for row in rows)
        if body:
            parts.append("\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *body)) + "\n")
    if reasons := _reasons(report):
        parts.append("Not measured:\n\n" + "\n".join(f"- {reason}" for reason in reasons) + "\n")
    return "\n".join(parts)


def _print(report) -> None:
    print(_heading(report))
    for rows in (_ray_rows(report), _rows(report)):
        print_table(rows)
    for reason in _reasons(report):
        print(f"not measured: {reason}")
    sys.stdout.flush()
    if report["machine"]["load_before"][0] > (os.cpu_count() or 1):
        print("The machine was busy: a device that runs on its processor was slowed down.")
