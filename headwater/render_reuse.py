# SPDX-License-Identifier: Apache-2.0
"""The reservoir options of `headwater render`: one for each parameter of headwater.integrators, checked by the core."""

import argparse

from headwater.errors import EXIT_USAGE, UserError, first_line
from headwater.integrators import ESTIMATORS, INTEGRATORS, PARAMETERS, Choice, Number, Switch, Whole

SWITCH = {"on": True, "off": False}


def add_arguments(parser) -> None:
    """Declares the options. Ranges and choices are the core's to judge, for it also knows who reads what."""
    group = parser.add_argument_group(
        "reservoirs",
        "Parameters of the integrators that reuse light samples, each with its default by integrator; one that the "
        "integrator does not read is refused. docs/manual/reuse.md says what they do to the picture.",
    )
    for parameter in PARAMETERS.values():
        kind, metavar = form(parameter)
        group.add_argument(parameter.flag, type=kind, metavar=metavar, help=help_text(parameter))


def form(parameter):
    """(type, metavar) of a parameter's option."""
    match parameter:
        case Whole():
            return _whole, "N"
        case Number(unit="metres"):
            return _number, "METRES"
        case Number():
            return _number, "X"
        case Switch():
            return _switch, "|".join(SWITCH)
        case Choice(choices=choices):
            return str, "|".join(value for value, _, _ in choices)


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no whole number") from None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is no number") from None


def _switch(text: str) -> bool:
    if text not in SWITCH:
        raise argparse.ArgumentTypeError(f"'{text}' is neither of {', '.join(SWITCH)}")
    return SWITCH[text]


def help_text(parameter) -> str:
    """What it is, and its defaults with the integrators that read it, those of unbiased estimators apart."""
    shown = []
    for estimator, _, _ in ESTIMATORS:
        by_default = {}
        for integrator in INTEGRATORS.values():
            values = integrator.parameters(estimator)
            if parameter.name in values and (estimator == "paper" or integrator.unbiased):
                by_default.setdefault(_shown(values[parameter.name]), []).append(integrator.name)
        defaults = "; ".join(f"{', '.join(names)}: {value}" for value, names in by_default.items())
        if defaults:
            shown.append(f"[{defaults}]" if estimator == "paper" else f"[{estimator}: {defaults}]")
    automatic = f". {parameter.automatic}" if isinstance(parameter, Switch) and parameter.automatic else ""
    return f"{parameter.summary} {' '.join(shown)}{automatic}".replace("%", "%%")


def _shown(value) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return value if isinstance(value, str) else f"{value:g}"


def integrator_help() -> str:
    """Names of the integrators, for the option that chooses one."""
    return f"one of {', '.join(INTEGRATORS)} (see headwater info; default: the file's, else path)"


def given(args) -> dict:
    """The core's settings among the parsed options: only those that were given."""
    return {name: getattr(args, name) for name in PARAMETERS if getattr(args, name) is not None}


def check(core, integrator: str, estimator: str | None, parameters: dict) -> None:
    """Raises UserError, with the core's sentence, for an integrator, estimator or parameter that the core refuses."""
    settings = {"width": 1, "height": 1, "integrator": integrator, **parameters}
    if estimator is not None:
        settings["estimator"] = estimator
    try:
        core.reservoir_bytes(settings)
    except (ValueError, TypeError) as error:
        raise UserError(first_line(error), EXIT_USAGE) from error
