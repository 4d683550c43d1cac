"""Mutable links and robots during the interpretation of a script."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field, replace

from armblocks.matlab.source import Location
from armblocks.spatial import Matrix3, Transform, Vector3


class Release(enum.Enum):
    """The interface of the toolbox with which an object was created."""

    UP_TO_8 = "up to 8"
    """``link``, ``robot``: values, copied when assigned."""
    FROM_9 = "9 and later"
    """``Link``, ``SerialLink``: handles, shared when assigned."""


@dataclass(kw_only=True)
class LinkRecord:
    """A link in a script; ``None``: not set by the script. Units as in ``Link`` and ``Motor``.

    ``location``: where it was created, for messages.
    """

    location: Location
    release: Release
    alpha: float = 0.0
    a: float = 0.0
    theta: float = 0.0
    d: float = 0.0
    sigma: int = 0
    offset: float = 0.0
    modified: bool = False
    mass: float | None = None
    centre_of_mass: Vector3 | None = None
    inertia: Matrix3 | None = None
    motor_inertia: float | None = None
    gear_ratio: float | None = None
    viscous_friction: float | None = None
    coulomb_friction: tuple[float, float] | None = None
    qlim: tuple[float, float] | None = None

    @property
    def kind(self) -> str:
        """The name of this kind of value in messages."""
        return "a link"

    def copy_on_assignment(self) -> LinkRecord:
        """The object that an assignment to another variable stores: a copy up to release 8."""
        return replace(self) if self.release is Release.UP_TO_8 else self


@dataclass(kw_only=True)
class RobotRecord:
    """A robot in a script. ``gravity`` has the toolbox's sign: it points up."""

    location: Location
    release: Release
    links: list[LinkRecord]
    name: str = "noname"
    manufacturer: str = ""
    comment: str = ""
    gravity: Vector3 = (0.0, 0.0, 9.81)
    base: Transform = field(default_factory=Transform)
    tool: Transform = field(default_factory=Transform)

    @property
    def kind(self) -> str:
        """The name of this kind of value in messages."""
        return "a robot"

    def copy_on_assignment(self) -> RobotRecord:
        """The object that an assignment to another variable stores: a copy up to release 8."""
        if self.release is Release.FROM_9:
            return self
        return replace(self, links=[link.copy_on_assignment() for link in self.links])
