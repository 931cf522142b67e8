# SPDX-License-Identifier: Apache-2.0
"""Expressions and closures → the words and constants of a material program (shaders/shared/material_program.h).

Each section's values are put in order by a depth-first walk that visits the operand with the greater need of registers
first (Sethi and Ullman 1970, applied to a graph), then given registers, each freed after its last use.
"""

from dataclasses import dataclass, field

import numpy as np

from headwater.materials import opcodes as op
from headwater.materials.expression import Expr, Graph, Table


class ProgramError(Exception):
    """The program exceeds a limit of the format (registers, rows, constants)."""


@dataclass(eq=False)
class Closure:
    """A closure row: operands a .. f, then rows of six further arguments. Unused operands are None."""

    code: int
    operands: tuple
    sub: int = 0
    arguments: tuple = ()


@dataclass(frozen=True)
class Unsupported:
    """Something in a material that is left out or replaced by something else."""

    node_type: str
    node_name: str
    material: str
    reason: str

    def __str__(self) -> str:
        node = f"{self.node_type} '{self.node_name}'" if self.node_name else self.node_type
        return f"Material '{self.material}': {node}: {self.reason}"


@dataclass
class CompiledMaterial:
    """What core.Scene.upsert_material takes, and what the material needs beside it."""

    program: np.ndarray  # (4 R,) uint32; empty: a black surface, or a constant background
    constants: np.ndarray  # (K, 4) float32
    images: list = field(default_factory=list)  # in the order of the program's image indices; the caller's own objects
    attributes: frozenset = frozenset()  # names of mesh attributes the program reads
    flags: int = 0  # op.MATERIAL_*
    emission: tuple = (0.0, 0.0, 0.0)  # radiance, where it is constant; of a world its constant background
    unsupported: list = field(default_factory=list)

    @property
    def notes(self) -> list[str]:
        """`unsupported` as text."""
        return [str(u) for u in self.unsupported]


_FIRST = op.REGISTER_FIRST_FREE


class _Section:
    """Orders and writes the rows of one section."""

    def __init__(self, constants: "_Constants"):
        self._constants = constants
        self._register: dict[int, int] = {}
        self._second: dict[int, int] = {}  # register of an image's alpha, by the image
        self.rows: list[tuple[int, int, int, int]] = []

    def write(self, closures: list[Closure]) -> None:
        roots = [e for c in closures for e in (*c.operands, *(a for row in c.arguments for a in row)) if e is not None]
        order = _order(roots)
        last_use: dict[int, int] = {}
        for position, e in enumerate(order):
            for a in e.args:
                last_use[id(_row_of(a))] = position
        end = len(order)
        for root in roots:
            last_use[id(_row_of(root))] = end
        alpha_of = {id(e.args[0]): e for e in order if e.alpha_of is not None}
        free = list(range(op.VM_REGISTERS - 1, _FIRST - 1, -1))
        ends: dict[int, list[Expr]] = {}
        for e in order:
            if e.alpha_of is None:
                ends.setdefault(last_use.get(id(e), 0), []).append(e)
        for position, e in enumerate(order):
            if e.alpha_of is not None:
                continue
            need = 2 if id(e) in alpha_of else 1
            # Operands that end here can be overwritten: a row reads before it writes. Not with two results: the second
            # is written before the first.
            if need == 1:
                self._free(ends.get(position, ()), free)
            if len(free) < need:
                raise ProgramError(f"more than {op.VM_REGISTERS - _FIRST} values are needed at once")
            self._register[id(e)] = free.pop()
            if need == 2:
                self._register[id(alpha_of[id(e)])] = self._second[id(e)] = free.pop()
            self._value(e, alpha_of.get(id(e)))
            if need == 2:
                self._free(ends.get(position, ()), free)
        for closure in closures:
            self._closure(closure)
        self.rows.append((op.OP_END, 0, 0, 0))

    def _free(self, ended, free: list[int]) -> None:
        for e in ended:
            if id(e) in self._register:
                free.append(self._register[id(e)])
                if id(e) in self._second:
                    free.append(self._second[id(e)])

    def _operand(self, e: Expr | None) -> int:
        if e is None:
            return op.OPERAND_CONSTANT | self._constants.vector((0.0, 0.0, 0.0))
        if e.value is not None:
            return op.OPERAND_CONSTANT | self._constants.vector(e.value)
        return e.register if e.register is not None else self._register[id(e)]

    def _value(self, e: Expr, alpha: Expr | None) -> None:
        a, b, c, d = (*(self._operand(x) for x in e.args), 0, 0, 0, 0)[:4]
        imm = self._constants.table(e.imm) if isinstance(e.imm, Table) else e.imm
        if alpha is not None:
            d = self._register[id(alpha)]
        # Only where alpha is used is colour divided by it, as in Cycles.
        sub = e.sub | (op.IMAGE_UNPREMULTIPLY if e.wants_alpha else 0)
        self.rows.append((e.code | self._register[id(e)] << 8 | sub << 16, a | b << 16, c | d << 16, imm))

    def _closure(self, closure: Closure) -> None:
        self._closure_row(closure.code, closure.sub, closure.operands)
        for arguments in closure.arguments:
            self._closure_row(op.OP_ARGUMENTS, 0, arguments)

    def _closure_row(self, code: int, sub: int, operands) -> None:
        a, b, c, d, e, f = (self._operand(x) for x in (*operands, *[None] * (6 - len(operands))))
        self.rows.append((code | sub << 16, a | b << 16, c | d << 16, e | f << 16))


