"""Blocks with external reset, compared with recurrences (sampled) and closed forms (continuous)."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    Clock,
    Constant,
    Delay,
    DiscreteIntegrator,
    Gain,
    Integrator,
    PulseGenerator,
    Relay,
    RepeatingSequenceStair,
    ResettableDelay,
    ResettableIntegrator,
    SineWave,
    Sum,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.blocks.external_resets import EDGES, EXTERNAL_RESETS
from armblocks.diagram import Block, Diagram, DiagramBuilder, trace_diagram
from armblocks.errors import AlgebraicLoopError, DiagramError, InputError

T = 0.1
COUNT = 60
TRIGGER = np.array([0, 0, 1, 2, 0, 0, -1, 3, 3, 0, 0, 0, -2, 0, 1, 0] * 4)[:COUNT].astype(float)
ENABLE = np.array([1, 1, 1, 0, 0, 1, 1] * 9)[:COUNT].astype(float)
U = np.cos(0.7 * np.arange(COUNT)) + 0.2
START = 0.1 * np.arange(COUNT) - 1.0
SOLVERS = pytest.mark.parametrize(
    "solver",
    [{"solver": "rk45", "rtol": 1e-10, "atol": 1e-12}, {"solver": "rk4", "step": 0.01}],
    ids=["rk45", "rk4"],
)


def reset_fires(kind: str, value: float, before: float | None) -> bool:
    """Return whether a reset fires, by the rules of Simulink's documentation."""
    first = before is None
    previous = 0.0 if before is None else before
    return {
        "none": False,
        "rising": not first and previous <= 0 < value,
        "falling": not first and previous > 0 >= value,
        "either": not first and (previous > 0) != (value > 0),
        "level": value != 0 or (not first and previous != 0),
        "level hold": value != 0,
    }[kind]


def sequence_source(values: np.ndarray) -> RepeatingSequenceStair:
    return RepeatingSequenceStair(values=values, sample_time=T)


def tick_outputs(*blocks: Block) -> list[dict[str, np.ndarray]]:
    """Return the outputs of several blocks at each tick, with the signals above as inputs."""
    builder = DiagramBuilder("d")
    input_values = {"u": U, "reset": TRIGGER, "initial": START, "enable": ENABLE}
    sources = {name: builder.add(name, sequence_source(values)) for name, values in input_values.items()}
    for number, block in enumerate(blocks):
        handle = builder.add(f"block {number}", block)
        for port in block.input_ports():
            builder.connect(sources[port.name], handle[port.name])
    system = trace_diagram(builder.build())
    p, update = system.parameter_values, system.update.casadi_function()
    z, rows = system.initial_discrete(p)[0], list[dict[str, np.ndarray]]()
    for k in range(COUNT):
        (after,) = update.call([np.array(value, dtype=float) for value in (k * T, (), z, (), p, [1.0])])
        z = np.asarray(after).ravel()
        rows.append(system.discrete.unpack(z))
    return [
        {
            port.name: np.array([row[f"block {k}/{port.name}"] for row in rows])
            for port in block.output_ports()
        }
        for k, block in enumerate(blocks)
    ]


@pytest.mark.parametrize("method", ["forward_euler", "backward_euler", "trapezoidal"])
def test_a_discrete_integrator_is_reset_at_its_ticks(method: str) -> None:
    cases = list(product(EXTERNAL_RESETS, ("internal", "external", "external at resets")))
    blocks = [
        DiscreteIntegrator(
            method=method,
            gain=2.0,
            external_reset=kind,
            initial_condition_source=source,
            initial=0.3,
            lower=-0.9,
            upper=0.8,
            state_port=True,
            saturation_port=True,
            sample_time=T,
        )
        for kind, source in cases
    ]
    for (kind, source), outputs in zip(cases, tick_outputs(*blocks)):
        check_discrete_integrator(outputs, kind, source, method)


def check_discrete_integrator(actual: dict[str, np.ndarray], kind: str, source: str, method: str) -> None:
    """Compare outputs with the recurrence, for a gain of 2 and limits."""
    lower, upper = -0.9, 0.8
    weight = {"forward_euler": 0.0, "backward_euler": 1.0, "trapezoidal": 0.5}[method]
    x = START[0] if source == "external" else 0.3
    for k in range(COUNT):
        assert actual["state"][k] == pytest.approx(min(max(x, lower), upper), abs=1e-13)
        if reset_fires(kind, TRIGGER[k], TRIGGER[k - 1] if k else None):
            x = 0.3 if source == "internal" else START[k]
        y = min(max(x + weight * 2.0 * T * U[k], lower), upper)
        assert actual["y"][k] == pytest.approx(y, abs=1e-13)
        assert actual["saturated"][k] == (1.0 if y >= upper else -1.0 if y <= lower else 0.0)
        x = min(max(x + 2.0 * T * U[k], lower), upper)


