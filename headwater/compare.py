# SPDX-License-Identifier: Apache-2.0
"""`headwater compare`: errors of test images against references, as JSON; heat map; per-tile test of independent runs.

Definitions: docs/manual/compare.md. The metrics themselves: metrics.py, tile_test.py.
"""

import json
import os

import numpy as np

from headwater import metrics, tile_test
from headwater.errors import EXIT_USAGE, UserError
from headwater.image_io import colour_channels, read_exr, select_layer, write_png8
from headwater.output import check_output
from headwater.texture_io import load_texture

# Black, violet, orange, pale yellow at equal steps of the error shown; signed maps go blue, white, red.
_HEAT = np.array([(0, 0, 4), (74, 12, 107), (165, 44, 96), (237, 105, 37), (251, 180, 26), (252, 255, 200)], float)
_SIGNED = np.array([(10, 30, 140), (70, 130, 220), (245, 245, 245), (225, 90, 70), (130, 10, 20)], float)


def add_arguments(parser) -> None:
    """Options of the subcommand."""
    parser.add_argument(
        "test", nargs="+", metavar="IMAGE", help="A B: test A against reference B; or the test side's runs"
    )
    parser.add_argument("--against", nargs="+", metavar="IMAGE", help="the reference side's runs")
    parser.add_argument("--layer", help="view layer, or a layer's full name (default: the only one)")
    parser.add_argument("--pass", dest="pass_name", help="pass, by Cycles' name (default: Combined)")
    parser.add_argument(
        "--tiles", type=int, metavar="N", help="per-tile z-test on an N x N grid, from independent runs"
    )
    parser.add_argument("--heatmap", metavar="OUT.png", help="write the error as a false-colour picture")
    parser.add_argument("--heatmap-metric", choices=("relative", "signed", "flip"), default="relative")
    parser.add_argument("--max-relmse", type=float, metavar="X", help="fail (exit 1) when trimmed relMSE is above X")
    parser.add_argument("--max-z", type=float, metavar="Z", help="fail (exit 1) when a tile's |z| is above Z")


def load_colour(path: str, layer=None, pass_name=None) -> np.ndarray:
    """Colour channels (H, W, C) float32, linear, top row first, of an EXR's layer, a PNG, a JPEG or a .hdr picture."""
    if os.path.isfile(path) and not _is_exr(path):
        if layer is not None or pass_name is not None:
            raise UserError(f"'{path}' is not an EXR file: it has no layers", EXIT_USAGE)
        texture = load_texture(path)
        pixels = texture.pixels[::-1]
        if not texture.is_float:
            encoded = pixels.astype(np.float32) / 255
            pixels = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
        return pixels[..., :3]
    exr = read_exr(path)
    return colour_channels(exr, select_layer(exr, layer, pass_name))


def _is_exr(path) -> bool:
    try:
        with open(path, "rb") as file:
            return file.read(4) in (b"\x76\x2f\x31\x01", b"")
    except OSError as error:
        raise UserError(f"'{path}' can't be read: {error.strerror or error}") from error


def run(args) -> int:
    """Runs the subcommand; prints one JSON object on stdout and returns the exit status."""
    tests, references = args.test, args.against
    if references is None:
        if len(tests) != 2:
            raise UserError(
                "compare takes two images, or several runs a side: compare A1 A2 … --against B1 B2 …", EXIT_USAGE
            )
        tests, references = tests[:1], tests[1:]
    if args.tiles is not None and (args.tiles < 1 or len(tests) + len(references) < 3):
        raise UserError(
            "--tiles needs a positive grid size and several runs: compare A1 A2 … --against B1 B2 … --tiles 16",
            EXIT_USAGE,
        )
    if args.max_z is not None and args.tiles is None:
        raise UserError("--max-z needs --tiles", EXIT_USAGE)
    heatmap = check_output(args.heatmap, (".png",)) if args.heatmap else None
    test_runs = [load_colour(path, args.layer, args.pass_name) for path in tests]
    reference_runs = [load_colour(path, args.layer, args.pass_name) for path in references]
    _check_sizes([*tests, *references], [*test_runs, *reference_runs])

    test, reference = (runs[0] if len(runs) == 1 else np.mean(runs, axis=0) for runs in (test_runs, reference_runs))
    display = not any(_is_exr(path) or path.lower().endswith(".hdr") for path in [*tests, *references])
    report, flip_map = describe(test, reference, display)
    report["files"] = {"test": tests, "reference": references, "layer": args.layer, "pass": args.pass_name}
    status = 0
    if args.tiles is not None:
        report["tiles"] = tile_report(test_runs, reference_runs, args.tiles)
        if args.max_z is not None and abs(report["tiles"]["worst_z"]) > args.max_z:
            status = 1
    if args.max_relmse is not None and not (report["relmse_trimmed"] or 0) <= args.max_relmse:
        status = 1
    if heatmap:
        write_png8(heatmap, heat_map(test, reference, args.heatmap_metric, flip_map))
    print(json.dumps(report, indent=2))
    return status


