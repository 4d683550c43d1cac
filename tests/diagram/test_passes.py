"""Passes: each resolves one kind of virtual block and records the original block of each added block."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import pytest

import armblocks as ab
from armblocks.blocks import (
    BusCreator,
    EnabledSubsystem,
    Gain,
    If,
    Scope,
    SineWave,
    Switch,
    TriggeredSubsystem,
)
from armblocks.diagram import (
    ActionSubsystem,
    Block,
    Diagram,
    DiagramBuilder,
    Merge,
    Port,
    PortRef,
    flatten_hierarchy,
)
from armblocks.diagram.passes import order
from armblocks.diagram.passes.netlist import Netlist, Replacement, Replacements


@dataclass(frozen=True, kw_only=True)
class Junction(Block):
    """A virtual block that a pass of this test resolves: both outputs equal the input."""

    title: ClassVar[str] = "Junction"
    virtual: ClassVar[bool] = True

    def input_ports(self) -> tuple[Port, ...]:
        return (Port("u", "the input"),)

    def output_ports(self) -> tuple[Port, ...]:
        return (Port("left", "the input"), Port("right", "the input"))


def resolve_junctions(net: Netlist) -> Netlist:
    replaced: dict[str, Replacements] = {}
    for path, block in net.blocks.items():
        if isinstance(block, Junction):
            source = net.drivers[PortRef(path, "u")]
            replaced[path] = {port.name: Replacement((source,)) for port in block.output_ports()}
    return net.with_replaced(replaced)


def test_a_new_pass_needs_one_function_and_its_place_in_the_order(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(order, "PASSES", (resolve_junctions, *order.PASSES))
    builder = DiagramBuilder("junctions")
    with builder.subsystem("inside", builder.add("sine", SineWave())) as inside:
        junction = inside.add("junction", Junction(), inside.input("u"))
        inside.output("y", inside.add("gain", Gain(gain=2.0), junction["right"]))
    builder.add("scope", Scope(), builder["inside"])
    form = flatten_hierarchy(builder.build())
    assert list(form.diagram.blocks) == ["inside/gain", "scope", "sine"]
    assert form.diagram.drivers[PortRef("inside/gain", "u")] == PortRef("sine", "y")
    assert form.aliases["inside/junction/left"] == PortRef("sine", "y")


def with_added_blocks() -> Diagram:
    """A diagram with control ports, held and merged outputs, and a Switch that is copied for a bus."""
    builder = DiagramBuilder("added")
    sine = builder.add("sine", SineWave())
    decision = builder.add("if", If(), sine)
    passed = ab.block_example("TriggeredSubsystem").blocks["triggered subsystem"]
    assert isinstance(passed, TriggeredSubsystem)
    inner = passed.diagram
    first = builder.add("first", ActionSubsystem(diagram=inner), sine, action=decision["if1"])
    second = builder.add("second", ActionSubsystem(diagram=inner), sine, action=decision["else"])
    merged = builder.add("merged", Merge(), first, second)
    enabled = builder.add("enabled", EnabledSubsystem(diagram=inner), merged, enable=sine)
    bus = builder.add("bus", BusCreator(names="a, b"), enabled, sine)
    builder.add("switch", Switch(), bus, sine, bus)
    return builder.build()


def test_every_flat_block_has_an_original_block_in_the_hierarchy() -> None:
    form = flatten_hierarchy(with_added_blocks())
    assert not any(block.virtual for block in form.diagram.blocks.values())
    drawn = {
        f"{level}/{name}".lstrip("/") for level, diagram in form.levels.items() for name in diagram.blocks
    }
    assert {form.origins.get(path, path) for path in form.diagram.blocks} <= drawn
    assert form.origins == {
        "enabled/enable": "enabled",
        "first/action": "first",
        "second/action": "second",
        "switch.a": "switch",
        "switch.b": "switch",
    }
