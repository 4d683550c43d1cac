"""Diagrams simulated with stiff solvers: agreement with explicit solvers and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Expression, Integrator, Relay, Step


@pytest.mark.parametrize(
    ("name", "signals"),
    [("van_der_pol_pid", ("x1", "x2")), ("falling_pendulum", ("pendulum/q", "pendulum/qd"))],
)
def test_shipped_diagrams_give_equal_results_with_explicit_and_stiff_solvers(
    name: str, signals: tuple[str, ...]
) -> None:
    runs = [ab.simulate(name, stop_time=5.0, solver=s, rtol=1e-9, atol=1e-12) for s in ("dop853", "rodas5p")]
    for signal in signals:
        np.testing.assert_allclose(runs[1][signal], runs[0][signal], rtol=1e-6, atol=2e-7)


def loop_diagram(rate: float = 1e4) -> ab.Diagram:
    """An implicit loop ``y = cos(y + x)`` with an independent x, followed by a lag of ``rate``."""
    builder = ab.DiagramBuilder("implicit and stiff")
    x = builder.add("x", Integrator(initial=0.0))
    drive = builder.add("drive", Expression(formula="cos(t)", inputs=0))
    builder.connect(drive, x["u"])
    loop = builder.add("loop", Expression(formula="cos(u1 + u2)", inputs=2))
    builder.connect(loop, loop["u1"])
    builder.connect(x, loop["u2"])
    lag = builder.add("lag", Integrator(initial=0.7390851332151607))
    pull = builder.add("pull", Expression(formula=f"{rate} * (u1 - u2)", inputs=2), loop, lag)
    builder.connect(pull, lag["u"])
    return builder.build()


@pytest.mark.parametrize("solver", ["rodas5p", "ros23", "auto"])
def test_an_implicit_loop_before_a_fast_lag_is_solved(solver: str) -> None:
    """The error of the lag is ``y' / rate``, with ``y' = -sin(y + x) x' / (1 + sin(y + x))``."""
    result = ab.simulate(loop_diagram(), stop_time=2.0, solver=solver, rtol=1e-7, atol=1e-10)
    x, y = np.sin(result.time), result["loop"]
    np.testing.assert_allclose(result["x"], x, atol=1e-6)
    np.testing.assert_allclose(y, np.cos(y + result["x"]), rtol=1e-13)
    slope = -np.sin(y + x) * np.cos(result.time) / (1.0 + np.sin(y + x))
    after = result.time > 0.01
    np.testing.assert_allclose(result["lag"][after], (y - slope / 1e4)[after], atol=2e-7)


@pytest.mark.parametrize(("solver", "step"), [("rodas5p", None), ("ros23", None), ("ros5", 0.01)])
def test_a_relay_after_a_fast_lag_switches_at_the_known_times(solver: str, step: float | None) -> None:
    """``x' = -relay(lag)`` with a lag of 1e5 1/s: a triangle between -0.5 and 0.5, slightly delayed."""
    builder = ab.DiagramBuilder("triangle")
    x = builder.add("x", Integrator(initial=0.0))
    lag = builder.add("lag", Integrator(initial=0.0))
    pull = builder.add("pull", Expression(formula="1e5 * (u1 - u2)", inputs=2), x, lag)
    builder.connect(pull, lag["u"])
    relay = builder.add("relay", Relay(on_point=0.5, off_point=-0.5, on_value=1.0, off_value=-1.0), lag)
    builder.connect(builder.add("minus", Expression(formula="-u"), relay), x["u"])
    result = ab.simulate(builder.build(), stop_time=9.9, solver=solver, step=step, sample_time=0.1)
    # x rises from 0 (the relay starts off); peaks at 0.5 s, 2.5 s …, each about 1e-5 s late due to the lag.
    t = result.time
    expected = 0.5 - np.abs((t + 0.5) % 2.0 - 1.0)
    np.testing.assert_allclose(result["x"], expected, atol=3e-4)
    assert result.run.events == 10


def test_a_jump_of_the_input_starts_a_new_stiff_transient() -> None:
    """A step at 1 s through a lag of 1e-3 s: 0 before it, ``1 - exp(-1000 (t - 1))`` after it."""
    builder = ab.DiagramBuilder("step")
    lag = builder.add("lag", Integrator(initial=0.0))
    jump = builder.add("jump", Step(time=1.0, final=1.0))
    builder.connect(builder.add("pull", Expression(formula="1e3 * (u1 - u2)", inputs=2), jump, lag), lag["u"])
    result = ab.simulate(builder.build(), stop_time=1.01, solver="rodas5p", sample_time=1e-3, rtol=1e-8)
    t = result.time
    expected = np.where(t < 1.0, 0.0, -np.expm1(-1e3 * np.maximum(t - 1.0, 0.0)))
    np.testing.assert_allclose(result["lag"], expected, atol=1e-6)
