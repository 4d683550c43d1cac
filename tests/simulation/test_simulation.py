"""Runs that are paused, inspected, tuned and continued."""

from __future__ import annotations

import dataclasses

import casadi as ca
import numpy as np
import pytest
from hybrid_systems import bouncing_ball, loop_of_cosine, relay_oscillator, sampled_loop, stick_slip
from small_systems import oscillator, scalar, van_der_pol_pid
from small_systems import system as small_system

from armblocks.equations import HybridSystem, SimulationOptions, signature
from armblocks.errors import InputError, SimulationError, UnknownNameError
from armblocks.integration.system import compile_system
from armblocks.simulation import Simulation, SimulationResult, simulate


def source_only() -> HybridSystem:
    """A system without states: ``y = a t``."""
    return small_system(
        "source",
        signals=signature(("ramp/y", ())),
        outputs=lambda t, x, p: p[0] * t,
        parameters=signature(("ramp.slope", ())),
        values=(2.0,),
    )


def stepped_lag() -> HybridSystem:
    """``x' = 1 - x`` after a time that is a parameter, ``x' = -x`` before it."""
    return scalar(
        "lag",
        lambda t, x, p: ca.if_else(t >= p[0], 1.0, 0.0) - x,
        0.0,
        parameters=signature(("step.time", (), "s")),
        values=(1.5,),
        breakpoints=lambda p: [p[0]],
    )


SYSTEMS = {
    "van_der_pol": compile_system(van_der_pol_pid()),
    "ball": compile_system(bouncing_ball(0.9)),
    "sampled": compile_system(sampled_loop(0.3)),
    "relay": compile_system(relay_oscillator()),
    "stick_slip": compile_system(stick_slip()),
    "loop": compile_system(loop_of_cosine()),
    "source": compile_system(source_only()),
}
SOLVERS = [("rk45", None), ("dop853", None), ("rk4", 0.013), ("rodas5p", None)]


def options(stop: float = 4.0, solver: str = "rk45", step: float | None = None) -> SimulationOptions:
    return SimulationOptions(stop_time=stop, sample_time=0.05, solver=solver, step=step)


def same_run(one: SimulationResult, other: SimulationResult) -> None:
    """Check that all results of two runs are equal bit for bit, except for the wall time."""
    assert one.time.tobytes() == other.time.tobytes()
    assert one.signals.tobytes() == other.signals.tobytes()
    timeless = [
        dataclasses.replace(result.run, wall_time=0.0, preparation_time=0.0, real_time_factor=0.0)
        for result in (one, other)
    ]
    assert timeless[0] == timeless[1]
    assert one.final_state is not None and other.final_state is not None
    assert one.final_state.states.tobytes() == other.final_state.states.tobytes()
    assert one.final_state.discrete.tobytes() == other.final_state.discrete.tobytes()


@pytest.mark.parametrize(("solver", "step"), SOLVERS)
@pytest.mark.parametrize("name", list(SYSTEMS))
def test_a_run_with_pauses_equals_a_run_without_bit_for_bit(
    name: str, solver: str, step: float | None
) -> None:
    system = SYSTEMS[name]
    whole = simulate(system, options(solver=solver, step=step))
    by_time = Simulation(system, options(solver=solver, step=step))
    for until in (0.0, 0.31, 0.5, 0.5, 1.7, 2.0):
        by_time.advance(until)
        assert by_time.time >= until or name == "source"
    by_time.advance()
    same_run(by_time.result(), whole)
    by_steps = Simulation(system, options(solver=solver, step=step))
    while not by_steps.finished:
        before = by_steps.recorded, by_steps.time
        by_steps.advance(steps=3)
        assert (by_steps.recorded, by_steps.time) > before
    same_run(by_steps.result(), whole)


@pytest.mark.parametrize("name", list(SYSTEMS))
def test_streamed_samples_equal_the_recorded_samples(name: str) -> None:
    run = Simulation(SYSTEMS[name], options())
    count, times, signals = 0, [], []
    while not run.finished:
        run.advance(run.time + 0.17)
        new_samples = run.samples(count)
        assert new_samples.begin == count and new_samples.end == run.recorded
        count = new_samples.end
        for path in run.compiled.signals_layout.names:
            assert new_samples[path].shape[0] == new_samples.time.size
        times.append(new_samples.time)
        signals.append(new_samples.signals)
    result = run.result()
    assert np.concatenate(times).tobytes() == result.time.tobytes()
    assert np.concatenate(signals, axis=1).tobytes() == result.signals.tobytes()
    assert run.samples(count).time.size == 0


