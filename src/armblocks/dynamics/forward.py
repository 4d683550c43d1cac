"""Forward dynamics: joint accelerations from joint torques, and a check of the inertia matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from casadi import SX, Function, horzcat, vertcat
from numpy.typing import NDArray

from armblocks.dynamics.aba import aba
from armblocks.dynamics.crba import FactoredInertia, crba
from armblocks.dynamics.joint_motion import joint_motions
from armblocks.dynamics.rnea import Wrench, rnea
from armblocks.errors import RobotError
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.vectors import Scalar

MAX_JOINTS_BY_MATRIX = 18
"""Maximum number of joints for which the factored inertia matrix is used.

Up to this number it takes fewer operations than the articulated-body algorithm, for chains of revolute joints
with general axes (6 joints: 2,200 against 4,345; 16 joints: 12,165 against 14,555).
"""

RANDOM_POSITIONS = 3
"""Number of positions at which the inertia matrix is checked."""
PIVOT_TOLERANCE = 1e-12
"""A pivot below this fraction of its diagonal entry counts as zero."""


def forward_dynamics(
    tree: KinematicTree,
    q: SX,
    qd: Sequence[Scalar],
    tau: Sequence[Scalar],
    on_bodies: Mapping[int, Wrench] | None = None,
) -> list[SX]:
    """Accelerations of the joints, in the order of qd; ``tau`` is the joint torque minus friction."""
    joints = joint_motions(tree, q)
    n = tree.n
    if n > MAX_JOINTS_BY_MATRIX:
        return aba(tree, joints, qd, tau, tree.gravity, on_bodies)
    bias = rnea(tree, joints, qd, [0.0] * n, tree.gravity, on_bodies)
    order = [body.speed for body in tree.bodies]
    net_torque = [tau[j] - bias[j] for j in order]
    solution = FactoredInertia(tree, crba(tree, joints)).solve(net_torque)
    qdd: list[SX] = [SX(0.0)] * n
    for j, acceleration in zip(order, solution):
        qdd[j] = acceleration
    return qdd


def check_accelerations_exist(tree: KinematicTree, speeds: Sequence[int] | None = None) -> None:
    """Raise RobotError that names the joint if the inertia at a joint is zero for all q.

    The criterion is a pivot of the factored inertia matrix (the inertia at the joint while all distal joints
    are free) that is not positive at several random positions. ``speeds``: the joints that accelerate freely,
    as indices in the speeds of the tree; by default all joints.
    """
    rows = [i for i, body in enumerate(tree.bodies) if speeds is None or body.speed in speeds]
    if not rows:
        return
    q = SX.sym("q", tree.robot.nq)
    M = crba(tree, joint_motions(tree, q))
    evaluate = Function("M", [q], [horzcat(*(vertcat(*(SX(entry) for entry in row)) for row in M))])
    random = np.random.default_rng(0)
    has_inertia = np.zeros(len(rows), dtype=bool)
    for _ in range(RANDOM_POSITIONS):
        of_all = np.asarray(evaluate(random.uniform(-np.pi, np.pi, tree.robot.nq)).full())
        numbers = of_all[np.ix_(rows, rows)]
        has_inertia |= _pivots(numbers) > PIVOT_TOLERANCE * np.abs(np.diag(numbers))
    if has_inertia.all():
        return
    joint = tree.bodies[rows[int(np.argmin(has_inertia))]].link
    raise RobotError(
        f"joint '{joint}' has no inertia to accelerate: the inertia matrix is singular at every position",
        where=f"robot '{tree.robot.name}', link '{joint}'",
        allowed="mass or inertia that moves with the joint, or motor inertia at the joint",
        fix="give the link a mass and an inertia, or the motor an inertia; or fix the joint",
    )


def _pivots(M: NDArray[np.float64]) -> NDArray[np.float64]:
    """D of ``M = L' D L``, by elimination from the last row upwards.

    Entries that are undefined after a zero pivot are 0.
    """
    H = M.copy()
    n = len(H)
    for k in reversed(range(n)):
        if H[k, k] > PIVOT_TOLERANCE * abs(M[k, k]):
            H[:k, :k] -= np.outer(H[:k, k], H[k, :k]) / H[k, k]
    return np.diag(H)