def _row_of(e: Expr) -> Expr:
    """The row that makes a value: an image's second result lives as long as its row."""
    return e.alpha_of if e.alpha_of is not None else e


def _order(roots: list[Expr]) -> list[Expr]:
    """Every varying expression the roots need, operands first. No recursion: trees may be deep."""
    need: dict[int, int] = {}
    stack = [(r, False) for r in roots]
    while stack:
        e, done = stack.pop()
        if id(e) in need:
            continue
        if done:
            needs = sorted((need[id(a)] for a in e.args), reverse=True)
            need[id(e)] = max([1, *(n + i for i, n in enumerate(needs))])
        elif not e.args:
            need[id(e)] = 0 if e.constant or e.register is not None else 1
        else:
            stack.append((e, True))
            stack.extend((a, False) for a in e.args if id(a) not in need)
    order: list[Expr] = []
    placed: set[int] = set()
    stack = [(r, False) for r in reversed(roots)]
    while stack:
        e, done = stack.pop()
        if id(e) in placed or e.constant or e.register is not None:
            continue
        if done:
            placed.add(id(e))
            order.append(e)
        else:
            stack.append((e, True))
            stack.extend((a, False) for a in sorted(e.args, key=lambda a: need[id(a)]) if id(a) not in placed)
    return order


class _Constants:
    def __init__(self):
        self._rows: list = []
        self._vectors: dict[tuple, int] = {}
        self._tables: dict[int, int] = {}
        self._count = 0

    def vector(self, value: tuple) -> int:
        index = self._vectors.get(value)
        if index is None:
            index = self._vectors[value] = self._append(np.array([[*value, 0.0]], np.float32))
        return index

    def table(self, table: Table) -> int:
        index = self._tables.get(id(table))
        if index is None:
            index = self._tables[id(table)] = self._append(table.rows)
        return index

    def _append(self, rows) -> int:
        first = self._count
        self._rows.append(rows)
        self._count += len(rows)
        if self._count > op.VM_MAX_CONSTANTS:
            raise ProgramError(f"more than {op.VM_MAX_CONSTANTS} constants")
        return first

    def array(self) -> np.ndarray:
        return np.concatenate(self._rows) if self._rows else np.zeros((0, 4), np.float32)


