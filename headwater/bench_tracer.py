# SPDX-License-Identifier: Apache-2.0
"""`headwater bench-tracer`: rays a second of a Tracer beside a plain loop, same rays and threads, in one run.

The contestants take turns in each round and medians count: the Tracer, a plain Embree loop over a robust scene (plain),
and the same without the robust flag (fast).
"""

import json

from headwater.core import load
from headwater.errors import EXIT_USAGE, UserError, first_line
from headwater.render import TRACERS

SIZES = (20_000, 320_000, 2_900_000)


def add_arguments(parser) -> None:
    """Options of the subcommand."""
    parser.add_argument("--triangles", type=int, nargs="+", default=list(SIZES), metavar="N")
    parser.add_argument("--rays", type=int, default=1 << 20, help="rays a measurement")
    parser.add_argument("--repeats", type=int, default=5, help="rounds; medians count")
    parser.add_argument("--device", default="")
    parser.add_argument("--tracer", choices=TRACERS, default="embree")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="print one JSON object")


def run(args) -> int:
    """Runs the subcommand."""
    if min(args.triangles) < 1 or args.rays < 1 or args.repeats < 1 or args.threads < 0:
        raise UserError("--triangles, --rays and --repeats must be positive", EXIT_USAGE)
    core = load()
    if not hasattr(core, "tracer_benchmark"):
        raise UserError("this build of the core has no tracer benchmark")
    try:
        results = [
            row
            | {
                "ratio fast closest": row["closest"] / row["fast closest"],
                "ratio fast any": row["any"] / row["fast any"],
            }
            for triangles in args.triangles
            for row in core.tracer_benchmark(
                triangles=triangles,
                rays=args.rays,
                repeats=args.repeats,
                device=args.device,
                tracer=args.tracer,
                threads=args.threads,
            )
        ]
    except UserError:
        raise
    except Exception as error:
        raise UserError(first_line(error)) from error
    if args.json:
        print(json.dumps(results, indent=2))
        return 0
    print("millions of rays a second")
    columns = list(dict.fromkeys(key for row in results for key in row))
    table = [columns] + [[_cell(row.get(column)) for column in columns] for row in results]
    widths = [max(len(row[i]) for row in table) for i in range(len(columns))]
    for row in table:
        print("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)))
    return 0


def _cell(value) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
