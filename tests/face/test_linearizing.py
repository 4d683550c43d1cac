"""Exact linear systems of diagrams compared with closed forms and simulations."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import armblocks as ab
from armblocks.blocks import (
    Constant,
    Expression,
    ForwardDynamics,
    Gain,
    Inport,
    Integrator,
    Outport,
    Saturation,
    Subsystem,
    Sum,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.errors import ArmblocksWarning, InputError, SimulationError, UnknownNameError


def oscillator(mass: float = 2.0, damping: float = 0.4, stiffness: float = 8.0) -> ab.Diagram:
    """m x'' = force - c x' - k x."""
    builder = ab.DiagramBuilder("oscillator")
    force = builder.add("force", Constant(value=3.0))
    total = builder.add("sum", Sum(signs="+--"), force)
    rate = builder.add("mass", Gain(gain=1.0 / mass), total)
    speed = builder.add("v", Integrator(), rate)
    angle = builder.add("x", Integrator(), speed)
    builder.connect(builder.add("c", Gain(gain=damping), speed), total["u2"])
    builder.connect(builder.add("k", Gain(gain=stiffness), angle), total["u3"])
    return builder.build()


def test_the_matrices_of_an_oscillator_agree_with_the_textbook() -> None:
    system = ab.linearize(oscillator(), "force", ["x", "v"])
    assert system.states == ("v/x", "x/x")
    assert np.array_equal(system.A, [[-0.2, -4.0], [1.0, 0.0]])
    assert np.array_equal(system.B, [[0.5], [0.0]])
    assert np.array_equal(system.C, [[0.0, 1.0], [1.0, 0.0]])
    assert np.array_equal(system.D, np.zeros((2, 1)))


def test_a_parameter_may_be_the_input_of_a_linear_system() -> None:
    signal, value = (ab.linearize(oscillator(), name, "x") for name in ("force", "force.value"))
    assert np.array_equal(signal.B, value.B)
    stiffness = ab.linearize(oscillator(), "k.gain", "x", at=5.0)
    assert stiffness.point is not None
    # d(v')/dk = -x / m
    assert stiffness.B[0, 0] == pytest.approx(-float(stiffness.point.signals["x/y"]) / 2.0, rel=1e-12)


def test_an_opened_loop_is_cut_at_its_signal() -> None:
    loop = ab.linearize(oscillator(), "sum", "sum", open="sum")
    # The loop is cut at the sum: its transfer function is -(c s + k) / (m s^2).
    s = 0.7 + 1.3j
    assert loop.at(s)[0, 0] == pytest.approx(-(0.4 * s + 8.0) / (2.0 * s**2), rel=1e-12)
    closed = ab.linearize(oscillator(), "sum", "sum")
    assert closed.at(s)[0, 0] == pytest.approx(loop.at(s)[0, 0] / (1.0 - loop.at(s)[0, 0]), rel=1e-12)


def test_an_input_port_perturbs_one_connection_and_an_output_port_all() -> None:
    one = ab.linearize(oscillator(), "c/u", ["v", "c/u"])
    assert np.array_equal(one.B[:, 0], [-0.2, 0.0])
    assert np.array_equal(one.D[:, 0], [0.0, 1.0])  # before and after the perturbed port
    both = ab.linearize(oscillator(), "v", "v")
    assert np.array_equal(both.B[:, 0], [-0.2, 1.0])


def pendulum() -> ab.Diagram:
    """qdd = torque - sin(q), with q(0) = 0.5 rad."""
    builder = ab.DiagramBuilder("pendulum")
    torque = builder.add("torque", Constant(value=0.0))
    total = builder.add("sum", Sum(signs="+-"), torque)
    speed = builder.add("qd", Integrator(initial=0.2), total)
    angle = builder.add("q", Integrator(initial=0.5), speed)
    builder.connect(builder.add("sine", Expression(formula="sin(u)"), angle), total["u2"])
    return builder.build()


