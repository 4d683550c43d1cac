"""Teaching of arms: the dragged tool, recorded poses with undo and files, motions and their limits."""

from __future__ import annotations

import asyncio
import base64
import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from pydantic import ValidationError
from test_robot_documents import Client, run_scenario

import armblocks as ab
from armblocks.errors import ArmblocksError, InputError, RobotError, UnknownNameError
from armblocks.formats import load_robot
from armblocks.robot import Configuration, Robot
from armblocks.robot.configurations import MAX_CONFIGURATIONS
from armblocks.spatial import Transform, trotx, trotz
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.messages import pose_edits
from armblocks.studio.protocol.messages.documents import Change
from armblocks.studio.protocol.messages.robot_edits import (
    AddJoint,
    MoveJoint,
    RemoveJoint,
    RenameLink,
    SetCell,
)
from armblocks.studio.protocol.messages.teaching import AskMotion
from armblocks.studio.robots.document import RobotDocument
from armblocks.studio.robots.motions import plan, planned_motion, workspace
from armblocks.studio.robots.open_robots import OpenRobot
from armblocks.studio.robots.pose_edits import POSE_EDITS
from armblocks.studio.robots.reaching import FARTHEST, followed_directions, reached
from armblocks.studio.robots.robot_kind import RobotKind

Q = [0.1, 1.0, -2.9, 0.2, 0.8, 0.1]
KIND = RobotKind(ProjectFolder("."))


@pytest.fixture(scope="module")
def puma() -> ab.Arm:
    return ab.load_robot("puma560")


@pytest.fixture(scope="module")
def kuka() -> ab.Arm:
    """An arm with limits of speed and torque."""
    return ab.load_robot("panda")


def taught(arm: ab.Arm, *rows: Any) -> tuple[Configuration, ...]:
    return tuple(Configuration(f"P{k}", tuple(map(float, q))) for k, q in enumerate(rows, start=1))


# -- the dragged tool ----------------------------------------------------------------------------------------


def test_the_tool_reaches_poses_near_by_without_a_change_of_configuration(puma: ab.Arm) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = np.array(Q) + rng.uniform(-0.2, 0.2, 6)
        goal = Transform.from_matrix(puma.fkine(q)) @ trotx(0.1 * rng.standard_normal())
        target = goal.matrix
        target[:3, 3] += rng.uniform(-0.03, 0.03, 3)
        found = reached(puma, q.tolist(), target.ravel().tolist())
        assert (found.reached, found.why, found.missing) == (True, "", [])
        assert_allclose(puma.fkine(found.q), target, atol=1e-7)
        assert_allclose(np.reshape(found.tool, (4, 4)), target, atol=1e-7)
        assert_allclose(found.poses, puma.link_poses(found.q), atol=1e-12)
        assert np.abs(found.q - q).max() < 0.9


def test_a_large_motion_equals_the_sum_of_small_ones(puma: ab.Arm) -> None:
    start, goal = puma.fkine(Q), puma.fkine(Q)
    goal[:3, 3] += (-0.15, 0.2, -0.1)
    at_once = reached(puma, Q, goal.ravel().tolist())
    q = Q
    for s in np.linspace(0.0, 1.0, 40)[1:]:
        T = start.copy()
        T[:3, 3] += s * (goal[:3, 3] - start[:3, 3])
        q = reached(puma, q, T.ravel().tolist()).q
    assert at_once.reached
    assert_allclose(at_once.q, q, atol=1e-6)


def test_out_of_reach_the_tool_stops_at_the_nearest_pose_and_says_why(puma: ab.Arm) -> None:
    target = puma.fkine(Q)
    target[0, 3] += 3.0
    found = reached(puma, Q, target.ravel().tolist())
    assert not found.reached
    assert "out of reach" in found.why
    assert found.tool[3] > puma.fkine(Q)[0, 3] + 0.05
    low, high = puma.robot.qlim.T
    assert ((found.q >= low - 1e-12) & (found.q <= high + 1e-12)).all()


