# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes against Cycles: the same squares and the same object rendered by both, one sample a pixel."""

import pytest
from bpy_process import run

TOLERANCE = 5e-3  # of |value| + 0.01
# Bump steps by a pixel of about the same width.
LOOSE = {
    "bump": 0.015,
    "bump generated": 0.015,
}


@pytest.fixture(scope="module")
def board(tmp_path_factory):
    return run(
        """
        import node_board, node_cases
        import node_images
        cases = node_cases.cases() | node_images.cases()
        node_board.fill(cases, node_images.prepare)
        names = list(cases)
        theirs = node_board.render("CYCLES", tmp, names)
        ours = node_board.render("HEADWATER", tmp, names)
        difference = {n: float((np.abs(ours[n] - theirs[n]) / (0.01 + np.abs(theirs[n]))).max()) for n in names}
        flat = sum(1 for n in names if np.ptp(theirs[n]) < 1e-6)
        show(difference=difference, flat=flat)
        """,
        tmp_path_factory.mktemp("board"),
        fake=False,
        timeout=600,
    )


def test_values_are_those_of_cycles(board):
    assert len(board["difference"]) > 200
    assert board["flat"] < 12, "the squares must vary to test anything"
    bad = {name: d for name, d in board["difference"].items() if not d < TOLERANCE}
    assert not bad


@pytest.mark.slow
def test_inputs_are_those_of_cycles(tmp_path):
    facts = run(
        """
        import node_board, node_inputs
        node_inputs.fill()
        found = {}
        for name, build in node_inputs.cases().items():
            node_inputs.show(build)
            theirs, ours = node_board.picture("CYCLES", tmp), node_board.picture("HEADWATER", tmp)
            seen = theirs.sum(-1) != 0
            difference = np.abs(theirs - ours).max(-1)[seen]
            found[name] = [float(np.quantile(difference, 0.9)), int(seen.sum())]
        show(found=found)
        """,
        tmp_path,
        fake=False,
        timeout=900,
    )
    assert len(facts["found"]) > 50
    bad = {n: q for n, (q, seen) in facts["found"].items() if not (q < LOOSE.get(n, TOLERANCE) and seen > 300)}
    assert not bad
