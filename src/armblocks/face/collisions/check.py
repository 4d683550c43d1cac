"""``collisions``: distances of links and obstacles along a motion, and the first contact."""

from __future__ import annotations

import math
from collections.abc import Sequence
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, check_type, counted
from armblocks.face.arm import Arm
from armblocks.face.collisions.obstacles import Box, Cylinder, Obstacle, Plane, Sphere
from armblocks.face.collisions.report import CollisionPair, CollisionReport
from armblocks.face.collisions.scene import Pair, Scene
from armblocks.face.robots import given_arm
from armblocks.face.trajectory import JointTrajectory
from armblocks.face.trajectory_arguments import as_array, positive
from armblocks.robot import Robot

Array = NDArray[np.float64]

FIRST_SAMPLES = 101
MAX_SAMPLES = 20_000
BISECTIONS = 40
WHERE = "collisions"


def collisions(
    arm: Arm | Robot | str | PathLike[str],
    motion: JointTrajectory | ArrayLike,
    obstacles: Sequence[Obstacle] = (),
    *,
    ignore: Sequence[tuple[str, str]] = (),
    margin: float = 0.0,
    resolution: float = 0.005,
) -> CollisionReport:
    """The minimum distance of every two bodies along a motion, and when they first touch.

    Bodies are the base, the links and the obstacles. Each shape in the file of a link is replaced by its
    convex hull. A link without shapes has the default shapes of its drawing. The hull of a mesh with more
    than 120 vertices may be too small: it has only those extreme in 120 directions. The bars of ``Rod``
    constraints are not bodies.

    - ``motion``: a trajectory, or configurations (nq,) or (N, nq), of which only these are checked.
    - ``obstacles``: :class:`Box`, :class:`Sphere`, :class:`Cylinder`, :class:`Plane`.
    - ``ignore``: pairs of names of bodies that are not compared.
    - ``margin`` (m): bodies touch where their distance is at most this margin.
    - ``resolution`` (m): between two samples of a trajectory no body moves by more than about this distance,
      so that only shorter contacts are missed. Times of contacts are located by bisection.

    Three further kinds of pairs are not compared: links that a joint or a closure connects, the base and an
    obstacle, and pairs that touch in almost all configurations (such as the links of a wrist). The result
    lists the pairs of ``ignore`` and the pairs that touch in almost all configurations.

    Raises UnknownNameError for an unknown name in ``ignore``, InputError for motions of another robot.
    """
    arm = given_arm(arm, "collisions")
    where = f"{WHERE} of robot '{arm.name}'"
    named_obstacles = _named(obstacles, where)
    clearance = float(as_array(margin)) if as_array(margin).ndim == 0 else math.nan
    if not 0.0 <= clearance < math.inf:
        raise InputError(
            f"margin = {margin!r}", where=where, allowed="0 or more, in m", fix="give the clearance in m"
        )
    step = positive("resolution", resolution, "m", where)
    scene = Scene.of(arm, named_obstacles, ignore, where)
    if isinstance(motion, JointTrajectory):
        if motion.n != arm.n or arm.nq != arm.n:
            raise InputError(
                f"the trajectory has {counted(motion.n, 'joint')}",
                where=where,
                allowed=f"{arm.nq} coordinates, as many as q of the robot",
                fix="use a trajectory of this robot, or configurations (N, nq)",
            )
        time = _times(scene, motion, step)
        poses = arm.link_poses(np.ascontiguousarray(motion(time)[0]))
    else:
        rows = np.atleast_2d(as_array(motion))
        if rows.ndim != 2 or rows.shape[1] != arm.nq or not len(rows) or not np.isfinite(rows).all():
            raise InputError(
                f"the motion has the shape {rows.shape}",
                where=where,
                allowed=f"a trajectory, ({arm.nq},) or (N, {arm.nq}), finite numbers",
                fix=f"give {counted(arm.nq, 'coordinate')} for each configuration",
            )
        time, poses = np.arange(len(rows), dtype=np.float64), arm.link_poses(rows)
    path = motion if isinstance(motion, JointTrajectory) else None
    found = [_result(scene, pair, time, poses, path, clearance) for pair in scene.pairs]
    found.sort(key=lambda entry: (math.inf if entry.contact is None else entry.contact, entry.distance))
    return CollisionReport(
        name=arm.name,
        samples=len(time),
        unit="s" if path is not None else "",
        pairs=tuple(found),
        excluded=scene.excluded,
        drawn=tuple(link.name for link in arm.robot.links if link.geometry is None),
    )


