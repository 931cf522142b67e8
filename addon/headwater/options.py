# SPDX-License-Identifier: GPL-3.0-or-later
"""Options for headless renders, given to Blender after `--`.

  blender -b shot.blend -E HEADWATER -a -- --headwater-samples 256 --headwater-stats stats.json

--headwater-device NAME    device by name or part of it, instead of the preference
--headwater-tracer NAME    auto, ray_query, ray_pipeline or embree
--headwater-samples N      samples a pixel, instead of the scene's
--headwater-threads N      host threads
--headwater-denoise on|off  denoises or does not, instead of what the scene says
--headwater-memory-limit N most device memory in MiB, instead of the preference
--headwater-stats FILE     one JSON object a line for each frame and view layer, appended
--headwater-strict         a failed render makes the process exit with status 1: the default of `blender -b`, not of bpy
--no-headwater-strict      it does not
"""

import argparse
import sys
from dataclasses import dataclass


@dataclass
class Options:
    """What was asked for; None where nothing was."""

    device: str | None = None
    tracer: str | None = None
    samples: int | None = None
    threads: int | None = None
    denoise: bool | None = None
    memory_limit: int | None = None
    stats: str | None = None
    strict: bool | None = None


class _Parser(argparse.ArgumentParser):
    def error(self, message):
        raise ValueError(message)


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not at least 1")
    return value


def parse(arguments: list[str]) -> Options:
    """Options among `arguments` (those after `--`); others are left to other add-ons. ValueError for a bad value."""
    parser = _Parser(add_help=False, allow_abbrev=False)
    parser.add_argument("--headwater-device", dest="device")
    parser.add_argument("--headwater-tracer", dest="tracer", choices=("auto", "ray_query", "ray_pipeline", "embree"))
    parser.add_argument("--headwater-samples", dest="samples", type=_positive)
    parser.add_argument("--headwater-threads", dest="threads", type=_positive)
    parser.add_argument("--headwater-denoise", dest="denoise", choices=("on", "off"))
    parser.add_argument("--headwater-memory-limit", dest="memory_limit", type=_positive)
    parser.add_argument("--headwater-stats", dest="stats")
    parser.add_argument("--headwater-strict", dest="strict", action=argparse.BooleanOptionalAction)
    known, _ = parser.parse_known_args(arguments)
    if known.denoise is not None:
        known.denoise = known.denoise == "on"
    return Options(**vars(known))


def current() -> Options:
    """Options of this process's command line."""
    return parse(sys.argv[sys.argv.index("--") + 1 :]) if "--" in sys.argv else Options()
