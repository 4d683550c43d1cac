"""Times that differ by rounding are one instant: sample times, times at which sources jump, the stop time."""

from __future__ import annotations

import math

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    Constant,
    Expression,
    HitCrossing,
    Integrator,
    Relay,
    ResettableIntegrator,
    Saturation,
    Sign,
    SignalGenerator,
    Step,
    Sum,
    TransportDelay,
)

SOLVERS = ("auto", "dop853", "rodas5p", "rk4")
LATE = 34 * 0.1
"""3.4000000000000004, one unit in the last place after the sample time 340 * 0.01."""


def stepped(*, delay: float = 0.0) -> ab.Diagram:
    """A step from 1.25 to -1.5 at ``LATE``, with blocks that have modes, and an implicit equation."""
    builder = ab.DiagramBuilder("step")
    step = builder.add("step", Step(time=LATE, initial=1.25, final=-1.5))
    builder.add("saturation", Saturation(lower=-1.0, upper=1.0), step)
    builder.add("relay", Relay(on_point=1.0, off_point=-1.0), step)
    builder.add("integral", Integrator(), step)
    loop = builder.add("loop", Expression(formula="u1 - 0.3*tanh(u2)", inputs=2), step)
    builder.connect(loop, loop["u2"])
    if delay:
        builder.add("late", TransportDelay(delay=delay), step)
    return builder.build()


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("delay", [0.0, 0.17])
def test_a_sample_just_before_a_jump_has_the_values_after_it(solver: str, delay: float) -> None:
    """With a delay of 0.17 s an ordinary step may end just before the jump, because no step is longer."""
    step = 0.01 if solver == "rk4" else None
    result = ab.simulate(stepped(delay=delay), stop_time=4.0, sample_time=0.01, solver=solver, step=step)
    assert result.time[340] == 340 * 0.01 < LATE
    after = np.arange(401) >= 340
    assert np.array_equal(result["step"], np.where(after, -1.5, 1.25))
    assert np.array_equal(result["saturation"], np.clip(result["step"], -1.0, 1.0))
    assert np.array_equal(result["relay"], ~after)
    assert np.allclose(result["loop"] + 0.3 * np.tanh(result["loop"]), result["step"], atol=1e-9)
    times, before, values = result.jumps["step"]
    assert (times.tolist(), before.tolist(), values.tolist()) == ([3.4], [1.25], [-1.5])
    rows = result.with_jumps()
    assert np.all(np.diff(rows["step"]) <= 0.0)


def test_a_run_to_a_time_just_before_a_jump_ends_with_the_values_of_a_longer_run() -> None:
    short = ab.simulate(stepped(), stop_time=3.4, sample_time=0.01)
    long = ab.simulate(stepped(), stop_time=4.0, sample_time=0.01)
    for name in short.names:
        assert np.array_equal(short[name], long[name][:341]), name
    assert short.final_state is not None
    rest = ab.simulate(stepped(), stop_time=4.0, sample_time=0.01, initial_state=short.final_state)
    for name in short.names:
        assert np.array_equal(rest[name][1:], long[name][341:]), name


def test_a_diagram_without_states_has_the_values_after_a_jump_too() -> None:
    builder = ab.DiagramBuilder("stateless")
    builder.add("step", Step(time=LATE))
    result = ab.simulate(builder.build(), stop_time=4.0, sample_time=0.01)
    assert np.array_equal(result["step"], np.arange(401) >= 340)
    times, before, values = result.jumps["step"]
    assert (times.tolist(), before.tolist(), values.tolist()) == ([3.4], [0.0], [1.0])


@pytest.mark.parametrize("solver", SOLVERS)
def test_two_steps_at_almost_the_same_time_make_no_pulse(solver: str) -> None:
    """The difference of steps at 0.3 s and 3 times 0.1 s is 0: no crossing counts, and nothing is reset."""
    assert math.nextafter(0.3, 1.0) == 3 * 0.1
    builder = ab.DiagramBuilder("steps")
    steps = [builder.add(name, Step(time=time)) for name, time in (("first", 0.3), ("second", 3 * 0.1))]
    pulse = builder.add("pulse", Sum(signs="+-"), *steps)
    builder.add("crossings", HitCrossing(offset=0.5), pulse)
    builder.add("relay", Relay(on_point=0.5, off_point=-5.0), pulse)
    builder.add("sign", Sign(), pulse)
    clock = builder.add("clock", ResettableIntegrator(), builder.add("one", Constant(value=1.0)), pulse)
    builder.add("area", Integrator(), clock)
    step = 0.05 if solver == "rk4" else None
    result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.05, solver=solver, step=step)
    for name in ("pulse", "crossings/count", "relay", "sign"):
        assert not result[name].any(), name
        assert not result.jumps[name][0].size, name
    assert np.allclose(result["clock"], result.time, atol=1e-12)


def test_a_sample_after_the_end_of_a_step_and_before_an_edge_within_rounding_has_the_values_after_it() -> (
    None
):
    """The sawtooth makes a step end two units in the last place before 0.875, and the edge follows."""
    builder = ab.DiagramBuilder("edge")
    square = builder.add("square", SignalGenerator(waveform="square", frequency=4.0))
    integral = builder.add("integral", ResettableIntegrator(), square)
    builder.connect(square, integral["reset"])
    builder.add("sawtooth", SignalGenerator(waveform="sawtooth", frequency=1.1457337343252456))
    result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.025)
    edges = np.floor(8.0 * result.time * (1.0 + 1e-12))
    assert np.array_equal(result["square"], np.where(edges % 2.0 == 1.0, 1.0, -1.0))
