# SPDX-License-Identifier: Apache-2.0
"""A log-log plot of curves as SVG text: each contestant's seeds faint, their median strong, with bars
from the least to the largest of them."""

import html
import math

COLOURS = ("#f59e0b", "#38bdf8", "#4ade80", "#f472b6", "#a78bfa", "#facc15", "#fb7185", "#2dd4bf")
_WIDTH, _HEIGHT = 760, 440
_LEFT, _RIGHT, _TOP, _BOTTOM = 70, 20, 36, 50
_INK, _GRID = "#a1a1aa", "#3f3f46"


def log_log(title: str, x_label: str, y_label: str, series: list) -> str:
    """An <svg> element. series: (name, colour, median curve, curves by seed); points are (x, y) above 0."""
    points = [p for _, _, median, seeds in series for curve in (median, *seeds) for p in curve]
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" font-family="system-ui,sans-serif" '
        f'font-size="12" fill="{_INK}"><rect width="{_WIDTH}" height="{_HEIGHT}" fill="#18181b"/>',
        f'<text x="{_LEFT}" y="20" font-size="14" fill="#e4e4e7">{html.escape(title)}</text>',
    ]
    if not points:
        return "".join([*text, f'<text x="{_LEFT}" y="{_HEIGHT / 2}">nothing was measured</text></svg>'])
    x, y = _Axis([p[0] for p in points], _LEFT, _WIDTH - _RIGHT), _Axis([p[1] for p in points], _HEIGHT - _BOTTOM, _TOP)
    for value, label in x.ticks():
        at = x(value)
        text.append(f'<path d="M{at:.1f} {_TOP}V{_HEIGHT - _BOTTOM}" stroke="{_GRID}"/>')
        text.append(f'<text x="{at:.1f}" y="{_HEIGHT - _BOTTOM + 16}" text-anchor="middle">{label}</text>')
    for value, label in y.ticks():
        at = y(value)
        text.append(f'<path d="M{_LEFT} {at:.1f}H{_WIDTH - _RIGHT}" stroke="{_GRID}"/>')
        text.append(f'<text x="{_LEFT - 6}" y="{at + 4:.1f}" text-anchor="end">{label}</text>')
    for number, (name, colour, median, seeds) in enumerate(series):
        for curve in seeds:
            text.append(_line(curve, x, y, colour, 1, 0.3))
        text.append(_line(median, x, y, colour, 2.5, 1.0))
        text += [_bar(at, [c[i][1] for c in seeds if len(c) > i], x, y, colour) for i, (at, _) in enumerate(median)]
        text += [f'<circle cx="{x(a):.1f}" cy="{y(b):.1f}" r="3.5" fill="{colour}"/>' for a, b in median]
        row = _TOP + 18 + 17 * number
        text.append(f'<text x="{_WIDTH - _RIGHT - 8}" y="{row}" text-anchor="end" fill="{colour}">')
        text.append(f"{html.escape(name)}</text>")
    text.append(
        f'<text x="{(_LEFT + _WIDTH) / 2}" y="{_HEIGHT - 12}" text-anchor="middle">{html.escape(x_label)}</text>'
    )
    text.append(f'<text transform="translate(16 {_HEIGHT / 2}) rotate(-90)" text-anchor="middle">')
    return "".join([*text, f"{html.escape(y_label)}</text></svg>"])


def _line(curve, x, y, colour, width, opacity) -> str:
    path = "L".join(f"{x(a):.1f} {y(b):.1f}" for a, b in curve)
    return (
        f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="{width}" opacity="{opacity}"/>' if path else ""
    )


def _bar(at, errors, x, y, colour) -> str:
    """From the least to the largest of several seeds' errors."""
    if len(errors) < 2:
        return ""
    left, low, high = x(at), y(min(errors)), y(max(errors))
    path = f"M{left:.1f} {low:.1f}V{high:.1f}M{left - 4:.1f} {low:.1f}h8M{left - 4:.1f} {high:.1f}h8"
    return f'<path class="bar" d="{path}" fill="none" stroke="{colour}" stroke-width="1.5"/>'


class _Axis:
    """Logarithmic: from values to pixels."""

    def __init__(self, values, start: float, end: float):
        low, high = math.log10(min(values)), math.log10(max(values))
        margin = max(0.05 * (high - low), 0.05)
        self._low, self._high, self._start, self._end = low - margin, high + margin, start, end

    def __call__(self, value: float) -> float:
        part = (math.log10(value) - self._low) / (self._high - self._low)
        return self._start + part * (self._end - self._start)

    def ticks(self) -> list:
        """(value, label) at powers of ten, with 2 and 5 between them where there is room."""
        steps = (1, 2, 5) if self._high - self._low < 2.5 else (1,)
        decades = range(math.floor(self._low), math.ceil(self._high) + 1)
        values = [step * 10.0**decade for decade in decades for step in steps]
        return [(v, f"{v:g}") for v in values if self._low <= math.log10(v) <= self._high]
