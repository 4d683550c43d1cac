"""CasADi functions as sums of products, with a limit on their size."""

from __future__ import annotations

from collections.abc import Sequence

from casadi import Function

from armblocks.algebra.graph import evaluate
from armblocks.algebra.sums import Sum, call, cosine, sine

MAX_PRODUCTS = 200_000
"""Largest number of products of terms in the expansion of a function, which takes some seconds."""
MAX_CONTRACTED = 300
"""Only intermediate sums of at most this many terms are contracted."""


class _TooManyTermsError(Exception):
    """The expansion has more than ``MAX_PRODUCTS`` products."""


class _Sums:
    """The arithmetic of sums. Small intermediate sums are contracted, so that they stay small."""

    def __init__(self) -> None:
        self._products = 0

    def constant(self, value: float) -> Sum:
        """A number."""
        return Sum.number(value)

    def add(self, a: Sum, b: Sum) -> Sum:
        """The sum."""
        self._count(len(a) + len(b))
        return _small_contracted(a.plus(b))

    def multiply(self, a: Sum, b: Sum) -> Sum:
        """The product, expanded."""
        self._count(len(a) * len(b))
        return _small_contracted(a.times(b))

    def divide(self, a: Sum, b: Sum) -> Sum:
        """The quotient. A divisor with several terms becomes the call ``reciprocal``."""
        if len(b) != 1:
            return self.multiply(a, call("reciprocal", b))
        ((monomial, (value, _)),) = b.terms.items()
        inverse = {tuple((atom, -power) for atom, power in monomial): (1.0 / value, abs(1.0 / value))}
        return a.times(Sum(inverse))

    def cosine(self, a: Sum) -> Sum:
        """The cosine."""
        return cosine(a)

    def sine(self, a: Sum) -> Sum:
        """The sine."""
        return sine(a)

    def call(self, name: str, *arguments: Sum) -> Sum:
        """A function without a rule in this class, as a call."""
        return call(name, *arguments)

    def _count(self, products: int) -> None:
        self._products += products
        if self._products > MAX_PRODUCTS:
            raise _TooManyTermsError


def _small_contracted(value: Sum) -> Sum:
    return value.contracted() if 1 < len(value) <= MAX_CONTRACTED else value


def sums_of(function: Function, inputs: Sequence[Sequence[Sum]], where: str) -> list[list[Sum]] | None:
    """The structural entries of the outputs as sums; None if they have too many terms."""
    try:
        return evaluate(function, inputs, _Sums(), where)
    except _TooManyTermsError:
        return None
