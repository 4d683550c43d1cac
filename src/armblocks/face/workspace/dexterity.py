"""The dexterous index: the share of directions that the tool can have at a position."""

from __future__ import annotations

import math
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, UnknownNameError
from armblocks.face.arm import Arm
from armblocks.face.robots import given_arm
from armblocks.face.trajectory_arguments import as_array
from armblocks.face.workspace.arguments import whole
from armblocks.robot import Robot

Array = NDArray[np.float64]

CHUNK = 20_000
"""Poses that are solved at once."""
MAX_DIRECTIONS = 10_000
ROLLS = 4
"""Searches for each direction, from targets that are rotated about the axis by 90 degrees. The rotation is
free, but a search towards a target that is rotated by almost 180 degrees about it may not converge."""


def dexterity(
    arm: Arm | Robot | str | PathLike[str],
    points: ArrayLike,
    directions: int | ArrayLike = 50,
    *,
    axis: str = "z",
    frame: str | None = None,
    limits: bool = True,
    tolerance: float = 1e-6,
    restarts: int = 20,
    seed: int = 0,
    threads: int = 1,
) -> Array:
    """The dexterous index of ``points`` (3,) or (N, 3), m in the world: 0 to 1 for each point.

    It is the share of ``directions`` in which the ``axis`` of the tool can point at the position. The
    rotation about this axis is free. A point with the index 1 is in the dexterous region.

    - ``directions``: a number of almost uniform directions (a Fibonacci lattice), or vectors (D, 3) in the
      world.
    - ``axis``: ``"x"``, ``"y"`` or ``"z"``, an axis of the tool or of ``frame``.
    - ``frame``: the frame that reaches the points, by default the tool.
    - ``limits``, ``tolerance`` (m and rad), ``restarts``, ``seed``: every direction is a search by
      :meth:`Arm.ikine` with these arguments. A search that misses a solution lowers the index.

    Source: Vijaykumar, Waldron, Tsai, IJRR 5(2), 1986 (dexterous workspace). Raises InputError for wrong
    shapes.
    """
    arm = given_arm(arm, "dexterity")
    where = f"dexterity of robot '{arm.name}'"
    if axis not in ("x", "y", "z"):
        raise UnknownNameError("axis", str(axis), ("x", "y", "z"), where=where)
    places = as_array(points)
    if places.ndim not in (1, 2) or places.shape[-1] != 3 or not np.isfinite(places).all():
        raise InputError(
            f"points has the shape {places.shape}",
            where=where,
            allowed="(3,) or (N, 3), finite numbers, m in the world",
            fix="give x, y, z of each point",
        )
    rotations = _rotations(_directions(directions, where), axis)
    rolled = [rotations @ _roll(axis, 0.5 * math.pi * k) for k in range(ROLLS)]
    mask = np.ones(6)
    mask[3 + "xyz".index(axis)] = 0.0
    flat = places.reshape(-1, 3)
    found = np.zeros(len(flat))
    D = len(rotations)
    for first in range(0, len(flat), max(1, CHUNK // D)):
        part = flat[first : first + max(1, CHUNK // D)]
        reached = np.zeros(len(part) * D, dtype=bool)
        for turned in rolled:
            targets = np.tile(np.eye(4), (len(part), D, 1, 1))
            targets[..., :3, :3] = turned
            targets[..., :3, 3] = part[:, None]
            (rest,) = np.nonzero(~reached)
            if not rest.size:
                break
            solved = arm.ikine(
                targets.reshape(-1, 4, 4)[rest],
                mask=mask,
                limits=limits,
                frame=frame,
                tolerance=tolerance,
                restarts=restarts,
                seed=seed,
                threads=threads,
            )
            reached[rest] = np.asarray(solved.success)
        found[first : first + len(part)] = reached.reshape(len(part), D).mean(axis=1)
    return found.reshape(places.shape[:-1])


def _directions(directions: int | ArrayLike, where: str) -> Array:
    if np.ndim(directions) == 0:
        D = whole("directions", directions, 1, MAX_DIRECTIONS, where)
        k = np.arange(D) + 0.5
        z, angle = 1.0 - 2.0 * k / D, math.pi * (3.0 - math.sqrt(5.0)) * k
        radius = np.sqrt(1.0 - z * z)
        return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    vectors = np.atleast_2d(as_array(directions))
    lengths = np.linalg.norm(vectors, axis=-1)
    if vectors.ndim != 2 or vectors.shape[-1] != 3 or not np.isfinite(lengths).all() or not lengths.all():
        raise InputError(
            f"directions has the shape {vectors.shape}, or a vector without direction",
            where=where,
            allowed="a number, or vectors (D, 3) that are finite and not zero",
            fix="give directions=50",
        )
    return vectors / lengths[:, None]


def _roll(axis: str, angle: float) -> Array:
    """The rotation matrix (3, 3) about an axis."""
    k = "xyz".index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = math.cos(angle)
    R[j, i], R[i, j] = math.sin(angle), -math.sin(angle)
    return R


def _rotations(directions: Array, axis: str) -> Array:
    """Rotation matrices (D, 3, 3) whose ``axis`` has the given directions."""
    k = "xyz".index(axis)
    smallest = np.eye(3)[np.abs(directions).argmin(axis=1)]
    second = np.cross(directions, smallest)
    second /= np.linalg.norm(second, axis=-1, keepdims=True)
    R = np.empty((len(directions), 3, 3))
    R[:, :, k] = directions
    R[:, :, (k + 1) % 3] = second
    R[:, :, (k + 2) % 3] = np.cross(directions, second)
    return R
