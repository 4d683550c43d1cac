"""Formulas for values: arrays as MATLAB writes them, the matrix product, and nothing that is code."""

from __future__ import annotations

import math

import numpy as np
import pytest

from armblocks.diagram import REQUIRED, Parameter, ParameterKind
from armblocks.diagram.mask import formula_names, formula_value
from armblocks.errors import ArmblocksError, InputError, UnknownNameError

ANY_ARRAY = Parameter(
    name="p", kind=ParameterKind.ARRAY, doc="a value", default=REQUIRED, roots=True, finite=False
)
SCOPE = {"k": 2.0, "v": (1.0, 2.0, 3.0), "A": ((1.0, 2.0), (3.0, 4.0)), "n": 3, "on": True, "word": "either"}


def value(text: str, rule: Parameter = ANY_ARRAY) -> object:
    return formula_value(rule, text, SCOPE, "block 'b'")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[1 2; 3 4]*k", [[2, 4], [6, 8]]),
        ("[1 2; 3 4]'", [[1, 3], [2, 4]]),
        ("A'*A", [[10, 14], [14, 20]]),
        ("A*[1 2]", [5, 11]),
        ("[1 2]*A", [7, 10]),
        ("A .* A - A./A", [[0, 3], [8, 15]]),
        ("inv(A)*A", [[1, 0], [0, 1]]),
        ("v*v", [1, 4, 9]),  # element by element, unlike MATLAB, which refuses two rows
        ("v.^2 + 1", [2, 5, 10]),
        ("[v; v]", [[1, 2, 3], [1, 2, 3]]),
        ("[v 4]", [1, 2, 3, 4]),
        ("[1; 2; 3]", [1, 2, 3]),
        ("[k -1]", [2, -1]),
        ("[k - 1]", 1),
        ("[k -1 + 3]", [2, 2]),
        ("[k, -v(2)  max(1, 3)]", [2, -2, 3]),
        ("[1 2 3]' ", [1, 2, 3]),
        ("[0:0.1:0.3]", [0, 0.1, 0.2, 0.3]),
        ("[1:n]", [1, 2, 3]),
        ("[3:-1:1]", [3, 2, 1]),
        ("eye(2)*k", [[2, 0], [0, 2]]),
        ("zeros(1, n) + ones(n, 1)", [1, 1, 1]),
        ("zeros(2) + 1", [[1, 1], [1, 1]]),
        ("linspace(0, 1, 3)", [0, 0.5, 1]),
        ("diag([1 2])", [[1, 0], [0, 2]]),
        ("diag(A)", [1, 4]),
        ("sum(v) + norm([3 4])", 11),
        ("90*deg - deg2rad(90) + rad2deg(pi)", 180),
        ("-inf", -math.inf),
        ("[]", []),
        ("if(k > 1, v, -v)", [1, 2, 3]),
        ("!(k < 1) && on", 1),
    ],
)
def test_values_are_those_of_linear_algebra(text: str, expected: object) -> None:
    assert np.asarray(value(text)) == pytest.approx(np.asarray(expected, dtype=float), rel=1e-15, abs=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "open('/etc/passwd')",
        "k.__class__",
        "(lambda: 1)()",
        "[k for k in v]",
        "'text'",
        "k if k else k",
        "A @ A",
        "A // A",
        "k.T.__class__",
        "exec(k)",
        "v[-1]",
    ],
)
def test_code_is_no_formula(text: str) -> None:
    with pytest.raises(ArmblocksError) as found:
        value(text)
    assert "block 'b', parameter 'p'" in str(found.value)
    assert "Allowed: " in str(found.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1 2", r"a bracket '\[' is not closed.*one '\]' for each"),
        ("[" * 40 + "]" * 40, "brackets are nested too deeply"),
        ("[1 2; 3]", "the rows of an array have 2, 1 numbers"),
        ("[A 1]", "a matrix is inside brackets"),
        ("A*v", "a matrix of 2 x 2 is multiplied by one of 3 x 1.*as many columns"),
        ("A + v", "arrays of 2 x 2 and 3 x 1 numbers are combined"),
        ("A^2", "powers of matrices are not supported"),
        ("v/A", r"the divisor is a matrix.*inv\(A\)"),
        ("A[1]", r"'A\[1\]' is an element of a matrix"),
        ("inv([1 2 3; 4 5 6])", "a 2 x 3 matrix has no inverse"),
        ("eye(1.5)", "eye: 1.5 is not a number of elements"),
        ("zeros(1000, 1000)", "1e.06 is not a number of elements"),
        ("eye(1, 2)", "eye: 2 numbers are given"),
        ("[0:0:1]", "a range: the steps do not lead"),
        ("eye(v)", "the size of an array made by eye is not constant"),
        ("word*2", "'word' is str, which is not a number.*write word alone"),
    ],
)
def test_messages_say_what_does_not_fit(text: str, message: str) -> None:
    with pytest.raises(InputError, match=f"(?s)block 'b', parameter 'p': .*{message}"):
        value(text)


def test_kinds_follow_the_parameter() -> None:
    def rule(kind: ParameterKind, **more: object) -> Parameter:
        return Parameter(name="p", kind=kind, doc="a value", default=REQUIRED, **more)  # pyright: ignore

    assert value("n*2", rule(ParameterKind.INTEGER)) == 6
    assert value("k > 1", rule(ParameterKind.BOOLEAN)) is True
    assert value("word", rule(ParameterKind.CHOICE, choices=("either", "or"))) == "either"
    assert value("n", rule(ParameterKind.NUMBER)) == 3.0
    with pytest.raises(InputError, match=r"the formula 'k' gives numbers|the value is 2.0"):
        value("k", rule(ParameterKind.STRING))
    with pytest.raises(
        InputError, match=r"the formula '2.k' gives numbers.*Allowed: the name of a mask parameter"
    ):
        value("2*k", rule(ParameterKind.STRING))
    with pytest.raises(InputError, match=r"the value is 2.5.*an integer"):
        value("2.5", rule(ParameterKind.INTEGER))
    with pytest.raises(UnknownNameError, match=r"there is no mask parameter named 'kk'.*did you mean 'k'"):
        value("2*kk")
    assert formula_names("sin(2*pi*k) + v(1) + [a b]") == {"k", "v", "a", "b"}
