"""Propagated names: the name of a signal behind From blocks, In blocks and subsystems."""

from __future__ import annotations

import dataclasses
import random

import armblocks as ab
from armblocks.blocks import Constant, EnabledSubsystem, From, Gain, Goto, Scope, SineWave
from armblocks.diagram import Connection, Diagram, DiagramBuilder, PortRef, Subsystem
from armblocks.diagram.propagated_names import propagated_names
from armblocks.drawing.diagram_drawing import diagram_svg

RECEIVER, PART, INSIDE = PortRef("receiver", "y"), PortRef("part", "y"), PortRef("u", "y")


def model() -> Diagram:
    builder = DiagramBuilder("model")
    source = builder.add("source", SineWave())
    builder.add("goto", Goto(tag="T"), source)
    receiver = builder.add("receiver", From(tag="T"))
    with builder.subsystem("part", u=receiver) as part:
        gain = part.add("gain", Gain(gain=2.0), part.input("u"))
        part.output("y", gain)
        part.name_signal(gain, "inside")
    builder.add("scope", Scope(), builder["part"])
    builder.name_signal(source, "speed")
    return builder.build()


def test_the_name_is_found_through_goto_and_both_ports_of_a_subsystem() -> None:
    diagram = model()
    assert propagated_names(diagram) == {RECEIVER: "speed", PART: "inside"}
    assert propagated_names(diagram, "part") == {INSIDE: "speed"}
    assert propagated_names(diagram, "no/such") == {}
    assert "&lt;speed&gt;" in diagram_svg(diagram)


def test_an_own_name_a_comment_and_a_missing_wire_end_the_search() -> None:
    diagram = model()
    named = dataclasses.replace(diagram, signal_names={**diagram.signal_names, RECEIVER: "command"})
    assert RECEIVER not in propagated_names(named)
    assert propagated_names(named, "part") == {INSIDE: "command"}
    commented = dataclasses.replace(diagram, commented={"goto": "out"})
    assert propagated_names(commented) == {PART: "inside"}
    unwired = dataclasses.replace(diagram, connections=())
    assert propagated_names(unwired) == {PART: "inside"}


def test_the_outputs_of_conditional_subsystems_inherit_no_name_because_they_are_held() -> None:
    diagram = model()
    part = diagram.blocks["part"]
    assert isinstance(part, Subsystem)
    held = EnabledSubsystem(diagram=part.diagram)
    conditional = dataclasses.replace(diagram, blocks={**diagram.blocks, "part": held})
    assert propagated_names(conditional) == {RECEIVER: "speed"}
    assert propagated_names(conditional, "part") == {INSIDE: "speed"}


def test_a_cycle_of_tags_has_no_name() -> None:
    wire = Connection(PortRef("f", "y"), PortRef("g", "u"))
    diagram = Diagram(name="cycle", blocks={"f": From(), "g": Goto()}, connections=(wire,))
    assert propagated_names(diagram) == {}


def test_propagated_names_belong_to_the_signals_that_the_run_gives_to_them() -> None:
    rng = random.Random(4)
    for _ in range(5):
        builder = DiagramBuilder("tags")
        for k in range(3):
            source = builder.add(f"s{k}", Constant(value=float(k)))
            builder.name_signal(source, f"name{k}")
            visibility = rng.choice(["local", "scoped", "global"])
            builder.add(f"g{k}", Goto(tag=f"T{k}", visibility=visibility), source)
        tags = [rng.randrange(3) for _ in range(4)]
        for k, tag in enumerate(tags):
            builder.add(f"p{k}", Scope(), builder.add(f"f{k}", From(tag=f"T{tag}")))
        diagram = builder.build()
        result = ab.simulate(diagram, stop_time=0.1)
        names = propagated_names(diagram)
        for k, tag in enumerate(tags):
            assert result[names[PortRef(f"f{k}", "y")]][-1] == tag
