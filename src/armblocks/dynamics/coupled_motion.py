"""Forward dynamics of trees with coupled joints whose bodies may depend on values of the run.

The equations of :mod:`armblocks.dynamics.reduction`: with the constant matrix C of the couplings,
``C' M C qdd = tau - C' bias``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from casadi import SX, Function, vertcat

from armblocks.dynamics.constrained import symmetric_solver
from armblocks.dynamics.crba import crba
from armblocks.dynamics.forward import PIVOT_TOLERANCE, RANDOM_POSITIONS
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.reduction import (
    generalised_forces,
    reduced_symmetric,
    tree_coordinates,
    tree_speeds,
)
from armblocks.dynamics.rnea import Wrench, rnea
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree


def coupled_accelerations(
    robot: Robot,
    tree: KinematicTree,
    q: SX,
    qd: SX,
    tau: SX,
    on_bodies: Mapping[int, Wrench] | None = None,
) -> SX:
    """The accelerations (n, 1) of the independent coordinates of a robot with couplings, without closures.

    ``tree``: of the robot, with inertias that may be symbols. ``tau`` (n, 1): the generalised forces of the
    independent coordinates. ``on_bodies``: see :func:`armblocks.dynamics.rnea.rnea`.
    """
    coordinates = robot.coordinate_map
    joints = joint_motions(tree, tree_coordinates(coordinates, q))
    rates = entries(tree_speeds(coordinates, qd))
    bias = SX(vertcat(*rnea(tree, joints, rates, [0.0] * tree.n, tree.gravity, on_bodies)))
    net = tau - generalised_forces(coordinates, bias)
    return SX(vertcat(*symmetric_solver(coupled_inertia(robot, tree, q))(entries(net))))


def coupled_inertia(robot: Robot, tree: KinematicTree, q: SX) -> SX:
    """The inertia matrix (n, n) of the independent coordinates ``q`` (nq, 1)."""
    coordinates = robot.coordinate_map
    order, of_tree = [body.speed for body in tree.bodies], SX(tree.n, tree.n)
    for i, row in zip(order, crba(tree, joint_motions(tree, tree_coordinates(coordinates, q)))):
        for j, entry in zip(order, row):
            of_tree[i, j] = entry
    return reduced_symmetric(coordinates, of_tree)


def coordinate_without_inertia(robot: Robot, tree: KinematicTree, speeds: Sequence[int]) -> int | None:
    """The first of the independent ``speeds`` (indices in qd) whose acceleration is undefined, or None.

    The inertia matrix is factored at random positions, see
    :func:`armblocks.dynamics.forward.check_accelerations_exist`.
    """
    if not speeds:
        return None
    q = SX.sym("q", robot.nq)
    evaluate = Function("M", [q], [coupled_inertia(robot, tree, q)])
    random = np.random.default_rng(0)
    regular = np.zeros(len(speeds), dtype=bool)
    for _ in range(RANDOM_POSITIONS):
        M = np.asarray(evaluate(random.uniform(-np.pi, np.pi, robot.nq)).full())[np.ix_(speeds, speeds)]
        H = M.copy()
        for k in reversed(range(len(H))):
            if H[k, k] > PIVOT_TOLERANCE * abs(M[k, k]):
                H[:k, :k] -= np.outer(H[:k, k], H[k, :k]) / H[k, k]
        regular |= np.diag(H) > PIVOT_TOLERANCE * np.abs(np.diag(M))
    return None if regular.all() else speeds[int(np.argmin(regular))]