def test_a_joint_stops_at_its_limit() -> None:
    arm = ab.load_robot("kr5_scara_r350")
    q = [0.3, 0.5, 0.0, 0.0]
    target = arm.fkine(q)
    rail = arm.robot.qlim[2]
    q[2] = float(np.mean(rail))
    target = arm.fkine(q)
    target[2, 3] += 2.0
    found = reached(arm, q, target.ravel().tolist())
    assert not found.reached
    assert arm.robot.positions[2].name in found.at_limit
    assert found.missing == ["turn about x", "turn about y"]


def test_arms_follow_the_directions_that_their_joints_have() -> None:
    masks = {name: followed_directions(ab.load_robot(name)).mask for name in ("irb460", "twolink", "iiwa7")}
    assert masks["irb460"] == (1, 1, 1, 0, 0, 1)
    assert sum(masks["twolink"]) == 2
    assert masks["iiwa7"] == (1, 1, 1, 1, 1, 1)
    arm = ab.load_robot("irb460")
    q = arm.robot.neutral.tolist()
    T = arm.fkine(q)
    goal = T.copy()
    goal[:3, 3] += (-0.1, 0.1, 0.1)
    found = reached(arm, q, goal.ravel().tolist())
    assert found.reached
    assert_allclose(np.reshape(found.tool, (4, 4))[:3, 3], goal[:3, 3], atol=1e-7)
    assert_allclose(np.reshape(found.tool, (4, 4))[2, :3], T[2, :3], atol=1e-7)  # the tool stays level
    turned = (Transform.from_matrix(T) @ trotz(0.2)).matrix
    assert reached(arm, q, turned.ravel().tolist()).reached


def translation(*position: float) -> list[float]:
    T = np.eye(4)
    T[:3, 3] = position
    return T.ravel().tolist()


def test_a_far_target_is_approached(puma: ab.Arm) -> None:
    target = puma.fkine(Q)
    target[0, 3] = FARTHEST
    assert "out of reach" in reached(puma, Q, target.ravel().tolist()).why


@pytest.mark.parametrize(
    ("q", "target", "words"),
    [
        ([0.0], [0.0] * 16, r"q has 1 number\."),
        (Q, [0.0] * 3, "the target of the tool has 3 numbers"),
        (Q, translation(0.0, 1e308, 0.0), r"the target of the tool is 1e\+308 m from the origin"),
        (Q, translation(-1e200, 0.0, 0.0), r"the target of the tool is 1e\+200 m from the origin"),
    ],
)
def test_wrong_numbers_are_refused(puma: ab.Arm, q: list[float], target: list[float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        reached(puma, q, target)


# -- poses ---------------------------------------------------------------------------------------------------


def change(document: RobotDocument, edit: Any) -> None:
    document.perform(Change(document="d", edit=edit))


def bare(robot: Robot, **configurations: Any) -> Robot:
    """A robot with these configurations instead of its own."""
    return replace(robot, configurations=configurations)


def names(document: RobotDocument) -> list[str]:
    return list(document.value.configurations)


def test_poses_are_recorded_named_moved_updated_removed_and_undone() -> None:
    document = RobotDocument(bare(load_robot("puma560")))
    for k in range(3):
        change(document, pose_edits.RecordPose(q=[0.1 * k] * 6))
    change(document, pose_edits.RenamePose(name="P2", to=" above "))
    change(document, pose_edits.RecordPose(q=[1.0] * 6, after="P1"))
    assert names(document) == ["P1", "P2", "above", "P3"]
    change(document, pose_edits.MovePose(name="P3", by=-3))
    change(document, pose_edits.UpdatePose(name="above", q=[2.0] * 6))
    change(document, pose_edits.RemovePose(name="P1"))
    assert names(document) == ["P3", "P2", "above"]
    assert document.value.configurations.entries[2].q == (2.0,) * 6
    assert document.undo_title == "remove P1"
    files: list[str] = []
    while document.undo_title:
        files.append(KIND.to_text(document.value))
        document.undo()
    assert names(document) == []
    for file in reversed(files):
        document.redo()
        assert KIND.to_text(document.value) == file
        assert KIND.from_text(file, "here") == document.value


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (
            pose_edits.RecordPose(q=[0.0]),
            "configuration 'P2': the configuration has 1 coordinate. Allowed: 6",
        ),
        (pose_edits.RecordPose(q=[0.0] * 6, name="P1"), "two configurations are named 'P1'"),
        (pose_edits.RenamePose(name="P1", to=" "), "'' is not a name of a configuration"),
        (pose_edits.MovePose(name="P1", by=1), "there is no pose on that side"),
        (pose_edits.RemovePose(name="P9"), "there is no pose named 'P9'"),
    ],
)
def test_edits_that_give_invalid_poses_are_refused(edit: Any, words: str) -> None:
    value = bare(load_robot("puma560"), P1=(0.0,) * 6)
    with pytest.raises((InputError, RobotError, UnknownNameError), match=words):
        POSE_EDITS.applied(edit, value)


