"""Equations of motion of an arm whose joints may be locked by sticking friction or by a stop.

:func:`locked_joints` finds the locked joints at one time. The set is constant between events, so that the
equations are smooth. Sources: Siciliano et al., *Robotics*, 2009, 7.3 (equations of motion); Pfeiffer,
Glocker, *Multibody Dynamics with Unilateral Contacts*, 1996 (stick and slip as a complementarity, impacts).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from casadi import SX, dot, if_else, logic_and, logic_or, mtimes, sign, vertcat
from numpy.typing import NDArray

from armblocks.dynamics.base_parameters import base_parameter_tree
from armblocks.dynamics.constrained import check_no_prescribed_motion
from armblocks.dynamics.crba import FactoredInertia, SquareMatrix, crba
from armblocks.dynamics.forward import check_accelerations_exist
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.loads import tip_wrench, with_payload
from armblocks.dynamics.lockable_mechanism import MechanismEquations
from armblocks.dynamics.mechanism import Array
from armblocks.dynamics.rnea import rnea
from armblocks.dynamics.springs import spring_torques
from armblocks.errors import RobotError, counted
from armblocks.robot.link import Motor
from armblocks.robot.robot import Robot

TORQUE_TOLERANCE = 1e-9
"""A torque against the sliding direction is significant if it exceeds this fraction of the friction."""
GENERIC_PAYLOAD = SX([1.0, 0.1, 0.2, 0.3, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
"""A payload with which an inertia that every payload leaves singular is found."""


@dataclass(frozen=True, eq=False)
class DryFriction:
    """Coulomb friction of the joints, N m or N: ``forward`` >= 0 and ``backward`` <= 0, each (n,).

    A joint sticks while the torque that holds it is within ``breakaway`` times these limits.
    """

    forward: NDArray[np.float64]
    backward: NDArray[np.float64]

    @classmethod
    def of(cls, robot: Robot) -> DryFriction:
        """The Coulomb friction of the motors, referred to the joints by the robot's friction model."""
        limits = np.zeros((robot.n, 2))
        for k, motor in enumerate(robot.motors):
            limits[k] = _dry_limits(robot, motor)
        for joint in robot.coupled_joints:
            own = _dry_limits(robot, joint.link.motor)
            if not own.any():
                continue
            if len(joint.factors) != 1:
                raise RobotError(
                    f"joint '{joint.link.name}' has Coulomb friction and depends on "
                    f"{counted(len(joint.factors), 'coordinate')}",
                    where=f"robot '{robot.name}'",
                    allowed="Coulomb friction at coupled joints that depend on one coordinate",
                    fix="give the friction to the joints on which it depends, or use ForwardDynamics",
                )
            ((k, factor),) = joint.factors.items()
            # Where the factor is negative, the joint moves backwards when the coordinate moves forwards.
            limits[k] += factor * (own if factor > 0.0 else own[::-1])
        return cls(limits[:, 0] + 0.0, limits[:, 1] + 0.0)

    @property
    def joints(self) -> tuple[int, ...]:
        """The joints with Coulomb friction."""
        return tuple(int(k) for k in np.flatnonzero((self.forward != 0.0) | (self.backward != 0.0)))

    def sliding(self, mode: SX) -> SX:
        """The friction torque of joints that slide forwards (1) or backwards (-1); 0 for other joints."""
        return if_else(mode > 0.0, SX(self.forward), if_else(mode < 0.0, SX(self.backward), 0.0))


def _dry_limits(robot: Robot, motor: Motor | None) -> NDArray[np.float64]:
    """Coulomb friction (2,) of a motor at its joint, forwards and backwards."""
    if motor is None:
        return np.zeros(2)
    return robot.friction_model.factors(motor.gear_ratio)[1] * np.array(motor.coulomb_friction)


def viscous_torque(robot: Robot, qd: SX) -> SX:
    """The torque (n,), N m or N, that overcomes viscous friction, by the robot's friction model."""
    factors = np.array([_viscous_factor(robot, motor) for motor in robot.motors])
    torque = SX(factors) * qd
    for joint in robot.coupled_joints:
        factor = _viscous_factor(robot, joint.link.motor)
        if factor:
            row = SX.zeros(robot.n)
            for k, value in joint.factors.items():
                row[k] = value
            torque = torque + row * (factor * dot(row, qd))
    return SX(torque)


def _viscous_factor(robot: Robot, motor: Motor | None) -> float:
    """Torque per speed of a joint, N m s/rad or N s/m."""
    if motor is None:
        return 0.0
    return robot.friction_model.factors(motor.gear_ratio)[0] * motor.viscous_friction


