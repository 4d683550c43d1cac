"""Diagrams compared with their solutions in closed form.

By default the runs have rtol 1e-10 and atol 1e-12 per step, and the tolerance of 1e-8 covers the accumulated
errors of some hundred steps.
"""

from __future__ import annotations

from math import factorial

import numpy as np
import pytest
from running import run
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from armblocks.blocks import (
    PID,
    Clock,
    Constant,
    Derivative,
    Gain,
    Integrator,
    MathFunction,
    MatrixGain,
    Product,
    Ramp,
    SineWave,
    StateSpace,
    Step,
    Sum,
    TransferFunction,
)
from armblocks.diagram import Diagram, DiagramBuilder


def test_a_chain_of_integrators_gives_powers_of_time() -> None:
    builder = DiagramBuilder("chain")
    last = builder.add("x0", Constant(value=1.0))
    for k in range(1, 5):
        last = builder.add(f"x{k}", Integrator(), last)
    result = run(builder.build(), 2.0)
    for k in range(5):
        # a method of order 5 integrates a polynomial of degree 4 exactly
        assert result[f"x{k}/y"] == pytest.approx(result.time**k / factorial(k), rel=1e-13, abs=1e-13)


def test_an_oscillator_agrees_with_the_cosine() -> None:
    builder = DiagramBuilder("oscillator")
    angle = builder.add("angle", Integrator(initial=1.0))
    speed = builder.add("speed", Integrator(), builder.add("force", Gain(gain=-4.0), angle))
    builder.connect(speed, angle)
    builder.add("acceleration", Derivative(), builder.add("rate", Derivative(), angle))
    result = run(builder.build(), 10.0)
    t = result.time
    assert result["angle/y"] == pytest.approx(np.cos(2 * t), abs=1e-8)
    assert result["rate/y"] == pytest.approx(-2 * np.sin(2 * t), abs=2e-8)
    assert np.array_equal(result["acceleration/y"], result["force/y"])


def test_a_matrix_in_a_loop_gives_the_matrix_exponential() -> None:
    A = np.array([[-0.1, 2.0, 0.0], [-2.0, -0.1, 0.3], [0.0, 0.5, -1.0]])
    x0 = np.array([1.0, 0.0, -1.0])
    builder = DiagramBuilder("linear")
    x = builder.add("x", Integrator(initial=x0))
    builder.connect(builder.add("A", MatrixGain(gain=A), x), x)
    result = run(builder.build(), 5.0)
    expected = np.array([expm(A * t) @ x0 for t in result.time])
    assert result["x/y"] == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("start", ["filter", "state space"])
def test_the_step_response_of_a_filter_agrees_with_its_closed_form(start: str) -> None:
    """4 / (s^2 + 2 s + 4), damping 1/2: y = 1 - exp(-t) (cos wt + sin(wt) / w), w = sqrt(3)."""
    filters = {
        "filter": TransferFunction(numerator=(4.0,), denominator=(1.0, 2.0, 4.0)),
        "state space": StateSpace(A=[[0, 1], [-4, -2]], B=[[0], [4]], C=[[1, 0]], D=[[0]]),
    }
    builder = DiagramBuilder("filter")
    builder.add("y", filters[start], builder.add("u", Step(time=1.0)))
    result = run(builder.build(), 10.0)
    t, w = np.maximum(result.time - 1.0, 0.0), np.sqrt(3)
    expected = 1 - np.exp(-t) * (np.cos(w * t) + np.sin(w * t) / w)
    assert result["y/y"].ravel() == pytest.approx(expected, abs=1e-8)


def test_a_filter_with_as_many_zeros_as_poles_agrees_with_its_closed_form() -> None:
    """(2 s + 3) / (s + 1) on a ramp t: y = 3 t - (1 - exp(-t))."""
    builder = DiagramBuilder("lead")
    builder.add("y", TransferFunction(numerator=(2.0, 3.0), denominator=(1.0, 1.0)), builder.add("u", Ramp()))
    result = run(builder.build(), 3.0)
    assert result["y/y"] == pytest.approx(3 * result.time - (1 - np.exp(-result.time)), abs=1e-8)


