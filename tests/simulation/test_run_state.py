"""Saved states: continued runs equal uninterrupted runs exactly."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hybrid_systems import bouncing_ball, loop_of_cosine, relay_oscillator, sampled_loop, stick_slip
from small_systems import oscillator, van_der_pol_pid

import armblocks as ab
from armblocks.blocks import (
    Constant,
    EnabledSubsystem,
    Integrator,
    Outport,
    SecondOrderIntegrator,
    SineWave,
    TransportDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Diagram, DiagramBuilder, trace_diagram
from armblocks.equations import SimulationOptions
from armblocks.errors import FormatError, InputError
from armblocks.integration.system import CompiledSystem, compile_system
from armblocks.integration.workspace import Count
from armblocks.simulation import RunState, simulate


def event_just_after_the_start() -> Diagram:
    """A mass is accelerated from height 0; once the height is positive, a subsystem sets the force to 0."""
    inside = DiagramBuilder("inside")
    inside.add("push", Outport(port=1, initial=1.0), inside.add("none", Constant(value=0.0)))
    builder = DiagramBuilder("pushed")
    mass = builder.add("mass", SecondOrderIntegrator())
    switch = builder.add("switch", EnabledSubsystem(diagram=inside.build()), mass["x"])
    builder.connect(switch, mass["u"])
    return builder.build()


SYSTEMS = {
    "pushed": compile_system(trace_diagram(event_just_after_the_start())),
    "van_der_pol": compile_system(van_der_pol_pid()),
    "ball": compile_system(bouncing_ball(0.9)),
    "sampled": compile_system(sampled_loop(0.3)),
    "relay": compile_system(relay_oscillator()),
    "stick_slip": compile_system(stick_slip()),
    "loop": compile_system(loop_of_cosine()),
}


@pytest.mark.parametrize(
    ("solver", "step"), [("rk45", None), ("dop853", None), ("rk4", 0.013), ("rodas5p", None), ("ros5", 0.013)]
)
@pytest.mark.parametrize("name", list(SYSTEMS))
def test_an_interrupted_run_equals_an_uninterrupted_one_bit_for_bit(
    name: str, solver: str, step: float | None, tmp_path: Path
) -> None:
    system = SYSTEMS[name]

    def options(stop: float) -> SimulationOptions:
        return SimulationOptions(stop_time=stop, sample_time=0.05, solver=solver, step=step)

    whole = simulate(system, options(4.0))
    for cuts in ([1.55], [0.3, 1.5, 1.51, 3.3]):
        state: RunState | None = None
        for stop in cuts:
            part = simulate(system, options(stop), initial_state=state)
            assert part.final_state is not None
            part.final_state.save(tmp_path / "state")
            state = RunState.load(tmp_path / "state")
        rest = simulate(system, options(4.0), initial_state=state)
        assert "exactly as the previous run" in rest.run.reason
        assert rest.time[0] == cuts[-1]
        common_samples = np.isin(rest.time, whole.time)
        assert common_samples.sum() >= 14
        later = np.isin(whole.time, rest.time)
        assert rest.signals[:, common_samples].tobytes() == whole.signals[:, later].tobytes()
        assert rest.final_state is not None and whole.final_state is not None
        assert rest.final_state.states.tobytes() == whole.final_state.states.tobytes()


def test_a_run_continues_from_a_step_that_ends_at_the_stop_time_to_rounding() -> None:
    """Steps of 0.1 s end at times such as 0.9999999999999999 s, which count as the time of a sample."""
    builder = DiagramBuilder("falling")
    push = builder.add("push", Constant())
    builder.add("mass", SecondOrderIntegrator(), push)
    builder.add("sampled", ZeroOrderHold(sample_time=0.3), push)  # ticks at 0.8999999999999999 s
    system = compile_system(trace_diagram(builder.build()))

    def options(stop: float) -> SimulationOptions:
        return SimulationOptions(stop_time=stop, sample_time=0.05, max_step=0.1, rtol=1e-9, atol=1e-12)

    whole = simulate(system, options(2.0))
    for stop in whole.time[8:40:2]:
        rest = simulate(system, options(2.0), initial_state=simulate(system, options(stop)).final_state)
        assert rest.signals.tobytes() == whole.signals[:, -rest.time.size :].tobytes(), stop


def first_second(system: CompiledSystem = SYSTEMS["sampled"], **more: object) -> RunState:
    state = simulate(system, SimulationOptions(stop_time=1.0, **more)).final_state  # pyright: ignore
    assert state is not None
    return state


def test_a_state_has_the_values_at_the_end_of_the_run() -> None:
    state = first_second()
    assert state.time == 1.0
    assert state.names == (("plant/x",), ("hold/y",), ())
    assert state.discrete[0] == pytest.approx(0.7**3)
    assert state.states[0] == pytest.approx(0.7**3 * (1 - 0.1))


def test_a_run_with_other_settings_restarts_from_the_values() -> None:
    state = first_second()
    result = simulate(
        SYSTEMS["sampled"], SimulationOptions(stop_time=2.0, solver="dop853"), initial_state=state
    )
    assert "with a restart of the solver" in result.run.reason
    assert result["plant/x"][0] == state.states[0]
    assert result["plant/x"][-1] == pytest.approx(0.7**6 * (1 - 0.2), rel=1e-12)


def test_the_values_of_a_state_can_be_changed() -> None:
    state = dataclasses.replace(first_second(), states=np.array([5.0]), checkpoint=None)
    result = simulate(SYSTEMS["sampled"], SimulationOptions(stop_time=1.1), initial_state=state)
    assert result["plant/x"][0] == 5.0


def test_a_state_of_another_diagram_or_with_nan_is_refused() -> None:
    with pytest.raises(InputError, match="belongs to another system: 'hold/y' is only in one of them"):
        simulate(SYSTEMS["relay"], SimulationOptions(stop_time=2.0), initial_state=first_second())
    bad = dataclasses.replace(first_second(), states=np.array([np.nan]))
    with pytest.raises(InputError, match="has values that are not finite"):
        simulate(SYSTEMS["sampled"], SimulationOptions(stop_time=2.0), initial_state=bad)


def delayed_sine() -> ab.Diagram:
    """An integrated sine, delayed by 0.3 s."""
    builder = DiagramBuilder("delayed")
    delayed = builder.add("delayed", TransportDelay(delay=0.3), builder.add("sine", SineWave()))
    builder.add("integral", Integrator(), delayed)
    return builder.build()


@pytest.mark.parametrize(
    "damage",
    ["rows", "first row", "last row", "searched", "stage", "reals", "counts", "method", "past", "order"],
)
def test_a_state_with_damaged_arrays_is_refused(damage: str, tmp_path: Path) -> None:
    diagram = delayed_sine()
    state = ab.simulate(diagram, stop_time=1.0).final_state
    assert state.checkpoint is not None
    counts, reals, method = state.checkpoint.counts.copy(), state.checkpoint.reals, state.checkpoint.method
    match damage:
        case "rows":
            counts[Count.HISTORY_ROWS] = 10**9
        case "first row":
            counts[-2] = 10**9
        case "last row":
            counts[-1] = 10**9
        case "searched":
            counts[-1] = -(10**9)
        case "stage":
            counts[Count.STAGE] = 7
        case "reals":
            reals = reals[:40]
        case "counts":
            counts = counts[:10]
        case "method":
            method = "rodas5p"
        case "past":
            state = dataclasses.replace(state, past=state.past[:-1])
        case _:
            state = dataclasses.replace(state, past=state.past.reshape(-1, 4)[::-1].ravel())
    checkpoint = dataclasses.replace(state.checkpoint, counts=counts, reals=reals, method=method)
    dataclasses.replace(state, checkpoint=checkpoint).save(tmp_path / "state.npz")
    with pytest.raises(InputError, match="the state of 'delayed' at 1 s is damaged"):
        ab.simulate(diagram, stop_time=2.0, initial_state=RunState.load(tmp_path / "state.npz"))


def test_the_search_for_delayed_jumps_goes_on_where_it_ended() -> None:
    checkpoint = ab.simulate(delayed_sine(), stop_time=1.0).final_state.checkpoint
    assert checkpoint is not None
    # The last row of a line without jumps is -1 - n, and no jump begins before row n.
    searched_rows = -1 - checkpoint.counts[-1]
    assert 10 < searched_rows < checkpoint.counts[Count.HISTORY_ROWS]


def test_a_stop_time_before_the_time_of_the_state_is_refused() -> None:
    with pytest.raises(InputError, match=r"stop_time is 0\.5 s, and the run continues from 1 s"):
        simulate(SYSTEMS["sampled"], SimulationOptions(stop_time=0.5), initial_state=first_second())


@pytest.mark.parametrize("content", [b"", b"PK", b"not a state at all", b"\x93NUMPY"])
def test_a_file_that_is_not_a_state_is_refused(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "state").write_bytes(content)
    with pytest.raises(FormatError, match="this file contains no run state"):
        RunState.load(tmp_path / "state")


def test_a_run_with_changed_parameters_restarts_from_the_values() -> None:
    system = compile_system(oscillator())
    state = first_second(system)
    result = simulate(system, SimulationOptions(stop_time=2.0), {"mass.omega": 3.0}, initial_state=state)
    assert "with a restart of the solver" in result.run.reason
    expected = np.cos(2.0) * np.cos(3.0) - 2.0 * np.sin(2.0) / 3.0 * np.sin(3.0)
    assert result["mass/x"][-1] == pytest.approx(expected, abs=1e-5)
