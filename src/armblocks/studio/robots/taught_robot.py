"""A robot and its recorded poses: the value of an open robot document."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

from armblocks.formats.robot_poses import TaughtPose
from armblocks.robot import Robot


@dataclass(frozen=True, kw_only=True)
class TaughtRobot:
    """A robot and the poses that were recorded for it, in their order in the motion."""

    robot: Robot
    poses: tuple[TaughtPose, ...] = ()

    @property
    def name(self) -> str:
        """The name of the robot."""
        return self.robot.name

    def with_robot(self, robot: Robot) -> TaughtRobot:
        """The same poses for a changed robot.

        Joints keep their coordinates by name, and a renamed joint by its place. A new joint, or one of
        another type, has its neutral coordinates.
        """
        if robot is self.robot:
            return self
        poses = self.poses
        if poses and robot.positions != self.robot.positions:
            poses = tuple(replace(pose, q=_fitted(pose.q, self.robot, robot)) for pose in poses)
        return replace(self, robot=robot, poses=poses)


class _JointCoordinates(NamedTuple):
    """The coordinates of one joint, and their units."""

    q: tuple[float, ...]
    units: tuple[str, ...]


def _coordinates(robot: Robot, q: tuple[float, ...]) -> dict[str, _JointCoordinates]:
    """The coordinates of each joint, by its name."""
    parts: dict[str, _JointCoordinates] = {}
    first = 0
    for name, joint in zip(robot.joint_names, robot.joints):
        units = tuple(entry.unit for entry in joint.positions)
        parts[name] = _JointCoordinates(tuple(q[first : first + joint.nq]), units)
        first += joint.nq
    return parts


def _fitted(q: tuple[float, ...], before: Robot, after: Robot) -> tuple[float, ...]:
    old = _coordinates(before, q)
    new = _coordinates(after, tuple(float(value) for value in after.neutral))
    renamed = len(old) == len(new)
    result: list[float] = []
    for place, (name, neutral) in enumerate(new.items()):
        known = old.get(name)
        if known is None and renamed and before.joint_names[place] not in new:
            known = old[before.joint_names[place]]
        result += (known if known is not None and known.units == neutral.units else neutral).q
    return tuple(result)
