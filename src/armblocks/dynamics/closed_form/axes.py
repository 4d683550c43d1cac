"""The axes of a chain of joints from the base to the tool, in the world, where all joints are at zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import RobotError, counted
from armblocks.robot.robot import Robot
from armblocks.robot.tree import BASE, KinematicTree

Array = NDArray[np.float64]

SAME = 1e-5
"""Largest sine of the angle between parallel axes, and distance relative to the size of the arm between axes
that intersect. Robot files often have angles such as 1.570796; the branches of such arms are approximate."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Axis:
    """A joint axis: its ``direction`` (3,), and a ``point`` (3,) on it, m, in the world.

    The joint's angle (or displacement in m, ``prismatic``) is ``factor (q_tree[position] + offset)``.
    """

    name: str
    direction: Array
    point: Array
    prismatic: bool
    position: int
    factor: float
    offset: float

    def parallel(self, other: Axis) -> bool:
        """Whether two axes have the same or the opposite direction."""
        return float(np.linalg.norm(np.cross(self.direction, other.direction))) < SAME


@dataclass(frozen=True, kw_only=True, eq=False)
class Chain:
    """The ``axes`` from the base to the tool, and the pose of the tool where all joints are at zero.

    ``size``: the sum of the distances between neighbouring points, m. ``to_tree`` (joints of the tree, nq):
    the coordinates of the tree are ``to_tree q`` plus the offsets of the couplings.
    """

    axes: tuple[Axis, ...]
    tool: Array
    size: float
    to_tree: Array

    def coincide(self, one: Axis, other: Axis) -> bool:
        """Whether two axes are the same line."""
        apart = np.cross(one.direction, other.point - one.point)
        return one.parallel(other) and float(np.linalg.norm(apart)) <= SAME * self.size

    def from_tool_to_base(self) -> Chain:
        """The reversed chain, from the tool to the base. Its end has the pose ``T_0 T⁻¹`` for equal angles.

        For ``T = E_1 … E_n T_0``, the reversed chain applies the inverse motions in reverse order.
        """
        axes = tuple(replace(axis, direction=-axis.direction) for axis in reversed(self.axes))
        return replace(self, axes=axes, tool=np.eye(4))

    def common_point(self, *axes: Axis) -> Array | None:
        """The point in which axes intersect; None if they do not. Parallel axes do not intersect."""
        lines = [(np.eye(3) - np.outer(a.direction, a.direction), a.point) for a in axes]
        matrix = sum((P for P, _ in lines), start=np.zeros((3, 3)))
        if np.linalg.cond(matrix) > 1e8:
            return None
        right = sum((P @ p for P, p in lines), start=np.zeros(3))
        x = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
        apart = max(float(np.linalg.norm(P @ (x - p))) for P, p in lines)
        return x if apart <= SAME * self.size else None


def chain_of(robot: Robot, frame: str | None) -> Chain:
    """The chain from the base to the tool or to a frame. Raises RobotError for other joints."""
    tree = KinematicTree.of(robot).with_tool_at(frame)
    carrier = tree.tool.body
    path = [] if carrier == BASE else [*reversed(tree.ancestors(carrier)), carrier]
    pose = tree.base.matrix
    axes: list[Axis] = []
    for k in path:
        body = tree.bodies[k]
        pose = pose @ body.placement.matrix
        if body.ball is not None or (body.angular and body.linear):
            raise RobotError(
                f"the branches of the inverse kinematics have no closed form with the joint '{body.link}'",
                where=f"robot '{robot.name}'",
                allowed="revolute and prismatic joints between the base and the tool",
                fix="use arm.ikine, which supports all types of joints",
            )
        axes.append(
            Axis(
                name=body.link,
                direction=pose[:3, 2].copy(),
                point=pose[:3, 3].copy(),
                prismatic=not body.angular,
                position=body.position,
                factor=body.angular or body.linear,
                offset=body.offset,
            )
        )
    tool = pose @ tree.tool.pose.matrix
    points = [tree.base.p, *(axis.point for axis in axes), tool[:3, 3]]
    size = float(sum(np.linalg.norm(b - a) for a, b in pairwise(points)))
    moving = {axis.position for axis in axes}
    to_tree = robot.coordinate_map.positions if robot.couplings else np.eye(robot.nq)
    idle = [k for k in range(robot.nq) if not any(to_tree[row, k] for row in moving)]
    if idle:
        names = ", ".join(f"'{robot.positions[k].name}'" for k in idle)
        raise RobotError(
            f"{counted(len(idle), 'joint does', 'joints do')} not move the tool: {names}",
            where=f"robot '{robot.name}'",
            allowed="a chain of joints from the base to the tool",
            fix="use arm.ikine, or a robot with the joints of one chain",
        )
    return Chain(axes=tuple(axes), tool=tool, size=size, to_tree=to_tree)


def names_of(axes: Sequence[Axis]) -> str:
    """The names of axes, for messages."""
    return ", ".join(axis.name for axis in axes)