def test_a_delay_is_reset_at_its_ticks() -> None:
    cases = list(product(EXTERNAL_RESETS, ("internal", "external"), (1, 3), (False, True)))
    blocks = [
        ResettableDelay(
            length=length,
            external_reset=kind,
            initial_condition_source=source,
            initial=0.3,
            enable_port=enable,
            sample_time=T,
        )
        for kind, source, length, enable in cases
    ]
    for case, outputs in zip(cases, tick_outputs(*blocks)):
        check_delay(outputs["y"], *case)


def check_delay(actual: np.ndarray, kind: str, source: str, length: int, enable: bool) -> None:
    """Compare outputs with the list of earlier inputs."""
    buffer, held, before, started = [0.3] * length, 0.3, None, source == "internal"
    for k in range(COUNT):
        if not enable or ENABLE[k]:
            if reset_fires(kind, TRIGGER[k], before) or not started:
                buffer = [START[k] if source == "external" else 0.3] * length
            held, started, before = buffer[0], True, TRIGGER[k]
            buffer = [*buffer[1:], U[k]]
        assert actual[k] == pytest.approx(held, abs=1e-14)


def test_a_resettable_delay_without_reset_agrees_with_the_delay_block() -> None:
    plain = Delay(length=3, initial=0.3, sample_time=T)
    block = ResettableDelay(
        length=3, external_reset="none", initial_condition_source="internal", initial=0.3, sample_time=T
    )
    outputs, expected = tick_outputs(block, plain)
    np.testing.assert_array_equal(outputs["y"], expected["y"])


def test_a_delay_of_vectors_is_reset_to_a_scalar() -> None:
    builder = DiagramBuilder("d")
    source = builder.add("u", SineWave(amplitude=[1.0, 2.0]))
    pulses = builder.add("reset", PulseGenerator(period=0.5, width=20.0))
    block = ResettableDelay(length=2, external_reset="level hold", sample_time=T)
    builder.add("block", block, source, pulses, builder.add("start", Constant(value=7.0)))
    y = ab.simulate(builder.build(), stop_time=0.9, sample_time=T)["block/y"]
    u = np.outer(np.sin(T * np.arange(10)), [1.0, 2.0])
    expected = [[7, 7], [7, 7], u[0], u[1], u[2], [7, 7], [7, 7], u[5], u[6], u[7]]
    assert y == pytest.approx(np.array(expected), abs=1e-14)
    with pytest.raises(DiagramError, match=r"has shape \(2, 2\).*Allowed: a scalar or a vector.*Reshape"):
        builder = DiagramBuilder("d")
        builder.add("block", Delay(sample_time=T), builder.add("u", Constant(value=np.eye(2))))
        builder.build()


def test_a_loop_through_the_state_port_is_not_algebraic() -> None:
    """A sum that is reset to half of its value, which the state port gives; y depends on the reset itself."""

    def loop(port: str) -> Diagram:
        builder = DiagramBuilder("d")
        block = DiscreteIntegrator(
            external_reset="rising",
            initial_condition_source="external at resets",
            state_port=True,
            sample_time=T,
        )
        handle = builder.add("sum", block)
        builder.connect(builder.add("one", Constant(value=1.0)), handle["u"])
        builder.connect(builder.add("pulses", PulseGenerator(period=1.0)), handle["reset"])
        builder.connect(builder.add("half", Gain(gain=0.5), handle[port]), handle["initial"])
        return builder.build()

    y = ab.simulate(loop("state"), stop_time=2.9, sample_time=T)["sum/y"]
    expected, x = list[float](), 0.0
    for k in range(30):
        x = 0.5 * x if k in (10, 20) else x
        expected.append(x)
        x += T
    assert y == pytest.approx(np.array(expected), abs=1e-13)
    with pytest.raises(AlgebraicLoopError, match=r"sum/y.*half/y|half/y.*sum/y"):
        ab.simulate(loop("y"), stop_time=1.0)


# -- in continuous time --------------------------------------------------------------------------------------


