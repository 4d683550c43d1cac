"""Output and exit codes of ``armblocks diff``."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

import armblocks as ab
from armblocks.blocks import Constant
from armblocks.cli.diff import value_text
from armblocks.diagram import Diagram, Note, PortRef, with_parameters

Invoke = Callable[..., Result]


@pytest.fixture
def changed_diagram() -> Diagram:
    """The paper's diagram with another duration and stop time."""
    diagram = with_parameters(ab.load_diagram("kr180model"), {"jtraj.tmax": 5.0})
    return dataclasses.replace(diagram, settings=dataclasses.replace(diagram.settings, stop_time=5.0))


def test_equal_diagrams_give_exit_code_0(invoke: Invoke, tmp_path: Path) -> None:
    diagram = ab.load_diagram("kr180model")
    ab.save_diagram(dataclasses.replace(diagram, layout={}, name="other"), tmp_path / "copy.json")
    result = invoke("diff", "kr180model", "copy.json")
    assert result.exit_code == 0, result.output
    assert result.stdout == "kr180model and copy.json are the same except for layout\n"


def test_changes_are_lines_with_both_values_and_give_exit_code_1(
    invoke: Invoke, tmp_path: Path, changed_diagram: Diagram
) -> None:
    ab.save_diagram(changed_diagram, tmp_path / "new.json")
    result = invoke("diff", "kr180model", "new.json")
    assert result.exit_code == 1, result.output
    assert "kr180model -> new.json: 2 differences" in result.stdout
    assert "  ~ jtraj.tmax: 10 -> 5\n" in result.stdout
    assert "  ~ stop_time: 10 -> 5\n" in result.stdout


def test_the_json_output_has_the_same_changes(
    invoke: Invoke, tmp_path: Path, changed_diagram: Diagram
) -> None:
    ab.save_diagram(changed_diagram, tmp_path / "new.json")
    result = invoke("diff", "kr180model", "new.json", "--json")
    assert result.exit_code == 1
    message = json.loads(result.stdout)
    assert message["same"] is False
    assert message["parameters"] == [{"path": "jtraj", "name": "tmax", "before": 10.0, "after": 5.0}]
    assert message["settings"] == [{"path": "", "name": "stop_time", "before": 10.0, "after": 5.0}]
    assert message["added"] == message["removed"] == message["wires_added"] == []


def test_changed_logged_outputs_and_notes_are_listed(invoke: Invoke, tmp_path: Path) -> None:
    old = ab.load_diagram("van_der_pol_pid")
    notes = {"/n1": Note(x=0.0, y=0.0, text="held by a PID")}
    new = dataclasses.replace(old, logged=(PortRef("PID", "y"),), notes=notes)
    ab.save_diagram(new, tmp_path / "new.json")
    message = invoke("diff", "van_der_pol_pid", "new.json").stdout
    assert "Logged\n  + PID/y\n" in message
    assert 'Notes\n  ~ /n1: none -> "held by a PID"\n' in message
    difference = json.loads(invoke("diff", "van_der_pol_pid", "new.json", "--json").stdout)
    assert difference["logged_added"] == [{"path": "", "port": "PID/y"}]
    assert difference["notes"] == [{"path": "", "name": "/n1", "before": None, "after": "held by a PID"}]


def test_the_differences_of_unlike_diagrams_fit_into_80_columns(invoke: Invoke) -> None:
    result = invoke("diff", "kr180model", "van_der_pol_pid")
    assert result.exit_code == 1, result.output
    assert max(len(line) for line in result.stdout.splitlines()) <= 80
    assert invoke("diff", "kr180model", "van_der_pol_pid", "--json").exit_code == 1


def test_values_with_the_same_short_text_are_listed_with_their_difference(
    invoke: Invoke, tmp_path: Path
) -> None:
    robot = ab.load_robot("kr180").robot
    on_the_moon = dataclasses.replace(robot, gravity=(0.0, 0.0, -1.62))
    diagram = with_parameters(ab.load_diagram("kr180model"), {"rne.robot": on_the_moon})
    ab.save_diagram(diagram, tmp_path / "moon.json")
    result = invoke("diff", "kr180model", "moon.json")
    assert "rne.robot: Robot KR180 -> Robot KR180 (differs in gravity)" in result.stdout
    for name, last in (("a", 1.0), ("b", 2.0)):
        builder = ab.DiagramBuilder(name)
        builder.add("long", Constant(value=[1.0] * 500 + [last]))
        ab.save_diagram(builder.build(), tmp_path / f"{name}.json")
    assert "(differs in 1 of 501 entries)" in " ".join(invoke("diff", "a.json", "b.json").stdout.split())


def test_an_unknown_diagram_is_refused(refusal: Callable[..., str]) -> None:
    assert "kr180modle" in refusal("diff", "kr180model", "kr180modle")


def test_different_numbers_have_different_texts() -> None:
    assert value_text(0.1) == "0.1"
    assert value_text(0.1 + 1e-12) != value_text(0.1)
    assert value_text(((1.0, 2.0), (3.0, 4.5))) == "[1 2; 3 4.5]"
    assert (value_text(None), value_text(True), value_text("+-")) == ("none", "true", '"+-"')
