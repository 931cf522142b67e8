# SPDX-License-Identifier: Apache-2.0
"""One figure from start to finish: render, measure, draw, record. What was made stays when a later step fails."""

import os

from headwater.compare import describe, heat_map
from headwater.errors import UserError
from headwater.figures import display, measures, report
from headwater.image_io import write_png8

INSET_WIDTH = 240  # pixels


def make_figure(figure, scene, workshop, folder: str) -> dict:
    """The figure's record, JSON-ready: "failures" lists what could not be made. Raises Stopped between its pictures."""
    record = {
        "id": figure.id,
        "title": figure.title,
        "caption": figure.caption,
        "scene": scene.facts,
        "size": list(workshop.size),
        "samples": figure.samples,
        "bounces": figure.bounces,
        "variants": [],
        "failures": [],
        "reference": None,
        "sheet": None,
    }
    place = os.path.join(folder, f"figure-{figure.id}")
    os.makedirs(place, exist_ok=True)
    reference = workshop.reference(scene, figure.bounces)
    exposure = display.exposure_of(reference.pixels)
    columns = []
    for variant in figure.variants:
        entry = {
            "name": variant.name,
            "label": variant.label,
            "integrator": variant.integrator,
            "options": variant.options,
        }
        record["variants"].append(entry)
        try:
            picture = workshop.picture(scene, figure, variant)
        except UserError as error:
            entry["failure"] = str(error)
            record["failures"].append(str(error))
            continue
        numbers, flip_map = measure(picture.pixels, reference, figure.grid, scene.facts["camera"], variant.rides)
        numbers |= {"seconds": picture.seconds, "reservoir_bytes": picture.reservoir_bytes}
        shown = display.tone_map(picture.pixels, exposure)
        relative, signed = (heat_map(picture.pixels, reference.pixels, kind) for kind in ("relative", "signed"))
        if figure.grid:
            edge = measures.boundary(reference.places, reference.lit, scene.facts["camera"], figure.grid, variant.rides)
            relative, signed = display.overlay(relative, edge), display.overlay(signed, edge, (0, 0, 0))
        maps = [relative, signed] + (
            [heat_map(picture.pixels, reference.pixels, "flip", flip_map)] if numbers["flip"] else []
        )
        entry |= {"numbers": numbers, "command": picture.command}
        entry["files"] = _save(place, folder, variant.name, shown, figure.insets, maps)
        columns.append(_column(variant.label, numbers, shown, figure.insets, [relative, signed]))
    shown = display.tone_map(reference.pixels, exposure)
    record["reference"] = {
        "error": reference.error,
        "samples": reference.samples,
        "seconds": reference.seconds,
        "command": reference.command,
        "files": _save(place, folder, "reference", shown, figure.insets, []),
    }
    record["verdicts"] = report.verdicts_of(figure, record)
    own = f"own relMSE of surfaces {report.cell(reference.error['lit_relmse_trimmed'], '{:.3g}')}"
    last = {"lines": ["reference", f"{reference.samples} spp", own], "rows": _rows(shown, figure.insets)}
    sheet = display.contact_sheet(f"Figure {figure.id}: {figure.title} ({figure.samples} spp)", [*columns, last])
    path = os.path.join(folder, f"figure-{figure.id}.png")
    write_png8(path, sheet)
    record["sheet"] = os.path.relpath(path, folder)
    return record


def measure(pixels, reference, grid, camera, rides=False):
    """All numbers of a picture against its reference, and FLIP's map or None."""
    numbers, flip_map = describe(pixels, reference.pixels)
    error, lit = measures.signed_error(pixels, reference.pixels), reference.lit
    numbers |= {
        "lit_share": float(lit.mean()),
        "lit_relmse_trimmed": measures.trimmed(measures.squared_error(pixels, reference.pixels)[lit]),
        "lit_signed_percent": measures.signed_percent(pixels, reference.pixels, lit),
        "neighbour_correlation": measures.neighbour_correlation(error, lit),
        "neighbour_pairs": measures.neighbour_pairs(lit),
        "block_share": measures.block_share(error, lit),
        "black_share": measures.black_share(pixels, lit),
        "bias_sigmas": measures.bias_sigmas(pixels, reference.pixels, lit),
    }
    if grid:
        numbers["grid"] = measures.grid_measures(pixels, reference.pixels, reference.places, lit, camera, grid, rides)
    return numbers, flip_map


def _rows(shown, insets):
    return [[display.framed(shown, insets)], [display.crop(shown, inset) for inset in insets]]


def _column(label, numbers, shown, insets, maps):
    cell = report.cell
    lines = [
        label,
        f"relMSE of surfaces {cell(numbers['lit_relmse_trimmed'], '{:.3g}')}   FLIP {cell(numbers['flip'], '{:.3f}')}",
        f"bias {cell(numbers['lit_signed_percent'], '{:+.1f} %')}   {numbers['seconds']:.1f} s",
        f"neighbours' errors correlate {numbers['neighbour_correlation']:.2f}",
    ]
    return {"lines": lines, "rows": [*_rows(shown, insets), *([picture] for picture in maps)]}


def _save(place, folder, name, shown, insets, maps) -> dict:
    """Writes a picture's PNGs; their paths relative to the report."""

    def write(suffix, pixels):
        path = os.path.join(place, f"{name}{suffix}.png")
        write_png8(path, pixels)
        return os.path.relpath(path, folder)

    crops = [display.magnify(display.crop(shown, inset), INSET_WIDTH) for inset in insets]
    return {
        "picture": write("", shown),
        "framed": write("-framed", display.framed(shown, insets)),
        "insets": [write(f"-inset{i + 1}", picture) for i, picture in enumerate(crops)],
        "maps": [write(f"-{kind}", m) for kind, m in zip(("error", "signed", "flip"), maps, strict=False)],
    }
