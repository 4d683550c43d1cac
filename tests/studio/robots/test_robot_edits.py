"""Editing the tables of a robot: parsing of cell texts, refused values, and undo of every edit."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter

from armblocks.errors import ArmblocksError, InputError, RobotError
from armblocks.formats import load_robot, write_robot
from armblocks.robot import FrictionModel, JointLimits, Link, Robot, standard_dh
from armblocks.studio.documents.history import History
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.message import AnyOf
from armblocks.studio.protocol.messages.robot_edits import RobotEdit
from armblocks.studio.robots.columns import ROBOT_COLUMNS, Quantity
from armblocks.studio.robots.edits import ROBOT_EDITS, angle_value
from armblocks.studio.robots.link_columns import LINK_COLUMNS
from armblocks.studio.robots.robot_kind import RobotKind
from armblocks.studio.robots.tables import robot_content, robot_tables
from robots_for_tests import LAW_NAMES

PAPER_COLUMNS = (
    *("alpha", "a", "d", "mass", "rx", "ry", "rz", "Ixx", "Iyy", "Izz"),
    *("Jm", "G", "B", "Tc+", "Tc-", "lowest", "highest", "speed"),
)
KIND = RobotKind(ProjectFolder("."))
EDIT: TypeAdapter[RobotEdit] = TypeAdapter(Annotated[RobotEdit, AnyOf()])


def edited(robot: Robot, kind: str, **values: Any) -> Robot:
    return ROBOT_EDITS.applied(EDIT.validate_python({"kind": kind, **values}), robot)


def typed(robot: Robot, link: str, column: str, text: str, angles: str = "deg") -> Robot:
    return edited(robot, "cell", link=link, column=column, text=text, angles=angles)


@pytest.mark.parametrize(
    ("text", "unit", "rad"),
    [
        ("90", "deg", math.pi / 2),
        ("pi/2", "deg", math.pi / 2),
        ("90 deg", "rad", math.pi / 2),
        ("-45°", "rad", -math.pi / 4),
        ("30 + 60", "deg", math.pi / 2),
        ("1.5", "rad", 1.5),
        ("1.5 rad", "deg", 1.5),
        ("-39", "deg", math.radians(-39)),
        ("90*deg - 1 rad", "deg", 90 * (math.pi / 180) - 1),
    ],
)
def test_angles_are_read_in_the_column_unit_or_in_their_own_unit(text: str, unit: Any, rad: float) -> None:
    assert angle_value(text, "here", unit) == rad


def test_the_tables_of_the_paper_can_be_typed_in() -> None:
    """From a new robot to the arm of the paper, cell by cell, with the texts of its script."""
    expected = load_robot("kr180")
    robot = KIND.new()
    for _ in range(2):
        robot = edited(robot, "add_joint", after=robot.links[-1].name)
    for link, text in zip(
        [link.name for link in robot.links],
        (
            "pi/2 0.35 0.75 | 0 | 0 0 0.3 | 0 0.35 0 | 200e-6 -62.6111 1.48e-3 0.395 -0.435 | -185 185 105",
            "0 0 1.25 | 150 | -0.1 -0.1 0 | 0.13 .524 .539 | 200e-6 107.815 0.817e-3 .126 -.071 | -39 90 105",
            "pi/2 1.6 0 | 100 | .1 .05 0 | .066 .086 .0125 | 200e-6 -53.7063 1.38e-3 .132 -.105 | -71 109 95",
            "0 0 2.6 | 50 | 0 0 .18 | 1.8e-3 1.3e-3 1.8e-3 | 33e-6 76.0364 71.2e-6 11.2e-3 -16.9e-3 "
            "| -270 270 300",
        ),
    ):
        for column, cell in zip(PAPER_COLUMNS, text.replace("|", " ").split(), strict=True):
            robot = typed(robot, link, column, cell)
    for column, text in (
        ("name", "KR180"),
        ("manufacturer", expected.manufacturer),
        ("comment", expected.comment),
    ):
        robot = typed(robot, "", column, text)
    assert robot == replace(expected, links=robot.links)
    for mine, expected_link in zip(robot.links, expected.links):
        assert mine == expected_link


@pytest.mark.parametrize("name", LAW_NAMES)
def test_typing_the_value_of_a_cell_changes_nothing(name: str) -> None:
    robot = load_robot(name)
    for link in robot.links:
        for column in LINK_COLUMNS.values():
            value = column.read(link)
            if column.locked(link) or (value is None and not column.optional):
                continue
            text = "" if value is None else value if isinstance(value, str) else repr(value)
            if value is None and column.name in ("Jm", "G", "B", "Tc+", "Tc-"):
                assert typed(robot, link.name, column.name, text) == robot
                continue
            assert typed(robot, link.name, column.name, text, "rad") == robot, (link.name, column.name)
    for column in ROBOT_COLUMNS.values():
        value = column.read(robot)
        again = typed(robot, "", column.name, value if isinstance(value, str) else repr(value), "rad")
        assert np.allclose(again.base.matrix, robot.base.matrix, atol=1e-15)
        assert replace(again, base=robot.base, tool=robot.tool) == robot


def test_cells_without_a_value_can_be_emptied() -> None:
    robot = load_robot("puma560")
    name = robot.links[0].name
    assert typed(robot, name, "G", "").link(name).motor is None
    assert typed(robot, name, "highest", "").link(name).joint.limits.position is None
    assert typed(robot, name, "speed", "100").link(name).joint.limits.speed == math.radians(100)
    assert typed(robot, "", "friction_model", "release-6").friction_model is FrictionModel.RELEASE_6
    assert typed(robot, "", "tool_z", "0.2").tool.translation == (0.0, 0.0, 0.2)
    assert typed(robot, "", "gravity_z", "-1.62").gravity == (0.0, 0.0, -1.62)
    without_motors = replace(robot, links=tuple(replace(link, motor=None) for link in robot.links))
    motor = typed(without_motors, name, "Jm", "2e-4").link(name).motor
    assert motor is not None
    assert (motor.inertia, motor.gear_ratio) == (2e-4, 1.0)
    alone = typed(KIND.new(), "link1", "highest", "90").link("link1")
    assert alone.joint.limits.position == (-math.pi / 2, math.pi / 2)


@pytest.mark.parametrize(
    ("link", "column", "text", "words"),
    [
        ("link1", "a", "", "the cell is empty"),
        ("link1", "a", "[1, 5]", "2 numbers were typed"),
        ("link1", "a", "import os", "'os' is not allowed here"),
        ("link1", "a", "inf", "a is inf"),
        ("link1", "theta", "1", "this cell cannot be edited"),
        ("link1", "joint", "ball", "'ball' is not a choice"),
        ("link1", "colour", "red", "there is no column 'colour'"),
        ("link1", "mass", "-1", "the mass is -1 kg"),
        ("link1", "lowest", "400", "position limits are reversed"),
        ("link1", "speed", "0", "the speed limit is 0"),
        ("link1", "G", "0", "the gear ratio is 0"),
        ("link1", "Jm", "-1", "motor inertia is -1"),
        ("link9", "a", "1", "link9"),
        ("", "gravity_x", "1e999", "'1e999' is too large"),
    ],
)
def test_invalid_values_are_refused_with_their_cell(link: str, column: str, text: str, words: str) -> None:
    robot = load_robot("puma560")
    with pytest.raises(ArmblocksError, match=words):
        typed(robot, link, column, text)


def test_joints_are_added_removed_moved_and_renamed() -> None:
    robot = load_robot("puma560")
    names = [link.name for link in robot.links]
    more = edited(robot, "add_joint", after=names[2])
    assert [link.name for link in more.links] == [*names[:3], "link7", *names[3:]]
    assert more.links[4].parent == "link7"
    assert edited(more, "remove_joint", link="link7") == robot
    first = edited(robot, "add_joint", after="")
    assert (first.links[0].parent, first.links[1].parent) == (None, "link7")
    swapped = edited(robot, "move_joint", link=names[0], by=1)
    assert [link.name for link in swapped.links[:3]] == [names[1], names[0], names[2]]
    assert edited(swapped, "move_joint", link=names[0], by=-1) == robot
    with pytest.raises(InputError, match="no link on that side"):
        edited(robot, "move_joint", link=names[0], by=-1)
    renamed = edited(robot, "rename_link", link=names[1], name=" elbow ")
    assert renamed.links[2].parent == "elbow"
    with pytest.raises(RobotError, match=f"two links are named '{names[0]}'"):
        edited(robot, "rename_link", link=names[1], name=names[0])
    with pytest.raises(RobotError, match="at least one link"):
        edited(replace(robot, links=robot.links[:1]), "remove_joint", link=names[0])
    tree = replace(robot, links=(*robot.links, standard_dh("finger", parent=names[1])))
    with pytest.raises(RobotError, match="do not form a single chain"):
        edited(tree, "move_joint", link=names[0], by=1)
    assert edited(tree, "add_joint", after="").links[1].parent is None


def test_a_joint_changed_to_prismatic_loses_its_angular_limits() -> None:
    robot = load_robot("puma560")
    name = robot.links[1].name
    prismatic_link = typed(robot, name, "joint", "prismatic").link(name)
    assert prismatic_link.joint.letter == "P"
    assert prismatic_link.joint.limits == JointLimits()
    assert typed(robot, name, "joint", "revolute") == robot


def test_dh_cells_are_locked_for_a_link_placed_by_a_transform() -> None:
    robot = replace(KIND.new(), links=(Link(name="plain"), Link(name="next", parent="plain")))
    shown = robot_content(robot)
    assert "not by a D-H row" in shown.links[0].locked["alpha"]
    assert shown.convention == ""
    assert typed(robot, "plain", "offset", "10").links[0].joint.offset == math.radians(10)


def test_non_physical_values_are_marked_at_their_cells() -> None:
    robot = load_robot("kr180")
    shown = robot_content(robot)
    marked = {finding.link: finding for finding in shown.findings}
    assert set(marked) == {"link1", "link3"}  # as printed in the paper
    assert "Izz" in marked["link1"].columns
    assert "exceeds the sum of the other two" in marked["link3"].what
    corrected = typed(typed(typed(robot, "link1", "Iyy", "0"), "link1", "mass", "1"), "link3", "Izz", "0.03")
    assert robot_content(corrected).findings == []
    with pytest.warns(UserWarning, match="friction accelerates"):
        bad = typed(robot, "link2", "Tc-", "0.1")
    findings_shown = robot_content(bad).findings
    assert [(f.link, f.columns) for f in findings_shown if "Friction" in f.what] == [("link2", ["Tc-"])]
    one_link = replace(KIND.new(), links=(standard_dh("link1", a=1.0),))
    assert "The last joint has no inertia" in robot_content(one_link).findings[0].what


def test_every_column_is_sent_to_the_page() -> None:
    tables = robot_tables()
    names = [column.name for column in (*tables.kinematics, *tables.dynamics)]
    assert names == list(LINK_COLUMNS)
    assert len(set(names)) == len(names)
    assert all(column.doc and column.quantity in {q.value for q in Quantity} for column in tables.robot)
    assert json.loads(tables.model_dump_json())["robot"][0]["name"] == "name"


CELL_TEXTS = st.sampled_from(["0", "1", "-2.5", "pi/3", "45 deg", "", "x", "1e400", "revolute", "prismatic"])
NAMES = st.sampled_from(["link1", "link2", "link3", "link4", "link5", "arm", ""])
EDITS = st.one_of(
    st.builds(
        lambda link, column, text, angles: {
            "kind": "cell",
            "link": link,
            "column": column,
            "text": text,
            "angles": angles,
        },
        NAMES,
        st.sampled_from([*LINK_COLUMNS, *ROBOT_COLUMNS]),
        CELL_TEXTS,
        st.sampled_from(["deg", "rad"]),
    ),
    st.builds(lambda name, new: {"kind": "rename_link", "link": name, "name": new}, NAMES, NAMES),
    st.builds(lambda after: {"kind": "add_joint", "after": after}, NAMES),
    st.builds(lambda link: {"kind": "remove_joint", "link": link}, NAMES),
    st.builds(
        lambda link, by: {"kind": "move_joint", "link": link, "by": by}, NAMES, st.sampled_from([-1, 1])
    ),
    st.builds(
        lambda word, keep: {"kind": "convention", "convention": word, "keep_arm": keep},
        st.sampled_from(["standard", "modified"]),
        st.booleans(),
    ),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(EDITS, max_size=12))
@pytest.mark.filterwarnings("ignore:.*friction accelerates")
def test_undoing_any_sequence_of_edits_restores_the_file(edits: list[dict[str, Any]]) -> None:
    history = History(load_robot("kr180"))
    before, files = write_robot(history.value), [write_robot(history.value)]
    for one in edits:
        edit = EDIT.validate_python(one)
        try:
            after = ROBOT_EDITS.applied(edit, history.value)
        except ArmblocksError as error:
            assert error.what and (error.allowed or error.fix)
            continue
        assert ROBOT_EDITS.title(edit)
        history.replace(ROBOT_EDITS.title(edit), after)
        files.append(write_robot(history.value))
        robot_content(history.value).model_dump_json()
    for file in files[-2::-1]:
        history.undo()
        assert write_robot(history.value) == file
    assert write_robot(history.value) == before
    assert not history.dirty or len(files) == 1
    for file in files[1:]:
        history.redo()
        assert write_robot(history.value) == file


def test_changes_of_one_gesture_are_one_undo_step() -> None:
    history = History(1)
    for value, gesture in ((2, "a"), (3, "a"), (4, "b"), (5, ""), (6, "")):
        history.replace("typing", value, gesture)
    for value in (5, 4, 3, 1):
        history.undo()
        assert history.value == value
    with pytest.raises(InputError, match="nothing to undo"):
        history.undo()
    history.redo()
    assert (history.value, history.version) == (3, 10)
    history.replace("typing", 7, "a")  # after a redo a new step begins, even for the same gesture
    history.undo()
    assert history.value == 3


def test_the_tables_show_plausibility_warnings() -> None:
    upward = replace(load_robot("planar3r"), gravity=(0.0, 0.0, 9.81))
    (finding,) = robot_content(upward).findings
    assert finding.link == upward.name
    assert "bodies fall upwards" in finding.what
