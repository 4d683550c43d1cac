"""The error of the pose of a tool with respect to a target, and its Jacobian, for inverse kinematics."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from casadi import SX, mtimes, vertcat

from armblocks.dynamics.ball_joints import rotation_vector
from armblocks.dynamics.jacobian import columns_at, jacobian_matrix
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.kinematics import body_poses, constant_pose, frame_pose
from armblocks.dynamics.reduction import reduced_columns, tree_coordinates
from armblocks.equations import Signature, Slot, TracedFunction, signature
from armblocks.errors import RobotError
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.orientation import to_quaternion


class ErrorAxes(Enum):
    """The axes in which the error of a pose is expressed."""

    WORLD = "world"
    TARGET = "tool"
    """The axes of the tool at the target."""


def trace_pose_error(
    robot: Robot, frame: str | None = None, axes: ErrorAxes = ErrorAxes.WORLD
) -> TracedFunction:
    """``error (6,)`` and ``J (6, n)`` for ``q (nq,)`` and the target ``T (4, 4)`` in the world.

    ``error``: the displacement from the tool to the target (m), then the rotation vector (rad, at most π)
    from the orientation of the tool to the orientation of the target; both in the given ``axes``. ``J qd`` is
    the velocity of the tool in the same axes, so ``J qd = error`` moves the tool towards the target.
    ``frame``: the name of another frame of the robot that takes the place of the tool.

    With closed loops, q are the coordinates of all joints, and the constraints are additional equations.
    Raises RobotError for a robot without moving joints.
    """
    check_joints(robot)
    tree, coordinates = KinematicTree.of(robot).with_tool_at(frame), robot.coordinate_map

    def equations(q: SX, T: SX) -> tuple[SX, SX]:
        of_tree = entries(tree_coordinates(coordinates, q) if robot.couplings else q)
        ground = constant_pose(tree.base)
        bodies = body_poses(tree, of_tree, ground)
        pose = frame_pose(tree.tool, bodies, ground)
        tool, R = pose.matrix(), T[:3, :3]
        jacobian = jacobian_matrix(columns_at(tree, bodies, pose.p))
        if robot.couplings:
            jacobian = reduced_columns(coordinates, jacobian)
        between = SX(mtimes(R, tool[:3, :3].T))
        rotation = SX(vertcat(*rotation_vector(entries(to_quaternion(between)))))
        displacement = SX(T[:3, 3] - tool[:3, 3])
        if axes is ErrorAxes.TARGET:
            displacement, rotation = SX(mtimes(R.T, displacement)), SX(mtimes(R.T, rotation))
            jacobian = SX(vertcat(mtimes(R.T, jacobian[:3, :]), mtimes(R.T, jacobian[3:, :])))
        return SX(vertcat(displacement, rotation)), jacobian

    inputs = Signature((Slot("q", (robot.nq,), ""), Slot("T", (4, 4), "m")))
    outputs = signature(("error", (6,), ""), ("J", (6, robot.n), ""))
    return TracedFunction.trace("pose_error", inputs, outputs, equations)


def trace_pose_error_in_world(robot: Robot, frame: str | None = None) -> TracedFunction:
    """:func:`trace_pose_error` in the axes of the world."""
    return trace_pose_error(robot, frame, ErrorAxes.WORLD)


def trace_pose_error_in_tool(robot: Robot, frame: str | None = None) -> TracedFunction:
    """:func:`trace_pose_error` in the axes of the tool at the target."""
    return trace_pose_error(robot, frame, ErrorAxes.TARGET)


def check_joints(robot: Robot) -> None:
    """Raise RobotError for a robot without moving joints."""
    if robot.n == 0:
        raise RobotError(
            "no joint moves, so there is no inverse kinematics",
            where=f"robot '{robot.name}'",
            allowed="at least one joint that is not fixed",
            fix="give the robot a joint that moves",
        )


def check_open_chain(robot: Robot) -> None:
    """Raise RobotError for a robot whose inverse kinematics are not defined by its joints alone."""
    check_joints(robot)
    closures: Sequence[str] = [closure.name for closure in robot.closures]
    if closures:
        raise RobotError(
            "closed forms and rates of inverse kinematics do not support closed loops, and the robot has "
            + ", ".join(closures),
            where=f"robot '{robot.name}'",
            allowed="chains and trees of joints, with couplings",
            fix="use arm.ikine(T), which also solves for the joints of closed loops",
        )
