"""The Jacobian of the flow: exact, sparse, and defined for every operation."""

from __future__ import annotations

import casadi as ca
import numpy as np

from armblocks.compiler.from_casadi import tape_from
from armblocks.compiler.interpret import interpret
from armblocks.equations import (
    Signature,
    Slot,
    TracedFunction,
    continuous_system,
    signature,
    trace_flow_jacobian,
)

OPERATIONS = {
    "product": lambda x, y: x * y,
    "quotient": lambda x, y: x / y,
    "root": lambda x, y: ca.sqrt(x) - y,
    "absolute value": lambda x, y: ca.fabs(x) * y,
    "sign": lambda x, y: ca.sign(x) * y,
    "floor": lambda x, y: ca.floor(x) + y * y,
    "ceiling": lambda x, y: ca.ceil(x) * y,
    "minimum": lambda x, y: ca.fmin(x, 2 * y),
    "maximum": lambda x, y: ca.fmax(x, 0.1 * y),
    "sign of another": lambda x, y: ca.copysign(x, y),
    "truncated remainder": lambda x, y: ca.fmod(3 * x, y),
    "nearest remainder": lambda x, y: ca.remainder(3 * x, y),
    "choice": lambda x, y: ca.if_else(x < y, x * y, x / y),
    "conditions": lambda x, y: ca.if_else(ca.logic_and(x > 0, ca.logic_not(y < 0)), x * x, y),
    "angles": lambda x, y: ca.sin(x) * ca.cos(y) + ca.tan(x * y) + ca.atan2(x, y) + ca.atan(y),
    "inverse": lambda x, y: ca.asin(0.3 * x) + ca.acos(0.3 * y),
    "hyperbolic": lambda x, y: ca.sinh(x) + ca.cosh(y) * ca.tanh(x) + ca.asinh(y) + ca.atanh(0.3 * x),
    "inverse cosh": lambda x, y: ca.acosh(1 + x) * y,
    "exponential": lambda x, y: ca.exp(x) * ca.expm1(y) + ca.log(x) + ca.log1p(y),
    "power": lambda x, y: x**y + x**3 + y**-2.5,
    "hypotenuse": lambda x, y: ca.hypot(x, y),
    "error": lambda x, y: ca.erf(x * y),
}


def test_every_operation_can_be_differentiated_and_compiled() -> None:
    """Comparison with central differences: the solver "auto" may need the Jacobian of any operation."""
    names = list(OPERATIONS)
    n = len(names)
    x = ca.SX.sym("x", 2 * n)
    rates = [OPERATIONS[name](x[2 * k], x[2 * k + 1]) for k, name in enumerate(names)]
    f = ca.vertcat(*(part for rate in rates for part in (rate, -rate)))
    ends = signature(("t", ()), ("x", (2 * n,)), ("p", (0,)))
    p_only = signature(("p", (0,)))
    system = continuous_system(
        name="all",
        states=Signature((Slot("all/x", (2 * n,)),)),
        parameters=Signature(),
        signals_layout=Signature(),
        parameter_values=np.empty(0),
        derivative=TracedFunction(
            "derivative", ends, signature(("xd", (2 * n,))), (ca.SX.sym("t"), x, ca.SX(0, 1)), (f,)
        ),
        signals=TracedFunction.trace("signals", ends, signature(("y", (0,))), lambda t, x, p: ca.SX(0, 1)),
        initial_states=TracedFunction.trace(
            "x0", p_only, signature(("x0", (2 * n,))), lambda p: ca.SX.zeros(2 * n)
        ),
        breakpoints=TracedFunction.trace("b", p_only, signature(("b", (0,))), lambda p: ca.SX(0, 1)),
        aliases={},
    )
    jacobian = trace_flow_jacobian(system)
    assert len(jacobian.rows) <= 4 * n  # each rate depends on its two states only
    tape = tape_from(jacobian.function)
    point = np.tile([0.7, 0.9], n)
    empty = np.empty(0)
    J, T = interpret(tape, [np.zeros(1), point, empty, empty, empty])
    actual = np.zeros((2 * n, 2 * n))
    actual[list(jacobian.rows), list(jacobian.columns)] = J
    rate = ca.Function("f", [x], [f])
    h = 1e-6
    columns = [
        (np.asarray(rate(point + h * e)) - np.asarray(rate(point - h * e))).ravel() / (2 * h)
        for e in np.eye(2 * n)
    ]
    for k, name in enumerate(names):
        block = slice(2 * k, 2 * k + 2)
        np.testing.assert_allclose(
            actual[block, block], np.column_stack(columns)[block, block], rtol=1e-7, atol=1e-8, err_msg=name
        )
    np.testing.assert_array_equal(T, 0.0)
