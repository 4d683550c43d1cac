"""The limits of a joint coordinate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import RobotError, counted
from armblocks.robot.fields import number, numbers


@dataclass(frozen=True, kw_only=True)
class JointLimits(metaclass=ArgumentErrors):
    """The limits of a joint coordinate; ``None`` if unknown.

    ``position``: lowest and highest joint coordinate (rad or m). ``speed``: maximum magnitude (rad/s or m/s).
    ``torque``: maximum magnitude at the joint side (N m or N).
    """

    position: tuple[float, float] | None = None
    speed: float | None = None
    torque: float | None = None

    def __post_init__(self) -> None:
        if self.position is not None:
            ends = np.atleast_1d(numbers(self.position, where="position limits of a joint"))
            position = tuple(ends.ravel().tolist())
            if len(position) != 2:
                raise RobotError(
                    f"the position limits are {counted(len(position), 'number')}",
                    allowed="a pair, or None where unknown",
                    where="joint limits",
                    fix="give (lowest, highest)",
                )
            object.__setattr__(self, "position", position)
        for name in ("speed", "torque"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, number(value, where=f"{name} limit of a joint"))
