"""A robot as front ends draw it: bodies are sent once, then only poses, which the server computes."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError, counted
from armblocks.robot import Link, Robot
from armblocks.robot.geometry import drum_radii, link_frames, reach, robot_bodies
from armblocks.robot.rod_bars import rod_bars
from armblocks.spatial import Transform, rotation_about, trotx
from armblocks.studio.protocol.robot_scene import RobotScene, SceneBody, SceneJoint, SceneRod


def scene_of(robot: Robot) -> RobotScene:
    """Return the bodies, joints and size of a robot."""
    rows: dict[str | None, int] = {link.name: row for row, link in enumerate(robot.links, start=1)}
    rows[None] = 0
    radii = drum_radii(robot)
    ranges = {entry.name: limits.position for entry, limits in zip(robot.speeds, robot.limits)}
    bodies = robot_bodies(robot)
    lowest_points = [float(body.mesh.corners[..., 2].min()) for body in bodies if body.row == 0]
    return RobotScene(
        name=robot.name,
        reach=reach(robot),
        foot=max(0.0, -min(lowest_points, default=0.0)),
        rows=len(robot.links) + 2,
        bodies=[
            SceneBody(
                row=body.row,
                material=body.mesh.material.value,
                corners=_packed(body.mesh.corners),
                normals=_packed(body.mesh.normals),
            )
            for body in bodies
        ],
        joints=[
            SceneJoint(
                name=link.name,
                row=rows[link.name],
                turns=link.joint.rotates,
                limits=ranges[link.name],
                carrier=rows[link.parent],
                frame=(link.before @ _z_along_axis(link)).matrix.ravel().tolist(),
                moving=(link.after.inverse() @ _z_along_axis(link)).matrix.ravel().tolist(),
                offset=link.joint.offset,
                radius=radii[link.name],
            )
            for link in robot.moving_links
            if link.joint.nv == 1
        ],
        rods=[
            SceneRod(
                first_row=bar.rows[0],
                first=list(bar.points[0]),
                second_row=bar.rows[1],
                second=list(bar.points[1]),
            )
            for bar in rod_bars(robot)
        ],
        rest=rest_of(robot),
    )


def rest_of(robot: Robot) -> list[float]:
    """The neutral coordinates, moved into the joint limits."""
    low, high = robot.qlim.T
    return np.clip(robot.neutral, low, high).tolist()


def _z_along_axis(link: Link) -> Transform:
    """The rotation of the joint frame that aligns z with the joint axis."""
    x, y, z = link.joint.axis
    sine = math.hypot(x, y)
    if sine < 1e-12:
        return Transform() if z > 0 else trotx(math.pi)
    return Transform(rotation=rotation_about((-y / sine, x / sine, 0.0), math.atan2(sine, z)))


def link_frames_of(robot: Robot, q: Sequence[float]) -> list[list[list[float]]]:
    """Poses of base, links and tool at ``q``, (L+2, 4, 4); raises ``InputError`` for a wrong length."""
    if len(q) != robot.nq:
        raise InputError(
            f"{counted(len(q), 'joint coordinate was', 'joint coordinates were')} given",
            where=f"robot '{robot.name}'",
            allowed=f"{robot.nq}, one for each coordinate",
            fix="give one number for each coordinate",
        )
    return link_frames(robot, q).tolist()


def _packed(numbers: NDArray[np.float64]) -> str:
    return base64.b64encode(np.ascontiguousarray(numbers, dtype="<f4").tobytes()).decode("ascii")
