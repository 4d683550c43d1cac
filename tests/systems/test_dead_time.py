"""Dead time compared with the method of steps, closed forms and SciPy, for fixed and adaptive steps."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from armblocks.blocks import (
    Clock,
    CompareToConstant,
    Constant,
    DeadZone,
    Derivative,
    Expression,
    Gain,
    Integrator,
    Mux,
    PulseGenerator,
    Ramp,
    Relay,
    Saturation,
    SecondOrderIntegrator,
    SineWave,
    Sqrt,
    Step,
    Sum,
    TransportDelay,
    VariableTimeDelay,
    VariableTransportDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Diagram, DiagramBuilder, trace_diagram
from armblocks.equations import SimulationOptions
from armblocks.errors import DiagramError, SimulationError
from armblocks.integration.native_integrator import INITIAL_CAPACITY
from armblocks.integration.system import compile_system
from armblocks.simulation import RunState, SimulationResult, simulate
from compiled_diagrams import compiled

Run = Callable[..., SimulationResult]


def native(**settings: object) -> Run:
    def run(diagram: Diagram, stop: float, **more: object) -> SimulationResult:
        chosen = {"stop_time": stop, "sample_time": stop / 200} | settings | more
        options = SimulationOptions(**chosen)  # pyright: ignore
        return simulate(compiled(diagram), options)

    return run


RUNS = {
    "rk45": native(solver="rk45", rtol=1e-10, atol=1e-12),
    "dop853": native(solver="dop853", rtol=1e-10, atol=1e-12),
    "rk4": native(solver="rk4", step=0.01),
}


@pytest.fixture(params=RUNS.values(), ids=RUNS)
def run(request: pytest.FixtureRequest) -> Run:
    return request.param


def close(actual: np.ndarray, expected: np.ndarray, tolerance: float) -> None:
    assert actual == pytest.approx(expected, abs=tolerance)


def decay(delay: float = 1.0) -> Diagram:
    """x' = -x(t - delay) with x = 1 for t <= 0."""
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator(initial=1.0))
    late = builder.add("late", TransportDelay(delay=delay, initial=1.0), x)
    builder.connect(builder.add("minus", Gain(gain=-1.0), late), x["u"])
    return builder.build()


def decay_solution(t: float) -> float:
    """The method of steps in fractions: the sum of (-1)^k (t - (k - 1))^k / k! over all k with t >= k - 1."""
    time, total, k = Fraction(t), Fraction(1), 1
    while time >= k - 1:
        total += (-1) ** k * (time - (k - 1)) ** k / math.factorial(k)
        k += 1
    return float(total)


def test_a_delayed_decay_agrees_with_the_method_of_steps(run: Run) -> None:
    result = run(decay(), 10.0)
    expected = np.array([decay_solution(t) for t in result.time])
    close(result["x/y"], expected, 5e-9)
    close(
        result["late/y"], np.array([decay_solution(t - 1.0) if t > 1.0 else 1.0 for t in result.time]), 5e-9
    )


def test_the_error_of_the_history_is_proportional_to_the_tolerance() -> None:
    """Tighter tolerances give proportionally smaller errors for any length of the steps."""
    errors = []
    for rtol in (1e-4, 1e-6, 1e-8, 1e-10):
        result = native(solver="rk45", rtol=rtol, atol=rtol * 1e-3)(decay(), 10.0)
        expected = np.array([decay_solution(t) for t in result.time])
        errors.append(float(np.abs(result["x/y"] - expected).max()))
    assert errors[0] < 1e-3
    assert all(later < 0.1 * earlier for earlier, later in pairwise(errors))


def test_the_output_of_a_delayed_step_jumps_exactly_one_delay_later(run: Run) -> None:
    builder = DiagramBuilder("d")
    late = builder.add(
        "late", TransportDelay(delay=0.7, initial=-1.0), builder.add("step", Step(time=0.5, final=2.0))
    )
    builder.add("integral", Integrator(), late)
    result = run(builder.build(), 3.0)
    t = result.time
    close(result["integral/y"], -np.minimum(t, 0.7) + 2.0 * np.clip(t - 1.2, 0.0, None), 1e-12)
    assert result["late/y"].tolist() == np.select([t < 0.7, t < 1.2 - 1e-12], [-1.0, 0.0], 2.0).tolist()


def test_a_sine_is_delayed(run: Run) -> None:
    builder = DiagramBuilder("d")
    sines = builder.add("sines", SineWave(frequency=2.0, amplitude=(1.0, 3.0), phase=(0.0, 1.0)))
    builder.add("late", TransportDelay(delay=0.35, initial=(5.0, 6.0)), sines)
    builder.add("keeps the steps", Integrator(), builder.add("sine", SineWave(frequency=2.0)))
    result = run(builder.build(), 10.0)
    t = result.time[:, np.newaxis]
    expected = np.where(t < 0.35, [5.0, 6.0], np.array([1.0, 3.0]) * np.sin(2.0 * (t - 0.35) + [0.0, 1.0]))
    close(result["late/y"], expected, 2e-8)


