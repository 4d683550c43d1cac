"""The edits of the recorded poses of a robot; each is a pure function from one list of poses to the next."""

from __future__ import annotations

from dataclasses import replace

from armblocks.errors import InputError, UnknownNameError
from armblocks.formats.robot_poses import TaughtPose, check_poses
from armblocks.studio.documents.edit_table import EditTable
from armblocks.studio.protocol.messages.pose_edits import (
    MovePose,
    RecordPose,
    RemovePose,
    RenamePose,
    UpdatePose,
)
from armblocks.studio.robots.taught_robot import TaughtRobot

POSE_EDITS: EditTable[TaughtRobot, []] = EditTable()


@POSE_EDITS.on(RecordPose, lambda edit: f"record {edit.name or 'a pose'}")
def _record(edit: RecordPose, taught: TaughtRobot) -> TaughtRobot:
    """Append the pose, or insert it after another one."""
    poses = list(taught.poses)
    place = _index(taught, edit.after) + 1 if edit.after else len(poses)
    name = edit.name.strip() or _free_name(taught)
    poses.insert(place, TaughtPose(name=name, q=tuple(edit.q)))
    return _with_poses(taught, poses)


@POSE_EDITS.on(UpdatePose, lambda edit: f"update {edit.name}")
def _update(edit: UpdatePose, taught: TaughtRobot) -> TaughtRobot:
    poses = list(taught.poses)
    place = _index(taught, edit.name)
    poses[place] = replace(poses[place], q=tuple(edit.q))
    return _with_poses(taught, poses)


@POSE_EDITS.on(RenamePose, lambda edit: f"name of {edit.name}")
def _rename(edit: RenamePose, taught: TaughtRobot) -> TaughtRobot:
    poses = list(taught.poses)
    place = _index(taught, edit.name)
    poses[place] = replace(poses[place], name=edit.to.strip())
    return _with_poses(taught, poses)


@POSE_EDITS.on(MovePose, lambda edit: f"move {edit.name}")
def _move(edit: MovePose, taught: TaughtRobot) -> TaughtRobot:
    poses = list(taught.poses)
    place = _index(taught, edit.name)
    if not 0 <= place + edit.by < len(poses):
        raise InputError(
            "there is no pose on that side",
            where=f"pose '{edit.name}'",
            allowed="the other direction",
            fix="move it the other way",
        )
    poses.insert(place + edit.by, poses.pop(place))
    return _with_poses(taught, poses)


@POSE_EDITS.on(RemovePose, lambda edit: f"remove {edit.name}")
def _remove(edit: RemovePose, taught: TaughtRobot) -> TaughtRobot:
    place = _index(taught, edit.name)
    return _with_poses(taught, [*taught.poses[:place], *taught.poses[place + 1 :]])


def _with_poses(taught: TaughtRobot, poses: list[TaughtPose]) -> TaughtRobot:
    check_poses(tuple(poses), taught.robot.nq, f"robot '{taught.name}'")
    return replace(taught, poses=tuple(poses))


def _index(taught: TaughtRobot, name: str) -> int:
    names = [pose.name for pose in taught.poses]
    if name not in names:
        raise UnknownNameError("pose", name, names, where=f"robot '{taught.name}'")
    return names.index(name)


def _free_name(taught: TaughtRobot) -> str:
    """The first of the names P1, P2 … that is not in use."""
    used = {pose.name for pose in taught.poses}
    return next(name for k in range(1, len(used) + 2) if (name := f"P{k}") not in used)
