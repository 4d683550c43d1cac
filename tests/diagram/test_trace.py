"""Tracing a diagram to equations: paths, aliases, exact derivatives, units, and cost."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import ClassVar

import numpy as np
import pytest
from casadi import SX

from armblocks.blocks import (
    PID,
    Clock,
    Constant,
    Demux,
    Derivative,
    Gain,
    Integrator,
    JTraj,
    MathFunction,
    Mux,
    Product,
    Scope,
    SineWave,
    Step,
    Sum,
    Trigonometry,
)
from armblocks.diagram import (
    Block,
    Diagram,
    DiagramBuilder,
    Port,
    Signals,
    block_equations,
    rate_unit,
    trace_diagram,
)
from armblocks.diagram.units import integral_unit
from armblocks.equations import HybridSystem
from armblocks.errors import DiagramError


def signals_at(system: HybridSystem, t: float, x: Sequence[float] = ()) -> dict[str, np.ndarray]:
    (y,) = system.signals(t, x, (), (), system.parameter_values)
    return system.signals_layout.unpack(y)


def falling() -> Diagram:
    builder = DiagramBuilder("falling")
    acceleration = builder.add("acceleration", Constant(value=-9.81))
    speed = builder.add("speed", Integrator(), acceleration)
    height = builder.add("height", Integrator(initial=10.0), speed)
    builder.add("scope", Scope(inputs=2), height, speed)
    return builder.build()


def test_states_signals_parameters_and_aliases_have_their_paths() -> None:
    system = trace_diagram(falling())
    assert system.name == "falling"
    assert system.states.names == ("height/x", "speed/x")
    assert system.parameters.names == ("acceleration.value", "height.initial", "speed.initial")
    assert set(system.signals_layout.names) == {"acceleration/y", "height/y", "speed/y"}
    assert system.aliases["scope/u1"] == "height/y"
    assert system.aliases["speed/u"] == "acceleration/y"
    assert system.aliases["height"] == "height/y"
    assert system.parameter_values.tolist() == [-9.81, 10.0, 0.0]


def test_derivatives_and_initial_states_depend_on_the_parameters() -> None:
    system = trace_diagram(falling())
    (rate,) = system.derivative(0.0, [1.0, 2.0], (), (), system.parameter_values)
    assert rate.tolist() == [2.0, -9.81]
    assert system.initial_states(system.parameter_values)[0].tolist() == [10.0, 0.0]
    assert system.initial_states([-9.81, 7.0, 3.0])[0].tolist() == [7.0, 3.0]
    assert system.breakpoints(system.parameter_values)[0].shape == (0,)


def test_signals_are_listed_in_evaluation_order() -> None:
    builder = DiagramBuilder("d")
    z = builder.add("z", Clock())
    y = builder.add("y", Gain(gain=2.0), z)
    builder.add("x", Gain(gain=3.0), y)
    assert trace_diagram(builder.build()).signals_layout.names == ("z/y", "y/y", "x/y")


def test_matrices_are_stored_in_row_major_order() -> None:
    builder = DiagramBuilder("d")
    matrix = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    builder.add("double", Gain(gain=2.0), builder.add("matrix", Constant(value=matrix)))
    system = trace_diagram(builder.build())
    assert system.parameter_values.tolist() == [2.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert np.array_equal(signals_at(system, 0.0)["double/y"], 2 * np.array(matrix))


def test_breakpoints_depend_on_their_parameters() -> None:
    builder = DiagramBuilder("d")
    builder.add("step", Step(time=2.0, final=[1.0, 2.0]))
    system = trace_diagram(builder.build())
    assert system.breakpoints(system.parameter_values)[0].tolist() == [2.0]
    assert signals_at(system, np.nextafter(2.0, 0.0))["step/y"].tolist() == [0.0, 0.0]
    assert signals_at(system, 2.0)["step/y"].tolist() == [1.0, 2.0]


def system_in_order(
    build: Callable[[DiagramBuilder, tuple[int, ...]], None], order: tuple[int, ...]
) -> HybridSystem:
    builder = DiagramBuilder("d")
    build(builder, order)
    return trace_diagram(builder.build())


def test_the_order_of_adding_blocks_does_not_change_the_signals() -> None:
    blocks: list[tuple[str, Block]] = [
        ("sine", SineWave(frequency=3.0)),
        ("control", PID(P=2.0, I=0.5, D=0.1)),
        ("plant", Integrator(initial=0.3)),
        ("error", Sum(signs="+-")),
        ("rate", Derivative()),
    ]
    wires = [("sine", "error.u1"), ("plant", "error.u2"), ("error", "control.u"), ("control", "plant.u")]
    wires.append(("plant", "rate.u"))

    def build(builder: DiagramBuilder, order: tuple[int, ...]) -> None:
        handles = {blocks[k][0]: builder.add(*blocks[k]) for k in order}
        for k in order:
            source, target = wires[k]
            block, port = target.split(".")
            builder.connect(handles[source], handles[block][port])

    reference = system_in_order(build, (0, 1, 2, 3, 4))
    x = [0.1, 0.2, 0.3]
    for order in list(permutations(range(5)))[::17]:
        system = system_in_order(build, order)
        assert system.signals_layout == reference.signals_layout
        assert system.parameter_values.tolist() == reference.parameter_values.tolist()
        for function in ("signals", "derivative"):
            (values,) = getattr(system, function)(0.7, x, (), (), system.parameter_values)
            (expected,) = getattr(reference, function)(0.7, x, (), (), reference.parameter_values)
            assert values.tolist() == expected.tolist()


# -- the exact derivative ----------------------------------------------------------------------------------


def test_the_derivative_of_a_trajectory_equals_its_speed_bit_for_bit() -> None:
    builder = DiagramBuilder("d")
    traj = builder.add("traj", JTraj(q0=[0, 0, 0, 0], qf=[3.14, 0, 1.57, 0]))
    speed = builder.add("speed", Derivative(), traj["q"])
    builder.add("acceleration", Derivative(), speed)
    system = trace_diagram(builder.build())
    for t in (0.0, 0.3, 5.0, 9.99, 10.0, 12.0):
        signals = signals_at(system, t)
        assert np.array_equal(signals["speed/y"], signals["traj/qd"])
        assert np.array_equal(signals["acceleration/y"], signals["traj/qdd"])


def test_the_derivative_uses_the_chain_rule_through_blocks_and_states() -> None:
    """y = x^2 sin(t), x' = -3x + t: y' and y'' are compared with their closed forms."""
    builder = DiagramBuilder("d")
    clock = builder.add("clock", Clock())
    x = builder.add("x", Integrator(initial=1.0))
    builder.connect(builder.add("rate", Sum(), builder.add("decay", Gain(gain=-3.0), x), clock), x)
    square = builder.add("square", MathFunction(function="square"), x)
    y = builder.add("y", Product(), square, builder.add("sine", Trigonometry(function="sin"), clock))
    first = builder.add("first", Derivative(), y)
    builder.add("second", Derivative(), first)
    system = trace_diagram(builder.build())
    for t, s in ((0.0, 1.0), (0.8, -0.4), (2.0, 1.3)):
        d = -3 * s + t
        dd = -3 * d + 1
        signals = signals_at(system, t, [s])
        one = 2 * s * d * np.sin(t) + s**2 * np.cos(t)
        two = (2 * d * d + 2 * s * dd) * np.sin(t) + 4 * s * d * np.cos(t) - s**2 * np.sin(t)
        # a few rounding errors each
        assert signals["first/y"] == pytest.approx(one, rel=1e-14, abs=1e-14)
        assert signals["second/y"] == pytest.approx(two, rel=1e-14, abs=1e-14)


def test_the_derivative_of_a_vector_is_taken_by_element() -> None:
    builder = DiagramBuilder("d")
    clock = builder.add("clock", Clock())
    sine = builder.add("sine", Trigonometry(function="sin"), clock)
    parts = builder.add("parts", Demux(), builder.add("pair", Mux(), clock, sine))
    builder.add("rate", Derivative(), builder.add("again", Mux(), parts["y2"], parts["y1"]))
    assert signals_at(trace_diagram(builder.build()), 0.4)["rate/y"].tolist() == [np.cos(0.4), 1.0]


def test_the_derivative_of_a_step_is_zero() -> None:
    builder = DiagramBuilder("d")
    builder.add("rate", Derivative(), builder.add("step", Step(time=1.0)))
    system = trace_diagram(builder.build())
    assert [float(signals_at(system, t)["rate/y"]) for t in (0.0, 1.0, 2.0)] == [0.0, 0.0, 0.0]


def test_a_derivative_may_be_the_input_of_an_integrator() -> None:
    """x' = d/dt sin(t), so that x is the sine."""
    builder = DiagramBuilder("d")
    rate = builder.add("rate", Derivative(), builder.add("sine", SineWave(frequency=2.0)))
    builder.add("x", Integrator(), rate)
    system = trace_diagram(builder.build())
    (xd,) = system.derivative(0.3, [0.0], (), (), system.parameter_values)
    assert xd[0] == pytest.approx(2 * np.cos(0.6), rel=1e-15)


