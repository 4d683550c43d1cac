"""A fast condition for a regular inertia matrix of a drawn mechanism, from the bodies at its joints alone."""

from __future__ import annotations

import math

import numpy as np

from armblocks.robot import Link, Robot
from armblocks.robot.joints import AxisMotion, Motion

SMALLEST_SHARE = 1e-10
"""Smallest inertia of a body at a joint, relative to a bound for the whole mechanism.

It is above ``armblocks.dynamics.forward.PIVOT_TOLERANCE``, by more than the rounding of the matrix."""


def every_joint_moves_mass(robot: Robot) -> bool:
    """Whether the link of each joint alone has an inertia that makes the joint's acceleration unique.

    The inertia at a joint, while all distal joints are free, is at least that of the link that the joint
    carries: the articulated-body inertia of a link is its inertia plus positive semidefinite terms
    (Featherstone, *Rigid Body Dynamics Algorithms*, 7.1). The condition is sufficient, not necessary. If it
    is not satisfied, :func:`armblocks.dynamics.forward.check_accelerations_exist` decides.
    """
    reach = sum(_reach(link) for link in robot.links)
    mass = sum(link.mass for link in robot.links)
    moments = sum(float(np.trace(np.asarray(link.inertia))) for link in robot.links)
    largest = mass * reach * reach + moments
    return all(_moves_mass(link, largest, mass) for link in robot.links if link.joint.nv)


def _reach(link: Link) -> float:
    """A bound for the distance of a link's mass from the link before it, for coordinates up to pi."""
    lengths = [math.hypot(*link.before.translation), math.hypot(*link.after.translation)]
    lengths.append(math.hypot(*link.centre_of_mass))
    lengths += (
        abs(motion.linear) * (math.pi + abs(motion.offset))
        for motion in link.joint.motions
        if isinstance(motion, AxisMotion) and motion.linear
    )
    return sum(lengths)


def _moves_mass(link: Link, largest: float, mass: float) -> bool:
    """Whether the inertia of a link alone is regular at its joint.

    ``largest`` (kg m2) and ``mass`` (kg): bounds of the diagonal entries of the inertia matrix.
    """
    if link.motor is not None or not _has_independent_axes(link.joint.motions):
        return False
    smallest = float(np.linalg.eigvalsh(np.asarray(link.inertia, dtype=float)).min())
    if not (smallest > SMALLEST_SHARE * largest and link.mass > 0.0):
        return False
    # A force at the origin of the joint also turns the link: its effective mass is smaller than its mass.
    x, y, z = link.after.apply(link.centre_of_mass)
    effective = smallest * link.mass / (smallest + link.mass * (x * x + y * y + z * z))
    return effective > SMALLEST_SHARE * mass


def _has_independent_axes(motions: tuple[Motion, ...]) -> bool:
    """Whether the axes of rotations, and those of translations, are at right angles at every position.

    Screws are not permitted, and a translation after a rotation only if it is the only one.
    """
    angular, linear = list[np.ndarray](), list[np.ndarray]()
    balls = 0
    for motion in motions:
        if not isinstance(motion, AxisMotion):
            balls += 1
        elif {abs(motion.angular), abs(motion.linear)} != {0.0, 1.0}:
            return False
        elif motion.angular:
            angular.append(np.array(motion.axis, dtype=float))
        else:
            if linear and (angular or balls):
                return False
            linear.append(np.array(motion.axis, dtype=float))
    if balls + len(angular) > (1 if balls else 2):
        return False
    return _at_right_angles(angular) and _at_right_angles(linear)


def _at_right_angles(axes: list[np.ndarray]) -> bool:
    return all(abs(float(a @ b)) < 1e-9 for k, a in enumerate(axes) for b in axes[:k])
