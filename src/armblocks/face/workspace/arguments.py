"""The arguments of workspaces: measures, axes, ranges of the joints, payloads."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import index
from typing import SupportsIndex, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, RobotError, UnknownNameError, counted
from armblocks.face.arm import Arm
from armblocks.face.arm_measures import axis_rows
from armblocks.face.trajectory_arguments import (
    as_array,
    check_same_length,
    displacement,
    joint_limits,
    joint_vector,
)
from armblocks.robot import Robot
from armblocks.robot.joints.motions import AxisMotion

Array = NDArray[np.float64]

MEASURES = ("manipulability", "singularity", "condition", "limits", "payload")
"""The measures of a workspace, in the order of its tables."""
MAX_SAMPLES = 10**10


@dataclass(frozen=True, eq=False, kw_only=True)
class SampledRanges:
    """The ranges of the d uniform numbers of a sample, and sentences about assumed ranges."""

    low: Array
    width: Array
    notes: tuple[str, ...]

    @classmethod
    def of(cls, robot: Robot, given: Mapping[str, ArrayLike] | None, where: str) -> SampledRanges:
        """The ranges ``given`` by the names of coordinates, or the limits of the joints.

        A rotation without limits has one turn. Raises RobotError for a translation without limits.
        """
        names = [entry.name for entry in robot.positions]
        for name in given or {}:
            if name not in names:
                raise UnknownNameError("coordinate", name, names, where=f"ranges of {where}")
        low: list[float] = []
        width: list[float] = []
        notes: list[str] = []
        at = 0
        for joint in robot.joints:
            for motion in joint.motions:
                if not isinstance(motion, AxisMotion):
                    low, width = [*low, 0.0, 0.0, 0.0], [*width, 1.0, 1.0, 1.0]
                    at += len(motion.positions)
                    continue
                entry = robot.positions[at]
                ends = robot.qlim[at].tolist()
                if given is not None and entry.name in given:
                    first, last = _within(entry.name, given[entry.name], ends, where)
                else:
                    first, last = _assumed(entry.name, entry.unit, ends, notes, where)
                low.append(first)
                width.append(last - first)
                at += 1
        if given and any(name.rpartition(".")[2] in ("qw", "qx", "qy", "qz") for name in given):
            raise InputError(
                "a range of a quaternion is given",
                where=f"ranges of {where}",
                allowed="ranges of angles and displacements; rotations of ball joints are uniform",
                fix="omit the coordinates of ball joints",
            )
        return cls(low=np.array(low), width=np.array(width), notes=tuple(notes))


def _within(name: str, value: ArrayLike, ends: Sequence[float], where: str) -> tuple[float, float]:
    pair = as_array(value)
    low, high = ends
    margin = 1e-9 * max(1.0, *(abs(end) for end in ends if math.isfinite(end)), 1.0)
    is_range = pair.shape == (2,) and bool(np.isfinite(pair).all()) and pair[0] <= pair[1]
    if not is_range or pair[0] < low - margin or pair[1] > high + margin:
        raise InputError(
            f"the range of {name} is {value!r}",
            where=f"ranges of {where}",
            allowed=f"(lowest, highest) within the limits {low:g} to {high:g}, rad or m",
            fix="give a range within the limits" if is_range else "give two finite numbers, the lowest first",
        )
    return float(pair[0]), float(pair[1])


def _assumed(
    name: str, unit: str, ends: Sequence[float], notes: list[str], where: str
) -> tuple[float, float]:
    low, high = ends
    if math.isfinite(low) and math.isfinite(high):
        return low, high
    if unit != "rad":
        raise RobotError(
            f"the displacement of joint '{name}' has no limits",
            where=where,
            allowed="joints that translate within limits",
            fix=f"give ranges={{'{name}': (lowest, highest)}} in m, or limits in the robot's file",
        )
    turn = 2.0 * math.pi
    start = low if math.isfinite(low) else high - turn if math.isfinite(high) else -math.pi
    notes.append(f"{name} has no limits and is sampled over one turn")
    return start, start + turn


def check_robot(arm: Arm, where: str) -> None:
    """Raise RobotError for robots whose coordinates do not move independently of each other."""
    if arm.robot.closures:
        raise RobotError(
            "the robot has closed loops",
            where=f"{where}, robot '{arm.name}'",
            allowed="trees of links, with couplings of joints such as parallelograms",
            fix="describe parallelograms by couplings, or use the tree of the links",
        )
    if not arm.n:
        raise RobotError(
            "no joint moves",
            where=f"{where}, robot '{arm.name}'",
            allowed="at least one joint that is not fixed",
            fix="give the robot a joint that moves",
        )


def checked_measures(measures: str | Sequence[str], where: str) -> tuple[str, ...]:
    """The names of measures, in the order of ``MEASURES``."""
    names = (measures,) if isinstance(measures, str) else tuple(measures)
    for name in names:
        if name not in MEASURES:
            raise UnknownNameError("measure", str(name), MEASURES, where=where)
    if not names:
        raise InputError(
            "there is no measure",
            where=where,
            allowed=f"one or more of {', '.join(sorted(MEASURES))}",
            fix='omit measures for "manipulability"',
        )
    return tuple(name for name in MEASURES if name in names)


def checked_axes(axes: str | None, n: int, where: str) -> str:
    """The rows of the Jacobian: by default all rows for six joints or more, else the rows of translation."""
    chosen = ("all" if n >= 6 else "trans") if axes is None else axes
    axis_rows(chosen, where)
    return chosen


def whole(name: str, value: object, low: int, high: int, where: str) -> int:
    """An integer from ``low`` to ``high``."""
    try:
        number = low - 1 if isinstance(value, bool) else index(cast("SupportsIndex", value))
    except TypeError:
        number = low - 1
    if not low <= number <= high:
        raise InputError(
            f"{name} = {value!r}",
            where=where,
            allowed=f"an integer from {low} to {high}",
            fix=f"give {name}={max(low, min(high, 1000))}",
        )
    return number


def load_arguments(
    arm: Arm,
    torque: ArrayLike | None,
    centre: ArrayLike,
    qd: ArrayLike | None,
    qdd: ArrayLike | None,
    where: str,
) -> tuple[list[Array], tuple[str, ...]]:
    """Torque limits (n,), centre (3,) of the payload, speeds and accelerations (n,); sentences about limits.

    Raises InputError without any torque limit.
    """
    limits = arm.robot.torque_limits
    if torque is not None:
        limits = joint_limits("torque", torque, arm.n, where, infinite=True)
    joints = [entry.name for entry in arm.robot.speeds]
    free = [joint for joint, limit in zip(joints, limits.tolist()) if not math.isfinite(limit)]
    if len(free) == arm.n:
        raise InputError(
            f"no joint of robot '{arm.name}' has a torque limit",
            where=where,
            allowed="at least one limit, for a payload that the arm can hold",
            fix="give torque=(one limit for each joint), N m or N",
        )
    notes = [f"{', '.join(free)}: no torque limit"] if free else []
    notes += [
        f"{joint.link.name}: its torque limit is not included, because it depends on several joints"
        for joint in arm.robot.coupled_joints
        if len(joint.factors) > 1 and joint.limits.torque is not None
    ]
    place = displacement("centre", centre, where)
    motion: list[Array] = []
    for name, value in (("qd", qd), ("qdd", qdd)):
        vector = np.zeros(arm.n) if value is None else joint_vector(name, value, where)
        check_same_length(np.zeros(arm.n), {name: vector}, where, f"the {counted(arm.n, 'speed')} of the arm")
        motion.append(vector)
    return [limits, place, *motion], tuple(notes)
