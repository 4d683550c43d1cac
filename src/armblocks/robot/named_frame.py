"""Named frames of a robot: end effectors, sensors, mounts and other places of interest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import RobotError, UnknownNameError
from armblocks.robot.fields import check_kind, pose
from armblocks.robot.link import Link
from armblocks.spatial import Transform

MAX_FRAMES = 5000
"""Maximum number of named frames."""


@dataclass(frozen=True, kw_only=True)
class NamedFrame(metaclass=ArgumentErrors):
    """A frame ``name`` that is fixed to a link: ``pose`` in the frame of ``link`` (None: the base).

    ``arm.fkine(q, frame=name)`` returns its pose in the world. ``pose`` may be a (4, 4) matrix.
    """

    name: str
    link: str | None = None
    pose: Transform = field(default_factory=Transform)

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", pose(self.pose, where=f"pose of frame '{self.name}'"))

    def with_renamed_link(self, old: str, new: str) -> Self:
        """The frame with the new name of a link."""
        return replace(self, link=new) if self.link == old else self


def check_frames(robot: str, links: Sequence[Link], frames: Sequence[NamedFrame]) -> None:
    """Raise RobotError or UnknownNameError for the first inconsistency. ``robot`` is the robot's name."""
    where = f"robot '{robot}'"
    if len(frames) > MAX_FRAMES:
        raise RobotError(
            f"the robot has {len(frames)} named frames",
            where=where,
            allowed=f"at most {MAX_FRAMES}",
            fix="omit frames that are not used",
        )
    link_names = {link.name for link in links}
    names: set[str] = set()
    for frame in frames:
        check_kind(frame, NamedFrame, where=f"frames of {where}")
        if not frame.name:
            raise RobotError(
                "a frame has no name", where=where, allowed="a name that is not empty", fix="name the frame"
            )
        if frame.name in names or frame.name in link_names:
            raise RobotError(
                f"two frames are named '{frame.name}'"
                if frame.name in names
                else f"a frame and a link are named '{frame.name}'",
                where=where,
                allowed="unique names of links and frames",
                fix="rename the frame",
            )
        names.add(frame.name)
        if frame.link is not None and frame.link not in link_names:
            raise UnknownNameError("link", frame.link, sorted(link_names), where=f"{where}, '{frame.name}'")
