"""The type of the parameter ``robot`` of blocks."""

from __future__ import annotations

from typing import Protocol, Self, overload

from armblocks.robot import Robot


class HasRobot(Protocol):
    """An object with a robot, such as an Arm."""

    @property
    def robot(self) -> Robot: ...


class RobotField(Protocol):
    """The type of the field ``robot`` for type checkers, which read it from ``__set__`` and ``__get__``.

    A block accepts a Robot or an Arm, and its attribute is the Robot. This class has no instances.
    """

    @overload
    def __get__(self, block: None, kind: type, /) -> Self: ...
    @overload
    def __get__(self, block: object, kind: type, /) -> Robot: ...
    def __get__(self, block: object, kind: type, /) -> Robot | Self: ...

    def __set__(self, block: object, value: Robot | HasRobot, /) -> None: ...
