"""Flattening: a hierarchical diagram is equivalent to a flat diagram of its blocks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    PID,
    BusAssignment,
    BusCreator,
    BusSelector,
    Clock,
    Constant,
    Display,
    EnabledSubsystem,
    From,
    Gain,
    Goto,
    Inport,
    Integrator,
    MatrixGain,
    Outport,
    Scope,
    SineWave,
    Step,
    Subsystem,
    Sum,
    UnitDelay,
)
from armblocks.diagram import (
    Diagram,
    DiagramBuilder,
    PortRef,
    diagram_views,
    flat_diagram,
    flatten_hierarchy,
    trace_diagram,
    with_parameters,
)
from armblocks.errors import AlgebraicLoopError, DiagramError, InputError, UnknownNameError


def loop_in_levels() -> Diagram:
    """A control loop: controller and plant are subsystems, and the controller contains another one."""
    builder = DiagramBuilder("loop")
    reference = builder.add("reference", Step(time=0.5, final=2.0))
    with builder.subsystem("controller", reference) as controller:
        error = controller.add(
            "error", Sum(signs="+-"), controller.input("reference"), controller.input("is")
        )
        with controller.subsystem("law", error) as law:
            u = law.input("e")
            law.output("u", law.add("pid", PID(P=3.0, I=1.5, D=0.2, N=40.0), u))
        controller.output("force", controller["law"])
        controller.output("error_out", error)
    with builder.subsystem("plant", builder["controller"]["force"]) as plant:
        force = plant.input("force")
        acceleration = plant.add("acceleration", Sum(signs="+-"), force)
        speed = plant.add("speed", Integrator(), acceleration)
        plant.connect(plant.add("drag", Gain(gain=0.4), speed), acceleration["u2"])
        plant.output("position", plant.add("position_", Integrator(initial=0.1), speed))
    builder.connect(builder["plant"], builder["controller"]["is"])
    builder.add("sampled", UnitDelay(sample_time=0.1), builder["plant"])
    builder.add("scope", Scope(inputs=2), builder["plant"], builder["controller"]["error_out"])
    return builder.build()


def flat_loop() -> Diagram:
    """The same diagram without subsystems."""
    builder = DiagramBuilder("loop")
    reference = builder.add("reference", Step(time=0.5, final=2.0))
    error = builder.add("error", Sum(signs="+-"), reference)
    pid = builder.add("pid", PID(P=3.0, I=1.5, D=0.2, N=40.0), error)
    acceleration = builder.add("acceleration", Sum(signs="+-"), pid)
    speed = builder.add("speed", Integrator(), acceleration)
    builder.connect(builder.add("drag", Gain(gain=0.4), speed), acceleration["u2"])
    position = builder.add("position_", Integrator(initial=0.1), speed)
    builder.connect(position, error["u2"])
    builder.add("sampled", UnitDelay(sample_time=0.1), position)
    builder.add("scope", Scope(inputs=2), position, error)
    return builder.build()


PATHS = {
    "reference": "reference",
    "controller/error": "error",
    "controller/law/pid": "pid",
    "plant/acceleration": "acceleration",
    "plant/speed": "speed",
    "plant/drag": "drag",
    "plant/position_": "position_",
    "sampled": "sampled",
}


@pytest.mark.parametrize("settings", [{"solver": "rk4", "step": 0.01}, {"solver": "rk45", "rtol": 1e-8}])
def test_flattening_does_not_change_the_signals(settings: dict[str, object]) -> None:
    levels = ab.simulate(loop_in_levels(), stop_time=3.0, **settings)
    by_hand = ab.simulate(flat_loop(), stop_time=3.0, **settings)
    assert np.array_equal(levels.time, by_hand.time)
    for path, name in PATHS.items():
        assert np.array_equal(levels[f"{path}/y"], by_hand[f"{name}/y"]), path


def test_ports_of_subsystems_are_aliases_of_their_signals() -> None:
    result = ab.simulate(loop_in_levels(), stop_time=1.0)
    for alias, signal in {
        "plant/position": "plant/position_/y",
        "plant": "plant/position_/y",
        "plant/force": "controller/law/pid/y",
        "controller/force": "controller/law/pid/y",
        "controller/law/e": "controller/error/y",
        "controller/law/e/y": "controller/error/y",
        "controller/law/u/u": "controller/law/pid/y",
        "scope/u2": "controller/error/y",
        "controller/error/u2": "plant/position_/y",
    }.items():
        assert result.resolve(alias) == signal


def test_flattening_returns_a_flat_diagram_unchanged_and_is_cached() -> None:
    diagram = flat_loop()
    assert flat_diagram(diagram) is diagram
    hierarchy = loop_in_levels()
    assert flatten_hierarchy(hierarchy) is flatten_hierarchy(hierarchy)


def test_parameters_of_inner_blocks_are_changed_by_path_without_compilation() -> None:
    diagram = loop_in_levels()
    model = ab.compile_diagram(diagram)
    before = model.compiled
    by_path = ab.simulate(model, parameters={"controller/law/pid.P": 5.0, "plant/drag.gain": 0.1})
    assert model.compiled is before
    changed = with_parameters(diagram, {"controller/law/pid.P": 5.0, "plant/drag.gain": 0.1})
    assert flat_diagram(changed).block("controller/law/pid").parameter_value("P") == 5.0
    assert np.array_equal(by_path["plant"], ab.simulate(changed)["plant"])
    with pytest.raises(UnknownNameError, match="there is no parameter named 'kx'"):
        with_parameters(diagram, {"controller/law/pid.kx": 5.0})
    with pytest.raises(UnknownNameError, match="there is no block named 'low/pid'"):
        with_parameters(diagram, {"controller/low/pid.P": 5.0})
    with pytest.raises(DiagramError, match=r"block 'controller/law/pid', PID\.P"):
        with_parameters(diagram, {"controller/law/pid.P": "fast"})


def test_the_view_of_a_sink_in_a_subsystem_has_its_path() -> None:
    builder = DiagramBuilder("top")
    with builder.subsystem("inner", builder.add("clock", Clock())) as inner:
        inner.add("display", Display(), inner.input("t"))
    ((name, view),) = diagram_views(builder.build())
    assert (name, view.signals) == ("inner/display", ("u",))


def test_an_in_block_at_the_top_level_outputs_its_value() -> None:
    builder = DiagramBuilder("part")
    builder.output("y", builder.add("gain", Gain(gain=3.0), builder.input("u", value=[1.0, 2.0])))
    result = ab.simulate(builder.build(), stop_time=1.0)
    assert np.array_equal(result["gain/y"][-1], [3.0, 6.0])
    assert np.array_equal(result["y"][-1], [3.0, 6.0])
    wide = DiagramBuilder("wide")
    wide.output("y", wide.input("u", dimensions=3, value=2.0))
    assert np.array_equal(ab.simulate(wide.build(), stop_time=1.0)["u"][-1], [2.0, 2.0, 2.0])
    odd = DiagramBuilder("odd")
    odd.output("y", odd.input("u", dimensions=3, value=[1.0, 2.0]))
    with pytest.raises(DiagramError, match="the value has 2 entries"):
        ab.simulate(odd.build())


def test_ports_are_ordered_by_their_numbers() -> None:
    builder = DiagramBuilder("inner")
    builder.output("sum", builder.add("s", Sum(signs="+-"), builder.input("b"), builder.input("a")))
    block = Subsystem(diagram=builder.build())
    assert [port.name for port in block.input_ports()] == ["b", "a"]
    twice = DiagramBuilder("twice")
    twice.output("one", twice.input("u", port=2))
    twice.output("two", twice.input("v", port=2))
    with pytest.raises(DiagramError, match="'u' and 'v' are both In number 2"):
        twice.build()


def test_wrong_dimensions_of_ports_are_refused() -> None:
    with pytest.raises(InputError, match=r"the dimensions are \[0.0\]"):
        Inport(dimensions=0)
    builder = DiagramBuilder("top")
    with builder.subsystem("sub", builder.add("c", Constant(value=[1.0, 2.0]))) as sub:
        sub.output("y", sub.input("u", dimensions=3))
    with pytest.raises(DiagramError, match=r"^block 'sub': 'c/y' gives shape \(2,\) but 'sub/u' takes"):
        builder.build()


def test_errors_in_a_subsystem_name_the_path() -> None:
    builder = DiagramBuilder("top")
    inner = DiagramBuilder("inner")
    inner.add("scope", Scope(inputs=2), inner.input("u"))
    with pytest.raises(DiagramError, match="1 unconnected input: scope/u2"):
        inner.build()
    with builder.subsystem("sub", builder.add("c", Constant(value=[1.0, 2.0]))) as sub:
        gained = sub.add("wide", MatrixGain(gain=np.eye(3)), sub.input("u"))
        sub.output("y", gained)
    with pytest.raises(DiagramError, match=r"'c/y' gives shape \(2,\) but 'sub/wide/u' takes shape \(3,\)"):
        builder.build()
    # The control block of an enabled subsystem is not in the user's diagram: the message names the port.
    builder = DiagramBuilder("top")
    c = builder.add("c", Constant(value=[1.0, 2.0]))
    builder.add("enabled", EnabledSubsystem(), c, enable=c)
    with pytest.raises(DiagramError, match=r"^block 'enabled': 'c/y' gives .* but 'enabled/enable' takes"):
        builder.build()
    builder = DiagramBuilder("top")
    with builder.subsystem("sub") as sub:
        sub.output("y", sub.input("u"))
    with pytest.raises(DiagramError, match="1 unconnected input: sub/u"):
        builder.build()


def test_an_algebraic_loop_across_levels_is_reported_with_its_paths() -> None:
    builder = DiagramBuilder("top")
    with builder.subsystem("sub") as sub:
        sub.output("y", sub.add("one", Gain(gain=1.0), sub.input("u")))
    builder.connect(builder["sub"], builder["sub"]["u"])
    with pytest.raises(AlgebraicLoopError, match="sub/one/y -> sub/one/y"):
        trace_diagram(builder.build())


def test_a_cycle_of_connections_without_a_block_is_refused() -> None:
    builder = DiagramBuilder("top")
    with builder.subsystem("sub") as sub:
        sub.output("y", sub.input("u"))
    builder.connect(builder["sub"], builder["sub"]["u"])
    with pytest.raises(DiagramError, match="connections form a cycle without a block"):
        builder.build()


def nested_diagram(depth: int) -> Diagram:
    builder = DiagramBuilder("inner")
    builder.output("y", builder.add("gain", Gain(gain=2.0), builder.input("u")))
    diagram = builder.build()
    for level in range(depth - 1):
        builder = DiagramBuilder(f"level {level}")
        builder.output("y", builder.add("sub", Subsystem(diagram=diagram), builder.input("u")))
        diagram = builder.build()
    return diagram


def test_a_hundred_levels_are_accepted_and_more_are_refused() -> None:
    builder = DiagramBuilder("top")
    builder.add("sub", Subsystem(diagram=nested_diagram(100)), builder.add("c", Constant(value=3.0)))
    assert ab.simulate(builder.build(), stop_time=1.0)["sub"][-1] == 6.0
    builder = DiagramBuilder("top")
    builder.add("sub", Subsystem(diagram=nested_diagram(100)), builder.add("c", Constant(value=3.0)))
    deeper = DiagramBuilder("top")
    with pytest.raises(DiagramError, match="subsystems are nested more than 100 levels deep"):
        deeper.add("more", Subsystem(diagram=builder.build()))
        deeper.build()


def test_thousands_of_blocks_in_fifty_levels_are_flattened() -> None:
    """50 chains of 60 blocks, each one level deeper than the one before: 3000 blocks in 50 levels."""
    builder = DiagramBuilder("inner")
    builder.output("y", builder.input("u"))
    diagram = builder.build()
    for level in range(50):
        builder = DiagramBuilder(f"level {level}")
        signal = builder.add("sub", Subsystem(diagram=diagram), builder.input("u"))
        for k in range(60):
            signal = builder.add(f"gain {k}", Gain(), signal)
        builder.output("y", signal)
        diagram = builder.build()
    form = flatten_hierarchy(diagram)
    assert len(form.diagram.blocks) == 3_000 + 2


# -- tags ------------------------------------------------------------------------------------------


def with_goto(
    visibility: str, diagram_of: Callable[[DiagramBuilder, DiagramBuilder], DiagramBuilder]
) -> Diagram:
    builder = DiagramBuilder("top")
    with builder.subsystem("sub") as sub:
        builder.add("goto", Goto(tag="speed", visibility=visibility), builder.add("sine", SineWave()))
        where = diagram_of(builder, sub)
        where.add("gain", Gain(gain=2.0), where.add("from", From(tag="speed")))
    return builder.build()


@pytest.mark.parametrize("visibility", ["local", "scoped", "global"])
def test_a_tag_is_equivalent_to_a_connection(visibility: str) -> None:
    result = ab.simulate(with_goto(visibility, lambda top, sub: top))
    assert np.array_equal(result["gain/y"], 2.0 * result["sine/y"])
    assert result.resolve("from/y") == result.resolve("goto/u") == "sine/y"


def test_scoped_and_global_tags_are_visible_in_subsystems() -> None:
    for visibility in ("scoped", "global"):
        result = ab.simulate(with_goto(visibility, lambda top, sub: sub))
        assert np.array_equal(result["sub/gain/y"], 2.0 * result["sine/y"])
    with pytest.raises(DiagramError) as caught:
        with_goto("local", lambda top, sub: sub)
    assert "no visible Goto sends 'speed'" in str(caught.value)
    assert "make the visibility of 'goto' scoped or global" in str(caught.value)


def test_a_global_tag_in_a_subsystem_is_visible_at_the_top_level() -> None:
    builder = DiagramBuilder("top")
    with builder.subsystem("sub") as sub:
        sub.add("goto", Goto(tag="speed", visibility="global"), sub.add("sine", SineWave()))
    builder.add("gain", Gain(gain=2.0), builder.add("from", From(tag="speed")))
    result = ab.simulate(builder.build())
    assert np.array_equal(result["gain/y"], 2.0 * result["sub/sine/y"])


def test_tags_that_are_sent_twice_or_invalid_are_refused() -> None:
    builder = DiagramBuilder("top")
    sine = builder.add("sine", SineWave())
    builder.add("one", Goto(tag="A"), sine)
    builder.add("two", Goto(tag="A", visibility="scoped"), sine)
    with pytest.raises(DiagramError, match="the Goto blocks 'one' and 'two' both send 'A'"):
        builder.build()
    with pytest.raises(InputError, match="the tag is 'a b'"):
        Goto(tag="a b")


# -- buses ------------------------------------------------------------------------------------------


def with_bus(element: str = "motor.speed") -> DiagramBuilder:
    builder = DiagramBuilder("buses")
    names = ("speed", "torque", "gain")
    speed, torque, other = (builder.add(n, Constant(value=float(k))) for k, n in enumerate(names, start=2))
    motor = builder.add("motor", BusCreator(names="speed, torque"), speed, torque)
    bus = builder.add("bus", BusCreator(names="motor, other"), motor, other)
    with builder.subsystem("sub", bus) as sub:
        wire = sub.input("bus")
        picked = sub.add("pick", BusSelector(elements=f"{element}, other"), wire)
        sub.output("first", picked[element.rpartition(".")[2]])
        sub.output("same", wire)
    return builder


def test_elements_of_a_bus_through_a_subsystem_can_be_selected() -> None:
    builder = with_bus()
    chosen = builder.add("chosen", BusSelector(elements="motor"), builder["sub"]["same"])
    builder.add("torque_again", BusSelector(elements="torque"), chosen)
    builder.add("gain2", Gain(gain=10.0), builder["torque_again"])
    result = ab.simulate(builder.build(), stop_time=1.0)
    assert result["sub/first"][-1] == 2.0
    assert result["gain2"][-1] == 30.0
    assert result.resolve("sub/bus.motor.torque") == "torque/y"


def test_bus_assignment_replaces_elements() -> None:
    builder = with_bus()
    changed = builder.add(
        "change",
        BusAssignment(elements="motor.torque"),
        builder["sub"]["same"],
        builder.add("c", Constant(value=7.0)),
    )
    picked = builder.add("picked", BusSelector(elements="motor.speed, motor.torque"), changed)
    builder.add("sum", Sum(signs="++"), picked["speed"], picked["torque"])
    assert ab.simulate(builder.build(), stop_time=1.0)["sum"][-1] == 9.0


def test_ports_of_elements_with_equal_names_contain_the_parent_name() -> None:
    block = BusSelector(elements="left.speed, right.speed, torque")
    assert [port.name for port in block.output_ports()] == ["left_speed", "right_speed", "torque"]


def test_a_sink_shows_all_signals_of_a_bus() -> None:
    builder = with_bus()
    builder.add("scope", Scope(inputs=1), builder["sub"]["same"])
    diagram = builder.build()
    (view,) = [view for name, view in diagram_views(diagram) if name == "scope"]
    assert view.signals == ("u.motor.speed", "u.motor.torque", "u.other")
    assert view.labels == ("motor.speed", "motor.torque", "other")
    result = ab.simulate(diagram, stop_time=1.0)
    assert [result[f"scope/{signal}"][-1] for signal in view.signals] == [2.0, 3.0, 4.0]
    assert flatten_hierarchy(diagram).contents[PortRef("bus", "bus")].paths() == (  # pyright: ignore[reportAttributeAccessIssue]
        "motor",
        "motor.speed",
        "motor.torque",
        "other",
    )


def test_a_bus_at_a_scalar_port_and_invalid_elements_are_refused() -> None:
    builder = with_bus()
    builder.add("gain2", Gain(), builder["sub"]["same"])
    with pytest.raises(DiagramError, match="input 'u' receives a bus with the elements motor, other"):
        builder.build()
    with pytest.raises(UnknownNameError, match=r"there is no bus element named 'motor\.sped'"):
        with_bus("motor.sped").build()
    builder = DiagramBuilder("d")
    builder.add("pick", BusSelector(elements="a"), builder.add("c", Constant()))
    with pytest.raises(DiagramError, match="the input 'bus' is the single signal 'c/y'"):
        builder.build()
    for elements in ("", "a, a", "a b"):
        with pytest.raises(InputError, match=r"the list is empty|in .* is not allowed"):
            BusCreator(names=elements)
    with pytest.raises(InputError, match="an element is named 'bus'"):
        BusAssignment(elements="bus")


def test_different_subsystems_may_have_blocks_of_the_same_name() -> None:
    builder = DiagramBuilder("top")
    for name, gain in (("one", 2.0), ("two", 3.0)):
        with builder.subsystem(name) as sub:
            sub.output("y", sub.add("gain", Gain(gain=gain), sub.add("c", Constant(value=1.0))))
    result = ab.simulate(builder.build(), stop_time=1.0)
    assert (result["one/gain"][-1], result["two/gain"][-1]) == (2.0, 3.0)
    with pytest.raises(DiagramError, match="differs only in case"):
        builder.add("ONE", Outport(), builder["one"])
