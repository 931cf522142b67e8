# SPDX-License-Identifier: Apache-2.0
"""UsdPreviewSurface → material programs, by the UsdPreviewSurface specification 2.6 (UsdPreviewSurface, UsdUVTexture,
UsdTransform2d, UsdPrimvarReader).

The surface is a Principled BSDF: the specular workflow sets its reflectance at normal incidence, opacity is its alpha.
Occlusion is not used and displacement is left out.
"""

import math

from headwater.materials import closures, textures
from headwater.materials import opcodes as op
from headwater.materials.assembler import CompiledMaterial, Surface, Unsupported
from headwater.materials.expression import Expr, Graph, attribute_hash

MAX_DEPTH = 32  # shaders in a chain; a longer one is taken as a loop
_WRAP = {"black": "CLIP", "clamp": "EXTEND", "repeat": "REPEAT", "mirror": "MIRROR", "useMetadata": "REPEAT"}


def compile_preview_surface(material, time=None) -> CompiledMaterial:
    """Compiles a UsdShade.Material. `images` of the result are (resolved path, source colour space) pairs.

    Raises ValueError if its surface is not a UsdPreviewSurface.
    """
    shader = material.ComputeSurfaceSource()[0]
    if not shader:
        raise ValueError("it has no surface shader")
    kind = shader.GetShaderId()
    if kind != "UsdPreviewSurface":
        raise ValueError(f"its surface shader is '{kind}', not a UsdPreviewSurface")
    return _Compiler(str(material.GetPath()), time).surface(shader)


