"""Formulas give MATLAB's numbers: powers go from the left, signs behind ^ belong to the operand."""

from __future__ import annotations

import math
import random

import casadi
import numpy as np
import pytest

from armblocks.diagram.expression_language import Formula
from armblocks.formats.matlab_script import read_script


def by_formula(text: str) -> np.ndarray:
    """The value of a formula without names."""
    return np.atleast_1d(casadi.evalf(Formula(text, "here").trace({})).full().squeeze())


def by_matlab(text: str) -> np.ndarray:
    """The value of the same text in the reader of MATLAB scripts, which has its own grammar."""
    variables = read_script(f"x = {text};".encode(), "here.m").variables
    return np.atleast_1d(np.asarray(variables["x"], dtype=float).squeeze())


# The values that MATLAB's documentation of operator precedence gives, or that follow from its rules.
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2^2^2^2", 256.0),
        ("2^3^2", 64.0),
        ("2^(3^2)", 512.0),
        ("(2^3)^2", 64.0),
        ("2^(3)^2", 64.0),
        ("2^((3^2))", 512.0),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("2^-1", 0.5),
        ("2^-1^2", 0.25),
        ("2^-(1^2)", 0.5),
        ("2^--1^2", 4.0),
        ("2^-+2^-1", 4.0),
        ("2^(-3)^2", 1 / 64),
        ("-2^-2^-1", -4.0),
        ("2*3^2^0.5", 6.0),
        ("2 .^ 3 .^ 2", 64.0),
        ("abs(-2)^2^3", 64.0),
        ("2^2'^3", 64.0),
        ("2'", 2.0),
        ("2.5.'", 2.5),
        ("2^-2'", 0.25),
        ("1 - 2 - 3", -4.0),
        ("8/2/2", 2.0),
        ("-3 - -3^2", 6.0),
    ],
)
def test_powers_are_those_of_matlab(text: str, value: float) -> None:
    assert by_formula(text).tolist() == [value]
    assert by_matlab(text).tolist() == [value]


def test_powers_of_vectors_go_by_element() -> None:
    assert by_formula("[1 2 4].^2.^-1").tolist() == [1.0, 0.25, 0.0625]
    assert by_formula("[1 -2 3]'.^2").tolist() == [1.0, 4.0, 9.0]


def written(draw: random.Random, depth: int) -> str:
    """A random expression of numbers, signs, powers, products, sums, brackets, transposes and functions."""
    if depth == 0 or draw.random() < 0.15:
        number = draw.choice(["1", "2", "3", "0.5", "1.5", ".25", "2e0"])
        return number + draw.choice(["", "", "", "'", ".'"])
    kind = draw.random()
    left, right = written(draw, depth - 1), written(draw, depth - 1)
    blank = draw.choice(["", " "])
    if kind < 0.45:
        sign = draw.choice(["", "", "-", "+", "--", "- +"])
        return f"{left}{blank}{draw.choice(['^', '.^'])}{blank}{sign}{right}"
    if kind < 0.7:
        return f"{left}{blank}{draw.choice(['+', '-', '*', '/', '.*', './'])}{blank}{right}"
    if kind < 0.8:
        return f"-{left}"
    if kind < 0.95:
        return f"({left}){draw.choice(['', '', chr(39)])}"
    return f"{draw.choice(['cos', 'exp', 'abs'])}({left})"


def test_random_expressions_have_the_values_of_the_matlab_reader() -> None:
    draw = random.Random(20)
    compared = 0
    for _ in range(600):
        text = written(draw, 4)
        expected = by_matlab_or_none(text)
        if expected is None:
            continue
        found = by_formula(text)[0]
        # Both take the library's powers; a few units in the last place each, made greater by later powers.
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-300), text
        compared += 1
    assert compared > 400


def by_matlab_or_none(text: str) -> float | None:
    """The reader's value where that is a real, finite number: others are refused or differ by design."""
    try:
        with np.errstate(all="ignore"):
            value = float(by_matlab(text)[0])
    except ValueError:
        return None
    return value if math.isfinite(value) and abs(value) < 1e200 else None
