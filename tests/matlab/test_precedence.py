"""Operator precedence, signs and blanks in matrices are those of MATLAB, for numbers and symbols."""

from __future__ import annotations

import math
import operator
import random
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass

import casadi
import numpy as np
import pytest
from casadi import SX

from armblocks.errors import ArmblocksError
from armblocks.formats import read_script
from armblocks.matlab.formula import Formula
from armblocks.matlab.parser import parse_formula
from armblocks.matlab.source import Position, formula_source
from armblocks.matlab.spelling import spelling


def by_formula(text: str) -> np.ndarray:
    """The value of a formula without names."""
    return np.atleast_1d(casadi.evalf(Formula(text, "here").trace({})).full().squeeze())


def by_script(text: str) -> np.ndarray:
    """The value of the same text in a script, which is evaluated with numbers only."""
    variables = read_script(f"x = {text};".encode(), "here.m").variables
    return np.atleast_1d(np.asarray(variables["x"], dtype=float).squeeze())


def by_symbols(text: str) -> float:
    """The value of a formula whose numbers are symbols, so that no operand is a constant."""
    numbers: list[float] = []

    def symbol_name(actual: re.Match[str]) -> str:
        numbers.append(float(actual[0]))
        return f"x{len(numbers)}x"

    formula = Formula(re.sub(r"(?<![\w.])(\d+\.?\d*|\.\d+)(e\d+)?", symbol_name, text), "here")
    symbols = {f"x{k}x": SX.sym(f"x{k}") for k in range(1, len(numbers) + 1)}
    value = casadi.Function("f", list(symbols.values()), [formula.trace(symbols)])
    return float(value(*numbers))


# The values that MATLAB's documentation of operator precedence gives, or that follow from its rules.
@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2^2^2^2", 256.0),
        ("2^3^2", 64.0),
        ("2**3**2", 64.0),
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
        ("([1 2; 3 4]^2')(1, 2)", 15.0),  # (A^2)'
        ("([1 2; 3 4].^-2')(1, 2)", 1 / 9),
        ("([1 2; 3 4]^(2'))(1, 2)", 10.0),
        ("sum([2^2' 1])", 5.0),
        ("1 - 2 - 3", -4.0),
        ("8/2/2", 2.0),
        ("2\\8", 4.0),
        ("-3 - -3^2", 6.0),
        ("~2 + 1", 1.0),  # (~2) + 1
        ("~2 == 0", 1.0),  # (~2) == 0
        ("not 2 == 0", 1.0),  # Python's word: not (2 == 0)
        ("not(2) == 0", 1.0),  # MATLAB's function: (not(2)) == 0
        ("not(3) > -1", 1.0),
        ("not (3) > -1", 0.0),
        ("~not 3", 1.0),
        ("-~0", -1.0),
        ("2^~0", 2.0),
        ("1 + 1 < 1 * 3", 1.0),
        ("1 < 2 == 1 < 2 || 0", None),
        ("0 || 1 && 0", 0.0),
        ("1 | 0 & 0", 1.0),
        ("1 || 1 | 0 && 0", 1.0),
        ("0 && 1 | 1", 0.0),  # 0 && (1 | 1)
        ("2 == 2 & 3 > 2", 1.0),
        ("1 and 0 or 1", 1.0),
        ("max(2, 3) ~= 3", 0.0),
        ("3 != 2", 1.0),
        ("5.*2", 10.0),
        ("5.**2", 25.0),
        ("5.'", 5.0),
        ("1e3 + 1E3 + .5", 2000.5),
        ("0x1F + 0b101 + 0o17", 51.0),
        ("1_000 - 007", 993.0),
        ("1 + ...\n 2", 3.0),
        ("sum([1 -2])", -1.0),
        ("numel([1 - 2])", 1.0),
        ("numel([1 -2 + 3, 4])", 3.0),
        ("numel([1 , -2; 3 4]')", 4.0),
        ("sum(1:3 + 1)", 10.0),  # 1:(3 + 1)
        ("sum(0:0.5:1)", 1.5),
        ("numel(3:1)", 0.0),
        ("[4 5 6](end)", 6.0),
        ("sum([4 5 6](2:end))", 11.0),
        ("[1 2; 3 4](2)", 3.0),  # columns first
        ("[1 2; 3 4](1, 2)", 2.0),
        ("sum([1 2; 3 4](:, 1))", 4.0),
        ("sum([1 2; 3 4](:))", 10.0),
        ("sum([1 2 3].T)", 6.0),
    ],
)
def test_operators_bind_as_in_matlab(text: str, value: float | None) -> None:
    if value is None:
        with pytest.raises(ArmblocksError, match=r"comparisons cannot be chained.*a < b && b < c"):
            by_formula(text)
        return
    assert by_formula(text).tolist() == [value]
    assert by_script(text).tolist() == [value]


