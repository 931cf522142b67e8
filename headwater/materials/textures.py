# SPDX-License-Identifier: Apache-2.0
"""Procedural textures and image sampling as expressions, with the semantics of Blender's texture nodes."""

import math

from headwater.materials import opcodes as op
from headwater.materials.expression import Expr, Graph

NOISE_TYPES = {
    "FBM": op.NOISE_FBM,
    "MULTIFRACTAL": op.NOISE_MULTIFRACTAL,
    "RIDGED_MULTIFRACTAL": op.NOISE_RIDGED,
    "HYBRID_MULTIFRACTAL": op.NOISE_HYBRID,
    "HETERO_TERRAIN": op.NOISE_HETERO_TERRAIN,
}
VORONOI_FEATURES = {
    "F1": op.VORONOI_F1,
    "F2": op.VORONOI_F2,
    "SMOOTH_F1": op.VORONOI_SMOOTH_F1,
    "DISTANCE_TO_EDGE": op.VORONOI_DISTANCE_TO_EDGE,
    "N_SPHERE_RADIUS": op.VORONOI_N_SPHERE_RADIUS,
}
VORONOI_METRICS = {
    "EUCLIDEAN": op.METRIC_EUCLIDEAN,
    "MANHATTAN": op.METRIC_MANHATTAN,
    "CHEBYCHEV": op.METRIC_CHEBYCHEV,
    "MINKOWSKI": op.METRIC_MINKOWSKI,
}
INTERPOLATIONS = {
    "Linear": op.INTERPOLATION_LINEAR,
    "Closest": op.INTERPOLATION_CLOSEST,
    "Cubic": op.INTERPOLATION_CUBIC,
    "Smart": op.INTERPOLATION_CUBIC,
}
EXTENSIONS = {
    "REPEAT": op.EXTENSION_REPEAT,
    "EXTEND": op.EXTENSION_EXTEND,
    "CLIP": op.EXTENSION_CLIP,
    "MIRROR": op.EXTENSION_MIRROR,
}


def noise(
    g: Graph,
    kind: str,
    dims: int,
    normalize: bool,
    color: bool,
    co,
    w,
    scale,
    detail,
    roughness,
    lacunarity,
    distortion,
    offset,
    gain,
) -> Expr:
    """Noise Texture: the factor, or with `color` the colour."""
    sub = NOISE_TYPES[kind] | dims << 4 | (1 << 8 if normalize else 0) | (1 << 9 if color else 0)
    b = g.combine(g.mul(w, scale), detail, roughness)
    c = g.combine(lacunarity, distortion, offset)
    return g.make(op.OP_NOISE, g.mul(co, scale), b, c, gain, sub=sub)


def voronoi(
    g: Graph,
    feature: str,
    metric: str,
    dims: int,
    normalize: bool,
    output: int,
    co,
    w,
    scale,
    detail,
    roughness,
    lacunarity,
    smoothness,
    exponent,
    randomness,
) -> Expr:
    """Voronoi Texture; `output` is op.VORONOI_OUT_*. Positions come back in unscaled coordinates."""
    sub = VORONOI_FEATURES[feature] | VORONOI_METRICS[metric] << 3 | dims << 6
    sub |= (1 << 9 if normalize else 0) | output << 10
    b = g.combine(g.mul(w, scale), detail, roughness)
    c = g.combine(lacunarity, smoothness, exponent)
    result = g.make(op.OP_VORONOI, g.mul(co, scale), b, c, randomness, sub=sub)
    return g.div(result, scale) if output in (op.VORONOI_OUT_POSITION, op.VORONOI_OUT_W) else result


def white_noise(g: Graph, dims: int, color: bool, co: Expr, w: Expr) -> Expr:
    return g.make(op.OP_WHITE_NOISE, co, w, sub=dims | (16 if color else 0))


def magic(g: Graph, depth: int, co: Expr, scale: Expr, distortion: Expr) -> Expr:
    return g.make(op.OP_MAGIC, co, distortion, scale, sub=max(0, min(depth, 10)))


def brick(
    g: Graph,
    offset,
    offset_frequency: int,
    squash,
    squash_frequency: int,
    co,
    scale,
    mortar_size,
    mortar_smooth,
    bias,
    width,
    height,
) -> Expr:
    """(tint, mortar, 0); offset and squash are numbers of the node."""
    sub = max(0, min(offset_frequency, 255)) | max(0, min(squash_frequency, 255)) << 8
    b = g.combine(mortar_size, mortar_smooth, bias)
    c = g.combine(width, height, g.const(offset))
    return g.make(op.OP_BRICK, g.mul(co, scale), b, c, g.const(squash), sub=sub)


def _off_lattice(g: Graph, p: Expr) -> Expr:
    """Moves coordinates off whole numbers, where faces of unit objects would flicker; Blender's amounts."""
    return g.scale(g.add(p, g.const(1e-6)), 0.999999)


def checker(g: Graph, co: Expr, scale: Expr) -> Expr:
    """1 in every other cell."""
    cell = g.floor(_off_lattice(g, g.mul(co, scale)))
    total = g.dot(cell, g.one)
    odd = g.sub(total, g.scale(g.floor(g.scale(total, 0.5)), 2.0))
    return g.abs(odd)


