# SPDX-License-Identifier: Apache-2.0
"""`headwater render`: options, their checks, and the way to the .blend or USD route."""

import os
import re

from headwater import interrupt, render_reuse
from headwater.errors import EXIT_INTERRUPTED, EXIT_USAGE, UserError, choose
from headwater.integrators import DEFAULT_INTEGRATOR
from headwater.output import check_output, frame_path
from headwater.progress import Progress
from headwater.render_request import BOUNCES, Request
from headwater.render_stats import RenderStats

TRACERS = ("auto", "ray_query", "ray_pipeline", "embree")
BLEND = (".blend",)
USD = (".usd", ".usda", ".usdc", ".usdz")
MAX_SIZE = 65536
MAX_FRAMES = 1_000_000


def add_arguments(parser) -> None:
    """Options of the subcommand. What is left out is taken from the file."""
    add = parser.add_argument
    add("file", metavar="FILE", help=".blend, .usd, .usda, .usdc or .usdz")
    add(
        "-o",
        "--output",
        metavar="OUT",
        help="OUT.exr or OUT.png; # marks the frame number (default: the file's name, .exr)",
    )
    add(
        "--exr-depth",
        choices=("half", "float"),
        default="float",
        help="of colour passes (default: float; data passes always are)",
    )
    add("--passes", metavar="A,B,C", help="passes by Cycles' names, e.g. Combined,Depth,Normal; all of them: all")
    add("--size", type=size, metavar="WxH")
    add("--region", type=region, metavar="X0,Y0,X1,Y1", help="pixels, from the bottom left; the rest is cropped away")
    add("--camera", metavar="NAME")
    add("--frames", type=frames, metavar="A-B[xSTEP]", help="one frame or a range (default: the file's current frame)")
    add("--samples", type=positive, metavar="N")
    add("--time-limit", type=seconds, metavar="S", help="seconds a frame; at least one sample is finished")
    add(
        "--noise-threshold",
        type=threshold,
        metavar="X|off",
        help="adaptive sampling: fewer samples where little noise is left, the end where the relative error is below "
        "X everywhere (0: never); off: --samples for every pixel (default: what a .blend says; of USD off)",
    )
    add("--seed", type=natural, metavar="N")
    add("--integrator", metavar="NAME", help=render_reuse.integrator_help())
    add(
        "--estimator",
        metavar="NAME",
        help="how reservoirs are merged: paper, with the paper's bias; unbiased (default: paper)",
    )
    add("--lights", metavar="auto|uniform|power|tree", help="how one light is chosen among many")
    for name, _, _ in BOUNCES:
        extra = " (0: direct light only)" if name == "max" else ""
        add(f"--{name}-bounces", type=natural, metavar="N", help=f"limit of {name} bounces{extra}")
    add("--no-clamp", action="store_true", help="no clamping of bright samples, whatever the file says")
    add(
        "--device",
        default="",
        metavar="NAME",
        help="part of a device's name, its number, or gpu, cpu (see headwater info)",
    )
    add("--tracer", default="auto", metavar="NAME", help=f"one of {', '.join(TRACERS)}")
    add("--threads", type=natural, default=0, metavar="N", help="host threads (default: all)")
    add(
        "--memory-limit",
        type=natural,
        default=0,
        metavar="MIB",
        help="most device memory a render may take, in MiB; one that needs more ends with an error (default: no limit)",
    )
    add(
        "--engine",
        choices=("headwater", "cycles"),
        default="headwater",
        help="cycles: the same .blend by Cycles, to compare",
    )
    add("--autoexec", action="store_true", help="let a .blend run its own scripts")
    add("--stats", metavar="OUT.json", help="write what the render cost")
    add("--denoise", action="store_true", help="denoise Combined; an EXR keeps the pass Noisy Image")
    add("--quiet", action="store_true", help="no progress")
    render_reuse.add_arguments(parser)


def positive(text: str) -> int:
    value = natural(text)
    if value < 1:
        raise _bad(f"{text} is not at least 1")
    return value


def natural(text: str) -> int:
    """A whole number from 0 to what 31 bits hold."""
    try:
        value = int(text)
    except ValueError:
        raise _bad(f"'{text}' is no whole number") from None
    if not 0 <= value < 2**31:
        raise _bad(f"{text} is out of range")
    return value


def seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise _bad(f"'{text}' is no number of seconds") from None
    if not 0 < value < 1e9:
        raise _bad(f"{text} is no time limit")
    return value


def threshold(text: str) -> float | bool:
    """A relative error from 0 to 1, or False from "off"."""
    if text == "off":
        return False
    try:
        value = float(text)
    except ValueError:
        raise _bad(f"'{text}' is no noise threshold: a number or off") from None
    if not 0 <= value <= 1:
        raise _bad(f"{text} is no noise threshold from 0 to 1")
    return value


