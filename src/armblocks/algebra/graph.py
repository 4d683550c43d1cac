"""Evaluation of a CasADi function with sums of products, or expressions of SymPy, in place of numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol, TypeVar

import casadi
from casadi import Function

from armblocks.errors import InputError

T = TypeVar("T")

CALLS: Mapping[str, str] = {
    "OP_SQRT": "sqrt",
    "OP_FABS": "abs",
    "OP_SIGN": "sign",
    "OP_LT": "less",
    "OP_LE": "less_equal",
    "OP_FMIN": "min",
    "OP_FMAX": "max",
    "OP_ATAN2": "atan2",
}
"""The functions that remain calls, by CasADi's name of the operation."""

_NAMES: Mapping[int, str] = {
    int(number): name
    for name, number in vars(casadi).items()
    if name.startswith("OP_") and isinstance(number, int)
}


class Arithmetic(Protocol[T]):
    """The operations with values of a type."""

    def constant(self, value: float) -> T:
        """A number."""
        ...

    def add(self, a: T, b: T) -> T:
        """The sum."""
        ...

    def multiply(self, a: T, b: T) -> T:
        """The product."""
        ...

    def divide(self, a: T, b: T) -> T:
        """The quotient."""
        ...

    def cosine(self, a: T) -> T:
        """The cosine."""
        ...

    def sine(self, a: T) -> T:
        """The sine."""
        ...

    def call(self, name: str, *arguments: T) -> T:
        """A function of :data:`CALLS`; comparisons are 1 or 0."""
        ...


def evaluate(
    function: Function, inputs: Sequence[Sequence[T]], arithmetic: Arithmetic[T], where: str
) -> list[list[T]]:
    """The structural entries of all outputs, for the entries of all inputs.

    Raises InputError that names an operation without a form in text.
    """
    outputs = [[arithmetic.constant(0.0)] * function.nnz_out(k) for k in range(function.n_out())]
    work = [arithmetic.constant(0.0)] * function.sz_w()
    for k in range(function.n_instructions()):
        number = function.instruction_id(k)
        targets, sources = function.instruction_output(k), function.instruction_input(k)
        if number == casadi.OP_OUTPUT:
            slot, index = targets
            outputs[slot][index] = work[sources[0]]
        elif number == casadi.OP_INPUT:
            slot, index = sources
            work[targets[0]] = inputs[slot][index]
        elif number == casadi.OP_CONST:
            work[targets[0]] = arithmetic.constant(function.instruction_constant(k))
        else:
            name = _NAMES.get(number, str(number))
            operands = [work[source] for source in sources if source >= 0]
            work[targets[0]] = _result(name, operands, arithmetic, where)
    return outputs


def _result(name: str, operands: Sequence[T], arithmetic: Arithmetic[T], where: str) -> T:
    """The result of one operation."""
    minus_one = arithmetic.constant(-1.0)
    first, last = operands[0], operands[-1]
    match name:
        case "OP_ADD":
            return arithmetic.add(first, last)
        case "OP_TWICE":
            return arithmetic.multiply(arithmetic.constant(2.0), first)
        case "OP_SUB":
            return arithmetic.add(first, arithmetic.multiply(minus_one, last))
        case "OP_NEG":
            return arithmetic.multiply(minus_one, first)
        case "OP_MUL" | "OP_IF_ELSE_ZERO":
            # A condition is 1 or 0.
            return arithmetic.multiply(first, last)
        case "OP_SQ":
            return arithmetic.multiply(first, first)
        case "OP_DIV":
            return arithmetic.divide(first, last)
        case "OP_INV":
            return arithmetic.divide(arithmetic.constant(1.0), first)
        case "OP_NOT":
            return arithmetic.add(arithmetic.constant(1.0), arithmetic.multiply(minus_one, first))
        case "OP_COS":
            return arithmetic.cosine(first)
        case "OP_SIN":
            return arithmetic.sine(first)
        case "OP_ASSIGN":
            return first
        case _ if name in CALLS:
            return arithmetic.call(CALLS[name], *operands[: 1 if name in _OF_ONE else 2])
        case _:
            raise InputError(
                f"the equations use the operation {name}, which has no form in text",
                where=where,
                allowed="sums, products, quotients, sines, cosines, " + ", ".join(CALLS.values()),
                fix="use the CasADi expression, the attribute 'casadi'",
            )


_OF_ONE = ("OP_SQRT", "OP_FABS", "OP_SIGN")
