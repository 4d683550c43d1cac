"""Parameter sets: stored with the diagram, checked, and applied by name in Python and on the command line."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import Result

import armblocks as ab
from armblocks.blocks import BLOCKS, Constant, Gain, Saturation, Scope
from armblocks.diagram import Diagram, diagram_difference, with_parameters
from armblocks.errors import ArmblocksError, DiagramError, FormatError, InputError, UnknownNameError
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.formats.diagram_python import diagram_to_python

Invoke = Callable[..., Result]

SETS: dict[str, dict[str, Any]] = {
    "stiff": {"controller.kp": 40.0, "limit.lower": 4.0, "limit.upper": 5.0, "source.value": 3.0},
    "soft": {"controller/gain 2.gain": [1.0, 2.0], "scale": 0.5},
    "unbounded": {"limit.upper": math.inf},
}


def model(sets: dict[str, dict[str, Any]]) -> ab.DiagramBuilder:
    builder = ab.DiagramBuilder("servo")
    builder.parameter("scale", 2.0, doc="scale")
    source = builder.add("source", Constant(value=1.0))
    with builder.subsystem("controller", source) as inner:
        kp = inner.parameter("kp", 5.0, unit="N/m", doc="stiffness")
        u = inner.input("u")
        inner.output("force", inner.add("gain", Gain(gain=kp), u))
        inner.add("plot", Scope(), inner.add("gain 2", Gain(gain=[3.0, 4.0]), u))
    limited = builder.add("limit", Saturation(lower=0.0, upper=2.0), builder["controller"])
    builder.add("scope", Scope(), builder.add("scaled", Gain(gain=ab.formula("scale")), limited))
    for name, values in sets.items():
        builder.parameter_set(name, values)
    return builder


def document(diagram: Diagram) -> dict[str, Any]:
    return json.loads(diagram_to_bytes(diagram, load_robot))


def read(content: dict[str, Any], *, draft: bool = False) -> Diagram:
    data = json.dumps(content, indent=1).encode()
    return diagram_from_bytes(data, "servo.json", BLOCKS, load_robot, draft=draft)


def test_sets_are_applied_by_name_and_the_diagram_keeps_its_values() -> None:
    diagram = model(SETS).build()
    stiff = ab.with_parameter_set(diagram, "stiff")
    assert ab.simulate(diagram, stop_time=0.1)["scaled"][-1] == 4.0
    # 40 N/m times 3 is limited to 5, and scaled by 2.
    assert ab.simulate(stiff, stop_time=0.1)["scaled"][-1] == 10.0
    assert stiff.parameter_sets == diagram.parameter_sets
    assert with_parameters(diagram, diagram.parameter_sets["stiff"]) == stiff
    run = ab.simulate(diagram, stop_time=0.1, parameters=diagram.parameter_sets["stiff"])
    assert run["scaled"][-1] == 10.0
    assert ab.with_parameter_set(diagram, "soft").mask_values["scale"] == 0.5


def test_limits_that_depend_on_each_other_are_changed_together() -> None:
    diagram = model(SETS).build()
    with pytest.raises(ArmblocksError):
        with_parameters(diagram, {"limit.lower": 4.0})
    limit = ab.with_parameter_set(diagram, "stiff").blocks["limit"]
    assert (limit.parameter_value("lower"), limit.parameter_value("upper")) == (4.0, 5.0)


def test_files_and_python_programs_keep_the_sets() -> None:
    diagram = model(SETS).build()
    content = diagram_to_bytes(diagram, load_robot)
    assert diagram_from_bytes(content, "servo", BLOCKS, load_robot) == diagram
    assert diagram_from_bytes(content, "servo", BLOCKS, load_robot, draft=True) == diagram
    assert diagram_to_bytes(read(document(diagram)), load_robot) == content
    assert document(diagram)["parameter_sets"]["unbounded"] == {"limit.upper": "inf"}
    names: dict[str, Any] = {}
    exec(diagram_to_python(diagram), names)  # noqa: S102
    assert names["diagram"].parameter_sets == diagram.parameter_sets


def test_a_file_without_sets_does_not_have_the_key() -> None:
    without = model({}).build()
    assert "parameter_sets" not in document(without)
    plain = dataclasses.replace(model(SETS).build(), parameter_sets={})
    assert diagram_to_bytes(plain, load_robot) == diagram_to_bytes(without, load_robot)


def test_sets_are_read_only_and_can_be_copied() -> None:
    diagram = model(SETS).build()
    assert pickle.loads(pickle.dumps(diagram)) == diagram
    assert copy.deepcopy(diagram).parameter_sets == diagram.parameter_sets
    for mapping in (diagram.parameter_sets, diagram.parameter_sets["soft"]):
        with pytest.raises(TypeError):
            mapping["new"] = {}  # pyright: ignore[reportIndexIssue]


@pytest.mark.parametrize(
    ("path", "value", "error", "what"),
    [
        ("limit.uper", 1.0, UnknownNameError, "'uper'"),
        ("limiter.upper", 1.0, UnknownNameError, "'limiter'"),
        ("controller/gain.gain", 1.0, DiagramError, "set by the formula"),
        ("speed", 1.0, UnknownNameError, "'speed'"),
        ("limit.upper", "five", InputError, "five"),
        ("controller.diagram", 1.0, ArmblocksError, "diagram"),
    ],
)
def test_an_entry_that_the_model_does_not_allow_is_named(
    path: str, value: Any, error: type[ArmblocksError], what: str
) -> None:
    with pytest.raises(error) as caught:
        model({"stiff": {path: value}}).build()
    assert what in str(caught.value)
    assert "parameter set 'stiff'" in str(caught.value)

    content = document(model(SETS).build())
    content["parameter_sets"] = {"stiff": {path: value}}
    with pytest.raises(ArmblocksError) as caught:
        read(content)
    assert what in str(caught.value)
    assert "servo.json:" in caught.value.where
    assert f'"{path}"' in caught.value.where or path in caught.value.where

    # The editor opens the file, and the error is raised when the set is applied.
    draft = read(content, draft=True)
    assert draft.parameter_sets["stiff"] == {path: value}
    assert document(draft)["parameter_sets"] == content["parameter_sets"]
    with pytest.raises(ArmblocksError, match="parameter set 'stiff'"):
        ab.with_parameter_set(draft, "stiff")


@pytest.mark.parametrize(
    ("sets", "what"),
    [
        ([], "an array of 0"),
        ({"a": 1}, "the number 1"),
        ({" ": {}}, "empty name"),
        ({"x" * 201: {}}, "has 201 characters"),
        ({"a\u202eb": {}}, "contains '\\u202e'"),
        ({"Soft": {}, "soft": {}}, "already named 'Soft'"),
        ({str(k): {} for k in range(1001)}, "1000 parameter sets"),
        ({"a": {f"p{k}": 1 for k in range(1001)}}, "1001 parameters"),
        ({"a": {"limit.upper": {"b": 1}}}, "the value is"),
        ({"a": {"limit.upper": None}}, "the value is"),
    ],
)
@pytest.mark.parametrize("draft", [False, True])
def test_malformed_sets_of_a_file_are_refused(sets: Any, what: str, draft: bool) -> None:
    content = {**document(model({}).build()), "parameter_sets": sets}
    with pytest.raises((FormatError, DiagramError, UnknownNameError)) as caught:
        read(content, draft=draft)
    assert what in str(caught.value)
    assert "servo.json:" in caught.value.where


@pytest.mark.parametrize(("name", "fix"), [("x" * 201, "shorten it"), ("a\0", "rename it")])
def test_the_message_about_a_name_of_a_set_has_a_remedy(name: str, fix: str) -> None:
    with pytest.raises(DiagramError) as caught:
        model({}).parameter_set(name, {})
    assert caught.value.fix == fix
    assert "1 to 200 characters, other than those of another set" in caught.value.allowed


def test_unknown_sets_are_refused_with_the_nearest_name() -> None:
    with pytest.raises(UnknownNameError, match="stiff"):
        ab.with_parameter_set(model(SETS).build(), "stif")


def test_differences_list_changed_values_of_sets() -> None:
    before, after = model(SETS).build(), model({"soft": {"scale": 0.25}, "stiff": SETS["stiff"]}).build()
    changes = {(c.name, c.before, c.after) for c in diagram_difference(before, after).parameter_sets}
    assert changes == {
        ("soft: controller/gain 2.gain", (1.0, 2.0), None),
        ("soft: scale", 0.5, 0.25),
        ("unbounded: limit.upper", math.inf, None),
    }


def test_the_command_line_runs_with_a_set(tmp_path: Path, invoke: Invoke) -> None:
    path = ab.save_diagram(model(SETS).build(), tmp_path / "servo.json")

    def last_value(*options: str) -> float:
        log = tmp_path / "log.csv"
        log.unlink(missing_ok=True)
        common = ("--stop-time", "0.1", "--no-figures", "--out", str(tmp_path / "report"), "--log", str(log))
        done = invoke("run", str(path), *common, *options)
        assert done.exit_code == 0, done.output
        header, *rows = log.read_text().splitlines()
        column = next(k for k, name in enumerate(header.split(",")) if name.startswith("scaled"))
        return float(rows[-1].split(",")[column])

    assert last_value() == 4.0
    assert last_value("--parameter-set", "stiff") == 10.0
    assert last_value("--parameter-set", "stiff", "--set", "limit.upper=4.5") == 9.0


def test_an_unknown_set_ends_a_command(tmp_path: Path, invoke: Invoke) -> None:
    path = ab.save_diagram(model(SETS).build(), tmp_path / "servo.json")
    for command in ("run", "linearize", "trim"):
        done = invoke(command, str(path), "--parameter-set", "stif")
        assert done.exit_code == 2
        assert "did you mean 'stiff'?" in " ".join(done.output.split())
    assert "parameter set stiff" in " ".join(invoke("show", str(path)).output.split())
