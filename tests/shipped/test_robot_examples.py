"""The shipped diagrams of robots and machines, compared with closed forms and separate integrations."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import armblocks as ab
from armblocks.robot import Robot
from armblocks.robot.geometry import robot_bodies

SCRIPT = Path(__file__).parents[2] / "scripts" / "robot_examples.py"
SCRIPT_NAMES = runpy.run_path(str(SCRIPT))
BUILDERS = {build.__name__: build for build in SCRIPT_NAMES["BUILDERS"]}


@pytest.mark.parametrize("name", BUILDERS)
def test_example_files_equal_the_diagrams_of_the_script(name: str) -> None:
    assert ab.load_diagram(name) == BUILDERS[name]()


def test_the_robot_cell_file_equals_the_robot_of_the_script() -> None:
    assert ab.load_robot("kr180_cell").robot == SCRIPT_NAMES["kr180_cell"]()


def test_dc_motor_sampled_pid_equals_the_exact_recurrence() -> None:
    """Between two ticks the motor is linear: x(k+1) = exp(A T) x(k) + terms of voltage and load."""
    simulated = ab.simulate("dc_motor_sampled_pid", rtol=1e-10, atol=1e-12)
    R, L, k, J, b, T = 1.2, 5e-3, 0.25, 8e-3, 1e-3, 0.01
    A = np.array([[-R / L, -k / L, 1 / L, 0], [k / J, -b / J, 0, -1 / J], [0, 0, 0, 0], [0, 0, 0, 0]])
    step = expm(A * T)
    x, integral, filtered, speeds, currents = np.zeros(2), 0.0, 0.0, [], []
    for tick in range(401):
        speeds.append(x[1])
        currents.append(x[0])
        error = (100.0 if tick >= 20 else 0.0) - x[1]
        free = 0.6 * error + integral + 50.0 * (0.004 * error - filtered)
        v = min(max(free, -48.0), 48.0)
        saturated = free != v and (free - v) * error > 0
        integral += 0.0 if saturated else T * 4.0 * error
        filtered += T * 50.0 * (0.004 * error - filtered)
        x = (step @ [*x, v, 0.5 if tick >= 200 else 0.0])[:2]
    np.testing.assert_allclose(simulated["motor/w"][::5], speeds, rtol=0, atol=1e-7)
    np.testing.assert_allclose(simulated["motor/i"][::5], currents, rtol=0, atol=1e-7)
    # in steady state the current balances friction and load, the voltage resistance and back-EMF
    i = (b * 100.0 + 0.5) / k
    assert simulated["motor/w"][-1] == pytest.approx(100.0, abs=0.02)
    assert simulated["motor/i"][-1] == pytest.approx(i, abs=0.01)
    assert simulated["controller/y"][-1] == pytest.approx(R * i + k * 100.0, abs=0.02)
    assert simulated["controller/y"].max() == 48.0


def test_puma560_payload_drop_has_the_theoretical_position_error() -> None:
    """In steady state M(q) Kp e is the gravity torque of the payload, M(q) of the arm without payload; after
    the drop e decays."""
    simulated = ab.simulate("puma560_payload_drop", rtol=1e-9, atol=1e-12)
    arm, error, t = ab.load_robot("puma560"), simulated["error/y"], simulated.time
    before = int(np.flatnonzero(t == 4.0)[0]) - 1
    q = simulated["arm/q"][before]
    payload = np.array([3.0, 0.0, 0.0, 0.1, 0.01, 0.01, 0.01, 0.0, 0.0, 0.0])
    zeros = np.zeros(6)
    loaded = np.ravel(ab.dynamics.trace_rne_loaded(arm.robot)(q, zeros, zeros, zeros, payload)[0])
    expected = np.linalg.solve(arm.inertia(q), loaded - arm.gravload(q)) / 225.0
    assert np.abs(expected).max() > 0.01
    # from 2.5 s to 4 s the slowest mode of the loop, 4 / s with the payload, decays to exp(-6)
    np.testing.assert_allclose(error[before], expected, rtol=0, atol=2e-3 * np.abs(expected).max())
    # e'' + 30 e' + 225 e = 0 from the drop on, sampled at 1 ms
    since = t[t >= 4.0] - 4.0
    free = np.outer((1.0 + 15.0 * since) * np.exp(-15.0 * since), error[before])
    np.testing.assert_allclose(error[t >= 4.0], free, rtol=0, atol=0.02 * np.abs(expected).max())
    assert np.abs(error[-1]).max() < 1e-9
    drop = simulated["arm/qd"][before + 1] - simulated["arm/qd"][before]
    assert np.abs(drop).max() < 1e-4, "the speeds do not jump"


# -- pick and place


CELL = 0.08
"""Edge length of the cubes whose centres represent the surface within them, m."""


def surface_points(robot: Robot, gap: float) -> dict[int, np.ndarray]:
    """Points by row of ``link_poses`` such that every surface point is within ``gap`` of one of them."""
    rows: dict[int, list[np.ndarray]] = {}
    longest = gap - np.sqrt(3.0) / 2.0 * CELL
    for body in robot_bodies(robot):
        corners = body.mesh.corners
        while len(corners):
            sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
            short = sides.max(axis=1) <= longest
            rows.setdefault(body.row, []).append(np.round(corners[short].reshape(-1, 3) / CELL))
            # the others are halved at the middle of their longest side
            shifts = sides[~short].argmax(axis=1)
            a, b, c = (corners[~short][np.arange(len(shifts)), (shifts + k) % 3] for k in range(3))
            middle = (a + b) / 2
            corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return {row: np.unique(np.concatenate(cubes), axis=0) * CELL for row, cubes in rows.items()}


def distance_to_box(points: np.ndarray, centre: np.ndarray, size: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.maximum(np.abs(points - centre) - size / 2, 0.0), axis=-1)


def test_kr180_pick_and_place_has_no_collisions() -> None:
    """All bodies of the arm and the load stay clear of wall, pallets and floor, also between samples.

    The motion is sampled every 10 ms, at surface points with gaps of at most 15 cm. A point whose distance
    exceeds the gap plus its motion in 5 ms proves that no surface point near it collides before the next
    sample.
    """
    gap, dt = 0.15, 0.01
    simulated = ab.simulate("kr180_pick_and_place", sample_time=dt)
    cell = ab.load_robot("kr180_cell").robot
    poses, t = simulated["plot/poses"], simulated.time
    boxes = {}
    for row, link in enumerate(cell.links, start=1):
        if not link.joint.moves:
            (box,) = link.geometry
            boxes[link.name] = (poses[0, row] @ np.array(box.pose)[:, 3])[:3], np.array(box.size)
    assert set(boxes) == {"pedestal", "pick pallet", "place pallet", "wall"}
    points = surface_points(cell, gap)
    arm = {row: points[row] for row in range(1, len(cell.links) + 1) if cell.links[row - 1].joint.moves}
    assert len(arm) == 4
    half = np.array([0.25, 0.25])
    x, y, z = (np.linspace(-half[0], half[0], 9), np.linspace(-half[1], half[1], 9), np.linspace(0, 0.4, 9))
    load = np.array(np.meshgrid(x, y, z)).reshape(3, -1).T
    carried = (t >= 2.7 - 1e-9) & (t <= 10.7 + 1e-9)
    minimum = {}
    for name, row, body, when in (
        *((cell.links[row - 1].name, row, body, np.full(len(t), True)) for row, body in arm.items()),
        ("load", len(cell.links) + 1, load, carried),
    ):
        R, p = poses[when][:, row, :3, :3], poses[when][:, row, :3, 3]
        positions = np.einsum("tij,kj->tki", R, body) + p[:, None]
        moved = np.linalg.norm(np.diff(positions, axis=0), axis=-1).max()
        margin = gap + moved / 2
        for obstacle, (centre, size) in boxes.items():
            if (name, obstacle) == ("link1", "pedestal") or (name == "load" and "pallet" in obstacle):
                continue
            clear = distance_to_box(positions, centre, size).min()
            minimum[name, obstacle] = clear
            assert clear > margin, f"{name} comes within {clear:.3f} m of the {obstacle}"
        if name != "load":
            assert positions[..., 2].min() > margin, f"{name} comes near the floor"
    assert minimum["load", "wall"] < 1.0, "the wall blocks the straight path"


def test_kr180_pick_and_place_puts_the_load_on_the_pallet() -> None:
    """The lowest corner of the load is 1 cm above the pallet at grip and release, and never lower."""
    simulated = ab.simulate("kr180_pick_and_place", sample_time=0.005)
    cell, t = ab.load_robot("kr180_cell").robot, simulated.time
    tool = simulated["plot/poses"][:, -1]
    corners = np.array([[x, y, 0.4, 1.0] for x in (-0.25, 0.25) for y in (-0.25, 0.25)])
    positions = np.einsum("tij,kj->tki", tool, corners)
    carried = (t >= 2.7 - 1e-9) & (t <= 10.7 + 1e-9)
    assert positions[carried][..., 2].min() == pytest.approx(0.15, abs=1e-9)
    for instant, name in ((2.7, "pick pallet"), (10.7, "place pallet")):
        (k,) = np.flatnonzero(np.isclose(t, instant))
        (box,) = cell.link(name).geometry
        centre = np.array(box.pose)[:2, 3]
        assert (np.abs(positions[k, :, :2] - centre) < np.array(box.size[:2]) / 2).all()
        assert not simulated["path/qd"][k].any(), "the arm is at rest at grip and release"
        np.testing.assert_allclose(tool[k, :3, 2], (0, 0, -1), atol=1e-12)
        # the edges of the load are parallel to those of the pallet
        assert np.abs(tool[k, :2, :2]).max(axis=0) == pytest.approx(1.0, abs=1e-9)


def test_kr180_pick_and_place_stays_within_limits_and_includes_the_load_torque() -> None:
    simulated = ab.simulate("kr180_pick_and_place")
    robot, t = ab.load_robot("kr180").robot, simulated.time
    q, qd = simulated["path/q"], simulated["path/qd"]
    assert (q >= robot.qlim[:, 0]).all()
    assert (q <= robot.qlim[:, 1]).all()
    assert (np.abs(qd) <= robot.speed_limits).all()
    trace = ab.dynamics.trace_rne_loaded(robot)
    load = np.array([60.0, 0.0, 0.0, 0.2, 2.05, 2.05, 2.5, 0.0, 0.0, 0.0])
    for k in (100, 400, 700, 1000, 1200):
        payload = load if 2.7 <= t[k] < 10.7 else np.zeros(10)
        (tau,) = trace(q[k], qd[k], simulated["path/qdd"][k], np.zeros(6), payload)
        np.testing.assert_allclose(simulated["rne/tau"][k], np.ravel(tau), rtol=1e-9, atol=1e-9)
    # gripped at rest: the shoulder's torque jumps by 60 kg times the arm of 1.6 m
    grip = simulated["rne/tau"][270] - simulated["rne/tau"][269]
    assert grip[1] == pytest.approx(60.0 * 9.81 * 1.6, rel=1e-9)


def test_puma560_multirate_equals_a_separate_simulation_of_its_loops() -> None:
    """20 ms: position loop every 1 ms, current loop every 0.1 ms, DOP853 in between."""
    diagram = ab.load_diagram("puma560_multirate")
    arm = ab.load_robot("puma560").nofriction("coulomb")
    motors, path = diagram.blocks["motors"], diagram.blocks["path"]
    R, L, k = (np.array(motors.parameter_value(name)) for name in "RLk")
    G = arm.robot.gear_ratios
    integral = np.array(diagram.blocks["current loop"].parameter_value("initial_integral"))
    x, tau = np.zeros(18), np.zeros(6)
    x[12:] = motors.parameter_value("initial_current")
    for tick in range(200):
        t = tick * 1e-4
        q, qd, i = np.split(x, 3)
        if tick % 10 == 0:
            s, T = t / 4.0, 4.0
            displacement = np.array(path.parameter_value("qf"))
            qr = displacement * (10 * s**3 - 15 * s**4 + 6 * s**5)
            qdr = displacement * (30 * s**2 - 60 * s**3 + 30 * s**4) / T
            qddr = displacement * (60 * s - 180 * s**2 + 120 * s**3) / T**2
            tau = arm.rne(q, qd, qddr + 60.0 * (qdr - qd) + 900.0 * (qr - q))
        error = tau / (G * k) - i
        free = 3000.0 * L * error + integral
        v = np.clip(free, -40.0, 40.0)
        integral = integral + np.where((free != v) & ((free - v) * error > 0), 0.0, 1e-4 * 3000.0 * R * error)

        def flow(_: float, x: np.ndarray, v: np.ndarray = v) -> np.ndarray:
            q, qd, i = np.split(x, 3)
            return np.concatenate([qd, arm.accel(q, qd, G * k * i), (v - R * i - k * G * qd) / L])

        x = solve_ivp(flow, (t, t + 1e-4), x, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    q, qd, i = np.split(x, 3)
    result = ab.simulate(diagram, stop_time=0.02, rtol=1e-10, atol=1e-13)
    # time constant of 1 ms of the windings, 200 steps with an error of 1e-10
    np.testing.assert_allclose(result["motors/i"][-1], i, rtol=0, atol=1e-9)
    np.testing.assert_allclose(result["arm/q"][-1], q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(result["arm/qd"][-1], qd, rtol=0, atol=1e-10)


def test_puma560_multirate_follows_its_path_and_stops_at_its_end() -> None:
    """The held torque delays the loop by about 1 ms: the error stays small and decays after 4 s."""
    result = ab.simulate("puma560_multirate")
    error = np.abs(result["position error/y"])
    assert error.max() < 1e-4
    assert error[-1].max() < 1e-9
    assert result.run.ticks == 100_001
    # at rest the current balances gravity only
    arm = ab.load_robot("puma560")
    motors = ab.load_diagram("puma560_multirate").blocks["motors"]
    hold = arm.gravload(result["arm/q"][-1]) / (arm.robot.gear_ratios * np.array(motors.parameter_value("k")))
    np.testing.assert_allclose(result["motors/i"][-1], hold, rtol=0, atol=1e-7)
