"""Masks and libraries in the studio: displayed values, permitted edits, formulas."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from client_requests import Events, run_scenario

import armblocks as ab
from armblocks.blocks import BLOCKS
from armblocks.diagram import DiagramBlock
from armblocks.errors import ArmblocksError, DiagramError, FormatError, InputError
from armblocks.formats import load_diagram, load_robot
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.messages.sheet_edits import BreakLink, SetParameters
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.drawing_data import sheet
from armblocks.studio.sheet.placing import placed


@pytest.fixture
def document() -> Document:
    return Document(placed(load_diagram("puma560_servos", BLOCKS)), load_robot)


def test_a_sheet_contains_mask_values_formulas_and_links(document: Document) -> None:
    block = sheet(document.diagram).blocks["servo 2"]
    assert block.link == "joint_servos#JointServo"
    assert block.formulas == {"w": "w"}
    assert [rule.name for rule in block.mask] == ["w", "G", "Jm", "B", "limit", "q0"]
    assert block.mask[0].default == 20.0
    assert block.mask[0].unit == "rad/s"
    assert block.opens
    assert not sheet(document.diagram).linked


def test_values_with_mask_names_remain_formulas(document: Document) -> None:
    document.edit(SetParameters(block="servo 1", values={"w": "2 * w", "G": "-60"}))
    block = document.diagram.blocks["servo 1"]
    assert dict(block.formulas) == {"w": "2 * w"}
    assert block.parameter_value("w") == 40.0
    assert block.parameter_value("G") == -60.0
    document.edit(SetParameters(block="servo 1", values={"w": "15"}))
    assert document.diagram.blocks["servo 1"].formulas == ()
    with pytest.raises(ArmblocksError, match=r"named 'ww'"):
        document.edit(SetParameters(block="servo 1", values={"w": "w*ww"}))
    with pytest.raises(InputError, match=r"block 'servo 1'.*parameter 'w': the value is -20.0"):
        document.edit(SetParameters(block="servo 1", values={"w": "-w"}))
    document.undo()
    assert dict(document.diagram.blocks["servo 1"].formulas) == {"w": "2 * w"}


def test_a_library_is_read_only_until_the_link_is_broken(document: Document) -> None:
    inner = SetParameters(block="rotor", values={"gain": "2"})
    with pytest.raises(
        DiagramError, match=r"belongs to the library block 'joint_servos#JointServo'.*break the"
    ):
        document.edit(inner, ["servo 1"])
    document.edit(BreakLink(block="servo 1"))
    assert document.undo_title == "break the link of servo 1"
    document.edit(inner, ["servo 1"])
    block, other = document.diagram.blocks["servo 1"], document.diagram.blocks["servo 2"]
    assert isinstance(block, DiagramBlock)
    assert isinstance(other, DiagramBlock)
    assert block.diagram.blocks["rotor"].parameter_value("gain") == 2.0
    assert other.diagram.blocks["rotor"].parameter_value("gain") == 5000.0
    with pytest.raises(DiagramError, match="the block is not linked to a library"):
        document.edit(BreakLink(block="motion"))


def test_a_page_opens_a_masked_subsystem_and_evaluates_formulas(tmp_path: Path) -> None:
    async def scenario(hub: Any, ask: Any, events: Events) -> None:
        key = await ask("open_shipped", document_kind="diagram", name="puma560_servos")
        where = {"document": key, "inside": [], "block": "servo 1", "type": "Subsystem"}
        assert await ask("typed", **where, parameter="w", text="w/2 + 1") == 11.0
        await ask("show_sheet", document=key, inside=["servo 1"])
        opened = [event for event in events if event["kind"] == "opened"][-1]
        assert opened["content"]["sheet"]["linked"] == ["servo 1"]
        assert opened["content"]["sheet"]["link"] == "joint_servos#JointServo"
        with pytest.raises(InputError, match="belongs to the library block"):
            await ask("change", document=key, inside=["servo 1"], edit={"kind": "arrange"})
        await ask("save", document=key, path="mine.json")
        assert '"library": "joint_servos#JointServo"' in (tmp_path / "mine.json").read_text()
        again = await ask("open", path="mine.json")
        assert again == [key]

    run_scenario(tmp_path, scenario)


def test_libraries_outside_the_project_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "project").mkdir()
    servo = ab.load_library("joint_servos")["JointServo"]
    ab.save_library({"Servo": servo}, tmp_path / "outside.json")
    folder = ProjectFolder(tmp_path / "project")
    with pytest.raises(FormatError, match=r"the library 'outside.json' is outside of the project folder"):
        folder.read_library((tmp_path / "outside.json").resolve())
    ab.save_library({"Servo": servo}, tmp_path / "project" / "own.json")
    assert folder.read_library(folder.root / "own.json")