def test_powers_of_vectors_are_elementwise() -> None:
    assert by_formula("[1 2 4].^2.^-1").tolist() == [1.0, 0.25, 0.0625]
    assert by_formula("[1 -2 3]'.^2").tolist() == [1.0, 4.0, 9.0]


def random_expression(draw: random.Random, depth: int) -> str:
    """A random expression of numbers, all operators, brackets, transposes and functions."""
    if depth == 0 or draw.random() < 0.15:
        number = draw.choice(["1", "2", "3", "0", "0.5", "1.5", ".25", "2e0"])
        return number + draw.choice(["", "", "", "'", ".'"])
    kind = draw.random()
    left, right = random_expression(draw, depth - 1), random_expression(draw, depth - 1)
    blank = draw.choice(["", " "])
    if kind < 0.3:
        sign = draw.choice(["", "", "-", "+", "--", "- +", "~"])
        return f"{left}{blank}{draw.choice(['^', '.^', '**'])}{blank}{sign}{right}"
    if kind < 0.55:
        return f"{left}{blank}{draw.choice(['+', '-', '*', '/', '.*', './'])}{blank}{right}"
    if kind < 0.62:
        return f"{left} {draw.choice(['<', '<=', '>', '>=', '==', '~=', '!='])} {right}"
    if kind < 0.72:
        return f"{left} {draw.choice(['&', '|', '&&', '||', 'and', 'or'])} {right}"
    if kind < 0.8:
        return f"{draw.choice('-~!')}{left}"
    if kind < 0.95:
        return f"({left}){draw.choice(['', '', chr(39)])}"
    return f"abs({left})"


# An independent evaluator: two stacks, as by Dijkstra, with its own table of precedences.

_TOKEN = re.compile(r"(\d+\.?\d*|\.\d+)(?:e\d+)?|\*\*|\.[*/^']|[<>=~!]=|&&|\|\||[-+*/^<>&|~!()']|\w+")
_BINDING = {
    **dict.fromkeys(("||", "or"), 1),
    **dict.fromkeys(("&&", "and"), 2),
    "|": 3,
    "&": 4,
    **dict.fromkeys(("<", "<=", ">", ">=", "==", "~=", "!="), 5),
    **dict.fromkeys(("+", "-"), 6),
    **dict.fromkeys(("*", "/", ".*", "./"), 7),
    "sign": 8,
    **dict.fromkeys(("^", ".^", "**"), 9),
    "sign of an exponent": 10,
}
_MEANING: dict[str, Callable[[float, float], float]] = {
    **dict.fromkeys(("||", "or", "|"), lambda a, b: float(a != 0 or b != 0)),
    **dict.fromkeys(("&&", "and", "&"), lambda a, b: float(a != 0 and b != 0)),
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    **dict.fromkeys(("~=", "!="), operator.ne),
    "+": operator.add,
    "-": operator.sub,
    **dict.fromkeys(("*", ".*"), operator.mul),
    **dict.fromkeys(("/", "./"), lambda a, b: float(np.float64(a) / np.float64(b))),
    **dict.fromkeys(("^", ".^", "**"), lambda a, b: float(np.power(np.float64(a), b))),
}


