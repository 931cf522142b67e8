# SPDX-License-Identifier: Apache-2.0
"""Blender's Math, Vector Math, Mapping, Map Range and Vector Rotate as expressions. Names are Blender's enum items."""

import math

from headwater.materials import opcodes as op
from headwater.materials.expression import Expr, Graph

_FLOAT_EPSILON = 1.1920929e-7


def _trunc(g: Graph, a: Expr) -> Expr:
    down = g.floor(a)
    up = g.negate(g.floor(g.negate(a)))
    return g.select(g.less(a, g.zero), down, up)


def _modulo(g: Graph, a: Expr, b: Expr) -> Expr:
    """C's fmod, 0 where b is 0."""
    return g.select(b, g.zero, g.sub(a, g.mul(b, _trunc(g, g.div(a, b)))))


def _wrap(g: Graph, value: Expr, high: Expr, low: Expr) -> Expr:
    extent = g.sub(high, low)
    wrapped = g.sub(value, g.mul(extent, g.floor(g.div(g.sub(value, low), extent))))
    return g.select(extent, low, wrapped)


def _sign(g: Graph, a: Expr) -> Expr:
    return g.sub(g.less(g.zero, a), g.less(a, g.zero))


def _smooth_min(g: Graph, a: Expr, b: Expr, k: Expr) -> Expr:
    h = g.div(g.max(g.sub(k, g.abs(g.sub(a, b))), g.zero), k)
    cubed = g.mul(g.mul(h, h), h)
    return g.sub(g.min(a, b), g.scale(g.mul(cubed, k), 1.0 / 6.0))


def _pingpong(g: Graph, a: Expr, b: Expr) -> Expr:
    twice = g.scale(b, 2.0)
    t = g.fract(g.div(g.sub(a, b), twice))
    return g.select(b, g.zero, g.abs(g.sub(g.mul(t, twice), b)))


def _compare(g: Graph, a: Expr, b: Expr, c: Expr) -> Expr:
    tolerance = g.max(c, g.const(_FLOAT_EPSILON))
    return g.one_minus(g.less(tolerance, g.abs(g.sub(a, b))))


_MATH = {
    "ADD": lambda g, a, b, c: g.add(a, b),
    "SUBTRACT": lambda g, a, b, c: g.sub(a, b),
    "MULTIPLY": lambda g, a, b, c: g.mul(a, b),
    "DIVIDE": lambda g, a, b, c: g.div(a, b),
    "MULTIPLY_ADD": lambda g, a, b, c: g.fma(a, b, c),
    "POWER": lambda g, a, b, c: g.function(op.MATH_POW, a, b),
    "LOGARITHM": lambda g, a, b, c: g.function(op.MATH_LOG, a, b),
    "SQRT": lambda g, a, b, c: g.sqrt(a),
    "INVERSE_SQRT": lambda g, a, b, c: g.div(g.one, g.sqrt(a)),
    "ABSOLUTE": lambda g, a, b, c: g.abs(a),
    "EXPONENT": lambda g, a, b, c: g.function(op.MATH_EXP, a),
    "MINIMUM": lambda g, a, b, c: g.min(a, b),
    "MAXIMUM": lambda g, a, b, c: g.max(a, b),
    "LESS_THAN": lambda g, a, b, c: g.less(a, b),
    "GREATER_THAN": lambda g, a, b, c: g.less(b, a),
    "SIGN": lambda g, a, b, c: _sign(g, a),
    "COMPARE": _compare,
    "SMOOTH_MIN": _smooth_min,
    "SMOOTH_MAX": lambda g, a, b, c: g.negate(_smooth_min(g, g.negate(a), g.negate(b), c)),
    "ROUND": lambda g, a, b, c: g.floor(g.add(a, g.const(0.5))),
    "FLOOR": lambda g, a, b, c: g.floor(a),
    "CEIL": lambda g, a, b, c: g.negate(g.floor(g.negate(a))),
    "TRUNC": lambda g, a, b, c: _trunc(g, a),
    "FRACT": lambda g, a, b, c: g.fract(a),
    "MODULO": lambda g, a, b, c: _modulo(g, a, b),
    "FLOORED_MODULO": lambda g, a, b, c: g.select(b, g.zero, g.sub(a, g.mul(g.floor(g.div(a, b)), b))),
    "WRAP": _wrap,
    "SNAP": lambda g, a, b, c: g.mul(g.floor(g.div(a, b)), b),
    "PINGPONG": lambda g, a, b, c: _pingpong(g, a, b),
    "SINE": lambda g, a, b, c: g.function(op.MATH_SIN, a),
    "COSINE": lambda g, a, b, c: g.function(op.MATH_COS, a),
    "TANGENT": lambda g, a, b, c: g.function(op.MATH_TAN, a),
    "ARCSINE": lambda g, a, b, c: g.function(op.MATH_ASIN, a),
    "ARCCOSINE": lambda g, a, b, c: g.function(op.MATH_ACOS, a),
    "ARCTANGENT": lambda g, a, b, c: g.function(op.MATH_ATAN2, a, g.one),
    "ARCTAN2": lambda g, a, b, c: g.function(op.MATH_ATAN2, a, b),
    "SINH": lambda g, a, b, c: g.function(op.MATH_SINH, a),
    "COSH": lambda g, a, b, c: g.function(op.MATH_COSH, a),
    "TANH": lambda g, a, b, c: g.function(op.MATH_TANH, a),
    "RADIANS": lambda g, a, b, c: g.scale(a, math.pi / 180.0),
    "DEGREES": lambda g, a, b, c: g.scale(a, 180.0 / math.pi),
}


