"""Palletising arms: published dimensions, a level flange, and their linkages as closed loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Constant, ForwardDynamics
from armblocks.dynamics import trace_accel, trace_fkine, trace_gravload, trace_link_poses, trace_rne
from armblocks.errors import InputError
from armblocks.formats.robot_json import read_robot, write_robot
from armblocks.robot import Attachment, Motor, RevoluteClosure, Robot
from armblocks.robot.palletiser import AxisConvention, Masses, palletiser
from armblocks.spatial import transl
from maximal_coordinates import accelerations

DEG = np.pi / 180


def m410(convention: str = "absolute", masses: Masses | None = None) -> Robot:
    """The FANUC M-410iC/185: lengths of the data sheet; joint 3 is positive upwards."""
    return palletiser(
        "M-410iC/185",
        shoulder_height=1.11,
        shoulder_offset=0.39,
        lower_arm=1.22,
        upper_arm=1.3,
        wrist_offset=0.255,
        flange_drop=0.159,
        upper_arm_angle=convention,  # type: ignore[arg-type]
        axes=(AxisConvention(), AxisConvention(), AxisConvention(sign=-1.0), AxisConvention()),
        masses=masses,
    )


@pytest.mark.parametrize(("q2", "q3", "height"), [(0.0, 10.0, 2.397), (100.0, -90.0, -0.561)])
def test_the_envelope_of_the_data_sheet(q2: float, q3: float, height: float) -> None:
    (T,) = trace_fkine(m410())(np.array([0.0, q2, q3, 0.0]) * DEG)
    assert T[2, 3] == pytest.approx(height, abs=5e-4)


def test_the_flange_stays_level_and_its_yaw_is_that_of_turret_and_flange() -> None:
    fkine = trace_fkine(m410())
    for q in np.random.default_rng(0).uniform(-1.5, 1.5, (10, 4)):
        (T,) = fkine(q)
        assert T[:3, 2] == pytest.approx([0.0, 0.0, -1.0], abs=1e-14)
        assert T[:2, 0] == pytest.approx([np.cos(q[0] - q[3]), np.sin(q[0] - q[3])], abs=1e-14)


def test_both_conventions_describe_one_arm() -> None:
    """With relative angles q3 is the angle between the arms; torques follow by virtual work."""
    masses = Masses.estimated(185.0, 1.22, 1.3)
    absolute, relative = m410("absolute", masses), m410("relative", masses)
    random = np.random.default_rng(1)
    for _ in range(3):
        q, qd, qdd = random.uniform(-1, 1, (3, 4))
        to_absolute = np.eye(4)
        to_absolute[2, 1] = -1.0  # phi3 = -q3 here: phi3 = phi2 - q3_relative
        angles = [to_absolute @ value for value in (q, qd, qdd)]
        assert trace_fkine(relative)(q)[0] == pytest.approx(trace_fkine(absolute)(angles[0])[0], abs=1e-13)
        tau = trace_rne(absolute)(*angles)[0]
        assert trace_rne(relative)(q, qd, qdd)[0] == pytest.approx(to_absolute.T @ tau, abs=1e-8)


def test_the_linkages_are_closed_loops() -> None:
    """The pins of the parallelograms stay together; the motion is that of loops in maximal coordinates."""
    robot = m410("absolute", Masses.estimated(185.0, 1.22, 1.3))
    q, qd, tau = np.random.default_rng(2).uniform(-0.8, 0.8, (3, 4))
    pins = (
        ("drive_rod", (0, 0, 1.22), "upper_arm", (-0.39, 0, 0)),
        ("lower_level_rod", (0, 0, 1.22), "triangle", (-0.195, 0, 0.195)),
        ("upper_level_rod", (1.3, 0, 0), "wrist", (0, 0, 0.195)),
    )
    poses = dict(zip(("base", *(link.name for link in robot.links)), trace_link_poses(robot)(q)[0]))
    closures = []
    for first, at_first, second, at_second in pins:
        points = [poses[first] @ (*at_first, 1.0), poses[second] @ (*at_second, 1.0)]
        assert points[0] == pytest.approx(points[1], abs=1e-14)
        across = transl(0, 0, 0).rotation, ((1, 0, 0), (0, 0, 1), (0, -1, 0))
        ends = [
            Attachment(link=link, pose=transl(*at) @ replace(transl(0, 0, 0), rotation=across[1]))
            for link, at in ((first, at_first), (second, at_second))
        ]
        closures.append(RevoluteClosure(name=first, first=ends[0], second=ends[1]))
    loops = replace(robot, constraints=tuple(closures))
    coordinates = robot.coordinate_map
    tree_q = coordinates.positions @ q + np.array(
        [coordinates.offsets.get(link.name, 0.0) for link in robot.tree_links]
    )
    tree_tau = np.zeros(10)
    independent = [link.name not in coordinates.offsets for link in robot.tree_links]
    tree_tau[independent] = 1e3 * tau
    expected = accelerations(loops, tree_q, coordinates.speeds @ qd, tree_tau)
    (qdd,) = trace_accel(robot)(q, qd, 1e3 * tau)
    assert coordinates.speeds @ qdd == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


def test_motors_reflect_their_inertia_at_their_axes() -> None:
    plain = m410("absolute", Masses.estimated(185.0, 1.22, 1.3))
    motor = Motor(inertia=1e-3, gear_ratio=100.0)
    driven = plain.with_link("drive_lever", motor=motor)
    q, qd, qdd = np.random.default_rng(3).uniform(-1, 1, (3, 4))
    added = trace_rne(driven)(q, qd, qdd)[0] - trace_rne(plain)(q, qd, qdd)[0]
    assert added == pytest.approx([0.0, 0.0, 10.0 * qdd[2], 0.0], abs=1e-8)


def test_another_word_for_the_convention_is_refused() -> None:
    with pytest.raises(InputError, match="'absolute' or 'relative'"):
        m410("relativ")


def test_the_torques_that_hold_the_arm_hold_it_in_a_run() -> None:
    robot = read_robot(write_robot(m410("absolute", Masses.estimated(185.0, 1.22, 1.3))), "robot.json")
    q = np.array([0.1, 0.2, -0.1, 0.3])
    builder = ab.DiagramBuilder("hold")
    torque = builder.add("torque", Constant(value=trace_gravload(robot)(q)[0]))
    builder.add("arm", ForwardDynamics(robot=robot, q0=q), torque)
    result = ab.simulate(builder.build(), stop_time=0.5)
    assert result["arm/q"] == pytest.approx(np.tile(q, (len(result.time), 1)), abs=1e-9)
