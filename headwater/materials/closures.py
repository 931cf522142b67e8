# SPDX-License-Identifier: Apache-2.0
"""Closure rows of the shader nodes: packs their inputs as shared/material_program.h lays them out."""

from dataclasses import dataclass

from headwater.materials import opcodes as op
from headwater.materials.assembler import Closure, Surface
from headwater.materials.expression import Expr, Graph

DISTRIBUTIONS = {
    "GGX": op.DISTRIBUTION_GGX,
    "MULTI_GGX": op.DISTRIBUTION_MULTI_GGX,
    "BECKMANN": op.DISTRIBUTION_BECKMANN,
    "ASHIKHMIN_SHIRLEY": op.DISTRIBUTION_ASHIKHMIN_SHIRLEY,
}


def is_zero(e: Expr) -> bool:
    return e.value == (0.0, 0.0, 0.0)


@dataclass
class Principled:
    """Inputs of a Principled BSDF, Blender 5.0's sockets. Scalars are expressions with the value in all components."""

    base_color: Expr
    metallic: Expr
    roughness: Expr
    ior: Expr
    alpha: Expr
    normal: Expr
    diffuse_roughness: Expr
    subsurface_weight: Expr
    specular_level: Expr
    specular_tint: Expr
    anisotropic: Expr
    anisotropic_rotation: Expr
    tangent: Expr
    transmission: Expr
    coat_weight: Expr
    coat_roughness: Expr
    coat_ior: Expr
    coat_tint: Expr
    coat_normal: Expr
    sheen_weight: Expr
    sheen_roughness: Expr
    sheen_tint: Expr
    emission_color: Expr
    emission_strength: Expr
    film_thickness: Expr
    film_ior: Expr
    multiscatter: bool = True

    @classmethod
    def defaults(cls, g: Graph) -> "Principled":
        """Blender's defaults."""
        c = g.const
        return cls(
            base_color=c(0.8),
            metallic=g.zero,
            roughness=c(0.5),
            ior=c(1.5),
            alpha=g.one,
            normal=g.normal,
            diffuse_roughness=g.zero,
            subsurface_weight=g.zero,
            specular_level=c(0.5),
            specular_tint=g.one,
            anisotropic=g.zero,
            anisotropic_rotation=g.zero,
            tangent=g.zero,
            transmission=g.zero,
            coat_weight=g.zero,
            coat_roughness=c(0.03),
            coat_ior=c(1.5),
            coat_tint=g.one,
            coat_normal=g.normal,
            sheen_weight=g.zero,
            sheen_roughness=c(0.5),
            sheen_tint=g.one,
            emission_color=g.one,
            emission_strength=g.zero,
            film_thickness=g.zero,
            film_ior=c(1.33),
        )


def add_principled(surface: Surface, weight: Expr, p: Principled) -> None:
    """Adds a Principled BSDF and what it emits and lets through."""
    g = surface.graph
    radiance = g.mul(p.emission_color, p.emission_strength)
    layered = not (is_zero(p.coat_weight) and is_zero(p.sheen_weight)) and not is_zero(radiance)
    alpha = g.clamp(p.alpha)
    if not is_zero(radiance) and not layered:
        surface.emit(g.mul(radiance, g.mul(weight, alpha)))
        p_emission = g.zero
    else:
        p_emission = p.emission_strength
    if alpha.value != (1.0, 1.0, 1.0):
        surface.let_through(g.mul(weight, g.one_minus(alpha)), separate=False)
    closure = Closure(
        op.OP_PRINCIPLED,
        (
            p.base_color,
            g.combine(p.metallic, p.roughness, p.ior),
            p.normal,
            g.combine(p.alpha, p.diffuse_roughness, p.subsurface_weight),
            weight,
            g.combine(p.specular_level, p.anisotropic, p.anisotropic_rotation),
        ),
        sub=1 if p.multiscatter else 0,
        arguments=(
            (
                p.specular_tint,
                p.tangent,
                g.combine(p.transmission, p.film_thickness, p.film_ior),
                g.combine(p.coat_weight, p.coat_roughness, p.coat_ior),
                p.coat_tint,
                p.coat_normal,
            ),
            (g.combine(p.sheen_weight, p.sheen_roughness, p_emission), p.sheen_tint, p.emission_color),
        ),
    )
    surface.add(closure, emits_layered=layered)


def add_diffuse(surface: Surface, weight: Expr, color: Expr, roughness: Expr, normal: Expr) -> None:
    surface.add(Closure(op.OP_DIFFUSE, (color, roughness, normal, None, weight)))


def add_translucent(surface: Surface, weight: Expr, color: Expr, normal: Expr) -> None:
    surface.add(Closure(op.OP_TRANSLUCENT, (color, None, normal, None, weight)))


def add_sheen(surface: Surface, weight: Expr, color: Expr, roughness: Expr, normal: Expr) -> None:
    surface.add(Closure(op.OP_SHEEN, (color, roughness, normal, None, weight)))


def add_toon(surface: Surface, weight: Expr, color: Expr, size: Expr, smooth: Expr, normal: Expr, glossy: bool) -> None:
    b = surface.graph.combine(size, smooth, surface.graph.zero)
    surface.add(Closure(op.OP_TOON, (color, b, normal, None, weight), sub=1 if glossy else 0))


def add_glossy(
    surface: Surface, weight, color, roughness, anisotropy, rotation, normal, tangent, distribution: int
) -> None:
    b = surface.graph.combine(roughness, anisotropy, rotation)
    surface.add(Closure(op.OP_GLOSSY, (color, b, normal, tangent, weight), sub=distribution))


def add_glass(surface: Surface, weight, color, roughness, ior, normal, distribution: int) -> None:
    b = surface.graph.combine(roughness, ior, surface.graph.zero)
    surface.add(Closure(op.OP_GLASS, (color, b, normal, None, weight), sub=distribution))


def add_refraction(surface: Surface, weight, color, roughness, ior, normal) -> None:
    b = surface.graph.combine(roughness, ior, surface.graph.zero)
    surface.add(Closure(op.OP_REFRACTION, (color, b, normal, None, weight)))


def add_metallic(
    surface: Surface,
    weight,
    base,
    edge,
    roughness,
    anisotropy,
    rotation,
    normal,
    tangent,
    distribution: int,
    conductor: bool,
) -> None:
    """base and edge: base colour and edge tint, or with `conductor` n and k."""
    b = surface.graph.combine(roughness, anisotropy, rotation)
    sub = distribution | (op.METALLIC_CONDUCTOR if conductor else 0)
    surface.add(Closure(op.OP_METALLIC, (base, b, normal, tangent, weight, edge), sub=sub))