CURVES: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "sqrt(u)": np.sqrt,
    "sqrt(u + 1e-12)": lambda t: np.sqrt(t + 1e-12),
    "sqrt(abs(u - 0.51))": lambda t: np.sqrt(np.abs(t - 0.51)),
    "sqrt(max(1.3 - u, 0))": lambda t: np.sqrt(np.maximum(1.3 - t, 0.0)),
    "sin(40*u)": lambda t: np.sin(40.0 * t),
}
"""Signals without states whose derivatives are infinite, very large, or vary within a step."""


def test_a_delayed_signal_is_not_extrapolated_beyond_a_kink(run: Run) -> None:
    """A signal that leaves its dead zone just after the start has a kink there and is never negative."""
    builder = DiagramBuilder("d")
    place = builder.add("place", SecondOrderIntegrator(), builder.add("push", Constant()))
    free = builder.add("free", DeadZone(end=0.0), place["x"])
    builder.add("root", Sqrt(), builder.add("late", TransportDelay(delay=1.0), free))
    result = run(builder.build(), 3.0)
    close(result["root/y"], np.maximum(result.time - 1.0, 0.0) / np.sqrt(2.0), 1e-5)


@pytest.mark.parametrize("formula", CURVES)
@pytest.mark.parametrize(
    "settings", [{}, {"rtol": 1e-9, "atol": 1e-12}, {"solver": "rk4", "step": 0.1}], ids=str
)
def test_the_history_of_a_signal_with_large_curvature_is_accurate(
    formula: str, settings: dict[str, object], tmp_path: Path
) -> None:
    builder = DiagramBuilder("d")
    curve = builder.add("bent", Expression(formula=formula), builder.add("t", Clock()))
    builder.add("late", TransportDelay(delay=1.0), curve)
    result = native(sample_time=0.0371, **settings)(builder.build(), 3.0)
    expected = np.where(result.time < 1.0, 0.0, CURVES[formula](np.maximum(result.time - 1.0, 0.0)))
    close(result["late/y"], expected, 1e-8 if "rtol" in settings else 3e-6)
    assert result.final_state is not None
    result.final_state.save(tmp_path / "state")
    assert RunState.load(tmp_path / "state").past.tolist() == result.final_state.past.tolist()


def test_the_derivative_of_a_delayed_signal_is_the_delayed_derivative(run: Run) -> None:
    builder = DiagramBuilder("d")
    late = builder.add("late", TransportDelay(delay=0.5), builder.add("sine", SineWave(frequency=2.0)))
    later = builder.add("later", TransportDelay(delay=0.25), late)
    builder.add("integral", Integrator(), builder.add("rate", Derivative(), later))
    result = run(builder.build(), 5.0)
    close(result["integral/y"], np.where(result.time < 0.75, 0.0, np.sin(2.0 * (result.time - 0.75))), 1e-7)


def test_pulses_and_sampled_signals_are_delayed(run: Run) -> None:
    """Jumps at events and ticks are delayed as jumps: the integrals are exact."""
    builder = DiagramBuilder("d")
    pulses = builder.add("late", TransportDelay(delay=0.3), builder.add("pulses", PulseGenerator(period=1.0)))
    builder.add("integral", Integrator(), pulses)
    held = builder.add("held", ZeroOrderHold(sample_time=0.25), builder.add("t", Clock()))
    builder.add("stairs", Integrator(), builder.add("held late", TransportDelay(delay=0.4), held))
    result = run(builder.build(), 5.0)
    t = np.clip(result.time - 0.3, 0.0, None)
    close(result["integral/y"], 0.5 * np.floor(t + 1e-12) + np.minimum(t - np.floor(t + 1e-12), 0.5), 1e-9)
    k = np.floor(np.clip(result.time - 0.4, 0.0, None) / 0.25 + 1e-9)
    rest = np.clip(result.time - 0.4, 0.0, None) - 0.25 * k
    close(result["stairs/y"], 0.25 * 0.25 * k * (k - 1) / 2 + 0.25 * k * rest, 1e-9)


