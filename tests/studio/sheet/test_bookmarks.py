"""Bookmarks of views: stored with their sheet, kept by files, renamed and removed with subsystems."""

from __future__ import annotations

import copy
import json
import pickle
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import armblocks as ab
from armblocks.blocks import BLOCKS, Constant, Gain, Scope
from armblocks.diagram import Bookmark, Diagram, content_key, diagram_difference
from armblocks.errors import ArmblocksError, DiagramError, FormatError, UnknownNameError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.formats.diagram_python import diagram_to_python
from armblocks.studio.documents.aspects import changed_aspects, clash
from armblocks.studio.protocol.messages import sheet_edits as do
from armblocks.studio.sheet.bookmarks import bookmarks_of
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.outline import find
from armblocks.studio.sheet.placing import placed

PART = do.SheetPart(x=-20.0, y=40.5, width=300.0, height=200.0)
OTHER_PART = do.SheetPart(x=0.0, y=0.0, width=80.0, height=60.0)


@pytest.fixture
def document() -> Document:
    """A model with a subsystem in a subsystem."""
    builder = ab.DiagramBuilder("servo")
    source = builder.add("source", Constant(value=1.0))
    with builder.subsystem("drive", source) as drive:
        u = drive.input("u")
        with drive.subsystem("motor", u) as motor:
            motor.output("speed", motor.add("gain", Gain(gain=2.0), motor.input("u")))
        drive.output("speed", drive["motor"])
    builder.add("scope", Scope(), builder["drive"])
    return Document(placed(builder.build()), load_robot)


def add(document: Document, name: str, *inside: str, **options: Any) -> None:
    document.edit(do.AddBookmark(name=name, **{"part": PART, **options}), inside)


def names(document: Document) -> list[str]:
    """The bookmarks with their paths."""
    return ["/".join((*found.inside, found.name)) for found in bookmarks_of(document.diagram)]


def read(content: bytes | dict[str, Any], *, draft: bool = False) -> Diagram:
    data = content if isinstance(content, bytes) else json.dumps(content, indent=1).encode()
    return diagram_from_bytes(data, "servo.json", BLOCKS, load_robot, draft=draft)


def test_a_bookmark_is_added_updated_renamed_and_removed_in_steps_that_can_be_undone(
    document: Document,
) -> None:
    add(document, " left ")
    assert document.undo_title == "bookmark left"
    add(document, "left", part=OTHER_PART, replace=True)
    assert document.undo_title == "update the bookmark left"
    assert dict(document.diagram.bookmarks) == {"left": Bookmark(**OTHER_PART.model_dump())}
    document.edit(do.RenameBookmark(name="left", to="Left"))
    document.edit(do.RemoveBookmark(name="Left"))
    assert names(document) == []
    for _ in range(3):
        document.undo()
    assert dict(document.diagram.bookmarks) == {"left": Bookmark(**PART.model_dump())}
    assert bookmarks_of(document.diagram)[0].part == PART


def test_bookmarks_follow_renamed_and_grouped_subsystems(document: Document) -> None:
    add(document, "all")
    add(document, "winding", "drive", "motor")
    document.edit(do.Rename(block="drive", name="axis 1"))
    document.edit(do.Rename(block="motor", name="M"), ["axis 1"])
    assert names(document) == ["all", "axis 1/M/winding"]
    document.edit(do.GroupBlocks(blocks=["axis 1"], name="plant"))
    assert names(document) == ["all", "plant/axis 1/M/winding"]


def test_bookmarks_of_a_removed_subsystem_come_back_with_undo_and_with_paste(document: Document) -> None:
    add(document, "winding", "drive", "motor")
    text = clipped(document.diagram, ["drive"], [], load_robot)
    document.edit(do.RemoveBlocks(blocks=["drive"]))
    assert names(document) == []
    document.undo()
    assert names(document) == ["drive/motor/winding"]
    document.edit(do.PasteBlocks(text=text, names={"drive": "drive 2"}))
    assert names(document) == ["drive/motor/winding", "drive 2/motor/winding"]