class JointEquations:
    """``M(q) qdd + bias(q, qd) = torque`` at one state, where ``torque`` is the total joint torque.

    ``bias`` includes gravity, springs, velocity terms and the ``wrench`` (see
    :mod:`armblocks.dynamics.traces`); ``M`` and ``bias`` include the ``payload``. Raises RobotError that
    names the joint if the inertia at a joint is zero.
    """

    def __init__(
        self, robot: Robot, q: SX, qd: SX, wrench: SX | None = None, payload: SX | None = None
    ) -> None:
        tree = base_parameter_tree(robot)
        check_accelerations_exist(tree if payload is None else with_payload(tree, GENERIC_PAYLOAD))
        on_bodies = None if wrench is None else tip_wrench(tree, wrench)
        if payload is not None:
            tree = with_payload(tree, payload)
        self._tree = tree
        joints = joint_motions(tree, q)
        no_acceleration = [0.0] * tree.n
        bias = rnea(tree, joints, entries(qd), no_acceleration, tree.gravity, on_bodies)
        self.bias = SX(vertcat(*(a + b for a, b in zip(bias, spring_torques(tree, q)))))
        self._M: SquareMatrix = crba(tree, joints)
        body_of_joint = sorted(range(tree.n), key=lambda i: tree.bodies[i].speed)
        self.M = SX(vertcat(*(vertcat(*(SX(self._M[i][j]) for j in body_of_joint)).T for i in body_of_joint)))

    def solve(self, right: SX, free: SX) -> SX:
        """``x`` with ``M x = right`` in the rows of free joints (1), and exactly 0 for locked joints (0)."""
        n, bodies = self._tree.n, self._tree.bodies
        is_free = [free[body.speed] for body in bodies]
        masked: SquareMatrix = [
            [self._M[i][j] if i == j else self._M[i][j] * is_free[i] * is_free[j] for j in range(n)]
            for i in range(n)
        ]
        factored = FactoredInertia(self._tree, masked)
        solution = factored.solve([right[body.speed] * is_free[i] for i, body in enumerate(bodies)])
        result = SX(n, 1)
        for body, value in zip(bodies, solution):
            result[body.speed] = value
        return result

    def motion(self, torque: SX, free: SX) -> tuple[SX, SX]:
        """``qdd`` (n,), exactly 0 for locked joints, and the torque that holds each locked joint (n,).

        The holding torque of free joints is 0 up to rounding.
        """
        qdd = self.solve(torque - self.bias, free)
        return qdd, torque - self.bias - mtimes(self.M, qdd)

    def speeds_after_impact(self, qd: SX, stopping: SX) -> SX:
        """Speeds after an impact that stops some joints (1) and leaves all other joints free (0).

        The impulse acts only at the joints that stop: ``M (qd+ - qd)`` is 0 for the others.
        """
        speed_change_of_stopping = -stopping * qd
        change = self.solve(-mtimes(self.M, speed_change_of_stopping), 1.0 - stopping)
        return if_else(stopping, 0.0, qd + change)


@dataclass(frozen=True, eq=False)
class JointModes:
    """The modes of the joints, each (n,).

    ``mode``: 1 for a joint that slides forwards or is free, -1 for one that slides backwards, 0 for a locked
    joint. ``contact``: 1 at the upper stop, -1 at the lower stop, else 0.
    """

    mode: SX
    contact: SX


def breakaway_direction(holding_torque: SX, contact: SX, forward: SX, backward: SX) -> SX:
    """Direction in which a locked joint starts to move: 1 forwards, -1 backwards, 0 if it remains locked."""
    forwards = logic_and(holding_torque > forward, contact <= 0.0)
    backwards = logic_and(holding_torque < backward, contact >= 0.0)
    return forwards - backwards


def equations_at(
    robot: Robot, q: SX, qd: SX, wrench: SX | None, payload: SX | None, near: Array | None
) -> JointEquations | MechanismEquations:
    """The equations of motion at a state; ``near``: see :class:`MechanismEquations`."""
    check_no_prescribed_motion(robot)
    if robot.constraints:
        return MechanismEquations(robot, q, qd, wrench, payload, near)
    return JointEquations(robot, q, qd, wrench, payload)


def locked_joints(
    equations: JointEquations | MechanismEquations,
    qd: SX,
    driving: SX,
    start: JointModes,
    friction: DryFriction,
    breakaway: SX,
) -> JointModes:
    """The locked joints, and the sliding directions of all other joints.

    ``driving`` is the torque (n,) at the joints without Coulomb friction and hard stops; ``start`` is the
    initial guess. A moving joint slides. Of the joints at rest, those beyond their friction limit are
    released, and joints that would slide against their direction are locked. The number of repetitions is the
    number of joints. (The accelerations minimise 1/2 qdd' M qdd - qdd' (torque - bias) + sum of friction
    |qdd|, the principle of least constraint. This function is convex and has a unique minimum.) Guards detect
    remaining inconsistencies.
    """
    n = qd.numel()
    dry = np.zeros(n)
    dry[list(friction.joints)] = 1.0
    has_friction = SX(dry)
    forward, backward = breakaway * SX(friction.forward), breakaway * SX(friction.backward)
    tolerance = TORQUE_TOLERANCE * SX(friction.forward - friction.backward)
    mode, contact = start.mode, start.contact
    for iteration in range(n + 1):
        torque = driving - friction.sliding(mode)
        qdd, holding_torque = equations.motion(torque, mode != 0.0)
        released = breakaway_direction(holding_torque, contact, forward, backward)
        slides = mode
        if iteration < n:
            inertia = SX(vertcat(*(equations.M[i, i] for i in range(n))))
            slides = if_else(mode * qdd * inertia < -tolerance, 0.0, mode)
        dry_mode = if_else(qd != 0.0, sign(qd), if_else(mode == 0.0, released, slides))
        stays_locked = logic_and(logic_and(contact != 0.0, mode == 0.0), released == 0.0)
        mode = if_else(has_friction, dry_mode, if_else(stays_locked, 0.0, 1.0))
        contact = if_else(logic_or(mode != 0.0, qd != 0.0), 0.0, contact)
    return JointModes(mode, contact)
