"""Coordinates of robots for inverse kinematics: random starts, whole turns, limits of dependent joints."""

from __future__ import annotations

import math
from typing import cast

import numpy as np
from numpy.typing import NDArray

from armblocks.robot import Robot
from armblocks.robot.joints.motions import AxisMotion

Array = NDArray[np.float64]


def random_coordinates(robot: Robot, count: int, rng: np.random.Generator, *, limited: bool) -> Array:
    """Random coordinates (count, nq): within the limits, within one turn, or within 1 m."""
    columns: list[Array] = []
    qlim, periodic = robot.qlim, periodic_coordinates(robot)
    place = 0
    for joint in robot.joints:
        for motion in joint.motions:
            if not isinstance(motion, AxisMotion):
                quaternion = rng.standard_normal((count, 4))
                columns += list((quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T)
                place += 4
                continue
            low, high = qlim[place] if limited else (-np.inf, np.inf)
            width = 2.0 * math.pi if motion.angular else 2.0
            if not math.isfinite(low) or not math.isfinite(high) or (periodic[place] and high - low > width):
                middle = min(max(0.0, low + 0.5 * width), high - 0.5 * width)
                low, high = max(low, middle - 0.5 * width), min(high, middle + 0.5 * width)
            columns.append(low + (high - low) * rng.random(count))
            place += 1
    return np.column_stack(columns)


def periodic_coordinates(robot: Robot) -> NDArray[np.bool_]:
    """Coordinates (nq,) whose pose repeats after a whole turn: angles of joints without couplings."""
    coupled = {index for joint in robot.coupled_joints for index in joint.factors}
    of_speed = [
        isinstance(motion, AxisMotion) and abs(motion.angular) == 1.0 and motion.linear == 0.0
        for joint in robot.joints
        for motion in joint.motions
        for _ in motion.speeds
    ]
    result = np.zeros(robot.nq, dtype=np.bool_)
    for k, (place, angle) in enumerate(zip(robot.position_of_speed, of_speed)):
        if place is not None:
            result[place] = angle and k not in coupled
    return result


def dependent_excess(robot: Robot, q: Array) -> Array:
    """The excess (N, joints) over the limits of joints that couplings determine, at ``q`` (N, nq)."""
    places = robot.position_of_speed
    columns: list[Array] = []
    for joint in robot.coupled_joints:
        value = np.full(q.shape[0], joint.constant)
        for index, factor in joint.factors.items():
            value += factor * q[:, cast("int", places[index])]
        low, high = joint.limits.position or (-np.inf, np.inf)
        slack = 1e-9 * max(1.0, abs(low) if math.isfinite(low) else 1.0)
        columns.append(np.maximum(np.maximum(low - value, value - high) - slack, 0.0))
    return np.column_stack(columns) if columns else np.zeros((q.shape[0], 0))
