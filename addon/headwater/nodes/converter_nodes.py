# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour, vector and converter nodes."""

import numpy as np

from headwater.materials import arithmetic, color, spectrum
from headwater.materials import opcodes as op

RAMP_ENTRIES = 256  # Cycles' tables of ramps and curves have as many


def rgb(call):
    return call.compiler.default(call.node.outputs[0])


def _clamped(call, value, on: bool):
    return call.graph.clamp(value) if on else value


def math_node(call):
    a, b, c = (yield call(0)), (yield call(1)), (yield call(2))
    return _clamped(call, arithmetic.math_node(call.graph, call.node.operation, a, b, c), call.node.use_clamp)


def vector_math(call):
    a, b, c, scale = (yield call(0)), (yield call(1)), (yield call(2)), (yield call("Scale"))
    return arithmetic.vector_math_node(call.graph, call.node.operation, a, b, c, scale)


def mapping(call):
    vector, rotation, scale = (yield call("Vector")), (yield call("Rotation")), (yield call("Scale"))
    location = (yield call("Location")) if call.has("Location") else call.graph.zero
    return arithmetic.mapping_node(call.graph, call.node.vector_type, vector, location, rotation, scale)


def vector_rotate(call):
    v, center, axis = (yield call("Vector")), (yield call("Center")), (yield call("Axis"))
    angle, rotation = (yield call("Angle")), (yield call("Rotation"))
    return arithmetic.vector_rotate_node(
        call.graph, call.node.rotation_type, v, center, axis, angle, rotation, call.node.invert
    )


def map_range(call):
    node = call.node
    if node.data_type == "FLOAT_VECTOR":
        names = ("Vector", "From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3", "Steps_FLOAT3")
    else:
        names = ("Value", "From Min", "From Max", "To Min", "To Max", "Steps")
    values = []
    for name in names:
        values.append((yield call(name)))
    return arithmetic.map_range_node(call.graph, node.interpolation_type, *values, node.clamp)


def clamp(call):
    value, low, high = (yield call("Value")), (yield call("Min")), (yield call("Max"))
    return arithmetic.clamp_node(call.graph, call.node.clamp_type, value, low, high)


def combine_xyz(call):
    x, y, z = (yield call(0)), (yield call(1)), (yield call(2))
    return call.graph.combine(x, y, z)


def separate_xyz(call):
    vector = yield call(0)
    return call.graph.component(vector, list(call.node.outputs).index(call.output))


_FROM = {"HSV": op.COLOR_HSV_TO_RGB, "HSL": op.COLOR_HSL_TO_RGB}
_TO = {"HSV": op.COLOR_RGB_TO_HSV, "HSL": op.COLOR_RGB_TO_HSL}


def combine_color(call):
    x, y, z = (yield call(0)), (yield call(1)), (yield call(2))
    combined = call.graph.combine(x, y, z)
    mode = call.node.mode
    return combined if mode == "RGB" else call.graph.make(op.OP_COLOR, combined, sub=_FROM[mode])


def separate_color(call):
    value = yield call(0)
    mode = call.node.mode
    if mode != "RGB":
        value = call.graph.make(op.OP_COLOR, value, sub=_TO[mode])
    return call.graph.component(value, list(call.node.outputs).index(call.output))


def rgb_to_bw(call):
    return call.graph.luminance((yield call(0)))


def mix(call):
    g, node = call.graph, call.node
    kind = node.data_type
    if kind == "VECTOR" and node.factor_mode == "NON_UNIFORM":
        factor = yield call("Factor_Vector")
    else:
        factor = yield call("Factor_Float")
    factor = _clamped(call, factor, node.clamp_factor)
    suffix = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color", "ROTATION": "Rotation"}[kind]
    a, b = (yield call(f"A_{suffix}")), (yield call(f"B_{suffix}"))
    if kind != "RGBA":
        return g.mix(a, b, factor)
    return _clamped(call, color.blend(g, node.blend_type, factor, a, b), node.clamp_result)


def mix_rgb(call):
    factor, a, b = (yield call(0)), (yield call(1)), (yield call(2))
    g, node = call.graph, call.node
    return _clamped(call, color.blend(g, node.blend_type, g.clamp(factor), a, b), node.use_clamp)


def hue_saturation(call):
    hue, saturation, value = (yield call("Hue")), (yield call("Saturation")), (yield call("Value"))
    factor, c = (yield call(3)), (yield call("Color"))
    return color.hue_saturation(call.graph, c, hue, saturation, value, factor)


def gamma(call):
    return color.gamma(call.graph, (yield call("Color")), (yield call("Gamma")))


