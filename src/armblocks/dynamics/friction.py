"""Friction and rotor inertia of the motors, referred to the joints."""

from __future__ import annotations

from collections.abc import Sequence

from casadi import SX, if_else

from armblocks.robot.robot import Robot
from armblocks.spatial.vectors import Scalar


def joint_friction(robot: Robot, qd: Sequence[Scalar]) -> list[Scalar]:
    """The torque that overcomes friction (N m, N): with the sign of ``qd``, to be added to ``tau``.

    The formula is the robot's :class:`FrictionModel`; at ``qd = 0`` there is no Coulomb friction.
    """
    torques: list[Scalar] = []
    for motor, rate in zip(robot.motors, qd):
        if motor is None:
            torques.append(0.0)
            continue
        on_viscous, on_coulomb = robot.friction_model.factors(motor.gear_ratio)
        forward, backward = (on_coulomb * Tc for Tc in motor.coulomb_friction)
        torque: Scalar = on_viscous * motor.viscous_friction * rate
        if forward:
            torque = torque + if_else(SX(rate) > 0.0, forward, 0.0)
        if backward:
            torque = torque + if_else(SX(rate) < 0.0, backward, 0.0)
        torques.append(torque)
    return torques


def rotor_torques(robot: Robot, qdd: Sequence[Scalar]) -> list[Scalar]:
    """The torque ``G^2 Jm qdd`` that accelerates the rotors (without their gyroscopic moments)."""
    return [motor.reflected_inertia * rate if motor else 0.0 for motor, rate in zip(robot.motors, qdd)]
