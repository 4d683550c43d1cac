"""Runs that blocks end, and assertions: time and message."""

from __future__ import annotations

import math

import numpy as np
import pytest

from armblocks.blocks import (
    Assertion,
    CompareToConstant,
    Constant,
    Integrator,
    Mux,
    SineWave,
    Step,
    StopSimulation,
    ZeroOrderHold,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import SimulationError
from armblocks.simulation import SimulationResult, simulate
from compiled_diagrams import compiled

SOLVERS = [("rk45", None), ("rk4", 0.01)]


def run(diagram: Diagram, solver: str, step: float | None) -> SimulationResult:
    options = SimulationOptions(
        stop_time=10.0, sample_time=0.1, solver=solver, step=step, rtol=1e-10, atol=1e-12
    )
    return simulate(compiled(diagram), options)


def monitored_diagram(block: Block, relation: str = ">", level: float = 0.5) -> Diagram:
    """x = 1 - cos t, with a block that monitors a comparison of x with a level."""
    builder = DiagramBuilder("d")
    x = builder.add("x", Integrator(), builder.add("sine", SineWave()))
    builder.add("watch", block, builder.add("is", CompareToConstant(relation=relation, constant=level), x))
    return builder.build()


@pytest.mark.parametrize(("solver", "step"), SOLVERS)
def test_a_run_ends_exactly_when_its_condition_becomes_true(solver: str, step: float | None) -> None:
    result = run(monitored_diagram(StopSimulation()), solver, step)
    end = math.acos(0.5)
    assert result.time[-1] == pytest.approx(end, abs=1e-9)
    assert result.time[:-1] == pytest.approx(np.arange(11) * 0.1)
    assert result["x/y"][-1] == pytest.approx(0.5, abs=1e-9)
    assert result["is/y"].tolist() == [0.0] * 11 + [1.0]
    assert result.run.complete
    assert result.run.message.startswith("stopped by block 'watch' at 1.0471975")


def test_a_run_ends_at_the_start_if_the_condition_is_true() -> None:
    result = run(monitored_diagram(StopSimulation(), "<"), "rk45", None)
    assert result.time.tolist() == [0.0]
    assert result.run.message == "stopped by block 'watch' at 0 s"


def test_a_run_with_a_sampled_or_jumping_condition_ends_at_the_tick_or_jump() -> None:
    builder = DiagramBuilder("d")
    step = builder.add("step", Step(time=1.23))
    held = builder.add("held", ZeroOrderHold(sample_time=0.25), step)
    builder.add(
        "stop", StopSimulation(), builder.add("two", Mux(), held, builder.add("no", Constant(value=0.0)))
    )
    result = run(builder.build(), "rk45", None)
    assert result.time[-1] == 1.25
    builder = DiagramBuilder("d")
    builder.add("stop", StopSimulation(), builder.add("step", Step(time=1.23)))
    result = run(builder.build(), "rk45", None)
    assert result.time[-1] == 1.23
    assert result["step/y"][-1] == 1.0


@pytest.mark.parametrize(("solver", "step"), SOLVERS)
def test_a_violated_assertion_fails_the_run_and_keeps_the_samples(solver: str, step: float | None) -> None:
    with pytest.raises(SimulationError, match=r"assertion 'watch' does not hold at 1\.0471975") as caught:
        run(monitored_diagram(Assertion(), "<="), solver, step)
    partial = caught.value.partial
    assert isinstance(partial, SimulationResult)
    assert partial.time[-1] == pytest.approx(math.acos(0.5), abs=1e-9)
    assert not partial.run.complete
    assert "or set its action to warn" in str(caught.value)


@pytest.mark.parametrize(("solver", "step"), SOLVERS)
def test_a_violated_assertion_may_only_warn(solver: str, step: float | None) -> None:
    result = run(monitored_diagram(Assertion(action="warn"), "<="), solver, step)
    assert result.time[-1] == 10.0
    assert result.run.complete
    second = 2 * math.pi + math.acos(0.5)
    assert result.run.message == f"assertion 'watch' did not hold, last from {second:.9g} s on"
    result = run(monitored_diagram(Assertion(action="warn"), ">", -1.0), solver, step)
    assert result.run.message == ""
    result = run(monitored_diagram(Assertion(action="warn"), ">", 9.0), solver, step)
    assert result.run.message == "assertion 'watch' did not hold, from the start on"


def test_simultaneous_events_are_processed_together() -> None:
    """Two comparisons of one signal change together: no sample has only one of the changes."""
    builder = DiagramBuilder("d")
    sine = builder.add("sine", SineWave())
    one = builder.add("one", CompareToConstant(relation=">", constant=0.5), sine)
    builder.add("two", CompareToConstant(relation=">", constant=0.5), sine)
    builder.add("three", CompareToConstant(relation=">", constant=0.5), one)
    builder.add("keeps the steps", Integrator(), sine)
    result = run(builder.build(), "rk45", None)
    assert result["one/y"].tolist() == result["two/y"].tolist() == result["three/y"].tolist()
    # the third comparison has no events, because its input changes only at events
    assert result.run.events == 2 * 4
