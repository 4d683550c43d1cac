"""The motion of a mechanism in which some speeds are given: the equations of drawn mechanisms with drives.

The speeds with a drive (p) have given accelerations, the others (f) given torques. With the inertia matrix M,
the bias (gravity, velocity terms, loads) and the Jacobian J of the closures,

    M_ff qdd_f = tau_f - bias_f - M_fp qdd_p + J_f' multipliers,
    J_f qdd_f = - dJ/dt qd - J_p qdd_p,
    tau_p = M_pf qdd_f + M_pp qdd_p + bias_p - J_p' multipliers.

Source: Featherstone, *Rigid Body Dynamics Algorithms*, 9.1 (hybrid dynamics) and 8.2 (loop constraints).
Unlike :mod:`armblocks.dynamics.prescribed_motion`, single degrees of freedom of a joint may be driven.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from casadi import SX, Function, jtimes, mtimes, vertcat

from armblocks.dynamics.ball_joints import position_rates
from armblocks.dynamics.constrained import independent_relations, symmetric_solver
from armblocks.dynamics.constraint_equations import constraint_equations
from armblocks.dynamics.coupled_motion import coupled_inertia
from armblocks.dynamics.crba import crba
from armblocks.dynamics.drawn_motion import DrawnMotion, Load
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.lockable_mechanism import consistent_state
from armblocks.dynamics.mechanism import RANK_TOLERANCE, Array, mechanism
from armblocks.dynamics.reduction import (
    generalised_forces,
    reduced_columns,
    tree_coordinates,
    tree_speeds,
)
from armblocks.dynamics.rnea import Wrench, rnea
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree


class DrawnDrives:
    """The equations of a robot whose speeds ``driven`` (indices in qd) are given, with loads at frames.

    ``motion``: the robot with its bodies. ``near`` (nq,): an assembled configuration, see
    :func:`armblocks.dynamics.constrained.independent_relations`.
    """

    def __init__(self, motion: DrawnMotion, near: Array, driven: Sequence[int]) -> None:
        robot = motion.robot
        self.motion = motion
        self.robot = robot
        self._near = near
        self._driven = list(driven)
        self._free = [k for k in range(robot.nv) if k not in driven]
        self._relations = independent_relations(robot, near)

    def state(self, q: SX, qd: SX) -> tuple[SX, SX]:
        """The state that satisfies the closures, nearest to ``q``, ``qd``; driven entries do not change.

        The coordinates are NaN if the closures cannot be satisfied near ``q``.
        """
        mask = SX(np.isin(np.arange(self.robot.nv), self._free).astype(float))
        return consistent_state(self.robot, q, qd, mask, self._near)

    def accelerations(
        self, q: SX, qd: SX, tau: SX, given: SX, loads: Sequence[Load], inertias: Sequence[SX]
    ) -> tuple[SX, SX]:
        """The accelerations (n, 1), and the generalised forces (n, 1) of drives and free joints.

        ``tau`` (n, 1): the forces of the free speeds; ``given`` (n, 1): the accelerations of the driven ones.
        The other entries of both are not read. ``inertias``: see
        :class:`armblocks.dynamics.drawn_motion.DrawnMotion`.
        """
        free, driven, tree = self._free, self._driven, self.motion.tree_with(inertias)
        frames = self.motion.frames(q, qd)
        placed = [(tree.attached(load.at.link, load.at.pose), load.force, load.moment) for load in loads]
        at_drives = SX.zeros(self.robot.nv)
        at_drives[driven] = given[driven]
        bias = self._bias(tree, q, qd, at_drives, frames.on_bodies(placed))
        M = coupled_inertia(self.robot, tree, q) if self.robot.couplings else _inertia_matrix(tree, q)
        J, J_bias = self._constraints(q, qd)
        x, multipliers = self._free_motion(M, J, tau[free] - bias[free], -J_bias - mtimes(J, at_drives))
        qdd, forces = SX(at_drives), SX(tau)
        needed = SX(bias)
        if free:
            qdd[free] = x
            needed = needed + mtimes(M[:, free], x)
        if J.shape[0]:
            needed = needed - mtimes(J.T, multipliers)
        forces[driven] = needed[driven]
        return qdd, forces

    def _bias(self, tree: KinematicTree, q: SX, qd: SX, qdd: SX, on_bodies: Mapping[int, Wrench]) -> SX:
        """The generalised forces (n, 1) of the accelerations ``qdd``, of gravity and of loads."""
        coordinates, coupled = self.robot.coordinate_map, bool(self.robot.couplings)
        if coupled:
            q, qd, qdd = (
                tree_coordinates(coordinates, q),
                tree_speeds(coordinates, qd),
                tree_speeds(coordinates, qdd),
            )
        joints = joint_motions(tree, q)
        bias = SX(vertcat(*rnea(tree, joints, entries(qd), entries(qdd), tree.gravity, on_bodies)))
        return generalised_forces(coordinates, bias) if coupled else bias

    def _free_motion(self, M: SX, J: SX, force: SX, rates: SX) -> tuple[SX, SX]:
        """``x`` and the multipliers: ``M_ff x = force + J_f' multipliers`` and ``J_f x = rates``."""
        free, count = self._free, J.shape[0]
        if not free:
            return SX(0, 1), SX(0, 1)
        solve = symmetric_solver(M[free, free])
        x = SX(vertcat(*solve(entries(force))))
        if not count:
            return x, SX(0, 1)
        J_free = J[:, free]
        responses = [SX(vertcat(*solve(entries(J_free[i, :].T)))) for i in range(count)]
        A = SX(count, count)
        for k, response in enumerate(responses):
            A[:, k] = mtimes(J_free, response)
        multipliers = SX(vertcat(*symmetric_solver(A)(entries(rates - mtimes(J_free, x)))))
        for k, response in enumerate(responses):
            x = x + multipliers[k] * response
        return x, multipliers

    def _constraints(self, q: SX, qd: SX) -> tuple[SX, SX]:
        """J of the independent relations, and ``dJ/dt qd``."""
        if not self._relations:
            return SX(0, self.robot.nv), SX(0, 1)
        # dJ/dt qd is a derivative with respect to q at constant speeds: both are symbols.
        at, speeds = SX.sym("q", self.robot.nq), SX.sym("qd", self.robot.nv)
        coordinates, coupled = self.robot.coordinate_map, bool(self.robot.couplings)
        of_tree = tree_coordinates(coordinates, at) if coupled else at
        rows = constraint_equations(self.motion.tree, of_tree).subset(self._relations).jacobian
        rows = reduced_columns(coordinates, rows) if coupled else rows
        rates = vertcat(*position_rates(self.robot, entries(at), entries(speeds)))
        bias_of_rows = jtimes(mtimes(rows, speeds), at, rates)
        relations = Function("relations", [at, speeds], [rows, bias_of_rows])
        J, J_bias = relations.call([q, qd], True, False)
        return J, J_bias


def _inertia_matrix(tree: KinematicTree, q: SX) -> SX:
    """The inertia matrix in the order of the speeds."""
    order, M = [body.speed for body in tree.bodies], SX(tree.n, tree.n)
    for i, row in zip(order, crba(tree, joint_motions(tree, q))):
        for j, entry in zip(order, row):
            M[i, j] = entry
    return M


def drives_are_independent(robot: Robot, q: Array, driven: Sequence[int]) -> bool:
    """Whether the speeds ``driven`` (indices in qd) can be chosen freely at the assembled ``q`` (nq,)."""
    relations = list(independent_relations(robot, q))
    if not relations:
        return True
    J = mechanism(robot).balanced(q)[relations]
    s = np.linalg.svd(J[:, [k for k in range(robot.nv) if k not in driven]], compute_uv=False)
    return int(np.sum(s > RANK_TOLERANCE * s.max(initial=0.0))) == len(relations)