def bright_contrast(call):
    c, bright, contrast = (yield call("Color")), (yield call(1)), (yield call("Contrast"))
    return color.brightness_contrast(call.graph, c, bright, contrast)


def invert(call):
    factor, c = (yield call(0)), (yield call("Color"))
    return color.invert(call.graph, c, factor)


def color_ramp(call):
    g, ramp = call.graph, call.node.color_ramp
    factor = yield call(0)
    positions = np.linspace(0.0, 1.0, RAMP_ENTRIES)
    rows = np.array([ramp.evaluate(x) for x in positions], np.float32)
    step = ramp.interpolation == "CONSTANT"
    return g.table(factor, rows, step=step, alpha=call.wanted == "Alpha")


def _curve_table(mapping_, curves):
    """(table, low, high) of curves over the range their points span; curve i is component i."""
    mapping_.initialize()
    points = [p.location[0] for curve in curves for p in curve.points]
    low, high = min(0.0, *points), max(1.0, *points)
    xs = np.linspace(low, high, RAMP_ENTRIES)
    rows = np.zeros((RAMP_ENTRIES, 4), np.float32)
    for i, curve in enumerate(curves):
        rows[:, i] = [mapping_.evaluate(curve, x) for x in xs]
    return rows, low, high


def _through_curves(call, value, rows, low, high, factor):
    g = call.graph
    extrapolate = call.node.mapping.extend == "EXTRAPOLATED"
    at = g.fma(value, g.const(1.0 / (high - low)), g.const(-low / (high - low)))
    return g.mix(value, g.table(at, rows, extrapolate=extrapolate), factor)


def rgb_curves(call):
    factor, c = (yield call(0)), (yield call("Color"))
    mapping_ = call.node.mapping
    mapping_.initialize()
    curves = list(mapping_.curves)
    rows, low, high = _curve_table(mapping_, curves[:3])
    # The combined curve acts first.
    points = [p.location[0] for p in curves[3].points]
    low, high = min(low, *points), max(high, *points)
    xs = np.linspace(low, high, RAMP_ENTRIES)
    combined = [mapping_.evaluate(curves[3], x) for x in xs]
    for i in range(3):
        rows[:, i] = [mapping_.evaluate(curves[i], x) for x in combined]
    return _through_curves(call, c, rows, low, high, factor)


def vector_curves(call):
    factor, vector = (yield call(0)), (yield call("Vector"))
    rows, low, high = _curve_table(call.node.mapping, list(call.node.mapping.curves)[:3])
    return _through_curves(call, vector, rows, low, high, factor)


def float_curve(call):
    factor, value = (yield call("Factor")), (yield call("Value"))
    rows, low, high = _curve_table(call.node.mapping, list(call.node.mapping.curves)[:1])
    rows[:, 1] = rows[:, 2] = rows[:, 0]
    return _through_curves(call, value, rows, low, high, factor)


def blackbody(call):
    return spectrum.blackbody(call.graph, (yield call("Temperature")))


def wavelength(call):
    return spectrum.wavelength(call.graph, (yield call("Wavelength")))


def shader_to_rgb(call):
    call.unsupported("Shader to RGB is EEVEE's only; black is used")
    return call.graph.zero


HANDLERS = {
    "ShaderNodeRGB": rgb,
    "ShaderNodeValue": rgb,
    "ShaderNodeMath": math_node,
    "ShaderNodeVectorMath": vector_math,
    "ShaderNodeMapping": mapping,
    "ShaderNodeVectorRotate": vector_rotate,
    "ShaderNodeMapRange": map_range,
    "ShaderNodeClamp": clamp,
    "ShaderNodeCombineXYZ": combine_xyz,
    "ShaderNodeSeparateXYZ": separate_xyz,
    "ShaderNodeCombineColor": combine_color,
    "ShaderNodeSeparateColor": separate_color,
    "ShaderNodeRGBToBW": rgb_to_bw,
    "ShaderNodeMix": mix,
    "ShaderNodeMixRGB": mix_rgb,
    "ShaderNodeHueSaturation": hue_saturation,
    "ShaderNodeGamma": gamma,
    "ShaderNodeBrightContrast": bright_contrast,
    "ShaderNodeInvert": invert,
    "ShaderNodeValToRGB": color_ramp,
    "ShaderNodeRGBCurve": rgb_curves,
    "ShaderNodeVectorCurve": vector_curves,
    "ShaderNodeFloatCurve": float_curve,
    "ShaderNodeBlackbody": blackbody,
    "ShaderNodeWavelength": wavelength,
    "ShaderNodeShaderToRGB": shader_to_rgb,
}
