"""The toolbox's trajectories, compared with straightforward transcriptions of its documented formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation, Slerp

import armblocks as ab
from armblocks.errors import ArmblocksWarning, InputError

RANDOM = np.random.default_rng(11)


def quintic_by_solving(q0: float, qf: float, t: np.ndarray, qd0: float, qdf: float) -> np.ndarray:
    """tpoly: the six conditions of a quintic as a linear system."""
    T = t[-1]
    rows = [
        [0, 0, 0, 0, 0, 1],
        [T**5, T**4, T**3, T**2, T, 1],
        [0, 0, 0, 0, 1, 0],
        [5 * T**4, 4 * T**3, 3 * T**2, 2 * T, 1, 0],
        [0, 0, 0, 2, 0, 0],
        [20 * T**3, 12 * T**2, 6 * T, 2, 0, 0],
    ]
    c = np.linalg.solve(np.array(rows, dtype=float), [q0, qf, qd0, qdf, 0, 0])
    return np.stack([np.polyval(np.polyder(c, k), t) for k in range(3)])


def lspb_by_phases(q0: float, q1: float, t: np.ndarray, V: float) -> np.ndarray:
    """lspb: parabola, line, parabola."""
    tf = t[-1]
    tb = (q0 - q1 + V * tf) / V
    a = V / tb
    values = []
    for tt in t:
        if tt <= tb:
            values.append((q0 + a / 2 * tt**2, a * tt, a))
        elif tt <= tf - tb:
            values.append(((q1 + q0 - V * tf) / 2 + V * tt, V, 0.0))
        else:
            values.append((q1 - a / 2 * tf**2 + a * tf * tt - a / 2 * tt**2, a * tf - a * tt, -a))
    return np.array(values).T


def mstraj_by_rows(
    start: Any, points: Any, dt: float, tacc: float, qdmax: Any, durations: Any, qd0: Any, qdf: Any
) -> np.ndarray:
    """mstraj, releases 9 and 10: row by row; jtraj with a time vector, then linear steps."""

    def ceil(x: float) -> int:
        return int(np.ceil(round(x / dt, 9)))

    rows, q, previous, qd = [], np.array(start), np.array(start), np.array(qd0)
    blend, half = ceil(tacc), ceil(tacc / 2)
    for k, point in enumerate(np.array(points)):
        first = half if k == 0 else blend
        change = point - previous
        if qdmax is not None:
            tseg = max(max(first + ceil(d) for d in abs(change) / qdmax), 2 * blend) * dt
        else:
            tseg = durations[k]
        speed = change / tseg
        if first:
            target = previous + half * dt * speed
            rows += list(ab.jtraj(q, target, np.arange(first + 1) * dt, qd, speed).q[1:])
            q = rows[-1]
        t = half * dt + dt
        while t <= tseg - half * dt + 1e-9:
            q = (1 - t / tseg) * previous + t / tseg * point
            rows.append(q)
            t += dt
        previous, qd = point, speed
    if half:
        rows += list(ab.jtraj(q, previous, np.arange(half + 1) * dt, qd, qdf).q[1:])
    return np.array(rows)


def test_tpoly_counts_samples_where_jtraj_normalises_time() -> None:
    for t, times in ((6, np.arange(6.0)), (np.linspace(0, 2.5, 11),) * 2):
        motion = ab.tpoly([0.1, -0.2], [1.0, 0.7], t, [0.1, 0.0], [0.0, -0.2])
        assert_allclose(motion.t, times)
        for k, arguments in enumerate(((0.1, 1.0, times, 0.1, 0.0), (-0.2, 0.7, times, 0.0, -0.2))):
            expected = quintic_by_solving(*arguments)
            assert_allclose([part[:, k] for part in motion], expected, rtol=0, atol=1e-11)
    assert_allclose(ab.tpoly(0, 1, 6).qd * 5, ab.jtraj(0, 1, 6).qd, rtol=1e-14)
    assert_array_equal(ab.tpoly(0, 1, np.int64(6)).q, ab.tpoly(0, 1, 6).q)


@pytest.mark.parametrize("t", [10, 11, np.linspace(0.0, 3.0, 40)])
@pytest.mark.parametrize("ratio", [None, 1.0001, 1.3, 2.0])
def test_lspb_has_the_three_phases_of_the_toolbox(t: Any, ratio: float | None) -> None:
    q0, q1 = np.array([0.0, 1.0, 0.4]), np.array([2.0, -1.5, 0.4])
    times = np.arange(t, dtype=float) if isinstance(t, int) else t
    mean = (q1 - q0)[:2] / times[-1]
    motion = ab.lspb(q0, q1, t, None if ratio is None else np.append(np.abs(mean) * ratio, 1.0))
    for k in range(2):
        expected = lspb_by_phases(q0[k], q1[k], times, mean[k] * (ratio or 1.5))
        assert_allclose(motion.q[:, k], expected[0], rtol=0, atol=1e-11)  # accelerations up to 2e4
        assert_allclose(motion.qd[:, k], expected[1], rtol=0, atol=1e-12)
        # A sample may be at a jump up to rounding.
        inside = np.abs(np.diff(expected[2], append=expected[2, -1])) == 0
        assert_allclose(motion.qdd[inside, k], expected[2][inside], rtol=1e-8, atol=1e-12)
    assert_array_equal(motion.q[:, 2], np.full(len(times), 0.4))
    assert_array_equal(motion.qd[:, 2], np.zeros(len(times)))
    assert motion.qd[-1].tolist() == [0.0, 0.0, 0.0]


def test_mtraj_is_its_function_joint_by_joint() -> None:
    for function in (ab.lspb, ab.tpoly):
        for t in (9, np.linspace(0, 2, 9)):
            whole = ab.mtraj(function, [0, 1], [1, -1], t)
            for k, (a, b) in enumerate(((0.0, 1.0), (1.0, -1.0))):
                for ours, alone in zip(whole, function(a, b, t)):
                    assert_array_equal(ours[:, k], alone[:, 0])
            assert_allclose(whole(whole.t).q, whole.q, atol=1e-14)


@pytest.mark.parametrize("tacc", [0.0, 0.1, 0.25, 0.5])
@pytest.mark.parametrize("by_time", [False, True])
def test_mstraj_has_the_rows_of_the_toolbox(tacc: float, by_time: bool) -> None:
    points = RANDOM.uniform(-1, 1, (4, 3))
    start, dt = np.array([0.1, 0.2, -0.3]), 0.05
    speeds, durations = np.array([0.8, 1.0, 2.0]), [1.0, 1.53, 0.8, 2.0]
    ends = (np.zeros(3), np.zeros(3)) if tacc == 0.0 else RANDOM.uniform(-0.2, 0.2, (2, 3))
    mode = (None, durations) if by_time else (speeds, None)
    motion = ab.mstraj(points, *mode, start, dt, tacc, *ends)
    if not tacc:  # without blends armblocks rounds up to multiples of dt, so that the points are reached
        durations[1] = 1.55
    expected = mstraj_by_rows(start, points, dt, tacc, *mode, *ends)
    assert_array_equal(motion.q[0], start)
    assert_allclose(motion.q[1:], expected, rtol=0, atol=1e-12)
    assert_allclose(motion.t, dt * np.arange(len(expected) + 1), rtol=1e-14)
    assert_allclose(motion(motion.t).q, motion.q, atol=1e-14)
    assert_allclose(motion.q[-1], points[-1], atol=1e-12)
    assert_array_equal(ab.mstraj([start, *points], *mode, None, dt, tacc, *ends).q, motion.q)


def test_mstraj_is_continuous_and_ends_at_the_last_point() -> None:
    """Random times, blends (also none at some points), sample times and directions."""
    for _ in range(150):
        K, n, dt = int(RANDOM.integers(1, 5)), int(RANDOM.integers(1, 4)), RANDOM.uniform(0.01, 0.3)
        start, points = RANDOM.normal(size=n), RANDOM.normal(size=(K, n)) * (RANDOM.random((K, 1)) < 0.9)
        durations, speeds = RANDOM.uniform(0.02, 2.0, K), RANDOM.uniform(0.3, 2.0, n)
        blends = RANDOM.uniform(0, 1, K) * durations * (RANDOM.random(K) < 0.6)
        for mode in ((None, durations), (speeds, None)):
            motion = ab.mstraj(points, *mode, start, dt, blends)
            assert_allclose(motion.q[-1], points[-1], rtol=0, atol=1e-12)
            assert_allclose(np.diff(motion.t), dt, rtol=1e-9)
            knots = motion.curve.times  # both one-sided limits at the ends of the pieces
            assert_allclose(motion.curve.at(knots, "left").q, motion.curve.at(knots).q, rtol=0, atol=1e-12)
            assert_allclose(knots[-1], motion.t[-1], rtol=1e-12, atol=1e-15)
            if mode[1] is not None and not blends.any():
                assert len(motion.t) == np.ceil(durations / dt).sum() + 1


def test_ctraj_moves_on_a_straight_line_and_rotates_about_one_axis() -> None:
    rotations = Rotation.random(2, rng=RANDOM)
    T0, T1 = np.eye(4), np.eye(4)
    T0[:3, :3], T1[:3, :3] = rotations.as_matrix()
    T0[:3, 3], T1[:3, 3] = RANDOM.normal(size=(2, 3))
    for s in (7, np.linspace(0, 1, 5)):
        fractions = ab.lspb(0, 1, s).q[:, 0] if isinstance(s, int) else s
        poses = ab.ctraj(T0, T1, s)
        assert_allclose(poses[:, :3, :3], Slerp([0, 1], rotations)(fractions).as_matrix(), atol=1e-14)
        assert_allclose(poses[:, :3, 3], T0[:3, 3] + fractions[:, None] * (T1 - T0)[:3, 3], atol=1e-14)
    assert_allclose(ab.ctraj(T0, T0, 3), [T0] * 3, atol=1e-15)
    half_turn = np.diag([-1.0, -1.0, 1.0, 1.0])
    assert_allclose(ab.ctraj(np.eye(4), half_turn, [1.0])[0], half_turn, atol=1e-15)
    arm = ab.load_robot("puma560")
    ends = arm.fkine([[0.0] * 6, [0.1] * 6])
    assert_allclose(ab.ctraj(*ends, 4)[[0, -1]], ends, atol=1e-14)
    assert_allclose(ab.ctraj(ab.Transform(), ab.Transform(translation=(1, 0, 0)), 3)[-1, 0, 3], 1.0)


def test_jtraj_is_a_motion_at_any_time() -> None:
    path = ab.jtraj([0, 1], [2, -1], np.linspace(0, 4, 9), qd0=[0.1, 0.0], qd1=[0.0, -0.2])
    dense = ab.jtraj([0, 1], [2, -1], np.linspace(0, 4, 801), qd0=[0.1, 0.0], qd1=[0.0, -0.2])
    for ours, theirs in zip(path(dense.t), dense):
        assert_allclose(ours, theirs, rtol=0, atol=1e-13)
    assert path.duration == 4.0 and path.n == 2
    assert path(2.0).q.shape == (2,)
    assert path(5.0).qd.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ab.lspb(0, 1, 11, 0.05), "the speed 0.05 of joint 1 is too small.*0.1 to 0.2"),
        (lambda: ab.lspb(0, 1, 11, 0.25), "the speed 0.25 of joint 1 is too large.*one to two times"),
        (lambda: ab.lspb(0, 1, 11, -np.inf), "speed = .*a number above 0"),
        (lambda: ab.mtraj(lambda *_: 3, [0], [1], 5), "mtraj: the function returns int.*ab.lspb"),
        (lambda: ab.mstraj([[1.0]], None, None, [0.0], 0.1, 0.2), "qdmax and tsegment are both None"),
        (lambda: ab.mstraj([[1.0]], 1.0, [1.0], [0.0], 0.1, 0.2), "qdmax and tsegment are both given"),
        (lambda: ab.mstraj([[1.0]], None, [1.0], [0.0], 0.1, 1.2), "tacc = 1.2.*from 0 to the duration"),
        (lambda: ab.mstraj([[1.0]], 1.0, None, [0.0], 0.0, 0.1), "dt = 0.0.*a finite number above 0, in s"),
        (
            lambda: ab.mstraj([[1.0]], 1.0, None, None, 0.1, 0.1),
            r"points has the shape \(1, 1\).*2 or more rows",
        ),
        (lambda: ab.mstraj([[1.0]], 1.0, None, [0, 0], 0.1, 0.1), "points has 1 joint.*2, the number of"),
        (lambda: ab.ctraj(np.eye(3), np.eye(4), 5), "T0 is not a pose"),
        (lambda: ab.ctraj(np.eye(4), 2 * np.eye(4), 5), "T1 is not a pose"),
        (lambda: ab.ctraj(np.eye(4), np.eye(4), [0, 2]), "s is between 0 and 2"),
        (lambda: ab.ctraj(np.eye(4), np.eye(4), [0, np.nan]), "s is not a vector .*path parameters from 0"),
        (lambda: ab.ctraj(np.eye(4), np.eye(4), 1), "ctraj: t = 1 sample"),
        (lambda: ab.mstraj([[1.0]], 1.0, None, [0.0], 0.1, "fast"), "mstraj: tacc = 'fast'"),
        (lambda: ab.mstraj([[1.0]], None, [0.0], [0.0], 0.1, 0), "tsegment = .*one per segment"),
        (lambda: ab.tpoly([0, 0], [1, 1], 5, [1]), "qd0 has 1 joint.*give qd0 as many numbers as q0"),
    ],
)
def test_invalid_arguments_are_refused(call: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()


def test_via_points_in_degrees_raise_a_warning() -> None:
    with pytest.warns(ArmblocksWarning, match="mstraj, points: an angle of 90 rad"):
        ab.mstraj([[90.0], [45.0]], 10.0, None, None, 0.1, 0.2)
