"""Motions under limits: limits are reached and not exceeded, shortest durations, tables, files, the block."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import armblocks as ab
from armblocks.blocks import Scope, Trajectory
from armblocks.errors import InputError, UnknownNameError

RANDOM = np.random.default_rng(5)
ZERO: dict[str, Any] = dict.fromkeys(("q", "qd", "qdd"), np.zeros((3, 2)))


def greatest(values: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    return np.maximum(-values[0], values[1])


@pytest.mark.parametrize("with_jerk", [False, True])
def test_point_to_point_motions_keep_all_limits_and_reach_one(with_jerk: bool) -> None:
    for _ in range(40):
        n = int(RANDOM.integers(1, 8))
        q0, qf = RANDOM.uniform(-2, 2, (2, n))
        qf[RANDOM.random(n) < 0.2] = q0[RANDOM.random(n) < 0.2][:0].sum() or 0.0  # some go to zero
        v, a, d, j = 10 ** RANDOM.uniform(-1, 1.5, (4, n))
        more: dict[str, Any] = {"jerk": j} if with_jerk else {"deceleration": d}
        path = ab.point_to_point(q0, qf, speed=v, acceleration=a, **more)
        assert_array_equal(path.q[0], q0)
        assert_allclose(path.q[-1], qf, rtol=1e-15, atol=1e-16)
        assert_array_equal(path.qd[-1], np.zeros(n))
        peaks = path.peaks()
        ratios = [greatest(peaks.qd) / v]
        change = np.abs(qf - q0)
        if with_jerk:
            jerks = 6 * np.abs(path.curve.coefficients[:, 3]).max(axis=0) if path.duration else np.zeros(n)
            ratios += [greatest(peaks.qdd) / a, jerks / j]
        else:
            up, down = path(1e-9).qdd, path(path.duration * (1 - 1e-9)).qdd
            ratios += [np.abs(up) / a, np.abs(down) / d]
        assert max(ratio.max() for ratio in ratios) == pytest.approx(1.0, rel=1e-9)
        assert change[np.abs(path.q - q0).max(axis=0) == 0.0].sum() == 0.0


def test_the_profile_is_a_trapezoid_a_triangle_or_rest() -> None:
    trapezoid = ab.point_to_point([0, 0], [1, 0], speed=0.5, acceleration=1.0, deceleration=2.0)
    assert trapezoid.duration == pytest.approx(1 / 0.5 + 0.5 / 2 * (1 + 1 / 2), rel=1e-14)
    triangle = ab.point_to_point(0, 1, speed=9.0, acceleration=1.0)
    assert triangle.duration == pytest.approx(2.0, rel=1e-14)
    rest = ab.point_to_point([1, 2], [1, 2], speed=1.0, acceleration=1.0)
    assert rest.duration == 0.0
    assert rest(0.0).q.tolist() == [1.0, 2.0]
    assert rest(3.0).qd.tolist() == [0.0, 0.0]
    held = ab.point_to_point([1, 2], [1, 2], speed=1.0, acceleration=1.0, duration=2.0)
    assert held.duration == 2.0 and held.q[:, 0].tolist() == [1.0] * len(held)
    slow = ab.point_to_point(0, 1, speed=9.0, acceleration=1.0, duration=4.0)
    assert slow.duration == pytest.approx(4.0) and slow.qdd[0, 0] == pytest.approx(0.25)


@pytest.mark.parametrize("kind", ["cubic", "quintic"])
def test_splines_pass_their_points_at_their_times(kind: str) -> None:
    points, times = RANDOM.uniform(-2, 2, (6, 3)), np.cumsum(RANDOM.uniform(0.3, 1, 6))
    path = ab.spline_trajectory(points, times, kind=kind, qd1=[0.1, 0.2, 0.3])
    assert_allclose(path(times).q, points, atol=1e-13)
    assert_allclose(path(times[-1]).qd, [0.1, 0.2, 0.3], atol=1e-13)
    inner = times[1:-1]
    for order in range(3):
        assert_allclose(path(inner - 1e-9)[order], path(inner)[order], atol=1e-5)
    fast = ab.spline_trajectory(points, speed=[1, 2, 3], acceleration=5.0, kind=kind)
    speed, acceleration = greatest(fast.peaks().qd) / [1, 2, 3], greatest(fast.peaks().qdd) / 5.0
    assert max(speed.max(), acceleration.max()) == pytest.approx(1.0, rel=1e-9)
    assert_allclose(fast.q[[0, -1]], points[[0, -1]], atol=1e-14)


def some_paths() -> list[ab.JointTrajectory]:
    points = RANDOM.uniform(-1, 1, (4, 2))
    return [
        ab.jtraj([0, 1], [1, -1], np.linspace(0, 2, 21)),
        ab.mtraj(ab.lspb, [0, 1], [1, -1], np.linspace(0, 2, 21)),
        ab.mstraj(points, 1.0, None, [0, 0], 0.1, 0.4),
        ab.point_to_point([0, 0], [1, 2], speed=1.0, acceleration=3.0),
        ab.point_to_point([0, 0], [1, 2], speed=1.0, acceleration=3.0, jerk=10.0),
        ab.spline_trajectory(points, speed=1.0, kind="quintic"),
    ]


@pytest.mark.parametrize("index", range(6))
def test_rows_files_and_copies_reproduce_the_motion(index: int, tmp_path: Path) -> None:
    path = some_paths()[index]
    path.save(tmp_path / "path.csv")
    again = [
        ab.load_trajectory(tmp_path / "path.csv"),
        ab.load_trajectory(tmp_path / "path.csv", dt=0.1),
        pickle.loads(pickle.dumps(path)),
        path.sampled(0.3),
        path.sampled(t=[0.0, 0.5, path.duration]),
        path.stretched(2 * path.duration).stretched(path.duration),
    ]
    t = np.linspace(-0.1, path.duration + 0.1, 777)
    expected, scale = path(t), np.abs(path.qdd).max() + 1
    for copy in again:
        for ours, theirs in zip(copy(t), expected):
            assert_allclose(ours, theirs, rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize("index", range(6))
def test_the_block_plays_the_motion(index: int) -> None:
    path = some_paths()[index]
    builder = ab.DiagramBuilder("playback")
    motion = builder.add("motion", path.block())
    builder.add("scope", Scope(), motion["q"])
    builder.add("rates", Scope(), motion["qd"])
    builder.add("accelerations", Scope(), motion["qdd"])
    result = ab.simulate(builder.build(), stop_time=path.duration + 0.5, sample_time=0.0625)
    expected, scale = path(result.time), np.abs(path.qdd).max() + 1
    jumps = path.rows()[:, 0]
    inside = np.abs(result.time[:, None] - jumps).min(axis=1) > 1e-9
    for name, values in expected._asdict().items():
        actual = result[f"motion/{name}"]
        assert_allclose(actual[inside], values[inside], rtol=0, atol=1e-10 * scale)
    assert_array_equal(result["motion/qd"][-1], np.zeros(2))


def test_positions_alone_are_a_spline_at_rest_at_both_ends(tmp_path: Path) -> None:
    times = np.linspace(0, 2, 21)
    text = "time,q1,q2\n" + "".join(f"{t},{np.sin(t)},{t * t * (3 - t)}\n" for t in times)
    (tmp_path / "measured.csv").write_text(text)
    path = ab.load_trajectory(tmp_path / "measured.csv")
    assert_allclose(path.q[:, 0], np.sin(times), atol=1e-14)
    assert_array_equal(path.qd[[0, -1]], np.zeros((2, 2)))
    assert_allclose(
        path(times[5:15] + 0.03).q[:, 1], (times[5:15] + 0.03) ** 2 * (2.97 - times[5:15]), atol=1e-3
    )


def test_units_of_headers_are_converted(tmp_path: Path) -> None:
    (tmp_path / "units.csv").write_text("t [ms],q1 [deg],q2 [mm]\n0,0,0\n1000,90,500\n")
    path = ab.load_trajectory(tmp_path / "units.csv")
    assert_allclose(path.t, [0.0, 1.0])
    assert_allclose(path.q[-1], [np.pi / 2, 0.5])
    (tmp_path / "units.csv").write_text("t,q1 [rev]\n0,0\n1,1\n")
    with pytest.raises(InputError, match=r"a column has the unit 'rev'.*units of rad, m, deg"):
        ab.load_trajectory(tmp_path / "units.csv")


def test_a_joint_with_the_smallest_motion_does_not_determine_the_duration() -> None:
    motion = ab.point_to_point([0, 0], [5e-324, 1.0], speed=1, acceleration=1)
    assert motion.duration == 2.0
    assert ab.point_to_point([0], [5e-324], speed=1, acceleration=1).duration == 0.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ab.point_to_point(0, 1, speed=0.0, acceleration=1), "speed = 0.0.*a number above 0"),
        (lambda: ab.point_to_point(0, 1, speed=1, acceleration=[1, 1]), r"acceleration = \[1, 1\]"),
        (
            lambda: ab.point_to_point(0, 1, speed=1, acceleration=1, deceleration=1, jerk=1),
            "jerk and deceleration are both given",
        ),
        (
            lambda: ab.point_to_point(0, 1, speed=1, acceleration=1, duration=1.5),
            "the duration is 1.5 s.*2 s or more",
        ),
        (lambda: ab.point_to_point(1, 1, speed=1, acceleration=1, duration=-1), "duration = -1"),
        (lambda: ab.spline_trajectory([[0]], [0]), r"points has the shape \(1, 1\)\. Allowed"),
        (lambda: ab.spline_trajectory([[0], [1]], [1, 1]), "times has the shape.*2 ascending times"),
        (lambda: ab.spline_trajectory([[0], [1]]), "times is None.*a speed limit and rest"),
        (lambda: ab.spline_trajectory([[0], [0]], speed=1.0), "points 1 and 2 are the same"),
        (lambda: ab.spline_trajectory([[0], [np.nan]], speed=1.0), "with NaN or infinity"),
        (lambda: ab.jtraj(0, 1, 5).sampled(-1.0), "dt = -1.0.*a finite number above 0"),
        (lambda: ab.jtraj(0, 1, 5).stretched(0.0), "duration = 0.0"),
        (
            lambda: ab.JointTrajectory(t=np.arange(3), **ZERO | {"qdd": np.zeros(3)}),
            r"t, q, qd, qdd have the shapes \(3,\)",
        ),
        (
            lambda: ab.JointTrajectory(t=-np.arange(3.0), **ZERO)(0.0),
            "the times of the samples do not ascend",
        ),
        (lambda: Trajectory(data=((0, 1, 2), (1, 1, 2))), "the table has 3 columns.*1 \\+ 3 n"),
    ],
)  # fmt: skip
def test_invalid_arguments_are_refused(call: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()


def test_unknown_splines_and_columns_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="kind of spline"):
        ab.spline_trajectory([[0], [1]], speed=1.0, kind="cubik")
    (tmp_path / "table.csv").write_text("t,q1,qd1\n0,0,0\n1,1,0\n")
    with pytest.raises(InputError, match=r"the columns are 'q1', 'qd1'.*rename the columns"):
        ab.load_trajectory(tmp_path / "table.csv")
