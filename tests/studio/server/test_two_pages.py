"""Two pages on one document: no edit is lost silently, and both pages end with the same diagram."""

from __future__ import annotations

import random
from collections import deque
from typing import Any

import pytest

from armblocks.diagram import Diagram
from armblocks.errors import ArmblocksError, InputError
from armblocks.formats import load_robot
from armblocks.studio.documents.aspects import changed_aspects, clash
from armblocks.studio.protocol.messages import documents as document_messages
from armblocks.studio.protocol.messages.sheet_edits import (
    AddBlocks,
    Connect,
    DiagramEdit,
    GroupBlocks,
    MoveBlocks,
    NewBlock,
    Place,
    RemoveBlocks,
    Rename,
    SetParameters,
    Wire,
)
from armblocks.studio.protocol.messages.sheets import SheetChange
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.drawing_data import sheet, sheet_change
from armblocks.studio.sheet.lines import SheetLines, changed_lines

ORIGIN = Place(x=0, y=0)


def drawing() -> Document:
    document = Document(Diagram(name="d", blocks={}), load_robot)
    blocks = [NewBlock(name=f"b{k}", type="Gain", place=ORIGIN) for k in range(4)]
    document.edit(AddBlocks(blocks=blocks))
    return document


def change(author: str, base: int, edit: DiagramEdit, *inside: str) -> document_messages.Change:
    return document_messages.Change(document="", author=author, base=base, edit=edit, inside=list(inside))


def gain(block: str, value: float) -> SetParameters:
    return SetParameters(block=block, values={"gain": value})


CONFLICTING: list[tuple[DiagramEdit, DiagramEdit]] = [
    (gain("b0", 2.0), gain("b0", 3.0)),
    (gain("b0", 2.0), RemoveBlocks(blocks=["b0"])),
    (gain("b0", 2.0), Rename(block="b0", name="other")),
    (MoveBlocks(places={"b0": Place(x=9, y=0)}), MoveBlocks(places={"b0": Place(x=0, y=9)})),
    (
        Connect(wire=Wire(source="b0/y", target="b2/u")),
        Connect(wire=Wire(source="b1/y", target="b2/u"), replace=True),
    ),
    (Connect(wire=Wire(source="b0/y", target="b2/u")), RemoveBlocks(blocks=["b0"])),
    (gain("b0", 2.0), GroupBlocks(blocks=["b0", "b1"], name="S")),
]
COMPATIBLE: list[tuple[DiagramEdit, DiagramEdit]] = [
    (gain("b0", 2.0), gain("b1", 3.0)),
    (gain("b0", 2.0), MoveBlocks(places={"b0": Place(x=9, y=0)})),
    (RemoveBlocks(blocks=["b0"]), gain("b1", 2.0)),
    (Connect(wire=Wire(source="b0/y", target="b2/u")), Connect(wire=Wire(source="b0/y", target="b3/u"))),
    (gain("b0", 2.0), gain("b0", 2.0)),
    (gain("b0", 2.0), AddBlocks(blocks=[NewBlock(name="new", type="Gain", place=ORIGIN)])),
]


@pytest.mark.parametrize(("other_edit", "own_edit"), CONFLICTING)
def test_an_edit_that_conflicts_with_another_page_is_refused(
    other_edit: DiagramEdit, own_edit: DiagramEdit
) -> None:
    document = drawing()
    base = document.version
    document.perform(change("other", base, other_edit))
    before = document.diagram
    with pytest.raises(
        InputError,
        match=r"your change conflicts with a change from another page.*"
        r"an edit of the version that this page showed"
        r".*look at the present version, and repeat the edit if you still want it",
    ):
        document.perform(change("me", base, own_edit))
    assert document.diagram is before
    document.perform(change("me", document.version, own_edit))  # accepted after seeing the change


@pytest.mark.parametrize(("other_edit", "own_edit"), COMPATIBLE)
def test_edits_of_different_aspects_are_both_applied(other_edit: DiagramEdit, own_edit: DiagramEdit) -> None:
    document, other_order = drawing(), drawing()
    base = document.version
    document.perform(change("other", base, other_edit))
    document.perform(change("me", base, own_edit))
    other_order.perform(change("me", base, own_edit))
    other_order.perform(change("other", base, other_edit))
    assert document.diagram == other_order.diagram