def test_a_loop_with_dead_time_oscillates_at_its_stability_limit(run: Run) -> None:
    """A loop of an integral controller and dead time, at the limit of its stability.

    y' = K (1 - y(t - 1)): the limit is K = pi / 2, with the undamped oscillation cos(pi t / 2).
    """
    builder = DiagramBuilder("d")
    error = builder.add("error", Sum(signs="+-"), builder.add("one", Constant(value=1.0)))
    y = builder.add("y", Integrator(initial=0.0), builder.add("K", Gain(gain=math.pi / 2), error))
    builder.connect(builder.add("late", TransportDelay(delay=1.0), y), error["u2"])
    result = run(builder.build(), 60.0)
    t, e = result.time, 1.0 - result["y/y"]
    stationary = t > 40.0
    basis = np.column_stack([np.cos(math.pi / 2 * t[stationary]), np.sin(math.pi / 2 * t[stationary])])
    fit, *_ = np.linalg.lstsq(basis, e[stationary], rcond=None)
    assert np.abs(basis @ fit - e[stationary]).max() < 1e-5
    assert np.hypot(*fit) > 0.5


def test_a_thermostat_with_dead_time_overshoots_by_the_delayed_change(run: Run) -> None:
    """x' = 1 - 2 m, measured 0.2 s late, relay at +-0.5: a triangle between +-0.7 of period 4 (0.5 + 0.2)."""
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator())
    late = builder.add("late", TransportDelay(delay=0.2), x)
    relay = builder.add("relay", Relay(on_point=0.5, off_point=-0.5, on_value=-1.0, off_value=1.0), late)
    builder.connect(relay, x["u"])
    result = run(builder.build(), 8.4)
    triangle = 0.7 - np.abs(np.mod(result.time - 0.7 + 1.4, 2.8) - 1.4)
    close(result["x/y"], triangle, 1e-9)


def test_a_growing_delay_agrees_with_its_closed_form(run: Run) -> None:
    """d = 0.1 + t / 2 gives u((t - 0.2) / 2) after 0.2 s."""
    builder = DiagramBuilder("d")
    d = builder.add("d", Ramp(slope=0.5, initial=0.1))
    late = builder.add(
        "late", VariableTimeDelay(longest=10.0), builder.add("sine", SineWave(frequency=2.0)), d
    )
    builder.add("integral", Integrator(), late)
    result = run(builder.build(), 6.0)
    past = (result.time - 0.2) / 2.0
    expected = np.where(past < 0.0, 0.0, np.sin(2.0 * past))
    close(result["late/y"], expected, 1e-7)


def test_the_transport_delay_of_a_pipe_with_decreasing_flow_agrees_with_its_closed_form(run: Run) -> None:
    """T(t) = 1 + t / 2; the integral of 1/T over d is 1: 1 + (t - d) / 2 = (1 + t / 2) exp(-1/2)."""
    builder = DiagramBuilder("d")
    T = builder.add("T", Ramp(slope=0.5, initial=1.0))
    pipe = builder.add("pipe", VariableTransportDelay(), builder.add("sine", SineWave()), T)
    builder.add("integral", Integrator(), pipe["y"])
    result = run(builder.build(), 6.0)
    entered = 2.0 * ((1.0 + result.time / 2.0) * math.exp(-0.5) - 1.0)
    # entry e before 0, where 1/T is 1: -e + 2 log(1 + t / 2) = 1
    before = 2.0 * np.log1p(result.time / 2.0) - 1.0
    entered = np.where(entered > 0.0, entered, before)
    # the delayed kink of T at 0 is not an event: RK4 steps across it
    close(result["pipe/delay"], result.time - entered, 1e-6)
    close(result["pipe/y"], np.where(entered < 0.0, 0.0, np.sin(entered)), 1e-6)


@pytest.mark.parametrize("start", (0.0, -1.0))
def test_a_transit_time_that_is_not_positive_ends_the_run(start: float) -> None:
    builder = DiagramBuilder("d")
    T = builder.add("T", Ramp(slope=0.5, initial=start))
    builder.add("pipe", VariableTransportDelay(), builder.add("sine", SineWave()), T)
    with pytest.raises(SimulationError, match="the derivative of state 'pipe/delay' is not finite at 0 s"):
        native()(builder.build(), 1.0)


def test_a_long_run_discards_history_older_than_the_delay() -> None:
    result = native(solver="rk4", step=0.01)(decay(0.5), 200.0)
    assert result.final_state is not None
    assert (
        result.final_state.past.size < INITIAL_CAPACITY * 4
    )  # numbers per row; 20 000 steps add 40 000 rows
    # it decays with the real part of the root of s + exp(-s / 2) = 0
    s = complex(-1.0, 1.0)
    for _ in range(50):
        s -= (s + np.exp(-s / 2)) / (1 - np.exp(-s / 2) / 2)
    early, later = (np.abs(result["x/y"][(result.time >= a) & (result.time < a + 6)]).max() for a in (10, 20))
    assert math.log(later / early) / 10.0 == pytest.approx(s.real, abs=0.05)


