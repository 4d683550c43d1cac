"""Summary of an arm's motion: ranges, peaks, loads, work, and exceeded limits.

Signals are interpolated linearly between their samples, and the integrals of this interpolation are exact.
For example, the positive and the negative work of a linear power that changes its sign have no error.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import LimitWarning, warn
from armblocks.pictures.numbers import table_number
from armblocks.robot import Robot

_Array = NDArray[np.float64]

_TOLERANCE = 1e-9
"""Relative tolerance of a limit, so that a trajectory planned exactly to the limit does not exceed it."""


class LimitKind(Enum):
    """The limits of a joint."""

    POSITION = "position"
    SPEED = "speed"
    TORQUE = "torque"


@dataclass(frozen=True, kw_only=True)
class LimitFinding:
    """One limit that a motion exceeds. Values are in SI units: rad, rad/s, N m, or m, m/s, N."""

    joint: str
    kind: LimitKind
    limit: float
    first_time: float
    """Time (s) at which the line between two samples crosses the limit, or the start time."""
    worst_time: float
    worst: float
    text: str
    """One sentence with joint, limit, first time and worst value."""


@dataclass(frozen=True, kw_only=True)
class JointSummary:
    """One joint over a run, in SI units; ``None`` for unknown values (no torque, no limit, no motor).

    ``position_margin``: minimum distance to the nearer end of the range, negative beyond it. ``speed_share``:
    peak speed divided by its limit. ``*_rms``: root mean square over time. ``motor_*``: at the motor's side
    of the gear, ``tau / G`` and ``G qd``. ``work_done`` and ``work_taken`` (J): the time integrals of the
    positive and of the negative part of ``tau qd``, both as positive numbers.
    """

    name: str
    unit: str
    position_min: float | None
    position_max: float | None
    position_limits: tuple[float, float] | None
    position_margin: float | None
    speed_peak: float
    speed_peak_time: float
    speed_limit: float | None
    acceleration_peak: float
    torque_peak: float | None
    torque_rms: float | None
    torque_limit: float | None
    motor_torque_peak: float | None
    motor_torque_rms: float | None
    motor_speed_peak: float | None
    power_peak: float | None
    work_done: float | None
    work_taken: float | None

    @property
    def speed_share(self) -> float | None:
        """Peak speed divided by its limit."""
        return None if self.speed_limit is None else self.speed_peak / self.speed_limit


@dataclass(frozen=True, kw_only=True)
class MotionSummary:
    """All joints, the whole arm, its tool, and the exceeded limits.

    ``power_peak``: of the sum over all joints, W. ``tool_path_length``: m. Positions: (x, y, z) m in the
    world.
    """

    joints: tuple[JointSummary, ...]
    power_peak: float | None
    tool_path_length: float
    tool_start: tuple[float, float, float]
    tool_end: tuple[float, float, float]
    tool_speed_peak: float
    findings: tuple[LimitFinding, ...]


def summarise(
    robot: Robot, time: _Array, q: _Array, qd: _Array, qdd: _Array, tau: _Array | None, tool: _Array
) -> MotionSummary:
    """The summary of a motion: ``time`` (N,) s, ``q`` (N, nq), ``qd``, ``qdd`` and ``tau`` (N, n), ``tool``
    (N, 3) m."""
    power = None if tau is None else tau * qd
    joints: list[JointSummary] = []
    for j, (entry, limits, motor) in enumerate(zip(robot.speeds, robot.limits, robot.motors)):
        k = int(np.argmax(np.abs(qd[:, j])))
        index = robot.position_of_speed[j]
        span = None if index is None else (float(q[:, index].min()), float(q[:, index].max()))
        ends = limits.position
        torque = None if tau is None else tau[:, j]
        peak = None if torque is None else float(np.abs(torque).max())
        rms = None if torque is None else root_mean_square(time, torque)
        work = (None, None) if power is None else signed_integrals(time, power[:, j])
        gear = abs(motor.gear_ratio) if motor else None
        speed_peak = float(abs(qd[k, j]))
        joints.append(
            JointSummary(
                name=entry.name,
                unit=entry.unit,
                position_min=None if span is None else span[0],
                position_max=None if span is None else span[1],
                position_limits=ends,
                position_margin=None
                if ends is None or span is None
                else min(span[0] - ends[0], ends[1] - span[1]),
                speed_peak=speed_peak,
                speed_peak_time=float(time[k]),
                speed_limit=limits.speed,
                acceleration_peak=float(np.abs(qdd[:, j]).max()),
                torque_peak=peak,
                torque_rms=rms,
                torque_limit=limits.torque,
                motor_torque_peak=None if peak is None or gear is None else peak / gear,
                motor_torque_rms=None if rms is None or gear is None else rms / gear,
                motor_speed_peak=None if gear is None else speed_peak * gear,
                power_peak=None if power is None else float(np.abs(power[:, j]).max()),
                work_done=work[0],
                work_taken=work[1],
            )
        )
    steps = np.linalg.norm(np.diff(tool, axis=0), axis=1)
    spans = np.diff(time)
    return MotionSummary(
        joints=tuple(joints),
        power_peak=None if power is None else float(np.abs(power.sum(axis=1)).max()),
        tool_path_length=float(steps.sum()),
        tool_start=_triple(tool[0]),
        tool_end=_triple(tool[-1]),
        tool_speed_peak=float((steps / spans).max()) if len(spans) else 0.0,
        findings=limit_findings(robot, time, q, qd, tau),
    )


SHOWN_AS_ZERO = 64.0 * float(np.finfo(np.float64).eps)
"""Values of a joint up to this fraction of the largest value of all joints are rounding errors."""
_COMPARED_QUANTITIES = (
    ("position_min", "position_max"),
    ("position_margin",),
    ("speed_peak",),
    ("acceleration_peak",),
    ("torque_peak", "torque_rms"),
    ("motor_torque_peak", "motor_torque_rms"),
    ("motor_speed_peak",),
    ("power_peak",),
    ("work_done", "work_taken"),
)
"""Joint quantities that are compared with those of all joints; names in one tuple are one quantity."""


def shown_summary(summary: MotionSummary) -> MotionSummary:
    """The summary for display: values that are rounding errors relative to the largest value of the same
    quantity and unit are 0.

    The torque of a joint is a sum of contributions of all bodies of the arm. If they cancel, the result has
    the rounding error of the largest contribution.
    """
    joints: list[JointSummary] = []
    for joint in summary.joints:
        same_unit = [other for other in summary.joints if other.unit == joint.unit]
        changes: dict[str, float] = {}
        for names in _COMPARED_QUANTITIES:
            sizes = [abs(getattr(other, name) or 0.0) for other in same_unit for name in names]
            if names == ("position_margin",):  # a difference of a position and a limit
                sizes += [abs(end) for other in same_unit for end in other.position_limits or ()]
            for name in names:
                value: float | None = getattr(joint, name)
                if value is not None and abs(value) <= SHOWN_AS_ZERO * max(sizes):
                    changes[name] = 0.0
        joints.append(dataclasses.replace(joint, **changes))
    return dataclasses.replace(summary, joints=tuple(joints))


def limit_findings(
    robot: Robot, time: _Array, q: _Array, qd: _Array | None = None, tau: _Array | None = None
) -> tuple[LimitFinding, ...]:
    """Every limit that a motion exceeds, in the order of joints; arrays as in :func:`summarise`."""
    findings: list[LimitFinding] = []
    for j, ((name, unit), limits) in enumerate(zip(robot.speeds, robot.limits)):
        index = robot.position_of_speed[j]
        if limits.position is not None and index is not None:
            low, high = limits.position
            findings += _exceeded(name, LimitKind.POSITION, unit, time, q[:, index], low, high)
        for kind, values, limit in (
            (LimitKind.SPEED, qd, limits.speed),
            (LimitKind.TORQUE, tau, limits.torque),
        ):
            if values is not None and limit is not None:
                findings += _exceeded(name, kind, unit, time, values[:, j], -limit, limit)
    return tuple(findings)


def warn_of_limits(findings: Sequence[LimitFinding]) -> None:
    """Issue a :class:`LimitWarning` for each finding."""
    for finding in findings:
        warn(finding.text, LimitWarning)


def _exceeded(
    name: str, kind: LimitKind, unit: str, time: _Array, values: _Array, low: float, high: float
) -> list[LimitFinding]:
    slack = _TOLERANCE * max(abs(low), abs(high))
    excess = np.maximum(low - values, values - high)
    outside = np.flatnonzero(excess > slack)
    if len(outside) == 0:
        return []
    first, worst = int(outside[0]), int(np.argmax(excess))
    first_time = float(time[first])
    if first > 0:
        before, after = float(excess[first - 1]), float(excess[first])
        fraction = min(max(-before / (after - before), 0.0), 1.0)
        first_time = float(time[first - 1]) + fraction * float(time[first] - time[first - 1])
    limit = high if values[worst] > high else low
    convert, shown_unit = shown_unit_of(kind, unit)
    verb = {
        LimitKind.POSITION: "leaves its range",
        LimitKind.SPEED: "is faster than allowed",
        LimitKind.TORQUE: f"needs more {'torque' if unit == 'rad' else 'force'} than allowed",
    }[kind]
    allowed = (
        f"{table_number(low * convert)} … {table_number(high * convert)}"
        if kind is LimitKind.POSITION
        else f"at most {table_number(high * convert)}"
    )
    worst_text = table_number(float(values[worst]) * convert)
    finding = LimitFinding(
        joint=name,
        kind=kind,
        limit=limit,
        first_time=first_time,
        worst_time=float(time[worst]),
        worst=float(values[worst]),
        text=(
            f"joint '{name}' {verb} ({allowed} {shown_unit}) from t = {table_number(first_time)} s on: "
            f"{worst_text} {shown_unit} at t = {table_number(float(time[worst]))} s"
        ),
    )
    return [finding]


def shown_unit_of(kind: LimitKind, unit: str) -> tuple[float, str]:
    """Factor and unit for the display of a joint's quantity: degrees for rad, N m or N for torques."""
    factor, base = (180 / math.pi, "deg") if unit == "rad" else (1.0, unit)
    if kind is LimitKind.POSITION:
        return factor, base
    if kind is LimitKind.SPEED:
        return factor, f"{base}/s"
    return 1.0, "N m" if unit == "rad" else "N"


