"""The operations of a tape: names, numbers of operands and categories.

Every operation is defined on IEEE 754 doubles and rounds to nearest. Where languages differ, the definitions
are:

* ``FMA a b c`` is ``a b + c`` rounded once, ``FMS`` is ``a b - c``, ``FNMA`` is ``c - a b``.
* ``MINIMUM`` and ``MAXIMUM`` return NaN if either operand is NaN (as ``numpy.minimum``; C's ``fmin`` and
  CasADi drop it, so a limiter would hide the first invalid signal). Of two equal operands the second is
  returned.
* ``SIGN`` is -1, 1, or the operand itself if it is a zero or a NaN.
* A comparison is 1.0 or 0.0. With a NaN all comparisons are 0.0, except ``NE``. A condition is true if it is
  not equal to zero, so a NaN is true.
* ``SELECT c a b`` is ``a`` if ``c`` is true, else ``b``. The other value has no influence, even if it is NaN.
* ``MODULO`` is C's ``fmod`` (sign of the dividend, exact); ``REMAINDER`` is IEEE's (nearest quotient, ties to
  even, exact).
* ``READ x n i`` reads a table of ``n`` scalars, which begins at input ``x`` and lies in one slot. The result
  is the entry with the index ``i``, truncated to an integer and limited to 0 … n - 1 (0 for a NaN). ``n`` is
  a constant.
* ``SOLVE a11 a12 … ann b1 … bn`` solves n linear equations (:mod:`armblocks.compiler.linear_solution`). It
  has n results. ``MEMBER s k`` is result k of the operation ``s``, where k is a constant, counted from 0.
  Only ``MEMBER`` may read the results.
* ``PRODUCT a m n x1 … xn c1 … cm`` adds a matrix times a vector. Its result i, for ``MEMBER``, is
  ``((ci + ai1 x1) + ai2 x2) + … + ain xn``, each term by ``FMA``. The matrix is the ``m n`` scalars that
  begin at input ``a`` and lie in one slot, row by row; ``m`` and ``n`` are constants
  (:mod:`armblocks.compiler.matrix_products`).
* ``POWER`` follows C99: ``x**0`` and ``1**y`` are 1 even with NaN.
"""

from __future__ import annotations

import math
from enum import IntEnum, auto


class Opcode(IntEnum):
    """One operation. The numbers are part of the digest of a tape, so new operations are appended."""

    ADD = auto()
    SUBTRACT = auto()
    MULTIPLY = auto()
    DIVIDE = auto()
    NEGATE = auto()
    SQUARE_ROOT = auto()
    FMA = auto()
    FMS = auto()
    FNMA = auto()
    ABSOLUTE = auto()
    SIGN = auto()
    FLOOR = auto()
    CEILING = auto()
    MINIMUM = auto()
    MAXIMUM = auto()
    COPY_SIGN = auto()
    MODULO = auto()
    REMAINDER = auto()
    LESS = auto()
    LESS_EQUAL = auto()
    EQUAL = auto()
    NOT_EQUAL = auto()
    NOT = auto()
    AND = auto()
    OR = auto()
    SELECT = auto()
    SIN = auto()
    COS = auto()
    TAN = auto()
    ASIN = auto()
    ACOS = auto()
    ATAN = auto()
    ATAN2 = auto()
    SINH = auto()
    COSH = auto()
    TANH = auto()
    ASINH = auto()
    ACOSH = auto()
    ATANH = auto()
    EXP = auto()
    EXPM1 = auto()
    LOG = auto()
    LOG1P = auto()
    POWER = auto()
    HYPOT = auto()
    ERF = auto()
    READ = auto()
    SOLVE = auto()
    MEMBER = auto()
    PRODUCT = auto()

    @property
    def arity(self) -> int:
        """Number of operands; 0 if it varies."""
        return _ARITY.get(self, 1)


VECTORS = frozenset({Opcode.SOLVE, Opcode.PRODUCT})
"""Operations with any number of operands and several results."""

COMMUTATIVE = frozenset(
    {Opcode.ADD, Opcode.MULTIPLY, Opcode.EQUAL, Opcode.NOT_EQUAL, Opcode.AND, Opcode.OR, Opcode.HYPOT}
)
"""Operations whose operands may be exchanged: results that are not NaN stay bitwise the same."""

COMPARISONS = frozenset(
    {Opcode.LESS, Opcode.LESS_EQUAL, Opcode.EQUAL, Opcode.NOT_EQUAL, Opcode.NOT, Opcode.AND, Opcode.OR}
)
"""Operations whose result is 1.0 or 0.0."""

ELEMENTARY = frozenset(opcode for opcode in Opcode if Opcode.SIN <= opcode <= Opcode.ERF) | {
    Opcode.MODULO,
    Opcode.REMAINDER,
}
"""Operations that a function of :mod:`armblocks.compiler.elementary` computes."""


def solution_length(operands: int) -> int:
    """The number n of unknowns of a ``SOLVE`` with n (n + 1) operands."""
    return math.isqrt(operands)


_ARITY = {
    **dict.fromkeys(VECTORS, 0),
    **dict.fromkeys((Opcode.FMA, Opcode.FMS, Opcode.FNMA, Opcode.SELECT, Opcode.READ), 3),
    **dict.fromkeys(
        (
            Opcode.ADD,
            Opcode.SUBTRACT,
            Opcode.MULTIPLY,
            Opcode.DIVIDE,
            Opcode.MINIMUM,
            Opcode.MAXIMUM,
            Opcode.COPY_SIGN,
            Opcode.MODULO,
            Opcode.REMAINDER,
            Opcode.LESS,
            Opcode.LESS_EQUAL,
            Opcode.EQUAL,
            Opcode.NOT_EQUAL,
            Opcode.AND,
            Opcode.OR,
            Opcode.ATAN2,
            Opcode.POWER,
            Opcode.HYPOT,
            Opcode.MEMBER,
        ),
        2,
    ),
}
