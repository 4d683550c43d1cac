"""Read-outs of an arm in one configuration: numbers, and descriptions of singularities."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError, counted
from armblocks.face.arm import Arm
from armblocks.robot import Robot
from armblocks.robot.geometry import reach
from armblocks.spatial import Transform
from armblocks.studio.protocol.messages.robots import Readings

SINGULAR_RATIO = 1e-6
"""Ratio of the extreme singular values of the Jacobian below which an arm is reported as singular."""
NEARLY_SINGULAR_RATIO = 0.02
"""Ratio below which an arm is close to singular: joint speeds can exceed 50 times the tool speed."""
_NAMED_FRACTION = 0.1
"""Fraction of the largest entry above which a joint or a direction is named."""


def readings(arm: Arm, q: Sequence[float], qd: Sequence[float], qdd: Sequence[float]) -> Readings:
    """Compute all read-outs at ``q, qd, qdd`` (rad, m and per second) with the compiled kernels."""
    n = arm.robot.n
    for name, values, count in (("q", q, arm.robot.nq), ("qd", qd, n), ("qdd", qdd, n)):
        _check_count(arm.robot, name, values, count)
    T, J = arm.fkine(q), arm.jacob0(q)
    pose = Transform.from_matrix(T)
    return Readings(
        pose=T.tolist(),
        position=list(pose.translation),
        rpy=list(pose.rpy),
        jacobian=J.tolist(),
        manipulability=float(arm.manipulability(q)),
        gravload=arm.gravload(q).tolist(),
        torque=arm.rne(q, qd, qdd).tolist(),
        singular=singularity(J, [entry.name for entry in arm.robot.speeds], reach(arm.robot)),
        limits=limit_warnings(arm.robot, q, qd, arm.rne(q, qd, qdd)),
    )


def _check_count(robot: Robot, name: str, values: Sequence[float], count: int) -> None:
    if len(values) != count:
        raise InputError(
            f"{counted(len(values), 'number was', 'numbers were')} given for {name}",
            where=f"robot '{robot.name}'",
            allowed=f"{count}, one for each joint",
            fix="give one number for each joint",
        )


def singularity(J: NDArray[np.float64], joints: Sequence[str], length: float) -> str:
    """Describe the lost motion in a singular configuration; ``""`` if the configuration is regular.

    ``J`` (6, n) is the result of ``jacob0``. Its linear rows are divided by ``length`` (m, the arm's reach),
    so that metres and radians can be compared. The text names the joints that can move without motion of the
    tool, or otherwise the lost direction.
    """
    scaled = J.copy()
    scaled[:3] /= length
    left, values, right = np.linalg.svd(scaled)
    if values[0] == 0:
        return "Singular: no joint moves the tool."
    ratio = float(values[-1] / values[0])
    if ratio >= NEARLY_SINGULAR_RATIO:
        return ""
    degree = "Singular" if ratio < SINGULAR_RATIO else "Close to singular"
    null_motion = np.abs(right[len(values) - 1])
    moving = [joint for joint, part in zip(joints, null_motion) if part > _NAMED_FRACTION * null_motion.max()]
    if len(moving) == 1:
        return f"{degree}: {moving[0]} moves without motion of the tool."
    words = f"{', '.join(moving[:-1])} and {moving[-1]} can move together without motion of the tool"
    if len(joints) < 6:
        return f"{degree}: {words}."
    return f"{degree}: {words}; the tool cannot {_direction(left[:, len(values) - 1])}."


def _direction(singular_vector: NDArray[np.float64]) -> str:
    """Describe the lost motion of the tool, a left singular vector of the Jacobian, in world axes."""
    linear, angular = singular_vector[:3], singular_vector[3:]
    is_linear = float(np.linalg.norm(linear)) >= float(np.linalg.norm(angular))
    motion = linear if is_linear else angular
    axis = int(np.argmax(np.abs(motion)))
    if abs(motion[axis]) > 0.99 * np.linalg.norm(motion):
        name = "xyz"[axis]
    else:
        x, y, z = (
            round(float(part), 2) + 0.0 for part in motion / np.linalg.norm(motion) * np.sign(motion[axis])
        )
        name = f"({x:g}, {y:g}, {z:g})"
    return f"move along {name}" if is_linear else f"turn about {name}"


def limit_warnings(
    robot: Robot, q: Sequence[float], qd: Sequence[float], tau: NDArray[np.float64]
) -> list[str]:
    """Describe the joints outside their range, or beyond their speed or torque limits."""
    texts: list[str] = []
    entries = zip(robot.speeds, robot.limits, robot.position_of_speed, qd, tau.tolist())
    for (name, _), limits, index, speed, torque in entries:
        if limits.position and index is not None and not limits.position[0] <= q[index] <= limits.position[1]:
            texts.append(f"{name} is outside its range")
        if limits.speed is not None and abs(speed) > limits.speed:
            texts.append(f"{name} exceeds its speed limit")
        if limits.torque is not None and abs(torque) > limits.torque:
            texts.append(f"{name} exceeds its torque limit")
    return texts
