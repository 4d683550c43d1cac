"""Dead time in linear systems: exact frequency response, approximation by states, and steady state."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    Constant,
    Derivative,
    FirstOrderLag,
    Gain,
    Integrator,
    Sum,
    TransportDelay,
    VariableTimeDelay,
    ZeroOrderHold,
)
from armblocks.errors import InputError

FREQUENCIES = np.array([0.05, 0.4, 1.0, 3.0, 9.0, 30.0])
S = 1j * FREQUENCIES
DELAY = 0.5


def loop() -> ab.Diagram:
    """x' = c - x(t - 0.5): X / C = 1 / (s + exp(-s / 2))."""
    builder = ab.DiagramBuilder("loop")
    x = builder.add("x", Integrator(initial=0.2))
    late = builder.add("late", TransportDelay(delay=DELAY), x)
    builder.connect(builder.add("sum", Sum(signs="+-"), builder.add("c", Constant()), late), x["u"])
    return builder.build()


def response(diagram: ab.Diagram, source: str, output: str) -> np.ndarray:
    return ab.frequency_response(diagram, source, output, FREQUENCIES)[:, 0, 0]


def test_the_frequency_response_of_a_loop_with_dead_time_is_exact() -> None:
    np.testing.assert_allclose(response(loop(), "c", "x"), 1.0 / (S + np.exp(-DELAY * S)), rtol=1e-13)


def test_the_frequency_response_with_an_opened_signal_is_that_of_the_open_loop() -> None:
    actual = ab.frequency_response(loop(), "x", "x", FREQUENCIES, open="x")[:, 0, 0]
    np.testing.assert_allclose(actual, -np.exp(-DELAY * S) / S, rtol=1e-13)


def test_the_response_of_delays_in_series_and_of_their_derivative_is_exact() -> None:
    """A delay in series with a delay that has a parallel direct path; a Derivative multiplies by s."""
    builder = ab.DiagramBuilder("row")
    u = builder.add("u", Constant())
    lag = builder.add("lag", FirstOrderLag(), u)
    first = builder.add("first", TransportDelay(delay=0.3), lag)
    second = builder.add("second", TransportDelay(delay=0.45), builder.add("both", Sum(), first, lag))
    builder.add("rate", Derivative(), second)
    expected = (np.exp(-0.3 * S) + 1.0) * np.exp(-0.45 * S) / (S + 1.0)
    np.testing.assert_allclose(response(builder.build(), "u", "second"), expected, rtol=1e-12)
    np.testing.assert_allclose(response(builder.build(), "u", "rate"), S * expected, rtol=1e-12)
    system = ab.linearize(builder.build(), "u", "second", delay_order=10)
    assert system.order == 21
    # an approximation of order 10 has an error of 1e-9 up to 9 rad/s, where |s| T = 4
    assert np.abs(system.frequency_response(FREQUENCIES[:5])[:, 0, 0] - expected[:5]).max() < 1e-9


def test_the_error_of_the_approximation_decreases_with_its_order() -> None:
    exact = 1.0 / (S + np.exp(-DELAY * S))
    errors = [
        np.abs(
            ab.linearize(loop(), "c", "x", delay_order=order).frequency_response(FREQUENCIES)[:, 0, 0] - exact
        )[:5].max()
        for order in range(1, 11)
    ]
    assert all(after < 0.3 * before for before, after in itertools.pairwise(errors))
    assert errors[-1] < 1e-11


def test_the_approximation_has_gain_1_and_the_slowest_poles_of_the_delay() -> None:
    """The slowest pole is the root of s + exp(-s T) near -1.6 + 1.5 j, found by Newton's method."""
    poles = ab.linearize(loop(), "c", "x", delay_order=10).poles()
    slowest = -1.6 + 1.5j
    for _ in range(20):
        late = np.exp(-DELAY * slowest)
        slowest -= (slowest + late) / (1.0 - DELAY * late)
    assert np.abs(poles - slowest).min() < 1e-10
    builder = ab.DiagramBuilder("late")
    builder.add("late", TransportDelay(delay=2.0), builder.add("u", Constant()))
    for order in (1, 3, 10):
        gains = np.abs(
            ab.linearize(builder.build(), "u", "late", delay_order=order).frequency_response(FREQUENCIES)
        )
        np.testing.assert_allclose(gains, 1.0, rtol=1e-9)


def test_dead_time_in_a_sampled_system_agrees_with_its_transfer_function() -> None:
    """A hold of 0.1 s, a dead time of two periods and a lag: (1 - a) / (z - a) / z^2 at low frequencies."""
    builder = ab.DiagramBuilder("sampled")
    hold = builder.add("hold", ZeroOrderHold(sample_time=0.1), builder.add("u", Constant()))
    late = builder.add("late", TransportDelay(delay=0.2), builder.add("lag", FirstOrderLag(), hold))
    builder.add("sampled", ZeroOrderHold(sample_time=0.1), late)
    system = ab.linearize(builder.build(), "u", "sampled", delay_order=8)
    assert system.dt == 0.1
    z = np.exp(0.1j * FREQUENCIES[:4])
    a = np.exp(-0.1)
    expected = (1 - a) / (z - a) / z**2
    # a step contains all frequencies; the approximation has too little delay far above order / delay
    np.testing.assert_allclose(
        system.frequency_response(FREQUENCIES[:4])[:, 0, 0], expected, atol=2e-3, rtol=0
    )
    with pytest.raises(
        InputError, match=r"is in one diagram with the clock of 0.1 s.*frequency_response of the result"
    ):
        response(builder.build(), "u", "sampled")


def test_a_variable_delay_is_linearised_with_its_present_value() -> None:
    builder = ab.DiagramBuilder("variable")
    u, delay = builder.add("u", Constant()), builder.add("T", Constant(value=0.7))
    builder.add(
        "late", VariableTimeDelay(shortest=0.1, longest=2.0), builder.add("lag", FirstOrderLag(), u), delay
    )
    actual = ab.frequency_response(builder.build(), "u", "late", FREQUENCIES, at=5.0)[:, 0, 0]
    np.testing.assert_allclose(actual, np.exp(-0.7 * S) / (S + 1.0), rtol=1e-12)


def test_a_diagram_without_dead_time_has_the_response_of_its_linear_system() -> None:
    builder = ab.DiagramBuilder("plain")
    x = builder.add("x", Integrator(), builder.add("u", Constant()))
    builder.add("y", Gain(gain=2.0), x)
    np.testing.assert_allclose(response(builder.build(), "u", "y"), 2.0 / S, rtol=1e-14)


@pytest.mark.parametrize("order", [0, 11, 2.0, True])
def test_an_order_that_is_not_an_integer_from_1_to_10_is_refused(order: int) -> None:
    with pytest.raises(InputError, match=r"the delay_order is .*an integer from 1 to 10.*begin with"):
        ab.linearize(loop(), "c", "x", delay_order=order)


def test_without_an_order_dead_time_is_refused() -> None:
    with pytest.raises(InputError, match=r"the dead time of late has no finite.*give delay_order=3"):
        ab.linearize(loop(), "c", "x")


def test_in_steady_state_the_output_of_a_delay_equals_its_input() -> None:
    actual = ab.trim(loop())
    assert float(actual.point.states["x/x"]) == pytest.approx(1.0, rel=1e-12)
    assert float(actual.point.discrete["late/past"]) == pytest.approx(1.0, rel=1e-12)
    run = ab.simulate(loop(), stop_time=30.0, rtol=1e-9)
    assert run["x"][-1] == pytest.approx(1.0, abs=1e-7)
