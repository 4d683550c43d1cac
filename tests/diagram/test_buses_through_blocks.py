"""Blocks that accept buses: the results equal a diagram with one block for each signal."""

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    ActionSubsystem,
    BusCreator,
    BusSelector,
    Constant,
    Delay,
    EnabledSubsystem,
    From,
    Gain,
    Goto,
    If,
    ManualSwitch,
    Memory,
    Merge,
    MultiportSwitch,
    PulseGenerator,
    Ramp,
    RateTransition,
    Scope,
    SineWave,
    Step,
    Switch,
    Terminator,
    ToWorkspace,
    UnitDelay,
    ZeroOrderHold,
)
from armblocks.diagram import Block, BlockHandle, Diagram, DiagramBuilder, Inport, Outport, Subsystem
from armblocks.equations import SimulationOptions
from armblocks.errors import DiagramError, UnknownNameError

NAMES = ("speed", "inner.angle", "inner.pair")
OPTIONS = SimulationOptions(stop_time=3.0, sample_time=0.05)


def signals(builder: DiagramBuilder, prefix: str, factor: float) -> list[BlockHandle]:
    """Add two scalar signals and a vector signal."""
    return [
        builder.add(f"{prefix} speed", SineWave(amplitude=factor, frequency=2.0)),
        builder.add(f"{prefix} angle", Ramp(slope=factor)),
        builder.add(f"{prefix} pair", SineWave(amplitude=(factor, 2.0 * factor), phase=0.3)),
    ]


def bus_of(builder: DiagramBuilder, prefix: str, parts: list[BlockHandle]) -> BlockHandle:
    inner = builder.add(f"{prefix} inner", BusCreator(names="angle, pair"), *parts[1:])
    return builder.add(f"{prefix} bus", BusCreator(names="speed, inner"), parts[0], inner)


def pass_through(kind: str) -> Diagram:
    builder = DiagramBuilder(kind)
    signal = builder.add("u", Inport())
    builder.add("y", Outport(), signal)
    return builder.build()


BLOCKS: dict[str, tuple[Block, tuple[str, ...]]] = {
    "unit delay": (UnitDelay(sample_time=0.2, initial=0.5), ("a",)),
    "memory": (Memory(sample_time=0.2), ("a",)),
    "delay": (Delay(length=3, sample_time=0.1), ("a",)),
    "hold": (ZeroOrderHold(sample_time=0.25), ("a",)),
    "rates": (RateTransition(sample_time=0.25), ("a",)),
    "switch": (Switch(threshold=0.5), ("a", "control", "b")),
    "manual": (ManualSwitch(position=2.0), ("a", "b")),
    "multiport": (MultiportSwitch(inputs=2), ("index", "a", "b")),
    "enabled": (EnabledSubsystem(diagram=pass_through("enabled")), ("a", "control")),
    "plain": (Subsystem(diagram=pass_through("plain")), ("a",)),
}


def with_bus(block: Block, inputs: tuple[str, ...]) -> Diagram:
    builder = DiagramBuilder("bus", settings=OPTIONS)
    wires = controls(builder)
    for prefix, factor in (("a", 1.0), ("b", -3.0)):
        if prefix in inputs:
            wires[prefix] = bus_of(builder, prefix, signals(builder, prefix, factor))
    tested_block = builder.add("block", block, *(wires[name] for name in inputs))
    selected = builder.add("selected", BusSelector(elements=", ".join(NAMES)), tested_block)
    builder.add("scope", Scope(inputs=3), *(selected[name.rpartition(".")[2]] for name in NAMES))
    return builder.build()


def signal_by_signal(block: Block, inputs: tuple[str, ...]) -> Diagram:
    builder = DiagramBuilder("single", settings=OPTIONS)
    wires = controls(builder)
    parts = {
        prefix: signals(builder, prefix, factor)
        for prefix, factor in (("a", 1.0), ("b", -3.0))
        if prefix in inputs
    }
    outputs = [
        builder.add(
            f"block {k}", block, *(parts[name][k] if name in parts else wires[name] for name in inputs)
        )
        for k in range(3)
    ]
    builder.add("scope", Scope(inputs=3), *outputs)
    return builder.build()


