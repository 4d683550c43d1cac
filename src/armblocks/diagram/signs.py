"""The face of a block: its outline and its sign (a curve, a fraction, or a few characters).

A block with a constant sign declares it as ``sign``; a block whose sign depends on parameters overrides
``face_sign``. :mod:`armblocks.drawing` draws signs. A block without a sign shows its title.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

import numpy as np

from armblocks.errors import counted
from armblocks.pictures.numbers import axis_number


class Outline(Enum):
    """The outline of a block."""

    CARD = "card"
    TRIANGLE = "triangle"
    CIRCLE = "circle"
    BAR = "bar"
    BUS = "bus"
    OVAL = "oval"
    TAG = "tag"


@dataclass(frozen=True)
class Words:
    """One short line of text."""

    text: str
    italic: bool = False


@dataclass(frozen=True)
class Lines:
    """Several lines of text, which are not broken further."""

    texts: tuple[str, ...]


@dataclass(frozen=True)
class Title:
    """The name of a block, broken at spaces."""

    text: str


@dataclass(frozen=True)
class Fraction:
    """A fraction; ``limited`` draws it between two limit stops."""

    above: str
    below: str
    limited: bool = False


@dataclass(frozen=True)
class Graph:
    """A curve in a small coordinate system: points from (0, 0), lower left, to (1, 1)."""

    points: tuple[tuple[float, float], ...]


FaceSign: TypeAlias = Words | Lines | Title | Fraction | Graph


# -- curves --------------------------------------------------------------------------------------------------


def graph(*points: tuple[float, float]) -> Graph:
    """A curve through points."""
    return Graph(points)


def sine_curve(cycles: float, growth: float = 0.0) -> Graph:
    """A sine around the middle with growing frequency."""
    points = [k / 64 for k in range(65)]
    return graph(*((u, 0.5 + 0.5 * math.sin(2 * math.pi * cycles * u * (1 + growth * u))) for u in points))


def stairs(levels: Sequence[float]) -> Graph:
    """A staircase with equidistant jumps."""
    share = 1 / len(levels)
    return graph(*((u, level) for k, level in enumerate(levels) for u in (k * share, (k + 1) * share)))


def pulses(widths: Sequence[float]) -> Graph:
    """Equidistant pulses with the given widths."""
    share = 1 / len(widths)
    corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)]
    return graph(
        *((share * (k + width * u), v) for k, width in enumerate(widths) for u, v in corners), (1.0, 0.0)
    )


BANDS = {
    "low_pass": graph((0, 0.85), (0.4, 0.85), (0.55, 0.75), (1, 0)),
    "high_pass": graph((0, 0), (0.45, 0.75), (0.6, 0.85), (1, 0.85)),
    "band_pass": graph((0, 0), (0.32, 0.75), (0.42, 0.85), (0.58, 0.85), (0.68, 0.75), (1, 0)),
    "band_stop": graph(
        (0, 0.85), (0.25, 0.85), (0.36, 0.75), (0.5, 0), (0.64, 0.75), (0.75, 0.85), (1, 0.85)
    ),
}
"""Magnitude over frequency of the four types of filters."""
SATURATION = graph((0, 0), (0.3, 0), (0.7, 1), (1, 1))
DEAD_ZONE = graph((0, 0), (0.33, 0.5), (0.67, 0.5), (1, 1))
RATE_LIMIT = graph((0, 0), (0.2, 0), (0.6, 1), (1, 1))
TABLE = graph((0, 0), (0.25, 0.75), (0.5, 0.6), (0.75, 0.95), (1, 1))
"""Curves that several blocks show."""


# -- text of parameters -------------------------------------------------------------------------------------


def value_text(value: object) -> str:
    """The text of a scalar, a small vector in brackets, or the size of a larger array."""
    array = np.asarray(value, dtype=np.float64)
    if array.size == 1:
        return axis_number(float(f"{float(array.reshape(-1)[0]):.4g}"))
    if array.ndim == 1 and array.size <= 4:
        return "[" + " ".join(axis_number(float(f"{float(v):.3g}")) for v in array) + "]"
    return "×".join(str(n) for n in array.shape) + (" vector" if array.ndim == 1 else "")


def polynomial(name: str, coefficients: object, letter: str = "s", *, delays: bool = False) -> str:
    """``s² + 2s + 1``; with ``delays`` in ascending negative powers; ``b(s)`` if that is too long."""
    values = np.asarray(coefficients, dtype=np.float64).reshape(-1).tolist()
    highest = 0 if delays else len(values) - 1
    terms: list[str] = []
    for k, value in enumerate(values):
        if value == 0 and len(values) > 1:
            continue
        degree = highest - k
        symbol = "" if degree == 0 else letter + ("" if degree == 1 else superscript(degree))
        magnitude = axis_number(abs(float(f"{value:.3g}")))
        text = symbol if symbol and magnitude == "1" else magnitude + symbol
        sign = "−" if value < 0 else "+"
        terms.append(text if not terms and value >= 0 else f"{sign} {text}" if terms else f"−{text}")
    text = " ".join(terms) or "0"
    return text if len(text) <= 20 else f"{name}({letter}{'⁻¹' * delays})"


def superscript(number: int) -> str:
    """An integer in superscript digits."""
    return "".join("⁰¹²³⁴⁵⁶⁷⁸⁹⁻"["0123456789-".index(digit)] for digit in str(number))


def _roots(roots: object, letter: str) -> str:
    """``s (s + 1)``; ``1`` without roots; else the number of roots, if some are complex or more than two."""
    values = np.asarray(roots, dtype=np.complex128).reshape(-1).tolist()
    if len(values) > 2 or any(abs(value.imag) > 0 for value in values):
        return counted(len(values), "root")
    factors = [
        letter if v == 0 else f"({polynomial('a', (1.0, -v.real), letter)})" for v in sorted(values, key=abs)
    ]
    return " ".join(factors) or "1"


def times(gain: object, text: str) -> str:
    """A gain before an expression; a gain of 1 is omitted."""
    gain_text = value_text(gain)
    if gain_text == "1":
        return text
    return gain_text if text == "1" else f"{gain_text} {text}"


def ratio_of_roots(zeros: object, poles: object, gain: object, letter: str) -> Fraction:
    """A transfer function by its zeros, poles and gain."""
    return Fraction(times(gain, _roots(zeros, letter)), _roots(poles, letter))


def plus(value: object) -> str:
    """``+ 3``, or ``− 3`` for a negative value."""
    text = value_text(value)
    return f"− {text[1:]}" if text.startswith("−") else f"+ {text}"


def minus(value: object) -> str:
    """``− 3``, or ``+ 3`` for a negative value."""
    return plus(-np.asarray(value, dtype=np.float64))


_FUNCTIONS = {
    "square": "u²",
    "cube": "u³",
    "reciprocal": "1/u",
    "sqrt": "√u",
    "cbrt": "∛u",
    "signedSqrt": "±√|u|",
    "rSqrt": "1/√u",
    "abs": "|u|",
    "negate": "−u",
    "exp": "exp u",
    "10^u": "10ᵘ",
    "log": "ln u",
    "log10": "log u",
}


def function_sign(name: str) -> Words:
    """An elementary function of u."""
    return Words(_FUNCTIONS.get(name, f"{name}(u)"), italic=True)