def control_loop(control: PID) -> Diagram:
    """A control loop with the plant x'' = u and the set point 1."""
    builder = DiagramBuilder("loop")
    x = builder.add("x", Integrator())
    error = builder.add("error", Sum(signs="+-"), builder.add("goal", Constant(value=1.0)), x)
    v = builder.add("v", Integrator(), builder.add("control", control, error))
    builder.connect(v, x)
    return builder.build()


def test_a_pid_loop_agrees_with_the_matrix_exponential() -> None:
    P, I, D, N = 6.0, 2.0, 4.0, 50.0  # noqa: E741
    result = run(control_loop(PID(P=P, I=I, D=D, N=N)), 8.0)
    # states x, v, integral, filter, and 1: u = P e + integral + N (D e - filter), e = 1 - x
    A = np.array(
        [
            [0, 1, 0, 0, 0],
            [-(P + N * D), 0, 1, -N, P + N * D],
            [-I, 0, 0, 0, I],
            [-N * D, 0, 0, -N, N * D],
            [0, 0, 0, 0, 0],
        ]
    )
    expected = np.array([(expm(A * t) @ [0, 0, 0, 0, 1])[0] for t in result.time])
    assert result["x/y"] == pytest.approx(expected, abs=1e-8)


def test_a_step_of_the_integrator_ends_at_a_jump() -> None:
    """x' = step(t - 1/3): no sample is at the jump, and x is exact nevertheless."""
    builder = DiagramBuilder("jump")
    builder.add("x", Integrator(), builder.add("u", Step(time=1 / 3, initial=-1.0, final=2.0)))
    result = run(builder.build(), 2.0)
    t = result.time
    expected = np.where(t < 1 / 3, -t, -1 / 3 + 2 * (t - 1 / 3))
    assert result["x/y"] == pytest.approx(expected, abs=1e-14)


def test_the_derivative_of_an_integral_equals_the_integrand() -> None:
    builder = DiagramBuilder("round trip")
    u = builder.add("u", SineWave(amplitude=[1.0, 2.0], frequency=3.0))
    builder.add("back", Derivative(), builder.add("x", Integrator(), u))
    result = run(builder.build(), 2.0)
    assert np.array_equal(result["back/y"], result["u/y"])


def van_der_pol() -> Diagram:
    """x1' = x2, x2' = (1 - x1^2) x2 - x1 + u; u = 2 e + 0.5 int(e) - 0.5 x2, e = sin(2 pi 0.1 t) - x1."""
    builder = DiagramBuilder("van der pol")
    goal = builder.add("goal", SineWave(frequency=2 * np.pi * 0.1))
    x1 = builder.add("x1", Integrator(initial=1.0))
    x2 = builder.add("x2", Integrator())
    builder.connect(x2, x1)
    error = builder.add("error", Sum(signs="+-"), goal, x1)
    action = builder.add("action", PID(P=2.0, I=0.5), error)
    u = builder.add("u", Sum(signs="+-"), action, builder.add("damping", Gain(gain=0.5), x2))
    square = builder.add("square", MathFunction(function="square"), x1)
    damping_factor = builder.add("damping factor", Sum(signs="+-"), builder.add("one", Constant()), square)
    push = builder.add("push", Product(), damping_factor, x2)
    builder.connect(builder.add("total", Sum(signs="+-+"), push, x1, u), x2)
    return builder.build()


def test_van_der_pol_agrees_with_an_independent_solution() -> None:
    def equations(t: float, x: np.ndarray) -> list[float]:
        x1, x2, integral = x
        e = np.sin(2 * np.pi * 0.1 * t) - x1
        return [x2, (1 - x1 * x1) * x2 - x1 + 2 * e + integral - 0.5 * x2, 0.5 * e]

    result = run(van_der_pol(), 30.0)
    solution = solve_ivp(
        equations, (0, 30), [1.0, 0.0, 0.0], method="DOP853", t_eval=result.time, rtol=1e-11, atol=1e-13
    )
    assert result["x1/y"] == pytest.approx(solution.y[0], abs=1e-8)
    assert result["x2/y"] == pytest.approx(solution.y[1], abs=1e-8)


def test_a_diagram_without_states_is_evaluated_at_the_sample_times() -> None:
    builder = DiagramBuilder("static")
    builder.add("square", MathFunction(function="square"), builder.add("clock", Clock()))
    result = run(builder.build(), 1.0)
    assert np.array_equal(result["square"], result.time**2)
