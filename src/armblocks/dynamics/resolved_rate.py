"""Joint speeds for a velocity of the tool, bounded near singular configurations, with symbols."""

from __future__ import annotations

import numpy as np
from casadi import SX, diag, fmax, fmin, mtimes, sqrt, vertcat

from armblocks.dynamics.jacobian import yoshikawa
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.pose_error import check_open_chain
from armblocks.equations.linear_solution import linear_solution
from armblocks.robot.robot import Robot
from armblocks.robot.tree import BASE, KinematicTree

MIN_DAMPING = 1e-6
"""Damping factor far from singular configurations. Its square keeps the equations regular."""
TINY = 1e-100
"""Added under square roots, whose derivative at zero is infinite."""


def arm_size(robot: Robot) -> float:
    """The sum of the distances between neighbouring joints from the base to the tool, m; 1 if it is zero."""
    tree = KinematicTree.of(robot)
    carrier = tree.tool.body
    path = [] if carrier == BASE else [carrier, *tree.ancestors(carrier)]
    size = float(np.linalg.norm(tree.tool.pose.p))
    size += sum(float(np.linalg.norm(tree.bodies[k].placement.p)) for k in path)
    return size if size > 1e-9 else 1.0


def bounded_speeds(
    robot: Robot, J: SX, twist: SX, posture_speeds: SX, *, damping: SX, region: SX, max_speed: SX
) -> SX:
    """``qd (n,)`` for the velocity ``twist (6,)`` of the tool, with the Jacobian ``J (6, n)``.

    Damped least squares with the rows of the position divided by the size of the arm: ``qd = J' (J J' + l²
    I)⁻¹ v``. The damping factor ``l`` grows from 0 to ``damping`` where the manipulability of this Jacobian
    falls from ``region`` to 0 (Nakamura and Hanafusa, *Inverse kinematic solutions with singularity
    robustness*, J. Dyn. Sys. Meas. Control 108, 1986). ``posture_speeds (n,)`` are projected onto the null
    space of J and added (Siciliano et al., *Robotics*, 2009, 3.5.1). Then all speeds are reduced in
    proportion, so that none exceeds ``max_speed``.
    """
    check_open_chain(robot)
    scale = diag(SX([1.0 / arm_size(robot)] * 3 + [1.0] * 3))
    scaled, v = SX(mtimes(scale, J)), SX(mtimes(scale, twist))
    n = robot.n
    columns = [entries(SX(scaled[:, k])) for k in range(n)]
    measure = yoshikawa([((a, b, c), (d, e, f)) for a, b, c, d, e, f in columns])
    nearness = fmax(0.0, 1.0 - measure / region)
    square = (damping * nearness) ** 2 + MIN_DAMPING**2

    def solved(right: SX) -> SX:
        """The damped least-squares speeds for a velocity of the tool."""
        if n >= 6:
            return SX(
                mtimes(scaled.T, linear_solution(SX(mtimes(scaled, scaled.T) + square * SX.eye(6)), right))
            )
        gram = SX(mtimes(scaled.T, scaled) + square * SX.eye(n))
        return linear_solution(gram, SX(mtimes(scaled.T, right)))

    # One linear system for both terms: the tool velocity of the posture motion is subtracted from ``twist``.
    speeds = SX(solved(SX(v - mtimes(scaled, posture_speeds))) + posture_speeds)
    largest = SX(0.0)
    for speed in entries(speeds):
        largest = SX(fmax(largest, sqrt(speed * speed + TINY)))
    return SX(speeds * fmin(1.0, max_speed / fmax(largest, TINY)))


def limit_avoidance(robot: Robot, q: SX, gain: SX) -> SX:
    """Speeds (n,) that move coordinates with limits towards the middle of their ranges.

    ``gain`` (1/s) times the distance from the middle. Coordinates without limits have the speed 0.
    """
    speeds: list[SX] = []
    qlim = robot.qlim
    for place in robot.position_of_speed:
        if place is None or not np.isfinite(qlim[place]).all():
            speeds.append(SX(0.0))
        else:
            speeds.append(SX(gain * (float(qlim[place].mean()) - q[place])))
    return SX(vertcat(*speeds))
