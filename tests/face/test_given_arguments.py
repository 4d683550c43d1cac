"""Arguments that are a diagram, compiled or not, its name or path; or an arm, a robot, its name or path."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import ArmblocksError

MODEL, ROBOT = "bouncing_ball", "twolink"
Q = np.array([0.3, 0.8])

DIAGRAM_FUNCTIONS: dict[str, Callable[[Any, ab.SimulationResult, Path], object]] = {
    "draw_diagram": lambda diagram, result, folder: ab.draw_diagram(diagram, folder / "a.svg").read_bytes(),
    "write_report": lambda diagram, result, folder: ab.write_report(folder, diagram, result).page.name,
    "write_files": lambda diagram, result, folder: ab.write_files(folder, diagram, result),
    "run_widget": lambda diagram, result, folder: ab.run_widget(diagram, result).title,
    "save_diagram": lambda diagram, result, folder: ab.save_diagram(diagram, folder / "b.json").read_bytes(),
    "to_python": lambda diagram, result, folder: ab.to_python(diagram),
}
COMPILED = ("draw_diagram", "write_report", "write_files", "run_widget")
ARM_FUNCTIONS: dict[str, Callable[[Any], object]] = {
    "workspace": lambda arm: repr(ab.workspace(arm, 100)),
    "payload_capacity": lambda arm: ab.payload_capacity(arm, Q, torque=[100.0, 100.0]),
    "collisions": lambda arm: repr(ab.collisions(arm, Q)),
    "dexterity": lambda arm: ab.dexterity(arm, [0.3, 0.1, 0.1], 3, restarts=1),
    "Arm": lambda arm: ab.Arm(arm).fkine(Q),
}


@pytest.mark.parametrize("name", DIAGRAM_FUNCTIONS)
def test_a_diagram_is_given_by_name_by_path_or_compiled(name: str, tmp_path: Path) -> None:
    call = DIAGRAM_FUNCTIONS[name]
    diagram = ab.load_diagram(MODEL)
    result = ab.simulate(diagram, stop_time=0.1)
    expected = call(diagram, result, tmp_path)
    path = ab.save_diagram(diagram, tmp_path / "model.json")
    given = [MODEL, path, str(path), *([ab.compile_diagram(diagram)] if name in COMPILED else [])]
    assert all(call(value, result, tmp_path) == expected for value in given)
    with pytest.raises(ArmblocksError, match=rf"{name}: a value of type .*Allowed: a Diagram"):
        call(7, result, tmp_path)


@pytest.mark.parametrize("name", ARM_FUNCTIONS)
def test_an_arm_is_given_as_a_robot_by_name_or_by_path(name: str, tmp_path: Path) -> None:
    call = ARM_FUNCTIONS[name]
    arm = ab.load_robot(ROBOT)
    path = ab.save_robot(ROBOT, tmp_path / "arm.json")
    given: list[Any] = [arm.robot] if name == "Arm" else [arm.robot, ROBOT, path]
    for value in given:
        np.testing.assert_equal(call(value), call(arm))
    with pytest.raises(ArmblocksError, match=rf"{name}: a value of type .*Allowed: a"):
        call(7)
