# SPDX-License-Identifier: Apache-2.0
"""`headwater bench`: error against time beside Cycles on the same .blend, or the speed report of a device.

Every picture is rendered by a process that the engine lives in; the engines take turns, so that a machine that is busy
for a while is busy for all. docs/manual/bench.md says what is measured and how.
"""

import os
import shlex
import sys

from headwater import __version__, denoiser, interrupt
from headwater.core import load
from headwater.errors import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_USAGE, UserError, first_line
from headwater.output import check_output
from headwater.progress import Progress
from headwater.render import BLEND, TRACERS, check_file, frame, frames, natural, positive, seconds, size

REFERENCES = ("together", "headwater", "cycles", "own")


def add_arguments(parser) -> None:
    """Options of the subcommand."""
    add = parser.add_argument
    add("files", nargs="*", metavar="FILE", help=".blend files")
    add("-o", "--output", metavar="DIR", help="folder of the report; with --gpu-report a .md or .json file")
    add("--against", default="cycles", metavar="NAME", help="cycles (default) or one of --integrators' form")
    add(
        "--integrators",
        nargs="+",
        default=["path"],
        metavar="NAME[:OPTION=VALUE,…]",
        help="integrators of ours, such as path:lights=power or restir:candidates=16,neighbours=3 (default: path)",
    )
    add("--time", type=seconds, default=60.0, metavar="S", help="of sampling, of the longest render (default: 60)")
    add("--seeds", type=positive, default=5, help="independent repetitions; medians count (default: 5)")
    add("--size", type=size, metavar="WxH", help="default 640x360; with --gpu-report 1920x1080")
    add("--max-bounces", type=natural, default=0, metavar="N", help="0: direct light only (default)")
    add("--frames", type=frames, metavar="A-B", help="animation: what integrators keep goes from frame to frame")
    add("--frame", type=frame, metavar="N", help="one frame, with what of the scene is kept from frame to frame")
    add("--animation-from", type=frame, metavar="M", help="with --frame: after frames M to N-1, which are not counted")
    add("--denoise", action="store_true", help="measure pictures after denoising, by the same denoiser for both")
    add(
        "--reference",
        choices=REFERENCES,
        default="together",
        help="measure against both engines' mean (default), one's, or each engine against its own",
    )
    add("--reference-integrator", default="path", metavar="NAME", help="ours that makes references (default: path)")
    add("--reference-time", type=seconds, metavar="S", help="of each engine and frame (default: 4 times --time)")
    add("--threads", type=natural, default=0, metavar="N", help="of both engines; 0: all")
    add("--device", default="", metavar="NAME", help="of Headwater")
    add("--tracer", choices=TRACERS, default="auto", help="of Headwater")
    add("--timeout", type=positive, default=3600, metavar="S", help="seconds a render may take")
    add("--gpu-report", action="store_true", help="frames and rays a second of a device instead; needs no FILE")
    add("--report-frames", type=positive, default=16, metavar="N", help="frames measured by --gpu-report (default: 16)")


def run(args) -> int:
    """Runs the subcommand."""
    if args.gpu_report:
        from headwater.bench.gpu_report import run as report

        if args.files:
            raise UserError("--gpu-report has a scene of its own: it takes no FILE", EXIT_USAGE)
        return report(args)
    return _against(args)


def _against(args) -> int:
    from headwater.bench import contestants
    from headwater.bench.measure import measure
    from headwater.bench.process import machine
    from headwater.bench.report import table, write_report
    from headwater.bench.text import print_table

    if not args.files:
        raise UserError("which .blend? (or --gpu-report)", EXIT_USAGE)
    if not args.output:
        raise UserError("where to? -o DIR is missing", EXIT_USAGE)
    for file in args.files:
        check_file(file)
        if not file.endswith(BLEND):
            raise UserError(f"'{file}' is not a .blend file", EXIT_USAGE)
    _choose_frames(args)
    if args.denoise and denoiser.unavailable():
        raise UserError(f"--denoise: {denoiser.unavailable()}")
    core = load()
    args.size = args.size or (640, 360)
    args.reference_time = args.reference_time or 4 * args.time
    names = list(dict.fromkeys([*args.integrators, args.against]))
    if len(names) < 2:
        raise UserError(f"'{args.against}' against itself is no comparison", EXIT_USAGE)
    racers = [contestants.parse(name, core) for name in names]
    makers = {
        "headwater": [contestants.parse(args.reference_integrator, core)],
        "cycles": [contestants.parse("cycles", core)],
    }
    makers["together"] = makers["own"] = makers["headwater"] + makers["cycles"]
    device, tracer = _device(core, args, racers + makers[args.reference])
    os.makedirs(args.output, exist_ok=True)
    check_output(os.path.join(args.output, "bench.json"), ())
    description = _description(args, device, tracer) | {"machine": machine()}
    progress, results, failed = Progress(), [], False
    with interrupt.Watch():
        for file in args.files:
            try:
                found = measure(file, args, racers, makers[args.reference], progress)
            except UserError as error:
                progress.warn(str(error))
                failed = True
                continue
            results.append(found)
            failed = failed or bool(found.failures)
            print(os.path.basename(file) + (" (stopped)" if found.stopped else ""))
            print_table(table(found, args.against))
            sys.stdout.flush()
            if interrupt.requested():
                break
        if results:
            write_report(args.output, description, results, args.against)
            print(os.path.join(args.output, "index.html"))
    progress.close()
    if interrupt.requested():
        return EXIT_INTERRUPTED
    return EXIT_FAILED if failed else 0


def _choose_frames(args) -> None:
    """Of --frame and --animation-from: `frames` that are measured and those before them, `lead`."""
    args.lead = []
    if args.frame is None:
        if args.animation_from is not None:
            raise UserError("--animation-from: which --frame?", EXIT_USAGE)
        return
    if args.frames is not None:
        raise UserError("--frame and --frames: one of them", EXIT_USAGE)
    args.frames = range(args.frame, args.frame + 1)
    if args.animation_from is not None:
        if args.animation_from >= args.frame:
            raise UserError(f"--animation-from {args.animation_from} is not before frame {args.frame}", EXIT_USAGE)
        args.lead = list(range(args.animation_from, args.frame))


def _device(core, args, racers) -> tuple[str, str]:
    """The device and tracer that Headwater takes; UserError before any work where there is none, or where it refuses
    what a contestant asks for."""
    from headwater.bench.contestants import check_lights

    try:
        context = core.Context(device=args.device, tracer=args.tracer, threads=args.threads)
    except Exception as error:
        raise UserError(first_line(error)) from error
    check_lights(core, context, racers)
    return context.device["name"], context.tracer


def _description(args, device: str, tracer: str) -> dict:
    settings = {name: value for name, value in vars(args).items() if name not in ("run", "command", "files", "output")}
    settings["frames"] = list(args.frames) if args.frames is not None else None
    # Folders are the reader's own business: names alone stay in the report.
    words = [os.path.basename(w) if os.sep in w else w for w in sys.argv[1:]]
    command = "headwater " + " ".join(shlex.quote(word) for word in words)
    about = {"headwater": __version__, "device": device, "tracer": tracer, "command": command}
    return about | {"settings": settings}
