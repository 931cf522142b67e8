# SPDX-License-Identifier: GPL-3.0-or-later
"""Node set-ups whose colour is compared between Cycles and the engine.

Each is a function that builds nodes in a tree, given a coordinate socket (pixel_centres of the UV map, 0..1 over an
8x8-pixel square), and returns the output socket to show."""

import bpy

MATH = [item.identifier for item in bpy.types.ShaderNodeMath.bl_rna.properties["operation"].enum_items]
VECTOR_MATH = [item.identifier for item in bpy.types.ShaderNodeVectorMath.bl_rna.properties["operation"].enum_items]
BLENDS = [item.identifier for item in bpy.types.ShaderNodeMix.bl_rna.properties["blend_type"].enum_items]


def _new(tree, kind, **settings):
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in settings.items():
        setattr(node, name, value)
    return node


def _feed(tree, node, values: dict):
    """Sets inputs by name or index: numbers are values, sockets are linked."""
    for name, value in values.items():
        sockets = [s for s in node.inputs if s.enabled and (s.name == name or s.identifier == name)]
        socket = node.inputs[name] if isinstance(name, int) else sockets[0]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node


def _spread(tree, co, scale=(4.0, 3.0, 2.0), location=(-1.7, -1.3, 0.4), rotation=(0.3, -0.6, 0.9)):
    """The coordinate turned and stretched, so that all three components vary about 0."""
    node = _new(tree, "Mapping", vector_type="POINT")
    return _feed(tree, node, {"Vector": co, "Location": location, "Rotation": rotation, "Scale": scale}).outputs[0]


def _parts(tree, vector):
    return _feed(tree, _new(tree, "SeparateXYZ"), {0: vector}).outputs


def pixel_centres(tree, co):
    """The coordinate moved to its pixel's middle: exact in float32, so that hashes agree and jitter does not matter."""
    snap = _feed(tree, _new(tree, "VectorMath", operation="SNAP"), {0: co, 1: (0.125, 0.125, 0.125)}).outputs[0]
    middle = (0.0625, 0.0625, 0.0)
    return _feed(tree, _new(tree, "VectorMath", operation="ADD"), {0: snap, 1: middle}).outputs[0]


def _math(operation):
    def build(tree, co):
        x, y, _ = _parts(tree, _spread(tree, co))
        return _feed(tree, _new(tree, "Math", operation=operation), {0: x, 1: y, 2: 0.7}).outputs[0]

    return build


def _vector_math(operation):
    def build(tree, co):
        a = _spread(tree, co)
        b = _spread(tree, co, scale=(2.0, 5.0, 1.0), location=(-0.3, -2.2, 0.7), rotation=(0.9, 0.2, -0.4))
        node = _new(tree, "VectorMath", operation=operation)
        values = {0: a, 1: b, 2: (0.3, -0.4, 0.8)}
        if any(s.name == "Scale" and s.enabled for s in node.inputs):
            values["Scale"] = 0.75
        _feed(tree, node, values)
        return next(o for o in node.outputs if o.enabled)

    return build


def _blend(mode):
    def build(tree, co):
        a = _feed(tree, _new(tree, "VectorMath", operation="ABSOLUTE"), {0: _spread(tree, co)}).outputs[0]
        b = _feed(tree, _new(tree, "VectorMath", operation="FRACTION"), {0: _spread(tree, co, (3, 2, 1))}).outputs[0]
        node = _new(tree, "Mix", data_type="RGBA", blend_type=mode)
        return _feed(tree, node, {"Factor_Float": 0.65, "A_Color": a, "B_Color": b}).outputs[2]

    return build


def _texture(kind, settings=None, inputs=None, output=0, cells=False):
    def build(tree, co):
        vector = co if cells else _spread(tree, co)
        node = _new(tree, kind, **(settings or {}))
        values = dict(inputs or {})
        if any(s.name == "Vector" and s.enabled for s in node.inputs):
            values["Vector"] = vector
        return _feed(tree, node, values).outputs[output]

    return build


def _noise(dims, kind, output, **inputs):
    def build(tree, co):
        node = _new(tree, "TexNoise", noise_dimensions=f"{dims}D", noise_type=kind)
        values = {"Scale": 2.3, "Detail": 2.5, "Roughness": 0.6, "Lacunarity": 2.1, **inputs}
        if dims > 1:
            values["Vector"] = _spread(tree, co)
        if dims in (1, 4):
            values["W"] = _parts(tree, _spread(tree, co))[0]
        values = {k: v for k, v in values.items() if any(s.name == k and s.enabled for s in node.inputs)}
        return _feed(tree, node, values).outputs[output]

    return build


def _voronoi(dims, feature, metric="EUCLIDEAN", output="Distance", **inputs):
    def build(tree, co):
        node = _new(tree, "TexVoronoi", voronoi_dimensions=f"{dims}D", feature=feature)
        if feature not in ("DISTANCE_TO_EDGE", "N_SPHERE_RADIUS"):
            node.distance = metric
        node.normalize = inputs.pop("normalize", False) if "normalize" in inputs else False
        values = {"Scale": 1.7, "Randomness": 0.9, **inputs}
        if dims > 1:
            values["Vector"] = _spread(tree, co)
        if dims in (1, 4):
            values["W"] = _parts(tree, _spread(tree, co))[0]
        values = {k: v for k, v in values.items() if any(s.name == k and s.enabled for s in node.inputs)}
        return _feed(tree, node, values).outputs[output]

    return build