def signed_integrals(time: _Array, values: _Array) -> tuple[float, float]:
    """Time integrals of the positive part and of the negative part (as a positive number) of a signal."""
    a, b, h = values[:-1], values[1:], np.diff(time)
    crossing = a * b < 0
    span = np.where(crossing, np.abs(a) + np.abs(b), 1.0)
    # If the sign changes, both parts are triangles of height a or b over their parts of the interval.
    positive = np.where(
        crossing, np.maximum(a, b) ** 2 / (2 * span), np.maximum(a, 0) / 2 + np.maximum(b, 0) / 2
    )
    negative = np.where(
        crossing, np.minimum(a, b) ** 2 / (2 * span), -np.minimum(a, 0) / 2 - np.minimum(b, 0) / 2
    )
    return float(np.sum(positive * h)), float(np.sum(negative * h))


def root_mean_square(time: _Array, values: _Array) -> float:
    """Root of the time average of the square of a signal."""
    if len(time) < 2:
        return float(np.abs(values).max(initial=0.0))
    a, b, h = values[:-1], values[1:], np.diff(time)
    return math.sqrt(float(np.sum(h * (a * a + a * b + b * b)) / 3) / float(time[-1] - time[0]))


def _triple(p: _Array) -> tuple[float, float, float]:
    return float(p[0]), float(p[1]), float(p[2])
