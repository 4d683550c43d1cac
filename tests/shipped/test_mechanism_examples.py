"""The examples of mechanisms: their closed forms, and the figures that the guide quotes."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.dynamics.mechanism import Mechanism

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name: str) -> dict[str, Any]:
    """The names that the script of an example defines."""
    return runpy.run_path(str(EXAMPLES / name / f"{name}.py"))


def test_the_top_precesses_and_nods_as_in_its_closed_forms(capsys: pytest.CaptureFixture[str]) -> None:
    names = example("spinning_top")
    for rate in (*names["steady_rates"](), 0.0):
        assert names["deviation"](rate, ab.simulate(names["diagram"](rate))) < 1e-6
    assert "precession 3.7685 rad/s" in capsys.readouterr().out


def test_the_strokes_of_the_stewart_platform_assemble_at_the_desired_pose() -> None:
    """The closed form of the legs, its derivatives, and six degrees of freedom. The run itself is long."""
    names = example("stewart_platform")
    robot, motion = names["platform"](20.0), names["leg_motion"]()
    mechanism = Mechanism(robot)
    assert mechanism.mobility(robot.neutral).degrees_of_freedom == 6
    legs = [f"leg{k}" for k in range(1, 7)]
    entries = [[entry.name for entry in robot.positions].index(leg) for leg in legs]
    q = robot.neutral.copy()
    q[entries] = motion.q[100]
    q = mechanism.assembled(q, legs)
    displacement, *_ = names["desired"](np.array([1.0]))
    pose = ab.Arm(robot).fkine(q, frame="platform")
    assert pose[:3, 3] == pytest.approx(displacement[0, :3] + (0.0, 0.0, names["HEIGHT"]), abs=1e-9)
    assert pose[:3, :3] == pytest.approx(names["rotations"](displacement[:, 3])[0], abs=1e-9)
    for value, rate in ((motion.q, motion.qd), (motion.qd, motion.qdd)):
        # Errors of the difference quotients: h^2 / 6 times the third derivative, which jumps at the stations.
        difference = (value[2:] - value[:-2]) / 0.02 - rate[1:-1]
        assert np.abs(np.delete(difference, [99, 199], axis=0)).max() < 6e-3


def test_the_arms_of_the_delta_robot_follow_from_its_path_in_closed_form() -> None:
    """Three degrees of freedom, the pose at all times, and the derivatives of the angles."""
    names = example("delta_robot")
    robot, motion = names["delta"](), names["arm_motion"]()
    arm, mechanism = ab.Arm(robot), Mechanism(robot)
    assert mechanism.mobility(robot.neutral).degrees_of_freedom == 3
    arms = ("arm1", "arm2", "arm3")
    entries = [[entry.name for entry in robot.positions].index(name) for name in arms]
    for k in (0, 50, 70, 120, 160):
        q = robot.neutral.copy()
        q[entries] = motion.q[k]
        pose = arm.fkine(arm.assemble(q, locked=arms).q)
        assert pose[:3, 3] == pytest.approx(names["desired"](motion.t[[k]])[0][0], abs=1e-9)
        assert pose[:3, :3] == pytest.approx(np.eye(3), abs=1e-9)
    # Between samples the motion is a quintic with these derivatives; the accelerations have no jumps.
    t = np.linspace(0.0, motion.t[-1], 40)[1:-1]
    found, expected = motion(t), names["arm_angles"](*names["desired"](t))
    assert found.q == pytest.approx(expected[0], abs=1e-6)
    assert found.qd == pytest.approx(expected[1], abs=1e-3)


def test_the_torques_of_the_delta_robot_do_the_virtual_work_of_its_point_masses() -> None:
    """A slender rod has the virtual work of 1/6, 2/3 and 1/6 of its mass at its start, middle and end."""
    names = example("delta_robot")
    robot, arms = names["delta"](), ("arm1", "arm2", "arm3")
    arm = ab.Arm(robot)
    columns = [[entry.name for entry in robot.speeds].index(name) for name in arms]
    t, step = 0.28, 1e-4
    path = names["desired"](np.array([t]))

    def points(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angles (3,) of the arms, and all point masses of arms, rods and platform (13, 3)."""
        angle = names["arm_angles"](p[None], np.zeros((1, 3)), np.zeros((1, 3)))[0][0]
        rows = []
        for k, value in enumerate(angle):
            u = np.array([np.cos(2 * np.pi / 3 * k), np.sin(2 * np.pi / 3 * k), 0.0])
            hinge, end = names["BASE_RADIUS"] * u, p + names["PLATFORM_RADIUS"] * u
            elbow = hinge + names["ARM"] * (np.cos(value) * u - (0, 0, np.sin(value)))
            rows += [(hinge + elbow) / 2, elbow, (elbow + end) / 2, end]
        return angle, np.array([*rows, p])

    beam, rods = names["ARM_MASS"], 2 * names["ROD_MASS"]
    load = 1.0
    masses = [4 / 6 * beam, beam / 6 + rods / 6, 4 / 6 * rods, rods / 6] * 3
    masses = np.array([*masses, names["PLATFORM_MASS"] + load])
    # Accelerations of the points and their derivatives by the position of the platform, by differences.
    around = [points(names["desired"](np.array([t + k * step]))[0][0])[1] for k in (-1, 0, 1)]
    acceleration = (around[0] - 2 * around[1] + around[2]) / step**2 - np.array((0, 0, robot.gravity[2]))
    moved = [[points(path[0][0] + s * step * axis) for s in (-1, 1)] for axis in np.eye(3)]
    force = [
        (masses[:, None] * acceleration * (ahead[1] - behind[1])).sum() / (2 * step)
        for behind, ahead in moved
    ]
    turns = np.array([(ahead[0] - behind[0]) / (2 * step) for behind, ahead in moved])  # (3 xyz, 3 arms)
    angle, rate, second = (value[0] for value in names["arm_angles"](*path))
    motor = names["MOTOR"]
    drive = motor.gear_ratio**2 * (motor.inertia * second + motor.viscous_friction * rate)
    expected = np.linalg.solve(turns, force) + drive

    q = robot.neutral.copy()
    q[columns] = angle
    q = arm.assemble(q, locked=arms).q
    J = Mechanism(robot).jacobian(q)
    others = np.setdiff1d(np.arange(robot.nv), columns)
    qd, qdd = np.zeros((2, robot.nv))
    qd[columns] = rate
    qd[others] = -np.linalg.lstsq(J[:, others], J[:, columns] @ rate)[0]
    ahead, behind = (Mechanism(robot).jacobian(arm.integrate(q, qd, s * 1e-6)) @ qd for s in (1, -1))
    qdd[columns] = second
    drift = (ahead - behind) / 2e-6
    qdd[others] = -np.linalg.lstsq(J[:, others], J[:, columns] @ second + drift)[0]
    torque = arm.rne(q, qd, qdd, payload=ab.Payload(mass=load))
    assert torque[columns] == pytest.approx(expected, abs=1e-4)
    assert np.abs(np.delete(torque, columns)).max() == 0.0


