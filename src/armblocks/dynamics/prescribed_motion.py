"""Motions of robots in which drives prescribe the motions of some joints.

The prescribed joints (p) have given accelerations, the free joints (f) given torques. With the inertia matrix
M, the bias (gravity, springs, velocity terms) and the Jacobian J of the closures,

    M_ff qdd_f = tau_f - bias_f - friction_f - M_fp qdd_p + J_f' multipliers,
    J_f qdd_f = - dJ/dt qd - J_p qdd_p,
    tau_p = M_pf qdd_f + M_pp qdd_p + bias_p + friction_p - J_p' multipliers.

The equations have one solution if J_f has the rank of J: the prescribed joints move independently of each
other. Source: Featherstone, *Rigid Body Dynamics Algorithms*, 9.1 (hybrid dynamics) and 8.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from casadi import SX, mtimes, vertcat

from armblocks.dynamics.base_parameters import regrouped
from armblocks.dynamics.constrained import assembled_coordinates, independent_relations, symmetric_solver
from armblocks.dynamics.forward import check_accelerations_exist
from armblocks.dynamics.friction import joint_friction
from armblocks.dynamics.joint_entries import entries_of
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.loads import with_payload as carrying
from armblocks.dynamics.lockable_joints import GENERIC_PAYLOAD
from armblocks.dynamics.lockable_mechanism import MechanismEquations, consistent_state
from armblocks.dynamics.mechanism import RANK_TOLERANCE, Array, mechanism
from armblocks.dynamics.reduction import generalised_forces, tree_speeds
from armblocks.dynamics.robot_trace import check_moves, robot_inputs
from armblocks.equations import Signature, TracedFunction
from armblocks.errors import MissingFunctionError, RobotError, counted
from armblocks.robot.constraints import PrescribedMotion
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree


class DrivenMotion(NamedTuple):
    """A consistent state, its accelerations and the torques (n, 1) of all joints."""

    q: SX
    qd: SX
    qdd: SX
    tau: SX


def driven_motion(
    robot: Robot,
    q: SX,
    qd: SX,
    tau: SX,
    qdd: SX,
    *,
    near: Array | None = None,
    wrench: SX | None = None,
    payload: SX | None = None,
    newton_steps: int = 0,
) -> DrivenMotion:
    """The motion at ``q``, ``qd`` with the torques ``tau`` (n, 1) of the free joints and the accelerations
    ``qdd`` (n, 1) of the prescribed joints.

    The other entries of ``tau`` and ``qdd`` are not read. The state is the consistent one nearest to ``q``,
    ``qd`` with the given coordinates and speeds of the prescribed joints; it is NaN if ``q`` is too far from
    the constraints. ``near``: see :func:`independent_relations`; ``newton_steps``: see
    :func:`consistent_state`. Raises RobotError for prescribed joints that depend on each other, and for free
    joints without inertia, unless the constraints determine their motion.
    """
    prescribed = entries_of(robot, robot.prescribed_joints).speeds
    free = entries_of(robot, robot.prescribed_joints, others=True).speeds
    check_drives(robot, near, with_payload=payload is not None)
    mask = SX(np.isin(np.arange(robot.nv), free).astype(float))
    q, qd = consistent_state(robot, q, qd, mask, near, newton_steps=newton_steps)
    equations = MechanismEquations(robot, q, qd, wrench, payload, near)
    M, J, coordinates = equations.M, equations.J, robot.coordinate_map
    rates = entries(tree_speeds(coordinates, qd))
    friction = generalised_forces(coordinates, vertcat(*joint_friction(robot.uncoupled, rates)))
    resistance = equations.bias + friction
    given = qdd[prescribed]
    force = tau[free] - resistance[free] - mtimes(M[free, prescribed], given)
    multipliers, count = SX(0, 1), J.shape[0]
    if count and count == len(free) and not _all_have_inertia(robot, payload is not None):
        # The constraints determine the motion of the free joints, also if these are without inertia.
        J_free = J[:, free]
        by_constraints = symmetric_solver(mtimes(J_free, J_free.T))
        rates_to_reach = -equations.J_bias - mtimes(J[:, prescribed], given)
        x = SX(mtimes(J_free.T, vertcat(*by_constraints(entries(rates_to_reach)))))
        forces = mtimes(M[free, free], x) - force
        multipliers = SX(vertcat(*by_constraints(entries(mtimes(J_free, forces)))))
    else:
        x, multipliers = _free_motion(equations, prescribed, free, force, given)
    result = SX(robot.nv, 1)
    result[prescribed], result[free] = given, x
    torques = SX(tau)
    needed = mtimes(M, result) + resistance
    if J.shape[0]:
        needed = needed - mtimes(J.T, multipliers)
    torques[prescribed] = needed[prescribed]
    return DrivenMotion(q, qd, result, torques)


def _free_motion(
    equations: MechanismEquations, prescribed: list[int], free: list[int], force: SX, given: SX
) -> tuple[SX, SX]:
    """The accelerations of the free joints under ``force``, and the multipliers of the closures."""
    M, J = equations.M, equations.J
    solve = symmetric_solver(M[free, free])
    x = SX(vertcat(*solve(entries(force))))
    if not J.shape[0]:
        return x, SX(0, 1)
    J_free = J[:, free]
    responses = [SX(vertcat(*solve(entries(J_free[i, :].T)))) for i in range(J.shape[0])]
    A = SX(J.shape[0], J.shape[0])
    for k, response in enumerate(responses):
        A[:, k] = mtimes(J_free, response)
    rates_to_reach = -equations.J_bias - mtimes(J[:, prescribed], given) - mtimes(J_free, x)
    multipliers = SX(vertcat(*symmetric_solver(A)(entries(rates_to_reach))))
    for k, response in enumerate(responses):
        x = x + multipliers[k] * response
    return x, multipliers


def with_prescribed_joints(robot: Robot, joints: Sequence[str]) -> Robot:
    """The robot with prescribed motions of these joints only. Raises RobotError, see :class:`Robot`."""
    others = tuple(c for c in robot.constraints if not isinstance(c, PrescribedMotion))
    used = {constraint.name for constraint in others}
    prescribed: list[PrescribedMotion] = []
    for joint in dict.fromkeys(joints):
        name = f"motion of {joint}"
        while name in used:
            name += "'"
        prescribed.append(PrescribedMotion(name=name, joint=joint))
    return replace(robot, constraints=(*others, *prescribed))


def check_drives(robot: Robot, near: Array | None, *, with_payload: bool = False) -> None:
    """Raise RobotError if the prescribed motions contradict each other, or a free joint has no inertia.

    ``with_payload``: whether a payload may give the inertia.
    """
    free = entries_of(robot, robot.prescribed_joints, others=True).speeds
    relations = independent_relations(robot, near)
    _check_independent(robot, free, relations, near)
    if len(free) > len(relations):
        check_accelerations_exist(*_accelerated(robot, with_payload))


def _accelerated(robot: Robot, with_payload: bool) -> tuple[KinematicTree, list[int]]:
    """The tree, perhaps with a payload, and its speeds that the free joints move."""
    free = entries_of(robot, robot.prescribed_joints, others=True).speeds
    moves = robot.coordinate_map.speeds[:, free].any(axis=1)
    tree = regrouped(KinematicTree.of(robot))
    return carrying(tree, GENERIC_PAYLOAD) if with_payload else tree, np.flatnonzero(moves).tolist()


def _all_have_inertia(robot: Robot, with_payload: bool) -> bool:
    """Whether forces determine the accelerations of all free joints without the closures."""
    try:
        check_accelerations_exist(*_accelerated(robot, with_payload))
    except RobotError:
        return False
    return True


def _check_independent(
    robot: Robot, free: Sequence[int], relations: Sequence[int], near: Array | None
) -> None:
    """Raise RobotError unless the speeds of the free joints follow from any speeds of the prescribed ones."""
    if not relations:
        return
    where = f"robot '{robot.name}'"
    dof, count = robot.nv - len(relations), robot.nv - len(free)
    names = ", ".join(f"'{name}'" for name in robot.prescribed_joints)
    if count > dof:
        raise RobotError(
            f"the prescribed joints {names} have {counted(count, 'degree', 'degrees')} of freedom, the "
            f"mechanism has {dof}",
            where=where,
            allowed="at most as many as the mechanism has; the constraints determine all others",
            fix="prescribe fewer joints",
        )
    J = mechanism(robot).balanced(assembled_coordinates(robot, near))[list(relations)]
    s = np.linalg.svd(J[:, free], compute_uv=False)
    if int(np.sum(s > RANK_TOLERANCE * s.max(initial=0.0))) < len(relations):
        raise RobotError(
            f"the constraints do not permit independent motions of the prescribed joints {names}",
            where=where,
            allowed="joints that can move independently at the start",
            fix="prescribe other joints, or start from a configuration that is not singular",
        )


def check_prescribes(robot: Robot) -> None:
    """Raise MissingFunctionError for a robot without prescribed motions."""
    if not robot.prescribed_joints:
        raise MissingFunctionError(
            "no joint has a prescribed motion",
            where=f"robot '{robot.name}'",
            allowed=f"constraints PrescribedMotion of the joints {', '.join(robot.joint_names)}",
            fix="add one to the robot's constraints, or use accel if all torques are given",
        )


def trace_hybrid_dynamics(robot: Robot, near: Array | None = None) -> TracedFunction:
    """``qdd (n,)`` and ``tau (n,)`` of all joints: see :func:`driven_motion`."""
    return _hybrid_dynamics(robot, ("q", "qd", "tau", "qdd"), near)


def trace_hybrid_dynamics_loaded(robot: Robot, near: Array | None = None) -> TracedFunction:
    """As :func:`trace_hybrid_dynamics`, with a wrench at the tip and a payload at the tool."""
    return _hybrid_dynamics(robot, ("q", "qd", "tau", "qdd", "wrench", "payload"), near)


def _hybrid_dynamics(robot: Robot, inputs: Sequence[str], near: Array | None) -> TracedFunction:
    check_moves(robot, "hybrid_dynamics")
    check_prescribes(robot)

    def equations(q: SX, qd: SX, tau: SX, qdd: SX, *loads: SX) -> tuple[SX, SX]:
        named = dict(zip(("wrench", "payload"), loads))
        motion = driven_motion(robot, q, qd, tau, qdd, near=near, **named)
        return motion.qdd, motion.tau

    slots = robot_inputs(robot, inputs)
    named_slots = {slot.name: slot for slot in slots}
    outputs = Signature((named_slots["qdd"], named_slots["tau"]))
    return TracedFunction.trace("hybrid_dynamics", slots, outputs, equations)
