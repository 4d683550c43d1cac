"""The elementary motions; the motion of a joint is a sequence of them.

A joint is a sequence of elementary motions, from its parent to its link. There are two types, and the
algorithms of :mod:`armblocks.dynamics` use only these, so the sequence describes a joint type completely.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from armblocks.errors import InputError
from armblocks.rounded_functions import hypot
from armblocks.spatial import Transform, Vector3, rotation_about


class Coordinate(NamedTuple):
    """One coordinate of a joint: its ``name`` (empty for a single coordinate) and its SI ``unit``."""

    name: str
    unit: str


@dataclass(frozen=True, kw_only=True)
class AxisMotion:
    """Rotation about an axis, translation along it, or both, by one coordinate q; its speed is q̇.

    With ``s = q + offset`` the distal frame rotates by ``angular s`` rad about the unit vector ``axis`` and
    translates by ``linear s`` m along it.
    """

    axis: Vector3
    angular: float = 0.0
    linear: float = 0.0
    offset: float = 0.0
    name: str = ""

    @property
    def positions(self) -> tuple[Coordinate, ...]:
        """The coordinate: rad if the motion rotates, else m."""
        return (Coordinate(self.name, "rad" if self.angular else "m"),)

    @property
    def speeds(self) -> tuple[Coordinate, ...]:
        """The speed: the rate of the coordinate."""
        return self.positions

    @property
    def neutral(self) -> tuple[float, ...]:
        """The coordinate 0."""
        return (0.0,)

    def pose(self, q: Sequence[float]) -> Transform:
        """The pose of the distal frame in the proximal frame at the coordinates ``q`` (1,)."""
        s = q[0] + self.offset
        x, y, z = self.axis
        shift = self.linear * s
        return Transform(
            rotation=rotation_about(self.axis, self.angular * s),
            translation=(x * shift, y * shift, z * shift),
        )


@dataclass(frozen=True, kw_only=True)
class BallMotion:
    """Any rotation about one point.

    The coordinates are a quaternion w x y z: the rotation of the distal frame in the proximal frame,
    ``p_proximal = R p_distal``. R depends only on the direction of the quaternion, whose length may be any
    number above zero. The speeds are the angular velocity of the distal frame relative to the proximal frame,
    in the axes of the distal frame, rad/s: ``d/dt (w x y z) = (w x y z) (0 wx wy wz) / 2``.
    """

    @property
    def positions(self) -> tuple[Coordinate, ...]:
        """The quaternion, scalar first."""
        return tuple(Coordinate(name, "") for name in ("qw", "qx", "qy", "qz"))

    @property
    def speeds(self) -> tuple[Coordinate, ...]:
        """The angular velocity in the axes of the distal frame; its integral has the unit rad."""
        return tuple(Coordinate(name, "rad") for name in ("wx", "wy", "wz"))

    @property
    def neutral(self) -> tuple[float, ...]:
        """The quaternion of no rotation."""
        return (1.0, 0.0, 0.0, 0.0)

    def pose(self, q: Sequence[float]) -> Transform:
        """The pose of the distal frame in the proximal frame at ``q`` (4,). Raises InputError for zeros."""
        length = hypot(*q)
        if length == 0.0:
            raise InputError(
                "the quaternion of a joint is 0 0 0 0, which is not a rotation",
                where="ball joint",
                allowed="a quaternion w x y z other than zero; 1 0 0 0 is the identity",
                fix="start from arm.neutral(), not from zeros",
            )
        w, x, y, z = (value / length for value in q)
        return Transform(
            rotation=(
                (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
                (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
                (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
            )
        )


Motion = AxisMotion | BallMotion
"""An elementary motion."""