@pytest.mark.parametrize(
    ("edit", "error", "what"),
    [
        (do.AddBookmark(name="LEFT", part=PART), DiagramError, "a bookmark is already named 'left'"),
        (do.AddBookmark(name=" ", part=PART), DiagramError, "a bookmark has an empty name"),
        (do.AddBookmark(name="a\nb", part=PART), DiagramError, "the bookmark name .* contains"),
        (do.AddBookmark(name="right", part=PART, replace=True), UnknownNameError, "'right'"),
        (do.RenameBookmark(name="left", to="Middle"), DiagramError, "already named 'middle'"),
        (do.RenameBookmark(name="right", to="x"), UnknownNameError, "'right'"),
        (do.RemoveBookmark(name="lefd"), UnknownNameError, "left"),
    ],
)
def test_refused_edits_change_nothing(
    document: Document, edit: do.DiagramEdit, error: type[ArmblocksError], what: str
) -> None:
    add(document, "left")
    add(document, "middle")
    before = document.diagram
    with pytest.raises(error, match=what):
        document.edit(edit)
    assert document.diagram is before


def test_the_number_of_bookmarks_is_bounded(document: Document) -> None:
    for k in range(200):
        add(document, str(k))
    with pytest.raises(DiagramError, match="the diagram has 200 bookmarks"):
        add(document, "200")


def test_bookmarks_of_library_blocks_are_listed_but_not_edited() -> None:
    builder = ab.DiagramBuilder("linked")
    builder.add("servo", ab.load_library("joint_servos")["JointServo"])
    document = Document(placed(builder.draft()), load_robot)
    with pytest.raises(DiagramError, match="belongs to the library block"):
        add(document, "left", "servo")
    document.edit(do.BreakLink(block="servo"))
    add(document, "left", "servo")
    assert [found.linked for found in bookmarks_of(document.diagram)] == [False]


def test_edits_of_different_bookmarks_do_not_conflict(document: Document) -> None:
    before = document.diagram
    add(document, "left", "drive")
    left = changed_aspects(before, document.diagram)
    add(document, "right", "drive")
    right = changed_aspects(before, document.diagram) - left
    assert left == {("drive", "/", "bookmark left")}
    assert not clash(left, right)
    assert clash(left, left)


def test_the_search_finds_bookmarks_by_name(document: Document) -> None:
    add(document, "motor winding", "drive", "motor")
    results = find(document.diagram, "winding motor")
    assert [(one.inside, one.name, one.part) for one in results] == [
        (["drive", "motor"], "motor winding", PART)
    ]
    assert [one.name for one in find(document.diagram, "motor")] == ["motor", "motor winding"]
    assert find(document.diagram, "") == []


def test_bookmarks_do_not_change_the_model(document: Document) -> None:
    before = document.diagram
    add(document, "all")
    add(document, "winding", "drive", "motor")
    assert document.diagram != before
    assert content_key(document.diagram) == content_key(before)
    assert not diagram_difference(before, document.diagram)
    assert diagram_to_python(document.diagram) == diagram_to_python(before)


coordinates = st.floats(-1e7, 1e7) | st.integers(-(10**7), 10**7)
sizes = st.floats(1.0, 1e6) | st.integers(1, 10**6)
parts = st.builds(do.SheetPart, x=coordinates, y=coordinates, width=sizes, height=sizes)
texts = st.text(st.characters(exclude_categories=["C"]), min_size=1, max_size=200).filter(str.strip)
actions = st.lists(
    st.tuples(st.sampled_from(("add", "rename", "remove", "block", "group")), texts, parts), max_size=12
)