def test_several_times_give_one_linear_system_each() -> None:
    diagram = pendulum()
    systems = ab.linearize(diagram, "torque", "q", at=[2.0, 0.0, 1.0], rtol=1e-10, atol=1e-12)
    result = ab.simulate(diagram, stop_time=2.0, sample_time=1.0, rtol=1e-10, atol=1e-12)
    for system, k in zip(systems, (2, 0, 1)):
        slope = system.A[system.states.index("qd/x"), system.states.index("q/x")]
        assert slope == pytest.approx(-np.cos(float(result["q"][k])), abs=1e-9)
    from_state = ab.linearize(diagram, "torque", "q", at=result.final_state)
    assert np.allclose(from_state.A, systems[0].A, atol=1e-9, rtol=0.0)


def test_the_gain_of_a_limiter_at_its_limit_is_zero() -> None:
    def gain_at(value: float) -> float:
        builder = ab.DiagramBuilder("limiter")
        source = builder.add("u", Constant(value=value))
        builder.add("limit", Saturation(lower=-1.0, upper=1.0), source)
        return float(ab.linearize(builder.build(), "u", "limit").D[0, 0])

    assert gain_at(0.5) == 1.0
    assert gain_at(2.0) == 0.0


def sampled_servo(period: float) -> ab.Diagram:
    """x' = -x + hold(gain (1 - x)), with a hold of the given period."""
    builder = ab.DiagramBuilder("servo")
    reference = builder.add("reference", Constant(value=1.0))
    error = builder.add("error", Sum(signs="+-"), reference)
    held = builder.add("hold", ZeroOrderHold(sample_time=period), builder.add("gain", Gain(gain=2.0), error))
    rate = builder.add("rate", Sum(signs="+-"), held)
    state = builder.add("x", Integrator(), rate)
    builder.connect(state, rate["u2"])
    builder.connect(state, error["u2"])
    return builder.build()


def test_the_linear_system_of_a_sampled_loop_is_the_map_over_one_period() -> None:
    period = 0.3
    system = ab.linearize(sampled_servo(period), "reference", "x")
    decay = np.exp(-period)
    assert system.dt == period
    assert system.states == ("x/x",)  # the held output is computed again at every tick
    assert system.A[0, 0] == pytest.approx(decay - 2.0 * (1.0 - decay), rel=1e-14)
    assert system.B[0, 0] == pytest.approx(2.0 * (1.0 - decay), rel=1e-14)
    assert np.array_equal(system.C, [[1.0]])


def test_the_run_of_a_sampled_loop_agrees_with_its_linear_system() -> None:
    diagram, period = sampled_servo(0.3), 0.3
    system = ab.linearize(diagram, "reference", "x")
    result = ab.simulate(diagram, stop_time=6.0, sample_time=period, rtol=1e-11, atol=1e-13)
    answer = system.step_response(6.0)
    assert np.allclose(answer.values[:, 0, 0], result["x"], atol=1e-9)


@pytest.mark.parametrize(("fast_every", "slow_every", "unit"), [(2, 3, 0.1), (3, 10, 1.0 / 30.0)])
def test_clocks_of_several_rates_give_the_map_over_their_common_period(
    fast_every: int, slow_every: int, unit: float
) -> None:
    builder = ab.DiagramBuilder("two rates")
    source = builder.add("u", Constant(value=0.0))
    total = builder.add("sum", Sum(signs="+-"), source)
    fast = builder.add("fast", ZeroOrderHold(sample_time=round(fast_every * unit, 12)), total)
    state = builder.add("x", Integrator(), fast)
    # 1/3 s is not exact in binary: its double equals a third only up to rounding.
    slow = ZeroOrderHold(sample_time=slow_every / round(1.0 / unit))
    builder.connect(builder.add("slow", slow, state), total["u2"])
    system = ab.linearize(builder.build(), "u", "x")
    assert system.dt == pytest.approx(fast_every * slow_every * unit, rel=1e-15)

    # Reference for 0.2 s and 0.3 s: slow samples x at 0 and 0.3, fast samples u - slow at 0, 0.2, 0.4.
    def period(x: float, slow: float, u: float) -> float:
        fast_value = 0.0
        for k in range(fast_every * slow_every):
            if k % slow_every == 0:
                slow = x
            if k % fast_every == 0:
                fast_value = u - slow
            x += unit * fast_value
        return x

    assert system.A[0, 0] == pytest.approx(period(1.0, 0.0, 0.0), rel=1e-13)
    assert system.B[0, 0] == pytest.approx(period(0.0, 0.0, 1.0), rel=1e-13)


