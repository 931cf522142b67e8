# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture nodes. Unlinked coordinates are Generated for procedural textures and the default UV map for images."""

from headwater.materials import arithmetic, textures
from headwater.materials import opcodes as op

from . import sky
from .images import ImageRequest, image_key


def _texture_mapping(call, co):
    """The mapping that old files keep in the texture node itself."""
    m = getattr(call.node, "texture_mapping", None)
    if m is None:
        return co
    g = call.graph
    identity = (
        m.vector_type == "POINT" and not any(m.translation) and not any(m.rotation) and all(s == 1 for s in m.scale)
    )
    if not identity:
        parts = (g.const(*m.translation), g.const(*m.rotation), g.const(*m.scale))
        co = arithmetic.mapping_node(g, m.vector_type, co, *parts)
    axes = (m.mapping_x, m.mapping_y, m.mapping_z)
    if axes != ("X", "Y", "Z"):
        co = g.combine(*(g.zero if a == "NONE" else g.component(co, "XYZ".index(a)) for a in axes))
    return co


def _coordinates(call, kind=op.INPUT_GENERATED):
    default = call.graph.position if kind is None else (lambda: call.input(kind))
    if kind == op.INPUT_GENERATED:
        default = call.generated
    return _texture_mapping(call, (yield call("Vector", default)))


def _scalar(call, value, color):
    """Factor or colour, as the asked output is."""
    return value if call.wanted in ("Fac", "Factor") else color


def noise(call):
    g, node = call.graph, call.node
    co = yield from _coordinates(call)
    names = ("W", "Scale", "Detail", "Roughness", "Lacunarity", "Distortion", "Offset", "Gain")
    values = []
    for name in names:
        values.append((yield call(name)))
    color = call.wanted == "Color"
    dims = int(node.noise_dimensions[0])
    return textures.noise(g, node.noise_type, dims, node.normalize, color, co, *values)


def voronoi(call):
    g, node = call.graph, call.node
    co = yield from _coordinates(call)
    names = ("W", "Scale", "Detail", "Roughness", "Lacunarity", "Smoothness", "Exponent", "Randomness")
    values = []
    for name in names:
        values.append((yield call(name)))
    outputs = {"Color": op.VORONOI_OUT_COLOR, "Position": op.VORONOI_OUT_POSITION, "W": op.VORONOI_OUT_W}
    dims = int(node.voronoi_dimensions[0])
    wanted = outputs.get(call.wanted, op.VORONOI_OUT_DISTANCE)
    return textures.voronoi(g, node.feature, node.distance, dims, node.normalize, wanted, co, *values)


def white_noise(call):
    co = yield call("Vector", call.generated)
    w = yield call("W")
    return textures.white_noise(call.graph, int(call.node.noise_dimensions[0]), call.wanted == "Color", co, w)


def wave(call):
    node = call.node
    co = yield from _coordinates(call)
    names = ("Scale", "Distortion", "Detail", "Detail Scale", "Detail Roughness", "Phase Offset")
    values = []
    for name in names:
        values.append((yield call(name)))
    return textures.wave(
        call.graph, node.wave_type, node.bands_direction, node.rings_direction, node.wave_profile, co, *values
    )


def magic(call):
    co = yield from _coordinates(call)
    scale, distortion = (yield call("Scale")), (yield call("Distortion"))
    color = textures.magic(call.graph, call.node.turbulence_depth, co, scale, distortion)
    return _scalar(call, call.graph.average(color), color)


def checker(call):
    g = call.graph
    co = yield from _coordinates(call)
    a, b, scale = (yield call("Color1")), (yield call("Color2")), (yield call("Scale"))
    factor = textures.checker(g, co, scale)
    # The first colour is where the factor is 1.
    return _scalar(call, factor, g.select(factor, b, a))


def gradient(call):
    co = yield from _coordinates(call)
    return textures.gradient(call.graph, call.node.gradient_type, co)


def brick(call):
    g, node = call.graph, call.node
    co = yield from _coordinates(call)
    values = {}
    for name in (
        "Color1",
        "Color2",
        "Mortar",
        "Scale",
        "Mortar Size",
        "Mortar Smooth",
        "Bias",
        "Brick Width",
        "Row Height",
    ):
        values[name] = yield call(name)
    result = textures.brick(
        g,
        node.offset,
        node.offset_frequency,
        node.squash,
        node.squash_frequency,
        co,
        values["Scale"],
        values["Mortar Size"],
        values["Mortar Smooth"],
        values["Bias"],
        values["Brick Width"],
        values["Row Height"],
    )
    tint, mortar = g.component(result, 0), g.component(result, 1)
    bricks = g.mix(values["Color1"], values["Color2"], tint)
    return _scalar(call, mortar, g.mix(bricks, values["Mortar"], mortar))


def _sample(call, co, extension: str, box_blend=None):
    g, node = call.graph, call.node
    picture = node.image
    if picture is None:
        return g.one if call.wanted == "Alpha" else g.const(1.0, 0.0, 1.0)  # as a missing image in Cycles
    request = ImageRequest(picture, node.image_user.frame_current if picture.source in ("SEQUENCE", "MOVIE") else 0)
    if picture.source == "TILED":
        call.unsupported("UDIM tiles are not supported; the first tile is used")
    index = call.compiler.image_index(image_key(request), request)
    normal = call.input(op.INPUT_OBJECT_NORMAL) if box_blend is not None else None
    texel = textures.image(
        g,
        index,
        co,
        node.interpolation,
        extension,
        box_blend=box_blend,
        normal=normal,
    )
    return g.alpha(texel) if call.wanted == "Alpha" else texel


def image(call):
    g, node = call.graph, call.node
    box = node.projection == "BOX"
    co = yield from _coordinates(call, op.INPUT_UV)
    if node.projection == "SPHERE":
        co = textures.sphere_coordinates(g, co)
    elif node.projection == "TUBE":
        co = textures.tube_coordinates(g, co)
    return _sample(call, co, node.extension, node.projection_blend if box else None)


def environment(call):
    direction = yield from _coordinates(call, None)
    co = textures.environment_coordinates(call.graph, call.node.projection, direction)
    return _sample(call, co, "REPEAT")


def sky_texture(call):
    direction = yield from _coordinates(call, None)
    return sky.sky(call, direction)


def ies(call):
    call.unsupported("IES profiles are not supported; an even distribution is used")
    return (yield call("Strength"))


HANDLERS = {
    "ShaderNodeTexNoise": noise,
    "ShaderNodeTexVoronoi": voronoi,
    "ShaderNodeTexWhiteNoise": white_noise,
    "ShaderNodeTexWave": wave,
    "ShaderNodeTexMagic": magic,
    "ShaderNodeTexChecker": checker,
    "ShaderNodeTexGradient": gradient,
    "ShaderNodeTexBrick": brick,
    "ShaderNodeTexImage": image,
    "ShaderNodeTexEnvironment": environment,
    "ShaderNodeTexSky": sky_texture,
    "ShaderNodeTexIES": ies,
}
