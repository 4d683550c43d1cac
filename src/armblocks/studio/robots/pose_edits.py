"""Edits of the recorded poses of a robot, which are its named configurations. Each is a pure function."""

from __future__ import annotations

from dataclasses import replace

from armblocks.errors import InputError, UnknownNameError
from armblocks.robot import Configuration, Configurations, Robot
from armblocks.studio.documents.edit_table import EditTable
from armblocks.studio.protocol.messages.pose_edits import (
    MovePose,
    RecordPose,
    RemovePose,
    RenamePose,
    UpdatePose,
)

POSE_EDITS: EditTable[Robot, []] = EditTable()


@POSE_EDITS.on(RecordPose, lambda edit: f"record {edit.name or 'a pose'}")
def _record(edit: RecordPose, robot: Robot) -> Robot:
    """Append the pose, or insert it after another pose."""
    poses = list(robot.configurations.entries)
    place = _index(robot, edit.after) + 1 if edit.after else len(poses)
    name = edit.name.strip() or _free_name(robot)
    poses.insert(place, Configuration(name, tuple(edit.q)))
    return _with_poses(robot, poses)


@POSE_EDITS.on(UpdatePose, lambda edit: f"update {edit.name}")
def _update(edit: UpdatePose, robot: Robot) -> Robot:
    poses = list(robot.configurations.entries)
    place = _index(robot, edit.name)
    poses[place] = Configuration(edit.name, tuple(edit.q))
    return _with_poses(robot, poses)


@POSE_EDITS.on(RenamePose, lambda edit: f"name of {edit.name}")
def _rename(edit: RenamePose, robot: Robot) -> Robot:
    poses = list(robot.configurations.entries)
    place = _index(robot, edit.name)
    poses[place] = Configuration(edit.to.strip(), poses[place].q)
    return _with_poses(robot, poses)


@POSE_EDITS.on(MovePose, lambda edit: f"move {edit.name}")
def _move(edit: MovePose, robot: Robot) -> Robot:
    poses = list(robot.configurations.entries)
    place = _index(robot, edit.name)
    if not 0 <= place + edit.by < len(poses):
        raise InputError(
            "there is no pose on that side",
            where=f"pose '{edit.name}'",
            allowed="the other direction",
            fix="move it the other way",
        )
    poses.insert(place + edit.by, poses.pop(place))
    return _with_poses(robot, poses)


@POSE_EDITS.on(RemovePose, lambda edit: f"remove {edit.name}")
def _remove(edit: RemovePose, robot: Robot) -> Robot:
    place = _index(robot, edit.name)
    poses = robot.configurations.entries
    return _with_poses(robot, [*poses[:place], *poses[place + 1 :]])


def _with_poses(robot: Robot, poses: list[Configuration]) -> Robot:
    return replace(robot, configurations=Configurations(poses, where=f"robot '{robot.name}'"))


def _index(robot: Robot, name: str) -> int:
    names = list(robot.configurations)
    if name not in names:
        raise UnknownNameError("pose", name, names, where=f"robot '{robot.name}'")
    return names.index(name)


def _free_name(robot: Robot) -> str:
    """The first of the names P1, P2 … that is not in use."""
    used = set(robot.configurations)
    return next(name for k in range(1, len(used) + 2) if (name := f"P{k}") not in used)