def assemble(surface: list[Closure], emission: list[Closure], transparency: list[Closure]):
    """Words (uint32) and constants ((K, 4) float32) of a program; a section without closures is absent.

    Raises ProgramError when a limit of the format is exceeded.
    """
    constants = _Constants()
    rows: list[tuple[int, int, int, int]] = [(0, 0, 0, 0)]
    starts = []
    for closures in (surface, emission, transparency):
        if len(closures) > op.VM_MAX_CLOSURE_ROWS:
            raise ProgramError(f"more than {op.VM_MAX_CLOSURE_ROWS} closures")
        starts.append(len(rows) if closures else 0)
        if closures:
            section = _Section(constants)
            section.write(closures)
            rows += section.rows
    if len(rows) > op.VM_MAX_ROWS:
        raise ProgramError(f"more than {op.VM_MAX_ROWS} rows")
    if not any(starts):
        return np.zeros(0, np.uint32), np.zeros((0, 4), np.float32)
    rows[0] = (op.PROGRAM_MAGIC, *starts)
    return np.array(rows, np.uint32).reshape(-1), constants.array()


class Surface:
    """The closures of one material while they are collected. Weights are expressions of the graph."""

    def __init__(self, graph: Graph):
        self.graph = graph
        self._closures: list[Closure] = []
        self._layered: list[Closure] = []  # Principled with emission under coat or sheen
        self.emission = graph.zero
        self.transparency = graph.zero
        self.holdout = graph.zero

    def add(self, closure: Closure, emits_layered: bool = False) -> None:
        self._closures.append(closure)
        if emits_layered:
            self._layered.append(closure)

    def emit(self, radiance: Expr) -> None:
        self.emission = self.graph.add(self.emission, radiance)

    def let_through(self, weight: Expr, separate: bool = True) -> None:
        """Transparency. `separate`: not already part of a closure row (Principled's alpha is)."""
        self.transparency = self.graph.add(self.transparency, weight)
        if separate:
            self._closures.append(Closure(op.OP_TRANSPARENT, (weight,)))

    def hold_out(self, weight: Expr) -> None:
        self.holdout = self.graph.add(self.holdout, weight)

    def finish(self, images, attributes, unsupported, *, transparent_shadows=True, flags=0) -> CompiledMaterial:
        """Assembles the three sections. Raises ProgramError."""
        zero = (0.0, 0.0, 0.0)
        emission = [] if self.emission.value == zero else [Closure(op.OP_EMISSION, (self.emission,))]
        holdout = [] if self.holdout.value == zero else [Closure(op.OP_HOLDOUT, (self.holdout,))]
        varying = [] if self.emission.constant and not self._layered else emission + self._layered
        through = []
        if self.transparency.value != zero and transparent_shadows:
            through = [Closure(op.OP_TRANSPARENT, (self.transparency,))]
            flags |= op.MATERIAL_TRANSPARENT
        if emission or self._layered:
            flags |= op.MATERIAL_EMISSIVE
        if varying:
            flags |= op.MATERIAL_EMISSION_SHADER
        words, constants = assemble(self._closures + emission + holdout, varying, through)
        constant = self.emission.value if self.emission.constant and not self._layered else zero
        return CompiledMaterial(
            words, constants, list(images), frozenset(attributes), flags, constant, list(unsupported)
        )


def compile_background(graph: Graph, radiance: Expr, images, unsupported) -> CompiledMaterial:
    """A world: a constant background has an empty program and its radiance in `emission`."""
    if radiance.constant:
        program, constants = np.zeros(0, np.uint32), np.zeros((0, 4), np.float32)
        return CompiledMaterial(program, constants, [], frozenset(), 0, radiance.value, list(unsupported))
    words, constants = assemble([], [Closure(op.OP_EMISSION, (radiance,))], [])
    return CompiledMaterial(
        words,
        constants,
        list(images),
        frozenset(),
        op.MATERIAL_EMISSIVE | op.MATERIAL_EMISSION_SHADER,
        (0.0,) * 3,
        list(unsupported),
    )
