"""Equations of motion of a robot with constraints whose joints may be locked by friction or by a stop.

The equations of :mod:`armblocks.dynamics.constrained` with a set of locked joints: with the free rows and
columns (f) of the inertia matrix M and of the Jacobian J of the closures,

    M_f qdd_f = (torque - bias)_f + J_f' multipliers,    J_f qdd_f = - dJ/dt qd.

They have a solution for every set of locked joints if the joints that can be locked are independent:
without their columns J keeps its rank. Source: Pfeiffer, Glocker, *Multibody Dynamics with Unilateral
Contacts*, 1996 (dry friction and impacts of systems with constraints).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from casadi import SX, Function, fabs, fmax, if_else, jtimes, mtimes, vertcat

from armblocks.dynamics.ball_joints import integrated, position_rates
from armblocks.dynamics.base_parameters import base_parameter_tree
from armblocks.dynamics.constrained import (
    MAX_RESIDUAL,
    POSITION_STEPS,
    assembled_coordinates,
    check_no_prescribed_motion,
    independent_relations,
    symmetric_solver,
)
from armblocks.dynamics.constraint_equations import constraint_equations
from armblocks.dynamics.crba import SquareMatrix, crba
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.loads import tip_wrench, with_payload
from armblocks.dynamics.mechanism import RANK_TOLERANCE, Array, mechanism
from armblocks.dynamics.reduction import (
    generalised_forces,
    reduced_columns,
    reduced_symmetric,
    tree_coordinates,
    tree_speeds,
)
from armblocks.dynamics.rnea import rnea
from armblocks.dynamics.springs import spring_torques
from armblocks.errors import RobotError, counted
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree


class MechanismEquations:
    """``M(q) qdd + bias(q, qd) = torque + J' multipliers`` at one state that satisfies the constraints.

    ``bias`` includes gravity, springs, velocity terms and the ``wrench``; ``M`` and ``bias`` include the
    ``payload``. ``J`` (m, n) is the Jacobian of the independent relations, ``J_bias`` (m, 1) is ``dJ/dt qd``.
    Couplings are eliminated. ``near``: coordinates near which the closures are assembled.
    """

    def __init__(
        self, robot: Robot, q: SX, qd: SX, wrench: SX | None, payload: SX | None, near: Array | None
    ) -> None:
        tree = base_parameter_tree(robot)
        on_bodies = None if wrench is None else tip_wrench(tree, wrench)
        if payload is not None:
            tree = with_payload(tree, payload)
        coordinates = robot.coordinate_map
        # J_bias is a derivative with respect to q at constant speeds, so coordinates and speeds are symbols.
        at, speeds = SX.sym("q", robot.nq), SX.sym("qd", robot.nv)
        tree_q, rates = tree_coordinates(coordinates, at), entries(tree_speeds(coordinates, speeds))
        joints = joint_motions(tree, tree_q)
        bias = rnea(tree, joints, rates, [0.0] * tree.n, tree.gravity, on_bodies)
        of_tree = vertcat(*(a + b for a, b in zip(bias, spring_torques(tree, tree_q))))
        J = _relations(robot, tree, at, independent_relations(robot, near))[1]
        q_rates = vertcat(*position_rates(robot, entries(at), entries(speeds)))
        parts = [
            generalised_forces(coordinates, of_tree),
            reduced_symmetric(coordinates, _inertia_matrix(tree, crba(tree, joints))),
            J,
            jtimes(mtimes(J, speeds), at, q_rates) if J.shape[0] else SX(0, 1),
        ]
        loads = [load for load in (wrench, payload) if load is not None]
        symbols = [SX.sym(f"load{k}", load.numel()) for k, load in enumerate(loads)]
        if loads:
            parts = Function("loaded", [at, speeds, *loads], parts).call([at, speeds, *symbols], True, False)
        evaluate = Function("equations", [at, speeds, *symbols], parts)
        self.bias, self.M, self.J, self.J_bias = evaluate.call([q, qd, *loads], True, False)

    def motion(self, torque: SX, free: SX) -> tuple[SX, SX]:
        """``qdd`` (n,), exactly 0 for locked joints, and the torque that holds each locked joint (n,)."""
        qdd, multipliers = self._solve(torque - self.bias, free, -self.J_bias)
        holding = torque - self.bias - mtimes(self.M, qdd)
        return qdd, holding + mtimes(self.J.T, multipliers) if self.J.shape[0] else holding

    def speeds_after_impact(self, qd: SX, stopping: SX) -> SX:
        """Speeds after an impact that stops some joints (1) and leaves all other joints free (0).

        Impulses act at the joints that stop and at the closures.
        """
        stopped = -stopping * qd
        change, _ = self._solve(-mtimes(self.M, stopped), 1.0 - stopping, -mtimes(self.J, qd + stopped))
        return if_else(stopping, 0.0, qd + change)

    def _solve(self, right: SX, free: SX, rates: SX) -> tuple[SX, SX]:
        """Return ``x`` and the multipliers with ``M x = right + J' multipliers`` and ``J x = rates``.

        The first equation holds in the rows of the free joints; ``x`` is 0 for locked joints.
        """
        n, m = self.M.shape[0], self.J.shape[0]
        masked = SX(self.M)
        for i in range(n):
            for j in range(n):
                if i != j:
                    masked[i, j] = self.M[i, j] * free[i] * free[j]
        solve = symmetric_solver(masked)
        x = SX(vertcat(*solve(entries(right * free))))
        if not m:
            return x, SX(0, 1)
        J = _free_columns(self.J, free)
        responses = [SX(vertcat(*solve(entries(J[i, :].T)))) for i in range(m)]
        A = SX(m, m)
        for k, response in enumerate(responses):
            A[:, k] = mtimes(J, response)
        multipliers = symmetric_solver(A)(entries(rates - mtimes(J, x)))
        for response, multiplier in zip(responses, multipliers):
            x = x + multiplier * response
        return x, SX(vertcat(*multipliers))


def consistent_state(
    robot: Robot, q: SX, qd: SX, free: SX, near: Array | None, *, newton_steps: int = 0
) -> tuple[SX, SX]:
    """Coordinates and speeds near ``q``, ``qd`` that satisfy the closures, by motions of the free joints.

    Locked joints keep their values exactly. The coordinates are NaN if ``q`` is too far from the closures.
    ``newton_steps``: number of additional first steps for ``q`` far from the closures. Each of them has its
    own Jacobian; the other steps share one.
    """
    relations = independent_relations(robot, near)
    if not relations:
        return q, qd
    tree = KinematicTree.of(robot)
    for _ in range(newton_steps):
        residuals, step = _shortest_step(robot, tree, q, free, relations)
        q = SX(vertcat(*integrated(robot, entries(q), entries(step(residuals)), 1.0)))
    residuals, step = _shortest_step(robot, tree, q, free, relations)
    for _ in range(POSITION_STEPS):
        q = SX(vertcat(*integrated(robot, entries(q), entries(step(residuals)), 1.0)))
        residuals, _ = _relations(robot, tree, q, relations)
    largest = SX(0.0)
    for value in entries(residuals):
        largest = fmax(largest, fabs(value))
    q = q + if_else(largest <= MAX_RESIDUAL, 0.0, math.nan)
    _, J = _relations(robot, tree, q, relations)
    _, step = _shortest_step(robot, tree, q, free, relations)
    return q, qd + step(mtimes(J, qd))


def _shortest_step(
    robot: Robot, tree: KinematicTree, q: SX, free: SX, relations: Sequence[int]
) -> tuple[SX, Callable[[SX], SX]]:
    """The residuals, and the function that maps them to the least-norm correction of the free joints."""
    residuals, of_all = _relations(robot, tree, q, relations)
    J = _free_columns(of_all, free)
    solve = symmetric_solver(mtimes(J, J.T))
    return residuals, lambda values: mtimes(J.T, -vertcat(*solve(entries(values))))


def _relations(robot: Robot, tree: KinematicTree, q: SX, relations: Sequence[int]) -> tuple[SX, SX]:
    """The residuals (m, 1) of relations and their Jacobian (m, n) in independent speeds."""
    coordinates = robot.coordinate_map
    equations = constraint_equations(tree, tree_coordinates(coordinates, q)).subset(relations)
    return equations.residual_vector, SX(reduced_columns(coordinates, equations.jacobian))


def _free_columns(J: SX, free: SX) -> SX:
    return SX(J * mtimes(SX.ones(J.shape[0], 1), free.T))


def _inertia_matrix(tree: KinematicTree, M: SquareMatrix) -> SX:
    """The inertia matrix of the tree in the order of its speeds."""
    result = SX(tree.n, tree.n)
    order = [body.speed for body in tree.bodies]
    for i, row in zip(order, M):
        for j, entry in zip(order, row):
            result[i, j] = entry
    return result


def check_lockable(robot: Robot, lockable: Sequence[int], near: Array | None, where: str) -> None:
    """Raise RobotError unless each set of the ``lockable`` joints (indices in qd) can be locked.

    Otherwise the forces of friction and stops would be statically indeterminate. Raises RobotError for
    prescribed motions, too.
    """
    check_no_prescribed_motion(robot)
    if not robot.closures or not lockable:
        return
    relations = list(independent_relations(robot, near))
    J = mechanism(robot).balanced(assembled_coordinates(robot, near))[relations]
    others = [k for k in range(robot.nv) if k not in lockable]
    s = np.linalg.svd(J[:, others], compute_uv=False) if others else np.zeros(0)
    if int(np.sum(s > RANK_TOLERANCE * s.max(initial=0.0))) == len(relations):
        return
    names = ", ".join(f"'{robot.speeds[k].name}'" for k in lockable)
    dof = robot.nv - len(relations)
    raise RobotError(
        f"Coulomb friction or hard stops act at the joints {names}, which are not independent: the mechanism "
        f"has {counted(dof, 'degree', 'degrees')} of freedom",
        where=where,
        allowed="joints that determine the others, at most as many as degrees of freedom, so that the forces "
        "at rest are unique",
        fix="give Coulomb friction and limits to the actuated joints only, or choose elastic stops",
    )
