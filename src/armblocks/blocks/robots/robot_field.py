"""The type of the parameter ``robot`` of blocks."""

from __future__ import annotations

from typing import Protocol, Self, overload

from armblocks.robot import Robot


class HasRobot(Protocol):
    """Something that has a robot, such as an Arm."""

    @property
    def robot(self) -> Robot: ...


class RobotField(Protocol):
    """For type checkers, to whom a field of a descriptor's type is what the descriptor takes and gives.

    A block is made with a Robot or an Arm, and its attribute is the Robot. Nothing is an instance of this.
    """

    @overload
    def __get__(self, block: None, kind: type, /) -> Self: ...
    @overload
    def __get__(self, block: object, kind: type, /) -> Robot: ...
    def __get__(self, block: object, kind: type, /) -> Robot | Self: ...

    def __set__(self, block: object, value: Robot | HasRobot, /) -> None: ...
