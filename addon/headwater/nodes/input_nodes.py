# SPDX-License-Identifier: GPL-3.0-or-later
"""Input nodes: coordinates, attributes, geometry, object, camera and ray."""

from headwater.materials import attribute_hash
from headwater.materials import opcodes as op


def _pick(call, kind: int, component: int):
    return call.graph.component(call.input(kind), component)


def texture_coordinate(call):
    wanted, g = call.wanted, call.graph
    if wanted == "Generated":
        if call.node.from_instancer:
            call.unsupported("From Instancer is not supported; the object's own coordinates are used")
        return call.generated()
    if wanted == "Object" and call.node.object is not None:
        inverse = call.node.object.matrix_world.inverted_safe()
        return g.matrix(call.input(op.INPUT_POSITION), [list(row) for row in inverse][:3])
    kinds = {
        "Normal": op.INPUT_OBJECT_NORMAL,
        "UV": op.INPUT_UV,
        "Object": op.INPUT_OBJECT,
        "Camera": op.INPUT_CAMERA,
        "Window": op.INPUT_WINDOW,
        "Reflection": op.INPUT_REFLECTION,
    }
    if call.node.from_instancer:
        call.unsupported("From Instancer is not supported; the object's own coordinates are used")
    return call.input(kinds[wanted])


def uv_map(call):
    if call.node.from_instancer:
        call.unsupported("From Instancer is not supported; the mesh's own UV map is used")
    return uv(call, call.node.uv_map)


def uv(call, name: str):
    """A UV map by name; the default one for an empty name."""
    return call.attribute(name) if name else call.input(op.INPUT_UV)


def attribute(call):
    node = call.node
    name = node.attribute_name
    if node.attribute_type != "GEOMETRY":
        call.unsupported(f"attributes of type {node.attribute_type.title()} are not supported; 0 is used")
        return call.graph.zero
    if not name:
        return call.graph.zero
    return _named(call, name)


def _named(call, name: str):
    if call.wanted == "Alpha":
        return call.attribute(name, op.ATTRIBUTE_ALPHA)
    value = call.attribute(name)
    return call.graph.average(value) if call.wanted == "Fac" else value


def color_attribute(call):
    name = call.node.layer_name
    if not name:
        call.compiler.attributes.add("")
        call.unsupported("no colour attribute is chosen; black is used")
        return call.graph.zero
    return _named(call, name)


def geometry(call):
    g, wanted = call.graph, call.wanted
    if wanted == "Position":
        return call.input(op.INPUT_POSITION)
    if wanted == "Normal":
        return call.compiler.normal
    if wanted == "True Normal":
        return call.input(op.INPUT_TRUE_NORMAL)
    if wanted == "Incoming":
        return g.incoming
    if wanted == "Parametric":
        return call.input(op.INPUT_PARAMETRIC)
    if wanted == "Tangent":
        return call.input(op.INPUT_RADIAL_Z)
    if wanted == "Backfacing":
        return _pick(call, op.INPUT_IS_TRANSMISSION_VOLUME_BACKFACING, 2)
    call.unsupported(f"output '{wanted}' is not supported; 0.5 is used")
    return g.const(0.5)


def object_info(call):
    wanted = call.wanted
    if wanted == "Location":
        return call.input(op.INPUT_OBJECT_LOCATION)
    if wanted == "Color":
        return call.input(op.INPUT_OBJECT_COLOR)
    if wanted == "Alpha":
        call.unsupported("the object's alpha is not supported; 1 is used")
        return call.graph.one
    order = ("Object Index", "Random", "Material Index")
    return _pick(call, op.INPUT_OBJECT_DATA, order.index(wanted))


def camera_data(call):
    if call.wanted == "View Vector":
        return call.input(op.INPUT_CAMERA_VECTOR)
    return _pick(call, op.INPUT_CAMERA_DEPTH, 0 if call.wanted == "View Z Depth" else 1)


