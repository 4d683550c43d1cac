"""The shipped diagrams of robots and machines against closed forms and integrations written here."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import armblocks as ab

SCRIPT = Path(__file__).parents[2] / "scripts" / "robot_examples.py"
BUILDERS = {build.__name__: build for build in runpy.run_path(str(SCRIPT))["BUILDERS"]}


@pytest.mark.parametrize("name", BUILDERS)
def test_the_file_is_what_the_script_builds(name: str) -> None:
    assert ab.load_diagram(name) == BUILDERS[name]()


def test_puma560_multirate_is_the_sampled_loops_written_out() -> None:
    """Twenty ms by hand: position loop each 1 ms, current loop each 0.1 ms, DOP853 in between."""
    diagram = ab.load_diagram("puma560_multirate")
    arm = ab.load_robot("puma560").nofriction("coulomb")
    motors, path = diagram.blocks["motors"], diagram.blocks["path"]
    R, L, k = (np.array(motors.parameter_value(name)) for name in "RLk")
    G = arm.robot.gear_ratios
    integral, x, tau = np.zeros(6), np.zeros(18), np.zeros(6)
    for tick in range(200):
        t = tick * 1e-4
        q, qd, i = np.split(x, 3)
        if tick % 10 == 0:
            s, T = t / 4.0, 4.0
            way = np.array(path.parameter_value("qf"))
            qr = way * (10 * s**3 - 15 * s**4 + 6 * s**5)
            qdr = way * (30 * s**2 - 60 * s**3 + 30 * s**4) / T
            qddr = way * (60 * s - 180 * s**2 + 120 * s**3) / T**2
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
    # the windings' 1 ms time constant over 200 steps of 1e-10
    np.testing.assert_allclose(result["motors/i"][-1], i, rtol=0, atol=1e-9)
    np.testing.assert_allclose(result["arm/q"][-1], q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(result["arm/qd"][-1], qd, rtol=0, atol=1e-10)


def test_puma560_multirate_follows_its_path_and_rests_at_its_end() -> None:
    """The held torque delays the loop by some 1 ms: the error stays small, and dies out after 4 s."""
    result = ab.simulate("puma560_multirate")
    error = np.abs(result["position error/y"])
    assert error.max() < 1e-4
    assert error[-1].max() < 1e-9
    assert result.run.ticks == 100_001
    # at rest the current holds gravity alone
    arm = ab.load_robot("puma560")
    motors = ab.load_diagram("puma560_multirate").blocks["motors"]
    hold = arm.gravload(result["arm/q"][-1]) / (arm.robot.gear_ratios * np.array(motors.parameter_value("k")))
    np.testing.assert_allclose(result["motors/i"][-1], hold, rtol=0, atol=1e-7)
