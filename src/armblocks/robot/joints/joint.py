"""The base class of joints."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self, cast

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import RobotError, counted
from armblocks.robot.fields import check_kind, number
from armblocks.robot.joints.limits import JointLimits
from armblocks.robot.joints.motions import AxisMotion, Coordinate, Motion
from armblocks.rounded_functions import hypot
from armblocks.spatial import Transform, Vector3, vector3


@dataclass(frozen=True, kw_only=True)
class Joint(ABC, metaclass=ArgumentErrors, methods=False):
    """A joint: a sequence of elementary motions from the parent to the link.

    Its coordinates q (nq,) are the coordinates of its motions, in order, and its speeds qd (nv,) are their
    speeds.

    ``axis``: the axis of its motion in the joint frame, a unit vector; it is normalised here, and the robot
    rejects a zero axis. ``offset`` (rad or m) is added to the coordinate. ``limits``: one value for all
    coordinates, or a sequence with one entry for each entry of qd. A type has the parameters that
    ``parameters`` lists; the others must keep their defaults. Raises RobotError.
    """

    axis: Vector3 = (0.0, 0.0, 1.0)
    offset: float = 0.0
    limits: JointLimits | tuple[JointLimits, ...] = field(default_factory=JointLimits)

    letter: ClassVar[str] = ""
    """The letter of the type, as in the toolbox's ``RRRRRR``."""
    parameters: ClassVar[tuple[str, ...]] = ("axis", "offset")
    """The parameters of the type, without the limits. Files have members of the same names."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", unit_axis(self.axis))
        object.__setattr__(self, "offset", number(self.offset, where="offset of a joint"))
        for name, default in (("axis", (0.0, 0.0, 1.0)), ("offset", 0.0)):
            if name not in self.parameters and getattr(self, name) != default:
                raise RobotError(
                    f"a {type(self).__name__} joint has no {name}",
                    where="joint",
                    allowed=", ".join(self.parameters) or "no parameters",
                    fix="put the constant rotation or translation into 'before' or 'after' of the link",
                )
        self._check_limits()

    def _check_limits(self) -> None:
        """Check the limits. A tuple of equal limits for all coordinates becomes that limit."""
        given = cast("object", self.limits)
        if not isinstance(given, JointLimits):
            entries = cast("Sequence[JointLimits]", given if isinstance(given, tuple | list) else (given,))
            for entry in entries:
                check_kind(entry, JointLimits, where="limits of a joint")
            if len(entries) != self.nv:
                raise RobotError(
                    f"{counted(len(entries), 'limit is', 'limits are')} given",
                    where="limits of a joint",
                    allowed=f"{self.nv} for a {type(self).__name__} joint, or one for all coordinates",
                    fix="give JointLimits() for unknown limits",
                )
            object.__setattr__(self, "limits", entries[0] if len(set(entries)) == 1 else tuple(entries))
        axes = [isinstance(motion, AxisMotion) for motion in self.motions for _ in motion.speeds]
        for coordinate, limits, has_axis in zip(self.speeds, self.coordinate_limits, axes):
            if limits.position is not None and not has_axis:
                raise RobotError(
                    f"coordinate {coordinate.name} of a {type(self).__name__} joint has position limits",
                    where="limits of a joint",
                    allowed="limits of speed and torque: its position is a quaternion",
                    fix="omit the position limits",
                )

    @property
    @abstractmethod
    def motions(self) -> tuple[Motion, ...]:
        """The elementary motions, from the parent to the link; none for a rigid connection."""

    @property
    def positions(self) -> tuple[Coordinate, ...]:
        """The entries of q."""
        return tuple(entry for motion in self.motions for entry in motion.positions)

    @property
    def speeds(self) -> tuple[Coordinate, ...]:
        """The entries of qd, with the units of their integrals."""
        return tuple(entry for motion in self.motions for entry in motion.speeds)

    @property
    def coordinate_limits(self) -> tuple[JointLimits, ...]:
        """The limits that belong to each entry of qd."""
        return self.limits if isinstance(self.limits, tuple) else (self.limits,) * self.nv

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return len(self.positions)

    @property
    def nv(self) -> int:
        """Number of speeds: the degrees of freedom."""
        return len(self.speeds)

    @property
    def neutral(self) -> tuple[float, ...]:
        """Zero for each coordinate, 1 0 0 0 for a quaternion; ``motion(neutral)`` is the motion by the
        offset."""
        return tuple(value for motion in self.motions for value in motion.neutral)

    @property
    def moves(self) -> bool:
        """Whether the joint has a coordinate."""
        return bool(self.motions)

    @property
    def rotates(self) -> bool:
        """Whether a motion of the joint changes the orientation."""
        return any(not isinstance(motion, AxisMotion) or motion.angular != 0.0 for motion in self.motions)

    @property
    def translations(self) -> int:
        """Number of motions that translate."""
        return sum(isinstance(motion, AxisMotion) and motion.linear != 0.0 for motion in self.motions)

    @property
    def travel(self) -> tuple[float, float] | None:
        """Lowest and highest translation along the axis within the limits, m, or None without limits.

        The offset is included. If several translations have limits, the limits of the first of them are
        returned.
        """
        motions = [motion for motion in self.motions for _ in motion.speeds]
        for motion, limits in zip(motions, self.coordinate_limits):
            if isinstance(motion, AxisMotion) and motion.linear and limits.position is not None:
                low, high = (motion.linear * (end + motion.offset) for end in limits.position)
                return min(low, high), max(low, high)
        return None

    def with_offset(self, added: float) -> Self:
        """The joint with ``added`` (rad or m) added to the offset of its single coordinate."""
        return replace(self, offset=self.offset + added)

    def motion(self, q: Sequence[float]) -> Transform:
        """The pose of the distal frame in the proximal frame at ``q`` (nq,), offset included."""
        pose, first = Transform(), 0
        for motion in self.motions:
            count = len(motion.positions)
            pose = pose @ motion.pose(q[first : first + count])
            first += count
        return pose


def unit_axis(value: object) -> Vector3:
    """An axis as a unit vector. A zero axis, and an axis of unit length up to rounding, are unchanged."""
    axis = vector3(value, where="axis of a joint")  # pyright: ignore[reportArgumentType] - checked there
    length = hypot(*axis)
    if length > 0 and abs(length - 1) > 1e-15 and math.isfinite(length):
        axis = (axis[0] / length, axis[1] / length, axis[2] / length)
    return axis