# -- units -------------------------------------------------------------------------------------------------


def test_units_are_propagated_through_blocks() -> None:
    builder = DiagramBuilder("d")
    clock = builder.add("clock", Clock())
    traj = builder.add("traj", JTraj())
    jerk = builder.add("jerk", Derivative(), traj["qdd"])
    builder.add("back", Integrator(), traj["qd"])
    builder.add("sum", Sum(), builder.add("back2", Integrator(), jerk), traj["qdd"])
    builder.add("mixed", Sum(), clock, traj["q"])
    units = {slot.name: slot.unit for slot in trace_diagram(builder.build()).signals_layout}
    assert units["jerk/y"] == "rad/s3"
    assert units["back/y"] == "rad"
    assert units["sum/y"] == "rad/s2"
    assert units["mixed/y"] == ""


def test_signals_that_are_added_to_a_speed_take_its_unit() -> None:
    builder = DiagramBuilder("d")
    traj, set_point = builder.add("traj", JTraj()), builder.add("reference", Step())
    builder.add("error", Sum(signs="+-"), set_point, traj["qd"])
    builder.add("both", Mux(), set_point, traj["qd"])
    clock, load = builder.add("clock", Clock()), builder.add("load", Step())
    builder.add("mixed", Sum(signs="+++"), load, traj["q"], clock)
    units = {slot.name: slot.unit for slot in trace_diagram(builder.build()).signals_layout}
    assert units["reference/y"] == units["error/y"] == units["both/y"] == "rad/s"
    assert units["load/y"] == units["mixed/y"] == ""