def test_conflicts_inside_subsystems_are_detected() -> None:
    document = drawing()
    document.edit(GroupBlocks(blocks=["b0", "b1"], name="S"))
    base = document.version
    document.perform(change("other", base, gain("b0", 2.0), "S"))
    document.perform(change("me", base, gain("b1", 2.0), "S"))
    with pytest.raises(InputError, match="your change conflicts with a change from another page"):
        document.perform(change("me", base, gain("b0", 3.0), "S"))
    with pytest.raises(InputError, match="your change conflicts with a change from another page"):
        document.perform(change("me", base, RemoveBlocks(blocks=["S"])))


def test_a_page_does_not_conflict_with_its_own_pending_edits() -> None:
    document = drawing()
    base = document.version
    for value in (2.0, 3.0, 4.0):
        document.perform(change("me", base, gain("b0", value)))
    assert document.diagram.blocks["b0"].parameter_value("gain") == 4.0


def test_undo_of_an_unseen_change_is_refused() -> None:
    document = drawing()
    base = document.version
    document.perform(change("other", base, gain("b0", 2.0)))
    for undo in (document_messages.Undo, document_messages.Redo):
        with pytest.raises(InputError, match="the drawing was changed in another page meanwhile"):
            document.perform(undo(document="", author="me", base=base))
    document.perform(document_messages.Undo(document="", author="me", base=document.version))
    assert document.diagram.blocks["b0"].parameter_value("gain") == 1.0


@pytest.mark.parametrize("base", [-1, 10_000])
def test_an_edit_based_on_an_unknown_version_is_refused(base: int) -> None:
    with pytest.raises(InputError, match="the page shows a version of the drawing that is too old"):
        drawing().perform(change("me", base, gain("b0", 2.0)))


class Page:
    """A page that receives the changes of the sheet with a delay of some messages."""

    def __init__(self, name: str, document: Document) -> None:
        self.name = name
        self.version = document.version
        self.blocks: dict[str, Any] = dict(sheet(document.diagram).blocks)
        self.wires = set(sheet(document.diagram).wires)
        self.lines: dict[str, Any] = dict(SheetLines().route(document.diagram))
        self.pending: deque[tuple[int, SheetChange]] = deque()

    def receive(self) -> None:
        """Process the next message."""
        self.version, change = self.pending.popleft()
        for name, block in change.blocks.items():
            if block is None:
                self.blocks.pop(name, None)
            else:
                self.blocks[name] = block
        self.wires = (self.wires - set(change.wires_removed)) | set(change.wires_added)
        self.lines = {
            key: lines for key, lines in {**self.lines, **change.lines}.items() if lines is not None
        }


def random_edit(random_: random.Random, page: Page) -> DiagramEdit:
    """A random user edit of the displayed sheet."""
    names = sorted(page.blocks) or ["b0"]
    block, other = random_.choice(names), random_.choice(names)
    return random_.choice(
        [
            gain(block, random_.random()),
            gain(block, random_.random()),
            MoveBlocks(places={block: Place(x=random_.random(), y=0)}),
            RemoveBlocks(blocks=[block]),
            AddBlocks(blocks=[NewBlock(name=f"b{random_.randrange(6)}", type="Gain", place=ORIGIN)]),
            Connect(wire=Wire(source=f"{block}/y", target=f"{other}/u"), replace=True),
        ]
    )


@pytest.mark.parametrize("seed", range(50))
def test_random_edits_of_two_pages_overwrite_no_unseen_change_and_converge(seed: int) -> None:
    """200 turns for each seed, 10 000 interleavings. An applied edit that has disappeared was undone by a
    page that had seen it."""
    random_ = random.Random(seed)
    document, lines = drawing(), SheetLines()
    pages = [Page("one", document), Page("two", document)]
    applied: list[tuple[int, str, set[tuple[str, ...]]]] = []
    for _ in range(200):
        page = random_.choice(pages)
        if page.pending and random_.random() < 0.6:
            page.receive()
            continue
        before = document.diagram
        try:
            document.perform(change(page.name, page.version, random_edit(random_, page)))
        except ArmblocksError:
            assert document.diagram is before
            continue
        aspects = changed_aspects(before, document.diagram)
        for version, author, other_aspects in applied:
            if author != page.name and version > page.version:
                assert not clash(aspects, other_aspects), "an edit that the page had not seen was overwritten"
        applied.append((document.version, page.name, aspects))
        changed = changed_lines(lines.route(before), lines.route(document.diagram))
        for listener in pages:
            listener.pending.append((document.version, sheet_change(before, document.diagram, changed)))
    for page in pages:
        while page.pending:
            page.receive()
    assert pages[0].blocks == pages[1].blocks == sheet(document.diagram).blocks
    assert pages[0].wires == pages[1].wires == set(sheet(document.diagram).wires)
    assert pages[0].lines == pages[1].lines == SheetLines().route(document.diagram)
