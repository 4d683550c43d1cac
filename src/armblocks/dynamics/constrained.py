"""Forward dynamics of robots with constraints, and the projection onto them.

Couplings are eliminated: the equations have independent coordinates (:mod:`armblocks.dynamics.reduction`).
The multipliers of the closures' independent relations are eliminated: with ``A = J M⁻¹ J'``,

    A multipliers = - (dJ/dt qd + J M⁻¹ (tau - h)),    qdd = M⁻¹ (tau - h + J' multipliers).

``J' multipliers`` are the generalised forces of the closures. Source: Featherstone, *Rigid Body Dynamics
Algorithms*, 8.3; Udwadia and Kalaba, *A new perspective on constrained motion*, Proc. R. Soc. A 1992.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from casadi import SX, Function, fabs, fmax, if_else, jtimes, logic_and, mtimes, vertcat

from armblocks.dynamics.ball_joints import difference, integrated, position_rates
from armblocks.dynamics.constraint_equations import constraint_equations
from armblocks.dynamics.crba import FactoredInertia, crba
from armblocks.dynamics.friction import joint_friction
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.mechanism import Array, mechanism
from armblocks.dynamics.reduction import (
    generalised_forces,
    reduced_columns,
    reduced_symmetric,
    tree_coordinates,
    tree_speeds,
)
from armblocks.dynamics.rnea import Wrench, rnea
from armblocks.dynamics.springs import spring_torques
from armblocks.errors import RobotError
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.vectors import Scalar

POSITION_STEPS = 3
"""Number of Newton steps of a projection of coordinates, with one Jacobian.

Each step multiplies the residual by the relative distance from the constraints. The tolerance of the solver
keeps this distance below about 1e-4, so that three steps leave 1e-16."""
RESTORING_TIME = 0.1
"""Time constant of the decay of the distance from the constraints during a run, s."""
MAX_RESIDUAL = 1e-9
"""Largest residual after the projection: m, or cosine of an angle. Above it accelerations are inaccurate."""
MAX_INCONSISTENCY = 1e-6
"""Largest residual of a motion whose torques are computed: m, or cosine of an angle.

The tolerance of the first time derivative is multiplied by the sum of the absolute speeds. That of the second
derivative is multiplied by the sum of the absolute accelerations plus the square of the sum of the absolute
speeds."""

Solve = Callable[[Sequence[Scalar]], list[SX]]
"""The solution of linear equations for one right-hand side."""


class ConstrainedMotion(NamedTuple):
    """Coordinates and speeds that satisfy the constraints, the accelerations, and the multipliers.

    ``multipliers``: of the independent relations, N or N m.
    """

    q: SX
    qd: SX
    qdd: SX
    multipliers: SX


class ConstrainedEquations:
    """The equations of a robot with constraints at one ``q`` (nq, 1).

    ``tree``: the bodies, perhaps with regrouped parameters. ``relations``: the indices of the independent
    relations of its closures.
    """

    def __init__(self, robot: Robot, tree: KinematicTree, q: SX, relations: Sequence[int]) -> None:
        self.robot = robot
        self.q = q
        self._tree = tree
        self._map = robot.coordinate_map
        tree_q = tree_coordinates(self._map, q)
        self._joints = joint_motions(tree, tree_q)
        equations = constraint_equations(tree, tree_q).subset(relations)
        self.residuals = equations.residuals
        self.J = reduced_columns(self._map, equations.jacobian)

    def consistent_speeds(self, qd: SX) -> SX:
        """The speeds nearest to ``qd`` in the metric of the kinetic energy that satisfy the constraints."""
        _, responses, in_metric = self._factored()
        return qd - _combined(responses, in_metric(entries(mtimes(self.J, qd))), self.robot.nv)

    def motion(self, qd: SX, tau: SX, on_bodies: Mapping[int, Wrench] | None = None) -> tuple[SX, SX]:
        """Accelerations (n, 1) and multipliers for consistent ``qd`` and the joint torques ``tau``.

        ``on_bodies``: see :func:`armblocks.dynamics.rnea.rnea`.
        """
        solve, responses, in_metric = self._factored()
        rates = tree_speeds(self._map, qd)
        at_rest = [0.0] * self._tree.n
        gravity = self._tree.gravity
        bias = vertcat(*rnea(self._tree, self._joints, entries(rates), at_rest, gravity, on_bodies))
        resistance = vertcat(*joint_friction(self._tree.robot, entries(rates)))
        resistance += vertcat(*spring_torques(self._tree, tree_coordinates(self._map, self.q)))
        free = vertcat(*solve(entries(tau - generalised_forces(self._map, bias + resistance))))
        q_rates = vertcat(*position_rates(self.robot, entries(self.q), entries(qd)))
        bias_of_relations = jtimes(mtimes(self.J, qd), self.q, q_rates)
        multipliers = in_metric(entries(-(bias_of_relations + mtimes(self.J, free))))
        return free + _combined(responses, multipliers, self.robot.nv), vertcat(*multipliers)

    def shortest_step(self) -> Callable[[Sequence[Scalar]], SX]:
        """The function that maps residuals to the least-norm step that makes them zero to first order."""
        solve = symmetric_solver(mtimes(self.J, self.J.T))
        return lambda residuals: mtimes(self.J.T, -vertcat(*solve(residuals)))

    def _factored(self) -> tuple[Solve, list[SX], Solve]:
        """``M⁻¹``, its products with the rows of J, and the inverse of ``J M⁻¹ J'``."""
        solve = self._inertia()
        responses = [vertcat(*solve(entries(self.J[i, :].T))) for i in range(self.J.shape[0])]
        if not responses:
            return solve, [], lambda _: []
        rows = [mtimes(self.J, response) for response in responses]
        A = SX(self.J.shape[0], self.J.shape[0])
        for k, column in enumerate(rows):
            A[:, k] = column
        return solve, responses, symmetric_solver(A)

    def _inertia(self) -> Solve:
        """The function that solves equations with the inertia matrix, in the order of qd."""
        M = crba(self._tree, self._joints)
        order = [body.speed for body in self._tree.bodies]
        if not self.robot.couplings:
            factored = FactoredInertia(self._tree, M)

            def solve(forces: Sequence[Scalar]) -> list[SX]:
                result = [SX(0.0)] * self._tree.n
                for j, value in zip(order, factored.solve([forces[j] for j in order])):
                    result[j] = value
                return result

            return solve
        of_tree = SX(self._tree.n, self._tree.n)
        for i, row in zip(order, M):
            for j, entry in zip(order, row):
                of_tree[i, j] = entry
        return symmetric_solver(reduced_symmetric(self._map, of_tree))


