# SPDX-License-Identifier: Apache-2.0
"""The Python mirror of the program format agrees with the header, and the assembler keeps the format's rules."""

import re
from pathlib import Path

import numpy as np
import pytest

from headwater.materials import Graph, ProgramError, Surface, arithmetic, attribute_hash, closures, folding
from headwater.materials import opcodes as op
from headwater.materials.assembler import Closure

ROOT = Path(__file__).resolve().parents[1]


def header_constants() -> dict:
    text = (ROOT / "shaders/shared/material_program.h").read_text()
    tables = (ROOT / "shaders/shared/tables.h").read_text()
    found = {m[1]: int(m[2]) for m in re.finditer(r"X\(HW_(OP_\w+), (\d+)u,", text)}
    found |= {m[1]: int(m[2], 0) for m in re.finditer(r"HW_CONST uint HW_(\w+) = (0x[0-9A-Fa-f]+|\d+)u;", text)}
    found |= {m[1]: int(m[2]) for m in re.finditer(r"HW_CONST uint HW_(MATERIAL_(?!BYTES)\w+) = (\d+)u;", tables)}
    return found


def test_constants_are_those_of_the_header():
    header = header_constants()
    assert len(header) > 150
    mirror = {name: value for name, value in vars(op).items() if name.isupper() and isinstance(value, int)}
    assert mirror == header


def test_operand_masks_are_those_of_the_header():
    text = (ROOT / "shaders/shared/material_program.h").read_text()
    masks = {int(m[1]): int(m[2]) for m in re.finditer(r"X\(HW_OP_\w+, (\d+)u, (\d+)u,", text)}
    assert masks == op.READS


def test_opcodes_are_those_of_the_core(core):
    assert {k[3:]: v for k, v in core.material_ops.items()} == {
        k: v for k, v in vars(op).items() if k.startswith("OP_")
    }


def rows_of(compiled):
    return compiled.program.reshape(-1, 4)


def emitting(build):
    graph = Graph()
    surface = Surface(graph)
    surface.emit(build(graph))
    return surface.finish([], [], [])


def test_constants_fold_to_a_constant_emission():
    g = Graph()
    e = arithmetic.math_node(g, "WRAP", g.add(g.const(3.0), g.const(2.3)), g.const(2.0), g.const(-1.0))
    assert e.scalar == pytest.approx(-0.7, abs=1e-6)
    compiled = emitting(lambda graph: graph.const(1.0, 2.0, 3.0))
    assert compiled.emission == (1.0, 2.0, 3.0)
    assert compiled.flags == op.MATERIAL_EMISSIVE


def test_shared_values_are_computed_once():
    def build(g):
        noise = g.fract(g.scale(g.uv, 7.0))
        return g.add(g.mul(noise, noise), noise)

    words = rows_of(emitting(build))
    floors = [row for row in words if row[0] & 255 == op.OP_FLOOR]
    assert len(floors) == 2  # once in the surface section, once in the emission section


def test_two_scalings_become_one_row():
    g = Graph()
    e = g.fma(g.fma(g.uv, g.const(2.0), g.const(1.0)), g.const(3.0), g.const(-1.0))
    assert e.args[0] is g.uv
    assert e.args[1].scalar == 6.0 and e.args[2].scalar == 2.0


def test_a_chain_of_100000_operations_needs_no_recursion():
    g = Graph()
    e = g.uv
    for i in range(100000):
        e = g.max(e, g.const(i * 1e-9))
    surface = Surface(g)
    surface.emit(e)
    with pytest.raises(ProgramError, match="rows|constants"):
        surface.finish([], [], [])


def test_too_many_live_values_are_refused():
    g = Graph()
    values = [g.make(op.OP_MATH, g.component(g.uv, 0), g.const(i), sub=op.MATH_POW) for i in range(200)]
    total = values[0]
    for a, b in zip(values, reversed(values), strict=True):
        total = g.combine(total, a, b)
    surface = Surface(g)
    for v in values:
        surface.add(Closure(op.OP_TRANSPARENT, (v,)))
    with pytest.raises(ProgramError):
        surface.finish([], [], [])


def test_alpha_of_an_image_has_its_own_register():
    from headwater.materials import textures

    def build(g):
        texel = textures.image(g, 0, g.uv, "Linear", "REPEAT")
        return g.mul(texel, g.alpha(texel))

    words = rows_of(emitting(build))
    image = next(row for row in words if row[0] & 255 == op.OP_IMAGE)
    color, alpha = image[0] >> 8 & 255, image[2] >> 16
    assert alpha >= op.REGISTER_FIRST_FREE and color != alpha


def test_principled_sections():
    g = Graph()
    p = closures.Principled.defaults(g)
    p.alpha = g.component(g.uv, 0)
    p.emission_strength = g.const(2.0)
    surface = Surface(g)
    closures.add_principled(surface, g.one, p)
    compiled = surface.finish([], [], [])
    header = rows_of(compiled)[0]
    assert header[op.SECTION_SURFACE] and header[op.SECTION_EMISSION] and header[op.SECTION_TRANSPARENCY]
    assert compiled.flags & op.MATERIAL_TRANSPARENT and compiled.flags & op.MATERIAL_EMISSION_SHADER


def test_not_finite_constants_are_bounded():
    g = Graph()
    assert g.const(float("nan")).scalar == 0.0
    assert np.isfinite(g.const(float("inf")).scalar)
    assert g.function(op.MATH_EXP, g.const(1000.0)).scalar == pytest.approx(3.402823e38, rel=1e-6)
    assert folding.power(-2.0, 0.5) == 0.0 and folding.power(-2.0, 3.0) == -8.0


def test_attribute_hash_is_fnv_1a():
    assert attribute_hash("") == 0x811C9DC5
    assert attribute_hash("a") == 0xE40C292C
