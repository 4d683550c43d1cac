"""Inverse dynamics of robots with constraints: the torques of the joints that have a motor.

The torques of a tree, ``tau_tree``, are shared between motors and constraints: ``tau_tree = tau + J' λ`` with
``tau = 0`` at joints without a motor. The rows of those joints determine the multipliers λ.
Source: Featherstone, *Rigid Body Dynamics Algorithms*, 8.12 (inverse dynamics of closed loops); Nakamura and
Ghodoussi, *Dynamics computation of closed-link robot mechanisms*, IEEE Trans. Robotics and Automation 1989.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from casadi import SX

from armblocks.dynamics.constrained import independent_relations, symmetric_solver
from armblocks.dynamics.constraint_equations import constraint_equations
from armblocks.dynamics.mechanism import RANK_TOLERANCE, mechanism
from armblocks.errors import RobotError
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.vectors import Scalar


def motor_torques(tree: KinematicTree, q: SX, tree_torques: Sequence[Scalar]) -> list[Scalar]:
    """Torques (n,) of the joints with a motor, and 0 at the others, in the order of qd.

    ``tree_torques``: the torques of all joints for the same motion without the constraints. Raises RobotError
    unless the motors and the degrees of freedom agree in number and the motors move all of them.
    """
    passive = [body.speed for body in tree.bodies if body.motor is None]
    relations = independent_relations(tree)
    _check_actuation(tree, passive, relations)
    equations = constraint_equations(tree, q).only(relations)
    columns = [[row[j] for row in equations.rows] for j in passive]
    # J_p' λ = tau_p by its normal equations, whose matrix is J_p J_p'.
    m = len(relations)
    normal = [[_sum(c[i] * c[k] for c in columns) for k in range(m)] for i in range(m)]
    right = [_sum(c[i] * tree_torques[j] for c, j in zip(columns, passive)) for i in range(m)]
    multipliers = symmetric_solver(normal)(right)
    torques: list[Scalar] = [0.0] * tree.n
    for body in tree.bodies:
        j = body.speed
        if body.motor is not None:
            carried = _sum(row[j] * factor for row, factor in zip(equations.rows, multipliers))
            torques[j] = tree_torques[j] - carried
    return torques


def _check_actuation(tree: KinematicTree, passive: Sequence[int], relations: Sequence[int]) -> None:
    """Raise RobotError unless the joints without a motor follow from those with a motor."""
    robot = tree.robot
    functions = mechanism(robot)
    dof, motors = tree.n - len(relations), tree.n - len(passive)
    where = f"robot '{robot.name}'"
    if motors != dof:
        raise RobotError(
            f"the joints with motors have {motors} degrees of freedom, the mechanism has {dof}",
            where=where,
            allowed="as many motors as degrees of freedom, so that the torques exist and are unique",
            fix="give a motor (Motor() without inertia is enough) to the actuated joints only",
        )
    J = functions.jacobian(functions.assembled(functions.neutral))[np.ix_(relations, passive)]
    s = np.linalg.svd(J, compute_uv=False)
    if len(s) and s.min() <= RANK_TOLERANCE * s.max():
        raise RobotError(
            "the joints with motors do not determine the other joints",
            where=where,
            allowed="motors whose joints fix the mechanism when they are locked",
            fix="move a motor to a joint that can still move while the others are locked",
        )


def _sum(terms: Iterable[Scalar]) -> SX:
    total = SX(0.0)
    for term in terms:
        total = total + term
    return total
