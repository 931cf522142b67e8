# SPDX-License-Identifier: Apache-2.0
"""`headwater figures`: the paper's figures on our scenes, measured, as one report page. Manual: docs/manual/figures.md.

table.py is what is rendered, claims.py what is checked.
"""

import argparse
import json
import os

from headwater import __version__, interrupt
from headwater.errors import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_USAGE, UserError
from headwater.figures import display, report, scenes, table
from headwater.figures.make import make_figure
from headwater.figures.pictures import Stopped, Workshop
from headwater.progress import Progress
from headwater.render import TRACERS, natural, positive, size

FULL = ((640, 360), 512)  # size, samples of a reference
QUICK = ((320, 180), 256)


def add_arguments(parser) -> None:
    """Options of the subcommand."""
    add = parser.add_argument
    add("-o", "--output", required=True, metavar="DIR", help="folder of the report: DIR/index.html")
    add("--only", type=_numbers, metavar="N[,N]", help="these figures; others that DIR has stay in the report")
    add("--quick", action="store_true", help="320x180, references of 256 samples")
    add("--size", type=size, metavar="WxH", help="of the pictures (default: 640x360)")
    add(
        "--reference-samples",
        type=positive,
        metavar="N",
        help="samples of a reference of direct light, half as many with bounces (default: 512)",
    )
    add("--seed", type=natural, default=0, metavar="N")
    add("--device", default="", metavar="NAME", help="as for render")
    add("--tracer", choices=TRACERS, default="auto")
    add("--threads", type=natural, default=0, metavar="N", help="host threads (default: all)")
    add("--quiet", action="store_true", help="no progress")


def _numbers(text: str) -> list:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no list of figures such as 1,6") from None


def run(args) -> int:
    """Runs the subcommand. The report is written again after every figure, so that nothing that is done is lost."""
    figures = table.chosen(args.only)
    display.check_labels()
    folder = os.path.abspath(args.output)
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as error:
        raise UserError(f"'{args.output}' can't be made a folder: {error.strerror or error}", EXIT_USAGE) from error
    picture_size, samples = QUICK if args.quick else FULL
    device = [
        word for name in ("device", "tracer") if getattr(args, name) for word in (f"--{name}", getattr(args, name))
    ]
    if args.threads:
        device += ["--threads", str(args.threads)]
    progress = Progress(quiet=args.quiet)
    workshop = Workshop(
        folder, args.size or picture_size, args.seed, args.reference_samples or samples, device, progress
    )
    records, failed = _kept(folder), []
    about = {"headwater": __version__, "seed": args.seed, "device": None, "tracer": None}
    stopped = False
    with interrupt.Watch():
        made = {name: _scene(name, folder, progress) for name in dict.fromkeys(figure.scene for figure in figures)}
        workshop.plan([(made[f.scene], f) for f in figures if not isinstance(made[f.scene], UserError)])
        for figure in figures:
            try:
                if isinstance(made[figure.scene], UserError):
                    raise made[figure.scene]
                record = make_figure(figure, made[figure.scene], workshop, folder)
            except Stopped:
                stopped = True
                break
            except (UserError, OSError) as error:
                failed.append(f"figure {figure.id} ({error})")
                progress.warn(f"figure {figure.id}: {error}")
                continue
            records[figure.id] = record
            if record["failures"]:
                failed.append(f"figure {figure.id} ({record['failures'][0]})")
            about |= workshop.machine()
            report.write_report(folder, _in_order(records), about)
            progress.note(f"figure {figure.id}: {_summary(record)}")
    progress.close()
    if stopped:
        progress.note("headwater: stopped; the figures that were done are in the report")
        return EXIT_INTERRUPTED
    if failed:
        progress.warn(f"{len(failed)} of {len(figures)} figures are not whole: {'; '.join(failed)}")
        return EXIT_FAILED
    progress.note(os.path.join(args.output, "index.html"))
    return 0


def _scene(name, folder, progress):
    """The scene, or the UserError that says why there is none: other scenes' figures go on."""
    progress.update_text(f"scene {name}", 0.0, "making it")
    try:
        return scenes.make_scene(name, os.path.join(folder, "scenes"))
    except UserError as error:
        return error


def _kept(folder) -> dict:
    """Records of an earlier run in the folder, by figure; none where they can't be read."""
    try:
        with open(os.path.join(folder, "figures.json"), encoding="utf-8") as file:
            return {record["id"]: record for record in json.load(file)["figures"]}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _in_order(records) -> list:
    return [records[figure.id] for figure in table.FIGURES if figure.id in records]


def _summary(record) -> str:
    agreed = [verdict["agrees"] for verdict in record["verdicts"]]
    return f"{agreed.count(True)} of {len(agreed)} statements agree" + ("; not whole" if record["failures"] else "")