def test_a_continued_run_uses_the_saved_history(tmp_path: Path) -> None:
    """With equal settings the bits are equal; other settings restart from values and history."""
    for settings in ({"solver": "rk45", "rtol": 1e-8, "atol": 1e-10}, {"solver": "rk4", "step": 0.05}):
        run = native(**settings)
        whole = run(decay(), 8.0, sample_time=0.1)
        compiled = compile_system(trace_diagram(decay()))
        half = simulate(compiled, SimulationOptions(stop_time=3.7, sample_time=0.1, **settings))  # pyright: ignore
        assert half.final_state is not None
        half.final_state.save(tmp_path / "state.npz")
        state = RunState.load(tmp_path / "state.npz")
        options = SimulationOptions(stop_time=8.0, sample_time=0.1, **settings)  # pyright: ignore
        rest = simulate(compiled, options, initial_state=state)
        after = whole.time > 3.75
        assert rest["x/y"][rest.time > 3.75].tolist() == whole["x/y"][after].tolist()
        other = SimulationOptions(stop_time=8.0, sample_time=0.1, solver="dop853", rtol=1e-9, atol=1e-11)
        restarted = simulate(compiled, other, initial_state=state)
        assert "with a restart of the solver" in restarted.run.reason
        close(restarted["x/y"][restarted.time > 3.75], whole["x/y"][after], 1e-6)


def test_a_changed_delay_takes_effect_without_compilation() -> None:
    compiled = compile_system(trace_diagram(decay()))
    options = SimulationOptions(stop_time=3.0, sample_time=0.1, rtol=1e-9, atol=1e-12)
    tuned = simulate(compiled, options, {"late.delay": 0.5})
    recompiled = simulate(compile_system(trace_diagram(decay(0.5))), options)
    assert tuned["x/y"] == pytest.approx(recompiled["x/y"], abs=1e-12)


def test_delays_break_algebraic_loops_and_delay_jumps(run: Run) -> None:
    """y = 1 - y(t - 1) / 2, a loop without integrators: 1, 1/2, 3/4, 5/8 …"""
    builder = DiagramBuilder("d")
    y = builder.add("y", Sum(signs="+-"), builder.add("one", Constant(value=1.0)))
    half = builder.add("half", Gain(gain=0.5), builder.add("late", TransportDelay(delay=1.0), y))
    builder.connect(half, y["u2"])
    builder.add("above", CompareToConstant(relation=">", constant=0.7), y)
    builder.add("time", Integrator(), builder.add("limited", Saturation(lower=-9.0, upper=9.0), y))
    result = run(builder.build(), 5.0)
    k = np.floor(result.time + 1e-12)
    level = (2.0 + (-0.5) ** k) / 3.0
    close(result["y/y"], level, 1e-14)
    assert result["above/y"].tolist() == (level > 0.7).tolist()
    close(result["time/y"], np.cumsum(np.r_[0.0, level[:-1]]) * 0.025, 1e-9)


def test_unsupported_derivatives_and_delay_times_are_refused() -> None:
    builder = DiagramBuilder("d")
    builder.add(
        "twice",
        Derivative(),
        builder.add(
            "once", Derivative(), builder.add("late", TransportDelay(), builder.add("sine", SineWave()))
        ),
    )
    with pytest.raises(DiagramError, match="the second derivative of a delayed signal is not available"):
        trace_diagram(builder.build())
    builder = DiagramBuilder("d")
    late = builder.add(
        "late", VariableTimeDelay(), builder.add("sine", SineWave()), builder.add("t", Clock())
    )
    builder.add("rate", Derivative(), late)
    with pytest.raises(
        DiagramError, match="the derivative of a delayed signal is not available, whose delay changes"
    ):
        trace_diagram(builder.build())
    builder = DiagramBuilder("d")
    inner = builder.add("inner", TransportDelay(), builder.add("t", Clock()))
    builder.add("late", VariableTimeDelay(), builder.add("sine", SineWave()), inner)
    with pytest.raises(DiagramError, match="the delay time depends on a delayed signal"):
        trace_diagram(builder.build())


def test_vectors_are_delayed_by_element(run: Run) -> None:
    builder = DiagramBuilder("d")
    pair = builder.add("pair", Mux(), builder.add("t", Clock()), builder.add("sine", SineWave()))
    builder.add("late", TransportDelay(delay=0.5), pair)
    builder.add("x", Integrator(), builder.add("s", SineWave()))
    result = run(builder.build(), 3.0)
    past = np.clip(result.time - 0.5, 0.0, None)
    close(result["late/y"], np.column_stack([past, np.sin(past)]), 1e-8)
