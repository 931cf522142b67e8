# SPDX-License-Identifier: Apache-2.0
"""The `headwater` command: render, compare, figures, info, bench, bench-tracer, bench-speed.

Exit status: 0 done, 1 the work failed, 2 the request is wrong, 130 stopped by Ctrl-C. User errors are one line on
stderr; HEADWATER_DEBUG=1 shows where they came from.
"""

import argparse
import os
import sys

from headwater import __version__
from headwater.errors import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_USAGE, UserError, first_line


class _Parser(argparse.ArgumentParser):
    """Errors in the command's own form: one line, exit status 2."""

    def error(self, message):
        raise UserError(f"{message} (see '{self.prog} --help')", EXIT_USAGE)


def build_parser() -> argparse.ArgumentParser:
    """The parser of all subcommands. Each subcommand's module is imported only to declare its options or to run."""
    from headwater import bench, bench_speed, bench_tracer, compare, figures, info, render

    parser = _Parser(prog="headwater", description="Headwater renders Blender and USD scenes and measures images.")
    parser.add_argument("--version", action="version", version=f"headwater {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", parser_class=_Parser)
    for name, module, summary in (
        ("render", render, "render a .blend or USD file"),
        ("compare", compare, "error of images against references, as JSON"),
        ("figures", figures, "the paper's figures on scenes of ours, measured, as one report page"),
        ("info", info, "versions, devices and what they can do"),
        ("bench", bench, "error against time beside Cycles, or the speed report of a device"),
        ("bench-tracer", bench_tracer, "rays per second of a tracer beside a plain loop on the same rays"),
        ("bench-speed", bench_speed, "seconds of the same .blend by Headwater and by Cycles"),
    ):
        command = commands.add_parser(name, help=summary, description=summary[0].upper() + summary[1:] + ".")
        module.add_arguments(command)
        command.set_defaults(run=module.run)
    return parser


def main(argv=None) -> int:
    """Runs the command with `argv` (default: the process's); returns the exit status."""
    debug = os.environ.get("HEADWATER_DEBUG", "0") not in ("", "0")
    try:
        args = build_parser().parse_args(argv)
        status = args.run(args)
        sys.stdout.flush()
        return status
    except UserError as error:
        if debug:
            raise
        return _fail(str(error), error.status)
    except KeyboardInterrupt:
        return _fail("stopped", EXIT_INTERRUPTED)
    except BrokenPipeError:  # the reader of our output went away, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_FAILED
    except MemoryError:
        return _fail("out of memory", EXIT_FAILED)
    except Exception as error:
        if debug:
            raise
        return _fail(f"{type(error).__name__}: {first_line(error)} (HEADWATER_DEBUG=1 shows where)", EXIT_FAILED)


def _fail(message: str, status: int) -> int:
    print(f"headwater: error: {message}" if status != EXIT_INTERRUPTED else f"headwater: {message}", file=sys.stderr)
    return status
