"""Modes and guards of operations that jump: comparisons, signs, rounding, remainders, angles."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import casadi
from casadi import SX, fabs, fmax, fmin, if_else, logic_and, sign

from armblocks.equations.remainders import OFFSET, beyond_ends, quotient_of, remainder_for_quotient

COMPARISONS = frozenset({casadi.OP_LT, casadi.OP_LE, casadi.OP_EQ, casadi.OP_NE})
JUMPS = COMPARISONS | {
    casadi.OP_SIGN,
    casadi.OP_FLOOR,
    casadi.OP_CEIL,
    casadi.OP_FMOD,
    casadi.OP_ATAN2,
}
"""The operations that jump."""
LOGIC = frozenset({casadi.OP_NOT, casadi.OP_AND, casadi.OP_OR})
STEPS = (JUMPS | LOGIC) - {casadi.OP_FMOD, casadi.OP_ATAN2}
"""Operations whose values are constant between their jumps."""


@dataclass
class JumpModes:
    """The modes that replace jumping operations, their values for the present signals, and their guards."""

    modes: list[SX] = field(default_factory=list[SX])
    consistent: list[SX] = field(default_factory=list[SX])
    guards: list[SX] = field(default_factory=list[SX])
    directions: list[int] = field(default_factory=list[int])
    mode_of_guard: list[int] = field(default_factory=list[int])
    """For each guard the number of its mode."""
    after: list[tuple[SX, SX]] = field(default_factory=list[tuple[SX, SX]])
    """For each guard the value of its mode after it fired upwards and downwards."""

    def replaced(self, operation: int, a: SX, b: SX) -> SX:
        """The value of a jumping operation as a function of its operands and of a new mode.

        For a consistent mode it is the value of the operation. Just beyond a jump, before the mode changes,
        it is the continued value from before the jump.
        """
        if operation == casadi.OP_FMOD:
            return self._remainder(a, b)
        if operation == casadi.OP_ATAN2:
            return self._angle(a, b)
        if operation in (casadi.OP_FLOOR, casadi.OP_CEIL):
            return self._rounded(operation, a)
        if operation == casadi.OP_SIGN:
            mode = self._mode(_if_number(a, sign(a), 0.0))
            self._guard(a, SX(1.0), SX(-1.0))
            return _if_number(a, mode, sign(a))
        mode = self._mode(SX.binary(operation, a, b))
        if operation in (casadi.OP_EQ, casadi.OP_NE):
            passed = SX(float(operation == casadi.OP_NE))
            self._guard(b - a, passed, passed)
        else:
            self._guard(b - a + (OFFSET if operation == casadi.OP_LE else -OFFSET), SX(1.0), SX(0.0))
        return mode

    def _mode(self, consistent: SX) -> SX:
        mode = SX.sym(f"jump {len(self.modes)}")
        self.modes.append(mode)
        self.consistent.append(consistent)
        return mode

    def _guard(self, value: SX, up: SX, down: SX, direction: int = 0) -> None:
        self.guards.append(value)
        self.after.append((up, down))
        self.directions.append(direction)
        self.mode_of_guard.append(len(self.modes) - 1)

    def _rounded(self, operation: int, a: SX) -> SX:
        mode = self._mode(_if_number(a, SX.unary(operation, a), 0.0))
        if operation == casadi.OP_FLOOR:
            self._steps(mode, a - (mode + 1.0) + OFFSET, a - mode + OFFSET)
        else:
            self._steps(mode, a - mode - OFFSET, a - (mode - 1.0) - OFFSET)
        return _if_number(a, mode, a)

    def _steps(self, mode: SX, up: SX, down: SX) -> None:
        """The guards of an integer: at the next and at the previous integer.

        A jump may pass several integers at once. A mode changes by at least one, although rounding errors at
        an integer could give the old value.
        """
        target = self.consistent[-1]
        self._guard(up, fmax(target, mode + 1.0), mode, 1)
        self._guard(down, mode, fmin(target, mode - 1.0), -1)

    def _remainder(self, a: SX, b: SX) -> SX:
        """``fmod(a, b) = a - n b``; the mode is the integer n, a / b rounded toward zero."""
        mode = self._mode(quotient_of("rem", a, b))
        self._steps(mode, *beyond_ends("rem", a, b, mode))
        return remainder_for_quotient("rem", a, b, mode)

    def _angle(self, y: SX, x: SX) -> SX:
        """``atan2(y, x)``; the mode is 1 in the third quadrant. The angle jumps where x < 0 and y changes
        sign."""
        third = logic_and(x < 0.0, y < 0.0)
        mode = self._mode(third)
        self._guard(fmax(x, y) + OFFSET, SX(0.0), SX(1.0))
        below = logic_and(third, fabs(y) < fabs(x))
        above = logic_and(x < 0.0, y >= 0.0)
        turns = if_else(mode, if_else(above, -1.0, 0.0), if_else(below, 1.0, 0.0))
        return casadi.atan2(y, x) + 2.0 * math.pi * turns


def _if_number(a: SX, value: SX, other: SX | float) -> SX:
    """``value``, or ``other`` if ``a`` is infinite or NaN: no event occurs there, and the mode is 0."""
    return if_else(fabs(a) < math.inf, value, other)
