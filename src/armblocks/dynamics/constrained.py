"""Forward dynamics of robots with constraints, and the projection onto them.

The multipliers of the independent relations are eliminated: with ``A = J M⁻¹ J'``,

    A multipliers = - (dJ/dt qd + J M⁻¹ (tau - h)),    qdd = M⁻¹ (tau - h + J' multipliers).

``J' multipliers`` are the generalised forces of the constraints. Source: Featherstone, *Rigid Body Dynamics
Algorithms*, 8.3; Udwadia and Kalaba, *A new perspective on constrained motion*, Proc. R. Soc. A 1992.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from casadi import SX, Function, fabs, fmax, if_else, mtimes, vertcat

from armblocks.dynamics.ball_joints import difference, integrated, position_rates
from armblocks.dynamics.constraint_equations import (
    acceleration_bias,
    constraint_equations,
)
from armblocks.dynamics.crba import FactoredInertia, crba
from armblocks.dynamics.friction import joint_friction
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.mechanism import Array, mechanism
from armblocks.dynamics.rnea import rnea
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.vectors import Scalar

POSITION_STEPS = 3
"""Number of Newton steps of a projection of coordinates, with one Jacobian.

Each step multiplies the residual by the relative distance from the constraints. At a distance of 1e-4, which
the tolerance of the solver keeps, three steps leave 1e-16."""
RESTORING_TIME = 0.1
"""Time constant of the decay of the distance from the constraints during a run, s."""
MAX_RESIDUAL = 1e-9
"""Largest residual after the projection: m, or cosine of an angle. A larger one would give wrong motions."""


class ConstrainedMotion(NamedTuple):
    """Coordinates and speeds that satisfy the constraints, the accelerations, and the multipliers.

    ``qdd`` (n,) in the order of qd. ``multipliers``: of the independent relations, N or N m.
    """

    q: SX
    qd: SX
    qdd: SX
    multipliers: SX


class ConstraintForces:
    """The constraints at one q and the inertia there: directions in which the relations act.

    ``equations``: the independent relations. ``responses``: ``M⁻¹ J'``, one column in the order of qd for
    each relation.
    """

    def __init__(self, tree: KinematicTree, q: SX, relations: Sequence[int]) -> None:
        self.tree = tree
        self.q = q
        self.joints = joint_motions(tree, q)
        self.equations = constraint_equations(tree, q).only(relations)
        self._inertia = FactoredInertia(tree, crba(tree, self.joints))
        self._order = [body.speed for body in tree.bodies]
        self.responses = [self.accelerations(row) for row in self.equations.rows]
        self._solve = symmetric_solver(
            [[_dot(row, response) for response in self.responses] for row in self.equations.rows]
        )

    def accelerations(self, forces: Sequence[Scalar]) -> list[SX]:
        """``M⁻¹ forces``, both in the order of qd."""
        solution = self._inertia.solve([forces[j] for j in self._order])
        result: list[SX] = [SX(0.0)] * self.tree.n
        for j, value in zip(self._order, solution):
            result[j] = value
        return result

    def consistent_speeds(self, qd: SX) -> SX:
        """The speeds nearest to ``qd`` in the metric of the kinetic energy that satisfy the constraints."""
        rates = mtimes(self.equations.jacobian, qd)
        return qd - self._response(self._solve(entries(rates)))

    def motion(self, qd: SX, net_torque: Sequence[Scalar]) -> tuple[SX, SX]:
        """Accelerations (n, 1) and multipliers; ``net_torque`` is the joint torque minus friction."""
        no_acceleration = [0.0] * self.tree.n
        bias = rnea(self.tree, self.joints, entries(qd), no_acceleration, self.tree.gravity)
        free = vertcat(*self.accelerations([a - b for a, b in zip(net_torque, bias)]))
        needed = -(
            acceleration_bias(self.tree, self.equations, self.q, qd) + mtimes(self.equations.jacobian, free)
        )
        multipliers = self._solve(entries(needed))
        return free + self._response(multipliers), vertcat(*multipliers)

    def _response(self, multipliers: Sequence[Scalar]) -> SX:
        """``M⁻¹ J' multipliers`` (n, 1)."""
        total = SX.zeros(self.tree.n)
        for factor, response in zip(multipliers, self.responses):
            total = total + factor * vertcat(*response)
        return total


def independent_relations(tree: KinematicTree, near: Array | None = None) -> tuple[int, ...]:
    """The indices of the relations that the equations of motion contain, see :meth:`Mechanism.mobility`.

    ``near`` (nq,): coordinates near which the constraints are assembled for this; by default the neutral
    ones.
    """
    functions = mechanism(tree.robot)
    return functions.mobility(functions.assembled(functions.neutral if near is None else near)).independent


