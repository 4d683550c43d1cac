"""The universal joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from armblocks.robot.joints.joint import Joint, unit_axis
from armblocks.robot.joints.motions import AxisMotion, Motion
from armblocks.spatial import Vector3


@dataclass(frozen=True, kw_only=True)
class Universal(Joint):
    """Two rotations about axes that intersect: by q[0] rad about ``axis``, which is fixed to the parent, then
    by q[1] rad about ``second_axis``, which is fixed to the link.

    Both axes are given in the joint frame at q = 0; they are usually perpendicular (Cardan joint).
    """

    axis: Vector3 = (1.0, 0.0, 0.0)
    second_axis: Vector3 = (0.0, 1.0, 0.0)

    letter: ClassVar[str] = "U"
    parameters: ClassVar[tuple[str, ...]] = ("axis", "second_axis")

    def __post_init__(self) -> None:
        object.__setattr__(self, "second_axis", unit_axis(self.second_axis))
        super().__post_init__()

    @property
    def motions(self) -> tuple[Motion, ...]:
        return (
            AxisMotion(axis=self.axis, angular=1.0, name="angle1"),
            AxisMotion(axis=self.second_axis, angular=1.0, name="angle2"),
        )
