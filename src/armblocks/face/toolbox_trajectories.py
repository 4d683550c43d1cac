"""The Robotics Toolbox's trajectories: ``jtraj``, ``tpoly``, ``lspb``, ``mtraj``, ``mstraj``, ``ctraj``."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError
from armblocks.face.trajectory import JointTrajectory
from armblocks.face.trajectory_arguments import (
    as_array,
    check_same_length,
    end_speed,
    ends_of,
    joint_limits,
    joint_vector,
    positive,
    sample_count,
    sample_times,
    via_points,
)
from armblocks.spatial import Transform
from armblocks.trajectories import PiecewisePolynomial, Quintic
from armblocks.trajectories.piecewise import joined
from armblocks.trajectories.profiles import lspb as lspb_profile
from armblocks.trajectories.profiles import quintic
from armblocks.trajectories.segments import multi_segment

Array = NDArray[np.float64]


def jtraj(
    q0: ArrayLike,
    qf: ArrayLike,
    t: ArrayLike | int,
    qd0: ArrayLike | None = None,
    qd1: ArrayLike | None = None,
) -> JointTrajectory:
    """Quintic motion from ``q0`` to ``qf`` (n,), zero acceleration at both ends.

    - ``t``: the times (N,) in s, from 0 to the end of the motion. Or a number of samples N: then the time is
      normalised as in the toolbox, ``linspace(0, 1, N)``, and rates are per unit of this time.
    - ``qd0``, ``qd1`` (n,): speeds at the ends, zero by default.

    The polynomial is the same as in the toolbox. ``q, qd, qdd = jtraj(…)`` unpacks the motion. Warns of
    angles that look like degrees.
    """
    start, goal = ends_of(q0, qf, "jtraj")
    first = None if qd0 is None else end_speed("qd0", qd0, start, "jtraj")
    last = None if qd1 is None else end_speed("qd1", qd1, start, "jtraj")
    times = sample_times(t, "jtraj")
    motion = Quintic(q0=start, qf=goal, tmax=times[-1:], qd0=first, qd1=last).at(times)
    rest = np.zeros_like(start)
    curve = quintic(
        start, goal, float(times[-1]), rest if first is None else first, rest if last is None else last
    )
    return JointTrajectory(t=times, q=motion.q, qd=motion.qd, qdd=motion.qdd, curve=curve)


def tpoly(
    q0: ArrayLike,
    qf: ArrayLike,
    t: ArrayLike | int,
    qd0: ArrayLike | None = None,
    qdf: ArrayLike | None = None,
) -> JointTrajectory:
    """The toolbox's ``tpoly``: a quintic, zero acceleration at both ends.

    - ``q0``, ``qf``: numbers or (n,). The toolbox supports one joint only.
    - ``t``: the times (N,) in s from 0. Or a number of samples N: then the times are 0, 1 … N - 1, and rates
      are per sample, as in releases 9 and 10 and in roboticstoolbox-python (``quintic``). :func:`jtraj` has
      another time for a number of samples.
    - ``qd0``, ``qdf`` (n,): speeds at the ends, zero by default.
    """
    start, goal = ends_of(q0, qf, "tpoly")
    times = sample_times(t, "tpoly", step=1.0)
    ends = [end_speed(name, value, start, "tpoly") for name, value in (("qd0", qd0), ("qdf", qdf))]
    return _at(quintic(start, goal, float(times[-1]), *ends), times)


def lspb(q0: ArrayLike, qf: ArrayLike, t: ArrayLike | int, speed: ArrayLike | None = None) -> JointTrajectory:
    """The toolbox's ``lspb``: constant acceleration, constant ``speed``, constant deceleration.

    - ``q0``, ``qf``: numbers or (n,). All joints end at the same time.
    - ``t``: the times (N,) in s from 0, or a number of samples N for the times 0, 1 … N - 1.
    - ``speed``: a number or (n,), between one and two times the mean speed. Its sign is ignored, as in
      release 10 (release 9.4 compares the signed value). By default it is 1.5 times the mean speed, which
      gives three equal parts.

    At a time at which the acceleration jumps, the table has the value before the jump, as in the toolbox.
    Raises InputError for a speed that is too small or too large.
    """
    start, goal = ends_of(q0, qf, "lspb")
    times = sample_times(t, "lspb", step=1.0)
    duration = float(times[-1])
    mean = (goal - start) / duration
    if speed is None:
        speeds = 1.5 * mean
    else:
        speeds = joint_limits("speed", np.abs(speed), len(start), "lspb") * np.sign(mean)
    low, high = np.abs(mean) * (1.0 - 1e-12), 2.0 * np.abs(mean) * (1.0 + 1e-12)
    outside = np.flatnonzero((mean != 0.0) & ((np.abs(speeds) < low) | (np.abs(speeds) > high)))
    if outside.size:
        k = int(outside[0])
        size = "small" if abs(speeds[k]) < low[k] else "large"
        raise InputError(
            f"the speed {abs(speeds[k]):g} of joint {k + 1} is too {size}",
            where="lspb",
            allowed=f"{abs(mean[k]):g} to {2 * abs(mean[k]):g}: one to two times the mean speed",
            fix="change the speed or the duration, or omit the speed",
        )
    ends = zip(start.tolist(), goal.tolist(), speeds.tolist())
    joints = [lspb_profile(a, b, duration, v) for a, b, v in ends]
    return _at(joined(joints), times, side="left")


def mtraj(
    function: Callable[[ArrayLike, ArrayLike, ArrayLike | int], JointTrajectory],
    q0: ArrayLike,
    qf: ArrayLike,
    t: ArrayLike | int,
) -> JointTrajectory:
    """The toolbox's ``mtraj``: a motion of several joints by ``lspb`` or ``tpoly`` for each of them.

    - ``function``: :func:`lspb`, :func:`tpoly`, or another function ``(q0, qf, t)`` of one joint that returns
      a :class:`JointTrajectory`.
    - ``q0``, ``qf`` (n,): start and end.
    - ``t``: times (N,) in s from 0, or a number of samples. Releases 9 and 10 replace times by their number;
      here, as in roboticstoolbox-python, the given times are used.
    """
    start, goal = ends_of(q0, qf, "mtraj")
    parts = [function(a, b, t) for a, b in zip(start.tolist(), goal.tolist())]
    for part in parts:
        if type(part) is not JointTrajectory or part.q.shape[1] != 1:
            raise InputError(
                f"the function returns {type(part).__name__}",
                where="mtraj",
                allowed="a JointTrajectory of one joint, such as lspb or tpoly return",
                fix="use ab.mtraj(ab.lspb, q0, qf, t)",
            )
    columns = (np.hstack([getattr(part, name) for part in parts]) for name in ("q", "qd", "qdd"))
    curves = [part.curve for part in parts]
    known = [curve for curve in curves if curve is not None]
    curve = joined(known) if len(known) == len(parts) else None
    return JointTrajectory(t=parts[0].t, curve=curve, **dict(zip(("q", "qd", "qdd"), columns)))


def mstraj(
    points: ArrayLike,
    qdmax: ArrayLike | None,
    tsegment: ArrayLike | None,
    q0: ArrayLike | None,
    dt: float,
    tacc: ArrayLike,
    qd0: ArrayLike | None = None,
    qdf: ArrayLike | None = None,
) -> JointTrajectory:
    """The toolbox's ``mstraj``: linear segments between via points with quintic blends.

    - ``points`` (K, n): the via points.
    - ``qdmax``: greatest joint speeds, a number or (n,), or ``None`` if ``tsegment`` is given.
    - ``tsegment`` (K,): durations of the segments in s, or ``None`` if ``qdmax`` is given.
    - ``q0`` (n,): the start; ``None``: the first point.
    - ``dt``: the sample time, s.
    - ``tacc``: durations of the blends in s, a number or one for each segment.
    - ``qd0``, ``qdf`` (n,): speeds at the ends, zero by default.

    The motion passes near the inner points and ends at the last point. A segment takes at least two blends,
    and its speed is the distance between the points divided by its duration.

    As in releases 9 and 10, the durations of blends and, for given ``qdmax``, of segments are rounded up to
    multiples of ``dt``. A duration that is a multiple of ``dt`` up to rounding is not lengthened.

    Two properties differ from the toolbox:

    - The table includes the start, which the toolbox omits.
    - The last row is the last point, and positions do not jump. For this, a segment that no blend follows
      takes a multiple of ``dt`` also for given ``tsegment`` (rounded up) and ends at its point. The toolbox
      ends such a segment, and then the motion, before its point.
    """
    via = via_points("points", points, "mstraj", least=1 if q0 is not None else 2)
    start, via = (via[0], via[1:]) if q0 is None else (joint_vector("q0", q0, "mstraj"), via)
    check_same_length(start, {"points": via[0]}, "mstraj")
    step = positive("dt", dt, "s", "mstraj")
    if (qdmax is None) == (tsegment is None):
        raise InputError(
            "qdmax and tsegment are " + ("both given" if qdmax is not None else "both None"),
            where="mstraj",
            allowed="exactly one of them: the greatest speeds, or the durations of the segments",
            fix="give None for the other argument",
        )
    blends = as_array(tacc)
    blends = np.broadcast_to(blends, (len(via),)) if blends.ndim == 0 else blends
    durations = (
        None if tsegment is None else joint_limits("tsegment", tsegment, len(via), "mstraj", of="segment")
    )
    fits = blends.shape == (len(via),) and np.isfinite(blends).all() and (blends >= 0.0).all()
    if not fits or (durations is not None and (blends > durations * (1.0 + 1e-9)).any()):
        raise InputError(
            f"tacc = {tacc!r}",
            where="mstraj",
            allowed="durations of blends from 0 to the duration of their segment, one or one per segment",
            fix="shorten the blends or lengthen the segments",
        )
    motion = multi_segment(
        start,
        via,
        step,
        blends,
        speeds=None if qdmax is None else joint_limits("qdmax", qdmax, len(start), "mstraj"),
        durations=durations,
        qd0=end_speed("qd0", qd0, start, "mstraj"),
        qd1=end_speed("qdf", qdf, start, "mstraj"),
    )
    return _at(motion.curve, step * np.arange(motion.steps + 1, dtype=np.float64), side="left")


def ctraj(T0: ArrayLike | Transform, T1: ArrayLike | Transform, s: ArrayLike | int) -> Array:
    """The toolbox's ``ctraj``: poses (N, 4, 4) on a straight line from ``T0`` to ``T1``, each (4, 4).

    - ``T0``, ``T1``: poses, (4, 4) or :class:`Transform`. Translations of the result are in the unit of
      ``T0``.
    - ``s``: path parameters (N,) from 0 to 1, or a number of poses N. For a number, ``s`` has the trapezoidal
      speed of :func:`lspb`, as in releases 9 and 10. Releases up to 8 have equal steps:
      ``np.linspace(0, 1, N)``.

    The rotation is about one axis by the shorter angle.
    """
    first, last = pose_of("T0", T0, "ctraj"), pose_of("T1", T1, "ctraj")
    if sample_count(s) is not None:
        sample_times(s, "ctraj", step=1.0)
        fractions = lspb(0.0, 1.0, s).q[:, 0]
    else:
        fractions = np.atleast_1d(as_array(s))
        is_vector = fractions.ndim == 1 and fractions.size > 0 and bool(np.isfinite(fractions).all())
        if not is_vector or fractions.min() < 0.0 or fractions.max() > 1.0:
            what, fix = "s is not a vector of finite numbers", "give a vector of path parameters"
            if is_vector:
                what = f"s is between {fractions.min():g} and {fractions.max():g}"
                fix = "divide the times by the duration"
            raise InputError(
                what, where="ctraj", allowed="path parameters from 0 (pose T0) to 1 (pose T1)", fix=fix
            )
    poses = np.zeros((len(fractions), 4, 4))
    poses[:, 3, 3] = 1.0
    poses[:, :3, 3] = first[:3, 3] + fractions[:, None] * (last[:3, 3] - first[:3, 3])
    axis, angle = _axis_angle(first[:3, :3].T @ last[:3, :3])
    poses[:, :3, :3] = first[:3, :3] @ _rotations(axis, angle * fractions)
    return poses


def _at(curve: PiecewisePolynomial, times: Array, side: str = "right") -> JointTrajectory:
    motion = curve.at(times, side)
    return JointTrajectory(t=times, q=motion.q, qd=motion.qd, qdd=motion.qdd, curve=curve)


def pose_of(name: str, value: ArrayLike | Transform, where: str) -> Array:
    """A pose (4, 4), finite and with a rotation matrix."""
    matrix = value.matrix if isinstance(value, Transform) else value
    T = as_array(matrix)
    is_pose = T.shape == (4, 4) and np.isfinite(T).all() and (T[3] == (0.0, 0.0, 0.0, 1.0)).all()
    R = T[:3, :3] if is_pose else np.zeros((3, 3))
    if not is_pose or np.abs(R @ R.T - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0.0:
        raise InputError(
            f"{name} is not a pose",
            where=where,
            allowed="a (4, 4) matrix with a rotation matrix and a last row 0 0 0 1",
            fix="use a result of fkine, or a Transform",
        )
    return T


def _axis_angle(R: Array) -> tuple[Array, float]:
    """Axis (3,) and angle (0 to π) of a rotation, from the quaternion of largest component."""
    K = np.array(
        [
            [R[0, 0] - R[1, 1] - R[2, 2], 0.0, 0.0, 0.0],
            [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0.0, 0.0],
            [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0.0],
            [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)],
        ]
    )
    # Bar-Itzhack, New method for extracting the quaternion from a rotation matrix, 2000: the quaternion is
    # the eigenvector of the largest eigenvalue.
    *vector, scalar = np.linalg.eigh(K / 3.0)[1][:, -1]
    size = float(np.linalg.norm(vector))
    if size < 1e-15:
        return np.array([0.0, 0.0, 1.0]), 0.0
    axis = np.array(vector) / size * (1.0 if scalar >= 0.0 else -1.0)
    return axis, 2.0 * float(np.arctan2(size, abs(scalar)))


def _rotations(axis: Array, angles: Array) -> Array:
    """Rotations (N, 3, 3) about one axis, by Rodrigues' formula."""
    x, y, z = axis
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sines, versines = np.sin(angles)[:, None, None], 2.0 * (np.sin(angles / 2.0) ** 2)[:, None, None]
    return np.eye(3) + sines * S + versines * (S @ S)
