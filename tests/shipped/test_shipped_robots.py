"""The shipped robots: complete, canonical, and equal to their published data."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from armblocks import formats
from armblocks.formats import list_robots, load_robot, read_robot, write_robot
from armblocks.formats.canonical_json import canonical_bytes
from armblocks.formats.robot_json import is_one_line, robot_to_json
from armblocks.formats.shipped import shipped_folder
from armblocks.robot import Robot, inertia_findings
from robots_for_tests import evaluate

FOLDER = shipped_folder("robots")
SCHEMA = Path(formats.__file__).parent / "schema" / "robot.schema.json"


@pytest.fixture(params=list_robots())
def shipped_robot(request: pytest.FixtureRequest) -> Robot:
    return load_robot(request.param)


def test_the_documented_robots_are_shipped() -> None:
    assert {"kr180", "puma560", "twolink", "planar3r"} <= set(list_robots())


def test_robot_files_are_canonical_and_follow_the_schema(shipped_robot: Robot) -> None:
    text = (FOLDER / shipped_robot.source / "robot.json").read_text(encoding="utf-8")
    document = json.loads(text)
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text())).validate(document)
    kept = {key: document[key] for key in ("facts", "notes") if key in document}
    assert len(kept["notes"]) > 80, "the notes state the source of the data"
    expected = canonical_bytes(
        {**robot_to_json(shipped_robot), **kept},
        one_line=is_one_line,
    )
    assert text == expected.decode()
    assert load_robot(shipped_robot.source) == read_robot(write_robot(shipped_robot), "robot.json")


def test_a_robot_that_is_loaded_again_is_equal(shipped_robot: Robot) -> None:
    assert load_robot(shipped_robot.source) == shipped_robot
    assert hash(replace(shipped_robot, comment=shipped_robot.comment)) == hash(shipped_robot)


def test_puma560_has_the_parameters_of_corke(puma560: Robot) -> None:
    """Comparison with the same numbers written in Python."""
    assert replace(load_robot("puma560"), name="puma560", configurations=puma560.configurations) == puma560


def test_links_with_impossible_published_inertias_are_found() -> None:
    findings = {name: inertia_findings(load_robot(name)) for name in list_robots()}
    links = {name: [finding.link for finding in found] for name, found in findings.items() if found}
    assert links == {
        "kr180": ["link1", "link3"],
        "kr180_cell": ["link1", "link3"],
        "puma560": ["link1", "link3"],
        "puma560_akb": ["link1"],
    }


def test_twolink_hangs_in_the_vertical_plane() -> None:
    """Static torques of the horizontal arm: 9.81 (0.5 + 1.5) N m (shoulder), 9.81 0.5 N m (elbow)."""
    arm = load_robot("twolink")
    np.testing.assert_allclose(evaluate(arm, "gravload", np.zeros(2)), [19.62, 4.905], rtol=1e-14)
    tip = evaluate(arm, "fkine", np.array([np.pi / 2, 0.0]))[:3, 3]
    np.testing.assert_allclose(tip, [0, 0, 2], atol=1e-15)
    # Two uniform rods: M11 = 5/3 m l^2 + m l^2 cos q2, M22 = m l^2 / 3 (Siciliano, example 7.2).
    M = evaluate(arm, "inertia", np.array([0.3, np.pi / 3]))
    np.testing.assert_allclose(M, [[5 / 3 + 0.5, 1 / 3 + 0.25], [1 / 3 + 0.25, 1 / 3]], rtol=1e-14)


def test_planar3r_has_no_gravity_torques() -> None:
    arm = load_robot("planar3r")
    np.testing.assert_allclose(evaluate(arm, "gravload", np.array([0.1, 0.2, 0.3])), 0, atol=1e-15)
    tip = evaluate(arm, "fkine", np.array([0.0, np.pi / 2, -np.pi / 2]))[:3, 3]
    np.testing.assert_allclose(tip, [0.8, 0.4, 0], atol=1e-15)
