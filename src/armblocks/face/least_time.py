"""The time-optimal motion of an arm along a path under limits of speed, acceleration and torque."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, RobotError, counted
from armblocks.face.arm import Arm
from armblocks.face.payload import Payload
from armblocks.face.robots import given_arm
from armblocks.face.trajectory import JointTrajectory, sampled
from armblocks.face.trajectory_arguments import joint_limits, positive, via_points
from armblocks.planning.least_time import Limits, segment_times, solve
from armblocks.report.motion_summary import limit_findings, warn_of_limits
from armblocks.robot import Robot
from armblocks.trajectories import Motion, PiecewisePolynomial
from armblocks.trajectories.paths import blended_path, spline_path, turning_points
from armblocks.trajectories.piecewise import hermite

Array = NDArray[np.float64]

_FASTEST = 1e12
"""Squared path speed where no joint speed is limited."""
_ROUNDING = 1e-12
"""Torques that are smaller, relative to their terms, are rounding errors."""
_SAME = 4e-15
"""Points are the same up to this distance, relative to coordinates above 1: the path between them would be
shorter than its rounding errors."""
_QUARTERS = np.array([0.25, 0.75])
_SMALL, _ACCEPTED = 8e-4, 2e-2
"""Excess over a limit between grid points, relative to the limit: above the first number the limits are
corrected, above the second number an error is raised."""
_ROUNDS, _CORRECTION = 8, 1.3
"""Maximum number of corrections, and the multiple of the excess by which each correction reduces the
limits."""


@dataclass(frozen=True, kw_only=True)
class MotionLimits:
    """Greatest magnitudes (n,) of speeds, accelerations and torques; infinite where there is no limit."""

    speed: Array
    acceleration: Array
    torque: Array


def least_time(
    arm: Arm | Robot | str | PathLike[str],
    points: ArrayLike,
    *,
    speed: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    torque: ArrayLike | None = None,
    payload: Payload | float | None = None,
    blend: float | None = None,
    grid: int = 200,
    dt: float = 0.01,
) -> JointTrajectory:
    """The time-optimal motion of ``arm`` from rest to rest along the path through ``points`` (K, n).

    - ``points``: joint coordinates, rad or m. The path is the cubic spline through the points.
    - ``speed``, ``acceleration``, ``torque``: greatest magnitudes, numbers or (n,), in rad or m, s, N m or N.
      By default speeds and torques have the limits of the robot, and accelerations have none.
    - ``payload``: a :class:`Payload`, or a mass (kg) at the tool.
    - ``blend``: with this argument, the path consists of straight lines in joint space with parabolas at the
      inner points. A parabola replaces this fraction (above 0, up to 0.5) of the shorter adjacent line.
    - ``grid``: minimum number of segments of the path.
    - ``dt``: time between samples, s.

    Torques are computed as by ``arm.rne``: rigid bodies, payload, rotor inertia, gravity, viscous and Coulomb
    friction of the motion. The acceleration jumps at each segment of the grid. Strong viscous friction can
    cause separate intervals of feasible speeds; only the slowest interval is used.

    Source: Pham and Pham, A new approach to time-optimal path parameterization based on reachability
    analysis, IEEE Trans. Robotics 2018. Viscous friction and the limits between grid points are added by
    iteration.

    Raises InputError for a path that is infeasible, with the joint whose torque is too small, and for paths
    without a limit; RobotError for robots with ball joints or closed loops. Warns of positions outside the
    limits of the joints, which a spline may pass between the points.
    """
    arm = given_arm(arm, "least_time")
    where = "least_time"
    robot = arm.robot
    check_joint_space(arm, where)
    via = via_points("points", points, where)
    if via.shape[1] != arm.n:
        raise InputError(
            f"the points have {counted(via.shape[1], 'joint')}",
            where=where,
            allowed=f"{arm.n}, the number of joints of robot '{robot.name}'",
            fix="give one number for each joint",
        )
    limits = motion_limits(arm, where, speed, acceleration, torque)
    step = positive("dt", dt, "s", where)
    if type(grid) is not int or grid < 10:
        raise InputError(
            f"grid = {grid!r}",
            where=where,
            allowed="an integer of 10 or more: the least number of segments",
            fix="omit grid for 200 segments",
        )
    path = path_through(via, limits, blend)
    result = sampled(fastest_motion(arm, path, limits, payload, grid_of(arm, path, grid)), step)
    warn_of_limits(limit_findings(robot, result.t, result.q))
    return result


def check_joint_space(arm: Arm, where: str) -> None:
    """Raise RobotError for robots whose coordinates cannot be moved independently along a path."""
    if arm.nq != arm.nv or arm.robot.closures:
        kind = "closed loops" if arm.robot.closures else "ball joints"
        raise RobotError(
            f"the robot has {kind}",
            where=f"{where}, robot '{arm.name}'",
            allowed="robots whose joint coordinates are independent numbers",
            fix="use a robot without them, such as the tree of its links",
        )


def motion_limits(
    arm: Arm,
    where: str,
    speed: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    torque: ArrayLike | None = None,
) -> MotionLimits:
    """The limits of a motion, by default the limits of the robot."""

    def given(name: str, value: ArrayLike | None, default: Array) -> Array:
        return default if value is None else joint_limits(name, value, arm.n, where, infinite=True)

    return MotionLimits(
        speed=given("speed", speed, arm.robot.speed_limits),
        acceleration=given("acceleration", acceleration, np.full(arm.n, np.inf)),
        torque=given("torque", torque, arm.robot.torque_limits),
    )


def fastest_motion(
    arm: Arm, path: PiecewisePolynomial, limits: MotionLimits, payload: Payload | float | None, s: Array
) -> PiecewisePolynomial:
    """The time-optimal motion along a path ``q(s)`` on the grid ``s`` (N + 1,), which contains its knots."""
    lengths, points = np.diff(s), _points(path, s)
    problem = _problem(arm, points, limits, payload, lengths)
    margin = np.zeros_like(problem.a[0])
    solution = solve(problem, margin)
    if solution.failed is not None:
        _raise_infeasible(arm, path, limits, payload, s, solution.failed)
    for _ in range(_ROUNDS):
        beyond, factor = _between(arm, path, limits, payload, s, solution.x)
        excess = max(float((beyond / problem.bound).max(initial=0.0)), float(factor.max()) - 1.0)
        solution = replace(solution, excess=max(solution.excess, excess))
        if excess <= _SMALL:
            break
        margin += _CORRECTION * np.maximum(beyond, 0.0)
        slower = np.maximum(factor, 1.0) ** (-2.0 * _CORRECTION)
        problem.fastest[:-1] *= slower
        problem.fastest[1:] *= slower
        corrected = solve(problem, margin)
        if corrected.failed is not None:
            break
        solution = corrected
    if solution.excess > _ACCEPTED:
        raise InputError(
            f"a limit is exceeded by {solution.excess:.2g} of its value between points of the grid",
            where="least_time",
            allowed=f"{_ACCEPTED:g} after all corrections",
            fix="use a finer grid, or points that are farther apart",
        )
    return _motion(points, lengths, solution.x)


def _between(
    arm: Arm,
    path: PiecewisePolynomial,
    limits: MotionLimits,
    payload: Payload | float | None,
    s: Array,
    x: Array,
) -> tuple[Array, Array]:
    """Excess at a quarter and three quarters of each segment: of torques and accelerations (N, R), and the
    ratios (N,) of speeds to their limits."""
    lengths, change = np.diff(s)[:, None], np.diff(x)[:, None]
    motion = path.at((s[:-1, None] + lengths * _QUARTERS).ravel())
    squared = (x[:-1, None] + change * _QUARTERS).ravel()[:, None]
    u = np.repeat(change / (2.0 * lengths), len(_QUARTERS), axis=0)
    qd, qdd = motion.qd * np.sqrt(squared), motion.qd * u + motion.qdd * squared
    bounds = np.concatenate([limits.torque, limits.acceleration])
    values = np.abs(np.hstack([_torque(arm, motion.q, qd, qdd, payload), qdd])) - bounds
    shape = (len(lengths), len(_QUARTERS), -1)
    ratios = np.abs(qd / limits.speed).reshape(shape).max(axis=(1, 2))
    return values[:, np.isfinite(bounds)].reshape(shape).max(axis=1), ratios


def path_through(points: Array, limits: MotionLimits, blend: float | None) -> PiecewisePolynomial:
    """The path through the points; joints are scaled by their speed limits, or by their ranges of motion."""
    rounding = _SAME * np.maximum(np.abs(points[:-1]), 1.0)
    same = np.flatnonzero((np.abs(np.diff(points, axis=0)) <= rounding).all(axis=1))
    if same.size:
        raise InputError(
            f"the points {same[0] + 1} and {same[0] + 2} are the same",
            where="least_time",
            allowed="points that differ from the previous point",
            fix="remove one of them",
        )
    scale = np.where(np.isfinite(limits.speed), limits.speed, 1.0)
    if blend is None or len(points) == 2:
        return spline_path(points, scale)
    if not 0.0 < blend <= 0.5:
        raise InputError(
            f"blend = {blend!r}",
            where="least_time",
            allowed="a number above 0 and up to 0.5: the fraction of a line that a blend replaces",
            fix="omit blend for a path through the points",
        )
    return blended_path(points, scale, blend)


def grid_of(arm: Arm, path: PiecewisePolynomial, count: int) -> Array:
    """A grid of at least ``count`` segments, with points at the knots and where Coulomb friction jumps."""
    slow = np.full(arm.n, 1e-9)
    has_coulomb = np.abs(arm.friction(slow)) + np.abs(arm.friction(-slow)) > 1e-6
    knots = path.times
    if has_coulomb.any():
        knots = np.unique(np.append(knots, turning_points(path, has_coulomb)))
    grid: list[Array] = [knots[:1]]
    for begin, end in pairwise(knots):
        parts = max(math.ceil(count * (end - begin) / (knots[-1] - knots[0])), 4)
        grid.append(np.linspace(float(begin), float(end), parts + 1)[1:])
    return np.concatenate(grid)


@dataclass(frozen=True, kw_only=True)
class _GridPoints:
    """The path and its derivatives (M, n) at separate points, and the indices (3, N) of start, middle and end
    of each segment."""

    path: Motion[Array]
    index: NDArray[np.int64]

    def at(self, values: Array) -> Array:
        """The values (3, N, …) at start, middle and end of each segment, of values (M, …)."""
        return values[self.index]


def _points(path: PiecewisePolynomial, s: Array) -> _GridPoints:
    N = len(s) - 1
    every = np.empty(2 * N + 1)
    every[::2], every[1::2] = s, (s[:-1] + s[1:]) / 2.0
    start = 2 * np.arange(N)
    index = np.stack([start, start + 1, start + 2])
    motion = path.at(every)
    # The curvature may jump at the inner knots.
    knots = np.searchsorted(s, path.times[1:-1])
    if knots.size:
        before = path.at(path.times[1:-1], side="left")
        motion = Motion(*(np.concatenate(pair) for pair in zip(motion, before)))
        index[2, knots - 1] = 2 * N + 1 + np.arange(len(knots))
    return _GridPoints(path=motion, index=index)


def _problem(
    arm: Arm, points: _GridPoints, limits: MotionLimits, payload: Payload | float | None, lengths: Array
) -> Limits:
    """The linear constraints at the start, the middle and the end of each segment of the grid."""
    _, first, second = points.path
    bounds = np.concatenate([limits.torque, limits.acceleration])
    rows = np.isfinite(bounds)
    shape = (*points.index.shape, arm.n)
    torques: tuple[Array | float, ...] = (0.0, 0.0, 0.0, 0.0)
    if np.isfinite(limits.torque).any():
        torques = _torque_terms(arm, points, payload)
    along = (points.at(first), points.at(second), 0.0, 0.0)
    values: list[Array] = []
    for torque, acceleration in zip(torques, along):
        both = np.empty((*shape[:2], 2 * arm.n))
        both[..., : arm.n], both[..., arm.n :] = torque, acceleration
        values.append(both if rows.all() else both[..., rows])
    with np.errstate(divide="ignore"):
        squared = points.at(np.abs(first / limits.speed).max(axis=1) ** -2.0)
    if not rows.any() and not np.isfinite(squared).all():
        raise InputError(
            f"nothing limits the motion of the robot '{arm.name}'",
            where="least_time",
            allowed="limits of the speeds, accelerations or torques of the joints that move",
            fix="give speed=, acceleration= or torque=, or limits in the robot's file",
        )
    ends = np.minimum(np.append(squared[0], np.inf), np.append(np.inf, squared[2]))
    return Limits(
        lengths=lengths,
        fastest=np.minimum(ends, _FASTEST),
        fastest_middle=np.minimum(squared[1], _FASTEST),
        bound=bounds[rows],
        **dict(zip("abcd", values)),
    )


def _torque_terms(arm: Arm, points: _GridPoints, payload: Payload | float | None) -> tuple[Array, ...]:
    """The terms a, b, c, d (3, N, n) of the torques ``a u + b x + c + d y`` in each segment."""
    q, first, second = points.path
    zero = np.zeros_like(q)
    # Torques at rest, for unit acceleration along the path, and at the path speeds 1 and 2.
    qd = np.concatenate([zero, zero, first, 2.0 * first])
    qdd = np.concatenate([zero, first, second, 4.0 * second])
    gravity, a, once, twice = np.split(_torque(arm, np.concatenate([q, q, q, q]), qd, qdd, payload), 4)
    coulomb = _coulomb(arm, first)
    # once = gravity + coulomb + d + b, twice = gravity + coulomb + 2 d + 4 b
    b = (twice - 2.0 * once + gravity + coulomb) / 2.0
    d = once - gravity - coulomb - b
    d[np.abs(d) <= _ROUNDING * (np.abs(once) + np.abs(gravity))] = 0.0
    a, b, c, d = (points.at(values) for values in (a - gravity, b, gravity + coulomb, d))
    # A joint that reverses at a grid point has the direction of the segment.
    at_rest = np.abs(points.at(first)) <= 1e-12 * np.abs(first).max()
    if at_rest.any():
        middle = first[points.index[1]]
        of_segment = _coulomb(arm, middle)
        c += np.where(at_rest, of_segment - points.at(coulomb), 0.0)
    return a, b, c, d


def _coulomb(arm: Arm, qd: Array) -> Array:
    """The Coulomb friction, without the viscous friction, which is linear in the speeds."""
    once, twice = np.split(arm.friction(np.concatenate([qd, 2.0 * qd])), 2)
    return 2.0 * once - twice


def _torque(arm: Arm, q: Array, qd: Array, qdd: Array, payload: Payload | float | None) -> Array:
    return arm.rne(q, qd, qdd) if payload is None else arm.rne(q, qd, qdd, payload=payload)


def _motion(points: _GridPoints, lengths: Array, x: Array) -> PiecewisePolynomial:
    """The motion over time; each segment is the quintic with the exact derivatives at both of its ends."""
    times = np.append(0.0, np.cumsum(segment_times(x, lengths)))
    u = (np.diff(x) / (2.0 * lengths))[:, None]
    y = np.sqrt(x)
    start, end = (
        (q, first * speed[:, None], first * u + second * squared[:, None])
        for (q, first, second), speed, squared in (
            (tuple(part[points.index[0]] for part in points.path), y[:-1], x[:-1]),
            (tuple(part[points.index[2]] for part in points.path), y[1:], x[1:]),
        )
    )
    last = np.array([part[-1] for part in end])
    last[1] = 0.0
    return hermite(times, start, end, end=last)


def _raise_infeasible(
    arm: Arm,
    path: PiecewisePolynomial,
    limits: MotionLimits,
    payload: Payload | float | None,
    s: Array,
    index: int,
) -> None:
    """Raise InputError for an infeasible grid point, with the torques that hold the arm there."""
    q = path.at(s[index]).q
    zero = np.zeros_like(q)
    holding = _torque(arm, q, zero, zero, payload)
    friction = np.abs(arm.friction(path.at(s[index]).qd * 1e-9))
    missing = (np.abs(holding) + friction) / limits.torque
    k = int(np.argmax(missing))
    name = arm.robot.joint_names[k] if len(arm.robot.joint_names) == arm.n else f"joint {k + 1}"
    share = (s[index] - s[0]) / (s[-1] - s[0])
    raise InputError(
        f"the path is infeasible at {100 * share:.0f} % of its length: there joint '{name}' needs "
        f"{abs(holding[k]):.4g} to hold the arm and {friction[k]:.4g} against friction",
        where="least_time",
        allowed=f"torques (N m, N) up to {limits.torque[k]:.4g}",
        fix="raise the torque limit, reduce the payload, or move the path",
    )
