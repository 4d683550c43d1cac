"""Convex bodies of links and obstacles: hulls of points, enlarged by a radius."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.face.collisions.obstacles import Box, Cylinder, Obstacle, Plane, Sphere
from armblocks.robot import Robot, shapes
from armblocks.robot.geometry import robot_shapes
from armblocks.robot.triangles import triangles

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

SIDES = 24
"""Sides of the prism around a cylinder, which is larger than the cylinder by at most 0.9 % of its radius."""
MAX_POINTS = 120
"""Maximum number of points of a hull; otherwise only points extreme in uniform directions are used."""
_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


class Hull(NamedTuple):
    """The hull of ``points`` (k, 3) enlarged by ``radius``, m, in the frame of its link or in the world."""

    points: Array
    radius: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Body:
    """The n hulls of a link or obstacle: ``points`` (n, K, 3), ``radii`` (n,), and spheres around the hulls.

    Hulls of fewer points repeat their first point. ``centres`` (n, 3) and ``sizes`` (n,): the spheres, m.
    """

    points: Array
    radii: Array
    centres: Array
    sizes: Array

    @classmethod
    def of(cls, hulls: Sequence[Hull]) -> Body:
        """The body of these hulls, at least one."""
        most = max(len(hull.points) for hull in hulls)
        points = np.stack(
            [
                np.concatenate([hull.points, np.repeat(hull.points[:1], most - len(hull.points), axis=0)])
                for hull in hulls
            ]
        )
        radii = np.array([hull.radius for hull in hulls])
        centres = 0.5 * (points.min(axis=1) + points.max(axis=1))
        sizes = np.linalg.norm(points - centres[:, None], axis=2).max(axis=1) + radii
        return cls(points=points, radii=radii, centres=centres, sizes=sizes)

    def centres_at(self, poses: Array) -> Array:
        """The centres (N, n, 3) of the spheres at poses (N, 4, 4)."""
        return np.einsum("nij,kj->nki", poses[:, :3, :3], self.centres) + poses[:, None, :3, 3]

    def points_at(self, hulls: Indices, poses: Array) -> Array:
        """The points (M, K, 3) of M hulls, given by their numbers, at poses (M, 4, 4)."""
        moved = np.einsum("nij,nkj->nki", poses[:, :3, :3], self.points[hulls])
        return np.asarray(moved + poses[:, None, :3, 3])


def link_bodies(robot: Robot) -> list[Body | None]:
    """The bodies of the base, every link and the tool, in the frames of ``link_poses``; None without any."""
    rows = [[_of_shape(shape) for shape in row] for row in robot_shapes(robot)]
    if any(link.geometry is not None for link in robot.links):
        rows[0] = []  # the drawn pedestal is not part of a robot whose links have shapes
    return [Body.of(row) if row else None for row in rows]


def _of_shape(shape: shapes.Shape) -> Hull:
    T = np.array(shape.pose)
    radius = 0.0
    match shape:
        case shapes.Box():
            points = _CORNERS * np.array(shape.size)
        case shapes.Sphere():
            points, radius = np.zeros((1, 3)), shape.radius
        case shapes.Cylinder():
            points = _prism(shape.radius, shape.length)
        case _:
            return Hull(_extreme(triangles(shape).corners.reshape(-1, 3)), 0.0)
    return Hull(points @ T[:3, :3].T + T[:3, 3], radius)


def obstacle_body(obstacle: Obstacle) -> Body | Plane:
    """The body of an obstacle in the world; half-spaces have no hull."""
    match obstacle:
        case Plane():
            return obstacle
        case Sphere():
            return Body.of([Hull(np.array([obstacle.centre]), obstacle.radius)])
        case Box():
            points = _CORNERS * np.array(obstacle.size)
        case Cylinder():
            points = _prism(obstacle.radius, obstacle.length)
    T = obstacle.pose.matrix
    return Body.of([Hull(points @ T[:3, :3].T + T[:3, 3], 0.0)])


def _prism(radius: float, length: float) -> Array:
    angle = 2.0 * math.pi * np.arange(SIDES) / SIDES
    outer = radius / math.cos(math.pi / SIDES)
    ring = np.column_stack([outer * np.cos(angle), outer * np.sin(angle)])
    ends = [np.column_stack([ring, np.full(SIDES, end)]) for end in (-0.5 * length, 0.5 * length)]
    return np.concatenate(ends)


def _extreme(points: Array) -> Array:
    """The different points, or only the points that are extreme in one of ``MAX_POINTS`` directions."""
    points = np.unique(np.round(points, 12), axis=0)
    if len(points) <= MAX_POINTS:
        return points
    k = np.arange(MAX_POINTS) + 0.5
    z, angle = 1.0 - 2.0 * k / MAX_POINTS, math.pi * (3.0 - math.sqrt(5.0)) * k
    flat = np.sqrt(1.0 - z * z)
    directions = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), z])
    return points[np.unique((directions @ points.T).argmax(axis=1))]
