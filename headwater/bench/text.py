# SPDX-License-Identifier: Apache-2.0
"""Tables of measurements on a terminal."""


def print_table(rows) -> None:
    """Rows of equally many cells of text: the first column to the left, the others to the right."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for label, *cells in rows:
        print("  ".join([label.ljust(widths[0]), *(c.rjust(w) for c, w in zip(cells, widths[1:], strict=True))]))