@pytest.mark.parametrize("exactly", [False, True])
@pytest.mark.parametrize(("solver", "step"), SOLVERS)
def test_a_run_with_a_changed_parameter_equals_two_runs_joined_by_their_state(
    solver: str, step: float | None, exactly: bool
) -> None:
    system, settings = compile_system(oscillator()), options(solver=solver, step=step)
    names = system.parameters.names
    change = {names[0]: 3.0}
    run = Simulation(system, settings)
    run.advance(1.23, exactly=exactly)
    if exactly:
        assert run.time == 1.23
    state, recorded = run.state(), run.recorded
    run.set(change)
    run.advance()
    joined = run.result()
    rest = simulate(system, settings, parameters=change, initial_state=state)
    # The continued run also records its start time, besides the common grid.
    assert joined.time[recorded:].tobytes() == rest.time[1:].tobytes()
    assert joined.signals[:, recorded:].tobytes() == rest.signals[:, 1:].tobytes()
    first = simulate(system, options(stop=1.23, solver=solver, step=step))
    if exactly:
        before_change = first.time < 1.23
        assert joined.signals[:, :recorded].tobytes() == first.signals[:, before_change].tobytes()
    assert [change.time for change in joined.parameter_changes] == [state.time]
    assert joined.parameters[names[0]] == 3.0


def test_breakpoints_depend_on_a_changed_parameter() -> None:
    # x' = (t >= p) - x: a step ends at the jump although it was moved while the run was paused.
    system = compile_system(stepped_lag())
    run = Simulation(system, SimulationOptions(stop_time=3.0, sample_time=0.01, rtol=1e-10, atol=1e-12))
    run.advance(0.7, exactly=True)
    run.set({"step.time": 2.25})
    run.advance()
    result = run.result()
    after = np.maximum(0.0, result.time - 2.25)
    np.testing.assert_allclose(result["block/y"], 1.0 - np.exp(-after), atol=1e-9)
    assert run.result().run.rejected <= 2  # a jump within a step causes many rejected steps


def test_a_parameter_change_before_the_first_step_equals_one_at_the_start() -> None:
    system = compile_system(oscillator())
    name = system.parameters.names[0]
    run = Simulation(system, options())
    run.set({name: 2.0})
    run.advance()
    same_run(run.result(), simulate(system, options(), parameters={name: 2.0}))
    assert run.result().parameter_changes == ()


def test_signals_without_states_depend_on_a_changed_parameter() -> None:
    system = SYSTEMS["source"]
    name = system.parameters.names[0]
    run = Simulation(system, options())
    run.advance(2.0)
    assert run.time == 2.0
    run.set({name: 5.0})
    run.advance()
    changed_run, before = run.result(), simulate(system, options())
    after = simulate(system, options(), parameters={name: 5.0})
    early = changed_run.time <= 2.0
    np.testing.assert_array_equal(changed_run.signals[:, early], before.signals[:, early])
    np.testing.assert_array_equal(changed_run.signals[:, ~early], after.signals[:, ~early])


def test_a_parameter_change_after_the_end_is_refused() -> None:
    system = compile_system(oscillator())
    run = Simulation(system, options())
    with pytest.raises(UnknownNameError):
        run.set({"nothing": 1.0})
    run.advance()
    with pytest.raises(
        InputError, match=r"the run has ended at 4 s.*changes of parameters before the end"
    ) as caught:
        run.set({system.parameters.names[0]: 1.0})
    assert caught.value.fix == "begin another run with the new values"


def test_a_stopped_run_keeps_its_samples_and_does_not_continue() -> None:
    run = Simulation(SYSTEMS["relay"], options())
    run.advance(1.0)
    run.stop("inspection finished")
    run.advance()
    result = run.result()
    assert 0.95 <= result.time[-1] < 2.0
    assert result.final_state is not None and result.final_state.time >= 1.0
    assert not result.run.complete and result.run.message == "inspection finished"


def test_a_failed_run_raises_the_same_error_each_time() -> None:
    run = Simulation(compile_system(scalar("blow_up", lambda t, x, p: x * x, 1.0)), options())
    with pytest.raises(SimulationError) as first:
        run.advance()
    assert run.finished
    with pytest.raises(SimulationError) as second:
        run.result()
    assert second.value is first.value
    assert isinstance(first.value.partial, SimulationResult)


def test_many_single_steps_do_not_lengthen_the_next_timed_advance() -> None:
    run = Simulation(SYSTEMS["van_der_pol"], options(1e4, "rk4", 1e-3))
    for _ in range(1100):
        run.advance(steps=1)
    run.advance(wall_time=0.0)
    assert not run.finished
    assert run.time < 10.0