@pytest.mark.parametrize(
    ("unit", "rate"), [("m", "m/s"), ("m/s", "m/s2"), ("rad/s2", "rad/s3"), ("", ""), ("N m", "N m/s")]
)
def test_units_of_derivatives_and_integrals_are_inverse(unit: str, rate: str) -> None:
    assert rate_unit(unit) == rate
    assert integral_unit(rate) == unit


# -- growth ------------------------------------------------------------------------------------------------


def count_calls(work: Callable[[], object]) -> int:
    """Count function calls: a measure of work that does not depend on other processes."""
    calls = 0

    def count(frame: object, event: str, argument: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        work()
    finally:
        sys.setprofile(None)
    return calls


def chain(length: int) -> HybridSystem:
    builder = DiagramBuilder("chain")
    last = builder.add("source", SineWave())
    for k in range(length):
        last = builder.add(f"integrator{length - k}", Integrator(), last)
        last = builder.add(f"gain{length - k}", Gain(gain=float(k)), last)
    return trace_diagram(builder.build())


def test_tracing_work_grows_linearly_with_the_diagram() -> None:
    chain(10)  # traces the equations of the block types, which are then cached
    small, large = count_calls(lambda: chain(50)), count_calls(lambda: chain(500))
    # sorting grows slightly faster than linearly
    assert large < 10.5 * small


def test_blocks_that_differ_only_in_tunable_parameters_are_traced_once() -> None:
    one = block_equations(Gain(gain=2.0), {"u": (3,)})
    assert block_equations(Gain(gain=5.0), {"u": (3,)}) is one
    assert block_equations(Gain(gain=2.0), {"u": ()}) is not one
    assert block_equations(Gain(gain=[1.0, 2.0, 3.0]), {"u": (3,)}) is not one
    assert block_equations(Sum(signs="+-"), {"u1": (), "u2": ()}) is not block_equations(
        Sum(signs="++"), {"u1": (), "u2": ()}
    )


def test_equations_without_a_declared_output_are_refused() -> None:
    @dataclass(frozen=True, kw_only=True)
    class Forgetful(Block):
        """A block that declares the output y and computes z."""

        title: ClassVar[str] = "Forgetful"

        def output_ports(self) -> tuple[Port, ...]:
            return (Port("y", "said", shape=()),)

        def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
            return {"z": t}

    builder = DiagramBuilder("d")
    builder.add("f", Forgetful())
    with pytest.raises(DiagramError, match=r"block type Forgetful: the equations give \['z'\] as outputs"):
        builder.build()
