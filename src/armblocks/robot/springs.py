"""Springs of a robot: at a joint, and between two points, such as the counterbalance of a palletiser.

A spring stores energy and is part of the equations of motion; it does not restrict the motion.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import RobotError, UnknownNameError
from armblocks.robot.constraints import Attachment
from armblocks.robot.fields import check_kind, check_parts, number
from armblocks.robot.link import Link

MAX_SPRINGS = 300
"""Maximum number of springs."""


@dataclass(frozen=True, kw_only=True)
class Spring(ABC, metaclass=ArgumentErrors, methods=False):
    """A linear spring without mass and damping. ``name`` is unique among the springs of the robot."""

    name: str

    title: ClassVar[str] = ""
    """The name of the type in messages and files."""
    quantities: ClassVar[tuple[str, ...]] = ()
    """The fields that are finite numbers."""

    def __post_init__(self) -> None:
        if not self.name:
            raise RobotError(
                f"a {self.title} has no name",
                where="springs",
                allowed="a name that is not empty",
                fix="name the spring",
            )
        for field in self.quantities:
            value = number(getattr(self, field), where=f"{field} of {self.title} '{self.name}'")
            if not math.isfinite(value) or (field in ("stiffness", "length") and value < 0.0):
                raise RobotError(
                    f"the {field} is {value:g}",
                    where=f"{self.title} '{self.name}'",
                    allowed="a finite number" + (" of zero or more" if value < 0.0 else ""),
                    fix=f"correct the {field}",
                )
            object.__setattr__(self, field, value)

    @abstractmethod
    def with_renamed_link(self, old: str, new: str) -> Self:
        """The spring with the new name of a link; the joint of the link has the same name."""

    def with_offsets(self, offsets: Mapping[str, float]) -> Self:
        """The spring for joints whose offsets have increased by ``offsets``, by name of the joint."""
        return self


@dataclass(frozen=True, kw_only=True)
class JointSpring(Spring):
    """A spring at a joint with one coordinate q: the torque on the joint is ``-stiffness (q - rest)``.

    - ``joint``: the name of the joint, equal to the name of its link; couplings may determine the joint.
    - ``stiffness``: N m/rad, or N/m of a prismatic joint, zero or more.
    - ``rest``: the coordinate without torque, rad or m.

    The energy is ``stiffness (q - rest)^2 / 2``. A joint may have several springs.
    """

    joint: str
    stiffness: float
    rest: float = 0.0

    title: ClassVar[str] = "joint spring"
    quantities: ClassVar[tuple[str, ...]] = ("stiffness", "rest")

    def with_renamed_link(self, old: str, new: str) -> Self:
        return replace(self, joint=new) if self.joint == old else self

    def with_offsets(self, offsets: Mapping[str, float]) -> Self:
        return replace(self, rest=self.rest - offsets.get(self.joint, 0.0))


@dataclass(frozen=True, kw_only=True)
class LineSpring(Spring):
    """A spring, or a gas cylinder, between two points: the origins of frames on two links.

    The points attract each other with the force ``preload + stiffness (L - length)``, N, where L is their
    distance, m; a negative force pushes them apart. The energy is
    ``preload (L - length) + stiffness (L - length)^2 / 2``. If the points coincide, the force has
    no direction, and results are NaN.

    - ``first``, ``second``: the two frames.
    - ``stiffness``: N/m, zero or more; 0 is a constant force.
    - ``length``: the distance at which the force is ``preload``, m.
    - ``preload``: N.
    """

    first: Attachment
    second: Attachment
    stiffness: float
    length: float
    preload: float = 0.0

    title: ClassVar[str] = "line spring"
    quantities: ClassVar[tuple[str, ...]] = ("stiffness", "length", "preload")

    def __post_init__(self) -> None:
        super().__post_init__()
        for end in (self.first, self.second):
            check_kind(end, Attachment, where=f"line spring '{self.name}'")
        if self.first.link == self.second.link:
            raise RobotError(
                "both points are on the same link",
                where=f"line spring '{self.name}'",
                allowed="points on two links, or on a link and the base",
                fix="correct the link of one of the points",
            )

    def with_renamed_link(self, old: str, new: str) -> Self:
        ends = [replace(end, link=new) if end.link == old else end for end in (self.first, self.second)]
        return replace(self, first=ends[0], second=ends[1])


SPRING_TYPES: tuple[type[Spring], ...] = (JointSpring, LineSpring)
"""All types of springs."""


def check_springs(robot: str, links: Sequence[Link], springs: Sequence[Spring]) -> None:
    """Raise RobotError or UnknownNameError for the first inconsistency. ``robot`` is the robot's name."""
    where = f"robot '{robot}'"
    fix = "omit springs that are not used"
    check_parts(springs, Spring, "spring", MAX_SPRINGS, where=where, fix=fix)
    joints = {link.name: link.joint for link in links}
    for spring in springs:
        place = f"{where}, spring '{spring.name}'"
        if isinstance(spring, JointSpring):
            if spring.joint not in joints:
                raise UnknownNameError("joint", spring.joint, joints, where=place)
            joint = joints[spring.joint]
            if joint.nv != 1:
                raise RobotError(
                    f"joint '{spring.joint}' is {type(joint).__name__} and has {joint.nv} degrees of freedom",
                    where=place,
                    allowed="springs at joints with one coordinate",
                    fix="replace the joint by joints with one coordinate, or use a LineSpring",
                )
        elif isinstance(spring, LineSpring):
            for end in (spring.first, spring.second):
                if end.link is not None and end.link not in joints:
                    raise UnknownNameError("link", end.link, joints, where=place)
