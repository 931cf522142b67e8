# SPDX-License-Identifier: Apache-2.0
"""Opening USD files that may be anything: every failure is one UserError, composition problems are warnings.

Stage space to Headwater's: metres and Z up (docs/architecture.md), whatever the file's metersPerUnit and upAxis are.
"""

import os
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from headwater.errors import EXIT_USAGE, UserError, first_line

EXTENSIONS = (".usd", ".usda", ".usdc", ".usdz")


@dataclass
class OpenStage:
    """An opened stage and its conventions."""

    stage: object  # Usd.Stage
    path: str
    meters_per_unit: float
    to_world: np.ndarray  # (4, 4) row-major, column vectors: stage space to metres, Z up
    first_frame: float
    last_frame: float
    warnings: list


def pxr_modules():
    """The pxr package. Raises UserError with what to install."""
    try:
        from pxr import Tf, Usd  # noqa: F401
    except ImportError as error:
        raise UserError("USD files need the Python package usd-core: pip install usd-core") from error
    import pxr

    return pxr


def open_stage(path: str) -> OpenStage:
    """Opens a USD file. Raises UserError naming the file and the reason."""
    pxr_modules()
    from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils

    if not os.path.isfile(path):
        raise UserError(f"'{path}': {'is a folder' if os.path.isdir(path) else 'no such file'}", EXIT_USAGE)
    if os.path.getsize(path) == 0:
        raise UserError(f"'{path}' is empty")
    errors = UsdUtils.CoalescingDiagnosticDelegate()  # USD's own messages become ours instead of going to stderr
    try:
        layer = Sdf.Layer.FindOrOpen(path)
        stage = Usd.Stage.Open(layer) if layer else None
    except Tf.ErrorException as error:
        raise UserError(f"'{path}' can't be read as USD: {tf_reason(error)}") from error
    except Exception as error:
        raise UserError(f"'{path}' can't be read as USD: {first_line(error)}") from error
    finally:
        messages = usd_messages(errors)
    if stage is None:
        raise UserError(f"'{path}' can't be read as USD{': ' + messages[0] if messages else ''}")
    meters = UsdGeom.GetStageMetersPerUnit(stage)
    warnings = [f"{path}: {text}" for text in messages]
    if not (np.isfinite(meters) and meters > 0):
        warnings.append(f"{path}: metersPerUnit {meters} is no length; 0.01 is used")
        meters = 0.01
    to_world = np.diag([meters, meters, meters, 1.0])
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y:
        to_world = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]]) @ to_world
    first, last = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if not stage.HasAuthoredTimeCodeRange() or not np.isfinite([first, last]).all():
        first = last = 1.0
    return OpenStage(stage, path, float(meters), to_world, first, last, warnings)


@contextmanager
def reading(path: str):
    """USD's exceptions inside become one UserError that names the file: damage may show only when values are read."""
    from pxr import Tf

    try:
        yield
    except Tf.ErrorException as error:
        raise UserError(f"'{path}' can't be read as USD: {tf_reason(error)}") from error
    except UnicodeDecodeError as error:
        raise UserError(f"'{path}' can't be read as USD: it holds text that is not UTF-8") from error


def usd_messages(delegate) -> list:
    """Warnings USD gave meanwhile, without its source locations."""
    texts = []
    for diagnostic in delegate.TakeUncoalescedDiagnostics():
        text = _commentary(diagnostic)
        if text and text not in texts:
            texts.append(text)
    return texts


def tf_reason(error) -> str:
    """The sentence in a Tf.ErrorException, whose text is a table of locations."""
    for entry in error.args:
        if commentary := _commentary(entry):
            return commentary
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    for line in lines:
        if "': " in line or " -- " in line:
            return line.split(" -- ", 1)[-1].split("': ", 1)[-1]
    return lines[0] if lines else "unknown error"


def _commentary(entry) -> str:
    """First line of a diagnostic's text, "" where it has none."""
    try:
        text = getattr(entry, "commentary", None)
    except UnicodeDecodeError:  # it quotes a damaged file
        return "it holds text that is not UTF-8"
    return first_line(Exception(text)) if text else ""


def matrix_to_numpy(matrix) -> np.ndarray:
    """A Gf.Matrix4d (row vectors) as (4, 4) float64 for column vectors."""
    return np.array(matrix, np.float64).T