_LIGHT_PATH = {
    "Is Camera Ray": (op.INPUT_IS_CAMERA_SHADOW_DIFFUSE, 0),
    "Is Shadow Ray": (op.INPUT_IS_CAMERA_SHADOW_DIFFUSE, 1),
    "Is Diffuse Ray": (op.INPUT_IS_CAMERA_SHADOW_DIFFUSE, 2),
    "Is Glossy Ray": (op.INPUT_IS_GLOSSY_SINGULAR_REFLECTION, 0),
    "Is Singular Ray": (op.INPUT_IS_GLOSSY_SINGULAR_REFLECTION, 1),
    "Is Reflection Ray": (op.INPUT_IS_GLOSSY_SINGULAR_REFLECTION, 2),
    "Is Transmission Ray": (op.INPUT_IS_TRANSMISSION_VOLUME_BACKFACING, 0),
    "Is Volume Scatter Ray": (op.INPUT_IS_TRANSMISSION_VOLUME_BACKFACING, 1),
    "Ray Length": (op.INPUT_RAY_LENGTH_DEPTH_DIFFUSE, 0),
    "Ray Depth": (op.INPUT_RAY_LENGTH_DEPTH_DIFFUSE, 1),
    "Diffuse Depth": (op.INPUT_RAY_LENGTH_DEPTH_DIFFUSE, 2),
    "Glossy Depth": (op.INPUT_DEPTH_GLOSSY_TRANSPARENT_TRANSMISSION, 0),
    "Transparent Depth": (op.INPUT_DEPTH_GLOSSY_TRANSPARENT_TRANSMISSION, 1),
    "Transmission Depth": (op.INPUT_DEPTH_GLOSSY_TRANSPARENT_TRANSMISSION, 2),
}


def light_path(call):
    found = _LIGHT_PATH.get(call.wanted)
    if found is None:
        call.unsupported(f"output '{call.wanted}' is not supported; 0 is used")
        return call.graph.zero
    return _pick(call, *found)


def fresnel(call):
    ior = yield call("IOR")
    normal = yield call("Normal", call.compiler.normal)
    return call.graph.make_varying(op.OP_FRESNEL, ior, normal)


def layer_weight(call):
    g = call.graph
    blend = yield call("Blend")
    normal = yield call("Normal", call.compiler.normal)
    if call.wanted == "Fresnel":
        ior = g.div(g.one, g.max(g.one_minus(blend), g.const(1e-5)))
        return g.make_varying(op.OP_FRESNEL, ior, normal)
    facing = g.make_varying(op.OP_FRESNEL, g.one, normal, sub=1)
    b = g.clamp(blend, 0.0, 1.0 - 1e-5)
    exponent = g.select(g.less(b, g.const(0.5)), g.div(g.const(0.5), g.one_minus(b)), g.scale(b, 2.0))
    if not (blend.constant and blend.scalar == 0.5):
        facing = g.function(op.MATH_POW, facing, exponent)
    return g.one_minus(facing)


def tangent(call):
    node = call.node
    if node.direction_type == "RADIAL":
        return call.input(op.INPUT_RADIAL_X + "XYZ".index(node.axis))
    return call.attribute(f"{node.uv_map}.tangent", op.ATTRIBUTE_TANGENT)


def normal_node(call):
    # The Normal output is the node's own direction; Dot compares it with the input.
    g = call.graph
    own = g.normalize(call.compiler.default(call.node.outputs[0]))
    if call.wanted == "Normal":
        return own
    normal = yield call("Normal")
    return g.dot(own, g.normalize(normal))


def normal_map(call):
    g, node = call.graph, call.node
    color = yield call("Color")
    strength = yield call("Strength")
    spaces = {
        "TANGENT": op.NORMAL_MAP_TANGENT,
        "OBJECT": op.NORMAL_MAP_OBJECT,
        "WORLD": op.NORMAL_MAP_WORLD,
        "BLENDER_OBJECT": op.NORMAL_MAP_OBJECT,
        "BLENDER_WORLD": op.NORMAL_MAP_WORLD,
    }
    if node.space.startswith("BLENDER_"):  # y and z are stored turned round
        color = g.fma(color, g.const(1.0, -1.0, -1.0), g.const(0.0, 1.0, 1.0))
    space = spaces[node.space]
    name = 0
    if space == op.NORMAL_MAP_TANGENT:
        tangents = f"{node.uv_map}.tangent"
        call.compiler.attributes.add(tangents)
        name = attribute_hash(tangents)
    # Strength acts on the interpolated normal, whatever displaces it.
    return g.make_varying(op.OP_NORMAL_MAP, color, strength, g.normal, sub=space, imm=name)