def independent_relations(robot: Robot, near: Array | None = None) -> tuple[int, ...]:
    """The indices of the relations that the equations of motion contain, see :meth:`Mechanism.mobility`.

    ``near`` (nq,): coordinates near which the mechanism is assembled to find them; by default the neutral
    configuration, or any other configuration that can be assembled.
    """
    if not robot.closures:
        return ()
    return mechanism(robot).mobility(assembled_coordinates(robot, near)).independent


def assembled_coordinates(robot: Robot, near: Array | None = None) -> Array:
    """Coordinates (nq,) that satisfy the closures; ``near``: see :func:`independent_relations`."""
    functions = mechanism(robot)
    return functions.assembled_anywhere() if near is None else functions.assembled(np.asarray(near, float))


def nan_unless_consistent(equations: ConstrainedEquations, qd: SX | None = None, qdd: SX | None = None) -> SX:
    """0 if ``equations.q``, ``qd`` and ``qdd`` satisfy the constraints within a tolerance, otherwise NaN.

    The conditions are the relations and their first and second time derivatives, of those arguments that are
    not None. ``equations.q`` consists of symbols. See ``MAX_INCONSISTENCY``.
    """
    J, q = equations.J, equations.q
    excess = [_largest(equations.residuals) - MAX_INCONSISTENCY]
    if qd is not None:
        speed = _total(qd)
        excess.append(_largest(entries(mtimes(J, qd))) - MAX_INCONSISTENCY * fmax(1.0, speed))
        if qdd is not None:
            rates = vertcat(*position_rates(equations.robot, entries(q), entries(qd)))
            second = entries(mtimes(J, qdd) + jtimes(mtimes(J, qd), q, rates))
            scale = fmax(1.0, _total(qdd) + speed * speed)
            excess.append(_largest(second) - MAX_INCONSISTENCY * scale)
    consistent = excess[0] <= 0.0
    for value in excess[1:]:
        consistent = logic_and(consistent, value <= 0.0)
    return if_else(consistent, 0.0, math.nan)


def _largest(values: Sequence[Scalar]) -> SX:
    """The largest magnitude; 0 without values."""
    largest = SX(0.0)
    for value in values:
        largest = fmax(largest, fabs(value))
    return largest


def _total(values: SX) -> SX:
    """The sum of the magnitudes."""
    total = SX(0.0)
    for value in entries(values):
        total = total + fabs(value)
    return total


