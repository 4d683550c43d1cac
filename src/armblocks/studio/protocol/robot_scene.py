"""A robot as front ends draw it: its bodies once, after that only poses.

Notebooks show robots as well: this file needs no pydantic.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, kw_only=True)
class SceneBody:
    """A body of a robot, which moves with a ``row`` of the poses: 0 is the base, then come the links.

    ``corners`` (F, 3, 3) m and unit ``normals`` (F, 3, 3) of its triangles: base64 of little-endian float32.
    """

    row: int
    material: Literal["paint", "joint", "flange", "base"]
    corners: str
    normals: str


@dataclass(frozen=True, kw_only=True)
class SceneJoint:
    """A joint: the link of ``row`` moves against that of ``carrier``.

    ``frame`` is its pose in the frame of ``carrier`` and ``moving`` its pose in the link's own frame, (16,)
    row by row; z is the joint's axis. The x of ``moving`` has turned from that of ``frame`` by q + ``offset``
    (of a prismatic joint: its origin has moved so far). ``limits`` are in rad or m, ``radius`` (m) is that of
    the drum that is drawn on the joint.
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
class RobotScene:
    """Bodies, joints and size of a robot.

    ``reach`` (m) of the arm; ``foot`` (m): how far the bodies of the base reach below its frame. There are
    ``rows`` poses: of base, links and tool.
    """

    name: str
    reach: float
    foot: float
    rows: int
    bodies: list[SceneBody]
    joints: list[SceneJoint]