def _ramp(interpolation, mode="RGB"):
    def build(tree, co):
        node = _new(tree, "ValToRGB")
        ramp = node.color_ramp
        ramp.color_mode = mode
        ramp.interpolation = interpolation
        ramp.elements[0].color = (0.1, 0.7, 0.3, 1)
        ramp.elements[1].color = (0.9, 0.2, 0.6, 0.5)
        ramp.elements.new(0.37).color = (0.0, 0.1, 1.0, 0.2)
        return _feed(tree, node, {0: _parts(tree, co)[0]}).outputs[0]

    return build


def _curve(kind, extend):
    def build(tree, co):
        node = _new(tree, kind)
        node.mapping.extend = extend
        for i, curve in enumerate(node.mapping.curves):
            curve.points.new(0.4, 0.7 - 0.1 * i)
        node.mapping.update()
        wide = _spread(tree, co, scale=(1.6, 1.2, 1.0), location=(-0.31, -0.13, 0.2), rotation=(0, 0, 0))
        name = {"RGBCurve": "Color", "VectorCurve": "Vector", "FloatCurve": "Value"}[kind]
        value = _parts(tree, wide)[0] if kind == "FloatCurve" else wide
        return _feed(tree, node, {name: value}).outputs[0]

    return build


def _mapping(kind, varying):
    def build(tree, co):
        node = _new(tree, "Mapping", vector_type=kind)
        rotation = _spread(tree, co) if varying else (0.4, -0.7, 1.1)
        values = {"Vector": _spread(tree, co), "Rotation": rotation, "Scale": (1.5, 0.6, -2.0)}
        if kind in ("POINT", "TEXTURE"):
            values["Location"] = (0.3, -0.2, 0.9)
        return _feed(tree, node, values).outputs[0]

    return build


def _rotate(kind, invert):
    def build(tree, co):
        node = _new(tree, "VectorRotate", rotation_type=kind, invert=invert)
        values = {"Vector": _spread(tree, co), "Center": (0.2, -0.1, 0.4)}
        if kind == "EULER_XYZ":
            values["Rotation"] = (0.5, -0.3, 1.2)
        else:
            values["Angle"] = _parts(tree, co)[0]
        if kind == "AXIS_ANGLE":
            values["Axis"] = (0.3, 0.5, -0.8)
        return _feed(tree, node, values).outputs[0]

    return build


def _map_range(kind, data):
    def build(tree, co):
        node = _new(tree, "MapRange", interpolation_type=kind, data_type=data)
        if data == "FLOAT":
            values = {
                "Value": _parts(tree, _spread(tree, co))[0],
                "From Min": -0.8,
                "From Max": 1.1,
                "To Min": 2.0,
                "To Max": -1,
            }
            if kind == "STEPPED":
                values["Steps"] = 3.5
            return _feed(tree, node, values).outputs[0]
        values = {"Vector": _spread(tree, co), "From_Min_FLOAT3": (-0.8, -0.4, 0), "To_Max_FLOAT3": (2, -1, 0.5)}
        return _feed(tree, node, values).outputs[1]

    return build


def _simple(kind, inputs, output=0, **settings):
    """A node fed with the spread coordinate where an input is "co", its absolute value for "color", x for "x"."""

    def build(tree, co):
        spread = _spread(tree, co)
        values = {}
        for name, value in inputs.items():
            if value == "co":
                value = spread
            elif value == "color":
                value = _feed(tree, _new(tree, "VectorMath", operation="ABSOLUTE"), {0: spread}).outputs[0]
            elif value in ("x", "y", "z"):
                value = _parts(tree, spread)["xyz".index(value)]
            elif value == "u":
                value = _parts(tree, co)[0]
            elif value == "kelvin":
                value = _feed(
                    tree, _new(tree, "Math", operation="MULTIPLY_ADD"), {0: _parts(tree, co)[0], 1: 9e3, 2: 900.0}
                ).outputs[0]
            elif value == "nm":
                value = _feed(
                    tree, _new(tree, "Math", operation="MULTIPLY_ADD"), {0: _parts(tree, co)[0], 1: 420.0, 2: 370.0}
                ).outputs[0]
            values[name] = value
        return _feed(tree, _new(tree, kind, **settings), values).outputs[output]

    return build


