"""Consistency rules of robot descriptions, with their error messages."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from armblocks.errors import RobotError, warn
from armblocks.robot.fields import check_kind
from armblocks.robot.joints import AxisMotion, Joint, JointLimits
from armblocks.robot.link import Link, Motor
from armblocks.spatial import Transform, Vector3

MAX_LINKS = 1000
"""Maximum number of links."""


def check_robot(name: str, links: Sequence[Link], frames: Mapping[str, Transform], gravity: Vector3) -> None:
    """Raise RobotError for the first inconsistency.

    Warn (ArmblocksWarning) if friction accelerates a joint.
    """
    robot = f"robot '{name}'"
    for k, link in enumerate(links):
        check_kind(link, Link, where=f"{robot}, link number {k + 1}")
    _check_tree(robot, links)
    for frame, transform in frames.items():
        _check_finite(robot, ((frame, number) for number in _numbers(transform)))
    _check_finite(robot, (("gravity", number) for number in gravity))
    for link in links:
        where = f"{robot}, link '{link.name}'"
        _check_finite(where, _link_numbers(link))
        if link.mass < 0:
            raise RobotError(
                f"the mass is {link.mass:g} kg", where=where, allowed="zero or more", fix="check the sign"
            )
        _check_joint(where, link.joint)
        if link.motor is not None:
            _check_motor(where, link.motor)
        _check_dh(where, link)


def _check_tree(robot: str, links: Sequence[Link]) -> None:
    """Check the number of links, their names and parents: every chain of parents ends at the base."""
    if not links:
        raise RobotError("the robot has no links", where=robot, allowed="1 link or more", fix="add a link")
    if len(links) > MAX_LINKS:
        raise RobotError(
            f"the robot has {len(links)} links",
            where=robot,
            allowed=f"at most {MAX_LINKS}",
            fix="split the robot",
        )
    parents: dict[str, str | None] = {}
    for link in links:
        if not link.name:
            raise RobotError(
                "a link has no name", where=robot, allowed="a name that is not empty", fix="name the link"
            )
        if link.name in parents:
            raise RobotError(
                f"two links are named '{link.name}'",
                where=robot,
                allowed="unique names",
                fix="rename one of the links",
            )
        parents[link.name] = link.parent
    checked: set[str | None] = {None}
    for link in links:
        path: list[str] = []
        name: str | None = link.name
        while name not in checked and name is not None:
            if name not in parents:
                raise RobotError(
                    f"link '{path[-1]}' has the parent '{name}', which does not exist",
                    where=robot,
                    allowed=", ".join(parents),
                    fix="name an existing link as parent, or None for the base",
                )
            if name in path:
                cycle = [*path[path.index(name) :], name]
                raise RobotError(
                    "links are each other's parents: " + " -> ".join(cycle),
                    where=robot,
                    allowed="every chain of parents ends at the base",
                    fix="set the parent of one of them to None",
                )
            path.append(name)
            name = parents[name]
        checked.update(path)


def _check_joint(where: str, joint: Joint) -> None:
    if not all(any(motion.axis) for motion in joint.motions if isinstance(motion, AxisMotion)):
        raise RobotError(
            "the joint's axis is zero",
            where=where,
            allowed="a direction such as (0, 0, 1)",
            fix="set the axis of the motion",
        )
    for coordinate, limits in zip(joint.speeds, joint.coordinate_limits):
        _check_limits(where, coordinate.unit, limits)


def _check_limits(where: str, unit: str, limits: JointLimits) -> None:
    if limits.position is not None and limits.position[0] > limits.position[1]:
        low, high = limits.position
        raise RobotError(
            f"the position limits are reversed: from {low:g} to {high:g} {unit}",
            where=where,
            allowed="the lower limit first",
            fix="exchange the two limits",
        )
    for kind, value in (("speed", limits.speed), ("torque", limits.torque)):
        if value is not None and value <= 0:
            raise RobotError(
                f"the {kind} limit is {value:g}",
                where=where,
                allowed="above zero, or None where unknown",
                fix="give its magnitude, or omit it",
            )


def _check_motor(where: str, motor: Motor) -> None:
    if motor.gear_ratio == 0:
        raise RobotError(
            "the gear ratio is 0, so the motor cannot move the joint",
            where=where,
            allowed="any other number",
            fix="use 1 for a direct drive, or omit the motor",
        )
    if motor.inertia < 0:
        raise RobotError(
            f"the motor inertia is {motor.inertia:g} kg m2",
            where=where,
            allowed="zero or more",
            fix="check the sign",
        )
    plus, minus = motor.coulomb_friction
    if motor.viscous_friction < 0 or plus < 0 or minus > 0:
        warn(
            f"{where}: friction accelerates the joint instead of braking it: viscous B = "
            f"{motor.viscous_friction:g}, Coulomb Tc+ = {plus:g}, Tc- = {minus:g}. "
            "Allowed: B >= 0, Tc+ >= 0, Tc- <= 0."
        )


def _check_dh(where: str, link: Link) -> None:
    if link.dh is None:
        return
    stored = (link.before, link.after, link.joint.letter, link.joint.axis, link.joint.offset)
    row = link.dh.joint()
    if stored != (link.dh.before, link.dh.after, row.letter, row.axis, row.offset):
        raise RobotError(
            "the D-H row disagrees with the link's transforms or joint",
            where=where,
            allowed="the transforms that the row gives",
            fix="build the link with standard_dh or modified_dh, or set dh=None",
        )


def _check_finite(where: str, fields: Iterator[tuple[str, float]]) -> None:
    for field, value in fields:
        if not math.isfinite(value):
            raise RobotError(
                f"{field} is {value}", where=where, allowed="a finite number", fix=f"set {field} to a number"
            )


def _numbers(transform: Transform) -> Iterator[float]:
    for row in transform.rotation:
        yield from row
    yield from transform.translation


def _link_numbers(link: Link) -> Iterator[tuple[str, float]]:
    """All numbers of a link, each with the name of its field."""
    if link.dh is not None:
        for name in ("alpha", "a", "d", "theta", "offset"):
            yield f"D-H {name}", getattr(link.dh, name)
    yield from (("before", number) for number in _numbers(link.before))
    yield from (("after", number) for number in _numbers(link.after))
    yield "mass", link.mass
    yield from (("centre_of_mass", number) for number in link.centre_of_mass)
    yield from (("inertia", number) for row in link.inertia for number in row)
    yield from (("joint axis", number) for number in link.joint.axis)
    yield "joint offset", link.joint.offset
    for motion in link.joint.motions:
        if isinstance(motion, AxisMotion):
            yield from (("joint axis", number) for number in (*motion.axis, motion.angular, motion.linear))
    for limits in link.joint.coordinate_limits:
        if limits.position is not None:
            yield from (("position limit", number) for number in limits.position)
        for name, value in (("speed limit", limits.speed), ("torque limit", limits.torque)):
            if value is not None:
                yield name, value
    if link.motor is not None:
        yield "motor inertia", link.motor.inertia
        yield "gear ratio", link.motor.gear_ratio
        yield "viscous friction", link.motor.viscous_friction
        yield from (("Coulomb friction", number) for number in link.motor.coulomb_friction)