def math_node(g: Graph, operation: str, a: Expr, b: Expr, c: Expr) -> Expr:
    """Math node on scalars, not clamped. Raises KeyError for an operation there isn't."""
    return _MATH[operation](g, a, b, c)


def _project(g: Graph, a: Expr, b: Expr) -> Expr:
    return g.mul(b, g.div(g.dot(a, b), g.dot(b, b)))


def reflect(g: Graph, incident: Expr, normal: Expr) -> Expr:
    """incident - 2 (normal . incident) normal, for a unit normal."""
    return g.fma(normal, g.scale(g.dot(normal, incident), -2.0), incident)


def _refract(g: Graph, incident: Expr, normal: Expr, eta: Expr) -> Expr:
    """GLSL's refract: zero on total internal reflection."""
    cosine = g.dot(normal, incident)
    k = g.one_minus(g.mul(g.mul(eta, eta), g.one_minus(g.mul(cosine, cosine))))
    bent = g.sub(g.mul(eta, incident), g.mul(normal, g.add(g.mul(eta, cosine), g.sqrt(k))))
    return g.select(g.less(k, g.zero), bent, g.zero)


_VECTOR = {
    "ADD": lambda g, a, b, c, s: g.add(a, b),
    "SUBTRACT": lambda g, a, b, c, s: g.sub(a, b),
    "MULTIPLY": lambda g, a, b, c, s: g.mul(a, b),
    "DIVIDE": lambda g, a, b, c, s: g.div(a, b),
    "MULTIPLY_ADD": lambda g, a, b, c, s: g.fma(a, b, c),
    "CROSS_PRODUCT": lambda g, a, b, c, s: g.cross(a, b),
    "PROJECT": lambda g, a, b, c, s: _project(g, a, b),
    "REFLECT": lambda g, a, b, c, s: reflect(g, a, g.normalize(b)),
    "REFRACT": lambda g, a, b, c, s: _refract(g, a, g.normalize(b), s),
    "FACEFORWARD": lambda g, a, b, c, s: g.select(g.less(g.dot(c, b), g.zero), g.negate(a), a),
    "DOT_PRODUCT": lambda g, a, b, c, s: g.dot(a, b),
    "DISTANCE": lambda g, a, b, c, s: g.length(g.sub(a, b)),
    "LENGTH": lambda g, a, b, c, s: g.length(a),
    "SCALE": lambda g, a, b, c, s: g.mul(a, s),
    "NORMALIZE": lambda g, a, b, c, s: g.normalize(a),
    "ABSOLUTE": lambda g, a, b, c, s: g.abs(a),
    "POWER": lambda g, a, b, c, s: g.by_component(op.MATH_POW, a, b),
    "SIGN": lambda g, a, b, c, s: _sign(g, a),
    "MINIMUM": lambda g, a, b, c, s: g.min(a, b),
    "MAXIMUM": lambda g, a, b, c, s: g.max(a, b),
    "FLOOR": lambda g, a, b, c, s: g.floor(a),
    "CEIL": lambda g, a, b, c, s: g.negate(g.floor(g.negate(a))),
    "FRACTION": lambda g, a, b, c, s: g.fract(a),
    "MODULO": lambda g, a, b, c, s: _modulo(g, a, b),
    "WRAP": lambda g, a, b, c, s: _wrap(g, a, b, c),
    "SNAP": lambda g, a, b, c, s: g.mul(g.floor(g.div(a, b)), b),
    "SINE": lambda g, a, b, c, s: g.by_component(op.MATH_SIN, a),
    "COSINE": lambda g, a, b, c, s: g.by_component(op.MATH_COS, a),
    "TANGENT": lambda g, a, b, c, s: g.by_component(op.MATH_TAN, a),
}


def vector_math_node(g: Graph, operation: str, a: Expr, b: Expr, c: Expr, scale: Expr) -> Expr:
    """Vector Math node; scalar results (Dot, Length, Distance) are in all components. KeyError: no such operation."""
    return _VECTOR[operation](g, a, b, c, scale)


def rotate_euler(g: Graph, v: Expr, rotation: Expr, inverse: bool = False) -> Expr:
    """v turned by XYZ Euler angles [rad], x first; the inverse turns back."""
    for axis in (2, 1, 0) if inverse else (0, 1, 2):
        angle = g.component(rotation, axis)
        v = rotate_axis(g, v, axis, g.negate(angle) if inverse else angle)
    return v