def cases() -> dict:
    found = {f"math {m}": _math(m) for m in MATH}
    found |= {f"vector math {m}": _vector_math(m) for m in VECTOR_MATH}
    found |= {f"blend {m}": _blend(m) for m in BLENDS}
    for kind in ("FBM", "MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "HETERO_TERRAIN"):
        found[f"noise 3D {kind}"] = _noise(3, kind, 0)
    for dims in (1, 2, 3, 4):
        found[f"noise {dims}D color"] = _noise(dims, "FBM", 1, Distortion=0.4)
        found[f"voronoi {dims}D F1 color"] = _voronoi(dims, "F1", output="Color")
        found[f"voronoi {dims}D F2"] = _voronoi(dims, "F2", Detail=1.5, Roughness=0.6)
        found[f"voronoi {dims}D smooth"] = _voronoi(dims, "SMOOTH_F1", Smoothness=0.7)
        found[f"voronoi {dims}D edge"] = _voronoi(dims, "DISTANCE_TO_EDGE")
        found[f"voronoi {dims}D radius"] = _voronoi(dims, "N_SPHERE_RADIUS", output="Radius")
    found["voronoi edge fractal"] = _voronoi(3, "DISTANCE_TO_EDGE", Detail=1.5, Roughness=0.4, normalize=True)
    found["voronoi smooth color"] = _voronoi(2, "SMOOTH_F1", output="Color", Smoothness=0.9)
    found["voronoi position"] = _voronoi(3, "F1", output="Position")
    for metric in ("MANHATTAN", "CHEBYCHEV", "MINKOWSKI"):
        found[f"voronoi {metric}"] = _voronoi(3, "F1", metric, Exponent=1.4, normalize=True)
    for dims in ("1D", "2D", "3D", "4D"):
        for output in (0, 1):
            inputs = {"W": 0.375} if dims in ("1D", "4D") else {}
            build = _texture("TexWhiteNoise", {"noise_dimensions": dims}, inputs, output, cells=True)
            found[f"white noise {dims} {output}"] = build
    for depth in (0, 2, 5, 10):
        found[f"magic {depth}"] = _texture("TexMagic", {"turbulence_depth": depth}, {"Scale": 1.3, "Distortion": 1.4})
    for kind, ring in (("BANDS", "X"), ("BANDS", "DIAGONAL"), ("RINGS", "Z"), ("RINGS", "SPHERICAL")):
        for profile in ("SIN", "SAW", "TRI"):
            settings = {"wave_type": kind, "wave_profile": profile}
            settings["bands_direction" if kind == "BANDS" else "rings_direction"] = ring
            inputs = {"Scale": 0.4, "Distortion": 1.5, "Detail": 1.5, "Detail Scale": 0.8, "Phase Offset": 0.3}
            found[f"wave {kind} {ring} {profile}"] = _texture("TexWave", settings, inputs)
    found["checker"] = _texture("TexChecker", None, {"Scale": 1.3})
    for kind in ("LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL"):
        found[f"gradient {kind}"] = _texture("TexGradient", {"gradient_type": kind})
    found["brick"] = _texture("TexBrick", {"squash": 0.7, "squash_frequency": 3}, {"Scale": 1.9, "Mortar Size": 0.06})
    found["brick factor"] = _texture("TexBrick", None, {"Scale": 3.0, "Mortar Smooth": 0.4, "Mortar Size": 0.1}, 1)
    for kind in ("LINEAR", "CONSTANT", "EASE", "B_SPLINE", "CARDINAL"):
        found[f"ramp {kind}"] = _ramp(kind)
    found["ramp HSV"] = _ramp("LINEAR", "HSV")
    for kind in ("RGBCurve", "VectorCurve", "FloatCurve"):
        for extend in ("HORIZONTAL", "EXTRAPOLATED"):
            found[f"{kind} {extend}"] = _curve(kind, extend)
    for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
        found[f"mapping {kind}"] = _mapping(kind, False)
        found[f"mapping {kind} varying"] = _mapping(kind, True)
    for kind in ("AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"):
        for invert in (False, True):
            found[f"rotate {kind} {invert}"] = _rotate(kind, invert)
    for kind in ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"):
        for data in ("FLOAT", "FLOAT_VECTOR"):
            found[f"map range {kind} {data}"] = _map_range(kind, data)
    for mode in ("HSV", "HSL"):
        found[f"combine {mode}"] = _simple("CombineColor", {0: "u", 1: 0.6, 2: 0.7}, mode=mode)
        found[f"separate {mode}"] = _simple("SeparateColor", {0: "color"}, 0, mode=mode)
        found[f"separate {mode} 1"] = _simple("SeparateColor", {0: "color"}, 1, mode=mode)
    found["hue saturation"] = _simple("HueSaturation", {"Color": "color", "Hue": 0.7, "Saturation": 1.4, "Value": 0.8})
    found["gamma"] = _simple("Gamma", {"Color": "co", "Gamma": 2.3})
    found["contrast"] = _simple("BrightContrast", {"Color": "co", 1: 0.2, 2: 0.7})
    found["invert"] = _simple("Invert", {"Color": "co", 0: 0.7})
    found["bw"] = _simple("RGBToBW", {0: "color"})
    found["clamp"] = _simple("Clamp", {"Value": "x", "Min": -0.5, "Max": 0.3}, clamp_type="MINMAX")
    found["clamp range"] = _simple("Clamp", {"Value": "x", "Min": 0.5, "Max": -0.3}, clamp_type="RANGE")
    found["blackbody"] = _simple("Blackbody", {0: "kelvin"})
    found["wavelength"] = _simple("Wavelength", {0: "nm"})
    return found
