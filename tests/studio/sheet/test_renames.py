"""Renamed blocks are found from two versions of a diagram, and the views of their run follow."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from client_requests import Events, run_scenario

from armblocks.diagram import Diagram
from armblocks.formats import load_robot
from armblocks.studio.protocol.messages.sheet_edits import (
    AddBlocks,
    Connect,
    DiagramEdit,
    GroupBlocks,
    MoveBlocks,
    NewBlock,
    PasteBlocks,
    Place,
    RemoveBlocks,
    Rename,
    SetParameters,
    Wire,
)
from armblocks.studio.server.hub import Hub
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.nesting import inside
from armblocks.studio.sheet.renames import PathNames, path_after, renamed_paths


def drawing() -> Document:
    document = Document(Diagram(name="d", blocks={}), load_robot)
    blocks = [NewBlock(name=name, type="Gain", place=Place(x=100 * k, y=0)) for k, name in enumerate("acz")]
    document.edit(AddBlocks(blocks=blocks))
    document.edit(Connect(wire=Wire(source="a/y", target="c/u")))
    return document


def test_a_rename_its_undo_and_its_redo_are_found_also_inside_subsystems() -> None:
    document = drawing()
    for path, edits in (
        ((), (Rename(block="a", name="y"),)),  # another position in the alphabet
        (("S",), (GroupBlocks(blocks=["y", "c"], name="S"), Rename(block="c", name="b"))),
        ((), (Rename(block="S", name="T"),)),
    ):
        *before_edits, edit = edits
        for one in before_edits:
            document.edit(one)
        before = document.diagram
        document.edit(edit, path)
        after = document.diagram
        assert isinstance(edit, Rename)
        old, new = "/".join((*path, edit.block)), "/".join((*path, edit.name))
        assert renamed_paths(before, after) == {old: new}
        assert renamed_paths(after, before) == {new: old}


def test_other_edits_rename_nothing() -> None:
    edits: list[DiagramEdit] = [
        MoveBlocks(places={"a": Place(x=9, y=9)}),
        SetParameters(block="a", values={"gain": 3.0}),
        RemoveBlocks(blocks=["c"]),
        AddBlocks(blocks=[NewBlock(name="n", type="Gain", place=Place(x=0, y=90))]),
    ]
    document = drawing()
    for edit in edits:
        before = document.diagram
        document.edit(edit)
        assert renamed_paths(before, document.diagram) == {}
        assert renamed_paths(document.diagram, before) == {}


def test_blocks_that_are_grouped_and_ungrouped_by_undo_are_followed() -> None:
    document = drawing()
    before = document.diagram
    document.edit(GroupBlocks(blocks=["a", "c"], name="S"))
    after = document.diagram
    assert renamed_paths(before, after) == {"a": "S/a", "c": "S/c"}
    assert renamed_paths(after, before) == {"S/a": "a", "S/c": "c"}
    document.edit(GroupBlocks(blocks=["a"], name="T"), ("S",))
    assert renamed_paths(after, document.diagram) == {"S/a": "S/T/a"}


def test_blocks_that_are_cut_and_pasted_on_other_sheets_are_followed_also_by_undo() -> None:
    """The view of a run that shows ``c`` follows it to a subsystem, to another one, and back."""
    document = drawing()
    document.edit(GroupBlocks(blocks=["a"], name="S"))
    document.edit(GroupBlocks(blocks=["z"], name="T"))
    shown, places = "c", ["c"]

    def follow(step: Callable[[], object]) -> None:
        nonlocal shown
        before = document.diagram
        step()
        shown = path_after(shown, document.renamed(before))

    def move(name: str, source: tuple[str, ...], target: tuple[str, ...], new_name: str) -> None:
        text = clipped(inside(document.diagram, source), [name], [], load_robot)
        follow(lambda: document.edit(RemoveBlocks(blocks=[name]), source))
        follow(lambda: document.edit(PasteBlocks(text=text, names={name: new_name}), target))
        places.append(shown)

    move("c", (), ("S",), "c 2")
    move("c 2", ("S",), ("T",), "c")
    assert places == ["c", "S/c 2", "T/c"]
    names = PathNames()
    names.rename({"c": "S/c 2"})
    names.rename({"S/c 2": "c"})
    names.rename({"S/c 2": "T/c", "c": "T/c"})
    assert names.original("T/c.gain") == "c.gain"
    for expected in ("c", "S/c 2", "c", "c"):
        follow(document.undo)
        assert shown == expected
    for _ in range(4):
        follow(document.redo)
    assert shown == "T/c"
    # A copy is another block, and so is an equal block that is added later.
    text = clipped(inside(document.diagram, ("T",)), ["c"], [], load_robot)
    follow(lambda: document.edit(PasteBlocks(text=text, names={"c": "copy"})))
    assert shown == "T/c"


def test_paths_follow_renames_forward_and_back() -> None:
    names = PathNames()
    assert names.present("a.gain") == "a.gain"
    names.rename({"a": "b"})
    names.rename({"c": "a"})
    names.rename({"b": "S"})
    assert names.present("a/u") == "S/u"
    assert names.present("c.gain") == "a.gain"
    assert names.original("a.gain") == "c.gain"
    assert names.original("S/inner.gain") == "a/inner.gain"
    assert path_after("ab.gain", {"a": "x"}) == "ab.gain"


def test_a_run_is_notified_of_renames_and_is_tuned_by_the_new_names(tmp_path: Path) -> None:
    async def scenario(hub: Hub, ask: Callable[..., Awaitable[Any]], events: Events) -> None:
        async def event_of(kind: str, count: int = 1) -> dict[str, Any]:
            while len(found := [event for event in events if event["kind"] == kind]) < count:
                await asyncio.sleep(0.01)
            return found[count - 1]

        key = await ask("open_shipped", document_kind="diagram", name="van_der_pol_pid")
        run = await ask("run", document=key, speed=0.1)
        await event_of("run_started")
        await event_of("run_progress")
        await ask("change", document=key, edit={"kind": "rename", "block": "PID", "name": "C"})
        assert (await event_of("run_renamed"))["renamed"] == {"PID": "C"}
        changed = [event for event in events if event["kind"] == "changed"][-1]
        assert changed["change"]["renamed"] == {"PID": "C"}
        await ask("tune", run=run, values={"C.P": 7.0})
        assert (await event_of("run_tuned"))["parameter"] == "C.P"
        await ask("undo", document=key)
        assert (await event_of("run_renamed", 2))["renamed"] == {"C": "PID"}
        await ask("tune", run=run, values={"PID.P": 5.0})
        assert (await event_of("run_tuned", 2))["parameter"] == "PID.P"
        await ask("control", run=run, action="stop")

    run_scenario(tmp_path, scenario, runs=True)
