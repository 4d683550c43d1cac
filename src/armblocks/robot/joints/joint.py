"""The base class of joints: rotation about an axis, translation along it, or both."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from armblocks.errors import RobotError, check_arguments
from armblocks.robot.fields import check_kind, number, numbers
from armblocks.rounded_functions import hypot
from armblocks.spatial import Transform, Vector3, rotation_about, vector3


@dataclass(frozen=True, kw_only=True)
class JointLimits:
    """The limits of a joint; ``None`` if unknown.

    ``position``: lowest and highest joint coordinate (rad or m). ``speed``: maximum magnitude (rad/s or m/s).
    ``torque``: maximum magnitude at the joint side (N m or N).
    """

    position: tuple[float, float] | None = None
    speed: float | None = None
    torque: float | None = None

    def __new__(cls, *values: object, **named: object) -> Self:
        check_arguments(cls, values, named)
        return super().__new__(cls)

    def __post_init__(self) -> None:
        if self.position is not None:
            ends = np.atleast_1d(numbers(self.position, where="position limits of a joint"))
            position = tuple(ends.ravel().tolist())
            if len(position) != 2:
                raise RobotError(
                    f"the position limits are {len(position)} numbers",
                    allowed="a pair, or None where unknown",
                    where="joint limits",
                    fix="give (lowest, highest)",
                )
            object.__setattr__(self, "position", position)
        for name in ("speed", "torque"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, number(value, where=f"{name} limit of a joint"))


@dataclass(frozen=True, kw_only=True)
class Joint(ABC):
    """A joint with at most one degree of freedom.

    With ``s = q + offset`` the distal side rotates by ``angular s`` rad about ``axis`` and translates by
    ``linear s`` m along it. ``axis`` is a unit vector in the joint frame; it is normalised here, and the
    robot rejects a zero axis. ``offset`` (rad or m) is added to the joint coordinate.
    """

    axis: Vector3 = (0.0, 0.0, 1.0)
    offset: float = 0.0
    limits: JointLimits = field(default_factory=JointLimits)

    letter: ClassVar[str] = ""
    """R, P or F, as in the toolbox's ``RRRRRR``."""
    unit: ClassVar[str] = ""
    """SI unit of the joint coordinate."""

    def __new__(cls, *values: object, **named: object) -> Self:
        check_arguments(cls, values, named)
        return super().__new__(cls)

    def __post_init__(self) -> None:
        axis = vector3(self.axis, where="axis of a joint")
        length = hypot(*axis)
        # An axis of unit length up to rounding is unchanged, so that an axis read from a file is the same.
        if length > 0 and abs(length - 1) > 1e-15 and math.isfinite(length):
            axis = (axis[0] / length, axis[1] / length, axis[2] / length)
        object.__setattr__(self, "axis", axis)
        object.__setattr__(self, "offset", number(self.offset, where="offset of a joint"))
        check_kind(self.limits, JointLimits, where="limits of a joint")

    @property
    @abstractmethod
    def angular(self) -> float:
        """Angular part of the motion subspace: rotation (rad) about the axis per unit of the coordinate."""

    @property
    @abstractmethod
    def linear(self) -> float:
        """Linear part of the motion subspace: translation (m) along the axis per unit of the coordinate."""

    @property
    def moves(self) -> bool:
        """Whether the joint has a coordinate."""
        return self.angular != 0 or self.linear != 0

    def motion(self, s: float) -> Transform:
        """The pose of the distal side in the joint frame at ``s = q + offset``."""
        x, y, z = self.axis
        shift = self.linear * s
        return Transform(
            rotation=rotation_about(self.axis, self.angular * s),
            translation=(x * shift, y * shift, z * shift),
        )
