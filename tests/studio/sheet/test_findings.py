"""Findings are marked at the blocks of the sheet, and signals have shapes on the sheets of subsystems.

Messages and shapes are those of the flat diagram, which has other blocks than the sheets.
"""

from armblocks.blocks import (
    BusCreator,
    ConnectionPort,
    Constant,
    EnabledSubsystem,
    Gain,
    RevoluteJoint,
    RigidTransform,
    SphericalSolid,
    Subsystem,
    Switch,
    WorldFrame,
)
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.studio.sheet.check import check


def marked(diagram: Diagram) -> dict[str, str]:
    return {finding.block: finding.what for finding in check(diagram)[0]}


def test_a_copy_for_a_bus_marks_its_switch() -> None:
    builder = DiagramBuilder("shapes")
    three = builder.add("three", BusCreator(names="a"), builder.add("x", Constant(value=(1.0, 2.0, 3.0))))
    two = builder.add("two", BusCreator(names="a"), builder.add("y", Constant(value=(1.0, 2.0))))
    builder.add("switch", Switch(), three, builder.add("which", Constant()), two)
    markings = marked(builder.draft())
    assert list(markings) == ["switch"]
    assert "'u1' has shape (3,) and 'u3' has shape (2,)" in markings["switch"]


def test_a_vector_at_a_control_input_marks_its_subsystem() -> None:
    builder = DiagramBuilder("shapes")
    c = builder.add("c", Constant(value=(1.0, 2.0)))
    builder.add("enabled", EnabledSubsystem(), c, enable=c)
    markings = marked(builder.draft())
    assert markings == {"enabled": "'c/y' gives shape (2,) but 'enabled/enable' takes shape ()"}


def test_signals_of_a_subsystem_have_shapes_on_its_sheet_and_outside() -> None:
    builder = DiagramBuilder("shapes")
    with builder.subsystem("inside", builder.add("c", Constant(value=(1.0, 2.0, 3.0)))) as inside:
        inside.output("y", inside.add("gain", Gain(), inside.input("u")))
    findings, wires = check(builder.draft())
    assert findings == []
    for port in ("inside/u/y", "inside/gain/y", "inside/y"):
        assert wires[port].shape == [3], port


def test_faults_of_a_mechanism_are_marked_while_inputs_are_unconnected() -> None:
    builder = DiagramBuilder("rigid")
    world = builder.add("world", WorldFrame())
    inner = DiagramBuilder("inside")
    base = inner.add("base", ConnectionPort())
    tip = inner.add("tip", ConnectionPort())
    hinge = inner.add("hinge", RevoluteJoint(actuation="torque"), B=base, F=tip)
    inner.add("ball", SphericalSolid(), R=hinge["F"])
    arm = builder.add("arm", Subsystem(diagram=inner.draft()))
    builder.draw_line(arm["base"], world)
    rod = builder.add("rod", RigidTransform(), B=world)
    assert marked(builder.draft()) == {"arm/hinge": "the input 'tau' is not connected"}
    builder.draw_line(rod["F"], arm["tip"])
    fault, warning = check(builder.draft())[0]
    assert (fault.block, fault.severity) == ("arm/hinge", "error")
    assert "the base and the follower of the joint are on the same rigid body" in fault.what
    assert (warning.block, warning.port, warning.severity) == ("arm/hinge", "tau", "warning")
