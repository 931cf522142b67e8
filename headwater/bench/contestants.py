# SPDX-License-Identifier: Apache-2.0
"""Who is measured: Cycles, or an integrator of ours with options, as "restir:estimator=unbiased,candidates=16" says."""

import argparse
from dataclasses import dataclass, field

import numpy as np

from headwater import render_reuse
from headwater.errors import EXIT_USAGE, UserError, choose, first_line
from headwater.integrators import PARAMETERS
from headwater.render import threshold

CYCLES = "cycles"
_OPTIONS = ("lights", "estimator", "noise_threshold")  # of every integrator of ours, beside its parameters


@dataclass(frozen=True)
class Contestant:
    """`text` is how the user wrote it, and its name in reports. What is not given is the integrator's default: nothing
    is taken from the .blend, so that the same words mean the same in every file."""

    text: str
    engine: str  # "headwater" or "cycles"
    integrator: str = ""
    lights: str | None = None
    estimator: str | None = None
    noise_threshold: float | bool = False  # False: no adaptive sampling
    parameters: dict = field(default_factory=dict)  # the core's setting -> value
    light_tree: bool = True  # of Cycles

    def settings(self) -> dict:
        """As JSON for the worker that renders it."""
        names = ("engine", "integrator", "lights", "estimator", "noise_threshold", "parameters", "light_tree")
        return {name: getattr(self, name) for name in names}


def parse(text: str, core) -> Contestant:
    """The contestant that `text` names. UserError for an unknown name, option or value; the core is the judge."""
    name, _, rest = text.partition(":")
    options = {}
    for item in filter(None, rest.split(",")):
        key, equals, value = item.partition("=")
        if not equals or not value:
            raise UserError(f"'{text}': '{item}' is not OPTION=VALUE", EXIT_USAGE)
        options[key.strip().replace("-", "_")] = value.strip()
    if name == CYCLES:
        return _cycles(text, options)
    choose("integrator", name, [*core.integrators(), CYCLES])
    given = {key: options.pop(key) for key in _OPTIONS if key in options}
    noise_threshold = _parsed(text, "noise_threshold", threshold, given.pop("noise_threshold", "off"))
    parameters = {key: _value(text, key, value) for key, value in options.items()}
    settings = {"width": 1, "height": 1, "integrator": name, **given, **parameters}
    try:
        core.reservoir_bytes(settings)
    except (ValueError, TypeError) as error:
        raise UserError(f"'{text}': {first_line(error)}", EXIT_USAGE) from error
    return Contestant(text, "headwater", name, given.get("lights"), given.get("estimator"), noise_threshold, parameters)


def check_lights(core, context, contestants: list) -> None:
    """Raises UserError for a choice of lights that the core refuses, alone or with the integrator. It tells only at the
    start of a render: one of a single pixel of nothing is started."""
    session = None
    for each in contestants:
        if each.lights is None:
            continue
        if session is None:
            nothing = core.Scene()
            nothing.set_camera("perspective", np.eye(4, dtype=np.float32)[:3].copy(), (-1.0, 1.0, -1.0, 1.0))
            session = core.Session(context, nothing)
            session.sync()
        settings = {"width": 1, "height": 1, "samples": 1, "integrator": each.integrator, "lights": each.lights}
        try:
            session.start(settings)
        except (ValueError, TypeError) as error:
            raise UserError(f"'{each.text}': {first_line(error)}", EXIT_USAGE) from error
        session.cancel()
        session.finish()


def _cycles(text: str, options: dict) -> Contestant:
    tree = options.pop("light_tree", "on")
    if options or tree not in render_reuse.SWITCH:
        raise UserError(f"'{text}': cycles has one option, light-tree=on|off", EXIT_USAGE)
    return Contestant(text, CYCLES, light_tree=render_reuse.SWITCH[tree])


def _value(text: str, key: str, value: str):
    if key not in PARAMETERS:
        known = ", ".join(name.replace("_", "-") for name in (*_OPTIONS, *PARAMETERS))
        raise UserError(f"'{text}': unknown option '{key}'; there are: {known}", EXIT_USAGE)
    kind, _ = render_reuse.form(PARAMETERS[key])
    return _parsed(text, key, kind, value)


def _parsed(text: str, key: str, kind, value: str):
    """The value as `kind`, a type of a command line's option, reads it."""
    try:
        return kind(value)
    except argparse.ArgumentTypeError as error:
        raise UserError(f"'{text}': {key}: {error}", EXIT_USAGE) from error
