"""Every function of the table: the same values from numbers, from constants and from symbols."""

from __future__ import annotations

import random
import re
import runpy
from pathlib import Path

import casadi
import numpy as np
import pytest
from casadi import SX

from armblocks.errors import ArmblocksError, InputError, UnknownNameError
from armblocks.formats import read_script
from armblocks.matlab.arrays import Budget, scalar
from armblocks.matlab.evaluation import Evaluator
from armblocks.matlab.formula import Formula
from armblocks.matlab.functions import RESERVED, TABLE
from armblocks.matlab.number_functions import FUNCTIONS_OF_NUMBERS
from armblocks.matlab.numbers import NumberOrText, Numbers
from armblocks.matlab.operators import INFIX, Level
from armblocks.matlab.parser import parse_formula
from armblocks.matlab.source import formula_source

DOCS = Path(__file__).resolve().parents[2] / "docs"
ARGUMENTS = {
    **dict.fromkeys(("diag", "inv", "transpose", "trace"), ("A",)),
    **dict.fromkeys(("sum", "prod", "mean", "any", "all", "size"), ("A", "2")),
    **dict.fromkeys(("power", "pow"), ("abs(v)", "w")),
    **dict.fromkeys(("cross", "dot"), ("v", "w")),
    **dict.fromkeys(("transl", "SE3"), ("v",)),
    **dict.fromkeys(("zeros", "ones", "eye"), ("2", "3")),
    "linspace": ("-1", "2.5", "7"),
    "norm": ("v",),
    "if": ("v > 0", "v", "w"),
    **dict.fromkeys(("rotx", "roty", "rotz", "trotx", "troty", "trotz"), ("k",)),
}
"""Arguments of the functions that do not accept vectors."""


def numbers(name: str, draw: random.Random) -> dict[str, np.ndarray]:
    """Random values of the names in ``ARGUMENTS``, in the interval in which a function is real."""
    low, high = max(TABLE[name].real_from, -3.0), min(TABLE[name].real_to, 3.0)
    two = [np.array([[draw.uniform(low, high) for _ in range(3)]]) for _ in range(2)]
    matrix = np.array([[draw.uniform(-2, 2) + 4 * (i == j) for j in range(3)] for i in range(3)])
    return {"v": two[0], "w": two[1], "A": matrix, "k": scalar(draw.uniform(-3, 3))}


def literal(array: np.ndarray) -> str:
    """An array as text."""
    return "[" + "; ".join(" ".join(map(repr, row)) for row in array.tolist()) + "]"