def integral(block: ResettableIntegrator, sources: Mapping[str, Block]) -> Diagram:
    builder = DiagramBuilder("d")
    handle = builder.add("y", block)
    for name, source in sources.items():
        builder.connect(builder.add(f"source {name}", source), handle[name])
    return builder.build()


@SOLVERS
@pytest.mark.parametrize("kind", ["level", "level hold"])
def test_a_level_reset_holds_the_present_initial_value(kind: str, solver: dict[str, Any]) -> None:
    """y = sin 3t in each pulse (0.5 s to 1.25 s, 2.5 s to 3.25 s …); afterwards y rises with rate 1."""
    pulses = PulseGenerator(period=2.0, width=37.5, delay=0.5)
    block = ResettableIntegrator(external_reset=kind, initial_condition_source="external")
    sources = {"u": Constant(value=1.0), "reset": pulses, "initial": SineWave(frequency=3.0)}
    result = ab.simulate(integral(block, sources), stop_time=4.0, sample_time=0.01, **solver)
    t = result.time
    phase = np.mod(t - 0.5, 2.0)
    held = (t >= 0.5) & (phase < 0.75 - 1e-12)
    released = t - phase + 0.75
    expected = np.where(held, np.sin(3 * t), np.sin(3 * released) + (t - released))
    expected = np.where(t < 0.5, t, expected)
    assert result["y/y"] == pytest.approx(expected, abs=1e-9)


@SOLVERS
def test_level_hold_keeps_the_initial_value_before_the_trigger_falls(solver: dict[str, Any]) -> None:
    """Where the initial value jumps as the trigger falls, level takes the new value, level hold the old."""
    pulse = PulseGenerator(period=10.0, width=10.0, amplitude=2.0)
    for kind, initial in (("level", 0.0), ("level hold", 2.0)):
        block = ResettableIntegrator(external_reset=kind, initial_condition_source="external")
        sources = {"u": Constant(value=1.0), "reset": pulse, "initial": pulse}
        result = ab.simulate(integral(block, sources), stop_time=3.0, sample_time=0.1, **solver)
        t = result.time
        expected = np.where(t < 1.0 - 1e-9, 2.0, initial + t - 1.0)
        assert result["y/y"] == pytest.approx(expected, abs=1e-9)


@SOLVERS
def test_the_start_value_of_each_initial_condition_source(solver: dict[str, Any]) -> None:
    for source, start in (("external", 5.0), ("external at resets", 1.0), ("internal", 1.0)):
        block = ResettableIntegrator(external_reset="none", initial_condition_source=source, initial=1.0)
        sources: dict[str, Block] = {"u": Clock(), "initial": Constant(value=5.0)}
        if source == "internal":
            del sources["initial"]
        result = ab.simulate(integral(block, sources), stop_time=2.0, sample_time=0.1, **solver)
        assert result["y/y"] == pytest.approx(start + result.time**2 / 2, abs=1e-9)


def test_the_initial_port_is_read_after_the_modes_are_consistent() -> None:
    """The initial value comes from a Relay, whose mode depends on the signals at the start."""
    builder = DiagramBuilder("d")
    relay = builder.add("relay", Relay(on_value=4.0, off_value=-4.0), builder.add("one", Constant(value=1.0)))
    block = ResettableIntegrator(external_reset="none", initial_condition_source="external")
    builder.add("y", block, builder.add("zero", Constant(value=0.0)), relay)
    y = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.1)["y/y"]
    assert y.tolist() == [4.0] * 11


def test_a_continued_run_does_not_reset_the_integrator() -> None:
    block = ResettableIntegrator(external_reset="none", initial_condition_source="external")
    diagram = integral(block, {"u": Constant(value=1.0), "initial": Constant(value=5.0)})
    first = ab.simulate(diagram, stop_time=1.0)
    second = ab.simulate(diagram, stop_time=2.0, initial_state=first.final_state)
    assert second["y/y"][-1] == pytest.approx(7.0, abs=1e-9)