def projected(tree: KinematicTree, q: SX, relations: Sequence[int]) -> SX:
    """Coordinates (nq, 1) near ``q`` that satisfy the constraints: shortest steps in the speeds.

    They are NaN if a residual larger than ``MAX_RESIDUAL`` remains, because ``q`` is too far from them.
    """
    equations = constraint_equations(tree, q).only(relations)
    J = equations.jacobian
    solve = symmetric_solver([[_dot(a, b) for b in equations.rows] for a in equations.rows])
    residuals = equations.residuals
    for _ in range(POSITION_STEPS):
        step = mtimes(J.T, -vertcat(*solve(residuals)))
        q = SX(vertcat(*integrated(tree.robot, entries(q), entries(step), 1.0)))
        residuals = constraint_equations(tree, q).only(relations).residuals
    largest = SX(0.0)
    for residual in residuals:
        largest = fmax(largest, fabs(residual))
    return q + if_else(largest <= MAX_RESIDUAL, 0.0, math.nan)


def constrained_motion(
    tree: KinematicTree, q: SX, qd: SX, tau: SX, near: Array | None = None
) -> ConstrainedMotion:
    """The motion of a robot with constraints under the joint torques ``tau`` (n, 1).

    The state is the consistent one nearest to ``q``, ``qd``. ``near``: see :func:`independent_relations`.
    """
    relations = independent_relations(tree, near)
    # The bias of the accelerations is a derivative with respect to q at constant speeds: both are symbols.
    at, speeds = SX.sym("q", tree.robot.nq), SX.sym("qd", tree.n)
    forces = ConstraintForces(tree, at, relations)
    friction = joint_friction(tree.robot, entries(speeds))
    net_torque = [torque - resistance for torque, resistance in zip(entries(tau), friction)]
    consistent = Function("speeds", [at, qd], [forces.consistent_speeds(qd)])
    motion = Function("motion", [at, speeds, tau], list(forces.motion(speeds, net_torque)))
    q = projected(tree, q, relations)
    (qd,) = consistent.call([q, qd], True, False)
    qdd, multipliers = motion.call([q, qd, tau], True, False)
    return ConstrainedMotion(q, qd, qdd, multipliers)


def restoring_rates(tree: KinematicTree, q: SX, qd: SX, motion: ConstrainedMotion) -> tuple[SX, SX]:
    """Rates of the states ``q`` (nq, 1) and ``qd`` (n, 1) of an integration of ``motion``.

    They are those of the motion and a decay of the distance from the consistent state with the time constant
    ``RESTORING_TIME``. The outputs of a run are the consistent state, so this term keeps the integration
    within the range of the projection and does not change the motion. Source: the method of Baumgarte 1972,
    here without its influence on the results.
    """
    to_consistent = vertcat(*difference(tree.robot, entries(q), entries(motion.q)))
    speeds = motion.qd + to_consistent / RESTORING_TIME
    q_rates = vertcat(*position_rates(tree.robot, entries(q), entries(speeds)))
    return SX(q_rates), motion.qdd + (motion.qd - qd) / RESTORING_TIME


def symmetric_solver(A: Sequence[Sequence[Scalar]]) -> Callable[[Sequence[Scalar]], list[SX]]:
    """The function that solves ``A x = b`` for a symmetric positive definite A, by ``A = L D L'``."""
    m = len(A)
    H = [[SX(entry) for entry in row] for row in A]
    inverse_pivots: list[SX] = []
    for k in range(m):
        inverse_pivots.append(2.0 / (H[k][k] + H[k][k]))
        factors = [H[i][k] * inverse_pivots[k] for i in range(k + 1, m)]
        for i in range(k + 1, m):
            for j in range(k + 1, i + 1):
                H[i][j] = H[i][j] - factors[i - k - 1] * H[j][k]
        for i in range(k + 1, m):
            H[i][k] = factors[i - k - 1]

    def solve(b: Sequence[Scalar]) -> list[SX]:
        x = [SX(entry) for entry in b]
        for k in range(m):
            for i in range(k + 1, m):
                x[i] = x[i] - H[i][k] * x[k]
        for k in reversed(range(m)):
            x[k] = x[k] * inverse_pivots[k]
            for i in range(k + 1, m):
                x[k] = x[k] - H[i][k] * x[i]
        return x

    return solve


def _dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> SX:
    total = SX(0.0)
    for x, y in zip(a, b):
        total = total + x * y
    return total
