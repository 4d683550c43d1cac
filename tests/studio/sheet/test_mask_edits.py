"""Edits of a mask: declaring, renaming and removing parameters, and the effect on values and formulas."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from client_requests import Events, run_scenario
from hypothesis import given, settings
from hypothesis import strategies as st

import armblocks as ab
from armblocks.blocks import BLOCKS, Constant, Gain, Scope
from armblocks.diagram import Diagram, DiagramBlock, DiagramBuilder, formula
from armblocks.errors import ArmblocksError, DiagramError, InputError, UnknownNameError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_diagram, load_robot
from armblocks.matlab.formula import Formula
from armblocks.studio.protocol.messages.sheet_edits import BreakLink, MaskParameter, SetMask, SetParameters
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.mask_edits import mask_of, renamed_in
from armblocks.studio.sheet.placing import placed


def spring() -> Diagram:
    """A subsystem ``spring`` with a gain ``2*k``, k = 3, in a model that declares ``w`` = 5."""
    builder = DiagramBuilder("model")
    w = builder.parameter("w", 5.0)
    with builder.subsystem("spring", builder.add("u", Constant(value=w))) as inner:
        inner.parameter("k", 1.0, unit="N/m", doc="stiffness", minimum=0.0)
        inner.output("y", inner.add("gain", Gain(gain=formula("2*k")), inner.input("u")))
    builder.add("scope", Scope(), builder["spring"]["y"])
    return placed(builder.build())


@pytest.fixture
def document() -> Document:
    document = Document(spring(), load_robot)
    document.edit(SetParameters(block="spring", values={"k": "w - 2"}))
    return document


def inner(document: Document) -> Diagram:
    block = document.diagram.blocks["spring"]
    assert isinstance(block, DiagramBlock)
    return block.diagram


def parameter(name: str, default: Any = 1.0, **properties: Any) -> MaskParameter:
    return MaskParameter(name=name, default=default, **properties)


def edit_mask(document: Document, parameters: Iterable[MaskParameter], name: str = "") -> None:
    document.edit(SetMask(block="spring", name=name, parameters=list(parameters)))


def gain(document: Document) -> tuple[object, str | None]:
    block = inner(document).blocks["gain"]
    return block.parameter_value("gain"), dict(block.formulas).get("gain")


@pytest.mark.parametrize("name", ["puma560_servos", "kr180model"])
def test_setting_the_present_mask_changes_nothing(name: str) -> None:
    document = Document(placed(load_diagram(name, BLOCKS)), load_robot)
    document.edit(mask_of(document.diagram))
    assert document.diagram == document.saved
    for key, block in load_diagram(name, BLOCKS).blocks.items():
        if isinstance(block, DiagramBlock):
            document.edit(BreakLink(block=key))
            before = document.diagram
            document.edit(mask_of(block.diagram).model_copy(update={"block": key}))
            assert document.diagram.blocks == before.blocks


def test_an_added_parameter_can_be_used_in_formulas(document: Document) -> None:
    edit_mask(
        document, [parameter("k", was="k"), parameter("damping", "[1 2; 3 4]/2", kind="array", unit="N s/m")]
    )
    assert document.undo_title == "mask spring"
    rule = inner(document).mask[1]
    assert (rule.name, rule.unit, rule.default) == ("damping", "N s/m", ((0.5, 1.0), (1.5, 2.0)))
    document.edit(SetParameters(block="gain", values={"gain": "k*damping"}), ["spring"])
    assert gain(document) == (((1.5, 3.0), (4.5, 6.0)), "k*damping")


def test_a_renamed_parameter_keeps_its_value_and_its_formulas(document: Document) -> None:
    edit_mask(document, [parameter("stiffness", was="k", unit="N/m")], name="Spring of steel")
    assert gain(document) == (6.0, "2*stiffness")
    assert inner(document).name == "Spring of steel"
    assert dict(document.diagram.blocks["spring"].formulas) == {"stiffness": "w - 2"}
    document.undo()
    assert gain(document) == (6.0, "2*k")
    document.redo()
    data = diagram_to_bytes(document.diagram, load_robot)
    assert diagram_from_bytes(data, "model.json", BLOCKS, load_robot) == document.diagram


def test_two_parameters_exchange_names_and_the_new_order_remains(document: Document) -> None:
    edit_mask(document, [parameter("k", was="k"), parameter("j", 10.0)])
    document.edit(SetParameters(block="gain", values={"gain": "k/j"}), ["spring"])
    edit_mask(document, [parameter("k", 10.0, was="j"), parameter("j", was="k")])
    assert [rule.name for rule in inner(document).mask] == ["k", "j"]
    assert gain(document) == (0.3, "j/k")


def test_a_value_at_its_default_follows_a_changed_default() -> None:
    document = Document(spring(), load_robot)
    edit_mask(document, [parameter("k", 4.0, was="k")])
    assert gain(document)[0] == 8.0
    document.edit(SetParameters(block="spring", values={"k": "7"}))
    edit_mask(document, [parameter("k", 5.0, was="k")])
    assert gain(document)[0] == 14.0


def test_bounds_apply_to_the_default_and_to_set_values(document: Document) -> None:
    with pytest.raises(InputError, match=r"the value is 1.0.*>= 2"):
        edit_mask(document, [parameter("k", was="k", minimum=2.0)])
    with pytest.raises(InputError, match=r"'k'.*the value is 3.0.*<= 2"):
        edit_mask(document, [parameter("k", was="k", maximum=2.0)])
    edit_mask(document, [parameter("k", was="k", above=0.0, maximum=3.0)])
    with pytest.raises(InputError, match=r"the value is 4.0"):
        document.edit(SetParameters(block="spring", values={"k": "w - 1"}))


def test_removing_a_parameter_that_a_formula_reads_is_refused(document: Document) -> None:
    before = document.diagram
    with pytest.raises(
        DiagramError, match=r"the mask parameter 'k' is removed, and the formula '2\*k' reads it"
    ):
        edit_mask(document, [])
    assert document.diagram is before
    document.edit(SetParameters(block="gain", values={"gain": "6"}), ["spring"])
    edit_mask(document, [])
    assert inner(document).mask == ()
    assert document.diagram.blocks["spring"].formulas == ()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ([parameter("k", was="nothing")], "unknown mask parameter|no mask parameter"),
        ([parameter("k", was="k"), parameter("k")], "declared twice"),
        ([parameter("2k", was="k")], "cannot be the name"),
        ([parameter("k", "++", was="k")], "the formula ends where a value is expected"),
        ([parameter("k", "maybe", was="k", kind="boolean")], "the value is 'maybe'"),
        ([parameter("k", was="k"), parameter("mode", "c", kind="choice", choices=["a", "b"])], "one of a, b"),
    ],
)
def test_invalid_declarations_are_refused(
    document: Document, parameters: list[MaskParameter], message: str
) -> None:
    before = document.diagram
    with pytest.raises(ArmblocksError, match=message):
        edit_mask(document, parameters)
    assert document.diagram is before


def test_parameters_of_all_types_can_be_declared(document: Document) -> None:
    kinds = [
        parameter("k", was="k"),
        parameter("n", "3", kind="integer"),
        parameter("on", "true", kind="boolean"),
        parameter("mode", "b", kind="choice", choices=["a", "b"]),
        parameter("label", "left", kind="string"),
        parameter("arm", "puma560", kind="robot"),
    ]
    edit_mask(document, kinds)
    values = inner(document).mask_values
    assert (values["n"], values["on"], values["mode"], values["label"]) == (3, True, "b", "left")
    assert values["arm"] == load_robot("puma560")
    reread_mask = [
        rule.model_copy(update={"default": rule.default}) for rule in mask_of(inner(document)).parameters
    ]
    assert [rule.kind for rule in reread_mask] == [
        "number",
        "integer",
        "boolean",
        "choice",
        "string",
        "robot",
    ]


def test_masks_of_primitive_and_linked_blocks_cannot_be_edited(document: Document) -> None:
    with pytest.raises(DiagramError, match="the block cannot have a mask"):
        document.edit(SetMask(block="scope", parameters=[]))
    with pytest.raises(UnknownNameError, match="block named 'sprin'"):
        document.edit(SetMask(block="sprin", parameters=[]))
    linked = Document(placed(load_diagram("puma560_servos", BLOCKS)), load_robot)
    with pytest.raises(
        DiagramError, match=r"the mask belongs to the library block 'joint_servos#JointServo'"
    ):
        linked.edit(SetMask(block="servo 1", parameters=[]))


def test_a_model_can_declare_a_mask(document: Document) -> None:
    document.edit(SetMask(parameters=[parameter("speed", 7.0, was="w")]))
    assert document.undo_title == "mask the model"
    assert dict(document.diagram.blocks["spring"].formulas) == {"k": "speed - 2"}
    assert gain(document)[0] == 10.0
    result = ab.simulate(document.diagram, stop_time=1.0)
    assert result["spring/y/y" if "spring/y/y" in result.names else "spring/gain/y"][-1] == 70.0


names = st.sampled_from(["a", "b", "k", "x1", "sin", "e", "pi", "u"])
terms = st.recursive(
    st.one_of(names, st.sampled_from(["1e5", "2.5", ".5", "1e-3"])),
    lambda inside: st.tuples(inside, st.sampled_from("+-*/"), inside).map(
        lambda t: f"({t[0]} {t[1]} {t[2]})"
    ),
    max_leaves=8,
)


@settings(deadline=None, max_examples=80, derandomize=True)
@given(terms, st.permutations(["a", "b", "k", "x1"]))
def test_renaming_changes_only_whole_names(text: str, order: list[str]) -> None:
    renaming = dict(zip(["a", "b", "k", "x1"], order, strict=True))
    inverse = {new: old for old, new in renaming.items()}
    renamed = renamed_in(text, renaming)
    assert renamed_in(renamed, inverse) == text
    assert Formula(renamed, "").names == {renaming.get(name, name) for name in Formula(text, "").names}


def test_a_client_can_read_and_set_a_mask(tmp_path: Path) -> None:
    async def scenario(hub: Any, ask: Any, events: Events) -> None:
        key = await ask("open_shipped", document_kind="diagram", name="puma560_servos")
        mask_edit = await ask("ask_mask", document=key, block="servo 1")
        assert [rule["name"] for rule in mask_edit["parameters"]] == ["w", "G", "Jm", "B", "limit", "q0"]
        await ask("change", document=key, edit={"kind": "break_link", "block": "servo 1"})
        mask = {**mask_edit, "block": "servo 1", "name": "Servo"}
        await ask("change", document=key, edit=mask)
        change = [event for event in events if event["kind"] == "changed"][-1]["change"]
        assert ">Servo<" in change["sheet"]["blocks"]["servo 1"]["face"]

    run_scenario(tmp_path, scenario)
