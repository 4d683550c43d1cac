"""Joint motions under limits: point to point, and splines through via points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, UnknownNameError
from armblocks.face.trajectory import JointTrajectory, sampled
from armblocks.face.trajectory_arguments import (
    ascending,
    end_speed,
    ends_of,
    joint_limits,
    positive,
    via_points,
)
from armblocks.trajectories.piecewise import extremes
from armblocks.trajectories.profiles import along, at_rest, double_s, trapezoid
from armblocks.trajectories.splines import cubic_spline, quintic_spline

Array = NDArray[np.float64]

_NO_DISTANCE = 1e-100
"""Joint motions that are smaller (rad or m) are omitted, because limits divided by them may overflow."""


def point_to_point(
    q0: ArrayLike,
    qf: ArrayLike,
    *,
    speed: ArrayLike,
    acceleration: ArrayLike,
    deceleration: ArrayLike | None = None,
    jerk: ArrayLike | None = None,
    duration: float | None = None,
    dt: float = 0.01,
) -> JointTrajectory:
    """The fastest synchronised motion from rest at ``q0`` to rest at ``qf`` (n,) under limits.

    All joints start and end together, and the motion is a straight line in joint space.

    - ``speed``, ``acceleration``: greatest magnitudes, a number for all joints or (n,), in rad or m and s.
    - ``deceleration``: as ``acceleration``, which is its default. Not together with ``jerk``.
    - ``jerk``: the same for the derivative of the acceleration. With ``jerk`` the acceleration is continuous
      (a double S). Without it the speed is a trapezoid, or a triangle if no joint reaches its speed.
    - ``duration`` (s): a longer duration, to which the motion is scaled.
    - ``dt``: time between samples, s.

    Raises InputError for limits that are not positive and for a duration below the minimum.
    """
    where = "point_to_point"
    start, goal = ends_of(q0, qf, where)
    n, change = len(start), goal - start
    moves = np.abs(change) > _NO_DISTANCE
    step = positive("dt", dt, "s", where)
    given = {"speed": speed, "acceleration": acceleration}
    given["deceleration"] = acceleration if deceleration is None else deceleration
    given |= {} if jerk is None else {"jerk": jerk}
    limits = {name: joint_limits(name, value, n, where) for name, value in given.items()}
    if jerk is not None and deceleration is not None:
        raise InputError(
            "jerk and deceleration are both given",
            where=where,
            allowed="a deceleration without jerk limit, or a jerk limit for equal ramps at both ends",
            fix="omit one of them",
        )
    if not moves.any():
        rest = 0.0 if duration is None or duration == 0 else positive("duration", duration, "s", where)
        return sampled(at_rest(start, rest), step)
    v, a, d, *j = (float(np.min(limit[moves] / np.abs(change[moves]))) for limit in limits.values())
    profile = double_s(v, a, j[0]) if j else trapezoid(v, a, d)
    if duration is not None:
        wanted = positive("duration", duration, "s", where)
        if wanted < profile.duration * (1.0 - 1e-12):
            raise InputError(
                f"the duration is {wanted:g} s",
                where=where,
                allowed=f"{profile.duration:g} s or more, the shortest duration within these limits",
                fix="lengthen the duration or raise the limits",
            )
        profile = profile.stretched(wanted / profile.duration)
    return sampled(along(start, change, profile), step)


def spline_trajectory(
    points: ArrayLike,
    times: ArrayLike | None = None,
    *,
    speed: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    kind: str = "cubic",
    qd0: ArrayLike | None = None,
    qd1: ArrayLike | None = None,
    dt: float = 0.01,
) -> JointTrajectory:
    """A spline through ``points`` (K, n), at rest at both ends or with the end speeds ``qd0``, ``qd1`` (n,).

    - ``times`` (K,), ascending, in s: when each point is passed. Without ``times``, the time between two
      points is proportional to the largest joint motion relative to its ``speed``. The whole motion is then
      scaled in time so that one joint reaches its ``speed`` or ``acceleration`` limit.
    - ``speed``, ``acceleration``: limits of a motion without ``times``, numbers or (n,), in rad or m and s.
      By default accelerations have no limit.
    - ``kind``: ``"cubic"`` has continuous accelerations, ``"quintic"`` also continuous jerk and no
      acceleration at the ends.
    - ``qd0``, ``qd1`` (n,): the speeds at the ends, only together with ``times``.
    - ``dt``: time between samples, s.

    Raises InputError if neither ``times`` nor ``speed`` is given, and, without ``times``, for equal
    consecutive points. Raises UnknownNameError for another kind.
    """
    where = "spline_trajectory"
    via = via_points("points", points, where)
    count, n = via.shape
    step = positive("dt", dt, "s", where)
    if kind not in ("cubic", "quintic"):
        raise UnknownNameError("kind of spline", kind, ("cubic", "quintic"), where=where)
    ends = [end_speed(k, v, via[0], where, "a point") for k, v in (("qd0", qd0), ("qd1", qd1))]
    make = cubic_spline if kind == "cubic" else quintic_spline
    if times is not None:
        return sampled(make(ascending("times", times, count, where), via, *ends), step)
    if speed is None or qd0 is not None or qd1 is not None:
        raise InputError(
            "times is None" + ("" if speed is None else ", with end speeds"),
            where=where,
            allowed="times, or a speed limit and rest at both ends",
            fix="give times=, or speed= without qd0 and qd1",
        )
    v = joint_limits("speed", speed, n, where)
    a = joint_limits(
        "acceleration", np.inf if acceleration is None else acceleration, n, where, infinite=True
    )
    distances = (np.abs(np.diff(via, axis=0)) / v).max(axis=1)
    if not distances.all():
        raise InputError(
            f"points {int(np.argmin(distances)) + 1} and {int(np.argmin(distances)) + 2} are the same",
            where=where,
            allowed="points that differ from the previous point, unless times are given",
            fix="remove one of them, or give times",
        )
    curve = make(np.append(0.0, np.cumsum(distances)), via, *ends)
    peaks = [np.abs(extremes(curve, order)).max(axis=0) for order in (1, 2)]
    factor = max(float((peaks[0] / v).max()), float(np.sqrt((peaks[1] / a).max())))
    return sampled(curve.stretched(factor), step)
