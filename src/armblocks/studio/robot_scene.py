"""A robot as the page draws it: bodies once, then only poses. The page knows no kinematics."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError
from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames, reach, robot_bodies


def scene_of(robot: Robot) -> dict[str, Any]:
    """Bodies, joints and size of a robot.

    ``bodies``: for each the ``row`` of ``link_poses`` that it moves with (0 the base, then the links), its
    ``material``, and its triangles: ``corners`` (F, 3, 3) m and unit ``normals`` (F, 3, 3) as base64 of
    little-endian float32. ``joints``: name, row, whether it turns, limits (rad or m). ``reach`` m.
    """
    rows = {link.name: row for row, link in enumerate(robot.links, start=1)}
    return {
        "name": robot.name,
        "reach": reach(robot),
        "rows": len(robot.links) + 2,
        "bodies": [
            {
                "row": body.row,
                "material": body.mesh.material.value,
                "corners": _packed(body.mesh.corners),
                "normals": _packed(body.mesh.normals),
            }
            for body in robot_bodies(robot)
        ],
        "joints": [
            {
                "name": link.name,
                "row": rows[link.name],
                "turns": bool(link.joint.turn),
                "limits": list(link.joint.limits.position) if link.joint.limits.position else None,
            }
            for link in robot.moving_links
        ],
    }


def link_frames_of(robot: Robot, q: Sequence[float]) -> list[Any]:
    """Poses of base, links and tool at ``q``, (L+2, 4, 4); raises ``InputError`` for a wrong count."""
    if len(q) != len(robot.moving_links):
        raise InputError(
            f"{len(q)} joint coordinates were given",
            where=f"robot '{robot.name}'",
            allowed=f"{len(robot.moving_links)}, one for each joint",
        )
    return link_frames(robot, q).tolist()


def _packed(numbers: NDArray[np.float64]) -> str:
    return base64.b64encode(np.ascontiguousarray(numbers, dtype="<f4").tobytes()).decode("ascii")