class _Compiler:
    def __init__(self, name: str, time):
        from pxr import Usd

        self._name, self._time = name, Usd.TimeCode.EarliestTime() if time is None else time
        self._graph = Graph()
        self._images: list[tuple[str, str]] = []
        self._attributes: set[str] = set()
        self._unsupported: list[Unsupported] = []

    def surface(self, shader) -> CompiledMaterial:
        g = self._graph
        surface = Surface(g)
        p = closures.Principled.defaults(g)
        p.base_color = self._input(shader, "diffuseColor", (0.18,) * 3)
        p.roughness = self._input(shader, "roughness", 0.5)
        p.ior = self._input(shader, "ior", 1.5)
        p.coat_weight = self._input(shader, "clearcoat", 0.0)
        p.coat_roughness = self._input(shader, "clearcoatRoughness", 0.01)
        if int(self._plain(shader, "useSpecularWorkflow", 0)):
            self._specular_workflow(p, self._input(shader, "specularColor", (0.0,) * 3))
        else:
            p.metallic = self._input(shader, "metallic", 0.0)
        p.alpha = self._opacity(shader)
        p.normal = p.coat_normal = self._normal(shader)
        p.multiscatter = False
        p.emission_color = self._input(shader, "emissiveColor", (0.0,) * 3)
        p.emission_strength = g.one
        displacement = self._input(shader, "displacement", 0.0)
        if displacement.value != (0.0, 0.0, 0.0):
            self._list(shader, "displacement is not supported")
        closures.add_principled(surface, g.one, p)
        return surface.finish(self._images, self._attributes, self._unsupported, flags=op.MATERIAL_BUMP_CORRECTION)

    def _specular_workflow(self, p, specular: Expr) -> None:
        """Reflectance at normal incidence `specular`: the tint of a dielectric whose own is 4 % (index 1.5)."""
        p.ior = self._graph.const(1.5)
        p.specular_tint = self._graph.scale(specular, 1.0 / 0.04)

    def _opacity(self, shader) -> Expr:
        g = self._graph
        opacity = self._input(shader, "opacity", 1.0)
        threshold = float(self._plain(shader, "opacityThreshold", 0.0))
        if threshold > 0.0:
            return g.one_minus(g.less(opacity, g.const(threshold)))
        return opacity

    def _normal(self, shader) -> Expr:
        g = self._graph
        normal = self._input(shader, "normal", (0.0, 0.0, 1.0))
        if normal.constant:
            return g.normal
        color = g.fma(normal, g.const(0.5), g.const(0.5))
        tangents = f"{self._map_of(shader)}.tangent"
        self._attributes.add(tangents)
        imm = attribute_hash(tangents)
        return g.make_varying(op.OP_NORMAL_MAP, color, g.one, g.normal, sub=op.NORMAL_MAP_TANGENT, imm=imm)

    def _map_of(self, shader) -> str:
        """Name of the primvar by which the normal's texture is placed; "" for the mesh's default UV map."""
        from pxr import UsdShade

        names = ["normal", "st"] + ["in"] * (MAX_DEPTH - 2)  # of a transform, or of one behind another
        for name in names:
            source = shader.GetInput(name)
            made = UsdShade.Utils.GetValueProducingAttributes(source) if source else ()
            if not made or not UsdShade.Output.IsOutput(made[0]):
                break
            shader = UsdShade.Shader(made[0].GetPrim())
        reads = (shader.GetShaderId() or "").startswith("UsdPrimvarReader_")
        return str(self._plain(shader, "varname", "")) if reads else ""

    def _list(self, shader, reason: str) -> None:
        found = Unsupported(str(shader.GetShaderId() or "Shader"), shader.GetPrim().GetName(), self._name, reason)
        if found not in self._unsupported:
            self._unsupported.append(found)

    def _plain(self, shader, name: str, default):
        """A value that no shader makes: constants and values of the material's interface."""
        from pxr import UsdShade

        source = shader.GetInput(name)
        if not source:
            return default
        for attribute in UsdShade.Utils.GetValueProducingAttributes(source):
            if not UsdShade.Output.IsOutput(attribute):
                value = attribute.Get(self._time)
                if value is not None:
                    return value
        return default

    def _constant(self, value) -> Expr:
        g = self._graph
        if isinstance(value, (bool, int, float)):
            return g.const(float(value))
        parts = [float(x) for x in value][:3]
        return g.const(*(parts + [0.0] * (3 - len(parts))))

    def _input(self, shader, name: str, default, depth: int = 0) -> Expr:
        """An input's value: what is connected, what is set, or the specification's default."""
        from pxr import UsdShade

        source = shader.GetInput(name)
        if source:
            for attribute in UsdShade.Utils.GetValueProducingAttributes(source):
                if UsdShade.Output.IsOutput(attribute):
                    if depth >= MAX_DEPTH:
                        self._list(shader, "its connections form a loop; a default value is used")
                        break
                    value = self._output(UsdShade.Shader(attribute.GetPrim()), UsdShade.Output(attribute), depth + 1)
                    if value is not None:
                        return value
                else:
                    plain = attribute.Get(self._time)
                    if plain is not None and not isinstance(plain, str):
                        return self._constant(plain)
        return self._constant(default)

    def _output(self, shader, output, depth: int) -> Expr | None:
        kind = shader.GetShaderId() or ""
        if kind == "UsdUVTexture":
            return self._texture(shader, output.GetBaseName(), depth)
        if kind == "UsdTransform2d":
            return self._transform(shader, depth)
        if kind.startswith("UsdPrimvarReader_"):
            return self._primvar(shader, kind)
        self._list(shader, "this shader is not supported; a default value is used")
        return None

    def _texture(self, shader, channel: str, depth: int) -> Expr:
        g = self._graph
        asset = self._plain(shader, "file", None)
        path = (getattr(asset, "resolvedPath", "") or getattr(asset, "path", "")) if asset is not None else ""
        space = str(self._plain(shader, "sourceColorSpace", "auto"))
        co = self._input(shader, "st", (0.0, 0.0), depth) if shader.GetInput("st") else g.uv
        wraps = [str(self._plain(shader, name, "useMetadata")) for name in ("wrapS", "wrapT")]
        if wraps[0] != wraps[1]:
            self._list(shader, f"wrapS and wrapT differ; '{wraps[0]}' is used for both")
        scale = [float(x) for x in self._plain(shader, "scale", (1.0,) * 4)]
        bias = [float(x) for x in self._plain(shader, "bias", (0.0,) * 4)]
        if not path:
            fallback = self._plain(shader, "fallback", (0.0, 0.0, 0.0, 1.0))
            self._list(shader, "it has no file; its fallback is used")
            return g.const(float(fallback[3])) if channel == "a" else self._channel(self._constant(fallback), channel)
        if (path, space) not in self._images:
            self._images.append((path, space))
        extension = _WRAP.get(wraps[0], "REPEAT")
        texel = textures.image(g, self._images.index((path, space)), co, "Linear", extension)
        if channel == "a":
            return g.fma(g.alpha(texel), g.const(scale[3]), g.const(bias[3]))
        return self._channel(g.fma(texel, g.const(*scale[:3]), g.const(*bias[:3])), channel)

    def _channel(self, value: Expr, channel: str) -> Expr:
        return self._graph.component(value, "rgb".index(channel)) if channel in ("r", "g", "b") else value

    def _transform(self, shader, depth: int) -> Expr:
        g = self._graph
        value = self._input(shader, "in", (0.0, 0.0), depth)
        angle = math.radians(float(self._plain(shader, "rotation", 0.0)))
        sx, sy = (float(x) for x in self._plain(shader, "scale", (1.0, 1.0)))
        tx, ty = (float(x) for x in self._plain(shader, "translation", (0.0, 0.0)))
        c, s = math.cos(angle), math.sin(angle)
        return g.matrix(value, [[c * sx, -s * sy, 0.0, tx], [s * sx, c * sy, 0.0, ty], [0.0, 0.0, 1.0, 0.0]])

    def _primvar(self, shader, kind: str) -> Expr | None:
        name = str(self._plain(shader, "varname", ""))
        if not name:
            self._list(shader, "it names no primvar; its fallback is used")
            return self._input(shader, "fallback", (0.0, 0.0, 0.0))
        self._attributes.add(name)
        g = self._graph
        value = g.attribute(name, op.ATTRIBUTE_VALUE)
        if "fallback" in [i.GetBaseName() for i in shader.GetInputs()]:
            exists = g.attribute(name, op.ATTRIBUTE_EXISTS)
            return g.select(exists, self._constant(self._plain(shader, "fallback", 0.0)), value)
        return value
