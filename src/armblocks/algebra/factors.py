"""Sums with common factors taken out, as textbooks print them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from armblocks.algebra.sums import EQUAL, TRIGONOMETRIC, Atom, Monomial, Sum, product


class Term(NamedTuple):
    """``factor`` times the product of the ``monomial`` times the sum of ``inner`` (1 if it is empty)."""

    factor: float
    monomial: Monomial
    inner: tuple[Term, ...] = ()


def factored(value: Sum) -> tuple[Term, ...]:
    """The terms of a sum, with its most frequent factors taken out.

    For kinematics these are the sines and cosines of the first joints: ``c1 (a2 c2 + a3 c23) - d s1``.
    """
    return tuple(sorted(_terms({key: entry[0] for key, entry in value.terms.items()}), key=_place))


def atoms_of(terms: tuple[Term, ...]) -> Iterator[Atom]:
    """All atoms of terms, also in the arguments of calls."""
    for term in terms:
        for atom, _ in term.monomial:
            yield atom
            for argument in atom.arguments:
                yield from atoms_of(factored(argument))
        yield from atoms_of(term.inner)


def _terms(numbers: Mapping[Monomial, float]) -> Iterator[Term]:
    rest = dict(numbers)
    while rest:
        group = _largest_group(rest)
        if len(group) < 2:
            break
        for key in group:
            del rest[key]
        common = _common(group)
        inverse = tuple((atom, -power) for atom, power in common)
        inner = {product(key, inverse): number for key, number in group.items()}
        factor = _common_number(inner)
        parts = {key: number / factor for key, number in inner.items()}
        yield Term(factor, common, tuple(sorted(_terms(parts), key=_place)))
    for key, number in rest.items():
        yield Term(number, key)


def _largest_group(numbers: Mapping[Monomial, float]) -> Mapping[Monomial, float]:
    """The terms with the most frequent power of an atom; of several, the one of the first joint."""
    counts: dict[tuple[Atom, int], int] = {}
    for key in numbers:
        for atom, power in key:
            if power > 0:
                counts[atom, power] = counts.get((atom, power), 0) + 1
    if not counts:
        return {}
    best = min(counts, key=lambda factor: (-counts[factor], factor[0].rank != TRIGONOMETRIC, factor))
    return {key: number for key, number in numbers.items() if best in key}


def _common(group: Mapping[Monomial, float]) -> Monomial:
    """The largest monomial that divides all terms."""
    first, *others = (dict(key) for key in group)
    shared = {atom: min(power, *(other.get(atom, 0) for other in others)) for atom, power in first.items()}
    return tuple(sorted((atom, power) for atom, power in shared.items() if power > 0))


def _common_number(numbers: Mapping[Monomial, float]) -> float:
    """The number to take out of a sum: the magnitude, if it is the same for all, with the sign of the first.

    The sign is taken out of sums without positive terms only.
    """
    values = list(numbers.values())
    size = abs(values[0])
    same = all(abs(abs(value) - size) <= EQUAL * size for value in values)
    sign = -1.0 if all(value < 0 for value in values) else 1.0
    return sign * size if same else sign


def _place(term: Term) -> tuple[object, ...]:
    """The place of a term in its sum: by its sines and cosines, then by its symbols."""
    trigonometric = tuple(entry for entry in term.monomial if entry[0].rank == TRIGONOMETRIC)
    return trigonometric == (), trigonometric, term.monomial
