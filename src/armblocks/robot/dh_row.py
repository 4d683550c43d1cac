"""One row of a Denavit-Hartenberg table and its transforms."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import RobotError
from armblocks.robot.fields import number
from armblocks.robot.joints import Joint, JointLimits, Prismatic, Revolute
from armblocks.spatial import Transform, transl, trotx, trotz


class DhConvention(Enum):
    """Convention of a D-H row: the order of the joint motion and the constant transforms."""

    STANDARD = "standard"
    """``T = Rz(theta) Tz(d) Tx(a) Rx(alpha)``: the link frame is at the distal end of the link."""
    MODIFIED = "modified"
    """``T = Rx(alpha) Tx(a) Rz(theta) Tz(d)`` (Craig): the link frame is on the axis of the link's joint."""


@dataclass(frozen=True, kw_only=True)
class DhRow(metaclass=ArgumentErrors):
    """One row of a Denavit-Hartenberg table: a joint and the link that it carries.

    ``alpha`` rad, ``a`` m, ``d`` m, ``theta`` rad, ``sigma`` 0 revolute or 1 prismatic, ``offset`` rad, m.
    As in the toolbox, the numbers ``theta`` of a revolute joint and ``d`` of a prismatic joint are not used,
    because the joint variable ``q + offset`` replaces them.

    Source: Denavit and Hartenberg 1955 as in Corke, *Robotics, Vision and Control*, 2nd ed., section 7.1;
    modified: Craig, *Introduction to Robotics*, section 3.4.
    """

    alpha: float = 0.0
    a: float = 0.0
    d: float = 0.0
    theta: float = 0.0
    sigma: int = 0
    offset: float = 0.0
    convention: DhConvention = DhConvention.STANDARD

    def __post_init__(self) -> None:
        for name in ("alpha", "a", "d", "theta", "offset"):
            object.__setattr__(self, name, number(getattr(self, name), where=f"{name} of a D-H row") + 0.0)
        if self.sigma not in (0, 1):
            raise RobotError(
                f"sigma of a D-H row is {self.sigma}",
                allowed="0 for a revolute, 1 for a prismatic joint",
                where="D-H row",
                fix="set sigma to 0 or 1",
            )
        object.__setattr__(self, "sigma", int(self.sigma))

    @property
    def before(self) -> Transform:
        """The constant transform from the parent's frame to the joint."""
        if self.convention is DhConvention.STANDARD:
            return trotz(self.theta) if self.sigma else Transform()
        return trotx(self.alpha) @ transl(self.a, 0.0, 0.0) @ self._fixed_part

    @property
    def after(self) -> Transform:
        """The constant transform from the joint to the link's frame."""
        if self.convention is DhConvention.MODIFIED:
            return Transform()
        fixed = Transform() if self.sigma else self._fixed_part
        return fixed @ transl(self.a, 0.0, 0.0) @ trotx(self.alpha)

    @property
    def _fixed_part(self) -> Transform:
        """The constant factor of ``Rz(theta) Tz(d)``; the two factors commute."""
        return trotz(self.theta) if self.sigma else transl(0.0, 0.0, self.d)

    def joint(self, limits: JointLimits | None = None) -> Joint:
        """The joint about or along z that the row describes."""
        kind = Prismatic if self.sigma else Revolute
        return kind(offset=self.offset, limits=limits or JointLimits())