def _result(
    scene: Scene, pair: Pair, time: Array, poses: Array, path: JointTrajectory | None, margin: float
) -> CollisionPair:
    """The minimum distance of a pair and its first contact, by the poses at the times."""
    distance = scene.distances(pair, poses, margin)
    nearest = int(distance.argmin())
    contact: float | None = None
    touching = np.flatnonzero(distance <= margin)
    if touching.size:
        contact = float(time[touching[0]])
        if path is not None and touching[0]:
            contact = _located(scene, pair, path, (float(time[touching[0] - 1]), contact), margin)
    return CollisionPair(
        first=pair.names[0],
        second=pair.names[1],
        distance=max(0.0, float(distance[nearest])),
        time=float(time[nearest]),
        contact=contact,
    )


def _named(obstacles: Sequence[Obstacle], where: str) -> dict[str, Obstacle]:
    """The obstacles by name; equal names get a number."""
    named_obstacles: dict[str, Obstacle] = {}
    for obstacle in obstacles:
        check_type(obstacle, (Box, Sphere, Cylinder, Plane), "a Box, Sphere, Cylinder or Plane", where=where)
        name, number = obstacle.name, 2
        while name in named_obstacles:
            name, number = f"{obstacle.name} {number}", number + 1
        named_obstacles[name] = obstacle
    return named_obstacles


def _times(scene: Scene, path: JointTrajectory, step: float) -> Array:
    """Times between which no body moves by much more than ``step`` (m)."""
    first = np.linspace(float(path.t[0]), float(path.t[-1]), FIRST_SAMPLES)
    if not path.duration > 0.0:
        return first[:1]
    time = np.union1d(first, _inside_pieces(path, first))
    poses = scene.arm.link_poses(np.ascontiguousarray(path(time)[0]))
    moved = np.zeros(len(time) - 1)
    for row, body in enumerate(scene.bodies):
        if body is not None:
            for hull in range(len(body.radii)):
                points = body.points_at(np.full(len(poses), hull), poses[:, row])
                moved = np.maximum(moved, np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1))
    way = np.append(0.0, np.cumsum(moved))
    ends = way[np.searchsorted(time, first)]
    parts = np.maximum(1, np.ceil(np.diff(ends) / step)).astype(int)
    if parts.sum() > MAX_SAMPLES:
        raise InputError(
            f"a resolution of {step:g} m needs {int(parts.sum())} samples",
            where=f"{WHERE} of robot '{scene.arm.name}'",
            allowed=f"at most {MAX_SAMPLES}",
            fix="give a larger resolution, in m",
        )
    within: list[Array] = [
        np.linspace(a, b, n + 1)[1:-1] for a, b, n in zip(ends[:-1], ends[1:], parts.tolist())
    ]
    return np.union1d(first, np.interp(np.concatenate(within), way, time))


def _inside_pieces(path: JointTrajectory, first: Array) -> Array:
    """The ends and quarters of the pieces of a motion that are shorter than two of the ``first`` times.

    Without them, a motion that returns between two of the first times would look like a rest.
    """
    knots = np.unique(path.rows()[:, 0])
    knots = knots[:: math.ceil(len(knots) / MAX_SAMPLES)]
    quarters = np.linspace(knots[:-1], knots[1:], 4, endpoint=False)
    inside = quarters[:, np.diff(knots) < 2.0 * (first[1] - first[0])].ravel()
    inside = inside if len(inside) <= MAX_SAMPLES else knots
    return inside[(inside > first[0]) & (inside < first[-1])]


def _located(
    scene: Scene, pair: Pair, path: JointTrajectory, interval: tuple[float, float], margin: float
) -> float:
    """The time at which a pair begins to touch, by bisection."""
    apart, touching = interval
    for _ in range(BISECTIONS):
        middle = 0.5 * (apart + touching)
        if not apart < middle < touching:
            break
        pose = scene.arm.link_poses(np.ascontiguousarray(path(np.array([middle]))[0]))
        if scene.distances(pair, pose, margin)[0] <= margin:
            touching = middle
        else:
            apart = middle
    return touching