class TwoStacks:
    """Operands and pending operators of one expression."""

    def __init__(self) -> None:
        self.values: list[float] = []
        self.pending: list[tuple[str, str]] = []

    def reduce(self, binding: int) -> None:
        """Apply the pending operators of this precedence or a higher one."""
        while self.pending and self.pending[-1][0] != "(" and _BINDING[self.pending[-1][0]] >= binding:
            kind, sign = self.pending.pop()
            right = self.values.pop()
            if kind.startswith("sign"):
                self.values.append({"-": -right, "+": right}.get(sign, float(right == 0)))
            else:
                self.values.append(float(_MEANING[kind](self.values.pop(), right)))


def by_two_stacks(text: str) -> float:
    """The value of a text of :func:`random_expression`; raises ``ValueError`` for chained comparisons."""
    stacks, before = TwoStacks(), "("
    for match in _TOKEN.finditer(text):
        token = match[0]
        operand_before = before not in ("(", "operator")
        if token[0].isdigit() or (token[0] == "." and token[1:2].isdigit()):
            stacks.values.append(float(token))
            before = "operand"
        elif token in ("'", ".'", "abs"):
            pass
        elif token == "(":
            name = "abs" if text[: match.start()].endswith("abs") else ""
            stacks.pending.append(("(", name))
            before = "("
        elif token == ")":
            stacks.reduce(0)
            if stacks.pending.pop()[1] == "abs":
                stacks.values.append(abs(stacks.values.pop()))
            before = "operand"
        elif token in "-+~!" and not operand_before:
            above = stacks.pending[-1][0] if stacks.pending else ""
            exponent = above in ("^", ".^", "**", "sign of an exponent")
            stacks.pending.append(("sign of an exponent" if exponent else "sign", token))
            before = "operator"
        else:
            stacks.reduce(_BINDING[token])
            if _BINDING[token] == 5 and re.search(r"[<>=~!]=|[<>]", _since_bracket(text, match.start())):
                raise ValueError("a comparison of a comparison")
            stacks.pending.append((token, ""))
            before = "operator"
    stacks.reduce(0)
    return stacks.values.pop()


def _since_bracket(text: str, end: int) -> str:
    """The text before a comparison up to where its left operand begins."""
    depth, k = 0, end - 1
    while k >= 0 and not (depth == 0 and text[k] in "(&|"):
        depth += {")": 1, "(": -1}.get(text[k], 0)
        if depth == 0 and re.match(r"(and|or)\b", text[k:]) and text[k - 1] == " ":
            break
        k -= 1
    inside, shown = 0, ""
    for mark in text[k + 1 : end]:
        inside += mark == "("
        shown += mark if not inside else ""
        inside -= mark == ")"
    return shown


def shape_of(tree: object) -> object:
    """A syntax tree without positions."""
    if is_dataclass(tree):
        parts = [getattr(tree, entry.name) for entry in fields(tree)]
        return (type(tree).__name__, *(shape_of(part) for part in parts if not isinstance(part, Position)))
    return tuple(map(shape_of, tree)) if isinstance(tree, tuple) else tree  # pyright: ignore


def test_random_expressions_have_the_values_of_an_independent_evaluator() -> None:
    draw = random.Random(20)
    compared = refused = 0
    for _ in range(300):
        text = random_expression(draw, 4)
        with np.errstate(all="ignore"):
            try:
                expected = by_two_stacks(text)
            except ValueError:
                with pytest.raises(ArmblocksError, match="comparisons cannot be chained"):
                    by_formula(text)
                refused += 1
                continue
        tree = parse_formula(formula_source(text, "here"))
        assert shape_of(parse_formula(formula_source(spelling(tree), "here"))) == shape_of(tree), text
        if not math.isfinite(expected) or abs(expected) > 1e200:
            continue
        actual = by_formula(text)[0]
        # Powers of the C library differ in the last place; later powers increase the difference.
        assert actual == pytest.approx(expected, rel=1e-9, abs=1e-300), text
        assert by_symbols(text) == pytest.approx(expected, rel=1e-9, abs=1e-300), text
        try:
            by_numbers = by_script(text)[0]
        except ArmblocksError as error:  # a complex value in a part without effect on the result
            assert "complex" in str(error)
        else:
            assert by_numbers == actual or abs(by_numbers) == abs(actual) == 0.0, text
            compared += 1
    assert compared > 120
    assert refused > 5


