"""Constraints in robot.json: every type is read as it was written, and agrees with the schema."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest

from armblocks import formats
from armblocks.errors import FormatError
from armblocks.formats.robot_json import read_robot, write_robot
from armblocks.robot import CONSTRAINT_TYPES, Coupling, PrescribedMotion, Robot
from mechanisms_for_tests import CLOSURES, four_bar, random_mechanism

SCHEMA = json.loads((Path(formats.__file__).parent / "schema" / "robot.schema.json").read_bytes())


def robots() -> list[Robot]:
    coupling = Coupling(name="gear", terms=(("rocker", 2.0), ("crank", -1.0)), constant=0.25)
    loop, drive = four_bar(), PrescribedMotion(name="drive", joint="crank")
    return [
        replace(loop, constraints=(*loop.constraints, coupling, drive)),
        *(random_mechanism(seed)[0] for seed in range(len(CLOSURES))),
    ]


def test_reading_inverts_writing_for_every_type() -> None:
    written: set[type] = set()
    for robot in robots():
        data = write_robot(robot)
        jsonschema.validate(json.loads(data), SCHEMA)
        assert read_robot(data, "robot.json") == robot
        written |= {type(constraint) for constraint in robot.constraints}
    assert written == set(CONSTRAINT_TYPES)


@pytest.mark.parametrize(
    ("constraint", "message"),
    [
        ('{"type": "rod", "name": "r", "first": {"link": null}, "second": {"link": "crank"}}', "no length"),
        ('{"type": "rodd", "name": "r"}', "did you mean 'rod'"),
        (
            '{"type": "point_on_line", "name": "r", "first": {"link": null}, "second": {"link": "crnk"}}',
            "did you mean 'crank'",
        ),
        (
            '{"type": "coupling", "name": "r", "terms": [], "length": 2}',
            "key 'length' is not known",
        ),
        (
            '{"type": "coupling", "name": "r", "terms": [{"joint": "crank", "coefficient": 0}]}',
            "a coefficient is 0",
        ),
        (
            '{"type": "rod", "name": "r", "length": -1, '
            '"first": {"link": null}, "second": {"link": "crank"}}',
            "the length of the rod is -1 m",
        ),
    ],
)
def test_faults_have_file_and_place(constraint: str, message: str) -> None:
    text = write_robot(four_bar()).decode().replace('"constraints": [', f'"constraints": [{constraint}, ')
    with pytest.raises(FormatError, match=message) as failure:
        read_robot(text.encode(), "robot.json")
    assert "robot.json:" in str(failure.value)
