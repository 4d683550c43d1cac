"""Expressions of SymPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING

from casadi import Function

from armblocks.algebra.factors import Term, factored
from armblocks.algebra.graph import evaluate
from armblocks.algebra.notation import pi_fraction
from armblocks.algebra.sums import CALL, TRIGONOMETRIC, Atom, angle_of
from armblocks.extras import from_extra

if TYPE_CHECKING:
    from sympy import Expr, Matrix, Symbol


@cache
def _sympy():
    with from_extra("symbolic", "expressions of SymPy"):
        import sympy
    return sympy


class _SympyArithmetic:
    """The arithmetic of SymPy's expressions."""

    def constant(self, value: float) -> Expr:
        """A number."""
        return _number(value)

    def add(self, a: Expr, b: Expr) -> Expr:
        """The sum."""
        return a + b

    def multiply(self, a: Expr, b: Expr) -> Expr:
        """The product."""
        return a * b

    def divide(self, a: Expr, b: Expr) -> Expr:
        """The quotient."""
        return a / b

    def cosine(self, a: Expr) -> Expr:
        """The cosine."""
        return _sympy().cos(a)

    def sine(self, a: Expr) -> Expr:
        """The sine."""
        return _sympy().sin(a)

    def call(self, name: str, *arguments: Expr) -> Expr:
        """A function of the graph; comparisons are 1 or 0."""
        a, b = arguments[0], arguments[-1]
        match name:
            case "less":
                return _sympy().Piecewise((1, a < b), (0, True))
            case "less_equal":
                return _sympy().Piecewise((1, a <= b), (0, True))
            case "reciprocal":
                return 1 / a
            case "sqrt":
                return _sympy().sqrt(a)
            case "abs":
                return _sympy().Abs(a)
            case "min":
                return _sympy().Min(a, b)
            case "max":
                return _sympy().Max(a, b)
            case "atan2":
                return _sympy().atan2(a, b)
            case _:
                return _sympy().sign(a)


def symbols_of(names: Sequence[str]) -> dict[str, Symbol]:
    """Real symbols by name."""
    return {name: _sympy().Symbol(name, real=True) for name in names}


def of_terms(terms: Sequence[Term], coordinates: Sequence[str], symbols: Mapping[str, Symbol]) -> Expr:
    """The expression of a factored sum."""
    return _sympy().Add(*(_of_term(term, coordinates, symbols) for term in terms))


def of_function(function: Function, inputs: Sequence[Sequence[Symbol]], where: str) -> list[list[Expr]]:
    """The structural entries of the outputs, without simplification."""
    values: Sequence[Sequence[Expr]] = inputs
    return evaluate(function, values, _SympyArithmetic(), where)


def matrix(rows: Sequence[Sequence[Expr]]) -> Matrix:
    """The matrix with these rows."""
    return _sympy().Matrix(rows)


def _of_term(term: Term, coordinates: Sequence[str], symbols: Mapping[str, Symbol]) -> Expr:
    factors = [_of_atom(atom, coordinates, symbols) ** power for atom, power in term.monomial]
    if term.inner:
        factors.append(of_terms(term.inner, coordinates, symbols))
    return _sympy().Mul(_number(term.factor), *factors)


def _of_atom(atom: Atom, coordinates: Sequence[str], symbols: Mapping[str, Symbol]) -> Expr:
    if atom.rank == TRIGONOMETRIC:
        factors, constant = angle_of(atom)
        angle = _sympy().Add(*(_number(factor) * symbols[coordinates[k]] for k, factor in factors))
        fraction = pi_fraction(constant)
        rest = _number(constant) if fraction is None else _sympy().pi * _sympy().Rational(*fraction)
        return _sympy().cos(angle + rest) if atom.text == "cos" else _sympy().sin(angle + rest)
    if atom.rank != CALL:
        return symbols[atom.text]
    arguments = [of_terms(factored(argument), coordinates, symbols) for argument in atom.arguments]
    return _SympyArithmetic().call(atom.text.partition("(")[0], *arguments)


def _number(value: float) -> Expr:
    """Integers and halves exactly, other numbers with 15 digits."""
    return _sympy().Rational(int(2 * value), 2) if (2 * value).is_integer() else _sympy().Float(value, 15)
