"""The limits of the coordinates q, including the limits of joints that depend on them by couplings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armblocks.robot.coordinate_map import CoordinateMap
from armblocks.robot.joints import JointLimits
from armblocks.robot.link import Link

ROUNDING = 1e-9
"""Limits of dependent joints that differ by less, relative to their size, do not change other limits."""


class DependentJoint(NamedTuple):
    """A joint that a coupling determines: its coordinate is the sum of factors times q, plus a constant.

    ``factors``: by the index of an entry of qd.
    """

    link: Link
    factors: dict[int, float]
    constant: float

    @property
    def limits(self) -> JointLimits:
        """The limits of the joint's own coordinate."""
        return self.link.joint.coordinate_limits[0]


def dependent_joints_of(links: Sequence[Link], coordinates: CoordinateMap) -> list[DependentJoint]:
    """The dependent joints among the moving ``links`` of a tree, in their order."""
    found: list[DependentJoint] = []
    row = 0
    for link in links:
        if link.name in coordinates.offsets:
            factors = coordinates.speeds[row]
            by_index = {int(k): float(factors[k]) for k in np.flatnonzero(factors)}
            found.append(DependentJoint(link, by_index, coordinates.offsets[link.name]))
        row += link.joint.nv
    return found


def limits_with_couplings(
    own: Sequence[JointLimits], motors: Sequence[object], dependent: Sequence[DependentJoint]
) -> tuple[JointLimits, ...]:
    """The limits of each entry of qd: its own limits and the limits of joints that depend on it alone.

    ``own``: the limits of the joint of each entry. Positions and speeds satisfy the limits of all these
    joints. A position range that has no common value with the other ranges is ignored. If the joint of the
    coordinate has neither motor nor torque limit, and only one joint has a motor, the torque limit of this
    joint applies. The torques of several motors would add up.
    """
    limits = list(own)
    for joint in dependent:
        if len(joint.factors) == 1:
            ((k, factor),) = joint.factors.items()
            limits[k] = JointLimits(
                position=common_range(limits[k].position, joint) or limits[k].position,
                speed=_smaller(limits[k].speed, joint.limits.speed, 1.0 / abs(factor)),
                torque=limits[k].torque,
            )
    for k, motor in enumerate(motors):
        drives = [joint for joint in dependent if k in joint.factors and joint.link.motor is not None]
        if motor is None and own[k].torque is None and len(drives) == 1 and len(drives[0].factors) == 1:
            limit = _smaller(None, drives[0].limits.torque, abs(drives[0].factors[k]))
            limits[k] = JointLimits(position=limits[k].position, speed=limits[k].speed, torque=limit)
    return tuple(limits)


def common_range(given: tuple[float, float] | None, joint: DependentJoint) -> tuple[float, float] | None:
    """The part of a range of q in which a joint that depends on this entry of q alone is in its range.

    ``None`` without such a part or without a range.
    """
    if joint.limits.position is None:
        return given
    (factor,) = joint.factors.values()
    low, high = sorted((end - joint.constant) / factor + 0.0 for end in joint.limits.position)
    if given is not None:
        low = low if low > given[0] + _rounding(given[0]) else given[0]
        high = high if high < given[1] - _rounding(given[1]) else given[1]
    return (low, high) if low <= high else None


def _smaller(given: float | None, limit: float | None, factor: float) -> float | None:
    if limit is None:
        return given
    scaled = limit * factor
    return given if given is not None and scaled >= given * (1.0 - ROUNDING) else scaled


def _rounding(value: float) -> float:
    return ROUNDING * max(1.0, abs(value)) if math.isfinite(value) else 0.0
