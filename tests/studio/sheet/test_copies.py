"""Copy and paste preserve all properties; the text on the clipboard is a diagram file."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import pytest
from client_requests import Events, run_scenario

import armblocks as ab
from armblocks.blocks import BLOCKS, Gain
from armblocks.diagram import Diagram, Note, diagram_difference, formula, mask_parameter
from armblocks.errors import DiagramError, FormatError, InputError
from armblocks.formats import diagram_from_bytes, load_diagram, load_robot
from armblocks.studio.protocol.messages.sheet_edits import (
    BendWires,
    MoveBlocks,
    PasteBlocks,
    Place,
    RemoveBlocks,
    Wire,
)
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.placing import placed

EXAMPLES = ("kr180model", "puma560_servos", "puma560_payload_drop", "dc_motor_sampled_pid")


def copy(diagram: Diagram, *names: str, notes: tuple[str, ...] = ()) -> str:
    return clipped(diagram, names, notes, load_robot)


@pytest.mark.parametrize("name", EXAMPLES)
def test_pasting_all_blocks_into_an_empty_diagram_reproduces_the_diagram(name: str) -> None:
    original = placed(load_diagram(name, BLOCKS))
    document = Document(Diagram(name=original.name, blocks={}, mask=original.mask), load_robot)
    document.edit(PasteBlocks(text=copy(original, *original.blocks, notes=tuple(original.notes))))
    pasted = document.diagram
    content = dataclasses.replace(original, settings=pasted.settings, description="")
    assert not diagram_difference(content, pasted)
    assert (pasted.layout, pasted.bends, pasted.notes) == (original.layout, original.bends, original.notes)
    document.undo()
    assert document.diagram.blocks == {}


def test_duplicates_keep_library_links_and_bends() -> None:
    document = Document(placed(load_diagram("puma560_servos", BLOCKS)), load_robot)
    wire = next(wire for wire in document.diagram.connections if wire.target.block == "servo 2")
    source, target = wire.source.block, wire.target.block
    routed = Wire(source=str(wire.source), target=str(wire.target), bends=(200.0, 50.0, 300.0))
    document.edit(BendWires(wires=[routed]))
    names = {source: "a", target: "b"}
    document.edit(PasteBlocks(text=copy(document.diagram, *names), names=names, shift=(30.0, 10.0)))
    after = document.diagram
    assert after.blocks["b"] == after.blocks[target]
    assert after.layout["b"].x == after.layout[target].x + 30
    assert after.layout["b"].y == after.layout[target].y + 10
    (copied,) = (wire for wire in after.bends if wire.source.block == "a")
    assert after.bends[copied] == (230.0, 60.0, 330.0)


def test_a_pasted_formula_becomes_a_value_where_its_names_are_undeclared() -> None:
    masked = Diagram(
        name="there",
        blocks={"gain": Gain(gain=formula("2*k"))},
        mask=(mask_parameter("k", 3.0),),
        mask_values={"k": 5.0},
    )
    text = copy(placed(masked), "gain")
    without_mask = Document(Diagram(name="here", blocks={}), load_robot)
    without_mask.edit(PasteBlocks(text=text))
    assert without_mask.diagram.blocks["gain"] == Gain(gain=10.0)
    with_mask = Document(Diagram(name="here", blocks={}, mask=(mask_parameter("k", 1.5),)), load_robot)
    with_mask.edit(PasteBlocks(text=text))
    assert dict(with_mask.diagram.blocks["gain"].formulas) == {"gain": "2*k"}
    assert with_mask.diagram.blocks["gain"].parameter_value("gain") == 3.0


def test_pasting_used_names_or_invalid_text_is_refused() -> None:
    document = Document(placed(load_diagram("van_der_pol_pid", BLOCKS)), load_robot)
    diagram_with_note = dataclasses.replace(document.diagram, notes={"/1": Note(x=0, y=0, text="a")})
    with pytest.raises(DiagramError, match="a block is already named 'PID'"):
        document.edit(PasteBlocks(text=copy(document.diagram, "PID")))
    document = Document(diagram_with_note, load_robot)
    with pytest.raises(DiagramError, match="a note with this name already exists"):
        document.edit(PasteBlocks(text=copy(diagram_with_note, notes=("/1",))))
    document.edit(PasteBlocks(text=copy(diagram_with_note, notes=("/1",)), names={"/1": "/2"}, shift=5.0))
    assert document.diagram.notes["/2"] == Note(x=5, y=5, text="a")
    with pytest.raises(FormatError, match="the copied blocks"):
        document.edit(PasteBlocks(text="[1, 2]"))


def test_the_clipboard_text_is_a_diagram_file() -> None:
    diagram = placed(load_diagram("kr180model", BLOCKS))
    read = diagram_from_bytes(
        copy(diagram, "jtraj", "rne").encode(), "mail.json", BLOCKS, load_robot, draft=True
    )
    assert set(read.blocks) == {"jtraj", "rne"}


def test_pasting_reads_no_file_outside_the_project(tmp_path: Path) -> None:
    (tmp_path / "project").mkdir()
    ab.save_library({"Servo": ab.load_library("joint_servos")["JointServo"]}, tmp_path / "outside.json")
    text = copy(placed(load_diagram("puma560_servos", BLOCKS)), "servo 1")
    assert '"joint_servos#JointServo"' in text

    async def scenario(hub: Any, ask: Any, events: Events) -> None:
        key = await ask("open_shipped", document_kind="diagram", name="puma560_servos")
        copied_text = await ask("copy", document=key, blocks=["servo 1"])
        assert copied_text == text
        edit = {"kind": "paste", "names": {"servo 1": "another"}}
        await ask("change", document=key, edit={**edit, "text": copied_text})
        outside = copied_text.replace("joint_servos#JointServo", "../outside.json#Servo")
        with pytest.raises(InputError, match="is outside of the project folder"):
            await ask("change", document=key, edit={**edit, "text": outside, "names": {"servo 1": "third"}})

    run_scenario(tmp_path / "project", scenario)


def test_inserting_a_block_into_a_wire_and_removing_it_is_one_step_each() -> None:
    document = Document(placed(load_diagram("van_der_pol_pid", BLOCKS)), load_robot)
    before = document.diagram
    document.edit(PasteBlocks(text=copy(before, "damping"), names={"damping": "free"}))
    unconnected = document.diagram
    place = Place(x=500, y=400)
    wires_of_block = [Wire(source="x2/y", target="free/u"), Wire(source="free/y", target="x1/u")]
    direct_wire = [Wire(source="x2/y", target="x1/u")]
    document.edit(MoveBlocks(places={"free": place}, wires=wires_of_block, instead=direct_wire))
    assert document.undo_title == "insert free"
    inserted = {str(wire) for wire in document.diagram.connections}
    assert {"x2/y -> free/u", "free/y -> x1/u"} <= inserted
    assert "x2/y -> x1/u" not in inserted
    document.edit(MoveBlocks(places={"free": place}, wires=direct_wire, instead=wires_of_block))
    assert document.undo_title == "disconnect free"
    assert document.diagram.connections == before.connections
    document.undo()
    document.undo()
    assert document.diagram == unconnected
    document.edit(RemoveBlocks(blocks=["free"]))
    with pytest.raises(DiagramError, match="the wire free/y -> x1/u does not exist"):
        document.edit(MoveBlocks(places={}, instead=wires_of_block[1:]))
