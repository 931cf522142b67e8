# SPDX-License-Identifier: Apache-2.0
"""`headwater info`: versions, devices and what they can do, the Tracer that `auto` would choose, integrators."""

import contextlib
import importlib.metadata
import json
import platform
import sys

from headwater import __version__, denoiser
from headwater.core import load
from headwater.errors import UserError, first_line

PACKAGES = ("numpy", "bpy", "usd-core", "OpenEXR", "Pillow", "flip-evaluator", "mitsuba")


def add_arguments(parser) -> None:
    """Options of the subcommand."""
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--device", default="", help="tell what this device would use")


def package_versions() -> dict:
    """Installed versions of the Python packages Headwater can use; None for those that are not there."""
    versions = {}
    for name in PACKAGES:
        try:
            versions[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            versions[name] = None
    return versions


def collect(device: str = "") -> dict:
    """Everything the command says, as a JSON-ready dict. Never raises for what is missing on the machine."""
    report = {
        "headwater": __version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": package_versions(),
        "denoiser": None,
        "devices": [],
        "core": None,
        "chosen_device": None,
        "tracer": None,
        "integrators": [],
        "error": None,
    }
    with contextlib.suppress(denoiser.DenoiserUnavailable):
        report["denoiser"] = denoiser.version()
    try:
        core = load()
        report["core"] = dict(core.versions()) if hasattr(core, "versions") else {}
        report["integrators"] = list(core.integrator_table())
        report["devices"] = [dict(d) for d in core.devices()]
        context = core.Context(device=device)
        report["chosen_device"] = context.device["name"]
        report["tracer"] = context.tracer
    except UserError as error:
        report["error"] = str(error)
    except Exception as error:  # no Vulkan loader, no usable device: the core's own sentence
        report["error"] = first_line(error)
    return report


def format_report(report: dict) -> str:
    """The report as text for people."""
    lines = [f"Headwater {report['headwater']}, Python {report['python']}, {report['platform']}"]
    for name, version in sorted((report["core"] or {}).items()):
        lines.append(f"  {name}: {version}")
    lines.append("  " + ", ".join(f"{name} {version or 'absent'}" for name, version in report["packages"].items()))
    lines.append(f"  OpenImageDenoise: {report['denoiser'] or 'absent'}")
    lines.append("Devices:" if report["devices"] else "Devices: none")
    for index, device in enumerate(report["devices"]):
        features = [name.replace("_", " ") for name in ("ray_query", "ray_pipeline") if device.get(name)]
        memory = device.get("memory", 0) / 2**30
        lines.append(
            f"  [{index}] {device['name']} ({device['kind']}, Vulkan {device['api']}, {device['driver']}, "
            f"{memory:.1f} GiB"
            f"{', ' + ', '.join(features) if features else ''})"
        )
        if not device["usable"]:
            lines.append(f"      not usable: {device['why_not']}")
            continue
        for tracer in ("ray_query", "ray_pipeline"):
            if not device.get(tracer):
                lines.append(f"      no tracer {tracer}: {device.get(tracer + '_why_not', '')}")
    if report["chosen_device"]:
        lines.append(f"Renders on: {report['chosen_device']}, tracer {report['tracer']}")
    if report["integrators"]:
        lines.append("Integrators:")
        width = max(len(integrator["name"]) for integrator in report["integrators"])
        for integrator in report["integrators"]:
            lines.append(f"  {integrator['name']:{width}}  {integrator['description']}")
    if report["error"]:
        lines.append(f"Can't render: {report['error']}")
    return "\n".join(lines)


def run(args) -> int:
    """Runs the subcommand; exit status 1 when nothing here can render."""
    report = collect(args.device)
    print(json.dumps(report, indent=2) if args.json else format_report(report))
    sys.stdout.flush()
    return 1 if report["error"] else 0
