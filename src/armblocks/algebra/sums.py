"""Sums of products of symbols, sines and cosines, with the simplifications of robot kinematics.

An atom is a symbol, the sine or cosine of a sum of joint angles, or a call of another function. A monomial is
a product of powers of atoms. A :class:`Sum` has a number for each monomial.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

PARAMETER, COORDINATE, RATE, TRIGONOMETRIC, CALL = range(5)
"""The ranks of atoms, in the order of the factors of a product."""

CANCELLATION = 1e-13
"""A sum below this fraction of its terms counts as a rounding error."""
EQUAL = 1e-12
"""Largest relative difference of two numbers that count as equal."""
QUARTER = math.pi / 2


class Atom(NamedTuple):
    """One factor of a product.

    ``rank``: PARAMETER, COORDINATE, RATE (symbols), TRIGONOMETRIC or CALL. ``order``: the index of a symbol;
    of a sine or cosine its angle, ``(i, f, j, g, …)`` for ``f q_i + g q_j + …``, and at the end, with an odd
    length, a constant (rad). ``text``: the name of the symbol or function. ``arguments``: of a call.
    """

    rank: int
    order: tuple[float, ...]
    text: str
    arguments: tuple[Sum, ...] = ()


Monomial = tuple[tuple[Atom, int], ...]
"""Atoms with their powers, sorted."""


class Sum:
    """A sum of monomials with numbers.

    ``terms``: for each monomial its number, and the sum of the magnitudes of the numbers that were added to
    it, which distinguishes rounding errors from small numbers.
    """

    __slots__ = ("terms",)

    def __init__(self, terms: Mapping[Monomial, tuple[float, float]] | None = None) -> None:
        self.terms: Mapping[Monomial, tuple[float, float]] = {} if terms is None else terms

    @classmethod
    def number(cls, value: float) -> Sum:
        """A number."""
        return cls({(): (value, abs(value))} if value else None)

    @classmethod
    def of(cls, atom: Atom, power: int = 1) -> Sum:
        """A power of an atom."""
        return cls({((atom, power),): (1.0, 1.0)})

    def __len__(self) -> int:
        return len(self.terms)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sum) and self.terms == other.terms

    def __hash__(self) -> int:
        return hash(frozenset(self.terms))

    @property
    def value(self) -> float | None:
        """The number, if the sum has no atoms."""
        if not self.terms:
            return 0.0
        return self.terms[()][0] if len(self.terms) == 1 and () in self.terms else None

    def plus(self, other: Sum) -> Sum:
        """The sum of both."""
        return Sum(_collected((*self.terms.items(), *other.terms.items())))

    def times(self, other: Sum) -> Sum:
        """The product, as a sum."""
        return Sum(
            _collected(
                (product(one, two), (a * b, size_a * size_b))
                for one, (a, size_a) in self.terms.items()
                for two, (b, size_b) in other.terms.items()
            )
        )

    def scaled(self, factor: float) -> Sum:
        """The product with a number."""
        return Sum({key: (factor * a, abs(factor) * size) for key, (a, size) in self.terms.items()})

    def contracted(self) -> Sum:
        """The sum with products of sines and cosines of two angles written with their sum or difference.

        ``cos a cos b - sin a sin b = cos(a + b)``, ``cos² a + sin² a = 1``, and similar identities, where
        both products occur with the same other factors and numbers.
        """
        terms = dict(self.terms)
        while any(_contracted_once(terms, monomial) for monomial in list(terms)):
            pass
        return Sum(terms)


def product(one: Monomial, two: Monomial) -> Monomial:
    """The product of two monomials."""
    if not one or not two:
        return one or two
    powers = dict(one)
    for atom, power in two:
        powers[atom] = powers.get(atom, 0) + power
    return tuple(sorted((atom, power) for atom, power in powers.items() if power))


def cosine(angle: Sum) -> Sum:
    """The cosine of a sum of joint angles; another argument gives a call."""
    return _trigonometric(angle, 0, "cos")


def sine(angle: Sum) -> Sum:
    """The sine of a sum of joint angles; another argument gives a call."""
    return _trigonometric(angle, 1, "sin")


def call(name: str, *arguments: Sum) -> Sum:
    """A call of a function that is neither sine nor cosine of joint angles."""
    key = ", ".join(repr(sorted(argument.terms.items())) for argument in arguments)
    return Sum.of(Atom(CALL, (), f"{name}({key})", arguments))


def _collected(terms: Iterable[tuple[Monomial, tuple[float, float]]]) -> dict[Monomial, tuple[float, float]]:
    """The sum with equal monomials added; monomials with the coefficient 0 are omitted."""
    collected: dict[Monomial, tuple[float, float]] = {}
    for key, (value, size) in terms:
        if key in collected:
            before, size_before = collected[key]
            collected[key] = before + value, size_before + size
        else:
            collected[key] = value, size
    return {key: entry for key, entry in collected.items() if abs(entry[0]) > CANCELLATION * entry[1]}


def _contracted_once(terms: dict[Monomial, tuple[float, float]], monomial: Monomial) -> bool:
    """Contract a monomial with another monomial of ``terms``; returns whether this was possible."""
    if monomial not in terms:
        return False
    a, size = terms[monomial]
    for partner, results in _contractions(monomial):
        b, other_size = terms.get(partner, (0.0, 0.0))
        found = results.get(math.copysign(1.0, a * b)) if b else None
        if found is None or abs(abs(a) - abs(b)) > EQUAL * abs(a):
            continue
        del terms[monomial], terms[partner]
        factor, result = found
        before, size_before = terms.pop(result, (0.0, 0.0))
        value, total = before + factor * a, size_before + max(size, other_size)
        if abs(value) > CANCELLATION * total:
            terms[result] = value, total
        return True
    return False


def _trigonometric(angle: Sum, quarters: int, name: str) -> Sum:
    """The cosine of ``angle - quarters 90°``."""
    factors: list[tuple[float, float]] = []
    constant = 0.0
    for monomial, (value, _) in angle.terms.items():
        if not monomial:
            constant = value
        elif len(monomial) == 1 and monomial[0][1] == 1 and monomial[0][0].rank == COORDINATE:
            factors.append((monomial[0][0].order[0], value))
        else:
            return call(name, angle)
    factors.sort()
    # cos(-a - b) = cos(a + b): the first factor is positive.
    shift = constant - quarters * QUARTER
    if factors and factors[0][1] < 0:
        factors, shift = [(index, -factor) for index, factor in factors], -shift
    turns = round(shift / QUARTER)
    rest = shift - turns * QUARTER
    if abs(rest) > EQUAL * max(1.0, abs(shift)):
        return _with_constant(factors, shift)
    if not factors:
        return Sum.number((1.0, 0.0, -1.0, 0.0)[turns % 4])
    order = tuple(value for pair in factors for value in pair)
    # cos(a + 90°) = -sin a.
    sign = (1.0, -1.0, -1.0, 1.0)[turns % 4]
    return Sum.of(Atom(TRIGONOMETRIC, order, ("cos", "sin")[turns % 2])).scaled(sign)


def _with_constant(factors: list[tuple[float, float]], shift: float) -> Sum:
    """``cos(angle + shift)`` as the cosine of the angle and a constant between 0 and 90 degrees."""
    if not factors:
        return Sum.number(math.cos(shift))
    turns = math.floor(shift / QUARTER)
    order = (*(value for pair in factors for value in pair), shift - turns * QUARTER)
    sign = (1.0, -1.0, -1.0, 1.0)[turns % 4]
    return Sum.of(Atom(TRIGONOMETRIC, order, ("cos", "sin")[turns % 2])).scaled(sign)


def angle_of(atom: Atom) -> tuple[list[tuple[int, float]], float]:
    """The angle of a sine or cosine: the factors of the coordinates by their indices, and the constant."""
    order = atom.order
    constant = order[-1] if len(order) % 2 else 0.0
    return [(int(order[k]), order[k + 1]) for k in range(0, len(order) - 1, 2)], constant


def _sum_of_angles(one: Atom, two: Atom, sign: float) -> Sum:
    """The angle ``one + sign two``."""
    total = Sum()
    for atom, factor in ((one, 1.0), (two, sign)):
        factors, constant = angle_of(atom)
        total = total.plus(Sum.number(factor * constant))
        for index, value in factors:
            symbol = Atom(COORDINATE, (float(index),), "")
            total = total.plus(Sum.of(symbol).scaled(factor * value))
    return total


_Contraction = tuple[Monomial, Mapping[float, tuple[float, Monomial]]]


@lru_cache(maxsize=20_000)
def _contractions(monomial: Monomial) -> tuple[_Contraction, ...]:
    """The cached results of :func:`_contractions_of`, which intermediate sums need repeatedly."""
    return tuple(_contractions_of(monomial))


def _contractions_of(monomial: Monomial) -> Iterator[_Contraction]:
    """The monomials with which a monomial can be contracted, and the results.

    Results: for the sign of the product of both numbers (1 or -1) the factor of the number of ``monomial``
    and the monomial.
    """
    trigonometric = [(atom, power) for atom, power in monomial if atom.rank == TRIGONOMETRIC and power > 0]
    for atom, power in trigonometric:
        if power >= 2:
            # cos² a + sin² a = 1, cos² a - sin² a = cos 2a, and a factor without the square: 1 - cos² = sin².
            other = Atom(atom.rank, atom.order, "sin" if atom.text == "cos" else "cos")
            rest = product(monomial, ((atom, -2),))
            doubled, sign = _single(_sum_of_angles(atom, atom, 1.0), "cos")
            turned = 1.0 if atom.text == "cos" else -1.0
            squared = product(rest, ((other, 2),))
            yield squared, {1.0: (1.0, rest), -1.0: (turned * sign, product(rest, doubled))}
            yield rest, {-1.0: (-1.0, squared)}
    for (one, _), (two, _) in combinations(trigonometric, 2):
        swapped = [Atom(a.rank, a.order, "sin" if a.text == "cos" else "cos") for a in (one, two)]
        rest = product(monomial, ((one, -1), (two, -1)))
        partner = product(product(rest, ((swapped[0], 1),)), ((swapped[1], 1),))
        if partner == monomial:
            continue
        results: dict[float, tuple[float, Monomial]] = {}
        for sign in (1.0, -1.0):
            value = _sum_of_pair(one, two, sign)
            if value is not None:
                results[sign] = value[0], product(rest, value[1])
        yield partner, results


def _sum_of_pair(one: Atom, two: Atom, sign: float) -> tuple[float, Monomial] | None:
    """``one two + sign`` times the product with sine and cosine exchanged, as a single sine or cosine."""
    if one.text == two.text:
        # cos a cos b ∓ sin a sin b = cos(a ± b)
        monomial, factor = _single(_sum_of_angles(one, two, -sign), "cos")
        return (factor if one.text == "cos" else sign * factor), monomial
    if sign > 0:
        # sin a cos b + cos a sin b = sin(a + b)
        monomial, factor = _single(_sum_of_angles(one, two, 1.0), "sin")
        return factor, monomial
    # sin a cos b - cos a sin b = sin(a - b)
    monomial, factor = _single(_sum_of_angles(one, two, -1.0), "sin")
    return (factor if one.text == "sin" else -factor), monomial


def _single(angle: Sum, name: str) -> tuple[Monomial, float]:
    """The sine or cosine of an angle as one monomial and its factor."""
    result = cosine(angle) if name == "cos" else sine(angle)
    if not result.terms:
        return (), 0.0
    ((monomial, (factor, _)),) = result.terms.items()
    return monomial, factor
