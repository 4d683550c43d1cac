"""Text and LaTeX of factored sums."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from armblocks.algebra.factors import Term, factored
from armblocks.algebra.sums import CALL, TRIGONOMETRIC, Atom, angle_of

DIGITS = 12
"""Significant digits of numbers in texts."""
_GREEK = (
    *("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda", "mu"),
    *("nu", "xi", "pi", "rho", "sigma", "tau", "upsilon", "phi", "chi", "psi", "omega"),
)


@dataclass(frozen=True, kw_only=True)
class Names:
    """The names of symbols.

    ``coordinates``: by index. ``rates``: for the name of a speed or acceleration the name of its coordinate
    and the number of derivatives.
    """

    coordinates: Sequence[str]
    rates: Mapping[str, tuple[str, int]] = field(default_factory=dict[str, tuple[str, int]])

    def allow_short(self, symbols: Iterable[str]) -> bool:
        """Whether c1, s12 … are unambiguous: no symbol has such a name, and joint numbers have one digit."""
        return len(self.coordinates) < 10 and not any(re.fullmatch(r"[cs]\d+", name) for name in symbols)


class Notation(ABC):
    """The form of sums. ``short``: ``c12`` for ``cos(q1 + q2)``."""

    def __init__(self, names: Names, *, short: bool, times: str, brackets: tuple[str, str]) -> None:
        self.names = names
        self.short = short
        self.times = times
        self.brackets = brackets

    def sum(self, terms: Sequence[Term]) -> str:
        """A sum; 0 without terms."""
        if not terms:
            return "0"
        # A sum begins with a positive term, if it has one.
        first = next((term for term in terms if term.factor > 0), terms[0])
        ordered = (first, *(term for term in terms if term is not first))
        return self._without_plus("".join(self._term(term) for term in ordered))

    def _term(self, term: Term) -> str:
        """A term with its sign."""
        factors = [self._power(atom, power) for atom, power in term.monomial]
        size = abs(term.factor)
        if term.inner:
            factors.append(f"{self.brackets[0]}{self.sum(term.inner)}{self.brackets[1]}")
        if size != 1.0 or not factors:
            factors.insert(0, self.number(size))
        return f" {'-' if term.factor < 0 else '+'} {self.times.join(factors)}"

    def _power(self, atom: Atom, power: int) -> str:
        if atom.rank == TRIGONOMETRIC:
            short = short_angle(atom) if self.short else None
            return self.raised(
                self.trigonometric(atom.text, short, self._angle(atom)), power, simple=bool(short)
            )
        if atom.rank != CALL:
            return self.raised(self.symbol(atom.text), power, simple=True)
        arguments = [self.sum(factored(argument)) for argument in atom.arguments]
        return self.raised(self.call(atom.text.partition("(")[0], arguments), power, simple=False)

    def _angle(self, atom: Atom) -> str:
        factors, constant = angle_of(atom)
        text = ""
        for index, factor in factors:
            name, size = self.symbol(self.names.coordinates[index]), abs(factor)
            shown = name if size == 1.0 else f"{self.number(size)}{self.times}{name}"
            text += f" {'-' if factor < 0 else '+'} {shown}"
        return self._without_plus(text + (f" + {self.constant_angle(constant)}" if constant else ""))

    def _without_plus(self, text: str) -> str:
        return text[3:] if text.startswith(" + ") else f"-{text[3:]}"

    @abstractmethod
    def number(self, value: float) -> str:
        """A number that is not negative."""

    @abstractmethod
    def constant_angle(self, value: float) -> str:
        """A constant part of an angle, rad."""

    @abstractmethod
    def symbol(self, name: str) -> str:
        """A symbol."""

    @abstractmethod
    def trigonometric(self, name: str, short: str | None, angle: str) -> str:
        """A sine or cosine; ``short``: the digits of its joints, or None."""

    @abstractmethod
    def call(self, name: str, arguments: Sequence[str]) -> str:
        """A call of another function."""

    @abstractmethod
    def raised(self, text: str, power: int, *, simple: bool) -> str:
        """A power; ``simple``: of a symbol."""


class Text(Notation):
    """Plain text: ``l1*cos(q1) + l2*cos(q1 + q2)``, which Python reads, or ``l1 c1 + l2 c12``."""

    def __init__(self, names: Names, *, short: bool) -> None:
        super().__init__(names, short=short, times=" " if short else "*", brackets=("(", ")"))

    def number(self, value: float) -> str:
        return number_text(value)

    def constant_angle(self, value: float) -> str:
        fraction = pi_fraction(value)
        if fraction is None:
            return number_text(value)
        numerator, denominator = fraction
        return ("" if numerator == 1 else f"{numerator}*") + (
            "pi" if denominator == 1 else f"pi/{denominator}"
        )

    def symbol(self, name: str) -> str:
        return name

    def trigonometric(self, name: str, short: str | None, angle: str) -> str:
        return f"{name}({angle})" if short is None else f"{name[0]}{short}"

    def call(self, name: str, arguments: Sequence[str]) -> str:
        signs = {"less": "<", "less_equal": "<="}
        if name in signs:
            return f"({arguments[0]} {signs[name]} {arguments[1]})"
        return f"(1/({arguments[0]}))" if name == "reciprocal" else f"{name}({', '.join(arguments)})"

    def raised(self, text: str, power: int, *, simple: bool) -> str:
        return text if power == 1 else f"{text}{'^' if self.short else '**'}{power}"


class Latex(Notation):
    r"""LaTeX, with ``c_{12}`` in the short form."""

    def __init__(self, names: Names, *, short: bool) -> None:
        super().__init__(names, short=short, times=r" \, ", brackets=(r"\left(", r"\right)"))

    def number(self, value: float) -> str:
        mantissa, _, exponent = number_text(value).partition("e")
        return f"{mantissa} \\cdot 10^{{{int(exponent)}}}" if exponent else mantissa

    def constant_angle(self, value: float) -> str:
        fraction = pi_fraction(value)
        if fraction is None:
            return self.number(value)
        numerator, denominator = fraction
        top = r"\pi" if numerator == 1 else rf"{numerator} \pi"
        return top if denominator == 1 else rf"\frac{{{top}}}{{{denominator}}}"

    def symbol(self, name: str) -> str:
        if name not in self.names.rates:
            return latex_name(name)
        coordinate, derivatives = self.names.rates[name]
        return f"\\{'d' * derivatives}ot{{{latex_name(coordinate)}}}"

    def trigonometric(self, name: str, short: str | None, angle: str) -> str:
        return rf"\{name}\left({angle}\right)" if short is None else f"{name[0]}_{{{short}}}"

    def call(self, name: str, arguments: Sequence[str]) -> str:
        match name:
            case "less":
                return rf"\left[{arguments[0]} < {arguments[1]}\right]"
            case "less_equal":
                return rf"\left[{arguments[0]} \le {arguments[1]}\right]"
            case "reciprocal":
                return rf"\frac{{1}}{{{arguments[0]}}}"
            case "sqrt":
                return rf"\sqrt{{{arguments[0]}}}"
            case "abs":
                return rf"\left|{arguments[0]}\right|"
            case _:
                return rf"\operatorname{{{name}}}\left({', '.join(arguments)}\right)"

    def raised(self, text: str, power: int, *, simple: bool) -> str:
        if power == 1:
            return text
        return f"{text}^{{{power}}}" if simple else rf"\left({text}\right)^{{{power}}}"


def short_angle(atom: Atom) -> str | None:
    """The digits of ``c12``, or None for angles that are not sums of joint angles."""
    factors, constant = angle_of(atom)
    if constant or any(factor != 1.0 for _, factor in factors):
        return None
    return "".join(str(index + 1) for index, _ in factors)


def latex_name(name: str) -> str:
    """A name in LaTeX: ``l1`` and ``lc1`` with an index, longer names upright."""
    match = re.fullmatch(r"([A-Za-z]+)_?([0-9]*)", name)
    if match is None:
        escaped = re.sub(r"([_#$%&{}])", r"\\\1", name).replace(" ", r"\ ")
        return rf"\mathrm{{{escaped}}}"
    letters, digits = match.groups()
    if letters.lower() in _GREEK:
        base = f"\\{letters}"
    elif len(letters) <= 2:
        base, digits = letters[0], letters[1:] + digits
    else:
        base = rf"\mathrm{{{letters}}}"
    return f"{base}_{{{digits}}}" if digits else base


def number_text(value: float) -> str:
    """A number with at most 12 significant digits."""
    return f"{value:.{DIGITS}g}"


def pi_fraction(value: float) -> tuple[int, int] | None:
    """``(n, d)`` for ``n π / d`` with d up to 12, within rounding."""
    for denominator in (1, 2, 3, 4, 5, 6, 8, 9, 10, 12):
        numerator = round(value * denominator / math.pi)
        if numerator and abs(value - numerator * math.pi / denominator) < 1e-12:
            return numerator, denominator
    return None