def test_a_robot_has_at_most_1000_configurations() -> None:
    many = bare(load_robot("puma560"), **{str(k): (0.0,) * 6 for k in range(MAX_CONFIGURATIONS)})
    with pytest.raises(RobotError, match="there are 1001 named configurations"):
        POSE_EDITS.applied(pose_edits.RecordPose(q=[0.0] * 6), many)


def test_poses_follow_the_joints_of_an_edited_robot() -> None:
    robot = bare(load_robot("puma560"), P1=(1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    first = robot.joint_names[0]
    expected: list[tuple[Any, tuple[float, ...]]] = [
        (AddJoint(after=first), (1.0, 0.0, 2.0, 3.0, 4.0, 5.0, 6.0)),
        (RemoveJoint(link=robot.joint_names[1]), (1.0, 3.0, 4.0, 5.0, 6.0)),
        (MoveJoint(link=first, by=1), (2.0, 1.0, 3.0, 4.0, 5.0, 6.0)),
        (RenameLink(link=first, name="waist"), (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)),
        (
            SetCell(link=first, column="joint", text="prismatic", angles="rad"),
            (0.0, 2.0, 3.0, 4.0, 5.0, 6.0),
        ),
    ]
    for edit, q in expected:
        document = RobotDocument(robot)
        change(document, edit)
        assert document.value.configurations.entries == (("P1", q),)
        assert KIND.from_text(KIND.to_text(document.value), "here") == document.value
        document.undo()
        assert document.value == robot


# -- motions -------------------------------------------------------------------------------------------------


def line_poses(arm: ab.Arm, q: Any) -> tuple[Configuration, ...]:
    rows = [list(q)]
    for shift in ((-0.05, 0.1, 0.0), (-0.08, 0.0, 0.08), (0.0, -0.1, -0.08)):
        target = arm.fkine(rows[-1])
        target[:3, 3] += shift
        found = reached(arm, rows[-1], target.ravel().tolist())
        assert found.reached
        rows.append(found.q)
    return taught(arm, *rows)


@pytest.mark.parametrize("course", ["joint", "line", "spline"])
@pytest.mark.parametrize("duration", [None, 6.0])
def test_motions_pass_the_poses_from_rest_to_rest(kuka: ab.Arm, course: Any, duration: float | None) -> None:
    poses = line_poses(kuka, [0.0, 0.2, 0.0, -1.8, 0.0, 2.0, 0.7])
    made = plan(kuka, poses, course, duration)
    motion = made.trajectory
    assert len(made.via) == 4
    assert all(first < second for first, second in itertools.pairwise(made.via))
    for time, pose in zip(made.via, poses):
        assert_allclose(motion(time).q, pose.q, atol=2e-3 if course == "spline" else 1e-9)
    assert_allclose([motion(0.0).qd, motion(motion.duration).qd], 0.0, atol=1e-9)
    if duration is not None:
        assert motion.duration == pytest.approx(duration)
    if course != "spline":
        assert_allclose([motion(time).qd for time in made.via], 0.0, atol=1e-9)
    if course == "line":
        for k, (first, second) in enumerate(itertools.pairwise(poses)):
            times = np.linspace(made.via[k], made.via[k + 1], 200)
            points = kuka.fkine(motion(times).q)[:, :3, 3]
            a, b = kuka.fkine(first.q)[:3, 3], kuka.fkine(second.q)[:3, 3]
            along = (points - a) @ (b - a) / ((b - a) @ (b - a))
            assert np.linalg.norm(points - a - along[:, None] * (b - a), axis=1).max() < 2e-5
    shown = planned_motion(kuka, made)
    if duration is None:
        shares = [
            max(p.speed / (p.speed_limit or np.inf), p.torque / (p.torque_limit or np.inf))
            for p in shown.peaks
        ]
        assert 0.9 < max(shares) < 1.03
    frames = np.frombuffer(base64.b64decode(shown.poses), "<f4").reshape(len(shown.time), shown.rows, 3, 4)
    assert_allclose(frames[-1], kuka.link_poses(poses[-1].q)[:, :3], atol=1e-5)
    assert shown.time[-1] == pytest.approx(motion.duration)


@pytest.mark.parametrize("duration", [None, 2.0])
def test_a_spline_passes_repeated_poses_in_their_order(kuka: ab.Arm, duration: float | None) -> None:
    a = np.array([0.0, 0.2, 0.0, -1.8, 0.0, 2.0, 0.7])
    b = a + np.array([0.3, 0.1, 0.2, 0.1, 0.2, 0.1, 0.1])
    c = a + np.array([0.6, -0.1, 0.2, 0.3, 0.2, 0.1, -0.4])
    for rows in ([a, b, a, b, a], [a, b, c, b, c, b, a]):
        made = plan(kuka, taught(kuka, *rows), "spline", duration)
        assert (np.diff(made.via) > 0.01).all()
        assert made.via[-1] == pytest.approx(made.trajectory.duration)
        assert_allclose([made.trajectory(time).q for time in made.via], rows, atol=2e-3)


def test_a_motion_that_is_too_fast_names_the_exceeded_limits(kuka: ab.Arm) -> None:
    poses = taught(kuka, [0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0], [1.5, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])
    shown = planned_motion(kuka, plan(kuka, poses, "joint", 0.3))
    assert any("speed" in text and "% of its limit" in text for text in shown.exceeded)
    assert shown.peaks[0].speed > (shown.peaks[0].speed_limit or np.inf)


def test_the_poses_of_a_redundant_arm_are_joined_by_a_line_with_motion_of_the_elbow(kuka: ab.Arm) -> None:
    start = np.array([0.0, 0.2, 0.1, -1.8, 0.0, 2.0, 0.7])
    null = np.linalg.svd(kuka.jacob0(start))[2][-1]
    goal = start + 0.15 * null
    poses = taught(kuka, start, kuka.ikine(kuka.fkine(start), q0=goal).q)
    assert np.abs(np.subtract(poses[0].q, poses[1].q)).max() > 0.02
    motion = plan(kuka, poses, "line", 2.0).trajectory
    assert_allclose(motion(2.0).q, poses[1].q, atol=1e-9)


def test_motions_that_are_impossible_are_refused_with_the_reason(puma: ab.Arm) -> None:
    flipped = [Q[0], Q[1], Q[2], Q[3] + np.pi, -Q[4], Q[5] - np.pi]
    cases: list[tuple[Any, Any, Any, str]] = [
        ([Q], "joint", 1.0, "1 pose is recorded"),
        ([Q, Q], "joint", 1.0, "the poses 'P1' and 'P2' are the same"),
        ([Q, np.add(Q, 1e-16)], "joint", 1.0, "the poses 'P1' and 'P2' are the same"),
        ([Q, flipped], "line", 1.0, "the straight line from 'P1' to 'P2' ends at .*configuration"),
        ([Q, [0.0] * 6], "spline", None, "the robot has no limits of speed or torque"),
    ]
    for rows, course, duration, words in cases:
        with pytest.raises(InputError, match=words):
            plan(puma, taught(puma, *rows), course, duration)


@pytest.mark.parametrize("duration", [0.0, 1e-200, 9e-4, 3601.0, float("nan")])
def test_durations_that_are_too_short_or_too_long_are_refused(duration: float) -> None:
    with pytest.raises(ValidationError, match="duration"):
        AskMotion(document="d", course="joint", duration=duration)


def test_the_workspace_has_positions_that_the_arm_reaches(puma: ab.Arm) -> None:
    points = np.frombuffer(base64.b64decode(workspace(puma)), "<f4").reshape(-1, 3)
    assert len(points) > 1000
    targets = np.tile(np.eye(4), (50, 1, 1))
    targets[:, :3, 3] = points[:50]
    assert np.all(puma.ikine(targets, mask=[1, 1, 1, 0, 0, 0], tolerance=1e-6).success)


# -- the studio ----------------------------------------------------------------------------------------------


def test_poses_are_taught_and_the_motion_is_saved_and_inserted(tmp_path: Path) -> None:
    async def scenario(client: Client) -> None:
        key = await client.ask("open_shipped", document_kind="robot", name="puma560")
        target = ab.load_robot("puma560").fkine(Q)
        target[2, 3] += 0.02
        found = await client.ask("reach", document=key, q=Q, target=target.ravel().tolist())
        assert found["reached"]
        for q in (Q, found["q"]):
            await client.ask("change", document=key, key=str(q), edit={"kind": "record_pose", "q": q})
        shown = client.shown()
        assert [pose["name"] for pose in shown["poses"]] == ["qz", "qr", "qs", "qn", "P1", "P2"]
        assert shown["undo"] == "record a pose"
        choice = {"document": key, "poses": ["P2", "P1"], "course": "line", "duration": 2.0}
        refused = await client.refused("motion", **{**choice, "poses": ["P1", "P3"]})
        assert "there is no recorded pose named 'P3'" in refused
        motion = await client.ask("motion", **choice)
        assert motion["via"] == [0.0, 2.0]
        rows = await client.ask("motion_rows", **choice)
        assert await client.ask("save_motion", **choice, path="up.csv") == "up.csv"
        assert "the file 'up.csv' exists" in await client.refused("save_motion", **choice, path="up.csv")
        await client.ask("save_motion", **choice, path="up.csv", overwrite=True)
        assert "outside of the project" in await client.refused("save_motion", **choice, path="../up.csv")
        saved = ab.load_trajectory(tmp_path / "up.csv")
        assert_allclose(saved(2.0).q, found["q"], atol=1e-12)
        assert await client.ask("workspace", document=key)
        diagram = await client.ask("new", document_kind="diagram")
        block = {
            "name": "motion",
            "type": "Trajectory",
            "place": {"x": 0, "y": 0},
            "parameters": {"data": rows},
        }
        await client.ask("change", document=diagram, key="b", edit={"kind": "add", "blocks": [block]})
        await client.ask("undo", document=diagram, key="u")
        with pytest.raises(ArmblocksError):
            client.hub.documents[diagram].document.value.block("motion")
        await client.ask("save", document=key, path="taught.json")

    run_scenario(tmp_path, scenario)
    again = KIND.from_file((tmp_path / "taught.json").read_bytes(), tmp_path / "taught.json")
    assert list(again.configurations) == ["qz", "qr", "qs", "qn", "P1", "P2"]


def test_a_motion_that_waits_for_another_request_is_that_of_the_present_robot(tmp_path: Path) -> None:
    async def scenario(client: Client) -> None:
        key = await client.ask("open_shipped", document_kind="robot", name="puma560")
        for q in (Q, [0.5] * 6):
            await client.ask("change", document=key, key=str(q), edit={"kind": "record_pose", "q": q})
        open_file = client.hub.documents[key]
        assert isinstance(open_file, OpenRobot)
        async with open_file.reading:
            waiting = asyncio.create_task(client.ask("motion", document=key, course="joint", duration=1.0))
            for _ in range(5):
                await asyncio.sleep(0)
            await client.ask("change", document=key, key="add", edit={"kind": "add_joint", "after": "link1"})
        motion = await waiting
        assert motion["q"][-1] == pytest.approx([0.5, 0.0, *[0.5] * 5])

    run_scenario(tmp_path, scenario)
