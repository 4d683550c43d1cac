"""Reports of trajectories: peaks, utilisation of limits, intervals of binding limits, the figure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import InputError
from armblocks.robot import standard_dh


def slider() -> ab.Arm:
    """A mass of 2 kg on a horizontal line."""
    link = standard_dh("x", sigma=1, mass=2.0)
    return ab.Arm(ab.Robot(name="slider", links=(link,), gravity=(0.0, -9.81, 0.0)))


def test_a_trapezoidal_motion_binds_acceleration_speed_acceleration() -> None:
    path = ab.point_to_point(0.0, 2.0, speed=1.0, acceleration=2.0)
    report = ab.trajectory_report(slider(), path, speed=1.0, acceleration=2.0, torque=8.0)
    (row,) = report.table()
    assert report.cycle_time == pytest.approx(2.5)
    assert [row[name] for name in ("lowest", "highest", "speed", "acceleration")] == pytest.approx(
        [0, 2, 1, 2]
    )
    assert row["torque"] == pytest.approx(4.0) and row["torque %"] == pytest.approx(50.0)
    phases = [(part.quantity, part.start, part.end) for part in report.binding]
    assert [name for name, *_ in phases] == ["acceleration", "speed", "acceleration"]
    assert np.ravel([times for _, *times in phases]) == pytest.approx([0, 0.5, 0.5, 2.0, 2.0, 2.5], abs=0.02)
    assert report.exceeded == ()
    assert "slider: cycle time 2.5 s" in str(report)
    assert "acceleration of x" in str(report)


def test_the_share_of_a_limit_that_does_not_exist_is_unknown() -> None:
    path = ab.point_to_point(-0.3, 0.6, speed=1.0, acceleration=2.0)
    (row,) = ab.trajectory_report(slider(), path, speed=1.0).table()
    assert row["speed %"] == pytest.approx(100.0)
    assert np.isnan([row["acceleration %"], row["torque %"]]).all()


def test_rounding_errors_of_a_position_of_0_are_not_shown() -> None:
    path = ab.spline_trajectory([[0.0], [0.2], [0.0]], [0.0, 1.0, 2.0])
    q = path.q - 5e-17
    report = ab.trajectory_report(slider(), ab.JointTrajectory(t=path.t, q=q, qd=path.qd, qdd=path.qdd))
    assert report.table()[0]["lowest"] == 0.0 and "e−17" not in str(report)


@pytest.mark.parametrize("payload", [None, 0.5])
def test_rounding_errors_of_a_speed_at_rest_cause_no_friction(payload: float | None) -> None:
    """The speeds at both ends, and those of a joint that does not move, are -3e-15 rad/s instead of 0."""
    puma = ab.load_robot("puma560")
    target = np.array([0.4, 0.4, 0.4, 0.4, 0.4, 0.0])
    motion = ab.jtraj(np.zeros(6), target, np.linspace(0.0, 2.0, 41))
    qd = motion.qd.copy()
    qd[[0, -1]] = qd[:, 5] = -3e-15
    rounded = ab.JointTrajectory(t=motion.t, q=motion.q, qd=qd, qdd=motion.qdd)
    report = ab.trajectory_report(puma, rounded, payload=payload)
    for row in (0, -1):
        holding = puma.rne(motion.q[row], np.zeros(6), motion.qdd[row], payload=payload or 0.0)
        assert report.tau[row] == pytest.approx(holding, abs=1e-9)


def test_exceeded_limits_are_sentences() -> None:
    arm = ab.load_robot("puma560")
    path = ab.jtraj(np.zeros(6), [6.0, 0, 0, 0, 0, 0], np.linspace(0, 1, 50))
    report = ab.trajectory_report(arm, path, speed=2.0, payload=1.0)
    assert report.position_margin[0] < 0
    assert "position outside its range by" in report.exceeded[0]
    assert any("speed" in sentence and "562.5 % of its limit at" in sentence for sentence in report.exceeded)
    assert "exceeded: " in str(report)


def test_figures_are_written_as_svg_and_png(tmp_path: Path) -> None:
    report = ab.trajectory_report(slider(), ab.jtraj(0.0, 1.0, np.linspace(0, 1, 20)), speed=3.0)
    report.save(tmp_path / "a.svg")
    report.save(tmp_path / "a.png")
    assert "Speed of its limit, %" in (tmp_path / "a.svg").read_text()
    assert "Torque" in (tmp_path / "a.svg").read_text()
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match=r"is neither SVG nor PNG"):
        report.save(tmp_path / "a.gif")


def test_a_trajectory_of_another_robot_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"the trajectory has 2 joints.*1, the number of joints of robot 'slider'"
    ):
        ab.trajectory_report(slider(), ab.jtraj([0, 0], [1, 1], 5))


def test_a_report_names_the_first_contact() -> None:
    arm = ab.load_robot("twolink")
    motion = ab.jtraj([0.0, 0.0], [1.0, 0.0], np.linspace(0.0, 2.0, 30))
    wall = ab.Box(size=(0.1, 2.0, 0.1), pose=ab.Transform(translation=(1.5, 0.0, 1.2)), name="lamp")
    report = ab.trajectory_report(arm, motion, obstacles=[wall])
    assert report.collisions is not None and report.collisions.first_contact is not None
    contact = report.collisions.first_contact
    assert (contact.first, contact.second) == ("link2", "lamp")
    assert f"collisions: first contact of link2 and lamp at {contact.contact:.4f}"[:45] in str(report)
    free = ab.trajectory_report(arm, motion, obstacles=[ab.Plane(point=(0, 0, -1))])
    assert "collisions: no contact, minimum distance" in str(free)
    alone = ab.trajectory_report(arm, motion, obstacles=())
    assert "collisions: no contact, minimum distance 0.7095 m" in str(alone)  # of base and link2
    nothing = ab.collisions(arm, [0.0, 0.0], ignore=[("base", "link2")])
    assert nothing.summary == "no pair of bodies is compared" and not nothing.collides
    assert ab.trajectory_report(arm, motion).collisions is None
