"""The largest payload within the torque limits, for configurations or for a whole trajectory."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler import cached_kernel
from armblocks.errors import InputError, counted
from armblocks.face.arm import Arm
from armblocks.face.arm_kernels import ArmKernels
from armblocks.face.robots import given_arm
from armblocks.face.trajectory import JointTrajectory
from armblocks.face.trajectory_arguments import as_array
from armblocks.face.trajectory_report import motion_with_torques
from armblocks.face.workspace.arguments import check_robot, load_arguments
from armblocks.robot import Robot

if TYPE_CHECKING:
    from armblocks.equations import TracedFunction

Array = NDArray[np.float64]


def payload_capacity(
    arm: Arm | Robot | str | PathLike[str],
    q: ArrayLike | JointTrajectory,
    qd: ArrayLike | None = None,
    qdd: ArrayLike | None = None,
    *,
    torque: ArrayLike | None = None,
    centre: ArrayLike = (0.0, 0.0, 0.0),
    frame: str | None = None,
    threads: int = 1,
) -> Array | float:
    """The largest mass (kg) at the tool with which the joint torques stay within their limits.

    - ``q`` (nq,) or (N, nq): configurations, rad or m; the result is one mass for each. Or a trajectory; the
      result is one mass for the whole motion.
    - ``qd``, ``qdd`` (n,) or (N, n): speeds and accelerations at ``q``, by default zero.
    - ``torque`` (n,) N m or N: limits, by default the limits of the robot.
    - ``centre`` (3,) m: the centre of mass in the axes of the tool, or of ``frame``.
    - ``frame``: the frame to which the mass is attached, by default the tool.

    The torques are computed as by ``arm.rne``; they are linear in the mass. The result is 0 where the weight
    of the arm alone exceeds a limit, and infinite where the payload loads no joint with a limit.

    Raises InputError without any torque limit, RobotError for closed loops.
    """
    arm = given_arm(arm, "payload_capacity")
    where = f"payload_capacity of robot '{arm.name}'"
    check_robot(arm, where)
    (limits, place, _, _), _ = load_arguments(arm, torque, centre, None, None, where)
    if frame is not None:
        arm.robot.frame(frame)
    if isinstance(q, JointTrajectory):
        if qd is not None or qdd is not None:
            raise InputError(
                "qd or qdd is given with a trajectory",
                where=where,
                allowed="a trajectory alone, which has speeds and accelerations",
                fix="omit qd and qdd",
            )
        _, *motion, _, _ = motion_with_torques(arm, q, None, where)
    else:
        motion = [
            as_array(q),
            *(np.zeros(arm.n) if value is None else as_array(value) for value in (qd, qdd)),
        ]
        for name, values, size in zip(("q", "qd", "qdd"), motion, (arm.nq, arm.n, arm.n)):
            if values.ndim not in (1, 2) or values.shape[-1] != size or not np.isfinite(values).all():
                raise InputError(
                    f"{name} has the shape {values.shape}",
                    where=where,
                    allowed=f"({size},) or (N, {size}), finite numbers",
                    fix=f"give {counted(size, 'number')} for each sample",
                )
    code = ArmKernels(arm.robot, None, arm.__reduce__()).description_key

    def trace() -> TracedFunction:
        from armblocks.dynamics.workspace_measures import trace_payload_capacity

        return trace_payload_capacity(arm.robot, frame)

    kernel = cached_kernel(f"robot/payload_capacity of {frame!r}/{code}", trace)
    masses = np.asarray(kernel(motion[0], limits, place, *motion[1:], threads=threads), dtype=np.float64)
    return float(masses.min()) if isinstance(q, JointTrajectory) else masses
