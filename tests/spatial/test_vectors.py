"""Sums, differences and products of symbols and numbers: the expressions of CasADi's operators."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from casadi import SX, sin

from armblocks.spatial.vectors import minus, plus, times

X, Y = SX.sym("x"), SX.sym("y")
SYMBOLIC = (X, -X, 2.0 * X, X * X, sin(X) + Y, SX(0.0), SX(1.0), SX(1, 1))
NUMBERS = (0.0, -0.0, 1.0, -1.0, 2.5, float("nan"), float("inf"), 3, np.float64(0.1), np.int64(2))


@pytest.mark.parametrize(
    ("function", "by_operator"), [(plus, operator.add), (minus, operator.sub), (times, operator.mul)]
)
def test_expressions_are_those_of_the_operators(
    function: Callable[[Any, Any], Any], by_operator: Callable[[Any, Any], Any]
) -> None:
    for symbolic in SYMBOLIC:
        for other in (*SYMBOLIC, *NUMBERS):
            for pair in ((symbolic, other), (other, symbolic)):
                found, expected = function(*pair), by_operator(*pair)
                assert (str(found), found.nnz()) == (str(expected), expected.nnz()), pair
    for a in NUMBERS:
        for b in NUMBERS:
            np.testing.assert_array_equal(function(a, b), by_operator(a, b))