@pytest.mark.parametrize("name", [name for name in TABLE if TABLE[name].max_arguments])
def test_numbers_constants_and_symbols_have_the_same_values(name: str) -> None:
    draw = random.Random(name)
    arguments = ARGUMENTS.get(name) or ("v", "w")[: TABLE[name].arguments.count(",") + 1]
    text = f"{name}({', '.join(arguments)})"
    for _ in range(3):
        values = numbers(name, draw)
        script = "".join(f"{key} = {literal(value)}; " for key, value in values.items())
        by_script = np.asarray(read_script(f"{script}x = {text};".encode(), "x.m").variables["x"], float)
        constants = {key: SX(value.ravel() if 1 in value.shape else value) for key, value in values.items()}
        by_constants = casadi.evalf(Formula(text, "here").trace(constants)).full()
        symbols = {key: SX.sym(key, *value.shape) for key, value in constants.items()}
        traced = casadi.Function("f", list(symbols.values()), [Formula(text, "here").trace(symbols)])
        by_symbols = traced(*(casadi.evalf(value) for value in constants.values())).full()
        if 1 in by_constants.shape or 1 in by_script.shape:
            by_script, by_constants, by_symbols = by_script.ravel(), by_constants.ravel(), by_symbols.ravel()
        if name == "inv":  # two algorithms
            np.testing.assert_allclose(by_constants, by_script, rtol=1e-13, atol=1e-14)
        else:
            np.testing.assert_array_equal(by_constants, by_script)
        np.testing.assert_allclose(by_symbols, by_script, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("mod(-1, 3)", 2.0),
        ("mod(5, -3)", -1.0),
        ("mod(5, 0)", 5.0),
        ("rem(-5, 3)", -2.0),
        ("round(-2.5)", -3.0),
        ("round(0.49999999999999994)", 0.0),
        ("fix(-2.7)", -2.0),
        ("sign(-3)", -1.0),
        ("xor(1, 0) + xor(2, 3)", 1.0),
        ("and(2, 0) + or(2, 0) + not(0)", 2.0),
        ("any([0 0 1]) + all([1 0])", 1.0),
        ("max([3 1 2]) - min([3 1 2])", 2.0),
        ("max(nan, 2)", 2.0),
        ("norm(max([1 5; 3 4], [], 2)' - [5 4]) + norm(min([1 5; 3 4], [], 1) - [1 4])", 0.0),
        ("numel(5:0:1) + numel(1:0:5)", 0.0),
        ("prod([2 3 4])", 24.0),
        ("mean([1 2 6])", 3.0),
        ("sum(mean([1 2; 3 4]))", 5.0),
        ("norm([3 4])", 5.0),
        ("norm([1 2; 2 4], 'fro')", 5.0),
        ("norm(sum([1 2; 3 4; 5 6], 1)  - [9 12])", 0.0),
        ("norm(sum([1 2; 3 4; 5 6], 2)' - [3 7 11])", 0.0),
        ("norm(prod([1 2; 3 4], 2)' - [2 12])", 0.0),
        ("norm(any([0 0; 0 2], 2)' - [0 1])", 0.0),
        ("10*size([1 2; 3 4; 5 6], 1) + size([1 2; 3 4; 5 6], 2)", 32.0),
        ("linspace(3, 5, 1)", 5.0),
        ("numel(0:1:1-1e-11)", 1.0),
        ("numel(0:0.1:1) + numel(1:-0.1:0) + numel(-0.3:0.1:0.3)", 29.0),
        ("numel(5:-2:0)*10 + (5:-2:0)(3)", 31.0),
        ("inf - inf == inf - inf", 0.0),
        ("nan == nan", 0.0),
        ("(0*inf > 0) + (0*inf < 0) + (0*inf == 0)", 0.0),
        ("dot([1 2 3], [4 5 6])", 32.0),
        ("sum(cross([1 0 0], [0 1 0]) == [0 0 1])", 3.0),
        ("trace([1 2; 3 4])", 5.0),
        ("length([1 2; 3 4; 5 6])", 3.0),
        ("sum(size([1 2; 3 4]))", 4.0),
        ("sum(sum(trotx(90, 'deg') == trotx(pi/2)))", 16.0),
        ("sum(transl(transl(1, 2, 3)) == [1; 2; 3])", 3.0),
        ("sum(sum(rotz(0.3)'*rotz(0.3))) > 2.999", 1.0),
        ("sum(sum(SE3() == eye(4)))", 16.0),
        ("sum(zeros(1, 2)) + zeros + eye", 1.0),
        ("numel(linspace(0, 1))", 100.0),
        ("eps == 2^-52", 1.0),
        ("true + false", 1.0),
        ("90*deg == deg2rad(90)", 1.0),
        ("inf > 1e300", 1.0),
    ],
)
def test_values_are_those_of_matlab(text: str, value: float) -> None:
    actual = read_script(f"x = {text};".encode(), "x.m").variables["x"]
    assert np.ravel(actual).tolist() == [value]
    assert casadi.evalf(Formula(text, "here").trace({})).full().ravel().tolist() == [value]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("sum([1 2 3], 1)", [[1.0, 2.0, 3.0]]),
        ("sum([1 2 3], 2)", [[6.0]]),
        ("any([0; 2], 2)", [[0.0], [1.0]]),
        ("mean([1; 3], 1)", [[2.0]]),
        ("sum(zeros(0, 3))", [[0.0, 0.0, 0.0]]),
        ("size([1 2 3], 2)", [[3.0]]),
        ("[5 6 7]([1 2; 3 1])", [[5.0, 6.0], [7.0, 5.0]]),
        ("[5; 6; 7]([1 3])", [[5.0], [7.0]]),
        ("(5)([1; 1; 1])", [[5.0], [5.0], [5.0]]),
        ("[1 2; 3 4]([4 1])", [[4.0, 1.0]]),
        ("[3 4 5]([3 4 5] > 3)", [[4.0, 5.0]]),
        ("[3 4]([3 4] > 0)", [[3.0, 4.0]]),
        ("[3; 4]([true true])", [[3.0], [4.0]]),
        ("[1 2; 3 4]([1 2; 3 4] > 1)", [[3.0], [2.0], [4.0]]),
        ("[1 2; 3 4](~[0 1], :)", [[1.0, 2.0]]),
        ("[1 2; 3 4](any([1 0; 0 0]), 1)", [[1.0]]),
        ("sum([3 4] > 3) + ([3 4] > 3)", [[1.0, 2.0]]),
        ("[1 2; 3 4]^-2*[1 2; 3 4]^2 - eye(2) < 1e-12", [[1.0, 1.0], [1.0, 1.0]]),
    ],
)
def test_arrays_of_scripts_have_the_shapes_of_matlab(text: str, value: list[list[float]]) -> None:
    actual = read_script(f"x = {text};".encode(), "x.m").variables["x"]
    assert np.asarray(actual, dtype=float).tolist() == value


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("u'*u", r"a transposed vector and a vector are combined by '\*'.*dot\(v, w\)"),
        ("u*u'", "a transposed vector"),
        ("u'*A*u", r"a row of a matrix or product and a vector.*dot\(v, A\*w\)"),
        ("u*A*u", "a row of a matrix or product"),
        ("-A(1, :)*u", "a row of a matrix"),
        ("sum(A)*u", "a row of a matrix"),
        ("(2*diag(A) + 1)*u", "a column of a matrix"),
        ("A(:, 1)/A(:, 2)", "a column of a matrix"),
        ("[A(:, 2) A(:, 1)]", "a column of a matrix, or a matrix times a vector, is combined"),
        ("[A*u; u]", "a column of a matrix, or a matrix times a vector, is combined"),
        ("u(:, 1)", "a vector has two indices, but is neither row nor column"),
        ("u(1, end)", "a vector has two indices"),
        ("sum(u, 2)", "a vector of a formula is neither row nor column"),
        ("sum(A, 3)", "the dimension is not 1 or 2"),
        ("norm(A)", "would be its largest singular value"),
        ("A^0.5", "the power of a matrix is not supported for this exponent"),
        ("u^A", "a power of a matrix|the power of a matrix"),
        ("A^3^B", "the power of a matrix is not supported"),
        ("u([1 2 3] > 0)", "an index is a comparison or a logical value"),
        ("u(true)", "an index is a comparison or a logical value"),
    ],
)
def test_formulas_whose_value_depends_on_the_orientation_of_a_vector_are_refused(
    text: str, message: str
) -> None:
    symbols = {"A": SX.sym("A", 3, 3), "B": SX.sym("B", 3, 3), "u": SX.sym("u", 3)}
    with pytest.raises(InputError, match=f"(?s){message}"):
        Formula(text, "here").trace(symbols)