def controls(builder: DiagramBuilder) -> dict[str, BlockHandle]:
    control = builder.add("control", PulseGenerator(period=0.7, width=40.0))
    return {"control": control, "index": builder.add("index", Step(time=1.3, initial=1.0, final=2.0))}


@pytest.mark.parametrize("name", BLOCKS)
def test_a_block_with_a_bus_equals_one_block_per_signal(name: str) -> None:
    combined, separate = with_bus(*BLOCKS[name]), signal_by_signal(*BLOCKS[name])
    combined_result, separate_result = ab.simulate(combined), ab.simulate(separate)
    for port in ("u1", "u2", "u3"):
        np.testing.assert_array_equal(combined_result[f"scope/{port}"], separate_result[f"scope/{port}"])
    # The signals have the names of the block and its ports.
    output = combined.blocks["block"].output_ports()[0].name
    for element, port in zip(NAMES, ("u1", "u2", "u3")):
        np.testing.assert_array_equal(
            combined_result[f"block/{output}.{element}"], combined_result[f"scope/{port}"]
        )
    assert float(np.ptp(combined_result["scope/u1"])) > 0.5, "the signal changes"


def test_merge_gives_the_bus_of_the_action_subsystem_that_executes() -> None:
    builder = DiagramBuilder("merge", settings=OPTIONS)
    chosen = builder.add("if", If(), builder.add("sign", SineWave(frequency=3.0)))
    ends: list[BlockHandle] = []
    for prefix, factor, port in (("a", 1.0, "if1"), ("b", -3.0, "else")):
        parts = signals(builder, prefix, factor)
        part = ActionSubsystem(diagram=pass_through(prefix))
        ends.append(builder.add(f"{prefix} action", part, bus_of(builder, prefix, parts), chosen[port]))
        ends += [builder.add(f"{prefix} action {k}", part, parts[k], chosen[port]) for k in range(3)]
    combined = builder.add("together", Merge(), ends[0], ends[4])
    separate = [builder.add(f"apart {k}", Merge(), ends[k], ends[k + 4]) for k in (1, 2, 3)]
    builder.add("shown", Scope(inputs=4), combined, *separate)
    result = ab.simulate(builder.build())
    for element, k in zip(NAMES, (1, 2, 3)):
        np.testing.assert_array_equal(result[f"together/y.{element}"], result[f"apart {k}/y"])


def test_a_bus_in_a_loop_through_a_delay() -> None:
    """Track and hold of each signal: y(k) = x during the pulse, then y(k-1)."""
    builder = DiagramBuilder("loop", settings=OPTIONS)
    bus = bus_of(builder, "a", signals(builder, "a", 1.0))
    sampling = builder.add("fresh", PulseGenerator(period=1.0, width=50.0))
    held = builder.add("held", Switch(threshold=0.5))
    builder.connect(bus, held["u1"])
    builder.connect(sampling, held["u2"])
    builder.connect(builder.add("before", UnitDelay(sample_time=0.1), held), held["u3"])
    builder.add("sent", Goto(tag="kept"), held)
    builder.add("kept", ToWorkspace(), builder.add("received", From(tag="kept")))
    result = ab.simulate(builder.build())
    speed, source, on = (result[name] for name in ("held/y.speed", "a speed/y", "fresh/y"))
    at = np.rint(result.time / 0.05).astype(int)
    assert np.array_equal(speed[on > 0.5], source[on > 0.5])
    # In the second half of each period the output has the value of the last tick in the first half.
    held_at = int(np.flatnonzero(at == 10)[0])
    assert np.all(speed[(at > 11) & (at < 20)] == speed[held_at + 2])
    assert result.resolve("kept/u.speed") == "held.speed/y"


