"""Consistency rules of the constraints of a robot, with their error messages."""

from __future__ import annotations

from collections.abc import Sequence

from armblocks.errors import RobotError, UnknownNameError
from armblocks.robot.constraints import Constraint, Coupling, PrescribedMotion
from armblocks.robot.coordinate_map import dependent_joints
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
        if isinstance(constraint, PrescribedMotion):
            _check_prescribed(constraint, links, constraints, place)
            continue
        for name in constraint.joints:
            joint = joints[name]
            if joint.nv != 1:
                raise RobotError(
                    f"joint '{name}' is {type(joint).__name__} and has {joint.nv} degrees of freedom",
                    where=place,
                    allowed="joints with one coordinate",
                    fix="couple joints of one degree of freedom, or close the loop by a closure",
                )


def _check_prescribed(
    constraint: PrescribedMotion, links: Sequence[Link], constraints: Sequence[Constraint], place: str
) -> None:
    """Raise RobotError unless the joint moves, is independent and has only this prescribed motion."""
    name = constraint.joint
    others = [c for c in constraints if isinstance(c, PrescribedMotion) and c.joint == name]
    coupling = dependent_joints([c for c in constraints if isinstance(c, Coupling)]).get(name)
    if not next(link for link in links if link.name == name).joint.moves:
        what, fix = f"joint '{name}' is fixed", "name a joint that moves, or remove the constraint"
    elif coupling is not None:
        sources = ", ".join(f"'{joint}'" for joint, _ in coupling.terms[1:])
        what = f"joint '{name}' already follows from coupling '{coupling.name}'"
        fix = f"prescribe the joints on which it depends: {sources}" if sources else "remove the constraint"
    elif others[0] is not constraint:
        what = f"constraint '{others[0].name}' already prescribes joint '{name}'"
        fix = "remove one of them"
    else:
        return
    raise RobotError(
        what,
        where=place,
        allowed="one prescribed motion for each joint that moves and that no coupling determines",
        fix=fix,
    )
