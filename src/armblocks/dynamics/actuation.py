"""Inverse dynamics of robots with constraints: the torques of the joints that have a motor.

The torques of a tree, ``tau_tree``, are shared between motors and constraints: ``tau_tree = tau + J' λ`` with
``tau = 0`` at joints without a motor. The rows of those joints determine the multipliers λ.
Source: Featherstone, *Rigid Body Dynamics Algorithms*, 8.12 (inverse dynamics of closed loops); Nakamura and
Ghodoussi, *Dynamics computation of closed-link robot mechanisms*, IEEE Trans. Robotics and Automation 1989.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from typing import NamedTuple, Protocol

import numpy as np
from casadi import SX, mtimes, vertcat

from armblocks.dynamics.constrained import (
    ConstrainedEquations,
    assembled_coordinates,
    independent_relations,
    nan_unless_consistent,
    symmetric_solver,
)
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.mechanism import RANK_TOLERANCE, Array, mechanism
from armblocks.equations import TracedFunction, flatten
from armblocks.errors import RobotError, counted
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree


class MotorForces(NamedTuple):
    """Torques (n, 1) of the motors, and the multipliers of all relations of the closures, N or N m.

    The multipliers of relations that follow from others are 0: their forces are statically indeterminate.
    ``validity``: 0, or NaN if the motion violates the constraints.
    """

    torques: SX
    multipliers: list[SX]
    validity: SX


def motor_forces(
    robot: Robot, q: SX, free_torques: SX, qd: SX | None, qdd: SX | None, near: Array | None
) -> MotorForces:
    """Torques of the joints with a motor, and 0 at the others, in the order of qd.

    ``free_torques`` (n, 1): the torques of all joints for the same motion without the closures. ``near``: see
    :func:`independent_relations`. The results are NaN if the motion violates the constraints, because its
    inertia torques would be wrong. Raises RobotError unless the motors and the degrees of freedom agree in
    number and the motors move all of them.
    """
    passive = [k for k, motor in enumerate(robot.motors) if motor is None]
    relations = independent_relations(robot, near)
    _check_actuation(robot, passive, relations, near)
    equations = ConstrainedEquations(robot, KinematicTree.of(robot), q, relations)
    J = equations.J
    # J_p' λ = tau_p by its normal equations, whose matrix is J_p J_p'.
    J_passive = J[:, passive]
    solve = symmetric_solver(mtimes(J_passive, J_passive.T))
    multipliers = vertcat(*solve(entries(mtimes(J_passive, free_torques[passive]))))
    torques = free_torques - mtimes(J.T, multipliers)
    torques[passive] = 0.0
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


def _check_actuation(
    robot: Robot, passive: Sequence[int], relations: Sequence[int], near: Array | None
) -> None:
    """Raise RobotError unless the joints without a motor follow from those with a motor."""
    functions = mechanism(robot)
    dof, motors = robot.nv - len(relations), robot.nv - len(passive)
    where = f"robot '{robot.name}'"
    if motors != dof:
        raise RobotError(
            f"the joints with motors have {counted(motors, 'degree', 'degrees')} of freedom, the mechanism "
            f"has {dof}",
            where=where,
            allowed="as many motors as degrees of freedom, so that the torques exist and are unique",
            fix="give a motor (Motor() without inertia is enough) to the actuated joints only",
        )
    J = functions.jacobian(assembled_coordinates(robot, near))[np.ix_(relations, passive)]
    s = np.linalg.svd(J, compute_uv=False)
    if len(s) and s.min() <= RANK_TOLERANCE * s.max():
        raise RobotError(
            "the joints with motors do not determine the other joints",
            where=where,
            allowed="motors whose joints fix the mechanism when they are locked",
            fix="move a motor to a joint that can still move while the others are locked",
        )
