"""Motions through recorded poses: joint motions, straight lines of the tool, splines."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError, counted
from armblocks.face.arm import Arm
from armblocks.face.ikine_coordinates import random_coordinates
from armblocks.face.least_time import check_joint_space, fastest_motion, grid_of, motion_limits, path_through
from armblocks.face.toolbox_trajectories import ctraj
from armblocks.face.trajectory import JointTrajectory, sampled
from armblocks.face.trajectory_report import TrajectoryReport, trajectory_report
from armblocks.robot import Configuration
from armblocks.spatial import Transform
from armblocks.studio.protocol.messages.teaching import JointPeaks, PlannedMotion
from armblocks.studio.robots.reaching import followed_directions, same_configuration, solved
from armblocks.trajectories import PiecewisePolynomial
from armblocks.trajectories.piecewise import chained, hermite
from armblocks.trajectories.profiles import quintic
from armblocks.trajectories.splines import cubic_spline

Array = NDArray[np.float64]
Course = Literal["joint", "line", "spline"]

LINE_STEPS = 48
"""Number of poses on a straight line between two recorded poses that inverse kinematics solves."""
LEAST_PIECES = 24
"""Minimum number of quintic pieces of a part of given duration."""
GRID = 150
"""Minimum number of segments of a path on which the shortest time is computed."""
SAME = 1e-9
"""Difference of two coordinates, rad or m, up to which they are equal."""
FRAMES_PER_SECOND = 60
MAX_FRAMES = 900
MIN_FRAMES = 60
WORKSPACE_POINTS = 6000


class Plan(NamedTuple):
    """A motion, and the times of its recorded poses, s."""

    trajectory: JointTrajectory
    via: list[float]


def plan(arm: Arm, poses: Sequence[Configuration], course: Course, duration: float | None) -> Plan:
    """The motion from rest to rest through ``poses``, in ``duration`` (s) or in the shortest time.

    Raises InputError for fewer than two poses, for equal neighbours, and for a straight line that the arm
    cannot follow; RobotError for robots with ball joints or closed loops.
    """
    where = f"motion of robot '{arm.name}'"
    check_joint_space(arm, where)
    if len(poses) < 2:
        raise InputError(
            f"{counted(len(poses), 'pose is', 'poses are')} recorded",
            where=where,
            allowed="two poses or more",
            fix="record another pose",
        )
    for first, second in pairwise(poses):
        if all(math.isclose(*pair, rel_tol=0.0, abs_tol=SAME) for pair in zip(first.q, second.q)):
            raise InputError(
                f"the poses '{first.name}' and '{second.name}' are the same",
                where=where,
                allowed="poses that differ from the previous pose",
                fix="remove one of them",
            )
    points = np.array([pose.q for pose in poses])
    limits = motion_limits(arm, where)
    is_unlimited = not (np.isfinite(limits.speed).any() or np.isfinite(limits.torque).any())
    if duration is None and is_unlimited:
        raise InputError(
            "the robot has no limits of speed or torque, so that there is no shortest time",
            where=where,
            allowed="a duration in s, or a robot with limits",
            fix="type a duration, or the limits of the joints in the table Dynamics",
        )
    if course == "spline":
        path = path_through(points, limits, None)
        parts = [path]
    elif course == "joint":
        parts = [path_through(np.array(pair), limits, None) for pair in pairwise(points)]
    else:
        parts = [_line(arm, first, second, where) for first, second in pairwise(poses)]
    if duration is None:
        grids = [grid_of(arm, part, GRID) for part in parts]
        motions = [fastest_motion(arm, part, limits, None, grid) for part, grid in zip(parts, grids)]
        knots = motions[0].times[np.searchsorted(grids[0], parts[0].times)]
    else:
        weights = [_weight(part, limits.speed) for part in parts]
        laws = [_law(part, duration * weight / sum(weights)) for part, weight in zip(parts, weights)]
        motions = [_timed(part, law) for part, law in zip(parts, laws)]
        knots = _times_of(laws[0], parts[0].times)
    # The knots of a spline are its poses; the other motions have one part between two poses.
    via = knots if course == "spline" else np.append(0.0, np.cumsum([one.duration for one in motions]))
    return Plan(sampled(chained(motions), 0.01), via.tolist())


def _line(arm: Arm, first: Configuration, second: Configuration, where: str) -> PiecewisePolynomial:
    """The joint path (s from 0 to 1) of a straight line of the tool."""
    directions = followed_directions(arm)
    start, goal = (arm.fkine(pose.q) for pose in (first, second))
    s = np.linspace(0.0, 1.0, LINE_STEPS + 1)
    present, last = np.array(first.q), np.array(second.q)
    rows = [present]
    for k, T in enumerate(ctraj(start, goal, s)[1:]):
        # The search starts toward the second pose, at which a redundant arm then arrives.
        guess = present + (last - present) / (LINE_STEPS - k)
        result = solved(arm, Transform.from_matrix(T), guess, directions)
        if not result.success or not same_configuration(arm, present, result.q):
            reason = "the arm would change its configuration" if result.success else result.explain()
            raise InputError(
                f"the straight line from '{first.name}' to '{second.name}' ends at "
                f"{100 * k / LINE_STEPS:.0f} % of its length: {reason}",
                where=where,
                allowed="lines on which the arm reaches every pose in one configuration",
                fix="choose a joint motion, or drag the tool from one pose to the other and update the pose",
            )
        present = result.q
        rows.append(present)
    q = np.array(rows)
    q[-1] = last
    h = 1.0 / LINE_STEPS
    ends = (
        (-3.0 * q[0] + 4.0 * q[1] - q[2]) / (2.0 * h),
        (3.0 * q[-1] - 4.0 * q[-2] + q[-3]) / (2.0 * h),
    )
    return cubic_spline(s, q, *ends)


def _weight(path: PiecewisePolynomial, speed: Array) -> float:
    """The duration of a part relative to others: its largest joint motion, relative to the speed limits."""
    q = path.at(np.linspace(float(path.times[0]), float(path.times[-1]), 33)).q
    lengths = np.abs(np.diff(q, axis=0)).sum(axis=0)
    return float((lengths / np.where(np.isfinite(speed), speed, 1.0)).max())


def _law(path: PiecewisePolynomial, duration: float) -> PiecewisePolynomial:
    """The path coordinate over time, from rest to rest: a quintic."""
    one, zero = np.ones(1), np.zeros(1)
    return quintic(path.times[0] * one, path.times[-1] * one, duration, zero, zero)


def _timed(path: PiecewisePolynomial, law: PiecewisePolynomial) -> PiecewisePolynomial:
    """The motion along a path with the path coordinate ``law`` over time."""
    times = np.linspace(0.0, law.duration, max(LEAST_PIECES, 2 * (len(path.times) - 1)) + 1)
    s, rate, change = law.at(times)
    q, first, second = path.at(s[:, 0])
    qd, qdd = first * rate, second * rate**2 + first * change
    starts, ends = [part[:-1] for part in (q, qd, qdd)], [part[1:] for part in (q, qd, qdd)]
    rest = np.zeros(path.width)
    return hermite(times, starts, ends, end=np.array([q[-1], rest, rest]))


def _times_of(law: PiecewisePolynomial, s: Array) -> Array:
    """The times at which the path coordinate has the ascending values ``s``."""
    times = np.linspace(0.0, law.duration, 4001)
    return np.interp(s, law.at(times).q[:, 0], times)


def planned_motion(arm: Arm, made: Plan) -> PlannedMotion:
    """The data with which a client shows a motion."""
    duration = made.trajectory.duration
    count = min(max(math.ceil(FRAMES_PER_SECOND * duration), MIN_FRAMES), MAX_FRAMES)
    time = np.linspace(0.0, duration, count + 1)
    q, qd, qdd = made.trajectory(time)
    poses = arm.link_poses(q)
    speeds = np.linalg.norm((arm.jacob0(q)[:, :3] @ qd[..., None])[..., 0], axis=1)
    report = trajectory_report(arm, made.trajectory)
    return PlannedMotion(
        time=time.tolist(),
        q=q.tolist(),
        qd=qd.tolist(),
        qdd=qdd.tolist(),
        rows=poses.shape[1],
        poses=_packed(poses[:, :, :3, :].reshape(count + 1, -1)),
        via=made.via,
        tool_speed=float(speeds.max()),
        peaks=_peaks(report),
        exceeded=list(report.exceeded),
    )


def _peaks(report: TrajectoryReport) -> list[JointPeaks]:
    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return [
        JointPeaks(
            name=name,
            unit=unit,
            lowest=float(report.q[:, k].min()),
            highest=float(report.q[:, k].max()),
            low=number(float(report.position_limits[k, 0])),
            high=number(float(report.position_limits[k, 1])),
            speed=float(np.abs(report.qd[:, k]).max()),
            speed_limit=number(float(report.speed_limits[k])),
            torque=float(np.abs(report.tau[:, k]).max()),
            torque_limit=number(float(report.torque_limits[k])),
        )
        for k, (name, unit) in enumerate(zip(report.joints, report.units))
    ]


def workspace(arm: Arm) -> str:
    """Positions of the tool at random configurations within the limits, as base64."""
    q = random_coordinates(arm.robot, WORKSPACE_POINTS, np.random.default_rng(0), limited=True)
    return _packed(arm.fkine(q)[:, :3, 3])


def _packed(numbers: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(numbers, dtype="<f4").tobytes()).decode("ascii")
