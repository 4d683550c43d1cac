"""Elementary functions of constants of any origin are never evaluated by the C library."""

import math
from collections.abc import Callable

import casadi
import pytest
from casadi import SX

import armblocks as ab
from armblocks import rounded_functions
from armblocks.blocks import Clock, Expression, Integrator, Product, Trigonometry
from armblocks.compiler.from_casadi import tape_from
from armblocks.compiler.opcodes import Opcode
from armblocks.diagram import trace_diagram
from armblocks.diagram.mask import formula_number
from armblocks.equations import call_with_constants, elementary, signature, substituted, trace_flow_jacobian
from armblocks.equations.linear_solution import linear_solution
from armblocks.equations.traced_function import TracedFunction

MARK = 1234.5


@pytest.fixture
def marked_functions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace the functions of this package by ones that return a marker value."""
    for name in rounded_functions.FUNCTIONS:
        monkeypatch.setitem(rounded_functions.FUNCTIONS, name, lambda *arguments: MARK)


def constants_of(add_blocks: Callable[[ab.DiagramBuilder], object]) -> tuple[float, ...]:
    builder = ab.DiagramBuilder("d")
    builder.log(add_blocks(builder))  # pyright: ignore[reportArgumentType]
    return tape_from(trace_diagram(builder.build()).signals).constants


@pytest.mark.usefixtures("marked_functions")
@pytest.mark.parametrize(
    "text", ["u*cos(1.995)", "u*2.1^0.3", "u*atan2(0.3, 2)", "[u*log10(7); sin(0.3)]", "u*erf(pi)", "u+ln(2)"]
)
def test_constants_in_formulas_are_not_evaluated_by_the_c_library(text: str) -> None:
    assert MARK in constants_of(lambda d: d.add("y", Expression(formula=text), d.add("u", Clock())))


@pytest.mark.usefixtures("marked_functions")
def test_constants_in_masks_are_not_evaluated_by_the_c_library() -> None:
    assert formula_number("cos(1.995)", "") == MARK
    assert formula_number("[sin(0.3) 2; 3 4^0.5]", "") == [[MARK, 2.0], [3.0, MARK]]


@pytest.mark.usefixtures("marked_functions")
def test_constants_that_pass_through_blocks_are_not_evaluated_by_the_c_library() -> None:
    """The output of an Expression without inputs is a constant input of the next block."""

    def chain(d: ab.DiagramBuilder) -> object:
        number = d.add("number", Expression(formula="1.995", inputs=0))
        cosine = d.add("cos", Trigonometry(function="cos"), number)
        return d.add("y", Product(), cosine, d.add("u", Clock()))

    assert MARK in constants_of(chain)


@pytest.mark.usefixtures("marked_functions")
def test_constant_solutions_of_equations_are_not_evaluated_by_the_c_library() -> None:
    z, u = SX.sym("z", 2), SX.sym("u")
    solution = substituted(
        casadi.vertcat(casadi.cos(z[0]) * u, casadi.exp(z[1])), z, casadi.vertcat(1.995, u)
    )
    assert float(casadi.substitute(solution[0], u, 1.0)) == MARK
    assert casadi.depends_on(solution[1], u)


def test_the_logarithm_in_the_derivative_of_a_power_is_left_to_the_compiled_code() -> None:
    """CasADi would evaluate log(2.2) in the derivative of 2.2^u with the C library."""
    builder = ab.DiagramBuilder("d")
    state = builder.add("x", Integrator(initial=0.3))
    builder.connect(builder.add("y", Expression(formula="2.2^u - u"), state), state)
    system = trace_diagram(builder.build())
    flow = tape_from(system.derivative)
    assert [operation.opcode for operation in flow.operations][:1] == [Opcode.POWER]
    slopes = tape_from(trace_flow_jacobian(system).function)
    assert Opcode.LOG in {operation.opcode for operation in slopes.operations}
    assert not any(math.isclose(constant, math.log(2.2)) for constant in slopes.constants)


def test_powers_of_constants_keep_value_and_derivative() -> None:
    u = SX.sym("u")
    for base in (2.2, 0.4, 1.0, 0.0, -1.5):
        value = elementary("power", SX(base), u)
        function = casadi.Function("f", [u], [value, casadi.jacobian(value, u)])
        for x in (-2.0, 0.0, 3.0):
            if base > 0.0 or (base < 0.0 or x >= 0.0):
                actual, slope = map(float, function(x))
                assert actual == pytest.approx(base**x, rel=1e-15)
                if base > 0.0:
                    assert slope == pytest.approx(math.log(base) * base**x, rel=1e-14, abs=1e-15)


def test_functions_of_symbols_are_not_changed() -> None:
    u = SX.sym("u", 3)
    plain = TracedFunction.trace("f", signature(("u", (3,))), signature(("y", (3,))), casadi.sin)
    with_package_function = TracedFunction.trace(
        "f", signature(("u", (3,))), signature(("y", (3,))), lambda a: elementary("sin", a)
    )
    assert tape_from(plain) == tape_from(with_package_function)
    assert substituted(casadi.sin(u), u, 2.0 * u).shape == (3, 1)


def test_linear_solutions_are_kept_when_constants_are_folded() -> None:
    """Calls of the linear solver stay calls, even if their arguments or other arguments are constants."""
    A, b, u = SX.sym("A", 4), SX.sym("b", 2), SX.sym("u")
    x = linear_solution(casadi.reshape(A, 2, 2), b)
    results = casadi.vertcat(casadi.sin(x[0]) * u, x, casadi.cos(u), casadi.vec(casadi.jacobian(x, b)))
    function = casadi.Function("f", [A, b, u], [results])
    numbers = ([2.0, 1.0, 0.5, 3.0], [1.0, 0.7], 0.3)
    (value,) = call_with_constants(function, [SX(numbers[0]), casadi.vertcat(1.0, b[1]), SX(numbers[2])])
    assert casadi.Function("g", [b], [value])(numbers[1]).full() == pytest.approx(
        function(*numbers).full(), rel=1e-14
    )