def test_one_parameter_changes_all_signals_of_the_bus() -> None:
    block, inputs = BLOCKS["manual"]
    compiled = ab.compile_diagram(with_bus(block, inputs))
    names = [name for name in compiled.system.parameters.names if name.startswith("block")]
    assert names == ["block.position"]
    first = compiled.simulate(parameters={"block.position": 1.0})
    second = compiled.simulate(parameters={"block.position": 2.0})
    for port, source in (("u1", "speed"), ("u2", "angle"), ("u3", "pair")):
        np.testing.assert_array_equal(first[f"scope/{port}"], first[f"a {source}/y"])
        np.testing.assert_array_equal(second[f"scope/{port}"], second[f"b {source}/y"])


def test_a_bus_may_be_connected_to_a_terminator() -> None:
    builder = DiagramBuilder("end", settings=OPTIONS)
    builder.add("end", Terminator(), bus_of(builder, "a", signals(builder, "a", 1.0)))
    assert ab.simulate(builder.build()).run.complete


def two_buses(second: str, width: int = 1) -> DiagramBuilder:
    builder = DiagramBuilder("conflict")
    combined_result, two = builder.add("one", Constant()), builder.add("two", Constant(value=(1.0,) * width))
    first = builder.add("first", BusCreator(names="p, q"), combined_result, combined_result)
    other = builder.add("other", BusCreator(names=second), combined_result, two)
    builder.add("choose", ManualSwitch(), first, other)
    return builder


def test_different_buses_at_the_inputs_are_refused_with_both_ports() -> None:
    text = "'u1' is a bus with p, q, but input 'u2' is "
    with pytest.raises(DiagramError, match=f"{text}a bus with p, r") as caught:
        two_buses("p, r").build()
    assert "choose" in str(caught.value.where)
    builder = DiagramBuilder("mixed")
    combined_result = builder.add("one", Constant())
    builder.add(
        "choose",
        ManualSwitch(),
        builder.add("bus", BusCreator(names="p, q"), combined_result, combined_result),
        combined_result,
    )
    with pytest.raises(DiagramError, match=f"{text}the single signal 'one/y'"):
        builder.build()
    assert two_buses("p, q", width=3).build()  # a scalar is broadcast to a vector, as without buses


def test_bus_elements_of_different_shape_are_refused_with_both_sources() -> None:
    builder = DiagramBuilder("wide")
    two, three = (
        builder.add("two", Constant(value=(1.0, 2.0))),
        builder.add("three", Constant(value=(1.0,) * 3)),
    )
    buses = [builder.add(f"bus {k}", BusCreator(names="p"), wire) for k, wire in enumerate((two, three))]
    builder.add("choose", ManualSwitch(), *buses)
    with pytest.raises(DiagramError) as caught:
        builder.build()
    assert (
        "choose.p" in str(caught.value)
        and "'two/y'" in str(caught.value)
        and "'three/y'" in str(caught.value)
    )


def test_a_bus_at_a_block_that_computes_is_refused() -> None:
    builder = DiagramBuilder("gain")
    combined_result = builder.add("one", Constant())
    builder.add(
        "gain", Gain(), builder.add("bus", BusCreator(names="p, q"), combined_result, combined_result)
    )
    with pytest.raises(DiagramError, match="receives a bus with the elements p, q"):
        builder.build()


def test_an_unknown_element_of_the_bus_after_a_block_is_refused() -> None:
    builder = DiagramBuilder("unknown")
    combined_result = builder.add("one", Constant())
    bus = builder.add("bus", BusCreator(names="p, q"), combined_result, combined_result)
    builder.add("pick", BusSelector(elements="r"), builder.add("delay", UnitDelay(sample_time=1.0), bus))
    with pytest.raises(UnknownNameError, match="there is no bus element named 'r'"):
        builder.build()
