"""The studio shows frame lines, and keeps them in every edit of a sheet."""

from __future__ import annotations

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS, ConnectionPort
from armblocks.diagram import Diagram, DiagramBlock, FrameLine, PortRef
from armblocks.errors import DiagramError
from armblocks.formats import diagram_from_bytes, load_robot
from armblocks.studio.protocol.messages.sheet_edits import (
    Connect,
    GroupBlocks,
    PasteBlocks,
    RemoveBlocks,
    Rename,
    SetParameters,
    Wire,
)
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.drawing_data import sheet, sheet_change
from armblocks.studio.sheet.lines import SheetLines
from armblocks.studio.sheet.placing import placed


def pendulum() -> Document:
    """The worked example of a hinge: world, gravity, hinge, offset, brick and a scope."""
    return Document(placed(ab.block_example("RevoluteJoint")), load_robot)


def lines(document: Document) -> set[str]:
    return {str(line) for line in document.diagram.frame_lines}


def final_angle(diagram: Diagram, name: str) -> float:
    return float(ab.simulate(diagram, stop_time=0.5)[f"{name}/q"][-1])


def test_a_sheet_shows_ports_and_lines_of_frames() -> None:
    diagram = pendulum().diagram
    shown = sheet(diagram, SheetLines().route(diagram))
    frame_wires = [wire for wire in shown.wires if wire.source == "world/W"]
    assert {wire.target for wire in frame_wires} == {"gravity/C", "revolute joint/B"}
    assert all(shown.lines["world/W"].paths[wire.target] for wire in frame_wires)
    joint = shown.blocks["revolute joint"]
    for ports in (joint.inputs, joint.outputs):
        assert {"B", "F"} <= {port.name for port in ports if port.frame}


def test_edits_keep_the_frame_lines_of_other_blocks() -> None:
    document = pendulum()
    before = document.diagram
    document.edit(Rename(block="offset", name="rod"))
    assert {"brick/R -- rod/F", "revolute joint/F -- rod/B"} <= lines(document)
    assert final_angle(document.diagram, "revolute joint") == final_angle(before, "revolute joint")
    change = sheet_change(before, document.diagram)
    assert {wire.target for wire in change.wires_added} == {"rod/B", "brick/R"}
    document.edit(SetParameters(block="revolute joint", values={"actuation": "torque"}))
    assert len(lines(document)) == 4
    document.edit(RemoveBlocks(blocks=["brick"]))
    left = {"gravity/C -- world/W", "revolute joint/B -- world/W", "revolute joint/F -- rod/B"}
    assert lines(document) == left
    document.undo()
    assert len(lines(document)) == 4
    # the lines of gravity and hinge end at the world; without it, both are still at one frame
    document.edit(RemoveBlocks(blocks=["world"]))
    assert "gravity/C -- revolute joint/B" in lines(document)
    document.undo()
    neighbours = Wire(source="world/W", target="brick/R", bends=())
    document.edit(RemoveBlocks(blocks=["revolute joint", "rod"], reconnections=[neighbours]))
    assert lines(document) == {"brick/R -- world/W", "gravity/C -- world/W"}


def test_lines_are_drawn_and_removed_like_wires() -> None:
    document = pendulum()
    document.edit(RemoveBlocks(wires=[Wire(source="world/W", target="gravity/C", bends=())]))
    assert "gravity/C -- world/W" not in lines(document)
    document.edit(Connect(wire=Wire(source="gravity/C", target="revolute joint/B", bends=())))
    assert "gravity/C -- revolute joint/B" in lines(document)
    # world and gravity are now one frame with the joint; the shown wires lead from the world
    shown = {(wire.source, wire.target) for wire in sheet(document.diagram).wires}
    assert {("world/W", "gravity/C"), ("world/W", "revolute joint/B")} <= shown
    document.edit(RemoveBlocks(wires=[Wire(source="world/W", target="revolute joint/B", bends=())]))
    assert lines(document) == {"gravity/C -- world/W", "brick/R -- offset/F", "offset/B -- revolute joint/F"}


def test_frame_ports_and_signals_are_not_connected() -> None:
    document = pendulum()
    for source, target in (("revolute joint/q", "brick/R"), ("world/W", "scope/u1")):
        with pytest.raises(DiagramError, match="cannot be connected with an input or output of signals"):
            document.edit(Connect(wire=Wire(source=source, target=target, bends=())))


def test_copies_have_the_lines_between_the_copied_blocks() -> None:
    document = pendulum()
    text = clipped(document.diagram, ["offset", "brick"], [], load_robot)
    document.edit(PasteBlocks(text=text, names={"offset": "second", "brick": "ball"}, shift=40.0))
    assert "ball/R -- second/F" in lines(document)
    assert len(lines(document)) == 5
    alone = diagram_from_bytes(text.encode(), "copy", BLOCKS, load_robot, draft=True)
    assert alone.frame_lines == (FrameLine(PortRef("offset", "F"), PortRef("brick", "R")),)
    text = clipped(document.diagram, ["gravity", "revolute joint"], [], load_robot)
    alone = diagram_from_bytes(text.encode(), "copy", BLOCKS, load_robot, draft=True)
    assert alone.frame_lines == (FrameLine(PortRef("gravity", "C"), PortRef("revolute joint", "B")),)


def test_a_group_of_bodies_gets_connection_ports_and_moves_as_before() -> None:
    document = pendulum()
    expected = final_angle(document.diagram, "revolute joint")
    document.edit(GroupBlocks(blocks=["offset", "brick"], name="swing"))
    group = document.diagram.blocks["swing"]
    assert isinstance(group, DiagramBlock)
    ports = [name for name, block in group.diagram.blocks.items() if isinstance(block, ConnectionPort)]
    assert ports == ["offset B"]
    assert "revolute joint/F -- swing/offset B" in lines(document)
    np.testing.assert_array_equal(final_angle(document.diagram, "revolute joint"), expected)