def gradient(g: Graph, kind: str, co: Expr) -> Expr:
    x, y = g.component(co, 0), g.component(co, 1)
    if kind == "LINEAR":
        value = x
    elif kind == "QUADRATIC":
        r = g.max(x, g.zero)
        value = g.mul(r, r)
    elif kind == "EASING":
        r = g.clamp(x)
        value = g.mul(g.mul(r, r), g.fma(r, g.const(-2.0), g.const(3.0)))
    elif kind == "DIAGONAL":
        value = g.scale(g.add(x, y), 0.5)
    elif kind == "RADIAL":
        value = g.fma(g.function(op.MATH_ATAN2, y, x), g.const(0.5 / math.pi), g.const(0.5))
    else:
        r = g.max(g.sub(g.const(0.999999), g.length(co)), g.zero)
        value = g.mul(r, r) if kind == "QUADRATIC_SPHERE" else r
    return g.clamp(value)


def wave(
    g: Graph,
    kind: str,
    bands: str,
    rings: str,
    profile: str,
    co,
    scale,
    distortion,
    detail,
    detail_scale,
    detail_roughness,
    phase,
) -> Expr:
    p = _off_lattice(g, g.mul(co, scale))
    if kind == "BANDS":
        n = g.scale(g.dot(p, g.one), 10.0) if bands == "DIAGONAL" else g.scale(g.component(p, "XYZ".index(bands)), 20.0)
    else:
        if rings != "SPHERICAL":
            p_ring = g.mul(p, g.const(*(0.0 if axis == rings else 1.0 for axis in "XYZ")))
        else:
            p_ring = p
        n = g.scale(g.length(p_ring), 20.0)
    n = g.add(n, phase)
    if distortion.value != (0.0, 0.0, 0.0):
        bumps = noise(
            g,
            "FBM",
            3,
            True,
            False,
            p,
            g.zero,
            detail_scale,
            detail,
            detail_roughness,
            g.const(2.0),
            g.zero,
            g.zero,
            g.zero,
        )
        n = g.fma(g.fma(bumps, g.const(2.0), g.const(-1.0)), distortion, n)
    if profile == "SIN":
        return g.fma(g.function(op.MATH_SIN, g.sub(n, g.const(math.pi / 2))), g.const(0.5), g.const(0.5))
    turns = g.scale(n, 0.5 / math.pi)
    if profile == "SAW":
        return g.fract(turns)
    return g.scale(g.abs(g.sub(turns, g.floor(g.add(turns, g.const(0.5))))), 2.0)


def sphere_coordinates(g: Graph, co: Expr) -> Expr:
    """Image coordinates of a sphere around (0.5, 0.5, 0.5) of Generated space."""
    p = g.fma(co, g.const(2.0), g.const(-1.0))
    x, y, z = (g.component(p, i) for i in range(3))
    length = g.length(p)
    # At the poles of the map, where x and y vanish, u is 0.
    u = g.fma(g.function(op.MATH_ATAN2, x, y), g.const(-0.5 / math.pi), g.const(0.5))
    on_axis = g.add(g.abs(x), g.abs(y))
    u = g.select(on_axis, g.zero, u)
    v = g.fma(g.function(op.MATH_ACOS, g.clamp(g.div(z, length), -1.0, 1.0)), g.const(-1.0 / math.pi), g.one)
    return g.select(length, g.zero, g.combine(u, v, g.zero))


def tube_coordinates(g: Graph, co: Expr) -> Expr:
    """Image coordinates of a cylinder along z of Generated space."""
    p = g.fma(co, g.const(2.0), g.const(-1.0))
    x, y, z = (g.component(p, i) for i in range(3))
    flat = g.combine(x, y, g.zero)
    length = g.length(flat)
    inverse = g.div(g.one, length)
    u = g.scale(
        g.one_minus(g.scale(g.function(op.MATH_ATAN2, g.mul(x, inverse), g.mul(y, inverse)), 1.0 / math.pi)), 0.5
    )
    v = g.scale(g.add(z, g.one), 0.5)
    return g.select(length, g.zero, g.combine(u, v, g.zero))


def image(
    g: Graph,
    index: int,
    co: Expr,
    interpolation: str,
    extension: str,
    *,
    box_blend=None,
    normal: Expr | None = None,
) -> Expr:
    """Colour of image `index` of the material's list. `box_blend`: of a box projection, with an object-space normal."""
    sub = INTERPOLATIONS[interpolation] | EXTENSIONS[extension] << 2
    if box_blend is not None:
        sub |= op.PROJECTION_BOX << 4 | round(max(0.0, min(1.0, box_blend)) * 255) << 8
    return g.make_varying(op.OP_IMAGE, co, g.zero if normal is None else normal, sub=sub, imm=index)


def environment_coordinates(g: Graph, projection: str, direction: Expr) -> Expr:
    """EQUIRECTANGULAR or MIRROR_BALL."""
    return g.make(op.OP_ENVIRONMENT, direction, sub=1 if projection == "MIRROR_BALL" else 0)