def frame(text: str) -> int:
    """The number of a frame."""
    if not re.fullmatch(r"-?\d+", text) or abs(int(text)) > 1 << 20:
        raise _bad(f"'{text}' is no frame")
    return int(text)


def size(text: str):
    """(width, height) from "1920x1080"."""
    match = re.fullmatch(r"(\d+)[xX](\d+)", text)
    if not match or not all(0 < int(n) <= MAX_SIZE for n in match.groups()):
        raise _bad(f"'{text}' is no size WxH from 1x1 to {MAX_SIZE}x{MAX_SIZE}")
    return tuple(int(n) for n in match.groups())


def region(text: str):
    """(x0, y0, x1, y1) in pixels."""
    match = re.fullmatch(r"(\d+),(\d+),(\d+),(\d+)", text)
    values = [int(n) for n in match.groups()] if match else None
    if not values or values[0] >= values[2] or values[1] >= values[3]:
        raise _bad(f"'{text}' is no region X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1")
    return tuple(values)


def frames(text: str) -> range:
    """Frame numbers of "7", "1-48", "1-48x2" or "-5--1"."""
    match = re.fullmatch(r"(-?\d+)(?:-(-?\d+)(?:x(\d+))?)?", text)
    if not match:
        raise _bad(f"'{text}' is no frame or range A-B[xSTEP]")
    first = int(match[1])
    last = first if match[2] is None else int(match[2])
    step = int(match[3] or 1)
    if last < first or step < 1 or (last - first) // step >= MAX_FRAMES or max(abs(first), abs(last)) > 1 << 20:
        raise _bad(f"'{text}' is an empty or endless range of frames")
    return range(first, last + 1, step)


def _bad(message):
    import argparse

    return argparse.ArgumentTypeError(message)


def run(args) -> int:
    """Runs the subcommand: checks everything that can be checked, then renders."""
    extension = os.path.splitext(args.file)[1].lower()
    if extension not in BLEND + USD:
        raise UserError(f"'{args.file}': only {', '.join(BLEND + USD)} can be rendered", EXIT_USAGE)
    check_file(args.file)
    if args.engine == "cycles" and extension not in BLEND:
        raise UserError("--engine cycles renders .blend files only", EXIT_USAGE)
    output = args.output or os.path.splitext(os.path.basename(args.file))[0] + ".exr"
    check_output(frame_path(output, args.frames[0] if args.frames else 1, animated=args.frames is not None))
    if args.stats:
        check_output(args.stats, ())
    request = Request.from_args(args, output)
    check_names(request)

    progress = Progress(quiet=args.quiet)
    stats = RenderStats(os.path.abspath(args.file), request.as_dict())
    status = "failed"
    try:
        with interrupt.Watch():
            if extension in BLEND:
                from headwater.blend import render_blend as route
            else:
                from headwater.render_usd import render_usd as route
            route(request, progress, stats)
            status = "cancelled" if interrupt.requested() else "done"
    finally:
        progress.close()
        if args.stats:
            stats.write(args.stats, status)
    if status == "cancelled":
        progress.note("headwater: stopped")
        return EXIT_INTERRUPTED
    return 0


def check_file(path: str) -> None:
    """Raises UserError unless `path` is a readable file that is not empty."""
    if os.path.isdir(path):
        raise UserError(f"'{path}' is a folder", EXIT_USAGE)
    try:
        with open(path, "rb") as file:
            start = file.read(1)
    except OSError as error:
        raise UserError(f"'{path}' can't be read: {(error.strerror or str(error)).lower()}", EXIT_USAGE) from error
    if not start:
        raise UserError(f"'{path}' is empty")


def check_names(request: Request) -> None:
    """Raises UserError for unknown names of integrator, estimator, light choice, tracer or pass, and for parameters
    that the integrator refuses. A .blend may name an integrator of its own: blend_overrides checks its parameters."""
    choose("tracer", request.tracer, TRACERS)
    if request.lights is not None:
        choose("light choice", request.lights, ("auto", "uniform", "power", "tree"))
    if request.engine != "headwater":
        return
    from headwater.core import load

    core = load()
    decided = request.integrator is not None or not request.file.lower().endswith(BLEND)
    render_reuse.check(
        core, request.integrator or DEFAULT_INTEGRATOR, request.estimator, request.reuse if decided else {}
    )
    known = [name for name, _ in core.all_passes()]
    if request.passes == ["all"]:
        request.passes = known
    for name in request.passes or ():
        choose("pass", name, known)