def projected(robot: Robot, tree: KinematicTree, q: SX, relations: Sequence[int]) -> SX:
    """Coordinates (nq, 1) near ``q`` that satisfy the constraints, by Newton steps of least norm.

    The coordinates are NaN if a residual above ``MAX_RESIDUAL`` remains, because ``q`` is too far from the
    constraints.
    """
    if not relations:
        return q
    equations = ConstrainedEquations(robot, tree, q, relations)
    step, residuals = equations.shortest_step(), equations.residuals
    for _ in range(POSITION_STEPS):
        q = SX(vertcat(*integrated(robot, entries(q), entries(step(residuals)), 1.0)))
        at = tree_coordinates(robot.coordinate_map, q)
        residuals = constraint_equations(tree, at).subset(relations).residuals
    return q + if_else(_largest(residuals) <= MAX_RESIDUAL, 0.0, math.nan)


def constrained_motion(
    robot: Robot,
    tree: KinematicTree,
    q: SX,
    qd: SX,
    tau: SX,
    *,
    near: Array | None = None,
    on_bodies: Mapping[int, Wrench] | None = None,
    loads: Sequence[SX] = (),
) -> ConstrainedMotion:
    """The motion of a robot with constraints under the joint torques ``tau`` (n, 1).

    The state is the consistent state nearest to ``q``, ``qd``. ``near``: see :func:`independent_relations`.
    ``on_bodies``: see :func:`armblocks.dynamics.rnea.rnea`. ``loads``: the symbols on which the inertias of
    ``tree`` and ``on_bodies`` depend.
    """
    check_no_prescribed_motion(robot)
    relations = independent_relations(robot, near)
    # The bias of the relations is a derivative with respect to q at constant speeds: both are symbols.
    at, speeds = SX.sym("q", robot.nq), SX.sym("qd", robot.nv)
    equations = ConstrainedEquations(robot, tree, at, relations)
    consistent = Function("speeds", [at, qd, *loads], [equations.consistent_speeds(qd)])
    results = list(equations.motion(speeds, tau, on_bodies))
    motion = Function("motion", [at, speeds, tau, *loads], results)
    q = projected(robot, tree, q, relations)
    (qd,) = consistent.call([q, qd, *loads], True, False)
    qdd, multipliers = motion.call([q, qd, tau, *loads], True, False)
    return ConstrainedMotion(q, qd, qdd, multipliers)


def check_no_prescribed_motion(robot: Robot) -> None:
    """Raise RobotError for a robot with prescribed motions: torques do not determine its accelerations."""
    if robot.prescribed_joints:
        raise RobotError(
            f"the motion of joint '{robot.prescribed_joints[0]}' is prescribed: torques do not determine it",
            where=f"robot '{robot.name}'",
            allowed="robots without prescribed motions",
            fix="use arm.hybrid_dynamics or the blocks PositionDrivenArm and AccelerationDrivenArm, or "
            "remove the constraint",
        )


def restoring_rates(robot: Robot, q: SX, qd: SX, motion: ConstrainedMotion) -> tuple[SX, SX]:
    """Rates of the states ``q`` (nq, 1) and ``qd`` (n, 1) of an integration of ``motion``.

    The rates are the rates of the motion plus a term that reduces the distance from the consistent state with
    the time constant ``RESTORING_TIME``. This term keeps the integrated states within the range of the
    projection. It does not change the motion, because the outputs of a run are the consistent state. Source:
    the method of Baumgarte 1972, here without its influence on the results.
    """
    to_consistent = vertcat(*difference(robot, entries(q), entries(motion.q)))
    speeds = motion.qd + to_consistent / RESTORING_TIME
    q_rates = vertcat(*position_rates(robot, entries(q), entries(speeds)))
    return SX(q_rates), motion.qdd + (motion.qd - qd) / RESTORING_TIME


def symmetric_solver(A: SX) -> Solve:
    """The function that solves ``A x = b`` for a symmetric positive definite A, by ``A = L D L'``."""
    m = A.shape[0]
    H = [[A[i, j] for j in range(m)] for i in range(m)]
    inverse_pivots: list[SX] = []
    for k in range(m):
        # This is 1 / H[k][k]. With that expression CasADi would replace every product with it by a division.
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


def _combined(columns: Sequence[SX], factors: Sequence[SX], size: int) -> SX:
    total = SX.zeros(size)
    for column, factor in zip(columns, factors):
        total = total + factor * column
    return total