@SOLVERS
def test_a_bouncing_ball_with_the_state_port(solver: dict[str, Any]) -> None:
    """The speed becomes -e v at each impact; the state port gives v. Impact times of the FMI reference."""
    builder = DiagramBuilder("d")
    speed = builder.add(
        "speed",
        ResettableIntegrator(
            external_reset="falling", initial_condition_source="external at resets", state_port=True
        ),
    )
    builder.connect(builder.add("g", Constant(value=-9.81)), speed["u"])
    builder.connect(builder.add("bounce", Gain(gain=-0.7), speed["state"]), speed["initial"])
    height = builder.add("height", Integrator(initial=1.0), speed["y"])
    builder.connect(height, speed["reset"])
    result = ab.simulate(builder.build(), stop_time=1.5, sample_time=0.01, **solver)
    impacts = np.flatnonzero(np.diff(result["speed/y"]) > 1.0)
    assert result.time[impacts] == pytest.approx([0.45, 1.08], abs=0.011)
    t = result.time
    first, v = np.sqrt(2 / 9.81), 0.7 * np.sqrt(2 * 9.81)
    after = (t > first) & (t < first + 2 * v / 9.81)
    assert result["height/y"][after] == pytest.approx(
        (v * (t - first) - 4.905 * (t - first) ** 2)[after], abs=1e-8
    )


@SOLVERS
def test_a_loop_of_a_level_reset_through_the_state_port_and_through_y(solver: dict[str, Any]) -> None:
    """During the reset y = 0.5 + state / 2; the loop through y has the solution of y = 0.5 + y / 2, y = 1."""
    expected = {"y": 1.0, "state": 0.5}
    for port, held in expected.items():
        builder = DiagramBuilder("d")
        block = ResettableIntegrator(
            external_reset="level", initial_condition_source="external at resets", state_port=True
        )
        handle = builder.add("y", block)
        builder.connect(builder.add("rate", Constant(value=1.0)), handle["u"])
        builder.connect(builder.add("on", PulseGenerator(period=10.0, width=20.0)), handle["reset"])
        half = builder.add("half", Gain(gain=0.5), handle[port])
        builder.connect(
            builder.add("initial", Sum(), half, builder.add("c", Constant(value=0.5))), handle["initial"]
        )
        result = ab.simulate(builder.build(), stop_time=4.0, sample_time=0.5, **solver)
        t = result.time
        assert result["y/y"] == pytest.approx(np.where(t < 2.0, held, held + t - 2.0), abs=1e-9)


@SOLVERS
def test_an_integrator_with_limits_and_resets(solver: dict[str, Any]) -> None:
    """The integral of 1 within -1 and 1, reset at 0.5 s, 3.5 s … to -3, limited to -1: a clipped sawtooth."""
    block = ResettableIntegrator(external_reset="rising", initial=-3.0, limit_output=True)
    pulses = PulseGenerator(period=3.0, delay=0.5)
    result = ab.simulate(
        integral(block, {"u": Constant(value=1.0), "reset": pulses}), stop_time=9.0, sample_time=0.1, **solver
    )
    t = result.time
    free = np.where(t < 0.5 - 1e-9, t - 1.0, np.mod(t - 0.5 + 1e-9, 3.0) - 1e-9 - 1.0)
    assert result["y/y"] == pytest.approx(np.minimum(free, 1.0), abs=1e-8)
    inside = np.abs(free - 1.0) > 1e-6
    assert result["y/saturated"][inside].tolist() == (free > 1.0)[inside].astype(float).tolist()
    with pytest.raises(InputError, match=r"ResettableIntegrator.*lower <= upper"):
        ResettableIntegrator(limit_output=True, lower=2.0)


def test_sampled_and_continuous_integrators_are_reset_at_the_same_times() -> None:
    """A staircase signal that changes at ticks triggers both integrators."""
    for kind in EDGES:
        builder = DiagramBuilder("d")
        trigger = builder.add(
            "trigger", ZeroOrderHold(sample_time=T), builder.add("sine", SineWave(frequency=5.0))
        )
        one = builder.add("one", Constant(value=1.0))
        builder.add("continuous", ResettableIntegrator(external_reset=kind), one, trigger)
        sampled = DiscreteIntegrator(external_reset=kind, sample_time=T)
        builder.add("sampled", sampled, one, trigger)
        builder.add("late", UnitDelay(sample_time=T), trigger)
        result = ab.simulate(builder.build(), stop_time=5.0, sample_time=T)
        assert result["continuous/y"] == pytest.approx(result["sampled/y"], abs=1e-9)


def test_the_message_about_an_initial_shape_names_port_and_parameter() -> None:
    builder = DiagramBuilder("d")
    block = DiscreteIntegrator(initial_condition_source="external", initial=[1.0, 2.0], sample_time=T)
    builder.add(
        "block", block, builder.add("u", Constant(value=1.0)), builder.add("x0", Constant(value=[1.0] * 3))
    )
    message = r"'initial' has shape \(3,\) and 'parameter initial' has shape \(2,\)"
    with pytest.raises(DiagramError, match=message):
        builder.build()
