"""Directional derivatives equal CasADi's at regular points, and are 0 where roots and powers rest."""

import numpy as np
import pytest
from casadi import SX, Function, acos, asin, atan2, hypot, if_else, jtimes, sqrt, vertcat

import armblocks as ab
from armblocks.blocks import (
    Clock,
    Derivative,
    Expression,
    Integrator,
    PulseGenerator,
    Ramp,
    RateLimiterContinuous,
    Sqrt,
)
from armblocks.diagram import Block
from armblocks.equations import directional_derivative


def random_expression(rng: np.random.Generator, x: SX) -> SX:
    """A random expression of positive values in which roots, powers, angles and norms are nested."""
    operands = [x[k] for k in range(x.numel())]
    for _ in range(8):
        a, b = (operands[k] for k in rng.integers(len(operands), size=2))
        choices = [sqrt(a + 0.1 * b), a**b, a**1.3 + b, hypot(a, b), 0.5 + atan2(a, b), a / (1.0 + b)]
        choices += [2.0 + asin(a / (1.0 + a)) - acos(b / (1.0 + b)), if_else(a > b, a * b, sqrt(b))]
        operands.append(choices[rng.integers(len(choices))])
    return vertcat(*operands[-3:], operands[0])


@pytest.mark.parametrize("seed", range(30))
def test_at_regular_points_the_derivative_is_that_of_casadi(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, direction, others = SX.sym("x", 3), SX.sym("d", 3), SX.sym("o", 2)
    expression = random_expression(rng, vertcat(x, others))
    symbols = [x, direction, others]
    own = Function("own", symbols, [directional_derivative(expression, x, direction)])
    reference = Function("reference", symbols, [jtimes(expression, x, direction)])
    point = [rng.uniform(0.3, 1.5, 3), rng.normal(size=3), rng.uniform(0.3, 1.5, 2)]
    np.testing.assert_allclose(own(*point), reference(*point), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("formula", "point"),
    [
        ("sqrt(u[1]) + u[2]", (0.0, 2.0)),
        ("sqrt(sqrt(u[1])) * u[2]", (0.0, 2.0)),
        ("u[1] ^ 0.5 * u[2]", (0.0, 2.0)),
        ("u[1] ^ u[2]", (0.0, 0.7)),  # 0 ^ y is 0 for all positive y
        ("asin(u[1]) + u[2]", (1.0, 3.0)),
        ("acos(u[1]) * u[2]", (-1.0, 3.0)),
        ("hypot(u[1], 2 * u[1]) + u[2]", (0.0, 3.0)),
        ("atan2(u[1], u[1]) + u[2]", (0.0, 3.0)),
    ],
)
def test_operands_that_rest_do_not_contribute(formula: str, point: tuple[float, float]) -> None:
    x, direction = SX.sym("x", 2), SX.sym("d", 2)
    expression = Expression(formula=formula).outputs(SX(0.0), {}, {"u": x}, {"values": SX(0.0)})["y"]
    derivative = Function("f", [x, direction], [directional_derivative(expression, x, direction)])
    value = Function("v", [x], [expression])
    step = 1e-6
    beside = [float(value([point[0], point[1] + sign * step])) for sign in (1.0, -1.0)]
    difference = (beside[0] - beside[1]) / (2.0 * step)
    assert float(derivative(point, [0.0, 1.0])) == pytest.approx(difference, abs=1e-9)
    assert float(derivative(point, [0.0, 0.0])) == 0.0


def test_the_rate_of_a_root_is_differentiable_where_it_is_zero() -> None:
    """The second derivative at rest, and the derivative of a rate by a parameter with the value 0."""
    root = Expression(formula="sqrt(1+u^2)")
    twice = ab.simulate(chain(Clock(), root, Derivative(), Derivative()), stop_time=1.0, sample_time=0.25)
    np.testing.assert_allclose(twice["b2"].ravel(), (1.0 + twice.time**2) ** -1.5, rtol=1e-12)

    still = chain(Ramp(slope=0.0, initial=4.0), Sqrt(), Derivative())
    by_slope = ab.sensitivity(still, ["source.slope"], ["b1"], stop_time=1.0, sample_time=0.25)
    np.testing.assert_allclose(by_slope["b1", "source.slope"].ravel(), 0.25, rtol=1e-12)

    power = Expression(formula="u^n", names="n", values=0.0)
    by_exponent = ab.sensitivity(
        chain(Ramp(initial=1.0), power, Derivative()), ["b0.values"], ["b1"], stop_time=1.0, sample_time=0.25
    )
    moving = 1.0 + by_exponent.time
    np.testing.assert_allclose(by_exponent["b1", "b0.values"].ravel(), 1.0 / moving, rtol=1e-12)


def test_the_derivative_of_a_power_with_exponent_zero_is_zero() -> None:
    x = SX.sym("x", 2)
    derivative = Function("f", [x], [directional_derivative(x[0] ** x[1], x, SX([1.0, 0.0]))])
    assert float(derivative([0.0, 0.0])) == 0.0
    assert float(derivative([0.0, 1.0])) == 1.0


def test_a_root_that_leaves_zero_has_an_infinite_rate() -> None:
    x = SX.sym("x")
    derivative = Function("f", [x], [directional_derivative(sqrt(x), x, SX(1.0))])
    assert float(derivative(0.0)) == np.inf


def chain(source: Block, *blocks: Block) -> ab.Diagram:
    builder = ab.DiagramBuilder("chain")
    signal = builder.add("source", source)
    for number, block in enumerate(blocks):
        signal = builder.add(f"b{number}", block, signal)
    builder.log(signal)
    return builder.build()


ROOTS = (Sqrt(), Expression(formula="u^0.5"), Expression(formula="sqrt(u^2)^0.5"))


@pytest.mark.parametrize("root", ROOTS, ids=lambda block: getattr(block, "formula", "Sqrt"))
def test_a_root_that_rests_at_zero_passes_rate_limiters_and_sensitivities(root: Block) -> None:
    start = 0.5
    limited = chain(Ramp(slope=1.0, start=start), root, RateLimiterContinuous(rising=0.5, falling=-1.0))
    result = ab.simulate(limited, stop_time=1.5, sample_time=0.1)
    moving = np.maximum(result.time - start, 0.0)
    # sqrt(s) rises faster than s / 2 until its rate 0.5 / sqrt(s) is 0.5; both are equal again at s = 4.
    np.testing.assert_allclose(result["b1"].ravel(), 0.5 * moving, atol=1e-9)

    integral = chain(Ramp(slope=1.0, start=start), root, Integrator())
    by_slope = ab.sensitivity(integral, ["source.slope"], ["b1"], stop_time=1.5, sample_time=0.1)
    moving = np.maximum(by_slope.time - start, 0.0)
    np.testing.assert_allclose(by_slope["b1", "source.slope"].ravel(), moving**1.5 / 3.0, atol=1e-6)

    pulses = chain(PulseGenerator(amplitude=4.0, period=1.0, width=50.0), root, Integrator())
    by_height = ab.sensitivity(pulses, ["source.amplitude"], ["b1"], stop_time=2.0, sample_time=0.25)
    on = np.minimum(by_height.time % 1.0, 0.5) + 0.5 * np.floor(by_height.time)
    np.testing.assert_allclose(by_height["b1", "source.amplitude"].ravel(), on / 4.0, atol=1e-9)
