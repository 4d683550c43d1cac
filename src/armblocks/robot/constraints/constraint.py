"""The base classes of constraints: equations in addition to the joints of the tree."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import RobotError
from armblocks.robot.constraints.relations import NoDisplacement, Perpendicular, Relation
from armblocks.robot.fields import check_kind, pose
from armblocks.spatial import Transform


@dataclass(frozen=True, kw_only=True)
class Attachment(metaclass=ArgumentErrors):
    """A frame that is fixed to a link: ``pose`` in the frame of the link named ``link`` (None: the base).

    ``pose`` may be a (4, 4) matrix.
    """

    link: str | None = None
    pose: Transform = field(default_factory=Transform)

    def __post_init__(self) -> None:
        where = f"pose of an attachment to {'the base' if self.link is None else f'link {self.link!r}'}"
        object.__setattr__(self, "pose", pose(self.pose, where=where))


@dataclass(frozen=True, kw_only=True)
class Constraint(ABC, metaclass=ArgumentErrors, methods=False):
    """Equations that the coordinates of a robot satisfy at all times, in addition to the joints of its tree.

    ``name`` is unique in the robot.
    """

    name: str

    title: ClassVar[str] = ""
    """The name of the type in messages and files."""

    def __post_init__(self) -> None:
        if not self.name:
            raise RobotError(
                f"a constraint of type {self.title} has no name",
                allowed="a name that is not empty",
                fix="name the constraint",
                where="constraint",
            )

    @abstractmethod
    def with_renamed_link(self, old: str, new: str) -> Self:
        """The constraint with the new name of a link; the joint of the link has the same name."""

    @property
    def links(self) -> tuple[str | None, ...]:
        """The links that the constraint names; None is the base."""
        return ()

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints whose coordinates the constraint names."""
        return ()


@dataclass(frozen=True, kw_only=True)
class Closure(Constraint):
    """A joint between two links that closes a loop of the tree, described by the relations of two frames.

    ``first`` and ``second``: frames on the two links. Each relation is one equation; redundant equations are
    allowed, because the algorithms detect and remove them.
    """

    first: Attachment
    second: Attachment

    def __post_init__(self) -> None:
        super().__post_init__()
        for end in (self.first, self.second):
            check_kind(end, Attachment, where=f"constraint '{self.name}'")
        if self.first.link == self.second.link:
            raise RobotError(
                "both frames are on the same link",
                where=f"constraint '{self.name}'",
                allowed="frames on two links, or on a link and the base",
                fix="correct the link of one of the frames",
            )

    def with_renamed_link(self, old: str, new: str) -> Self:
        ends = [replace(end, link=new) if end.link == old else end for end in (self.first, self.second)]
        return replace(self, first=ends[0], second=ends[1])

    @property
    @abstractmethod
    def relations(self) -> tuple[Relation, ...]:
        """The equations of the two frames."""

    @property
    def links(self) -> tuple[str | None, ...]:
        return (self.first.link, self.second.link)

    @property
    def parallel_axes(self) -> Iterator[int]:
        """The axes that have the same direction in both frames.

        The relations alone would also accept the opposite direction.
        """
        crossed = {(r.first, r.second) for r in self.relations if isinstance(r, Perpendicular)}
        for axis in range(3):
            others = [other for other in range(3) if other != axis]
            if all((other, axis) in crossed or (axis, other) in crossed for other in others):
                yield axis

    @property
    def locks_position(self) -> bool:
        """Whether the origins of the frames coincide."""
        return sum(isinstance(relation, NoDisplacement) for relation in self.relations) == 3