def test_vectors_of_formulas_take_two_indices_where_one_of_them_is_1() -> None:
    actual = Formula("[v(2, 1), v(1, 3), A(2, :)(1, 2), A(:, 2)(3, 1), A(:, 2)'(1, 3)]", "here").trace(
        {"v": SX([4.0, 5.0, 6.0]), "A": SX(np.arange(9.0).reshape(3, 3))}
    )
    assert casadi.evalf(actual).full().ravel().tolist() == [5.0, 6.0, 4.0, 7.0, 7.0]


def test_wrong_arguments_are_refused_with_a_message() -> None:
    invalid = ("", "[]", "'a'", "1, 'a'", "[1 2; 3 4], [1 2 3]", "1, 2, 3, 4", "[1 2], [3; 4]", "inf, -1")

    def by_numbers(text: str) -> object:
        return read_script(f"x = {text};".encode(), "x.m")

    def by_symbols(text: str) -> object:
        return Formula(text, "here").trace({})

    for text in (f"{name}({arguments})" for name in TABLE for arguments in invalid):
        for evaluated in (by_numbers, by_symbols):
            try:
                evaluated(text)
            except ArmblocksError as error:
                assert error.allowed, text


def test_every_entry_is_documented() -> None:
    for name, function in TABLE.items():
        assert name.isidentifier()
        assert function.meaning and function.group, name
        assert function.max_arguments == 0 or function.arguments.count(",") + 1 == function.max_arguments, (
            name
        )
        assert function.min_arguments <= function.max_arguments
        assert function.elementwise or name not in FUNCTIONS_OF_NUMBERS or name in ("any", "all")
    assert {"sin", "pi", "sum"} <= RESERVED
    assert not {"length", "round", "mean", "size", "eps"} & RESERVED