def rotate_axis(g: Graph, v: Expr, axis: int, angle: Expr) -> Expr:
    """v turned about a coordinate axis."""
    if angle.constant and angle.scalar == 0.0:
        return v
    if angle.constant:
        c, s = math.cos(angle.scalar), math.sin(angle.scalar)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        rows = [[0.0] * 4 for _ in range(3)]
        rows[axis][axis] = 1.0
        rows[i][i], rows[i][j], rows[j][i], rows[j][j] = c, -s, s, c
        return g.matrix(v, rows)
    unit = g.const(*(1.0 if k == axis else 0.0 for k in range(3)))
    return rotate_about(g, v, unit, angle)


def rotate_about(g: Graph, v: Expr, axis: Expr, angle: Expr) -> Expr:
    """v turned about a unit axis (Rodrigues)."""
    c, s = g.function(op.MATH_COS, angle), g.function(op.MATH_SIN, angle)
    along = g.mul(axis, g.mul(g.dot(axis, v), g.one_minus(c)))
    return g.fma(v, c, g.fma(g.cross(axis, v), s, along))


def _euler_rows(x: float, y: float, z: float):
    cx, sx, cy, sy, cz, sz = (f(a) for a in (x, y, z) for f in (math.cos, math.sin))
    return [
        [cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz],
        [cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz],
        [-sy, sx * cy, cx * cy],
    ]


def mapping_node(g: Graph, kind: str, v: Expr, location: Expr, rotation: Expr, scale: Expr) -> Expr:
    """Mapping node: POINT, TEXTURE, VECTOR or NORMAL. Constant settings become one matrix."""
    if location.constant and rotation.constant and scale.constant:
        r = _euler_rows(*rotation.value)
        s, t = scale.value, location.value
        inverse = [1.0 / x if x else 0.0 for x in s]
        if kind == "TEXTURE":
            rows = [[r[j][i] * inverse[i] for j in range(3)] for i in range(3)]
            offset = [-sum(rows[i][j] * t[j] for j in range(3)) for i in range(3)]
        else:
            factor = inverse if kind == "NORMAL" else s
            rows = [[r[i][j] * factor[j] for j in range(3)] for i in range(3)]
            offset = t if kind == "POINT" else (0.0, 0.0, 0.0)
        result = g.matrix(v, [[*row, o] for row, o in zip(rows, offset, strict=True)])
        return g.normalize(result) if kind == "NORMAL" else result
    if kind == "TEXTURE":
        return g.div(rotate_euler(g, g.sub(v, location), rotation, inverse=True), scale)
    if kind == "NORMAL":
        return g.normalize(rotate_euler(g, g.div(v, scale), rotation))
    turned = rotate_euler(g, g.mul(v, scale), rotation)
    return g.add(turned, location) if kind == "POINT" else turned


def vector_rotate_node(g: Graph, kind: str, v, center, axis, angle, rotation, invert: bool) -> Expr:
    """Vector Rotate node: AXIS_ANGLE, X_AXIS, Y_AXIS, Z_AXIS or EULER_XYZ."""
    local = g.sub(v, center)
    if kind == "EULER_XYZ":
        return g.add(rotate_euler(g, local, rotation, inverse=invert), center)
    turn = g.negate(angle) if invert else angle
    if kind == "AXIS_ANGLE":
        turned = g.add(rotate_about(g, local, g.normalize(axis), turn), center)
        return g.select(g.dot(axis, axis), v, turned)
    return g.add(rotate_axis(g, local, "XYZ".index(kind[0]), turn), center)


def map_range_node(g: Graph, kind: str, value, from_min, from_max, to_min, to_max, steps, clamp: bool) -> Expr:
    """Map Range node: LINEAR, STEPPED, SMOOTHSTEP or SMOOTHERSTEP, scalars or vectors."""
    t = g.div(g.sub(value, from_min), g.sub(from_max, from_min))
    if kind == "STEPPED":
        t = g.select(g.less(g.zero, steps), g.zero, g.div(g.floor(g.mul(t, g.add(steps, g.one))), steps))
    elif kind == "SMOOTHSTEP":
        t = g.clamp(t)
        t = g.mul(g.mul(t, t), g.fma(t, g.const(-2.0), g.const(3.0)))
    elif kind == "SMOOTHERSTEP":
        t = g.clamp(t)
        inner = g.fma(t, g.fma(t, g.const(6.0), g.const(-15.0)), g.const(10.0))
        t = g.mul(g.mul(g.mul(t, t), t), inner)
    result = g.fma(t, g.sub(to_max, to_min), to_min)
    if clamp and kind in ("LINEAR", "STEPPED"):
        result = g.min(g.max(result, g.min(to_min, to_max)), g.max(to_min, to_max))
    return result


def clamp_node(g: Graph, kind: str, value: Expr, low: Expr, high: Expr) -> Expr:
    """Clamp node: MINMAX or RANGE (bounds in either order)."""
    if kind == "RANGE":
        low, high = g.min(low, high), g.max(low, high)
    return g.min(g.max(value, low), high)
