"""Parameter sets in the editor: saved, renamed, applied, and consistent after edits of blocks and masks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pytest

import armblocks as ab
from armblocks.blocks import Constant, Gain, Saturation, Scope
from armblocks.errors import ArmblocksError, DiagramError, InputError, UnknownNameError
from armblocks.formats import load_robot
from armblocks.studio.protocol.messages import sheet_edits as do
from armblocks.studio.sheet.check import check
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.parameter_sets import parameter_set_table
from armblocks.studio.sheet.placing import placed


@pytest.fixture
def document() -> Document:
    """A model with a masked subsystem, a limit, and a model parameter."""
    builder = ab.DiagramBuilder("servo")
    builder.parameter("scale", 2.0)
    source = builder.add("source", Constant(value=1.0))
    with builder.subsystem("controller", source) as inner:
        kp = inner.parameter("kp", 5.0, unit="N/m", doc="stiffness")
        inner.parameter("ki", 1.0)
        u = inner.input("u")
        inner.output("force", inner.add("gain", Gain(gain=kp), u))
        inner.add("plot", Scope(), inner.add("free", Gain(gain=3.0), u))
    limited = builder.add("limit", Saturation(lower=0.0, upper=2.0), builder["controller"])
    builder.add("scope", Scope(), builder.add("scaled", Gain(gain=ab.formula("scale")), limited))
    return Document(placed(builder.build()), load_robot)


ALL: dict[str, Any] = {
    "controller.kp": 7.0,
    "controller.ki": 2.0,
    "controller/free.gain": 4.0,
    "limit.upper": 9.0,
    "scale": 3.0,
}


def sets(document: Document) -> Mapping[str, Mapping[str, Any]]:
    return {name: dict(values) for name, values in document.diagram.parameter_sets.items()}


def save(document: Document, name: str, values: Mapping[str, Any], **options: bool) -> None:
    document.edit(do.SaveParameterSet(name=name, values=dict(values), **options))


def test_a_set_is_saved_updated_renamed_and_removed_in_steps_that_can_be_undone(document: Document) -> None:
    save(document, " stiff ", {"limit.upper": "2*pi", "controller.kp": 9})
    assert sets(document) == {"stiff": {"limit.upper": 2 * math.pi, "controller.kp": 9.0}}
    save(document, "stiff", {"limit.upper": "inf"}, replace=True)
    assert sets(document) == {"stiff": {"limit.upper": math.inf}}
    document.edit(do.RenameParameterSet(name="stiff", to="Stiff"))
    document.edit(do.RemoveParameterSet(name="Stiff"))
    assert sets(document) == {}
    for _ in range(3):
        document.undo()
    assert sets(document) == {"stiff": {"limit.upper": 2 * math.pi, "controller.kp": 9.0}}


def test_a_set_may_contain_the_values_that_the_model_has_for_the_other_sets(document: Document) -> None:
    save(document, "stiff", {"controller.kp": 9.0, "limit.upper": 3.0})
    save(document, "nominal", {}, all_parameters=True)
    save(document, "wide", {"limit.upper": 8.0}, all_parameters=True)
    assert sets(document)["nominal"] == {"controller.kp": 5.0, "limit.upper": 2.0}
    assert sets(document)["wide"] == {"controller.kp": 5.0, "limit.upper": 8.0}


def test_a_set_is_written_into_the_model_as_one_step(document: Document) -> None:
    before = document.diagram
    save(document, "all", ALL)
    document.edit(do.ApplyParameterSet(name="all"))
    applied = document.diagram
    assert applied == ab.with_parameter_set(document.diagram, "all")
    assert applied.mask_values["scale"] == 3.0
    assert applied.blocks["limit"].parameter_value("upper") == 9.0
    document.undo()
    assert document.diagram.blocks == before.blocks


@pytest.mark.parametrize(
    ("edit", "error", "what"),
    [
        (do.SaveParameterSet(name="stiff", values={"scale": 1.0}), DiagramError, "already named 'stiff'"),
        (do.SaveParameterSet(name="", values={"scale": 1.0}), DiagramError, "empty name"),
        (do.SaveParameterSet(name="none", values={}), DiagramError, "no values"),
        (do.SaveParameterSet(name="x", values={"limit.uper": 1.0}), UnknownNameError, "uper"),
        (do.SaveParameterSet(name="x", values={"limit.upper": "two"}), ArmblocksError, "two"),
        (do.SaveParameterSet(name="x", values={"limit.upper": None}), InputError, "None"),
        (do.SaveParameterSet(name="x", values={"scaled.gain": 1.0}), DiagramError, "formula"),
        (do.SaveParameterSet(name="x", values={"scale": 1.0}, replace=True), UnknownNameError, "'x'"),
        (do.RenameParameterSet(name="stiff", to="SOFT"), DiagramError, "already named 'soft'"),
        (do.RenameParameterSet(name="x", to="y"), UnknownNameError, "'x'"),
        (do.RemoveParameterSet(name="x"), UnknownNameError, "'x'"),
        (do.ApplyParameterSet(name="x"), UnknownNameError, "'x'"),
        (do.RemoveSetParameter(path="limit.lower"), UnknownNameError, "limit.lower"),
    ],
)
def test_refused_edits_change_nothing(
    document: Document, edit: do.DiagramEdit, error: type[ArmblocksError], what: str
) -> None:
    save(document, "stiff", {"limit.upper": 3.0})
    save(document, "soft", {"limit.upper": 1.0})
    before = document.diagram
    with pytest.raises(error, match=what):
        document.edit(edit)
    assert document.diagram is before


def renamed(path: str, *, old: str, new: str) -> str:
    return new + path.removeprefix(old) if path.startswith((f"{old}.", f"{old}/")) else path


def test_renamed_blocks_are_renamed_in_the_sets(document: Document) -> None:
    save(document, "all", ALL)
    document.edit(do.Rename(block="controller", name="PD"))
    document.edit(do.Rename(block="free", name="feed"), ["PD"])
    document.edit(do.Rename(block="limit", name="stop"))
    assert sets(document)["all"] == {
        "PD.kp": 7.0,
        "PD.ki": 2.0,
        "PD/feed.gain": 4.0,
        "stop.upper": 9.0,
        "scale": 3.0,
    }
    ab.with_parameter_set(document.diagram, "all")


def test_grouped_blocks_have_their_new_paths_in_the_sets(document: Document) -> None:
    save(document, "all", ALL)
    document.edit(do.GroupBlocks(blocks=["controller", "limit"], name="drive"))
    assert sets(document)["all"] == {
        "drive/controller.kp": 7.0,
        "drive/controller.ki": 2.0,
        "drive/controller/free.gain": 4.0,
        "drive/limit.upper": 9.0,
        "scale": 3.0,
    }
    document.edit(do.GroupBlocks(blocks=["free"], name="inner"), ["drive", "controller"])
    assert "drive/controller/inner/free.gain" in sets(document)["all"]
    ab.with_parameter_set(document.diagram, "all")


def test_removed_blocks_are_removed_from_the_sets_and_come_back_with_undo(document: Document) -> None:
    save(document, "all", ALL)
    document.edit(do.RemoveBlocks(blocks=["controller"]))
    assert sets(document)["all"] == {"limit.upper": 9.0, "scale": 3.0}
    document.undo()
    assert sets(document)["all"] == ALL


def declared(document: Document, block: str, names: Mapping[str, str]) -> None:
    parameters = [do.MaskParameter(name=new, was=old, default=1.0) for old, new in names.items()]
    document.edit(do.SetMask(block=block, parameters=parameters))


def test_renamed_mask_parameters_are_renamed_in_the_sets(document: Document) -> None:
    save(document, "all", ALL)
    declared(document, "controller", {"kp": "ki", "ki": "kp"})
    assert (sets(document)["all"]["controller.ki"], sets(document)["all"]["controller.kp"]) == (7.0, 2.0)
    declared(document, "", {"scale": "factor"})
    assert "scale" not in sets(document)["all"]
    assert sets(document)["all"]["factor"] == 3.0


def test_a_removed_mask_parameter_does_not_give_its_value_to_another_one(document: Document) -> None:
    save(document, "all", ALL)
    declared(document, "controller", {"kp": "ki"})  # the former ki is removed
    assert sets(document)["all"]["controller.ki"] == 7.0
    assert "controller.kp" not in sets(document)["all"]


def test_the_mask_of_an_open_subsystem_renames_its_parameters(document: Document) -> None:
    save(document, "all", ALL)
    parameters = [do.MaskParameter(name="stiffness", was="kp", default=1.0)]
    document.edit(do.SetMask(parameters=parameters), ["controller"])
    assert sets(document)["all"] == {
        "controller.stiffness": 7.0,
        "controller/free.gain": 4.0,
        "limit.upper": 9.0,
        "scale": 3.0,
    }


def test_the_table_has_the_values_of_the_model_and_the_faults_of_the_sets(document: Document) -> None:
    save(document, "all", ALL)
    save(document, "one", {"limit.lower": -1.0})
    document.edit(do.SetParameters(block="limit", values={"upper": "scale"}))
    table = parameter_set_table(document.diagram)
    rows = {row.path: row for row in table.parameters}
    assert rows["controller.kp"].value == 5.0
    assert rows["controller.kp"].unit == "N/m"
    assert rows["controller.kp"].tunable
    assert rows["controller/free.gain"].tunable
    assert table.sets["all"] == ALL
    assert list(table.faults["all"]) == ["limit.upper"]
    assert "formula" in table.faults["all"]["limit.upper"]
    assert not table.faults["one"]
    findings, _ = check(document.diagram)
    assert "limit" in findings[0].block
    document.edit(do.RemoveSetParameter(path="limit.upper"))
    assert not parameter_set_table(document.diagram).faults["all"]
    assert check(document.diagram)[0] == []
