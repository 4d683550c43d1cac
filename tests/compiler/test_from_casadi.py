"""Conversion of every operation of CasADi's scalar graphs to the tape."""

from collections.abc import Callable, Sequence
from functools import cache

import casadi
import numpy as np
import pytest
from casadi import SX
from small_functions import mixed, traced

from armblocks.compiler import Kernel, compile_function
from armblocks.compiler.from_casadi import tape_from
from armblocks.compiler.interpret import interpret
from armblocks.equations import TracedFunction
from armblocks.errors import CompileError

UNARY: dict[str, Callable[[SX], SX]] = {
    name: getattr(casadi, name)
    for name in [
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "sinh",
        "cosh",
        "tanh",
        "asinh",
        "acosh",
        "atanh",
        "exp",
        "log",
        "log10",
        "sqrt",
        "fabs",
        "sign",
        "floor",
        "ceil",
        "erf",
        "expm1",
        "log1p",
        "logic_not",
    ]
} | {
    "negative": lambda x: -x,
    "square": lambda x: x**2,
    "cube": lambda x: x**3,
    "twice": lambda x: 2 * x,
    "inverse": lambda x: 1 / x,
    "constant power": lambda x: x**2.5,
    "power of two": lambda x: 2**x,
}
BINARY: dict[str, Callable[[SX, SX], SX]] = {
    name: getattr(casadi, name)
    for name in ["atan2", "fmin", "fmax", "fmod", "remainder", "copysign", "hypot", "logic_and", "logic_or"]
} | {
    "add": lambda x, y: x + y,
    "subtract": lambda x, y: x - y,
    "multiply": lambda x, y: x * y,
    "divide": lambda x, y: x / y,
    "power": lambda x, y: x**y,
    "less": lambda x, y: x < y,
    "less or equal": lambda x, y: x <= y,
    "equal": lambda x, y: casadi.eq(x, y),
    "not equal": lambda x, y: casadi.ne(x, y),
    "choice": lambda x, y: casadi.if_else(x < y, 3 * x, y),
    "half choice": lambda x, y: casadi.if_else(x < y, x, 0),
}
VALUES = np.array(
    [0.0, -0.0, 0.3, -0.3, 0.9999, 1.0, -1.0, 1.7, -2.5, 3.0, 40.0, -1e5, 1e-9, np.inf, -np.inf]
)


@cache
def all_of(arity: int) -> tuple[TracedFunction, Kernel]:
    """All operations with one or two operands as one function with one result per operation."""
    operations = (UNARY if arity == 1 else BINARY).values()
    function = traced(lambda *ends: casadi.vertcat(*(one(*ends) for one in operations)), *[1] * arity)
    return function, compile_function(function)


def check_agreement_with_casadi(names: Sequence[str], *columns: np.ndarray) -> None:
    """Compare native code for one sample and for lanes, and the interpreter, with CasADi at many points."""
    (function, kernel), samples = all_of(len(columns)), [column[:, None] for column in columns]
    # CasADi expects one sample per column.
    expected = np.asarray(function.casadi_function()(*(column[None] for column in columns))).T
    singles = np.array([kernel(*sample) for sample in zip(*samples)])
    for actual in (singles, kernel(*samples), interpret(kernel.tape, samples)[0]):
        for name, one, other in zip(names, actual.T, expected.T, strict=True):
            # CasADi calls the C library: results may differ by the errors of both.
            np.testing.assert_allclose(one, other, rtol=1e-15, err_msg=name)


def test_unary_operations_agree_with_casadi() -> None:
    check_agreement_with_casadi(list(UNARY), np.append(VALUES, np.nan))


def test_binary_operations_agree_with_casadi() -> None:
    x, y = np.meshgrid(VALUES, VALUES)
    check_agreement_with_casadi(list(BINARY), x.ravel(), y.ravel())


def test_minimum_and_maximum_propagate_nan() -> None:
    """CasADi's fmin and fmax ignore a NaN: a limiter would then hide an invalid signal."""
    names = ["fmin", "fmax", "add", "divide", "fmod", "remainder", "atan2", "hypot", "power"]
    rows = [list(BINARY).index(name) for name in names]
    _, kernel = all_of(2)
    for x, y in ((np.nan, 2.0), (2.0, np.nan), (np.nan, np.nan)):
        assert np.isnan(kernel([x], [y])[rows]).all()
        assert np.isnan(kernel([[x]] * 9, [[y]] * 9)[:, rows]).all()


def test_the_branch_that_is_not_selected_does_not_affect_the_result() -> None:
    kernel = compile_function(traced(lambda x, y: casadi.if_else(x > 0, y, casadi.log(x)), 1, 1))
    assert kernel([1.0], [5.0])[0] == 5.0
    assert kernel([2.0], [-np.inf])[0] == -np.inf
    guarded = compile_function(traced(lambda x: casadi.if_else(x > 0, casadi.sqrt(x), 0), 1))
    assert guarded([-1.0])[0] == 0.0


def test_sparse_results_are_filled_with_zeros() -> None:
    function = traced(lambda x: casadi.sparsify(casadi.vertcat(x, 0, 2 * x)), 1)
    np.testing.assert_array_equal(compile_function(function)([3.0]), [3.0, 0.0, 6.0])


def test_a_whole_function_agrees_with_casadi() -> None:
    function = mixed()
    tape = tape_from(function)
    samples = np.random.default_rng(5).normal(size=(50, 2, 3))
    for a, b in samples:
        np.testing.assert_allclose(interpret(tape, [a, b])[0], function(a, b)[0], rtol=1e-13, atol=1e-15)


def test_an_unknown_operation_is_named() -> None:
    function = traced(lambda x: casadi.erfinv(x), 1, name="probit")
    with pytest.raises(CompileError, match=r"probit: the equations use the operation OP_ERFINV"):
        compile_function(function)


def test_a_call_of_another_function_is_named() -> None:
    x = SX.sym("x")
    square = casadi.Function("square", [x], [x * x], {"never_inline": True})
    function = traced(lambda x: square.call([x], False, True)[0], 1, name="outer")
    with pytest.raises(CompileError, match=r"outer: the equations call the function square"):
        compile_function(function)
