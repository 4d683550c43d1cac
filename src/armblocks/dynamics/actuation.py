"""Inverse dynamics of robots with constraints: the torques of the joints that have a motor.

Joints with prescribed motions count as joints with a motor.

Motors and constraints together exert the torques of the tree, ``tau_tree = tau + J' λ``. ``Z' tau = 0`` holds
for the directions Z in which no motor moves: the joints without a motor. These equations determine the
multipliers λ. Source: Featherstone, *Rigid Body Dynamics Algorithms*, 8.12 (inverse dynamics of closed
loops); Nakamura and Ghodoussi, *Dynamics computation of closed-link robot mechanisms*, IEEE Trans. Robotics
and Automation 1989.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from typing import NamedTuple, Protocol

import numpy as np
from casadi import DM, SX, mtimes, sparsify, vertcat

from armblocks.dynamics.constrained import (
    ConstrainedEquations,
    assembled_coordinates,
    independent_relations,
    nan_unless_consistent,
    symmetric_solver,
)
from armblocks.dynamics.joint_entries import entries_of
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.mechanism import RANK_TOLERANCE, Array, mechanism
from armblocks.equations import TracedFunction, flatten
from armblocks.errors import RobotError, counted
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree


class MotorForces(NamedTuple):
    """Torques (n, 1) of the motors, and the multipliers of all relations of the closures, N or N m.

    The multipliers of redundant relations are 0: their forces are statically indeterminate.
    ``validity``: 0, or NaN if the motion violates the constraints.
    """

    torques: SX
    multipliers: list[SX]
    validity: SX


def motor_forces(
    robot: Robot, q: SX, free_torques: SX, qd: SX | None, qdd: SX | None, near: Array | None
) -> MotorForces:
    """Torques of the joints with a motor, and 0 at all other joints, in the order of qd.

    ``free_torques`` (n, 1): the torques of all joints for the same motion without the closures. ``near``: see
    :func:`independent_relations`. The results are NaN if the motion violates the constraints, because its
    inertia torques would be wrong. Raises RobotError unless the motors and the degrees of freedom agree in
    number and the motors move all of them.
    """
    free_directions = directions_without_motor(robot)
    relations = independent_relations(robot, near)
    _check_actuation(robot, free_directions, relations, near)
    equations = ConstrainedEquations(robot, KinematicTree.of(robot), q, relations)
    J = equations.J
    # Z' J' λ = Z' tau by its normal equations, whose matrix is (J Z) (J Z)'.
    Z = sparsify(DM(free_directions))
    J_passive = mtimes(J, Z)
    solve = symmetric_solver(mtimes(J_passive, J_passive.T))
    multipliers = vertcat(*solve(entries(mtimes(J_passive, mtimes(Z.T, free_torques)))))
    torques = free_torques - mtimes(J.T, multipliers)
    torques[[k for k, row in enumerate(free_directions) if 1.0 in row]] = 0.0
    validity = nan_unless_consistent(equations, qd, qdd)
    of_all = [SX(0.0)] * len(mechanism(robot).names)
    for index, multiplier in zip(relations, entries(multipliers)):
        of_all[index] = SX(multiplier)
    return MotorForces(SX(torques + validity), of_all, validity)


class TorqueTrace(Protocol):
    """The trace of joint torques of a robot; ``near``: see :func:`independent_relations`."""

    def __call__(self, robot: Robot, near: Array | None = None) -> TracedFunction: ...


def of_motors(trace: Callable[[Robot], TracedFunction]) -> TorqueTrace:
    """Make a trace of joint torques return the torques of the motors for robots with closed loops."""

    @wraps(trace)
    def trace_of_motors(robot: Robot, near: Array | None = None) -> TracedFunction:
        traced = trace(robot)
        if not robot.closures:
            return traced

        def equations(*values: SX) -> SX:
            flat = [flatten(value, slot.shape) for value, slot in zip(values, traced.inputs)]
            (free,) = traced.casadi_function().call(flat, True, False)
            named = dict(zip((slot.name for slot in traced.inputs), values))
            qd, qdd = named.get("qd"), named.get("qdd")
            return motor_forces(robot, named["q"], free, qd, qdd, near).torques

        return TracedFunction.trace(traced.name, traced.inputs, traced.outputs, equations)

    return trace_of_motors


def directions_without_motor(robot: Robot) -> Array:
    """A basis Z (n, k) of the speeds at which no motor moves, for the motors of all joints of the tree.

    Motors of joints that couplings determine are included. The directions are single coordinates (a column
    has one entry 1) unless a motor is at a joint that depends on several coordinates without motors.
    """
    driven = {k for k, motor in enumerate(robot.motors) if motor is not None}
    driven |= {*entries_of(robot, robot.prescribed_joints).speeds}
    rows = [joint.factors for joint in robot.coupled_joints if joint.link.motor is not None]
    while single := [{*row} - driven for row in rows if len({*row} - driven) == 1]:
        driven |= set[int]().union(*single)
    several = [row for row in rows if {*row} - driven]
    passive = [k for k in range(robot.nv) if k not in driven]
    basis: Array = np.eye(robot.nv)[:, passive]
    if several:
        turns = np.array([[row.get(k, 0.0) for k in passive] for row in several])
        _, s, Vt = np.linalg.svd(turns)
        rank = int(np.sum(s > RANK_TOLERANCE * s.max()))
        basis = basis @ Vt[rank:].T
    return basis


def motor_joints(robot: Robot) -> tuple[str, ...]:
    """The joints of q that the motors of a robot with closed loops drive, through couplings as well.

    Raises RobotError unless they have as many degrees of freedom as the mechanism and determine the other
    joints, and if a motor drives only the sum of several joints.
    """
    directions = directions_without_motor(robot)
    _check_actuation(robot, directions, independent_relations(robot), None)
    passive = {k for k, row in enumerate(directions) if row.any()}
    if len(passive) != directions.shape[1]:
        joint = next(j for j in robot.coupled_joints if j.link.motor and passive & {*j.factors})
        raise RobotError(
            f"the motor of joint '{joint.link.name}' drives a sum of several joints",
            where=f"robot '{robot.name}'",
            allowed="motors that drive one joint each",
            fix="give the motors to joints that no coupling determines",
        )
    names = [link.name for link in robot.moving_links for _ in range(link.joint.nv)]
    return tuple(dict.fromkeys(name for k, name in enumerate(names) if k not in passive))


def _check_actuation(
    robot: Robot, free_directions: Array, relations: Sequence[int], near: Array | None
) -> None:
    """Raise RobotError unless the joints with a motor determine the joints without a motor."""
    functions = mechanism(robot)
    dof, motors = robot.nv - len(relations), robot.nv - free_directions.shape[1]
    where = f"robot '{robot.name}'"
    drives = "motors or prescribed motions" if robot.prescribed_joints else "motors"
    if motors != dof:
        raise RobotError(
            f"the joints with {drives} have {counted(motors, 'degree', 'degrees')} of freedom, the mechanism "
            f"has {dof}",
            where=where,
            allowed="as many motors as degrees of freedom, so that the torques exist and are unique",
            fix="give a motor (Motor() without inertia is enough) to the actuated joints only",
        )
    J = functions.balanced(assembled_coordinates(robot, near))[list(relations)] @ free_directions
    s = np.linalg.svd(J, compute_uv=False)
    if len(s) and s.min() <= RANK_TOLERANCE * s.max():
        raise RobotError(
            f"the joints with {drives} do not determine the other joints",
            where=where,
            allowed="motors whose joints fix the mechanism when they are locked",
            fix="move a motor to a joint that can still move while the other joints with motors are locked",
        )
