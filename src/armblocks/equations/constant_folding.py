"""Constant folding of elementary functions, with identical results on every machine.

CasADi evaluates an operation on constants when the expression is created, with the C library, whose last bits
are platform-dependent. The functions here insert the value of :mod:`armblocks.rounded_functions` instead.
Sums, products, quotients and square roots of constants are evaluated by CasADi, because IEEE 754 defines
their bits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Any

import casadi
from casadi import (
    SX,
    Function,
    copysign,
    densify,
    depends_on,
    fabs,
    reshape,
    substitute,
    symvar,
    vec,
    vertcat,
)

from armblocks import rounded_functions

_OPERATIONS = {
    **{
        int(getattr(casadi, f"OP_{name.upper()}")): name
        for name in (
            *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh", "acosh"),
            *("atanh", "exp", "expm1", "log", "log1p", "hypot", "erf"),
        )
    },
    int(casadi.OP_POW): "power",
    int(casadi.OP_CONSTPOW): "power",
}
"""CasADi's operations whose values come from the C library, with their names in armblocks."""


def elementary(name: str, *values: SX) -> SX:
    """A function of :data:`armblocks.rounded_functions.FUNCTIONS` of arrays, element by element.

    Scalars are broadcast.
    """
    result = _power(*values) if name == "power" else getattr(casadi, name)(*values)
    if not any(_has_constants(value) for value in values):
        return result
    whole = [densify(value) for value in values]
    result = densify(result)
    number = rounded_functions.FUNCTIONS[name]
    for k in range(result.numel()):
        operands = [value[k if value.numel() > 1 else 0] for value in whole]
        if all(operand.is_constant() for operand in operands):
            result[k] = number(*map(float, operands))
    return result


def _power(base: SX, exponent: SX) -> SX:
    """``base**exponent``, whose derivative with respect to the exponent has the factor ``log base``.

    CasADi would evaluate that logarithm during differentiation if the base is a constant. Here the base is
    passed in a form that CasADi does not recognise as a constant.
    """
    positive = base.is_constant() and all(float(base[k]) > 0.0 for k in range(base.numel()))
    if positive and not exponent.is_constant():
        base = fabs(copysign(base, exponent))
    return base**exponent


def _has_constants(value: SX) -> bool:
    if value.numel() <= 1 or value.is_symbolic() or value.is_constant():
        return value.is_constant()
    return any(value[k].is_constant() for k in range(value.numel()))


def has_elementary(function: Function) -> bool:
    """Whether a function has operations that CasADi would evaluate with the C library for constants."""
    return any(function.instruction_id(k) in _OPERATIONS for k in range(function.n_instructions()))


def call_with_constants(function: Function, arguments: Sequence[SX]) -> list[SX]:
    """The result columns of an SX function for these arguments, which may be constants."""
    if not any(map(_has_constants, arguments)):
        return function.call(list(arguments), True, False)
    return results_of_operations(function, arguments, operation_value)


def results_of_operations(
    function: Function, arguments: Sequence[SX], value_of: Callable[[int, Sequence[SX]], SX]
) -> list[SX]:
    """The result columns of an SX function, from the value of each operation.

    ``value_of(number, operands)`` is the value of the operation with CasADi's number.
    """
    whole = [densify(argument) for argument in arguments]
    results = [SX.zeros(function.numel_out(k)) for k in range(function.n_out())]
    rows = [function.sparsity_out(k).row() for k in range(function.n_out())]
    work: list[Any] = [SX(0.0)] * function.sz_w()
    for k in range(function.n_instructions()):
        number, sources = function.instruction_id(k), function.instruction_input(k)
        target = function.instruction_output(k)
        if number == casadi.OP_OUTPUT:
            results[target[0]][rows[target[0]][target[1]]] = work[sources[0]]
        elif number == casadi.OP_CONST:
            work[target[0]] = SX(function.instruction_constant(k))
        elif number == casadi.OP_INPUT:
            work[target[0]] = whole[sources[0]][sources[1]]
        elif number == casadi.OP_CALL:
            called = function.instructions_sx()[k].which_function()
            for slot, value in zip(target, called_entries(called, [work[source] for source in sources])):
                if slot >= 0:
                    work[slot] = value
        else:
            work[target[0]] = value_of(number, [work[source] for source in sources])
    return results


def called_entries(function: Function, entries: Sequence[SX]) -> list[SX]:
    """The entries of all results of a nested function call, from the entries of its arguments."""
    starts = [0, *accumulate(function.nnz_in(k) for k in range(function.n_in()))]
    arguments = [
        SX(function.sparsity_in(k), vertcat(*entries[starts[k] : starts[k + 1]], SX(0, 1)))
        for k in range(function.n_in())
    ]
    return [entry for result in function.call(arguments) for entry in result.nonzeros()]


def operation_value(number: int, operands: Sequence[SX]) -> SX:
    """The value of one operation of CasADi, by its number."""
    name = _OPERATIONS.get(number)
    if name is not None and all(operand.is_constant() for operand in operands):
        function: Callable[..., float] = rounded_functions.FUNCTIONS[name]
        return SX(function(*map(float, operands)))
    if number == casadi.OP_ASSIGN:
        return operands[0]
    return SX.unary(number, *operands) if len(operands) == 1 else SX.binary(number, *operands)


def substituted(expression: SX, symbols: SX, values: SX) -> SX:
    """The expression with values substituted for symbols; some values may be constants."""
    if not _has_constants(values):
        return substitute(expression, symbols, values)
    others = vertcat(*(entry for entry in symvar(expression) if not depends_on(symbols, entry)), SX(0, 1))
    function = Function("f", [symbols, others], [vec(densify(expression))])
    if not has_elementary(function):
        return substitute(expression, symbols, values)
    return reshape(call_with_constants(function, [values, others])[0], *expression.shape)