@given(actions, st.randoms(use_true_random=False))
def test_files_copies_and_undo_keep_bookmarks_after_any_edits(
    steps: list[tuple[str, str, do.SheetPart]], chance: Any
) -> None:
    inner = ab.DiagramBuilder("inner")
    inner.output("y", inner.add("gain", Gain(gain=2.0), inner.input("u")))
    builder = ab.DiagramBuilder("outer")
    builder.add("drive", ab.blocks.Subsystem(diagram=inner.build()), builder.add("source", Constant()))
    document = Document(placed(builder.draft()), load_robot)
    forms = [document.diagram]
    for kind, text, part in steps:
        bookmarks = [one for one in bookmarks_of(document.diagram) if kind in ("rename", "remove")]
        blocks = [name for name in document.diagram.blocks if name != "source"]
        edit: do.DiagramEdit
        inside = [blocks[0]] if chance.random() < 0.6 else []
        if bookmarks:
            one = chance.choice(bookmarks)
            inside = one.inside
            edit = (
                do.RenameBookmark(name=one.name, to=text)
                if kind == "rename"
                else do.RemoveBookmark(name=one.name)
            )
        elif kind == "block":
            edit, inside = do.Rename(block=blocks[0], name=text), []
        elif kind == "group":
            edit, inside = do.GroupBlocks(blocks=blocks, name=text), []
        else:
            edit = do.AddBookmark(name=text, part=part)
        count = len(bookmarks_of(document.diagram))
        try:
            document.edit(edit, inside)
        except ArmblocksError:
            assert document.diagram is forms[-1]
            continue
        forms.append(document.diagram)
        change = {do.AddBookmark: 1, do.RemoveBookmark: -1}.get(type(edit), 0)
        assert len(bookmarks_of(document.diagram)) == count + change
    diagram = document.diagram
    content = diagram_to_bytes(diagram, load_robot)
    assert read(content, draft=True) == diagram
    assert diagram_to_bytes(read(content, draft=True), load_robot) == content
    assert pickle.loads(pickle.dumps(diagram)) == diagram
    assert copy.deepcopy(diagram).bookmarks == diagram.bookmarks
    for form in reversed(forms[:-1]):
        document.undo()
        assert document.diagram == form


def test_a_bookmark_is_one_line_of_the_file_in_the_order_of_names(document: Document) -> None:
    without = diagram_to_bytes(document.diagram, load_robot)
    assert b"bookmarks" not in without
    add(document, "right")
    add(document, "left")
    lines = diagram_to_bytes(document.diagram, load_robot).decode().splitlines()
    added = [line.strip() for line in lines if line not in without.decode().splitlines()]
    assert added == [
        '"bookmarks": {',
        '"left": {"height": 200, "width": 300, "x": -20, "y": 40.5},',
        '"right": {"height": 200, "width": 300, "x": -20, "y": 40.5}',
    ]


@pytest.mark.parametrize(
    ("bookmarks", "what"),
    [
        ([], "an array of 0"),
        ({"a": 1}, "the number 1"),
        ({"a": {"x": 0, "y": 0, "width": 10}}, "height"),
        ({"a": {"x": 0, "y": 0, "width": 10, "height": 10, "zoom": 1}}, "zoom"),
        ({"a": {"x": 0, "y": 0, "width": 10, "height": 0}}, "the part of the sheet is 10 x 0 px"),
        ({"a": {"x": 1e300, "y": 0, "width": 10, "height": 10}}, "at (1e+300, 0)"),
        ({" ": {"x": 0, "y": 0, "width": 10, "height": 10}}, "empty name"),
        ({"x" * 201: {"x": 0, "y": 0, "width": 10, "height": 10}}, "has 201 characters"),
        ({key: {"x": 0, "y": 0, "width": 10, "height": 10} for key in ("Soft", "soft")}, "named 'Soft'"),
        ({str(k): {"x": 0, "y": 0, "width": 10, "height": 10} for k in range(201)}, "has 200 bookmarks"),
    ],
)
@pytest.mark.parametrize("draft", [False, True])
def test_malformed_bookmarks_of_a_file_are_refused(
    document: Document, bookmarks: Any, what: str, draft: bool
) -> None:
    content = json.loads(diagram_to_bytes(document.diagram, load_robot))
    with pytest.raises((FormatError, DiagramError)) as refused:
        read({**content, "bookmarks": bookmarks}, draft=draft)
    assert what in str(refused.value)
    assert "servo.json:" in refused.value.where


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0, 0.0])
def test_a_part_of_the_sheet_has_a_finite_size(value: float) -> None:
    with pytest.raises(DiagramError, match="the part of the sheet is"):
        Bookmark(x=0.0, y=0.0, width=value, height=1.0)


def test_the_builder_stores_bookmarks(document: Document) -> None:
    builder = ab.DiagramBuilder("marked")
    part = Bookmark(x=0.0, y=0.0, width=100.0, height=50.0)
    builder.bookmark("left", part)
    with pytest.raises(DiagramError, match="already named 'left'"):
        builder.bookmark("Left", part)
    assert builder.draft().bookmarks == {"left": part}
