"""Runs with many events, advanced in parts: each call ends at the requested time or step."""

from __future__ import annotations

from bisect import bisect_left
from pathlib import Path

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    CalledPythonFunction,
    DiscreteIntegrator,
    FirstOrderLag,
    Gain,
    Integrator,
    Relay,
    Saturation,
    SignalGenerator,
    SineWave,
    TransportDelay,
    TriggeredSubsystem,
    UnitDelay,
)
from armblocks.diagram import Diagram, DiagramBuilder

STOP = 1.5
SEEDS = range(5)


def with_many_events(seed: int) -> Diagram:
    """A random diagram with some thousand events until ``STOP``; ``gain.gain`` changes its states."""
    random = np.random.default_rng(seed)
    builder = DiagramBuilder(f"events {seed}")
    sine = builder.add("sine", SineWave(frequency=float(random.uniform(8e3, 15e3)), phase=random.uniform()))
    switching = Relay() if random.integers(2) else Saturation(lower=-0.5, upper=0.25)
    gain = builder.add("gain", Gain(gain=1.0), builder.add("switching", switching, sine))
    lag = builder.add("lag", FirstOrderLag(time_constant=0.05), gain)
    builder.add("integral", Integrator(), lag)
    if random.integers(2):
        square = SignalGenerator(waveform="square", frequency=float(random.uniform(200.0, 500.0)))
        builder.add("squares", Integrator(), builder.add("square", square))
    if random.integers(2):
        builder.add("ticks", DiscreteIntegrator(sample_time=7e-3), gain)
    if random.integers(2):
        builder.add("delayed", TransportDelay(delay=0.01), lag)
    if random.integers(2):
        inside = DiagramBuilder("inside")
        inside.output("y", inside.add("step", UnitDelay(), inside.input("u")))
        builder.add("triggered", TriggeredSubsystem(diagram=inside.build()), lag, trigger=sine)
    return builder.build()


def settings(seed: int) -> dict[str, float | str]:
    """The solver of a run, which also depends on the seed."""
    if seed % 3 == 2:
        return {"solver": "rk4", "step": 1e-3, "stop_time": STOP}
    return {"stop_time": STOP, "sample_time": 0.01}


def begin(diagram: Diagram, seed: int) -> ab.Simulation:
    return ab.begin(diagram, **settings(seed))  # pyright: ignore[reportArgumentType]


def ends_of_steps(diagram: Diagram, seed: int) -> list[float]:
    """The times at which the steps of a run end, s."""
    run, times = begin(diagram, seed), list[float]()
    while not run.finished:
        run.advance(steps=1)
        times.append(run.time)
    return times


@pytest.mark.parametrize("seed", SEEDS)
def test_each_call_of_advance_ends_where_requested(seed: int) -> None:
    diagram, random = with_many_events(seed), np.random.default_rng(seed)
    whole = ab.simulate(diagram, **settings(seed))  # pyright: ignore[reportArgumentType]
    assert whole.run.events + whole.run.ticks > 2000
    times = ends_of_steps(diagram, seed)
    # A last call without a step may end the run.
    assert len(set(times)) == whole.run.steps
    runs = [begin(diagram, seed) for _ in range(5)]
    runs[0].advance()
    runs[1].advance(wall_time=1e6)
    runs[2].advance(until=STOP)
    runs[3].advance(steps=10**9)
    for until in np.sort(random.uniform(0.0, STOP, 4)):
        runs[4].advance(until)
        assert runs[4].time == times[bisect_left(times, until)]
    taken = times.index(runs[4].time)
    runs[4].advance(steps=500)
    assert runs[4].time == times[min(taken + 500, len(times) - 1)]
    runs[4].advance()
    for run in runs:
        assert run.finished and run.time == STOP
        result = run.result()
        assert result.run.complete
        assert result.time.tobytes() == whole.time.tobytes()
        assert result.signals.tobytes() == whole.signals.tobytes()
        assert result.jumps.time.tolist() == whole.jumps.time.tolist()


@pytest.mark.parametrize("seed", SEEDS)
def test_parameters_change_at_the_requested_time(seed: int) -> None:
    diagram = with_many_events(seed)
    first, second = np.sort(np.random.default_rng(seed).uniform(0.3, STOP, 2)).tolist()
    run = begin(diagram, seed)
    states: list[ab.RunState] = []
    for until, gain in ((first, -3.0), (second, 2.0)):
        run.advance(until, exactly=True)
        assert run.time == until
        states.append(run.state())
        run.set("gain.gain", gain)
    run.advance()
    result = run.result()
    assert [change.time for change in result.parameter_changes] == [first, second]
    for start, end, gain in zip(states, (second, STOP), (-3.0, 2.0)):
        part = ab.simulate(
            diagram,
            parameters={"gain.gain": gain},
            initial_state=start,
            **settings(seed),  # pyright: ignore[reportArgumentType]
        )
        rows = (result.time > start.time) & (result.time < end)
        np.testing.assert_array_equal(
            result["integral"][rows], part["integral"][(part.time > start.time) & (part.time < end)]
        )


@pytest.mark.parametrize("called", [False, True])
@pytest.mark.parametrize("logged", [False, True])
def test_runs_with_a_log_or_python_functions_reach_the_requested_time(
    called: bool, logged: bool, tmp_path: Path
) -> None:
    builder = DiagramBuilder("d")
    sine = builder.add("sine", SineWave(frequency=4e3))
    relay = builder.add("relay", Relay(), sine)
    builder.add("integral", Integrator(), relay)
    if called:
        builder.add("python", CalledPythonFunction(function=_doubled, sample_time=0.05), relay)
    diagram = builder.build()
    path = tmp_path / "log.csv"
    run = ab.begin(diagram, stop_time=STOP, log=path if logged else None)
    run.advance(0.7, exactly=True)
    assert run.time == 0.7
    run.advance()
    assert run.finished and run.time == STOP
    assert run.result().run.complete
    assert not logged or path.read_text().splitlines()[-1].startswith("1.5,")


def _doubled(u: float) -> float:
    return 2.0 * u