def test_the_documentation_has_all_functions_and_operators() -> None:
    tables = runpy.run_path(str(DOCS / "function_tables.py"))["function_tables"]()
    rows = [re.split(r"(?<!\\)\|", line) for line in tables.splitlines() if line.startswith("| `")]
    assert {len(row) for row in rows} == {4}
    assert "| | |" not in tables  # every column has a heading
    assert {re.split(r"[`(]", row[1].strip())[1] for row in rows} == set(TABLE)
    page = (DOCS / "formulas.md").read_text(encoding="utf-8").replace("\\|", "∨")
    table = [line.split("|")[1].replace("∨", "|") for line in page.splitlines() if line.startswith("| `")]
    spans = [re.findall("`([^`]+)`", row) for row in table if "(" not in row]
    listed = [[":"] if "a:b" in row else row for row in spans if not row[0].isalpha()]
    assert {operator for row in listed for operator in row} == {*INFIX, "~"}
    levels = [INFIX[row[0]] if "~" not in row else Level.SIGN for row in listed]
    assert levels == sorted(levels, reverse=True)
    assert all(INFIX[operator] == INFIX[row[0]] for row in listed if "~" not in row for operator in row)


def test_a_name_hides_a_function_that_is_not_reserved() -> None:
    length = Formula("length + length(2)*size([1 2 3])(2)", "here")
    assert length.names == {"length"}
    assert length.readable_names == {"length", "size"}
    actual = length.trace({"length": SX([4.0, 5.0])})
    assert casadi.evalf(actual).full().ravel().tolist() == [9.0, 10.0]  # a vector of a formula is a column
    assert Formula("length([1 2 3])", "here").names == frozenset()


def test_plain_numbers_are_evaluated_without_objects() -> None:
    def value(text: str) -> object:
        source = formula_source(text, "here")
        variables: dict[str, NumberOrText] = {"a": scalar(3.0)}
        return Evaluator(source, Numbers(Budget()), variables).value(parse_formula(source))

    assert np.ravel(value("a + [1 2](2)")).tolist() == [5.0]  # pyright: ignore
    assert value("['a' 'b']") == "ab"
    with pytest.raises(UnknownNameError, match=r"there is no function named 'sni'.*did you mean 'sin'"):
        value("sni(a)")
    with pytest.raises(InputError, match=r"a cell array is not a number.*Allowed: \[a b; c d\]"):
        value("{a}")
    with pytest.raises(InputError, match=r"\{\} is used on a number"):
        value("a{1}")
    with pytest.raises(InputError, match=r"'end' and ':' are used outside of an index"):
        value("sin(:)")


def test_long_lines_are_quoted_around_the_error() -> None:
    text = "1 + " * 60 + "* 2 " + "+ 1" * 60
    with pytest.raises(InputError, match=r"in column 241: … \+ 1 \+ .*\+ »\* 2 \+.* …\. Allowed") as caught:
        Formula(text, "here")
    assert len(re.sub(".*column 241: ", "", caught.value.what)) <= 106