def test_values_agree_with_python_for_expressions_with_the_same_grammar() -> None:
    draw = random.Random(21)
    compared = 0
    for _ in range(400):
        text = "".join(
            f"{draw.choice(['', '-'])}{draw.choice(['1', '2.5', '(3 - 0.5)', '2 ** 2'])} "
            f"{draw.choice(['+', '-', '*', '/', '+', 'and', 'or', '== 1 and', '< 2 or not', '!= 3 or'])} "
            for _ in range(draw.randint(1, 5))
        )
        text += "2"
        logical = any(word in text for word in ("and", "or"))
        expected = eval(text)  # noqa: S307 (a text made here)
        actual = by_formula(text)[0]
        assert bool(actual) == bool(expected) if logical else actual == pytest.approx(expected, rel=1e-15), (
            text
        )
        compared += 1
    assert compared == 400


def arrays(draw: random.Random, kind: str, depth: int) -> str:
    """A random expression that is a number (n), a vector of 3 (v) or a 3x3 matrix (m), rows in scripts."""
    number = draw.choice(["2", "-1", "0.5", "3"])
    if depth == 0:
        row = f"[1 -{number.lstrip('-')}, {number}]"
        return {"n": number, "v": row, "m": f"[1 2 {number};{row};0 1 -1]"}[kind]
    a, b = arrays(draw, kind, depth - 1), arrays(draw, kind, depth - 1)
    n, m = arrays(draw, "n", depth - 1), arrays(draw, "m", depth - 1)
    same_shape = [f"({a}) {draw.choice(['+', '-', '.*'])} {b}", f"({n}) * ({a})", f"-({a})", f"({a}) + {n}"]
    same_shape += [f"max({a}, {b})", f"({a}) < ({b})", f"~({a})", f"mod({a}, 3)", f"if({a}, {a}, {b})"]
    v = arrays(draw, "v", depth - 1)
    own = {
        "n": [f"sum({v})", f"({v})(2)", f"({m})(2, 3)", f"norm({v})", f"dot({v}, {v})", f"numel({m})"],
        "v": [f"sum({m})", f"({m})(2, :)", f"({v}) * ({m})", f"[{n}, ({v})(2:end)]", f"cross({v}, {v})"],
        "m": [f"({m}) * ({a})", f"({a})'", f"[{v}; {v}; {v}]", f"diag({v})", f"eye(3) + {a}"],
    }[kind]
    choices = {
        "n": [f"size({m}, 2)"],
        "v": [f"sum({m}, 1)", f"sum({m}, 2)'"],
        "m": [f"({m})^2", f"({m}).^2'"],
    }
    own += choices[kind]
    return draw.choice([*same_shape, *own, *own])


def test_arrays_of_numbers_and_of_symbols_agree() -> None:
    draw = random.Random(22)
    for k in range(150):
        text = arrays(draw, "nvm"[k % 3], 2)
        expected = read_script(f"x = {text};".encode(), "here.m").variables["x"]
        actual = casadi.evalf(Formula(text, "here").trace({})).full()
        if 1 in np.shape(expected):
            expected, actual = np.ravel(expected), actual.ravel()  # vectors of formulas have no orientation
        np.testing.assert_allclose(actual, np.asarray(expected, float), rtol=1e-14, atol=1e-14, err_msg=text)
