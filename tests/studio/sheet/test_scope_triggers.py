"""The trigger of the scopes: saved with the diagram, one undo step, and following renamed blocks."""

from __future__ import annotations

import copy
import dataclasses
import json
import pickle
from typing import Any

import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS, Constant, Gain, Scope
from armblocks.diagram import Diagram, ScopeTrigger, content_key, diagram_difference, flat_diagram
from armblocks.errors import ArmblocksError, DiagramError, FormatError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.studio.documents.aspects import changed_aspects
from armblocks.studio.protocol.messages import sheet_edits as do
from armblocks.studio.protocol.messages.documents import Change
from armblocks.studio.sheet.document import Document
from armblocks.studio.sheet.placing import placed
from armblocks.studio.sheet.scope_triggers import trigger_settings

TRIGGER = ScopeTrigger(
    signal="drive/gain/y", element=2, edge="either", level=-0.5, mode="auto", span=0.25, position=0.1
)


def model(trigger: ScopeTrigger | None = TRIGGER) -> Diagram:
    builder = ab.DiagramBuilder("servo")
    source = builder.add("source", Constant(value=1.0))
    with builder.subsystem("drive", source) as drive:
        drive.output("speed", drive.add("gain", Gain(gain=2.0), drive.input("u")))
    builder.add("scope", Scope(), builder["drive"])
    if trigger:
        builder.trigger_scopes(trigger)
    return builder.build()


def settings(**changes: Any) -> do.ScopeTriggerSettings:
    known = trigger_settings(model())
    assert known is not None
    return known.model_copy(update=changes)


def read(content: bytes | dict[str, Any]) -> Diagram:
    data = content if isinstance(content, bytes) else json.dumps(content).encode()
    return diagram_from_bytes(data, "servo.json", BLOCKS, load_robot)


def test_a_trigger_is_kept_by_files_and_copies_and_does_not_affect_the_model() -> None:
    diagram, without = model(), model(None)
    data = diagram_to_bytes(diagram, load_robot)
    assert read(data) == diagram
    assert diagram_to_bytes(read(data), load_robot) == data
    assert b"scope_trigger" not in diagram_to_bytes(without, load_robot)
    assert pickle.loads(pickle.dumps(diagram)) == copy.deepcopy(diagram) == diagram
    assert not diagram_difference(diagram, without)
    assert content_key(flat_diagram(diagram)) == content_key(flat_diagram(without))
    assert changed_aspects(diagram, without) == {("/", "scope_trigger")}


def test_letters_typed_into_a_field_are_one_undo_step() -> None:
    document = Document(model(None), load_robot)
    for level in (1.0, 12.0, 12.5):
        edit = do.SetScopeTrigger(trigger=settings(level=level))
        document.perform(Change(document="", gesture="level", edit=edit))
    document.edit(do.SetScopeTrigger(trigger=None))
    assert document.diagram.scope_trigger is None
    document.undo()
    assert document.diagram.scope_trigger == dataclasses.replace(TRIGGER, level=12.5)
    assert document.undo_title == "change the trigger of the scopes"
    document.undo()
    assert document.diagram == model(None)


def test_the_signal_of_the_trigger_follows_renamed_and_grouped_blocks() -> None:
    document = Document(placed(model()), load_robot)

    def signal() -> str:
        assert document.diagram.scope_trigger
        return document.diagram.scope_trigger.signal

    document.edit(do.Rename(block="drive", name="axis"))
    document.edit(do.Rename(block="gain", name="motor"), ["axis"])
    assert signal() == "axis/motor/y"
    document.edit(do.GroupBlocks(blocks=["axis"], name="plant"))
    assert signal() == "plant/axis/motor/y"
    for _ in range(3):
        document.undo()
    assert signal() == "drive/gain/y"


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("edge", "up", "the edge of the trigger is 'up'"),
        ("mode", "", "the mode of the trigger is ''"),
        ("element", -1, "the element of the trigger is -1"),
        ("level", float("nan"), "the level of the trigger is nan"),
        ("span", 0.0, "the span of the trigger is 0.0"),
        ("span", float("inf"), "the span of the trigger is inf"),
        ("position", 1.5, "the position of the trigger is 1.5"),
        ("hold_off", -1.0, "the hold_off of the trigger is -1.0"),
    ],
)
def test_invalid_settings_are_refused(name: str, value: Any, message: str) -> None:
    with pytest.raises(DiagramError, match=message):
        ScopeTrigger(**{name: value})


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ({"edges": "up"}, "edge"),
        ({"element": 0.5}, "the value is 0.5"),
        ({"level": "high"}, "a number"),
        ({"span": 0}, "the span of the trigger is 0"),
        ([], "scope_trigger"),
    ],
)
def test_invalid_triggers_in_files_are_refused_with_their_place(entry: Any, message: str) -> None:
    content = json.loads(diagram_to_bytes(model(), load_robot))
    content["scope_trigger"] = entry
    with pytest.raises(ArmblocksError, match=message) as caught:
        read(content)
    assert isinstance(caught.value, FormatError | DiagramError)
    assert "scope_trigger" in str(caught.value)
