"""A robot as front ends draw it: its bodies are sent once, then only poses.

Notebook widgets use this file without pydantic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, kw_only=True)
class SceneBody:
    """A body of a robot; its pose is ``row`` of the poses: row 0 is the base, the links and the tool follow,
    then the rods.

    ``corners`` (F, 3, 3) m and unit ``normals`` (F, 3, 3) of its triangles: base64 of little-endian float32.
    """

    row: int
    material: Literal["paint", "joint", "flange", "base"]
    corners: str
    normals: str


@dataclass(frozen=True, kw_only=True)
class SceneJoint:
    """A joint: the link of ``row`` moves relative to the body of row ``carrier``.

    ``frame`` is the joint frame in the frame of ``carrier``, ``moving`` the joint frame in the link frame,
    both (16,) row by row; z is the joint axis. For a revolute joint, x of ``moving`` is rotated from x of
    ``frame`` by q + ``offset``; for a prismatic joint, its origin is displaced by q + ``offset``. ``limits``
    are in rad or m, ``radius`` (m): radius of the cylinder drawn at the joint.
    """

    name: str
    row: int
    turns: bool
    limits: tuple[float, float] | None
    carrier: int
    frame: list[float]
    moving: list[float]
    offset: float
    radius: float


@dataclass(frozen=True, kw_only=True)
class SceneRod:
    """A rod between the point ``first`` (3,) m in the frame of row ``first_row`` and ``second``.

    The front end computes its pose: the origin is the first point, z points to the second point.
    """

    first_row: int
    first: list[float]
    second_row: int
    second: list[float]


@dataclass(frozen=True, kw_only=True)
class RobotScene:
    """Bodies, joints and size of a robot.

    ``reach`` (m) of the arm; ``foot`` (m): distance by which the bodies of the base extend below its frame.
    ``rows`` is the number of poses: base, links and tool. ``joints``: joints with one axis. ``rest``: the
    coordinates q of the pose that is shown without motion.
    """

    name: str
    reach: float
    foot: float
    rows: int
    bodies: list[SceneBody]
    joints: list[SceneJoint]
    rods: list[SceneRod]
    rest: list[float]
