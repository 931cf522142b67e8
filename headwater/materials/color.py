# SPDX-License-Identifier: Apache-2.0
"""Blender's colour nodes as expressions: blend modes, hue/saturation/value, gamma, invert, contrast, ramps."""

from headwater.materials import opcodes as op
from headwater.materials.expression import Expr, Graph


def to_hsv(g: Graph, c: Expr) -> Expr:
    return g.make(op.OP_COLOR, c, sub=op.COLOR_RGB_TO_HSV)


def from_hsv(g: Graph, c: Expr) -> Expr:
    return g.make(op.OP_COLOR, c, sub=op.COLOR_HSV_TO_RGB)


def _replace(g: Graph, a: Expr, b: Expr, channels: str) -> Expr:
    """HSV vector a with some of its channels ("h", "s", "v") from b."""
    source = [b if channel in channels else a for channel in "hsv"]
    return g.make(op.OP_COMBINE, *source, sub=0 | 1 << 2 | 2 << 4)


def _screen(g: Graph, t: Expr, a: Expr, b: Expr) -> Expr:
    # 1 - (1 - t + t (1 - b)) (1 - a)
    return g.one_minus(g.mul(g.one_minus(g.mul(t, b)), g.one_minus(a)))


def _overlay(g: Graph, t: Expr, a: Expr, b: Expr) -> Expr:
    low = g.mul(a, g.fma(t, g.fma(b, g.const(2.0), g.const(-1.0)), g.one))
    # 1 - t + 2 t (1 - b) = 1 + t (1 - 2 b)
    high = g.one_minus(g.mul(g.fma(t, g.fma(b, g.const(-2.0), g.one), g.one), g.one_minus(a)))
    return g.select(g.less(a, g.const(0.5)), high, low)


def _divide(g: Graph, t: Expr, a: Expr, b: Expr) -> Expr:
    return g.select(b, a, g.mix(a, g.div(a, b), t))


def _dodge(g: Graph, t: Expr, a: Expr, b: Expr) -> Expr:
    rest = g.one_minus(g.mul(t, b))
    bright = g.select(g.less(g.zero, rest), g.one, g.min(g.div(a, rest), g.one))
    return g.select(a, a, bright)


def _burn(g: Graph, t: Expr, a: Expr, b: Expr) -> Expr:
    rest = g.fma(t, g.sub(b, g.one), g.one)
    dark = g.clamp(g.one_minus(g.div(g.one_minus(a), rest)))
    return g.select(g.less(g.zero, rest), g.zero, dark)


def _soft_light(g: Graph, t: Expr, a: Expr, b: Expr) -> Expr:
    screen = g.one_minus(g.mul(g.one_minus(b), g.one_minus(a)))
    soft = g.add(g.mul(g.mul(g.one_minus(a), b), a), g.mul(a, screen))
    return g.mix(a, soft, t)


def _in_hsv(g: Graph, t: Expr, a: Expr, b: Expr, channels: str) -> Expr:
    hsv_a, hsv_b = to_hsv(g, a), to_hsv(g, b)
    if channels == "v":
        return from_hsv(g, _replace(g, hsv_a, g.mix(hsv_a, hsv_b, t), "v"))
    if channels == "s":
        changed = from_hsv(g, _replace(g, hsv_a, g.mix(hsv_a, hsv_b, t), "s"))
        return g.select(g.component(hsv_a, 1), a, changed)
    changed = g.mix(a, from_hsv(g, _replace(g, hsv_a, hsv_b, channels)), t)
    return g.select(g.component(hsv_b, 1), a, changed)


_BLEND = {
    "MIX": lambda g, t, a, b: g.mix(a, b, t),
    "DARKEN": lambda g, t, a, b: g.mix(a, g.min(a, b), t),
    "MULTIPLY": lambda g, t, a, b: g.mix(a, g.mul(a, b), t),
    "BURN": _burn,
    "LIGHTEN": lambda g, t, a, b: g.mix(a, g.max(a, b), t),
    "SCREEN": _screen,
    "DODGE": _dodge,
    "ADD": lambda g, t, a, b: g.fma(t, b, a),
    "OVERLAY": _overlay,
    "SOFT_LIGHT": _soft_light,
    "LINEAR_LIGHT": lambda g, t, a, b: g.fma(t, g.fma(b, g.const(2.0), g.const(-1.0)), a),
    "DIFFERENCE": lambda g, t, a, b: g.mix(a, g.abs(g.sub(a, b)), t),
    "EXCLUSION": lambda g, t, a, b: g.max(g.mix(a, g.fma(g.mul(a, b), g.const(-2.0), g.add(a, b)), t), g.zero),
    "SUBTRACT": lambda g, t, a, b: g.fma(t, g.negate(b), a),
    "DIVIDE": _divide,
    "HUE": lambda g, t, a, b: _in_hsv(g, t, a, b, "h"),
    "SATURATION": lambda g, t, a, b: _in_hsv(g, t, a, b, "s"),
    "COLOR": lambda g, t, a, b: _in_hsv(g, t, a, b, "hs"),
    "VALUE": lambda g, t, a, b: _in_hsv(g, t, a, b, "v"),
}


def blend(g: Graph, mode: str, t: Expr, a: Expr, b: Expr) -> Expr:
    """Mix node, colours; t is already clamped where it is to be. KeyError: no such mode."""
    return _BLEND[mode](g, t, a, b)


def hue_saturation(g: Graph, color, hue, saturation, value, fac) -> Expr:
    hsv = to_hsv(g, color)
    h = g.fract(g.add(g.add(g.component(hsv, 0), hue), g.const(0.5)))
    s = g.clamp(g.mul(g.component(hsv, 1), saturation))
    v = g.mul(g.component(hsv, 2), value)
    return g.max(g.mix(color, from_hsv(g, g.combine(h, s, v)), fac), g.zero)


def gamma(g: Graph, color: Expr, exponent: Expr) -> Expr:
    """Powers of positive components; others stay."""
    if exponent.constant and exponent.scalar == 1.0:
        return color
    raised = g.by_component(op.MATH_POW, g.max(color, g.zero), g.add(exponent, g.zero))
    kept = g.select(g.less(g.zero, color), color, raised)
    return g.select(exponent, g.one, kept)


def brightness_contrast(g: Graph, color: Expr, brightness: Expr, contrast: Expr) -> Expr:
    offset = g.fma(contrast, g.const(-0.5), brightness)
    return g.max(g.fma(color, g.add(contrast, g.one), offset), g.zero)


def invert(g: Graph, color: Expr, fac: Expr) -> Expr:
    return g.mix(color, g.one_minus(color), fac)
