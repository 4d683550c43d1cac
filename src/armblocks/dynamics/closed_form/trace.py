"""All branches of the inverse kinematics of an arm as a traced function."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NoReturn

import numpy as np
from casadi import SX, floor, horzcat, if_else, logic_and, sqrt, sumsqr, vertcat

from armblocks.dynamics.closed_form.axes import Array, Chain, chain_of, names_of
from armblocks.dynamics.closed_form.branches import Branch, Solver
from armblocks.dynamics.closed_form.parallel_axes import (
    all_parallel,
    arm_of_parallel_axes,
    three_parallel_axes,
)
from armblocks.dynamics.closed_form.spherical_wrist import arm_with_one_wrist_axis, spherical_wrist
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.kinematics import body_poses, constant_pose, frame_pose
from armblocks.dynamics.pose_error import check_open_chain
from armblocks.dynamics.reduction import tree_coordinates
from armblocks.equations import Signature, Slot, TracedFunction, signature
from armblocks.errors import RobotError
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree

GEOMETRIES = (
    spherical_wrist,
    three_parallel_axes,
    arm_of_parallel_axes,
    arm_with_one_wrist_axis,
    all_parallel,
)
"""The functions that detect a geometry and return its solver, or None."""


def closed_solver(robot: Robot, frame: str | None = None) -> tuple[Chain, Solver]:
    """The chain of an arm and its solver.

    Raises RobotError with the reason if the arm has none.
    """
    check_open_chain(robot)
    chain = chain_of(robot, frame)
    for one, other in pairwise(axis for axis in chain.axes if not axis.prismatic):
        if chain.coincide(one, other):
            _refuse(
                robot,
                f"the axes {one.name} and {other.name} coincide, so a pose has infinitely many solutions",
            )
    for geometry in GEOMETRIES:
        solver = geometry(chain)
        if solver is not None:
            return chain, solver
    backwards = chain.from_tool_to_base()
    for geometry in GEOMETRIES[:2]:
        solver = geometry(backwards)
        if solver is not None:
            return chain, _reversed(chain, solver)
    return _refuse(robot, _why(chain))


def _refuse(robot: Robot, why: str) -> NoReturn:
    raise RobotError(
        f"the branches of the inverse kinematics have no closed form: {why}",
        where=f"robot '{robot.name}'",
        allowed="arms with a spherical wrist or three parallel axes, SCARA and planar arms, palletisers",
        fix="use arm.ikine, with several seeds for several branches",
    )


def _why(chain: Chain) -> str:
    axes = chain.axes
    if len(axes) > 6:
        return f"with {len(axes)} joints a pose has infinitely many solutions"
    if len(axes) < 6:
        return f"{len(axes)} joints whose axes are not parallel"
    wrist = f"the axes {names_of(axes[3:])} do not intersect in one point"
    parallel = f"the axes {names_of(axes[1:4])} are not parallel while {names_of(axes[4:])} intersect"
    return f"{wrist}, and {parallel}"


def trace_branches(robot: Robot, frame: str | None = None) -> TracedFunction:
    """The B branches for the pose ``T (4, 4)``: ``q (B, nq)``, ``errors (B, 2)`` and ``measures (B, C)``.

    Coordinates that are angles are within half a turn of zero, or within their limits. A branch that does not
    exist is NaN. ``errors``: the distance (m) and the angle (rad, if small) between ``T`` and the pose of the
    branch. ``measures``: one for each choice of the solver; 0 where two branches coincide.
    """
    chain, solver = closed_solver(robot, frame)
    inverse = np.linalg.pinv(chain.to_tree[[axis.position for axis in chain.axes]])
    inverse = np.where(np.abs(inverse) < 1e-12, 0.0, inverse)
    tree, coordinates = KinematicTree.of(robot).with_tool_at(frame), robot.coordinate_map
    ground = constant_pose(tree.base)

    def error(q: SX, T: SX) -> SX:
        of_tree = entries(tree_coordinates(coordinates, q) if robot.couplings else q)
        pose = frame_pose(tree.tool, body_poses(tree, of_tree, ground), ground).matrix()
        position, rotation = SX(T[:3, 3] - pose[:3, 3]), SX(T[:3, :3] - pose[:3, :3])
        angle = sqrt(0.5 * sumsqr(rotation))
        return SX(horzcat(sqrt(sumsqr(position)), angle))

    def equations(T: SX) -> tuple[SX, SX, SX]:
        branches = list(solver.branches(T))
        assert len(branches) == solver.branch_count
        rows = [_coordinates(robot, chain, inverse, branch) for branch in branches]
        measures = [SX(vertcat(*branch.measures)).T for branch in branches]
        errors = [error(row, T) for row in rows]
        return SX(vertcat(*(row.T for row in rows))), SX(vertcat(*errors)), SX(vertcat(*measures))

    B = solver.branch_count
    outputs = signature(
        ("q", (B, robot.nq), ""), ("errors", (B, 2), ""), ("measures", (B, len(solver.choices)), "")
    )
    return TracedFunction.trace("branches", Signature((Slot("T", (4, 4), "m"),)), outputs, equations)


def _reversed(chain: Chain, solver: Solver) -> Solver:
    """The solver of a chain, derived from the solver of its reversed chain (from the tool to the base)."""

    def branches(T: SX) -> Iterator[Branch]:
        R, p = T[:3, :3], T[:3, 3]
        inverse = SX(vertcat(horzcat(R.T, -(R.T @ p)), SX([[0.0, 0.0, 0.0, 1.0]])))
        for branch in solver.branches(SX(chain.tool @ inverse)):
            yield Branch(branch.angles[::-1], branch.measures)

    return solver._replace(geometry=f"{solver.geometry}, from the tool to the base", branches=branches)


def _coordinates(robot: Robot, chain: Chain, inverse: Array, branch: Branch) -> SX:
    """The coordinates q (nq,) of a branch; angles are shifted by full turns into their limits if possible."""
    tree = [value / axis.factor - axis.offset for axis, value in zip(chain.axes, branch.angles)]
    q = SX(inverse @ SX(vertcat(*tree)))
    rows: list[SX] = []
    for k, (entry, (lowest, highest)) in enumerate(zip(robot.positions, robot.qlim)):
        rows.append(_turned(SX(q[k]), lowest, highest) if entry.unit == "rad" else SX(q[k]))
    return SX(vertcat(*rows))


def _turned(angle: SX, lowest: float, highest: float) -> SX:
    """The equivalent angle from -π to π, or one full turn away if only that angle is within the limits."""
    turn = 2.0 * math.pi
    angle = SX(angle - turn * floor(angle / turn + 0.5))
    if highest < math.pi:
        angle = SX(if_else(logic_and(angle > highest, angle - turn >= lowest), angle - turn, angle))
    if lowest > -math.pi:
        angle = SX(if_else(logic_and(angle < lowest, angle + turn <= highest), angle + turn, angle))
    return angle