def _check_sizes(paths, images):
    first = images[0].shape
    for path, image in zip(paths, images, strict=True):
        if image.shape[:2] != first[:2]:
            sizes = [f"{shape[1]} x {shape[0]}" for shape in (first, image.shape)]
            raise UserError(f"sizes differ: '{paths[0]}' is {sizes[0]}, '{path}' is {sizes[1]}")
        if image.shape[2] != first[2]:
            raise UserError(f"channels differ: '{paths[0]}' has {first[2]}, '{path}' has {image.shape[2]}")


def describe(test, reference, display=False):
    """The metrics of two (H, W, C) images as a JSON-ready dict, and FLIP's (H, W) map or None."""
    non_finite = {}
    for name, image in (("test", test), ("reference", reference)):
        counts = metrics.count_non_finite(image)
        non_finite[name] = {"nan": counts.nan, "inf": counts.inf}
    report = {"width": test.shape[1], "height": test.shape[0], "channels": test.shape[2]}
    try:
        report |= metrics.error_metrics(test, reference)
    except ValueError as error:
        raise UserError(str(error)) from error
    flip = metrics.flip(test, reference, high_dynamic_range=not display)
    report["flip"] = flip[0] if flip else None
    report["non_finite_pixels"] = non_finite
    return report, flip[1] if flip else None


def tile_report(test_runs, reference_runs, tiles) -> dict:
    """The tile test's outcome as a JSON-ready dict."""
    try:
        result = tile_test.tile_test(test_runs, reference_runs, tiles)
    except ValueError as error:
        raise UserError(str(error)) from error
    row, column, channel = result.worst_tile
    return {
        "rows": result.z.shape[0],
        "columns": result.z.shape[1],
        "runs": [len(test_runs), len(reference_runs)],
        "worst_z": result.worst_z,
        "worst_p": result.p_worst,
        "family_p": result.p_family,
        "worst_tile": {"row": row, "column": column, "channel": channel},
        "worst_means": [float(m[result.worst_tile]) for m in (result.mean_test, result.mean_reference)],
        "rms_z": float(np.sqrt(np.mean(np.square(result.z)))),
    }


def heat_map(test, reference, metric="relative", flip_map=None) -> np.ndarray:
    """uint8 (H, W, 3) false colours, top row first. relative: |t − r| / sqrt(r² + ε), black 0 to pale 1; signed: the
    same with sign, blue −1 to red 1; flip: FLIP's map, 0 to 1. Pixels that are not finite are green."""
    t, r = np.asarray(test, float), np.asarray(reference, float)
    with np.errstate(invalid="ignore", over="ignore"):
        signed = (t - r) / np.sqrt(np.square(r) + metrics.EPSILON)
    bad = ~np.isfinite(signed).all(axis=2)
    if metric == "flip":
        if flip_map is None:
            raise UserError("a FLIP heat map needs the Python package flip-evaluator: pip install flip-evaluator")
        values, colours = flip_map, _HEAT
    elif metric == "signed":
        values, colours = signed.mean(axis=2) / 2 + 0.5, _SIGNED
    else:
        values, colours = np.sqrt(np.square(signed).mean(axis=2)), _HEAT
    place = np.clip(np.nan_to_num(values), 0, 1) * (len(colours) - 1)
    below = np.minimum(place.astype(int), len(colours) - 2)
    part = (place - below)[..., None]
    picture = colours[below] * (1 - part) + colours[below + 1] * part
    picture[bad] = (0, 255, 0)
    return (picture + 0.5).astype(np.uint8)
