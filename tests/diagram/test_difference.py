"""The difference of two diagrams: every change is reported exactly once, and nothing else is reported."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import pytest

import armblocks as ab
from armblocks.blocks import (
    Constant,
    Gain,
    Inport,
    Integrator,
    Outport,
    Scope,
    SineWave,
    Step,
    Subsystem,
    Sum,
)
from armblocks.diagram import (
    Block,
    Connection,
    Diagram,
    DiagramBuilder,
    DiagramDifference,
    Note,
    Placement,
    PortRef,
    diagram_difference,
    with_parameters,
)


def loop(names: Mapping[str, str] | None = None, *, inner: str = "law", **blocks: Block) -> Diagram:
    """A controlled integrator with a subsystem; ``names`` and ``blocks`` replace names and blocks."""
    called = {name: name for name in ("reference", "error", "controller", "plant", "scope")} | dict(
        names or {}
    )
    builder = DiagramBuilder("loop")
    reference = builder.add(called["reference"], blocks.get("reference", Step(time=0.5)))
    error = builder.add(called["error"], Sum(signs="+-"), reference)
    with builder.subsystem(called["controller"], error) as controller:
        e = controller.input("e")
        controller.output("u", controller.add(inner, blocks.get("law", Gain(gain=3.0)), e))
    plant = builder.add(called["plant"], Integrator(), builder[called["controller"]]["u"])
    builder.connect(plant, error["u2"])
    builder.add(called["scope"], Scope(), plant)
    return builder.build()


def check_kinds(actual: DiagramDifference, *kinds: str) -> None:
    """Check that the difference has entries of exactly these kinds."""
    nonempty = {entry.name for entry in dataclasses.fields(actual) if getattr(actual, entry.name)}
    assert nonempty == set(kinds)


def reversed_difference(actual: DiagramDifference) -> DiagramDifference:
    """Return the reverse difference; changed connections must not contain renamed blocks."""

    def reversed_changes(changes: tuple[object, ...]) -> tuple[object, ...]:
        return tuple(
            dataclasses.replace(change, before=change.after, after=change.before)  # type: ignore[attr-defined]
            for change in changes
        )

    return DiagramDifference(
        added=actual.removed,
        removed=actual.added,
        renamed=reversed_changes(actual.renamed),  # pyright: ignore[reportArgumentType]
        types=reversed_changes(actual.types),  # pyright: ignore[reportArgumentType]
        parameters=reversed_changes(actual.parameters),  # pyright: ignore[reportArgumentType]
        wires_added=actual.wires_removed,
        wires_removed=actual.wires_added,
        logged_added=actual.logged_removed,
        logged_removed=actual.logged_added,
        notes=reversed_changes(actual.notes),  # pyright: ignore[reportArgumentType]
        settings=reversed_changes(actual.settings),  # pyright: ignore[reportArgumentType]
        descriptions=reversed_changes(actual.descriptions),  # pyright: ignore[reportArgumentType]
    )


@pytest.mark.parametrize("name", ["kr180model", "van_der_pol_pid", "bouncing_ball", "robertson_kinetics"])
def test_equal_diagrams_and_other_layouts_have_no_difference(name: str) -> None:
    diagram = ab.load_diagram(name)
    rearranged = dataclasses.replace(
        diagram,
        name="elsewhere",
        layout={block: Placement(x=7.0 * k, y=3.0) for k, block in enumerate(diagram.blocks)},
    )
    assert not diagram_difference(diagram, ab.load_diagram(name))
    assert diagram_difference(diagram, rearranged) == DiagramDifference()


def test_layout_inside_a_subsystem_is_no_difference() -> None:
    before = loop()
    controller = before.blocks["controller"]
    assert isinstance(controller, Subsystem)
    inside = dataclasses.replace(controller.diagram, layout={"law": Placement(x=1.0, y=2.0)})
    after = dataclasses.replace(
        before, blocks={**before.blocks, "controller": dataclasses.replace(controller, diagram=inside)}
    )
    assert not diagram_difference(before, after)
    assert before != after


def test_every_changed_parameter_is_reported_with_both_values() -> None:
    before = loop()
    difference = diagram_difference(
        before, with_parameters(before, {"reference.time": 0.75, "controller/law.gain": 4})
    )
    check_kinds(difference, "parameters")
    assert [(c.path, c.name, c.before, c.after) for c in difference.parameters] == [
        ("controller/law", "gain", 3.0, 4.0),
        ("reference", "time", 0.5, 0.75),
    ]


def test_a_changed_block_type_is_reported_with_the_parameters_of_both() -> None:
    difference = diagram_difference(loop(), loop(reference=Constant(value=2.0)))
    check_kinds(difference, "types", "parameters")
    assert [(c.path, c.before, c.after) for c in difference.types] == [("reference", "Step", "Constant")]
    assert ("value", None, 2.0) in [(c.name, c.before, c.after) for c in difference.parameters]
    assert ("time", 0.5, None) in [(c.name, c.before, c.after) for c in difference.parameters]


@pytest.mark.parametrize("old_name", ["reference", "error", "controller", "plant", "scope"])
def test_a_renamed_block_is_recognised(old_name: str) -> None:
    difference = diagram_difference(loop(), loop({old_name: "another"}))
    check_kinds(difference, "renamed")
    assert [(entry.before, entry.after) for entry in difference.renamed] == [(old_name, "another")]


def test_connected_blocks_that_are_all_renamed_are_recognised() -> None:
    names = {"reference": "a", "error": "b", "controller": "c", "plant": "d", "scope": "e"}
    difference = diagram_difference(loop(), loop(names))
    check_kinds(difference, "renamed")
    assert {entry.before: entry.after for entry in difference.renamed} == names


def test_a_renamed_block_in_a_subsystem_is_reported_with_its_paths() -> None:
    difference = diagram_difference(loop(), loop(inner="gain"))
    check_kinds(difference, "renamed")
    assert [(e.before, e.after) for e in difference.renamed] == [("controller/law", "controller/gain")]


def chains(*names: str) -> Diagram:
    """Equal sources connected to equal gains: only the connections distinguish the blocks."""
    builder = DiagramBuilder("chains")
    for k, name in enumerate(names):
        gain = builder.add(f"{name}_gain", Gain(gain=2.0), builder.add(name, SineWave()))
        builder.add(f"scope{k}", Scope(), gain)
    return builder.build()


def test_equal_blocks_are_distinguished_by_their_connections() -> None:
    difference = diagram_difference(chains("a", "b", "c"), chains("z", "y", "x"))
    check_kinds(difference, "renamed")
    assert {entry.before: entry.after for entry in difference.renamed} == {
        "a": "z", "a_gain": "z_gain", "b": "y", "b_gain": "y_gain", "c": "x", "c_gain": "x_gain",
    }  # fmt: skip


def test_indistinguishable_blocks_are_each_paired_at_most_once() -> None:
    def sources(*names: str) -> Diagram:
        builder = DiagramBuilder("sources")
        for name in names:
            builder.add(name, Constant(value=1.0))
        return builder.build()

    difference = diagram_difference(sources("a", "b", "c"), sources("x", "y"))
    check_kinds(difference, "renamed", "removed")
    assert len({entry.after for entry in difference.renamed}) == 2


def test_a_block_with_other_name_and_other_parameter_is_a_new_block() -> None:
    difference = diagram_difference(loop(), loop({"reference": "target"}, reference=Step(time=9.0)))
    check_kinds(difference, "added", "removed", "wires_added", "wires_removed")
    assert [entry.path for entry in difference.removed] == ["reference"]
    assert [(entry.path, entry.block) for entry in difference.added] == [("target", Step(time=9.0))]
    assert [str(entry.wire) for entry in difference.wires_added] == ["target/y -> error/u1"]
    assert [str(entry.wire) for entry in difference.wires_removed] == ["reference/y -> error/u1"]


def test_a_changed_connection_is_reported_with_its_subsystem() -> None:
    def inner(doubled: bool) -> Diagram:
        builder = DiagramBuilder("inner")
        entry = builder.add("in", Inport())
        gain = builder.add("gain", Gain(gain=2.0), entry)
        builder.add("scope", Scope(), gain)
        builder.add("out", Outport(), gain if doubled else entry)
        return builder.build()

    def outer(doubled: bool) -> Diagram:
        builder = DiagramBuilder("outer")
        builder.add("sub", Subsystem(diagram=inner(doubled)), builder.add("u", Constant()))
        return builder.build()

    difference = diagram_difference(outer(False), outer(True))
    check_kinds(difference, "wires_added", "wires_removed")
    (new,), (old,) = difference.wires_added, difference.wires_removed
    assert new.path == old.path == "sub"
    assert new.wire.source == PortRef("gain", new.wire.source.port)
    assert isinstance(old.wire, Connection)
    assert old.wire.source.block == "in"


def test_settings_and_description_are_reported() -> None:
    before = loop()
    after = dataclasses.replace(
        before,
        description="a loop",
        settings=dataclasses.replace(before.settings, stop_time=3.0, solver="rk4"),
    )
    difference = diagram_difference(before, after)
    check_kinds(difference, "settings", "descriptions")
    assert [(c.name, c.before, c.after) for c in difference.settings] == [
        ("stop_time", 10.0, 3.0),
        ("solver", "auto", "rk4"),
    ]
    assert [(c.before, c.after) for c in difference.descriptions] == [("", "a loop")]


def test_logged_outputs_are_reported_with_the_new_block_names() -> None:
    before = dataclasses.replace(loop(), logged=(PortRef("plant", "y"), PortRef("reference", "y")))
    after = dataclasses.replace(
        loop({"plant": "tank"}), logged=(PortRef("tank", "y"), PortRef("controller", "u"))
    )
    difference = diagram_difference(before, after)
    check_kinds(difference, "renamed", "logged_added", "logged_removed")
    assert [(entry.path, str(entry.port)) for entry in difference.logged_added] == [("", "controller/u")]
    assert [(entry.path, str(entry.port)) for entry in difference.logged_removed] == [("", "reference/y")]


def test_changed_texts_of_notes_are_reported_and_moved_notes_are_not() -> None:
    def diagram_with_notes(**notes: tuple[float, str]) -> Diagram:
        difference = {f"/{name}": Note(x=x, y=0.0, text=text) for name, (x, text) in notes.items()}
        return dataclasses.replace(loop(), notes=difference)

    before = diagram_with_notes(a=(0.0, "stays"), b=(0.0, "old"), c=(0.0, "gone"))
    difference = diagram_difference(
        before, diagram_with_notes(a=(9.0, "stays"), b=(0.0, "new"), d=(0.0, "more"))
    )
    check_kinds(difference, "notes")
    assert [(c.name, c.before, c.after) for c in difference.notes] == [
        ("/b", "old", "new"),
        ("/c", "gone", None),
        ("/d", None, "more"),
    ]


@pytest.mark.parametrize(
    "after",
    [
        loop({"plant": "tank"}),
        loop(law=Gain(gain=8.0)),
        loop({"reference": "target"}, reference=Step(time=9.0)),
        chains("a", "b"),
        dataclasses.replace(loop(), logged=(PortRef("plant", "y"),), notes={"/a": Note(x=0, y=0, text="a")}),
        ab.load_diagram("van_der_pol_pid"),
    ],
    ids=["renamed", "retuned", "replaced", "unlike", "logged", "example"],
)
def test_the_difference_in_the_other_direction_is_the_reverse(after: Diagram) -> None:
    before = loop()
    forward, backward = diagram_difference(before, after), diagram_difference(after, before)
    assert reversed_difference(forward).added == backward.added
    for kind in (
        "removed",
        "types",
        "settings",
        "descriptions",
        "wires_added",
        "wires_removed",
        "logged_added",
        "notes",
    ):
        assert getattr(reversed_difference(forward), kind) == getattr(backward, kind)
    assert set(reversed_difference(forward).parameters) == set(backward.parameters)
    assert forward.count == backward.count
