# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes → closures. Mix and Add Shader are not rows of a program: each closure's weight is the product of the
factors on its way to the output, summed over ways, so that a shader used twice is one closure."""

from headwater.materials import Surface, closures
from headwater.materials import opcodes as op
from headwater.materials.closures import DISTRIBUTIONS, Principled, is_zero

from .tree import Context, TreeCompiler, resolve

_MIX, _ADD = "ShaderNodeMixShader", "ShaderNodeAddShader"


class Shader:
    """A shader node with its inputs evaluated on demand."""

    def __init__(self, compiler: TreeCompiler, context: Context, node, weight):
        self.compiler, self.graph = compiler, compiler.graph
        self.context, self.node, self.weight = context, node, weight
        self._sockets: dict = {}  # by name and by identifier, the first of each: asking Blender takes long
        for socket in node.inputs:
            self._sockets.setdefault(socket.name, socket)
            self._sockets.setdefault(socket.identifier, socket)

    def __call__(self, name: str, default=None):
        socket = self._sockets.get(name)
        if socket is None:
            raise KeyError(f"it has no input '{name}'")
        return self.compiler.value(socket, self.context, default)

    def has(self, name: str) -> bool:
        return name in self._sockets

    def normal(self, name="Normal", default=None):
        return self(name, default if default is not None else self.compiler.normal)

    def tangent(self):
        return self("Tangent", lambda: self.graph.input(op.INPUT_RADIAL_Z))

    def unsupported(self, reason: str) -> None:
        self.compiler.unsupported(self.node, reason)

    def distribution(self) -> int:
        name = self.node.distribution
        if name not in ("GGX", "MULTI_GGX"):
            self.unsupported(f"distribution {name.replace('_', ' ').title()} is approximated by GGX")
            name = "GGX"
        return DISTRIBUTIONS[name]


def principled(s: Shader, surface: Surface) -> None:
    g = s.graph
    normal = s.normal()
    thickness = s("Thin Film Thickness") if s.has("Thin Film Thickness") else g.zero
    if not is_zero(thickness):
        s.unsupported("thin film is not supported")
    if s.has("Thin Wall") and not is_zero(s("Thin Wall")):
        s.unsupported("thin walls are not supported")
    subsurface = s("Subsurface Weight")
    if not is_zero(subsurface):
        s.unsupported("subsurface scattering is approximated by diffuse reflection")
    anisotropic = s("Anisotropic")
    closures.add_principled(
        surface,
        s.weight,
        Principled(
            base_color=s("Base Color"),
            metallic=s("Metallic"),
            roughness=s("Roughness"),
            ior=s("IOR"),
            alpha=s("Alpha"),
            normal=normal,
            diffuse_roughness=s("Diffuse Roughness"),
            subsurface_weight=subsurface,
            specular_level=s("Specular IOR Level"),
            specular_tint=s("Specular Tint"),
            anisotropic=anisotropic,
            anisotropic_rotation=s("Anisotropic Rotation"),
            tangent=g.zero if is_zero(anisotropic) else s.tangent(),
            transmission=s("Transmission Weight"),
            coat_weight=s("Coat Weight"),
            coat_roughness=s("Coat Roughness"),
            coat_ior=s("Coat IOR"),
            coat_tint=s("Coat Tint"),
            coat_normal=s.normal("Coat Normal"),
            sheen_weight=s("Sheen Weight"),
            sheen_roughness=s("Sheen Roughness"),
            sheen_tint=s("Sheen Tint"),
            emission_color=s("Emission Color"),
            emission_strength=s("Emission Strength"),
            film_thickness=thickness,
            film_ior=s("Thin Film IOR") if s.has("Thin Film IOR") else g.const(1.33),
            multiscatter=s.node.distribution == "MULTI_GGX",
        ),
    )


def diffuse(s: Shader, surface: Surface) -> None:
    closures.add_diffuse(surface, s.weight, s("Color"), s("Roughness"), s.normal())


def translucent(s: Shader, surface: Surface) -> None:
    closures.add_translucent(surface, s.weight, s("Color"), s.normal())


def glossy(s: Shader, surface: Surface) -> None:
    anisotropy = s("Anisotropy") if s.has("Anisotropy") else s.graph.zero
    rotation = s("Rotation") if s.has("Rotation") else s.graph.zero
    tangent = s.graph.zero if is_zero(anisotropy) else s.tangent()
    closures.add_glossy(
        surface, s.weight, s("Color"), s("Roughness"), anisotropy, rotation, s.normal(), tangent, s.distribution()
    )


def metallic(s: Shader, surface: Surface) -> None:
    conductor = s.node.fresnel_type == "PHYSICAL_CONDUCTOR"
    base, edge = ("IOR", "Extinction") if conductor else ("Base Color", "Edge Tint")
    if s.has("Thin Film Thickness") and not is_zero(s("Thin Film Thickness")):
        s.unsupported("thin film is not supported")
    anisotropy = s("Anisotropy")
    tangent = s.graph.zero if is_zero(anisotropy) else s.tangent()
    closures.add_metallic(
        surface,
        s.weight,
        s(base),
        s(edge),
        s("Roughness"),
        anisotropy,
        s("Rotation"),
        s.normal(),
        tangent,
        s.distribution(),
        conductor,
    )


def glass(s: Shader, surface: Surface) -> None:
    if s.has("Thin Film Thickness") and not is_zero(s("Thin Film Thickness")):
        s.unsupported("thin film is not supported")
    closures.add_glass(surface, s.weight, s("Color"), s("Roughness"), s("IOR"), s.normal(), s.distribution())


def refraction(s: Shader, surface: Surface) -> None:
    s.distribution()
    closures.add_refraction(surface, s.weight, s("Color"), s("Roughness"), s("IOR"), s.normal())


def sheen(s: Shader, surface: Surface) -> None:
    if s.node.distribution == "ASHIKHMIN":
        s.unsupported("Ashikhmin velvet is approximated by microfiber sheen")
    closures.add_sheen(surface, s.weight, s("Color"), s("Roughness"), s.normal())


def toon(s: Shader, surface: Surface) -> None:
    is_glossy = s.node.component == "GLOSSY"
    closures.add_toon(surface, s.weight, s("Color"), s("Size"), s("Smooth"), s.normal(), is_glossy)


def subsurface(s: Shader, surface: Surface) -> None:
    s.unsupported("subsurface scattering is approximated by diffuse reflection")
    closures.add_diffuse(surface, s.weight, s("Color"), s.graph.zero, s.normal())


def transparent(s: Shader, surface: Surface) -> None:
    surface.let_through(s.graph.mul(s("Color"), s.weight))


def emission(s: Shader, surface: Surface) -> None:
    surface.emit(s.graph.mul(s.graph.mul(s("Color"), s("Strength")), s.weight))


def holdout(s: Shader, surface: Surface) -> None:
    surface.hold_out(s.weight)


def hair(s: Shader, surface: Surface) -> None:
    s.unsupported("hair shaders are approximated by diffuse reflection")
    color = s("Color") if s.has("Color") else s.graph.const(0.5)
    closures.add_diffuse(surface, s.weight, color, s.graph.zero, s.compiler.normal)


def ray_portal(s: Shader, surface: Surface) -> None:
    s.unsupported("ray portals are not supported; light goes straight on")
    surface.let_through(s.graph.mul(s("Color"), s.weight))


HANDLERS = {
    "ShaderNodeBsdfPrincipled": principled,
    "ShaderNodeBsdfDiffuse": diffuse,
    "ShaderNodeBsdfTranslucent": translucent,
    "ShaderNodeBsdfAnisotropic": glossy,
    "ShaderNodeBsdfGlossy": glossy,
    "ShaderNodeBsdfMetallic": metallic,
    "ShaderNodeBsdfGlass": glass,
    "ShaderNodeBsdfRefraction": refraction,
    "ShaderNodeBsdfSheen": sheen,
    "ShaderNodeBsdfToon": toon,
    "ShaderNodeSubsurfaceScattering": subsurface,
    "ShaderNodeBsdfTransparent": transparent,
    "ShaderNodeEmission": emission,
    "ShaderNodeBackground": emission,
    "ShaderNodeHoldout": holdout,
    "ShaderNodeBsdfHair": hair,
    "ShaderNodeBsdfHairPrincipled": hair,
    "ShaderNodeBsdfRayPortal": ray_portal,
}


def _sources(node, context: Context) -> list:
    """The shaders a Mix or Add Shader node joins: (input's number, source)."""
    numbers = {_MIX: (1, 2), _ADD: (0, 1)}.get(node.bl_idname, ())
    return [(i, resolve(node.inputs[i], context)) for i in numbers]


def add_shaders(compiler: TreeCompiler, surface: Surface, socket) -> None:
    """Adds every closure that reaches a shader socket of the root tree."""
    g = compiler.graph
    start = resolve(socket, compiler.root)
    if start.node is None:
        return
    order: list = []  # a shader after those it joins
    state: dict[tuple, bool] = {}  # False: on the way down
    stack = [(start, False)]
    while stack:
        source, done = stack.pop()
        key = (source.context, source.node.as_pointer())
        if done:
            state[key] = True
            order.append((key, source))
        elif key not in state:
            state[key] = False
            stack.append((source, True))
            for _, inner in _sources(source.node, source.context):
                if inner.node is not None and state.get((inner.context, inner.node.as_pointer())) is None:
                    stack.append((inner, False))
    weights = {(start.context, start.node.as_pointer()): g.one}
    finished = set()
    for key, source in reversed(order):
        finished.add(key)
        weight, node = weights.get(key), source.node
        if weight is None or is_zero(weight):
            continue
        factor = None
        if node.bl_idname == _MIX:
            factor = g.clamp(compiler.value(node.inputs[0], source.context))
        for number, inner in _sources(node, source.context):
            if inner.node is None:
                continue
            inner_key = (inner.context, inner.node.as_pointer())
            if inner_key in finished:
                compiler.unsupported(node, "its shader links form a loop; one is ignored")
                continue
            share = weight
            if factor is not None:
                share = g.mul(weight, factor if number == 2 else g.one_minus(factor))
            weights[inner_key] = g.add(weights[inner_key], share) if inner_key in weights else share
        if node.bl_idname not in (_MIX, _ADD):
            _add_closure(compiler, surface, source.context, node, weight)


def _add_closure(compiler, surface, context, node, weight) -> None:
    handler = HANDLERS.get(node.bl_idname)
    if handler is None:
        if any(output.type == "SHADER" for output in node.outputs):
            compiler.unsupported(node, "this shader is not supported; it is black")
        else:  # a colour linked to a shader socket: Cycles takes it as emission
            color = next((o for o in node.outputs if o.enabled), None)
            compiler.unsupported(node, f"it is not a shader ({color.name if color else 'no output'}); it is black")
        return
    try:
        handler(Shader(compiler, context, node, weight), surface)
    except (KeyError, AttributeError, ValueError) as error:
        compiler.unsupported(node, f"a setting is not supported ({error}); the shader is left out")
