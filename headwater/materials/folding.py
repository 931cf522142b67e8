# SPDX-License-Identifier: Apache-2.0
"""Values of operations whose operands are constants: what the interpreter would compute, in Python.

Mirrors shaders/lib/math_ops.h and color_ops.h; a test compares the two through the C++ reference.
"""

import math

from headwater.materials import opcodes as op


def _each(function):
    return lambda *v: tuple(function(*c) for c in zip(*v, strict=True))


def _divide(a: float, b: float) -> float:
    return a / b if b != 0 else 0.0


def _dot(a, b) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _normalize(a):
    length = math.sqrt(_dot(a, a))
    return tuple(x / length for x in a) if length > 0 else (0.0, 0.0, 0.0)


_CORE = {
    op.OP_FMA: _each(lambda a, b, c: a * b + c),
    op.OP_MIX: _each(lambda a, b, c: a + (b - a) * c),
    op.OP_DIV: _each(_divide),
    op.OP_MIN: _each(min),
    op.OP_MAX: _each(max),
    op.OP_LESS: _each(lambda a, b: 1.0 if a < b else 0.0),
    op.OP_FLOOR: _each(lambda a: float(math.floor(a))),
    op.OP_SQRT: _each(lambda a: math.sqrt(max(a, 0.0))),
    op.OP_DOT: lambda a, b: (_dot(a, b),) * 3,
    op.OP_CROSS: _cross,
    op.OP_NORMALIZE: _normalize,
    op.OP_SELECT: _each(lambda a, b, c: b if c != 0 else a),
}


def power(a: float, b: float) -> float:
    """1 for b = 0, 0 where undefined."""
    if b == 0:
        return 1.0
    if a == 0 or (a < 0 and b != math.floor(b)):
        return 0.0
    try:
        return math.pow(a, b)
    except OverflowError:
        return math.inf if a > 0 or b % 2 == 0 else -math.inf


def _bounded(function, x: float) -> float:
    try:
        return function(x)
    except OverflowError:
        return math.copysign(math.inf, function(math.copysign(1.0, x)))


_SCALAR = {
    op.MATH_POW: power,
    op.MATH_LOG: lambda a, b: _divide(math.log(a), math.log(b)) if a > 0 and b > 0 else 0.0,
    op.MATH_EXP: lambda a, b: _bounded(math.exp, a),
    op.MATH_SIN: lambda a, b: math.sin(a),
    op.MATH_COS: lambda a, b: math.cos(a),
    op.MATH_TAN: lambda a, b: math.tan(a),
    op.MATH_ASIN: lambda a, b: math.asin(max(-1.0, min(1.0, a))),
    op.MATH_ACOS: lambda a, b: math.acos(max(-1.0, min(1.0, a))),
    op.MATH_ATAN2: lambda a, b: math.atan2(a, b) if a or b else 0.0,
    op.MATH_SINH: lambda a, b: _bounded(math.sinh, a),
    op.MATH_COSH: lambda a, b: _bounded(math.cosh, a),
    op.MATH_TANH: lambda a, b: math.tanh(a),
}


def _hue_to_rgb(h: float):
    h6 = h * 6.0
    parts = (abs(h6 - 3.0) - 1.0, 2.0 - abs(h6 - 2.0), 2.0 - abs(h6 - 4.0))
    return tuple(max(0.0, min(1.0, x)) for x in parts)


def color_convert(conversion: int, c):
    """op.COLOR_*: RGB, HSV and HSL, hue in 0..1."""
    if conversion == op.COLOR_HSV_TO_RGB:
        if c[0] < 0 or c[0] > 1:
            f = c[0] * 6.0 - math.floor(c[0] * 6.0)
            return (c[2], c[2] * (1 - c[1]), c[2] * (1 - c[1] * f)) if c[1] else (c[2],) * 3
        return tuple((1.0 - (1.0 - p) * c[1]) * c[2] for p in _hue_to_rgb(c[0]))
    if conversion == op.COLOR_HSL_TO_RGB:
        chroma = (1.0 - abs(2.0 * c[2] - 1.0)) * c[1]
        return tuple((p - 0.5) * chroma + c[2] for p in _hue_to_rgb(c[0]))
    top, bottom = max(c), min(c)
    delta = top - bottom
    hue = 0.0
    if delta > 0:
        if c[0] == top:
            hue = (c[1] - c[2]) / delta
        elif c[1] == top:
            hue = 2.0 + (c[2] - c[0]) / delta
        else:
            hue = 4.0 + (c[0] - c[1]) / delta
        hue = hue / 6.0 + (1.0 if hue < 0 else 0.0)
    if conversion == op.COLOR_RGB_TO_HSV:
        saturation = delta / top if top else 0.0
        return (hue if saturation else 0.0, saturation, top)
    lightness = min(1.0, 0.5 * (top + bottom))
    extent = 2.0 - top - bottom if lightness > 0.5 else top + bottom
    return (hue, delta / extent if delta > 0 and extent else 0.0, lightness)


def _table(rows, sub: int, x: float, component: int) -> float:
    last = len(rows) - 1
    step = bool(sub & op.TABLE_STEP)
    at = max(0.0, min(1.0, x)) * last
    low = math.floor(at) if step else min(math.floor(at), max(last - 1, 0))
    t = 0.0 if step else at - low
    if sub & op.TABLE_EXTRAPOLATE and not 0 <= x <= 1:
        t = x * last - low
    a, b = float(rows[low][component]), float(rows[min(low + 1, last)][component])
    return a + (b - a) * t


def fold(code: int, values, sub: int, imm):
    """The three floats a row gives for constant operands, or None if this operation isn't folded."""
    if code in _CORE:
        return _CORE[code](*values)
    if code == op.OP_COMBINE:
        return tuple(values[i][(sub >> 2 * i) & 3] for i in range(3))
    if code == op.OP_MATH:
        return (_SCALAR[sub](values[0][0], values[1][0]),) * 3
    if code == op.OP_COLOR:
        return color_convert(sub, values[0])
    if code == op.OP_MATRIX:
        return tuple(float(_dot(row[:3], values[0]) + row[3]) for row in imm.rows)
    if code == op.OP_TABLE:
        return tuple(_table(imm.rows, sub, values[0][i], 3 if sub & op.TABLE_ALPHA else i) for i in range(3))
    return None