def bump(call):
    g = call.graph
    normal = yield call("Normal", call.compiler.normal)
    if not call.socket("Height").is_linked or call.shift:
        return normal
    width = (yield call("Filter Width")) if call.has("Filter Width") else g.const(0.1)
    width = g.max(width, g.const(0.001))
    strength = yield call("Strength")
    distance = yield call("Distance")
    heights = [(yield call("Height"))]
    for shift in (1, 2):
        heights.append((yield call.shifted("Height", shift, width)))
    return bumped(g, heights, strength, g.negate(distance) if call.node.invert else distance, width, normal)


def bumped(g, heights, strength, distance, width, normal):
    """Normal of a height field; the heights at the point and at its two shifted copies."""
    if heights[0] is heights[1] and heights[0] is heights[2]:
        return normal
    settings = g.combine(strength, distance, width)
    return g.make_varying(op.OP_BUMP, g.combine(*heights), settings, normal)


def displacement(call):
    g = call.graph
    height = yield call("Height")
    midlevel = yield call("Midlevel")
    scale = yield call("Scale")
    normal = yield call("Normal", g.normal)
    return g.mul(g.normalize(normal), g.mul(g.sub(height, midlevel), scale))


def vector_transform(call):
    g, node = call.graph, call.node
    vector = yield call("Vector")
    spaces = {"WORLD": op.SPACE_WORLD, "OBJECT": op.SPACE_OBJECT, "CAMERA": op.SPACE_CAMERA}
    kinds = {"VECTOR": op.TRANSFORM_AS_VECTOR, "POINT": op.TRANSFORM_AS_POINT, "NORMAL": op.TRANSFORM_AS_NORMAL}
    sub = spaces[node.convert_from] | spaces[node.convert_to] << 2 | kinds[node.vector_type] << 4
    if node.convert_from == node.convert_to:
        return g.normalize(vector) if node.vector_type == "NORMAL" else vector
    return g.make_varying(op.OP_TRANSFORM, vector, sub=sub)


def light_falloff(call):
    g = call.graph
    strength = yield call("Strength")
    smooth = yield call("Smooth")
    length = _pick(call, op.INPUT_RAY_LENGTH_DEPTH_DIFFUSE, 0)
    # Suns and backgrounds are infinitely far: the node does nothing there.
    far = g.less(g.const(1e30), length)
    near = g.select(far, length, g.one)
    squared = g.mul(near, near)
    factor = {"Quadratic": g.one, "Linear": near, "Constant": squared}[call.wanted]
    soft = g.select(g.less(g.zero, smooth), g.one, g.div(squared, g.add(smooth, squared)))
    return g.select(far, g.mul(strength, g.mul(factor, soft)), strength)


def ambient_occlusion(call):
    call.unsupported("ambient occlusion is not supported; the surface counts as open")
    return (yield call("Color")) if call.wanted == "Color" else call.graph.one


def bevel(call):
    call.unsupported("bevel is not supported; the normal is unchanged")
    return (yield call("Normal", call.compiler.normal))


HANDLERS = {
    "ShaderNodeTexCoord": texture_coordinate,
    "ShaderNodeUVMap": uv_map,
    "ShaderNodeAttribute": attribute,
    "ShaderNodeVertexColor": color_attribute,
    "ShaderNodeNewGeometry": geometry,
    "ShaderNodeObjectInfo": object_info,
    "ShaderNodeCameraData": camera_data,
    "ShaderNodeLightPath": light_path,
    "ShaderNodeFresnel": fresnel,
    "ShaderNodeLayerWeight": layer_weight,
    "ShaderNodeTangent": tangent,
    "ShaderNodeNormal": normal_node,
    "ShaderNodeNormalMap": normal_map,
    "ShaderNodeBump": bump,
    "ShaderNodeDisplacement": displacement,
    "ShaderNodeVectorTransform": vector_transform,
    "ShaderNodeLightFalloff": light_falloff,
    "ShaderNodeAmbientOcclusion": ambient_occlusion,
    "ShaderNodeBevel": bevel,
}
