"""Sampled blocks compared with difference equations solved by NumPy and SciPy, tick by tick."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from armblocks.blocks import (
    Clock,
    CounterLimited,
    Delay,
    Difference,
    DigitalClock,
    DiscreteDerivative,
    DiscreteFilter,
    DiscreteFir,
    DiscreteIntegrator,
    DiscretePID,
    DiscreteStateSpace,
    DiscreteTransferFunction,
    RateLimiter,
    RateTransition,
    SineWave,
    TappedDelay,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, DiagramBuilder, trace_diagram
from armblocks.errors import InputError

T = 0.1
TIMES = T * np.arange(40)
U = 2.0 * np.sin(3.0 * TIMES + 0.4) + 0.3


def tick_outputs(block: Block, source: Block | None = None, count: int = 40) -> np.ndarray:
    """Return the output of a block at its first ticks; its input is ``source``, by default the sine ``U``."""
    builder = DiagramBuilder("d")
    source = source or SineWave(amplitude=2.0, frequency=3.0, phase=0.4, bias=0.3)
    inputs = [builder.add("source", source)] if block.input_ports() else []
    builder.add("block", block, *inputs)
    system = trace_diagram(builder.build())
    p = system.parameter_values
    update = system.update.casadi_function()
    z, outputs = system.initial_discrete(p)[0], list[np.ndarray]()
    ones = np.ones(len(system.clocks))
    for k in range(count):
        (after,) = update.call([np.array(value, dtype=float) for value in (k * T, (), z, (), p, ones)])
        z = np.asarray(after).ravel()
        outputs.append(system.discrete.unpack(z)["block/y"])
    return np.array(outputs)


def test_a_hold_samples_its_input_at_the_tick() -> None:
    assert tick_outputs(ZeroOrderHold(sample_time=T)) == pytest.approx(U, rel=1e-14)
    assert tick_outputs(RateTransition(sample_time=T)) == pytest.approx(U, rel=1e-14)
    assert tick_outputs(DigitalClock(sample_time=T)).tolist() == [k * T for k in range(40)]


def test_a_held_output_does_not_change_between_ticks_of_its_clock() -> None:
    builder = DiagramBuilder("d")
    builder.add("hold", ZeroOrderHold(sample_time=T), builder.add("t", Clock()))
    system = trace_diagram(builder.build())
    assert system.update(3.0, (), [1.5], (), system.parameter_values, [0.0])[0].tolist() == [1.5]


def test_delays_output_earlier_inputs() -> None:
    assert tick_outputs(UnitDelay(initial=7.0, sample_time=T)) == pytest.approx([7.0, *U[:-1]], rel=1e-14)
    delayed = tick_outputs(Delay(length=3, initial=7.0, sample_time=T))
    assert delayed == pytest.approx([7.0, 7.0, 7.0, *U[:-3]], rel=1e-14)
    taps = tick_outputs(TappedDelay(length=3, initial=7.0, sample_time=T))
    padded = np.concatenate([[7.0] * 3, U])
    assert taps == pytest.approx(np.array([padded[k : k + 3] for k in range(40)]), rel=1e-14)


def test_vectors_are_delayed_by_element() -> None:
    source = SineWave(amplitude=[1.0, 2.0], frequency=3.0)
    delayed = tick_outputs(Delay(length=2, sample_time=T), source)
    expected = np.outer(np.sin(3.0 * TIMES), [1.0, 2.0])
    assert delayed[2:] == pytest.approx(expected[:-2], rel=1e-14)
    assert not delayed[:2].any()


def test_a_delay_of_matrices_is_refused() -> None:
    with pytest.raises(InputError, match=r"'u' has shape \(2, 2\)\. Allowed: a scalar or a vector"):
        Delay().output_shapes({"u": (2, 2)})


def test_integrators_agree_with_the_sums_of_the_three_integration_rules() -> None:
    sums = 0.5 + np.concatenate([[0.0], np.cumsum(2.0 * T * U)])
    rules = {
        "forward_euler": sums[:-1],
        "backward_euler": sums[1:],
        "trapezoidal": (sums[:-1] + sums[1:]) / 2,
    }
    for rule, expected in rules.items():
        block = DiscreteIntegrator(method=rule, gain=2.0, initial=0.5, sample_time=T)
        # rounding errors of forty sums
        assert tick_outputs(block) == pytest.approx(expected, rel=1e-13)


def test_a_limited_integrator_leaves_its_limit_without_delay() -> None:
    outputs = tick_outputs(DiscreteIntegrator(lower=-0.1, upper=0.2, sample_time=T))
    x = [0.0]
    for u in U[:-1]:
        x.append(min(max(x[-1] + T * u, -0.1), 0.2))
    assert outputs == pytest.approx(x, rel=1e-13, abs=1e-15)
    assert {0.2, -0.1} <= set(outputs)


def test_difference_and_derivative_agree_with_numpy() -> None:
    differences = np.diff(U, prepend=0.5)
    assert tick_outputs(Difference(initial=0.5, sample_time=T)) == pytest.approx(differences, abs=1e-14)
    assert tick_outputs(DiscreteDerivative(gain=3.0, initial=0.5, sample_time=T)) == pytest.approx(
        3.0 * differences / T, abs=1e-12
    )


@pytest.mark.parametrize("b", [(2.0,), (1.0, -0.4), (0.5, 0.2, 0.7)])
def test_transfer_functions_and_filters_agree_with_scipy(b: tuple[float, ...]) -> None:
    a = (2.0, -1.0, 0.9)
    powers_of_z = signal.lfilter(np.pad(b, (3 - len(b), 0)), a, U)
    assert tick_outputs(DiscreteTransferFunction(numerator=b, denominator=a, sample_time=T)) == pytest.approx(
        powers_of_z, abs=1e-13
    )
    assert tick_outputs(DiscreteFilter(numerator=b, denominator=a, sample_time=T)) == pytest.approx(
        signal.lfilter(b, a, U), abs=1e-13
    )
    if len(b) > 1:
        expected = signal.lfilter(b, [1.0], U)
        assert tick_outputs(DiscreteFir(coefficients=b, sample_time=T)) == pytest.approx(expected, abs=1e-14)


def test_a_filter_with_a_numerator_longer_than_the_denominator_agrees_with_scipy() -> None:
    block = DiscreteFilter(numerator=(1.0, 2.0, 3.0), denominator=(1.0, -0.5), sample_time=T)
    assert tick_outputs(block) == pytest.approx(signal.lfilter([1.0, 2.0, 3.0], [1.0, -0.5], U), abs=1e-13)


def test_a_state_space_system_agrees_with_its_recurrence() -> None:
    A, B, C, D = [[0.9, 0.2], [-0.3, 0.8]], [[1.0], [0.5]], [[1.0, 2.0]], [[0.3]]
    _, y, _ = signal.dlsim((A, B, C, D, T), U, x0=[0.1, -0.2])
    source = SineWave(amplitude=[2.0], frequency=3.0, phase=0.4, bias=0.3)
    block = DiscreteStateSpace(A=A, B=B, C=C, D=D, initial=[0.1, -0.2], sample_time=T)
    assert tick_outputs(block, source).ravel() == pytest.approx(y.ravel(), abs=1e-13)


@pytest.mark.parametrize("anti_windup", ["none", "clamping", "back_calculation"])
def test_a_pid_controller_agrees_with_its_recurrence(anti_windup: str) -> None:
    P, I, D, N, low, high, Kb = 2.0, 3.0, 0.1, 5.0, -1.0, 1.5, 4.0  # noqa: E741
    block = DiscretePID(
        P=P, I=I, D=D, N=N, lower=low, upper=high, anti_windup=anti_windup, Kb=Kb, sample_time=T
    )
    i = f = 0.0
    expected: list[float] = []
    for u in U:
        free = P * u + i + N * (D * u - f)
        y = min(max(free, low), high)
        rate = I * u
        if anti_windup == "clamping" and free != y and (free > y) == (rate > 0):
            rate = 0.0
        if anti_windup == "back_calculation":
            rate += Kb * (y - free)
        expected.append(y)
        i, f = i + T * rate, f + T * N * (D * u - f)
    assert tick_outputs(block) == pytest.approx(expected, abs=1e-12)
    assert high in expected


def test_a_rate_limiter_agrees_with_its_recurrence() -> None:
    actual = tick_outputs(RateLimiter(rising=3.0, falling=-2.0, initial=0.1, sample_time=T))
    y, expected = 0.1, []
    for u in U:
        y = min(max(u, y - 2.0 * T), y + 3.0 * T)
        expected.append(y)
    assert actual == pytest.approx(expected, rel=1e-13)


def test_a_limited_counter_restarts_at_zero() -> None:
    assert tick_outputs(CounterLimited(upper=2, sample_time=T), count=7).tolist() == [0, 1, 2, 0, 1, 2, 0]


def test_matrices_of_inconsistent_shapes_are_refused() -> None:
    with pytest.raises(InputError, match=r"DiscreteStateSpace: A is \(1, 1\), B is \(2, 1\).*the shapes"):
        DiscreteStateSpace(B=[[1.0], [2.0]])
    with pytest.raises(InputError, match=r"DiscreteStateSpace.initial: initial has shape \(2,\)"):
        DiscreteStateSpace(initial=[1.0, 2.0])


def test_invalid_filter_coefficients_are_refused() -> None:
    with pytest.raises(InputError, match=r"DiscreteTransferFunction: the denominator is \[0\.0, 1\.0\]"):
        DiscreteTransferFunction(denominator=(0.0, 1.0))
    with pytest.raises(InputError, match=r"DiscreteFilter: the denominator is \[1\.0\].*use a Gain"):
        DiscreteFilter(denominator=(1.0,))
    with pytest.raises(InputError, match=r"DiscreteFir\.coefficients: there is one coefficient"):
        DiscreteFir(coefficients=(1.0,))
