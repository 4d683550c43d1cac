"""Every edit of a diagram can be undone exactly."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from armblocks.blocks import BLOCKS, Gain
from armblocks.diagram import Diagram, DiagramBlock, Placement, diagram_views, formula, mask_parameter
from armblocks.errors import ArmblocksError, FormatError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_diagram, load_robot
from armblocks.studio.protocol.messages.sheet_edits import (
    AddBlocks,
    BendWires,
    CommentBlocks,
    Connect,
    Describe,
    DiagramEdit,
    GroupBlocks,
    KeepTuned,
    LogSignal,
    MoveBlocks,
    NewBlock,
    PasteBlocks,
    Place,
    RemoveBlocks,
    Rename,
    SetNotes,
    SetParameters,
    SetSettings,
    SheetNote,
    Wire,
)
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.drawing_data import sheet, sheet_change
from armblocks.studio.sheet.edits import EDITS, applied
from armblocks.studio.sheet.nesting import inside
from armblocks.studio.sheet.outline import find, outline
from armblocks.studio.sheet.parameter_values import parameter_value
from armblocks.studio.sheet.placing import placed

NAMES = ["sine", "gain", "scope", "Gain 2", "ä"]
TYPES = ["SineWave", "Gain", "Scope", "Sum", "JTraj", "Integrator"]
PORTS = ["sine/y", "gain/y", "gain/u", "scope/u1", "Gain 2/u", "Gain 2/y", "nobody/y", "x"]

COPIED = clipped(
    Diagram(name="there", blocks={"gain": Gain(gain=2.0)}, layout={"gain": Placement(x=1.0, y=2.0)}),
    ["gain"],
    [],
    load_robot,
)

names, ports = st.sampled_from(NAMES), st.sampled_from(PORTS)
numbers = st.floats(-1e4, 1e4, allow_nan=False)
wires = st.builds(Wire, source=ports, target=ports, bends=st.lists(numbers, max_size=3))
places = st.builds(
    Place, x=numbers, y=numbers, flipped=st.booleans(), rotation=st.sampled_from([0, 90, 180, 270])
)
note_names = st.sampled_from(["/1", "/2"])
notes = st.dictionaries(
    note_names, st.builds(SheetNote, x=numbers, y=numbers, text=st.text(max_size=5)), max_size=2
)
values = st.sampled_from(
    [2.0, "2*pi", "[1 2 3]", "inf", "import os", "++-", "", None, [1.0], True, "puma560"]
)
parameters = st.dictionaries(st.sampled_from(["gain", "signs", "inputs", "nothing"]), values, max_size=2)
blocks = st.builds(NewBlock, name=names, type=st.sampled_from(TYPES), parameters=parameters, place=places)
edits: st.SearchStrategy[DiagramEdit] = st.one_of(
    st.builds(AddBlocks, blocks=st.lists(blocks, max_size=2), wires=st.lists(wires, max_size=1)),
    st.builds(
        RemoveBlocks,
        blocks=st.lists(names, max_size=2),
        wires=st.lists(wires, max_size=1),
        reconnections=st.lists(wires, max_size=1),
    ),
    st.builds(Connect, wire=wires, replace=st.booleans(), instead=st.lists(wires, max_size=1)),
    st.builds(MoveBlocks, places=st.dictionaries(names, places, max_size=2), notes=notes),
    st.builds(MoveBlocks, wires=st.lists(wires, max_size=2), instead=st.lists(wires, max_size=2)),
    st.builds(
        PasteBlocks, text=st.just(COPIED), names=st.dictionaries(names, names, max_size=2), shift=numbers
    ),
    st.builds(BendWires, wires=st.lists(wires, min_size=1, max_size=2)),
    st.builds(SetNotes, notes=notes),
    st.builds(RemoveBlocks, notes=st.lists(note_names, min_size=1, max_size=2)),
    st.builds(Rename, block=names, name=names),
    st.builds(SetParameters, block=names, values=parameters),
    st.builds(
        SetSettings, values=st.dictionaries(st.sampled_from(["stop_time", "step", "x"]), numbers, max_size=1)
    ),
    st.builds(KeepTuned, values=st.dictionaries(st.sampled_from(["gain.gain", "x.y"]), values, max_size=2)),
    st.builds(LogSignal, port=ports, logged=st.booleans()),
    st.builds(Describe, text=st.text(max_size=5)),
)


def content(document: Document) -> bytes:
    return diagram_to_bytes(document.diagram, load_robot)


def empty() -> Document:
    return Document(Diagram(name="sheet", blocks={}), load_robot)


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(edits, max_size=25))
def test_undo_and_redo_of_all_edits_restore_the_files(todo: list[DiagramEdit]) -> None:
    document = empty()
    history = [content(document)]
    for edit in todo:
        before = document.diagram
        try:
            document.edit(edit)
        except ArmblocksError:
            assert document.diagram is before
            continue
        assert EDITS.title(edit) == document.undo_title
        history.append(content(document))
    for expected in reversed(history[:-1]):
        document.undo()
        assert content(document) == expected
    assert document.undo_title == ""
    for expected in history[1:]:
        document.redo()
        assert content(document) == expected
    assert document.redo_title == ""


def test_every_block_of_the_library_can_be_dropped_and_saved() -> None:
    document = empty()
    for kind in BLOCKS:
        document.edit(AddBlocks(blocks=[NewBlock(name=kind, type=kind, place=Place(x=0, y=0))]))
    assert len(document.diagram.blocks) == len(BLOCKS)
    assert content(document)
    for name, block in document.diagram.blocks.items():
        if isinstance(block, DiagramBlock):
            assert set(sheet(inside(document.diagram, [name])).blocks) == set(block.diagram.blocks)


def test_wires_to_removed_ports_are_removed_and_restored_by_undo() -> None:
    document = Document(placed(load_diagram("van_der_pol_pid", BLOCKS)), load_robot)
    before = document.diagram
    document.edit(SetParameters(block="error", values={"signs": "+"}))
    assert len(document.diagram.connections) == len(before.connections) - 2  # a single input is named u
    document.undo()
    assert document.diagram is before
    assert not document.dirty


def test_bends_follow_their_wire_and_its_blocks() -> None:
    document = chain()
    wire = Wire(source="sine/y", target="gain/u", bends=(100, 200, 150))
    document.edit(BendWires(wires=[wire]))
    (bends,) = document.diagram.bends.values()
    assert bends == (100, 200, 150)
    again = diagram_from_bytes(content(document), "again", BLOCKS, load_robot, draft=True)
    assert again == document.diagram
    document.edit(Rename(block="sine", name="wave"))
    assert [str(wire) for wire in document.diagram.bends] == ["wave/y -> gain/u"]
    both = {"wave": Place(x=10, y=7), "gain": Place(x=210, y=7)}
    document.edit(MoveBlocks(places=both))
    assert list(document.diagram.bends.values()) == [(110, 207, 160)]
    document.edit(MoveBlocks(places={"gain": Place(x=300, y=7)}))
    assert list(document.diagram.bends.values()) == [(110, 207, 160)]
    document.edit(RemoveBlocks(wires=[Wire(source="wave/y", target="gain/u")]))
    assert document.diagram.bends == {}
    document.undo()
    document.edit(BendWires(wires=[Wire(source="wave/y", target="gain/u")]))
    assert document.undo_title == "bend 1 wire"
    assert document.diagram.bends == {}


def test_inserting_a_block_into_a_wire_is_one_step() -> None:
    document = chain()
    before = content(document)
    document.edit(
        AddBlocks(
            blocks=[NewBlock(name="between", type="Gain", place=Place(x=100, y=0))],
            wires=[Wire(source="sine/y", target="between/u"), Wire(source="between/y", target="gain/u")],
            instead=[Wire(source="sine/y", target="gain/u")],
        )
    )
    assert [str(wire) for wire in document.diagram.connections] == [
        "between/y -> gain/u",
        "sine/y -> between/u",
    ]
    document.undo()
    assert content(document) == before


def test_wires_are_moved_reconnected_and_added_in_one_step() -> None:
    document = chain()
    before = content(document)
    document.edit(AddBlocks(blocks=[NewBlock(name="next", type="Gain", place=Place(x=100, y=0))]))
    added = content(document)
    sine = Wire(source="sine/y", target="gain/u")
    document.edit(Connect(wire=Wire(source="sine/y", target="next/u"), instead=[sine]))
    assert document.undo_title == "connect sine/y to next/u"
    assert [str(wire) for wire in document.diagram.connections] == ["sine/y -> next/u"]
    document.undo()
    document.edit(AddBlocks(blocks=[], wires=[Wire(source="gain/y", target="next/u")]))
    assert document.undo_title == "connect gain/y to next/u"
    document.edit(RemoveBlocks(blocks=["gain"], reconnections=[Wire(source="sine/y", target="next/u")]))
    assert [str(wire) for wire in document.diagram.connections] == ["sine/y -> next/u"]
    document.undo()
    document.undo()
    assert content(document) == added
    document.undo()
    assert content(document) == before


def test_notes_are_written_moved_and_saved() -> None:
    document = chain()
    before = content(document)
    document.edit(SetNotes(notes={"/1": SheetNote(x=5, y=6, text="first\nsecond")}))
    assert document.undo_title == "write 1 note"
    again = diagram_from_bytes(content(document), "again", BLOCKS, load_robot, draft=True)
    assert again.notes == document.diagram.notes
    document.edit(MoveBlocks(notes={"/1": SheetNote(x=9, y=6, text="first\nsecond")}))
    assert document.undo_title == "move 1 note"
    with pytest.raises(ArmblocksError, match="note"):
        document.edit(MoveBlocks(notes={"/2": SheetNote(x=9, y=6, text="")}))
    document.edit(RemoveBlocks(notes=["/1"]))
    assert content(document) == before


def chain() -> Document:
    """A sine wave connected to a gain beside it."""
    document = empty()
    document.edit(
        AddBlocks(
            blocks=[
                NewBlock(name="sine", type="SineWave", place=Place(x=0, y=0)),
                NewBlock(name="gain", type="Gain", place=Place(x=200, y=0)),
            ],
            wires=[Wire(source="sine/y", target="gain/u")],
        )
    )
    return document


def refused(*todo: DiagramEdit) -> str:
    document = chain()
    with pytest.raises(ArmblocksError) as caught:
        for edit in todo:
            document.edit(edit)
    return str(caught.value)


def test_refused_edits_give_the_reason() -> None:
    place = Place(x=0, y=0)
    second = AddBlocks(blocks=[NewBlock(name="GAIN", type="Gain", place=place)])
    assert "a block is already named 'gain'" in refused(second)
    assert "is already driven by 'sine/y'" in refused(Connect(wire=Wire(source="sine/y", target="gain/u")))
    assert "'gain' is not a port" in refused(Connect(wire=Wire(source="gain", target="gain/u")))
    missing = Wire(source="gain/y", target="gain/u")
    assert "the wire gain/y -> gain/u does not exist" in refused(RemoveBlocks(wires=[missing]))
    many = [NewBlock(name=f"b{k}", type="Gain", place=place) for k in range(20_000)]
    assert "the sheet would have 20002 blocks" in refused(AddBlocks(blocks=many))
    wrong = SetParameters(block="gain", values={"gain": "import os"})
    assert "'os' is not allowed here, expected an operator, in column 8: import »os" in refused(wrong)
    assert "there is no name named 'os'" in refused(SetParameters(block="gain", values={"gain": "2*os"}))
    assert "';' is not allowed here" in refused(SetParameters(block="gain", values={"gain": "1; x = 2"}))
    assert "this is not a value" in refused(SetParameters(block="gain", values={"gain": " "}))
    plot = AddBlocks(blocks=[NewBlock(name="p", type="RobotPlot", parameters={"robot": 3}, place=place)])
    assert "the value must be a robot, and int was given" in refused(plot)


def test_undo_and_redo_without_a_step_are_refused() -> None:
    with pytest.raises(ArmblocksError, match="there is nothing to undo"):
        empty().undo()
    with pytest.raises(ArmblocksError, match="there is nothing to redo"):
        empty().redo()


@pytest.mark.parametrize(
    ("typed", "matrix"),
    [
        ("-1", ((-1.0,),)),
        ("[-1]", ((-1.0,),)),
        ("[1 2]", ((1.0, 2.0),)),
        ("[2*2; sqrt(9)]", ((4.0,), (3.0,))),
        ("[1 2; 3 4]", ((1.0, 2.0), (3.0, 4.0))),
    ],
)
def test_rows_and_columns_are_distinguished_for_matrix_parameters(
    typed: str, matrix: tuple[tuple[float, ...], ...]
) -> None:
    rule = next(rule for rule in BLOCKS["StateSpace"].parameters() if rule.name == "A")
    assert parameter_value(rule, typed, "plant", load_robot) == matrix


@pytest.mark.parametrize(
    ("typed", "value"),
    [
        ("2*pi", 6.283185307179586),
        ("-1/4", -0.25),
        ("45*deg", 0.7853981633974483),
        ("2*rad", 2.0),
        ("1e3", 1000.0),
        (" 007 ", 7.0),
        ("1/Inf", 0.0),
        ("2^3^2", 64.0),
        ("[1 2; 3 4]", ((1.0, 2.0), (3.0, 4.0))),
        ("[1 -2]'", (1.0, -2.0)),
        ("sqrt(2)*[1, 0]", (math.sqrt(2.0), 0.0)),
    ],
)
def test_numbers_may_be_typed_as_formulas(typed: str, value: float) -> None:
    document = empty()
    new = NewBlock(name="gain", type="Gain", parameters={"gain": typed}, place=Place(x=0, y=0))
    document.edit(AddBlocks(blocks=[new]))
    assert document.diagram.blocks["gain"].parameter_value("gain") == value
    # A formula has the same value with and without a mask.
    assert Gain(gain=formula(typed)).parameter_value("gain") == value
    masked = replace(document.diagram, mask=(mask_parameter("k", 1.0),))
    in_mask = applied(SetParameters(block="gain", values={"gain": f"k*({typed})"}), masked, load_robot)
    assert in_mask.blocks["gain"].parameter_value("gain") == value


def test_tuned_values_of_several_blocks_are_kept_as_one_step() -> None:
    document = Document(placed(load_diagram("van_der_pol_pid", BLOCKS)), load_robot)
    before = content(document)
    document.edit(KeepTuned(values={"PID.P": "2*3", "PID.I": 0.25}))
    assert document.undo_title == "keep 2 tuned values"
    assert document.diagram.block("PID").parameter_value("P") == 6.0
    assert document.diagram.block("PID").parameter_value("I") == 0.25
    document.undo()
    assert content(document) == before


def test_a_logged_signal_follows_renaming_and_is_removed_with_its_block() -> None:
    document = Document(placed(load_diagram("van_der_pol_pid", BLOCKS)), load_robot)
    before = content(document)
    document.edit(LogSignal(port="PID/y", logged=True))
    document.edit(Rename(block="PID", name="controller"))
    assert [str(ref) for ref in document.diagram.logged] == ["controller/y"]
    again = diagram_from_bytes(content(document), "again", BLOCKS, load_robot)
    assert again.logged == document.diagram.logged
    name, view = diagram_views(again)[-1]
    assert (name, view.signals, view.title) == ("controller", ("y",), "controller/y")
    document.edit(GroupBlocks(blocks=["controller"], name="inner"))
    name, view = diagram_views(document.diagram)[-1]
    assert (name, view.title) == ("inner/controller", "inner/controller/y")
    document.undo()
    document.edit(RemoveBlocks(blocks=["controller"]))
    assert document.diagram.logged == ()
    for _ in range(3):
        document.undo()
    assert content(document) == before
    with pytest.raises(ArmblocksError, match="output port"):
        document.edit(LogSignal(port="PID/nothing", logged=True))
    document.edit(LogSignal(port="PID/y", logged=True))
    document.edit(LogSignal(port="PID/y", logged=False))
    assert document.undo_title == "stop logging PID/y"
    assert content(document) == before
    wrong = before.replace(b'"connections":', b'"logged": ["PID"], "connections":')
    with pytest.raises(FormatError, match="'PID' is not an output"):
        diagram_from_bytes(wrong, "wrong", BLOCKS, load_robot)


def test_a_comment_follows_its_block_and_is_checked_again_in_the_file() -> None:
    document = Document(placed(load_diagram("van_der_pol_pid", BLOCKS)), load_robot)
    before, plain = content(document), document.diagram
    document.edit(CommentBlocks(blocks=["PID", "damping"], comment="through"))
    assert document.undo_title == "comment through 2 blocks"
    shown = sheet_change(plain, document.diagram).blocks
    assert {name for name, block in shown.items() if block and block.comment} == {"PID", "damping"}
    document.edit(Rename(block="PID", name="controller"))
    document.edit(CommentBlocks(blocks=["damping"], comment="out"))
    assert document.diagram.commented == {"controller": "through", "damping": "out"}
    again = diagram_from_bytes(content(document), "again", BLOCKS, load_robot)
    assert again == document.diagram
    text = clipped(again, ["controller"], [], load_robot)
    document.edit(PasteBlocks(text=text, names={"controller": "copy"}))
    assert document.diagram.commented["copy"] == "through"
    document.edit(GroupBlocks(blocks=["controller", "damping"], name="inner"))
    assert inside(document.diagram, ["inner"]).commented == again.commented
    assert document.diagram.commented == {"copy": "through"}
    document.edit(RemoveBlocks(blocks=["copy"]))
    assert document.diagram.commented == {}
    for _ in range(5):
        document.undo()
    assert document.diagram.commented["PID"] == "through"
    document.edit(CommentBlocks(blocks=["PID", "damping"], comment=""))
    assert content(document) == before
    scope = next(name for name, block in plain.blocks.items() if not block.output_ports())
    with pytest.raises(ArmblocksError, match="0 outputs is commented through"):
        document.edit(CommentBlocks(blocks=[scope], comment="through"))
    wrong = before.replace(b'"damping": {', b'"damping": {"commented": "away",')
    with pytest.raises(FormatError, match="'away' is not a comment"):
        diagram_from_bytes(wrong, "wrong", BLOCKS, load_robot)


def test_blocks_are_found_on_all_sheets_by_name_type_and_value() -> None:
    document = Document(placed(load_diagram("van_der_pol_pid", BLOCKS)), load_robot)
    document.edit(GroupBlocks(blocks=["PID", "damping"], name="inner"))
    diagram = document.diagram
    first, *_ = find(diagram, "pid")
    assert (first.inside, first.name) == (["inner"], "PID")
    assert {block_found.name for block_found in find(diagram, "integrator")} == {"x1", "x2"}
    assert ("damping", "gain = 0.5") in {
        (block_found.name, block_found.match) for block_found in find(diagram, "gain 0.5")
    }
    assert find(diagram, "no such thing") == find(diagram, " ") == []
    tree = outline(diagram)
    assert [(sub.name, sub.blocks) for sub in tree.subsystems] == [("inner", len(diagram_inside(diagram)))]


def test_blocks_are_found_by_the_names_and_the_manufacturer_of_their_robot() -> None:
    diagram = load_diagram("kr180model", BLOCKS)
    for words in ("kr180 kuka", "Robotics"):
        robot = "robot = KUKA Robotics, KR180, kr180"
        assert {(one.name, one.match) for one in find(diagram, words)} == {
            (name, robot) for name in ("kuka", "plot", "rne")
        }
    assert find(diagram, "puma") == []


def diagram_inside(diagram: Diagram) -> list[str]:
    return list(inside(diagram, ["inner"]).blocks)


def test_settings_and_tuned_values_apply_to_the_model_on_every_sheet() -> None:
    document = Document(placed(load_diagram("puma560_servos", BLOCKS)), load_robot)
    name, block = next(
        (name, block) for name, block in document.diagram.blocks.items() if isinstance(block, DiagramBlock)
    )
    path, value = "motion.tmax", 1.25
    document.edit(SetSettings(values={"stop_time": 7.0}), [name])
    document.edit(KeepTuned(values={path: value}), [name])
    assert document.diagram.settings.stop_time == 7.0
    assert inside(document.diagram, [name]).settings == block.diagram.settings
    assert document.diagram.block("motion").parameter_value("tmax") == value