def test_two_unit_delays_have_the_transfer_function_z_to_the_minus_2() -> None:
    builder = ab.DiagramBuilder("delays")
    source = builder.add("u", Constant(value=0.0))
    first = builder.add("first", UnitDelay(sample_time=0.1), source)
    builder.add("second", UnitDelay(sample_time=0.1), first)
    system = ab.linearize(builder.build(), "u", "second")
    z = 1.3 + 0.4j
    assert system.at(z)[0, 0] == pytest.approx(z**-2, rel=1e-14)


def test_an_implicit_equation_is_eliminated_exactly() -> None:
    builder = ab.DiagramBuilder("implicit")
    state = builder.add("x", Integrator(initial=0.7))
    total = builder.add("sum", Sum(signs="+-"), state)
    cube = builder.add("cube", Expression(formula="u^3"), total)
    builder.connect(cube, total["u2"])
    builder.connect(builder.add("back", Gain(gain=-1.0), total), state["u"])
    system = ab.linearize(builder.build(), "x", "sum")
    assert system.point is not None
    y = float(system.point.signals["sum/y"])  # y + y^3 = x
    assert y + y**3 == pytest.approx(0.7, rel=1e-14)
    assert system.D[0, 0] == pytest.approx(1.0 / (1.0 + 3.0 * y**2), rel=1e-13)
    assert system.A[0, 0] == pytest.approx(-1.0 / (1.0 + 3.0 * y**2), rel=1e-13)


