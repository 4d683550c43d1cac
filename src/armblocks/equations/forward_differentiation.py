"""Directional derivatives that are finite where the direction does not change a root, a power or an angle.

The derivative of ``sqrt(u)`` is infinite at ``u = 0``. CasADi's forward differentiation multiplies it by the
rate of u, so that a root that rests at 0 has the rate ``0 * inf = nan``. Here an operand with the rate 0
contributes 0 at these points. At all other points the formulas and their own derivatives agree with CasADi:
the rate of u may be 0 at one time or for one value of a parameter only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi
from casadi import SX, Function, densify, fabs, if_else, jtimes, logic_and, reshape, symvar, vec, vertcat

from armblocks.equations.constant_folding import operation_value, results_of_operations, substituted

_POWERS = (casadi.OP_POW, casadi.OP_CONSTPOW)
_UNBOUNDED = frozenset(
    (
        *_POWERS,
        casadi.OP_SQRT,
        casadi.OP_ASIN,
        casadi.OP_ACOS,
        casadi.OP_ACOSH,
        casadi.OP_ATAN2,
        casadi.OP_HYPOT,
    )
)
"""Operations with a finite value at a point where a partial derivative is infinite or does not exist."""


@dataclass(frozen=True, eq=False)
class _Operation:
    """One operation of :data:`_UNBOUNDED`, whose value is a symbol in the operations after it."""

    number: int
    operands: tuple[SX, ...]
    symbol: SX

    def rate(self, rates: Sequence[SX]) -> SX:
        """The rate of the value, from the rates of the operands."""
        total = SX(0.0)
        for k, rate in enumerate(rates):
            if not rate.is_zero():
                rests = logic_and(rate == 0.0, self._unbounded(k))
                total += if_else(rests, 0.0, rate * self._partial(k))
        return total

    def _unbounded(self, index: int) -> SX:
        """Whether the partial derivative with respect to one operand is infinite or does not exist."""
        a, b = self.operands[0], self.operands[-1]
        match self.number:
            case casadi.OP_SQRT:
                return a == 0.0
            case casadi.OP_ASIN | casadi.OP_ACOS | casadi.OP_ACOSH:
                return fabs(a) == 1.0
            case casadi.OP_ATAN2 | casadi.OP_HYPOT:
                return logic_and(a == 0.0, b == 0.0)
            case _:  # a power; the logarithm of its base does not exist for negative bases
                return logic_and(a == 0.0, b < 1.0) if index == 0 else a <= 0.0

    def _partial(self, index: int) -> SX:
        """The partial derivative with respect to one operand."""
        symbols = [SX.sym(f"a{k}") for k in range(len(self.operands))]
        value = operation_value(self.number, symbols)
        partial = jtimes(value, symbols[index], SX(1.0))
        if self.number in _POWERS:
            base, exponent = symbols
            # At x = 0, x ** 0 is 1 beside x, too, and x ** y is 0 for all y > 0.
            constant = exponent == 0.0 if index == 0 else exponent > 0.0
            partial = if_else(logic_and(base == 0.0, constant), 0.0, partial)
        return substituted(partial, vertcat(*symbols), vertcat(*self.operands))


def directional_derivative(expression: SX, variables: SX, direction: SX) -> SX:
    """The derivative of ``expression`` along ``direction``, in the shape of the expression.

    ``variables`` is a column of symbols (n, 1), and ``direction`` (n, 1) their rates. Where the partial
    derivative of a root, power, arc or norm is unbounded, an operand with the rate 0 contributes 0. A rate
    that is not finite remains, such as the rate of ``sqrt(u)`` where u leaves 0 with a rate other than 0.
    """
    own = {variables[k].element_hash() for k in range(variables.numel())}
    others = vertcat(*(symbol for symbol in symvar(expression) if symbol.element_hash() not in own), SX(0, 1))
    function = Function("f", [variables, others], [vec(densify(expression))])
    if not any(function.instruction_id(k) in _UNBOUNDED for k in range(function.n_instructions())):
        return jtimes(expression, variables, direction)
    operations, column = _cut(function, (variables, others))
    symbols, values, rates = SX(0, 1), SX(0, 1), direction
    for operation in operations:
        operands = vertcat(*operation.operands)
        of_operands = densify(jtimes(operands, vertcat(variables, symbols), rates))
        rate = operation.rate([of_operands[k] for k in range(operands.numel())])
        value = operation_value(operation.number, _entries(substituted(operands, symbols, values)))
        symbols = vertcat(symbols, operation.symbol)
        values = vertcat(values, value)
        rates = vertcat(rates, rate)
    derivative = densify(jtimes(column, vertcat(variables, symbols), rates))
    return reshape(substituted(derivative, symbols, values), *expression.shape)


def _entries(column: SX) -> list[SX]:
    return [column[k] for k in range(column.numel())]


def _cut(function: Function, arguments: Sequence[SX]) -> tuple[list[_Operation], SX]:
    """The operations of :data:`_UNBOUNDED` in sequence, and the result as a function of their symbols."""
    operations: list[_Operation] = []

    def value(number: int, operands: Sequence[SX]) -> SX:
        if number not in _UNBOUNDED or all(operand.is_constant() for operand in operands):
            return operation_value(number, operands)
        operations.append(_Operation(number, tuple(operands), SX.sym(f"s{len(operations)}")))
        return operations[-1].symbol

    (result,) = results_of_operations(function, arguments, value)
    return operations, result
