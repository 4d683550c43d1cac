"""Consistency rules of the constraints of a robot, with their error messages."""

from __future__ import annotations

from collections.abc import Sequence

from armblocks.errors import RobotError, UnknownNameError
from armblocks.robot.constraints import Constraint
from armblocks.robot.fields import check_parts
from armblocks.robot.link import Link

MAX_CONSTRAINTS = 300
"""Maximum number of constraints."""


def check_constraints(robot: str, links: Sequence[Link], constraints: Sequence[Constraint]) -> None:
    """Raise RobotError or UnknownNameError for the first inconsistency.

    ``robot`` is the name of the robot.
    """
    where = f"robot '{robot}'"
    check_parts(constraints, Constraint, "constraint", MAX_CONSTRAINTS, where=where, fix="split the robot")
    joints = {link.name: link.joint for link in links}
    for constraint in constraints:
        place = f"{where}, constraint '{constraint.name}'"
        for name in (*constraint.links, *constraint.joints):
            if name is not None and name not in joints:
                raise UnknownNameError("link", name, joints, where=place)
        for name in constraint.joints:
            joint = joints[name]
            if joint.nv != 1:
                raise RobotError(
                    f"joint '{name}' is {type(joint).__name__} and has {joint.nv} degrees of freedom",
                    where=place,
                    allowed="joints with one coordinate",
                    fix="couple joints of one degree of freedom, or close the loop by a closure",
                )
