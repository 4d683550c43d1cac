"""Formulas for values: arrays in MATLAB's syntax, the matrix product, and rejection of Python code."""

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
        ("norm(A, 'fro')^2", 30),
        ("90*deg - deg2rad(90) + rad2deg(pi)", 180),
        ("-inf", -math.inf),
        ("[]", []),
        ("if(k > 1, v, -v)", [1, 2, 3]),
        ("!(k < 1) && on", 1),
        ("A(1, 2) + A(3) + v(end)", 7),
        ("v(2:end)", [2, 3]),
        ("A(:, 2)", [2, 4]),
        ("v([3 1])", [3, 1]),
        ("1:n", [1, 2, 3]),
        ("[1 2\n3 4]", [[1, 2], [3, 4]]),
        ("A.T - A'", [[0, 0], [0, 0]]),
        ("A.^2", [[1, 4], [9, 16]]),
        ("(v == 2) | (v > 2) & on", [0, 1, 1]),
        ("k*...\n  n # product", 6),
        ("(k\n+ n)", 5),
        ("\n k \n", 2),
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
        "v % 2",
    ],
)
def test_python_code_is_refused(text: str) -> None:
    with pytest.raises(ArmblocksError) as error:
        value(text)
    assert "block 'b', parameter 'p'" in str(error.value)
    assert "Allowed: " in str(error.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1 2", r"'\[' is never closed, in column 1: »\[1 2.*add '\]'"),
        ("[" * 80 + "]" * 80, "brackets are nested too deeply"),
        ("[1 2; 3]", "the rows of an array have 2, 1 numbers"),
        ("[A 1]", "a matrix is inside brackets"),
        ("A*v", "a matrix of 2 x 2 is multiplied by a matrix of 3 x 1.*as many columns"),
        ("A + v", "arrays of 2 x 2 and 3 x 1 numbers are combined"),
        ("v/A", r"the divisor is a matrix.*inv\(A\)"),
        ("A[5]", r"the index 5 is not possible here, in column 2: A»\[5\].*Allowed: A\(1\) to A\(4\)"),
        ("A(1, 2, 3)", "3 indices are given"),
        ("v(k/3)", "the index 0.666667 is not possible"),
        ("inv([1 2 3; 4 5 6])", "a 2 x 3 matrix has no inverse"),
        ("eye(1.5)", "eye: 1.5 is not a number of elements"),
        ("zeros(1000, 1000)", r"zeros: an array would have 1e\+06 elements; at most 100000 are allowed"),
        ("eye(1, 2, 3)", "eye is called with 3 arguments.*Allowed: 0 to 2"),
        ("[0:1e-320:1]", "a range: the number of steps is not finite"),
        ("eye(v)", "eye: 3 numbers are given as a size"),
        ("{1}", "a cell array is not a number"),
        ("v{1}", "cell arrays are not supported in formulas"),
        ("v.mass", "a number has no field 'mass'"),
        ("k + 'deg'", "the text 'deg' is not a number"),
        ("k % 2", r"'%' starts a comment in MATLAB.*write mod\(a, b\)"),
        ("k = 2", r"'=' is not allowed here, in column 3: k »= 2.*compare with '=='"),
        ("k if on else n", r"'if' is not allowed here.*write if\(condition, yes, no\)"),
        ("k; n", r"';' is not allowed here"),
        ("3i", "'3i' is an imaginary number"),
        ("2*(k +\n* n)", r"'\*' is not allowed here, expected a value, in line 2, column 1: »\* n"),
        ("a = @sin", "function handles"),
        ("word*2", "'word' is str, which is not a number.*write word alone"),
    ],
)
def test_error_messages_name_position_and_reason(text: str, message: str) -> None:
    with pytest.raises(InputError, match=f"(?s)block 'b', parameter 'p': .*{message}"):
        value(text)


def test_the_value_of_a_formula_has_the_kind_of_its_parameter() -> None:
    def rule(kind: ParameterKind, **options: object) -> Parameter:
        return Parameter(name="p", kind=kind, doc="a value", default=REQUIRED, **options)  # pyright: ignore

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
    with pytest.raises(UnknownNameError, match=r"function or mask parameter named 'sni'.*mean 'sin'"):
        value("sni(k)")
    assert formula_names("sin(2*pi*k) + v(1) + [a b]") == {"k", "v", "a", "b"}
