# SPDX-License-Identifier: Apache-2.0
"""Expressions of material programs: an interned graph of operations on three floats, folded where nothing varies.

An `Expr` stands for a vec3; a scalar is kept in all three components. Operations with the same operands are one object,
so shared parts of a node tree are computed once. Folding follows shaders/lib/math_ops.h and color_ops.h.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np

from headwater.materials import folding
from headwater.materials import opcodes as op


@dataclass(eq=False, slots=True)
class Expr:
    """One value. `code` is an opcode; None: a constant (`value`) or a register filled at the start (`register`)."""

    code: int | None
    args: tuple = ()
    sub: int = 0
    imm: object = 0  # int, or a Table
    value: tuple | None = None
    register: int | None = None
    alpha_of: Expr | None = None  # the second result of an image row
    wants_alpha: bool = False

    @property
    def constant(self) -> bool:
        return self.value is not None

    @property
    def scalar(self) -> float:
        """The first component of a constant."""
        return self.value[0]


@dataclass(eq=False)
class Table:
    """A run of constants that OP_TABLE or OP_MATRIX reads, (N, 4) float32."""

    rows: np.ndarray
    key: bytes = field(init=False)

    def __post_init__(self):
        self.rows = np.ascontiguousarray(self.rows, np.float32)
        self.key = self.rows.tobytes()


_VECTOR = struct.Struct("=3f")
_LARGEST = 3.402823e38


def _finite(x: float) -> float:
    """x, which a float32 can hold; what is no number becomes 0 (a constant must not poison a picture)."""
    if -_LARGEST <= x <= _LARGEST:
        return x
    return 0.0 if x != x else _LARGEST if x > 0 else -_LARGEST


class Graph:
    """Makes expressions. One graph a material."""

    def __init__(self):
        self._known: dict[tuple | bytes, Expr] = {}
        self._tables: dict[bytes, Table] = {}
        self.uv = self._register(op.REGISTER_UV)
        self.position = self._register(op.REGISTER_POSITION)
        self.normal = self._register(op.REGISTER_NORMAL)
        self.incoming = self._register(op.REGISTER_INCOMING)
        self.zero = self.const(0.0)
        self.one = self.const(1.0)

    def _register(self, number: int) -> Expr:
        return Expr(None, register=number)

    def const(self, x: float, y: float | None = None, z: float | None = None) -> Expr:
        """A constant; one number fills all components."""
        x = _finite(x)
        # As float32 holds them; the bits tell 0 from -0.
        bits = _VECTOR.pack(x, x, x) if y is None else _VECTOR.pack(x, _finite(y), _finite(z))
        found = self._known.get(bits)
        if found is None:
            found = self._known[bits] = Expr(None, value=_VECTOR.unpack(bits))
        return found

    def make(self, code: int, *args: Expr, sub: int = 0, imm=0) -> Expr:
        """A row's result; a constant when every operand is one and the operation can be folded."""
        if all(a.constant for a in args):
            folded = folding.fold(code, [a.value for a in args], sub, imm)
            if folded is not None:
                return self.const(*folded)
        key = (code, sub, imm.key if isinstance(imm, Table) else imm, *map(id, args))
        found = self._known.get(key)
        if found is None:
            if isinstance(imm, Table):
                imm = self._tables.setdefault(imm.key, imm)
            found = self._known[key] = Expr(code, args, sub, imm)
        return found

    def alpha(self, image: Expr) -> Expr:
        """Alpha of an OP_IMAGE row."""
        if image.constant:
            return self.one
        image.wants_alpha = True
        key = ("alpha", id(image))
        return self._known.setdefault(key, Expr(None, args=(image,), alpha_of=image))

    # Arithmetic, by component. Trivial operands vanish.

    def fma(self, a: Expr, b: Expr, c: Expr) -> Expr:
        if a.value == (1.0, 1.0, 1.0) and c.value == (0.0, 0.0, 0.0):
            return b
        if b.value == (1.0, 1.0, 1.0) and c.value == (0.0, 0.0, 0.0):
            return a
        if a.value == (0.0, 0.0, 0.0) or b.value == (0.0, 0.0, 0.0):
            return c
        if a.code == op.OP_FMA and b.constant and c.constant and a.args[1].constant and a.args[2].constant:
            # (x s + o) b + c in one row
            s, o = a.args[1].value, a.args[2].value
            scale = self.const(*(u * v for u, v in zip(s, b.value, strict=True)))
            offset = self.const(*(u * v + w for u, v, w in zip(o, b.value, c.value, strict=True)))
            return self.make(op.OP_FMA, a.args[0], scale, offset)
        return self.make(op.OP_FMA, a, b, c)

    def add(self, a: Expr, b: Expr) -> Expr:
        if a.value == (0.0, 0.0, 0.0):
            return b
        return a if b.value == (0.0, 0.0, 0.0) else self.fma(a, self.one, b)

    def sub(self, a: Expr, b: Expr) -> Expr:
        return a if b.value == (0.0, 0.0, 0.0) else self.fma(b, self.const(-1.0), a)

    def mul(self, a: Expr, b: Expr) -> Expr:
        return self.fma(a, b, self.zero)

    def scale(self, a: Expr, factor: float) -> Expr:
        return self.mul(a, self.const(factor))

    def negate(self, a: Expr) -> Expr:
        return self.scale(a, -1.0)

    def one_minus(self, a: Expr) -> Expr:
        return self.fma(a, self.const(-1.0), self.one)

    def mix(self, a: Expr, b: Expr, t: Expr) -> Expr:
        """a at t = 0, b at t = 1, not clamped."""
        if t.value == (0.0, 0.0, 0.0) or a is b:
            return a
        return b if t.value == (1.0, 1.0, 1.0) else self.make(op.OP_MIX, a, b, t)

    def div(self, a: Expr, b: Expr) -> Expr:
        """0 where b is 0."""
        return a if b.value == (1.0, 1.0, 1.0) else self.make(op.OP_DIV, a, b)

    def min(self, a: Expr, b: Expr) -> Expr:
        return self.make(op.OP_MIN, a, b)

    def max(self, a: Expr, b: Expr) -> Expr:
        return self.make(op.OP_MAX, a, b)

    def clamp(self, a: Expr, low: float = 0.0, high: float = 1.0) -> Expr:
        return self.min(self.max(a, self.const(low)), self.const(high))

    def less(self, a: Expr, b: Expr) -> Expr:
        """1 where a < b, else 0."""
        return self.make(op.OP_LESS, a, b)

    def select(self, condition: Expr, if_not: Expr, if_so: Expr) -> Expr:
        """if_so where the condition is not 0."""
        if condition.constant and len(set(condition.value)) == 1:
            return if_so if condition.scalar else if_not
        return if_so if if_so is if_not else self.make(op.OP_SELECT, if_not, if_so, condition)

    def floor(self, a: Expr) -> Expr:
        return self.make(op.OP_FLOOR, a)

    def abs(self, a: Expr) -> Expr:
        return self.max(a, self.negate(a))

    def fract(self, a: Expr) -> Expr:
        return self.sub(a, self.floor(a))

    def sqrt(self, a: Expr) -> Expr:
        return self.make(op.OP_SQRT, a)

    # Vectors

    def dot(self, a: Expr, b: Expr) -> Expr:
        return self.make(op.OP_DOT, a, b)

    def cross(self, a: Expr, b: Expr) -> Expr:
        return self.make(op.OP_CROSS, a, b)

    def normalize(self, a: Expr) -> Expr:
        return self.make(op.OP_NORMALIZE, a)

    def length(self, a: Expr) -> Expr:
        return self.sqrt(self.dot(a, a))

    def component(self, a: Expr, i: int) -> Expr:
        """Component i in all three."""
        return self.make(op.OP_COMBINE, a, a, a, sub=i | i << 2 | i << 4)

    def combine(self, x: Expr, y: Expr, z: Expr) -> Expr:
        """(x, y, z) of three scalars."""
        if x is y and y is z:
            return x
        return self.make(op.OP_COMBINE, x, y, z)

    def average(self, a: Expr) -> Expr:
        return self.dot(a, self.const(1.0 / 3.0))

    def luminance(self, a: Expr) -> Expr:
        """Rec. 709 luminance."""
        return self.dot(a, self.const(0.2126390059, 0.7151686788, 0.0721923154))

    def function(self, which: int, a: Expr, b: Expr | None = None) -> Expr:
        """Scalar function op.MATH_* of the first components."""
        return self.make(op.OP_MATH, a, self.zero if b is None else b, sub=which)

    def by_component(self, which: int, a: Expr, b: Expr | None = None) -> Expr:
        """A scalar function of each component."""
        parts = []
        for i in range(3):
            parts.append(self.function(which, self.component(a, i), None if b is None else self.component(b, i)))
        return self.combine(*parts)

    def matrix(self, a: Expr, rows) -> Expr:
        """Affine map; rows (3, 4). A diagonal one is a single multiply-add."""
        rows = np.asarray(rows, np.float64)
        linear = rows[:, :3]
        if not (linear - np.diag(np.diag(linear))).any():
            return self.fma(a, self.const(*np.diag(linear)), self.const(*rows[:, 3]))
        return self.make(op.OP_MATRIX, a, imm=Table(rows))

    def table(self, a: Expr, rows, *, step=False, extrapolate=False, alpha=False) -> Expr:
        """Piecewise linear function of each component over 0..1; rows (N, 4), N of 2 to 4096."""
        rows = np.asarray(rows, np.float32)
        flags = (op.TABLE_STEP if step else 0) | (op.TABLE_EXTRAPOLATE if extrapolate else 0)
        flags |= op.TABLE_ALPHA if alpha else 0
        return self.make(op.OP_TABLE, a, sub=(len(rows) - 1) | flags, imm=Table(rows))

    # Inputs

    def input(self, kind: int, shift: int = 0, width: Expr | None = None) -> Expr:
        """op.INPUT_*; `shift` 1 or 2 moves the point by the pixel's footprint times `width` (bump mapping)."""
        registers = {op.INPUT_UV: self.uv, op.INPUT_POSITION: self.position, op.INPUT_NORMAL: self.normal}
        if not shift and kind in registers:
            return registers[kind]
        return self.make_varying(op.OP_INPUT, width if shift else self.zero, sub=kind | shift << 8)

    def attribute(self, name: str, what: int, shift: int = 0, width: Expr | None = None) -> Expr:
        return self.make_varying(
            op.OP_ATTRIBUTE, width if shift else self.zero, sub=what | shift << 8, imm=attribute_hash(name)
        )

    def make_varying(self, code: int, *args: Expr, sub: int = 0, imm=0) -> Expr:
        """As `make`, for rows that read more than their operands."""
        key = (code, sub, imm, *map(id, args))
        return self._known.setdefault(key, Expr(code, args, sub, imm))


def attribute_hash(name: str) -> int:
    """FNV-1a of the UTF-8 name, 32 bits, never 0: hw::attribute_hash (core/scene)."""
    h = 0x811C9DC5
    for byte in name.encode("utf-8", "surrogateescape"):
        h = ((h ^ byte) * 0x01000193) & 0xFFFFFFFF
    return h or 1
