"""Taught poses of a robot file: named configurations, in the member ``poses`` of ``robot.json``."""

from __future__ import annotations

from dataclasses import dataclass

from armblocks.errors import FormatError, InputError, counted
from armblocks.formats.json_document import Node, closed_members, read_document

MAX_BYTES = 16 * 2**20
"""Maximum size of a robot document, bytes."""
MAX_POSES = 1000
"""Maximum number of poses in a file."""


@dataclass(frozen=True, kw_only=True)
class TaughtPose:
    """A named configuration: the coordinates ``q`` (nq,) of the robot, rad or m."""

    name: str
    q: tuple[float, ...]


def check_poses(poses: tuple[TaughtPose, ...], count: int, where: str) -> None:
    """Raise ``InputError`` for poses without ``count`` coordinates, without a name or with equal names."""
    if len(poses) > MAX_POSES:
        raise InputError(
            f"there are {len(poses)} poses",
            where=where,
            allowed=f"at most {MAX_POSES}",
            fix="remove some of them",
        )
    names: set[str] = set()
    for pose in poses:
        if len(pose.q) != count:
            raise InputError(
                f"the pose '{pose.name}' has {counted(len(pose.q), 'coordinate')}",
                where=where,
                allowed=f"{count}, one for each coordinate of the robot",
                fix="record the pose again",
            )
        if not pose.name.strip() or pose.name in names:
            raise InputError(
                f"the name '{pose.name[:40]}' of a pose is empty or used twice",
                where=where,
                allowed="a different name for each pose",
                fix="choose another name",
            )
        names.add(pose.name)


def poses_from_json(node: Node, count: int) -> tuple[TaughtPose, ...]:
    """The poses of a robot with ``count`` coordinates that a JSON array describes. Raises ``FormatError``."""
    poses: list[TaughtPose] = []
    for element in node.elements():
        members = closed_members(element, ("name", "q"), required=("name", "q"))
        q = tuple(entry.number() for entry in members["q"].elements())
        poses.append(TaughtPose(name=members["name"].text(), q=q))
    try:
        check_poses(tuple(poses), count, node.where)
    except InputError as error:
        raise FormatError(error.what, where=node.where, allowed=error.allowed, fix=error.fix) from error
    return tuple(poses)


def poses_to_json(poses: tuple[TaughtPose, ...]) -> list[dict[str, object]]:
    """The JSON array that describes poses."""
    return [{"name": pose.name, "q": [value + 0.0 for value in pose.q]} for pose in poses]


def read_poses(data: bytes, name: str, count: int) -> tuple[TaughtPose, ...]:
    """The poses of a robot document whose robot has ``count`` coordinates. Raises ``FormatError``."""
    members = read_document(data, name, MAX_BYTES).members()
    return poses_from_json(members["poses"], count) if "poses" in members else ()
