"""Conversion between standard and modified Denavit-Hartenberg rows of the same arm.

Both conventions describe the same product of rotations and translations,

    Rz(theta1) Tz(d1) · Tx(a1) Rx(alpha1) · Rz(theta2) Tz(d2) · Tx(a2) Rx(alpha2) …

and divide it at different places: a standard row contains the transforms after its joint, a modified row
those before it. The conversion therefore shifts alpha and a by one row; the remainder is added to the tool or
the base. The link frames change, and centres of mass, inertias and shapes are transformed to the new frames.

Sources: Corke, *Robotics, Vision and Control*, 2nd ed., 7.1.2; Craig, *Introduction to Robotics*, 3.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armblocks.errors import RobotError
from armblocks.robot.dh import link_from_dh, serial_chain
from armblocks.robot.dh_row import DhConvention, DhRow
from armblocks.robot.link import Link
from armblocks.robot.robot import Robot
from armblocks.robot.shapes import Pose
from armblocks.spatial import Transform, transl, trotx


def converted(robot: Robot, convention: DhConvention) -> Robot:
    """The same arm in rows of ``convention``: pose of the tool, Jacobian and joint torques are unchanged.

    The link frames change, and with them the meaning of a wrench in the last link's frame. Raises RobotError
    for a robot that is not a single chain of D-H rows.
    """
    rows = _rows(robot)
    if all(row.convention is convention for row in rows):
        return robot
    shifts = [transl(row.a, 0.0, 0.0) @ trotx(row.alpha) for row in rows]
    if convention is DhConvention.MODIFIED:
        alpha_and_a = [(0.0, 0.0), *((row.alpha, row.a) for row in rows[:-1])]
        new_from_old = shifts  # pose of a link's old frame in its new frame, which precedes the shift
        frames = {"tool": shifts[-1] @ robot.tool}
        base_shift = Transform()
    else:
        alpha_and_a = [*((row.alpha, row.a) for row in rows[1:]), (0.0, 0.0)]
        new_from_old = [*(shift.inverse() for shift in shifts[1:]), Transform()]
        frames = {"base": robot.base @ shifts[0]}
        base_shift = shifts[0].inverse()
    links = [
        _with_row(link, replace(row, alpha=alpha, a=a, convention=convention), shift)
        for link, row, (alpha, a), shift in zip(robot.links, rows, alpha_and_a, new_from_old)
    ]
    shift_of: dict[str | None, Transform] = {None: base_shift}
    shift_of.update((link.name, shift) for link, shift in zip(robot.links, new_from_old))
    named = tuple(replace(frame, pose=shift_of[frame.link] @ frame.pose) for frame in robot.frames)
    return replace(robot, links=tuple(links), frames=named, **frames)


def reread(robot: Robot, convention: DhConvention) -> Robot:
    """The same numbers read as rows of the other convention, which describe another arm.

    Raises RobotError in the cases of :func:`converted`.
    """
    rows = [replace(row, convention=convention) for row in _rows(robot)]
    return replace(
        robot, links=tuple(_with_row(link, row, Transform()) for link, row in zip(robot.links, rows))
    )


def _rows(robot: Robot) -> Sequence[DhRow]:
    where = f"robot '{robot.name}'"
    rows = [link.dh for link in robot.links if link.dh is not None]
    if len(rows) < len(robot.links) or robot.links != serial_chain(robot.links):
        raise RobotError(
            "the robot is not a single chain of D-H rows",
            where=where,
            allowed="robots in which every link has a row and the previous link as parent",
            fix="build its links with standard_dh or modified_dh",
        )
    if len({row.convention for row in rows}) > 1:
        raise RobotError(
            "the robot has rows of both conventions",
            where=where,
            allowed="rows of one convention only",
            fix="write all rows in one convention",
        )
    return rows


def _with_row(link: Link, row: DhRow, T_new_old: Transform) -> Link:
    """The link with another row, and its body transformed to the new frame.

    ``T_new_old`` is the pose of the old frame in the new frame.
    """
    R = T_new_old.R
    inertia = R @ link.I @ R.T
    geometry = link.geometry
    if geometry is not None:
        geometry = tuple(replace(shape, pose=_pose(T_new_old, shape.pose)) for shape in geometry)
    return link_from_dh(
        link.name,
        row,
        parent=link.parent,
        limits=link.joint.coordinate_limits[0],
        mass=link.mass,
        centre_of_mass=T_new_old.apply(link.centre_of_mass),
        inertia=(inertia + inertia.T) / 2,
        motor=link.motor,
        geometry=geometry,
    )


def _pose(T_new_old: Transform, pose: Pose) -> Pose:
    new_pose = (T_new_old.matrix @ np.array(pose)).tolist()
    a, b, c, d = ((row[0], row[1], row[2], row[3]) for row in new_pose)
    return a, b, c, d
