"""A time-optimal pick-and-place cycle: approach, grip, transfer, release, retract."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError
from armblocks.face.arm import Arm
from armblocks.face.least_time import (
    check_joint_space,
    fastest_motion,
    grid_of,
    motion_limits,
    path_through,
)
from armblocks.face.payload import Payload
from armblocks.face.robots import given_arm
from armblocks.face.toolbox_trajectories import ctraj, pose_of
from armblocks.face.trajectory import JointTrajectory, sampled
from armblocks.face.trajectory_arguments import check_same_length, joint_vector, positive
from armblocks.report.motion_summary import limit_findings, warn_of_limits
from armblocks.robot import Robot
from armblocks.spatial import Transform
from armblocks.trajectories import PiecewisePolynomial
from armblocks.trajectories.piecewise import chained
from armblocks.trajectories.profiles import at_rest

Array = NDArray[np.float64]

_LINE_POINTS = 6
"""Number of poses on a vertical line, between which joints move linearly."""
_MAX_JUMP = 1.0
"""Greatest change of a joint (rad) between two poses of a line; a larger change means a change of
configuration."""


@dataclass(frozen=True, kw_only=True)
class CyclePhase(metaclass=ArgumentErrors):
    """A phase from ``start`` to ``end`` (s) of a cycle; ``loaded``: whether the payload is at the tool."""

    name: str
    start: float
    end: float
    loaded: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class PickAndPlaceCycle(metaclass=ArgumentErrors):
    """A cycle: the ``trajectory`` from the start and back, and its ``phases``."""

    trajectory: JointTrajectory
    phases: tuple[CyclePhase, ...]

    @property
    def cycle_time(self) -> float:
        """Duration of the cycle, s."""
        return self.trajectory.duration

    def __str__(self) -> str:
        lines = [f"cycle time {self.cycle_time:.3f} s"]
        lines += [
            f"{phase.start:8.3f} to {phase.end:.3f} s: {phase.name}{', loaded' * phase.loaded}"
            for phase in self.phases
        ]
        return "\n".join(lines)


def pick_and_place(
    arm: Arm | Robot | str | PathLike[str],
    q0: ArrayLike,
    pick: ArrayLike | Transform,
    place: ArrayLike | Transform,
    *,
    lift: float = 0.1,
    grip_time: float = 0.2,
    payload: Payload | float | None = None,
    blend: float = 0.3,
    mask: ArrayLike | None = None,
    speed: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    torque: ArrayLike | None = None,
    dt: float = 0.01,
) -> PickAndPlaceCycle:
    """The fastest cycle from ``q0`` (n,) to the pose ``pick``, with the payload to ``place``, and back.

    The tool moves vertically down and up at both poses. Between the vertical lines the joints move on
    straight lines in joint space. Each of the three motions is time-optimal.

    - ``pick``, ``place``: poses of the tool in the world, (4, 4) or :class:`Transform`, m.
    - ``lift`` (m): the height of the vertical lines.
    - ``grip_time`` (s): the time for which the tool rests at each of the two poses.
    - ``payload``: a :class:`Payload`, or a mass (kg) at the tool, during the second motion.
    - ``blend``: rounds the corners, as for :func:`~armblocks.least_time`.
    - ``mask``: as for ``arm.ikine``.
    - ``speed``, ``acceleration``, ``torque``: limits, as for :func:`~armblocks.least_time`.
    - ``dt``: time between samples, s.

    Raises InputError for a pose that the arm does not reach, with the reason, and for a vertical line on
    which the configuration of the arm changes. Warns of positions outside the limits of the joints.
    """
    arm = given_arm(arm, "pick_and_place")
    where = "pick_and_place"
    check_joint_space(arm, where)
    start = joint_vector("q0", q0, where)
    check_same_length(np.zeros(arm.n), {"q0": start}, where, "the robot")
    height, wait = positive("lift", lift, "m", where), positive("grip_time", grip_time, "s", where)
    step = positive("dt", dt, "s", where)
    limits = motion_limits(arm, where, speed, acceleration, torque)
    lines: list[Array] = []
    near = start
    for name, pose in (("pick", pose_of("pick", pick, where)), ("place", pose_of("place", place, where))):
        lines.append(_vertical_line(arm, near, pose, height, mask, f"{where}, {name}"))
        near = lines[-1][0]
    down_to_pick, down_to_place = lines
    routes = (
        ("approach", [start[None], down_to_pick], None),
        ("transfer", [down_to_pick[::-1], down_to_place], payload),
        ("retract", [down_to_place[::-1], start[None]], None),
    )
    parts: list[PiecewisePolynomial] = []
    phases: list[CyclePhase] = []
    clock = 0.0
    for (name, route, load), pause in zip(routes, ("grip", "release", "")):
        points = np.vstack(route)
        path = path_through(points[_differs(points)], limits, blend)
        motion = fastest_motion(arm, path, limits, load, grid_of(arm, path, 200))
        stops = [(name, motion)] + ([(pause, at_rest(points[-1], wait))] if pause else [])
        for phase, part in stops:
            parts.append(part)
            phases.append(
                CyclePhase(
                    name=phase, start=clock, end=clock + part.duration, loaded=phase in ("transfer", "grip")
                )
            )
            clock += part.duration
    trajectory = sampled(chained(parts), step)
    warn_of_limits(limit_findings(arm.robot, trajectory.t, trajectory.q))
    return PickAndPlaceCycle(trajectory=trajectory, phases=tuple(phases))


def _vertical_line(
    arm: Arm, near: Array, pose: Array, height: float, mask: ArrayLike | None, where: str
) -> Array:
    """Joint coordinates (K, n) on the line from ``height`` above a pose down to it."""
    above = pose.copy()
    above[2, 3] += height
    found: list[Array] = []
    for T in ctraj(above, pose, np.linspace(0.0, 1.0, _LINE_POINTS)):
        result = arm.ikine(T, near, mask=mask)
        if not result.success:
            x, y, z = (float(entry) for entry in T[:3, 3])
            raise InputError(
                f"the arm does not reach the tool position ({x:.4g}, {y:.4g}, {z:.4g}) m: {result.reason}",
                where=where,
                allowed="poses within reach and within the limits of the joints",
                fix="move the pose, reduce lift, or give a mask of the free directions",
            )
        q = np.asarray(result.q)
        if found and np.abs(q - found[-1]).max() > _MAX_JUMP:
            raise InputError(
                f"a joint jumps by {np.abs(q - found[-1]).max():.3g} on the vertical line",
                where=where,
                allowed=f"changes up to {_MAX_JUMP:g} between neighbouring poses, in one configuration",
                fix="reduce lift, or start with q0 in another configuration",
            )
        found.append(q)
        near = q
    return np.array(found)


def _differs(points: Array) -> NDArray[np.bool_]:
    """Whether each point differs from the previous point."""
    return np.append(True, (np.abs(np.diff(points, axis=0)) > 1e-9).any(axis=1))
