"""Torques of the motors of robots with closed loops, for controllers.

The coordinates of a loop are not independent. Controllers therefore control the joints with a motor; the
motion of the other joints follows from the constraints.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from casadi import SX

from armblocks.dynamics.actuation import motor_joints
from armblocks.dynamics.joint_entries import JointEntries, entries_of
from armblocks.dynamics.prescribed_motion import driven_motion, with_prescribed_joints
from armblocks.errors import InputError
from armblocks.robot import Robot

REFERENCE_STEPS = 4
"""Number of Newton steps that make a reference consistent after interpolation of each joint."""


@lru_cache(maxsize=64)
def driven_by_motors(robot: Robot) -> Robot:
    """The robot with prescribed motions of the joints with a motor; errors as in ``motor_joints``."""
    return with_prescribed_joints(robot, motor_joints(robot))


def motor_entries(robot: Robot) -> JointEntries:
    """The entries of q and qd that controllers control: of all joints, or of the motors of closed loops."""
    joints = driven_by_motors(robot).prescribed_joints if robot.closures else robot.joint_names
    return entries_of(robot, joints)


def check_controlled(robot: Robot, where: str) -> None:
    """Raise an error if the motors do not determine a mechanism, or their speeds are not rates of q."""
    if not robot.closures:
        return
    names = driven_by_motors(robot).prescribed_joints
    for name in names:
        joint = robot.link(name).joint
        if joint.nq != joint.nv:
            raise InputError(
                f"joint '{name}' of robot '{robot.name}' has a motor and a quaternion as coordinates",
                where=where,
                allowed="motors at joints whose speeds are the rates of their coordinates",
                fix="replace the joint by revolute joints, or build the controller from other blocks",
            )


def motor_torques(robot: Robot, q: SX, qd: SX, qdd: SX, *, newton_steps: int = 0) -> SX:
    """The torques (n, 1) of the motors; 0 at the other joints.

    Of ``qdd`` (n, 1) only the entries of the motors are read. The state is the consistent state near
    ``q``, ``qd`` in which the motors have the coordinates and speeds of ``q``, ``qd``.
    """
    zero = SX.zeros(robot.n)
    motion = driven_motion(driven_by_motors(robot), q, qd, zero, qdd, newton_steps=newton_steps)
    return motion.tau


def at_motors(robot: Robot, values: SX) -> SX:
    """Values (n, 1) at the joints with a motor, 0 elsewhere; all values without closed loops."""
    if not robot.closures:
        return values
    mask = np.zeros(robot.n)
    mask[motor_entries(robot).speeds] = 1.0
    return SX(mask) * values


def position_errors(robot: Robot, reference: SX, q: SX) -> SX:
    """``reference - q`` (n, 1); in closed loops of the joints with a motor, else 0."""
    if not robot.closures:
        return reference - q
    positions, speeds = motor_entries(robot)
    errors = SX.zeros(robot.n)
    errors[speeds] = reference[positions] - q[positions]
    return errors
