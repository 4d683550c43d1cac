"""Formulas: values equal to those of Python and NumPy, and errors for all other syntax."""

from __future__ import annotations

import math

import numpy as np
import pytest
from block_evaluation import evaluate
from casadi import SX
from hypothesis import given, settings
from hypothesis import strategies as st

from armblocks.blocks import Expression
from armblocks.errors import ArmblocksError, DiagramError, InputError, UnknownNameError
from armblocks.matlab.formula import Formula

U = np.array([0.3, -1.2, 2.5])


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("sin(u[1]) * 2", math.sin(0.3) * 2),
        ("u(2)^2 + u[3]", 1.44 + 2.5),
        ("-u[1]^2", -0.09),
        ("2^-1", 0.5),
        ("2^3^2", 64.0),
        ("u[1] - u[2] - u[3]", 0.3 + 1.2 - 2.5),
        ("1 / u[3] / 2", 0.2),
        ("atan2(u[2], u[1])", math.atan2(-1.2, 0.3)),
        ("max(u[1], min(u[2], 7))", 0.3),
        ("u[1] < u[2]", 0.0),
        ("u[1] >= u[2] && !(u[3] == 0)", 1.0),
        ("u[1] < 0 || u[3] ~= 2.5", 0.0),
        ("if(u[1] > 0, pi, e)", math.pi),
        ("if(u[2] > 0, log(u[2]), 5)", 5.0),
        ("1.5e-3 + .5", 0.5015),
        ("rem(7, u[3])", 2.0),
        ("hypot(3, 4) + abs(-2) + sqrt(4) + power(2, 3)", 17.0),
        ("2 ** 3", 8.0),
        ("sum([1 2 3] .* u)", 0.3 - 2.4 + 7.5),
        ("t * u[1]", 0.21),
    ],
)
def test_formulas_equal_the_same_expression_in_python(formula: str, expected: float) -> None:
    actual = evaluate(Expression(formula=formula), U, t=0.7)["y"]
    assert actual.shape == ()
    assert actual == pytest.approx(expected, rel=1e-14, abs=1e-15)


def test_vectors_are_processed_elementwise() -> None:
    assert evaluate(Expression(formula="exp(u) + 1"), U)["y"] == pytest.approx(np.exp(U) + 1, rel=1e-15)
    two = Expression(formula="u1 * u2 - u1[1]", inputs=2)
    assert evaluate(two, U, 2.0)["y"] == pytest.approx(U * 2 - 0.3, rel=1e-15)


def test_named_constants_are_tunable() -> None:
    block = Expression(formula="k * u + offset", names="k, offset", values=[2.0, 0.5])
    assert evaluate(block, 3.0)["y"] == 6.5
    assert evaluate(Expression(formula="k", inputs=0, names="k", values=4.0))["y"] == 4.0
    assert next(rule for rule in Expression.parameters() if rule.name == "values").tunable


def test_a_long_sum_does_not_exceed_the_nesting_limit() -> None:
    assert evaluate(Expression(formula="+".join(["u"] * 1000)), 1.0)["y"] == 1000.0


@pytest.mark.parametrize(
    "formula",
    [
        "__import__('os')",
        "u.__class__",
        "(lambda: 1)()",
        "[1, 2",
        "[u; 1]",
        "[1 2; 3 4]",
        "u[0]",
        "u[4]",
        "u[u]",
        "'text'",
        "u if u else u",
        "u := 3",
        "1 < u < 3",
        "u @ u",
        "u // 2",
        "1j",
        "True",
        "f'{u}'",
        "sin(u, u)",
        "sin(x=u)",
        "sin(*u)",
        "sin",
        "sin(u",
        "",
        "u; u",
        "1e999",
        "9" * 400,
        "(" * 300 + "u" + ")" * 300,
        "~" * 1000 + "u",
        "u" * 5000,
        "\x00",
    ],
)
def test_other_syntax_is_refused(formula: str) -> None:
    with pytest.raises(ArmblocksError) as caught:
        evaluate(Expression(formula=formula), U)
    assert "Allowed: " in str(caught.value)


def test_messages_name_the_position_and_a_fix() -> None:
    with pytest.raises(
        InputError,
        match=r"Expression.formula: '\(' is never closed, in column 4: sin»\(u. Allowed: brackets in pairs",
    ):
        Expression(formula="sin(u")
    with pytest.raises(
        InputError, match=r"a value is expected, in column 4: u \+». Allowed: numbers.*correct the formula"
    ):
        Expression(formula="u +")
    with pytest.raises(DiagramError, match=r"block 'block' .*there is no name named 'v'"):
        evaluate(Expression(formula="v + u"), U)
    with pytest.raises(UnknownNameError, match=r"there is no function named 'sinn'.*did you mean 'sin'"):
        Formula("sinn(u)", "here").trace({})
    with pytest.raises(UnknownNameError, match=r"there is no name named 'gian'.*did you mean 'gain'"):
        Formula("gian", "here").trace({"gain": SX(1.0)})
    with pytest.raises(
        DiagramError,
        match=r"index 4 is not possible here, in column 2: u»\[4\]. Allowed: u\(1\) to",
    ):
        evaluate(Expression(formula="u[4]"), U)
    with pytest.raises(DiagramError, match=r"'u' has no constant index"):
        evaluate(Expression(formula="u[u]"), U)
    with pytest.raises(DiagramError, match=r"atan2 is called with 1 argument, .*Allowed: 2"):
        evaluate(Expression(formula="atan2(u)"), U)
    with pytest.raises(DiagramError, match=r"the function 'sin' is called without arguments"):
        evaluate(Expression(formula="sin"), U)
    with pytest.raises(InputError, match=r"function handles \('@'\) are not supported"):
        evaluate(Expression(formula="u @ u"), U)
    with pytest.raises(DiagramError, match=r"vectors of 2 and 3 elements are combined"):
        evaluate(Expression(formula="u1 + u2", inputs=2), U, [1.0, 2.0])
    with pytest.raises(DiagramError, match=r"the formula gives an empty array.*Allowed: scalars and vectors"):
        evaluate(Expression(formula="1:0:5"), U)
    with pytest.raises(DiagramError, match=r"'u' has shape \(2, 2\).*scalars and vectors in a formula"):
        evaluate(Expression(), np.eye(2))
    with pytest.raises(InputError, match=r"the formula has 5000 characters. Allowed: at most 4000"):
        Expression(formula="u" * 5000)
    with pytest.raises(InputError, match=r"the expression is nested too deeply"):
        Formula("~" * 300 + "u", "here").trace({"u": SX(1.0)})
    with pytest.raises(InputError, match=r"is too large a number"):
        Formula("1e999", "here").trace({})
    with pytest.raises(InputError, match=r"'t' cannot be the name of a constant"):
        Expression(names="t")
    with pytest.raises(InputError, match=r"2 names and 1 value are given"):
        Expression(names="a b", values=1.0)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(st.text(alphabet="u12.+-*/^()[]<>=!&|~, sincoexpkt_'\"\\\n{}:;", max_size=40))
def test_any_text_is_a_formula_or_is_refused_with_a_message(text: str) -> None:
    try:
        evaluate(Expression(formula=text), U)
    except ArmblocksError as error:
        assert str(error)
