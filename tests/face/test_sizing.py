"""Sizing of drives: closed forms of one joint, the arm's own equations, limits, catalogues, reports."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import armblocks as ab
from armblocks.errors import InputError, RobotError, UnknownNameError
from armblocks.report.drive_load import DriveLoad
from armblocks.robot import standard_dh

DRIVE = ab.Drive(name="d", gear_ratio=50.0, stall_torque=2.0, max_speed=300.0, peak_torque=6.0)
MASS, LENGTH, GRAVITY = 3.0, 0.8, 9.81


def pendulum(gravity: float = GRAVITY) -> ab.Arm:
    """A point mass at the end of a rod; horizontal at q = 0."""
    link = standard_dh("joint", a=LENGTH, mass=MASS, centre_of_mass=(0, 0, 0), inertia=(0, 0, 0))
    return ab.Arm(ab.Robot(name="pendulum", links=(link,), gravity=(0.0, -gravity, 0.0)))


def sine(amplitude: float, frequency: float, samples: int = 401) -> ab.JointTrajectory:
    """One period of q = A sin(w t)."""
    w = 2 * math.pi * frequency
    t = np.linspace(0.0, 1.0 / frequency, samples)
    q, qd, qdd = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t), -amplitude * w * w * np.sin(w * t)
    return ab.JointTrajectory(t=t, q=q[:, None], qd=qd[:, None], qdd=qdd[:, None])


def only(report: ab.SizingReport) -> DriveLoad:
    (load,) = report.loads
    return load


def test_a_sine_motion_without_gravity_has_the_closed_form() -> None:
    A, f, drive = 0.5, 0.7, replace(DRIVE, inertia=2e-4)
    load = only(ab.size_drives(pendulum(0.0), sine(A, f), [drive]))
    w, G = 2 * math.pi * f, drive.gear_ratio
    inertia = MASS * LENGTH**2 / G + drive.inertia * G  # at the motor, per joint acceleration
    torque, speed = inertia * A * w * w, G * A * w
    assert load.rms_torque == pytest.approx(torque / math.sqrt(2), rel=1e-4)
    assert load.mean_speed == pytest.approx(2 * speed / math.pi, rel=1e-4)
    assert load.peak_power == pytest.approx(torque * speed / 2, rel=1e-4)
    # Power is torque speed sin(2 w t) / 2: each of four quarters has the energy torque speed / (2 w).
    assert load.energy == pytest.approx(torque * speed / w, rel=1e-4)
    assert load.regenerated_energy == pytest.approx(load.energy, rel=1e-6)
    assert load.inertia_ratio == pytest.approx(MASS * LENGTH**2 / G**2 / drive.inertia, rel=1e-9)
    assert load.used("speed") == pytest.approx(speed / 300.0, rel=1e-9)
    assert load.used("peak torque") == pytest.approx(torque / 6.0, rel=1e-3)
    assert load.holding_torque == pytest.approx(0.0, abs=1e-15)


def test_a_pendulum_held_at_rest_has_constant_torque() -> None:
    drive = replace(DRIVE, brake_torque=1.0, thermal_time_constant=60.0, torque_constant=0.4, resistance=2.0)
    held = ab.JointTrajectory(t=np.array([0.0, 2.0]), **{k: np.zeros((2, 1)) for k in ("q", "qd", "qdd")})
    torque = MASS * LENGTH * GRAVITY / drive.gear_ratio
    load = only(ab.size_drives(pendulum(), held, [drive], pause=3.0))
    assert load.rms_torque == pytest.approx(torque, rel=1e-12)
    assert load.temperature_rise == pytest.approx((torque / 2.0) ** 2, rel=1e-9)
    assert load.used("brake") == pytest.approx(torque / 1.0, rel=1e-12)
    assert load.copper_loss == pytest.approx(2.0 * (torque / 0.4) ** 2 * 5.0, rel=1e-12)
    assert load.energy == load.regenerated_energy == 0.0
    assert load.cycles_per_hour == pytest.approx(720.0)
    released = only(ab.size_drives(pendulum(), held, [drive], pause=3.0, brakes_in_pause=True))
    assert released.rms_torque == pytest.approx(torque * math.sqrt(2 / 5), rel=1e-12)
    heavier = only(ab.size_drives(pendulum(), held, [drive], payload=1.0))
    assert heavier.holding_torque == pytest.approx(torque * (MASS + 1) / MASS, rel=1e-12)


def test_the_temperature_approaches_the_mean_and_the_peak_of_the_heat() -> None:
    """On/off duty in the periodic state: (1 - exp(-a)) / (1 - exp(-c)) of the heat while on."""
    on, off, constant = 2.0, 6.0, 4.0
    held = ab.JointTrajectory(t=np.array([0.0, on]), **{k: np.zeros((2, 1)) for k in ("q", "qd", "qdd")})
    heat = (MASS * LENGTH * GRAVITY / 50.0 / 2.0) ** 2
    for tau in (constant, 1e-3, 1e6):
        drive = replace(DRIVE, thermal_time_constant=tau)
        load = only(ab.size_drives(pendulum(), held, [drive], pause=off, brakes_in_pause=True))
        expected = heat * math.expm1(-on / tau) / math.expm1(-(on + off) / tau)
        assert load.temperature_rise == pytest.approx(expected, rel=1e-6)


def test_the_most_cycles_have_the_rms_torque_at_its_limit() -> None:
    path = ab.point_to_point(0.0, 1.0, speed=5.0, acceleration=30.0)
    weak = replace(DRIVE, stall_torque=0.5)
    load = only(ab.size_drives(pendulum(0.0), path, [weak]))
    assert load.rms_torque > 0.5 and not load.passes
    pause = 3600.0 / load.most_cycles_per_hour - path.duration
    paced = only(ab.size_drives(pendulum(0.0), path, [weak], pause=pause))
    assert paced.rms_torque == pytest.approx(0.5, rel=1e-9)
    assert paced.used("RMS torque") == pytest.approx(1.0, rel=1e-9)
    strong = only(ab.size_drives(pendulum(0.0), path, [DRIVE]))
    assert strong.most_cycles_per_hour == pytest.approx(3600.0 / path.duration)


def test_gear_losses_raise_the_driving_and_lower_the_braking_torque() -> None:
    path = ab.jtraj(0.0, -1.2, np.linspace(0, 3.0, 50))  # the weight drives the motor
    ideal = only(ab.size_drives(pendulum(), path, [DRIVE]))
    real = only(ab.size_drives(pendulum(), path, [replace(DRIVE, efficiency=0.8)]))
    assert_allclose(real.torque, ideal.torque * 0.8, rtol=1e-12)
    up = ab.jtraj(-1.2, 0.0, np.linspace(0, 3.0, 50))
    ideal, real = (only(ab.size_drives(pendulum(), up, [replace(DRIVE, efficiency=e)])) for e in (1.0, 0.8))
    assert_allclose(real.torque, ideal.torque / 0.8, rtol=1e-12)
    # Without losses the work over a closed motion is zero.
    both = only(ab.size_drives(pendulum(), sine(0.4, 0.5), [DRIVE]))
    assert both.energy == pytest.approx(both.regenerated_energy, rel=1e-4)


def test_the_motors_of_a_robot_file_as_drives_have_the_torques_of_rne() -> None:
    """Each motor of the Puma as a drive: its torque times the gear ratio is arm.rne of the whole robot."""
    arm = ab.load_robot("puma560")
    symmetric = [
        replace(link, motor=replace(link.motor, coulomb_friction=abs(link.motor.coulomb_friction[0])))
        for link in arm.robot.links
    ]
    arm = ab.Arm(replace(arm.robot, links=tuple(symmetric)))
    path = ab.jtraj(np.zeros(6), [0.5, -0.8, 1.0, 0.4, 0.3, -0.6], np.linspace(0, 1, 30))
    drives = [
        ab.Drive(
            name=link.name,
            joints=(link.name,),
            gear_ratio=abs(link.motor.gear_ratio),
            stall_torque=1.0,
            max_speed=500.0,
            inertia=link.motor.inertia,
            viscous_friction=link.motor.viscous_friction,
            coulomb_friction=link.motor.coulomb_friction[0],
        )
        for link in arm.robot.links
    ]
    report = ab.size_drives(arm, path, drives, payload=2.0)
    assert [load.joint for load in report.loads] == list(arm.robot.joint_names)
    for j, load in enumerate(report.loads):
        inner = slice(1, -1)  # at rest rne has no Coulomb friction
        q, qd, qdd = path(load.time)
        expected = arm.rne(q, qd, qdd, payload=2.0)[:, j] / load.drive.gear_ratio
        assert_allclose(load.torque[inner], expected[inner], rtol=0, atol=1e-9 * np.abs(expected).max())


def test_torque_curves_are_lines_through_their_points() -> None:
    drive = replace(DRIVE, rated_torque=1.6, rated_speed=200.0, corner_speed=220.0)
    assert_allclose(drive.continuous_torque(np.array([0.0, 200.0, -300.0])), [2.0, 1.6, 1.4])
    speeds = [0.0, 220.0, 260.0, 300.0, 400.0]
    assert_allclose(drive.peak_torque_at(speeds), [6.0, 6.0, 3.7, 1.4, 1.4])
    assert DRIVE.peak_torque_at(100.0) == 6.0


def test_gear_limits_use_output_torques() -> None:
    drive = replace(DRIVE, gear_peak_torque=100.0, gear_rated_torque=20.0, gear_max_speed=200.0)
    load = only(ab.size_drives(pendulum(), sine(0.3, 0.5), [drive]))
    assert load.used("gear peak torque") == pytest.approx(np.abs(load.output_torque).max() / 100.0)
    weights = np.abs(load.speed)
    mean = np.average(np.abs(load.output_torque) ** 3, weights=weights) ** (1 / 3)
    assert load.used("gear mean torque") == pytest.approx(mean / 20.0, rel=5e-3)
    assert not load.passes and load.tightest.name == "gear mean torque"
    assert load.tightest.margin == pytest.approx(1 - load.used("gear mean torque"))


CATALOGUE = """\
name,joint,gear_ratio,stall_torque_nm,max_speed_rpm,rated_torque_nm,rated_speed_rpm,inertia_kgm2
small,,50,0.2,3000,,,1e-5
large,,50,2.0,3000,1.8,2000,1e-4
"other, with comma",joint; joint,80,3.0,6000,,,
"""


def test_catalogues_are_read_in_their_units(tmp_path: Path) -> None:
    (tmp_path / "motors.csv").write_text(CATALOGUE)
    small, large, other = ab.load_drives(tmp_path / "motors.csv")
    assert small.max_speed == pytest.approx(100 * math.pi) and small.joints == ()
    assert large.rated_speed == pytest.approx(2000 * math.pi / 30) and large.rated_torque == 1.8
    assert other.name == "other, with comma" and other.joints == ("joint", "joint")
    report = ab.size_drives(pendulum(), sine(0.3, 0.5), [small, large, other])
    suggested = report.suggested["joint"]
    assert suggested is not None and suggested.drive is large
    assert [row["result"] for row in report.table()] == ["FAIL", "pass", "pass"]
    assert "joint: large" in str(report) and '"other, with comma"' in report.csv()
    names = {path.name for path in report.write(tmp_path / "out")}
    assert names == {"sizing.html", "sizing.csv", "torque-speed-1.svg"}
    page = (tmp_path / "out" / "sizing.html").read_text()
    assert "Drives of pendulum" in page and "FAIL" in page and "<svg" in page
    assert "fails" in report.picture("joint", "small").description
    failing = ab.size_drives(pendulum(), sine(0.3, 0.5), [small])
    assert failing.suggested == {"joint": None} and "no candidate passes" in str(failing)
    for arguments in (("elbow",), ("joint", "tiny")):
        with pytest.raises(UnknownNameError):
            report.picture(*arguments)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,gear_ratio\na,1\n", "the column 'stall_torque_nm' is missing"),
        ("name,gear_ratio,stall_torque_nm,max_speed_rpm\n", "the catalogue has no rows"),
        (
            "name,gear_ratio,stall_torque_nm,max_speed_rpm\na,1,x,3\n",
            "csv:2: stall_torque_nm = 'x'.*decimal point",
        ),
        ("name,gear_ratio,stall_torque_nm,max_speed_rpm\na,1,,3\n", "csv:2: stall_torque_nm is empty"),
        ("name,gear_ratio,stall_torque_nm,max_speed_rpm\na,1,2,3,4\n", "csv:2: the row has more cells than"),
        ("name,gear_ratio,stall_torque_nm,max_speed_rpm\na,-1,2,3\n", "csv:2, drive 'a': gear_ratio = -1.0"),
    ],
)
def test_invalid_catalogues_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "motors.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        ab.load_drives(tmp_path / "motors.csv")


def test_unknown_columns_and_joints_are_refused(tmp_path: Path) -> None:
    (tmp_path / "motors.csv").write_text("name,gear_ration\n")
    with pytest.raises(UnknownNameError, match="no column named 'gear_ration'"):
        ab.load_drives(tmp_path / "motors.csv")
    with pytest.raises(UnknownNameError, match="no joint named 'elbow'"):
        ab.size_drives(pendulum(), sine(1, 1), [replace(DRIVE, joints=("elbow",))])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: replace(DRIVE, efficiency=1.2), "efficiency = 1.2.*above 0 and up to 1"),
        (lambda: replace(DRIVE, inertia=-1.0), "inertia = -1.0.*0 or more"),
        (lambda: replace(DRIVE, stall_torque=math.inf), "stall_torque = inf.*a finite number"),
        (lambda: replace(DRIVE, max_speed="fast"), "max_speed = 'fast'"),
        (lambda: replace(DRIVE, rated_torque=1.0), "rated_torque and rated_speed are not given together"),
        (lambda: ab.size_drives(pendulum(), sine(1, 1), [DRIVE], pause=-1.0), "pause = -1.0.*0 or more"),
        (lambda: ab.size_drives(pendulum(), sine(1, 1), [DRIVE], pause="1"), "pause = '1'.*0 or more"),
        (lambda: ab.size_drives(pendulum(), sine(1, 1), []), "no candidate for the joint 'joint'"),
        (
            lambda: ab.size_drives(pendulum(), ab.point_to_point(0, 0, speed=1, acceleration=1), [DRIVE]),
            "the trajectory has no duration",
        ),
    ],
)
def test_invalid_arguments_are_refused(call: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()


def test_a_motor_at_a_dependent_joint_is_refused() -> None:
    links = tuple(
        ab.Link(name=name, parent=parent, mass=1.0, inertia=(1, 1, 1), motor=motor)
        for name, parent, motor in (("a", None, None), ("b", "a", ab.Motor()))
    )
    robot = ab.Robot(
        name="geared", links=links, constraints=(ab.Coupling(name="c", terms=(("b", 1.0), ("a", -2.0))),)
    )
    with pytest.raises(RobotError, match="the joint 'b' has a motor and depends on other joints"):
        ab.size_drives(ab.Arm(robot), sine(1, 1), [DRIVE])
