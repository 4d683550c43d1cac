"""Motion summaries against closed forms."""

import math

import numpy as np
import pytest

from armblocks.errors import LimitWarning
from armblocks.report.motion_summary import (
    LimitKind,
    limit_findings,
    root_mean_square,
    signed_integrals,
    summarise,
    warn_of_limits,
)
from armblocks.robot import JointLimits, Link, Motor, Prismatic, Revolute, Robot
from armblocks.spatial import transl

T = 4.0
TIME = np.linspace(0.0, T, 4001)


def one_joint(**limits: object) -> Robot:
    link = Link(
        name="swing",
        joint=Revolute(limits=JointLimits(**limits)),  # pyright: ignore
        after=transl(2.0, 0.0, 0.0),
        mass=1.0,
        motor=Motor(gear_ratio=-50.0),
    )
    return Robot(name="arm", links=(link,))


def sine() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q = sin(w t) over one period and its rates."""
    w = 2 * math.pi / T
    return (
        np.sin(w * TIME)[:, None],
        w * np.cos(w * TIME)[:, None],
        -(w**2) * np.sin(w * TIME)[:, None],
    )


def tool_of(q: np.ndarray) -> np.ndarray:
    return np.column_stack([2 * np.cos(q[:, 0]), 2 * np.sin(q[:, 0]), np.zeros(len(q))])


def test_a_sine_has_its_peaks_and_root_mean_square() -> None:
    q, qd, qdd = sine()
    summary = summarise(one_joint(position=(-2.0, 1.5)), TIME, q, qd, qdd, 3.0 * q, tool_of(q))
    (joint,) = summary.joints
    w = 2 * math.pi / T
    # The grid contains the extremes, so the error is rounding and the sag of the chord (h^2 / 8 = 1e-7).
    assert (joint.position_min, joint.position_max) == pytest.approx((-1.0, 1.0))
    assert joint.position_margin == pytest.approx(0.5)
    assert joint.speed_peak == pytest.approx(w)
    assert joint.acceleration_peak == pytest.approx(w**2)
    assert joint.torque_peak == pytest.approx(3.0)
    assert joint.torque_rms == pytest.approx(3.0 / math.sqrt(2), rel=1e-6)
    assert joint.motor_torque_peak == pytest.approx(3.0 / 50)
    assert joint.motor_speed_peak == pytest.approx(50 * w)
    assert summary.findings == ()


def test_positive_and_negative_work_of_a_spring_are_equal() -> None:
    """tau = k q over one period: in each quarter the spring stores or returns the work k/2."""
    q, qd, qdd = sine()
    (joint,) = summarise(one_joint(), TIME, q, qd, qdd, 3.0 * q, tool_of(q)).joints
    assert joint.work_done == pytest.approx(2 * 1.5, rel=1e-5)
    assert joint.work_taken == pytest.approx(2 * 1.5, rel=1e-5)


def test_the_integral_of_a_line_through_zero_is_exact() -> None:
    positive, negative = signed_integrals(np.array([0.0, 3.0]), np.array([-1.0, 2.0]))
    assert (positive, negative) == pytest.approx((2.0, 0.5), rel=1e-15)


def test_the_root_mean_square_of_a_ramp_is_exact() -> None:
    assert root_mean_square(np.array([0.0, 5.0]), np.array([0.0, 3.0])) == pytest.approx(math.sqrt(3.0))
    assert root_mean_square(np.array([0.0]), np.array([-2.0])) == 2.0


def test_the_path_length_of_the_tool_is_the_arc_length() -> None:
    q = np.linspace(0.0, math.pi, len(TIME))[:, None]
    rate = np.full_like(q, math.pi / T)
    summary = summarise(one_joint(), TIME, q, rate, 0 * q, None, tool_of(q))
    # 4000 chords of a half circle are shorter by (pi / 4000)^2 / 24.
    assert summary.tool_path_length == pytest.approx(2 * math.pi, rel=1e-7)
    assert summary.tool_speed_peak == pytest.approx(2 * math.pi / T, rel=1e-6)
    assert summary.tool_end == pytest.approx((-2.0, 0.0, 0.0), abs=1e-12)
    assert summary.power_peak is None
    assert summary.joints[0].torque_rms is None


def test_limit_violations_start_at_the_interpolated_crossing() -> None:
    time, q = np.array([0.0, 1.0, 2.0]), np.array([[0.0], [1.0], [3.0]])
    (finding,) = limit_findings(one_joint(position=(-1.0, 2.0)), time, q)
    assert finding.kind is LimitKind.POSITION
    assert finding.first_time == pytest.approx(1.5)
    assert (finding.worst, finding.worst_time, finding.limit) == (3.0, 2.0, 2.0)


def test_a_limit_that_is_reached_exactly_is_not_exceeded() -> None:
    time, q = np.array([0.0, 1.0]), np.array([[0.0], [2.0 * (1 + 1e-12)]])
    assert limit_findings(one_joint(position=(-1.0, 2.0)), time, q) == ()


def test_warnings_have_joint_time_and_value_in_display_units() -> None:
    robot = one_joint(position=(-math.pi / 2, math.pi / 2), speed=0.5, torque=10.0)
    time = np.array([0.0, 1.0, 2.0])
    q, qd, tau = np.array([[0.0], [0.0], [math.pi]]), np.full((3, 1), -1.0), np.array([[0.0], [-12.0], [0.0]])
    with pytest.warns(LimitWarning) as caught:
        warn_of_limits(limit_findings(robot, time, q, qd, tau))
    texts = [str(warning.message) for warning in caught]
    assert texts == [
        "joint 'swing' leaves its range (−90 … 90 deg) from t = 1.5 s on: 180 deg at t = 2 s",
        "joint 'swing' is faster than allowed (at most 28.65 deg/s) from t = 0 s on: −57.3 deg/s at t = 0 s",
        "joint 'swing' needs more torque than allowed (at most 10 N m) from t = 0.8333 s on: "
        "−12 N m at t = 1 s",
    ]


def test_warnings_of_a_prismatic_joint_are_in_metres() -> None:
    joint = Prismatic(limits=JointLimits(position=(0.0, 1.0), torque=10.0))
    robot = Robot(name="slide", links=(Link(name="z", joint=joint, mass=1.0),))
    time, q, tau = np.array([0.0, 1.0]), np.array([[0.0], [1.25]]), np.array([[0.0], [12.0]])
    out_of_range, too_strong = limit_findings(robot, time, q, tau=tau)
    assert "(0 … 1 m)" in out_of_range.text and "1.25 m" in out_of_range.text
    assert "needs more force than allowed (at most 10 N)" in too_strong.text


def test_additional_interpolated_rows_change_no_average() -> None:
    """Rows of a logged run have uneven times: a row on the line between two others adds no information."""
    time = np.array([0.0, 1.0, 3.0, 3.5, 7.0])
    values = np.array([0.0, 2.0, -1.0, 4.0, 0.5])
    random = np.random.default_rng(7)
    more = np.unique(np.concatenate([time, random.uniform(0.0, 1.0, 40), random.uniform(3.5, 7.0, 3)]))
    interpolated = np.interp(more, time, values)
    assert root_mean_square(more, interpolated) == pytest.approx(root_mean_square(time, values), rel=1e-13)
    assert signed_integrals(more, interpolated) == pytest.approx(signed_integrals(time, values), rel=1e-13)
    # By hand: the integral of the square over 0..1 is 4/3, over 1..3 it is 2, and so on.
    square = 4 / 3 + 2.0 + (1 - 4 + 16) / 6 + 3.5 * (16 + 2 + 0.25) / 3
    assert root_mean_square(time, values) == pytest.approx(math.sqrt(square / 7.0), rel=1e-14)
