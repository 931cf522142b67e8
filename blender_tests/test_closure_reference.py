# SPDX-License-Identifier: Apache-2.0
"""The values that the C++ tests compare our closures with are still what this Blender's Cycles gives."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
STORED = HERE.parent / "core/tests/closure_reference.inc"


def numbers(text: str) -> np.ndarray:
    """The rows of measured values: lines of numbers that end in a comma."""
    rows = re.findall(r"^    ([-\d.e, ]+),$", text, re.MULTILINE)
    return np.array([[float(v) for v in row.split(",")] for row in rows])


def run(script: str, output: Path) -> None:
    subprocess.run([sys.executable, HERE / script, output], check=True, capture_output=True, timeout=120)


def test_reference_is_current(tmp_path: Path) -> None:
    run("closure_reference.py", tmp_path / "values.inc")
    stored, found = numbers(STORED.read_text()), numbers((tmp_path / "values.inc").read_text())
    assert stored.shape == found.shape and stored.size > 10_000
    np.testing.assert_allclose(found, stored, rtol=2e-4, atol=2e-6)


def test_sheen_table_is_current(tmp_path: Path) -> None:
    run("measure_sheen.py", tmp_path / "sheen.inc")
    stored = (HERE.parent / "core/materials/sheen_table.inc").read_text()
    found = (tmp_path / "sheen.inc").read_text()
    tables = [np.array([float(v) for v in re.findall(r"(-?\d+\.\d+)f", text)]) for text in (stored, found)]
    assert tables[0].size == 3 * 32 * 32
    np.testing.assert_allclose(tables[1], tables[0], atol=2e-5)