def test_a_held_input_of_a_state_space_plant_gives_the_matrix_exponential() -> None:
    A = np.array([[0.0, 1.0], [-4.0, -0.2]])
    builder = ab.DiagramBuilder("plant")
    source = builder.add("u", Constant(value=0.0))
    held = builder.add("hold", ZeroOrderHold(sample_time=0.25), source)
    total = builder.add("sum", Sum(signs="+--"), held)
    speed = builder.add("v", Integrator(), total)
    angle = builder.add("q", Integrator(), speed)
    builder.connect(builder.add("c", Gain(gain=0.2), speed), total["u2"])
    builder.connect(builder.add("k", Gain(gain=4.0), angle), total["u3"])
    system = ab.linearize(builder.build(), "u", "q")
    assert system.states == ("q/x", "v/x")
    assert np.allclose(system.A, expm(A * 0.25), rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("name", ab.list_examples())
def test_every_shipped_example_is_linearised(name: str) -> None:
    system = ab.linearize(name)
    assert np.isfinite(system.A).all()


def test_unknown_names_and_unsuitable_times_are_refused() -> None:
    diagram = oscillator()
    with pytest.raises(UnknownNameError, match="there is no block named 'forse'"):
        ab.linearize(diagram, "forse")
    with pytest.raises(UnknownNameError, match="there is no port named 'z'"):
        ab.linearize(diagram, "sum/z")
    with pytest.raises(UnknownNameError, match="there is no tunable parameter named 'gian'"):
        ab.linearize(diagram, "k.gian")
    with pytest.raises(UnknownNameError, match="there is no signal named 'y'"):
        ab.linearize(diagram, "force", "y")
    with pytest.raises(InputError, match="the input 'force' is given twice"):
        ab.linearize(diagram, ["force", "force"])
    with pytest.raises(InputError, match="the times to linearize at are"):
        ab.linearize(diagram, at=[-1.0])
    with pytest.raises(InputError, match="the state of 'pendulum' at 1 s has other variables"):
        ab.linearize(diagram, at=ab.simulate(pendulum(), stop_time=1.0).final_state)


def test_a_block_with_several_outputs_without_a_port_is_refused() -> None:
    with pytest.raises(InputError, match=r"is a block with 3 outputs.*Fix: name the port"):
        ab.linearize("puma560_computed_torque", "arm")


def test_clocks_without_a_common_period_are_refused() -> None:
    builder = ab.DiagramBuilder("odd clocks")
    source = builder.add("u", Constant(value=0.0))
    builder.add("a", ZeroOrderHold(sample_time=0.001), source)
    builder.add("b", ZeroOrderHold(sample_time=0.99999), source)
    with pytest.raises(InputError, match=r"the clocks .* have the common period 99.999 s with 100099 ticks"):
        ab.linearize(builder.build())


def test_a_derivative_that_is_not_finite_is_refused() -> None:
    builder = ab.DiagramBuilder("root")
    state = builder.add("x", Integrator(initial=0.0))
    builder.connect(builder.add("root", Expression(formula="sqrt(u)"), state), state["u"])
    with pytest.raises(SimulationError, match="the derivative of the rate of state 'x/x' is not finite"):
        ab.linearize(builder.build())


def implicit(value: float, formula: str) -> ab.Diagram:
    """A diagram with the implicit equation w = formula(w, value)."""
    builder = ab.DiagramBuilder("implicit")
    source = builder.add("u", Constant(value=value))
    answer = builder.add("answer", Expression(formula=formula, inputs=2), source)
    builder.connect(answer, answer["u2"])
    return builder.build()


def test_implicit_equations_without_a_solution_are_refused() -> None:
    with pytest.raises(SimulationError, match="has no solution near the start value"):
        ab.linearize(implicit(1.0, "u2 + u2^2 + u1"))
    with pytest.raises(SimulationError, match="are singular at this point"):
        ab.linearize(implicit(0.0, "u2 + u2^3 + u1"))


def test_signals_in_a_subsystem_are_linearised_as_in_a_flat_diagram() -> None:
    inside = ab.DiagramBuilder("inside")
    entry = inside.add("in", Inport())
    lag = inside.add("lag", Sum(signs="+-"), entry)
    state = inside.add("x", Integrator(), lag)
    inside.connect(state, lag["u2"])
    inside.add("out", Outport(), inside.add("gain", Gain(gain=3.0), state))
    outside = ab.DiagramBuilder("outside")
    source = outside.add("u", Constant(value=1.0))
    plant = outside.add("plant", Subsystem(diagram=inside.build()), source)
    outside.add("twice", Gain(gain=2.0), plant)
    diagram = outside.build()
    s = 0.3 + 2.0j
    for inputs in ("u", "u/y", "plant/lag/u1"):
        system = ab.linearize(diagram, inputs, ["twice", "plant", "plant/x"])
        assert np.allclose(system.at(s)[:, 0], np.array([6.0, 3.0, 1.0]) / (s + 1.0), rtol=1e-13)
    assert ab.linearize(diagram, "plant/gain.gain", "twice").D[0, 0] == 0.0


def test_the_linearised_puma_agrees_with_mass_matrix_and_gravity_gradient() -> None:
    puma = ab.load_robot("puma560")
    q = np.array([0.1, 0.6, -0.4, 0.2, 0.5, -0.3])
    builder = ab.DiagramBuilder("puma")
    torque = builder.add("torque", Constant(value=puma.gravload(q)))
    builder.add("arm", ForwardDynamics(robot=puma.robot, q0=q), torque)
    # The Coulomb friction jumps at rest.
    with pytest.warns(ArmblocksWarning, match="block 'arm' is exactly at a limit or at a jump"):
        system = ab.linearize(builder.build(), "torque", "arm/q")
    inverse = np.linalg.inv(puma.inertia(q))
    assert np.allclose(system.B[6:], inverse, rtol=1e-9, atol=1e-9)
    step = 1e-5
    slope = np.column_stack(
        [(puma.gravload(q + e) - puma.gravload(q - e)) / (2 * step) for e in step * np.eye(6)]
    )
    # In equilibrium the derivative of qdd with respect to q is that of the gravity load; central differences
    # have the error h^2.
    assert np.allclose(system.A[6:, :6], -inverse @ slope, rtol=0.0, atol=1e-5 * np.abs(inverse).max())
    assert np.array_equal(system.A[:6, 6:], np.eye(6))