def test_the_pins_of_the_palletiser_do_the_work_of_its_couplings() -> None:
    """Virtual work: the torques of the pinned robot's drives give those of the catalogue's four axes."""
    names = example("palletiser_linkage")
    robot = names["pinned"](spring=False)
    A, b = names["joint_map"](robot)
    drives = [robot.joint_names.index(name) for name in names["DRIVES"]]
    random = np.random.default_rng(3)
    q, (qd, qdd) = names["START"] + random.uniform(-0.4, 0.4, (5, 4)), random.uniform(-1.0, 1.0, (2, 5, 4))
    load = ab.Payload(mass=names["LOAD"])
    expected = ab.load_robot("kr180_2_pa").rne(q, qd, qdd, payload=load)
    found = ab.Arm(robot).rne(q @ A.T + b, qd @ A.T, qdd @ A.T, payload=load)[:, drives]
    # The drive lever moves with axes 2 and 3.
    found[:, 1] += found[:, 2]
    assert found == pytest.approx(expected, abs=1e-8)


def test_the_forces_of_the_palletiser_at_rest_obey_statics() -> None:
    """Moments about the wrist give the force of the upper level rod; sensors and pins agree."""
    names = example("palletiser_linkage")
    robot, g, load = names["pinned"](spring=False), 9.81, names["LOAD"]
    A, b = names["joint_map"](robot)
    axes, mass = np.array([0.3, -1.1, 1.2, 0.5]), {link.name: link.mass for link in robot.links}
    state, payload = (A @ axes + b, np.zeros(13), np.zeros(13)), ab.Payload(mass=load)
    lean = axes[1] + np.pi / 2  # of the lower arm, from the vertical
    arm = ab.Arm(robot)
    wrenches, torques = arm.joint_wrenches(*state, payload=payload), arm.rne(*state, payload=payload)
    rows = {link.name: row for link, row in zip(robot.links, wrenches)}
    pins = dict(zip((closure.name for closure in robot.closures), wrenches[len(robot.links) :]))
    # The weight of the wrist is 0.125 m before its axis, flange and load 0.25 m. The pin is 0.2025 m above.
    moment = g * (0.125 * mass["wrist"] + 0.25 * (mass["flange"] + load))
    assert pins["pin of upper_level_rod"][0] == pytest.approx(-moment / 0.2025, abs=1e-8)
    for rod in names["RODS"]:
        sensor = f"{rod}_end"
        force = torques[robot.joint_names.index(sensor)]
        assert force == pytest.approx(rows[sensor][0 if rod == "upper_level_rod" else 2], abs=1e-8)
        assert np.linalg.norm(rows[sensor][:3]) == pytest.approx(np.linalg.norm(pins[f"pin of {rod}"][:3]))
    # The base carries all weights.
    assert rows["turret"][2] == pytest.approx(g * (sum(mass.values()) + load), abs=1e-8)
    # Per radian of the lower arm the elbow moves by 1.25 m, the centres of bars along the arm by 0.625 m.
    elbow = sum(mass[name] for name in ("upper_arm", "triangle", "upper_level_rod", "wrist", "flange")) + load
    bars = sum(mass[name] for name in ("lower_arm", "drive_rod", "lower_level_rod"))
    lower_arm = robot.joint_names.index("lower_arm")
    work = g * np.sin(lean) * (1.25 * elbow + 0.625 * bars)
    assert torques[lower_arm] == pytest.approx(-work, abs=1e-8)
    sprung = ab.Arm(names["pinned"](spring=True)).rne(*state, payload=payload)
    relief = names["STIFFNESS"] * names["ANCHOR"] * names["END"] * np.sin(lean)
    assert sprung[lower_arm] - torques[lower_arm] == pytest.approx(relief, abs=1e-8)
