"""Joint sensors, PID controllers and integrated poses compared with closed forms, statistics and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from running import run
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import armblocks as ab
from armblocks.blocks import (
    Bias,
    Constant,
    Encoder,
    Fkine,
    Integrator,
    Jacob0,
    Jacobe,
    JointPID,
    JointSensor,
    JTraj,
    MatrixProduct,
    PoseIntegration,
    Ramp,
    SampledJointPID,
    SineWave,
    Step,
    Tachometer,
)
from armblocks.diagram import Block, DiagramBuilder
from armblocks.equations import SimulationOptions
from armblocks.errors import InputError
from armblocks.robot import Robot
from armblocks.simulation import SimulationResult, simulate
from compiled_diagrams import compiled


@pytest.fixture(params=["rk45", "rk4"])
def solver(request: pytest.FixtureRequest) -> str:
    return request.param


def sensor_result(seed: float = 0.0) -> SimulationResult:
    """Simulate a joint sensor of a robot at rest for ten thousand ticks."""
    builder = DiagramBuilder("d")
    sensor = JointSensor(
        robot=ab.load_robot("planar3r").robot, q_deviation=(0.01, 0.02, 0.0), qd_deviation=0.1, seed=seed
    )
    q, qd = builder.add("q", Constant(value=(0.5,) * 3)), builder.add("qd", Constant(value=(0.0,) * 3))
    builder.add("sensor", sensor, q, qd)
    options = SimulationOptions(stop_time=10.0, sample_time=1e-3)
    return simulate(compiled(builder.build()), options)


# -- sensors


def test_sensor_noise_has_the_given_deviations_and_is_uncorrelated() -> None:
    result = sensor_result()
    noise = np.hstack([result["sensor/q_measured"] - 0.5, result["sensor/qd_measured"]])
    assert not noise[:, 2].any(), "a deviation of 0 gives no noise"
    expected = np.array([0.01, 0.02, 0.1, 0.1, 0.1])
    noise = np.delete(noise, 2, axis=1) / expected
    # 10 001 samples; standard errors: mean 1e-2, deviation 7e-3, correlation 1e-2; bounds of 4 sigma
    assert np.abs(noise.mean(axis=0)).max() < 0.04
    assert np.abs(noise.std(axis=0) - 1.0).max() < 0.03
    correlation = np.corrcoef(noise.T) - np.eye(5)
    assert np.abs(correlation).max() < 0.04
    assert np.abs((noise[1:] * noise[:-1]).mean(axis=0)).max() < 0.04


def test_equal_seeds_give_equal_noise_and_other_seeds_other_noise() -> None:
    one, repeated, other = sensor_result(seed=7.0), sensor_result(seed=7.0), sensor_result(seed=8.0)
    np.testing.assert_array_equal(one["sensor/qd_measured"], repeated["sensor/qd_measured"])
    assert (one["sensor/qd_measured"] != other["sensor/qd_measured"]).mean() > 0.99


def test_an_encoder_quantises_the_angle_and_differentiates_its_counts(solver: str) -> None:
    counts, G, T = np.array([100.0, 256.0]), np.array([1.0, -50.0]), 0.01
    builder = DiagramBuilder("d")
    u = builder.add("u", SineWave(amplitude=(2.0, 0.3), frequency=1.3, phase=0.4))
    builder.add("encoder", Encoder(counts=counts, gear_ratio=G, sample_time=T), u)
    result = run(builder.build(), 1.0, solver=solver)
    t = result.time
    angle = np.outer(np.sin(1.3 * t + 0.4), (2.0, 0.3))
    expected = np.floor(G * counts * angle / (2 * np.pi))
    np.testing.assert_array_equal(result["encoder/count"], expected)
    step = 2 * np.pi / (G * counts)
    np.testing.assert_allclose(result["encoder/y"], expected * step, rtol=1e-14)
    assert not result["encoder/speed"][0].any(), "the speed is 0 at the first tick"
    np.testing.assert_allclose(result["encoder/speed"][1:], np.diff(expected, axis=0) * step / T, atol=1e-9)
    # the error of the angle is below one count
    assert (np.abs(result["encoder/y"] - angle) < np.abs(step)).all()
    true = np.outer(1.3 * np.cos(1.3 * t + 0.4), (2.0, 0.3))
    assert (np.abs(result["encoder/speed"] - true)[1:] < np.abs(step) / T + 0.02).all()


def test_a_tachometer_has_a_first_order_lag(solver: str) -> None:
    builder = DiagramBuilder("d")
    builder.add("tachometer", Tachometer(gain=0.5, time_constant=0.2), builder.add("w", Ramp(slope=3.0)))
    result = run(builder.build(), 2.0, solver=solver)
    t = result.time
    exact = 1.5 * (t - 0.2 * (1.0 - np.exp(-t / 0.2)))
    np.testing.assert_allclose(result["tachometer/y"], exact, rtol=0, atol=1e-7)


# -- controllers


def loop(controller: Block, stop: float, solver: str, goal: Block, load: float = 0.0) -> SimulationResult:
    """A loop of two inertias of 1 kg m2 with a controller and a load torque."""
    builder = DiagramBuilder("d")
    pid = builder.add("pid", controller)
    builder.connect(builder.add("goal", goal), pid["qr"])
    builder.connect(builder.add("still", Constant(value=(0.0, 0.0))), pid["qdr"])
    speed = builder.add("speed", Integrator(initial=(0.0, 0.0)), builder.add("load", Bias(bias=-load), pid))
    angle = builder.add("angle", Integrator(initial=(0.0, 0.0)), speed)
    builder.connect(angle, pid["q"])
    builder.connect(speed, pid["qd"])
    return run(builder.build(), stop, solver=solver)


def test_a_pid_without_limits_agrees_with_the_linear_loop(solver: str) -> None:
    """q'' = Kp (1 - q) - Kd q' + i - load, i' = Ki (1 - q): the integral compensates the load."""
    Kp, Ki, Kd = (30.0, 20.0), (40.0, 20.0), (11.0, 9.0)
    result = loop(JointPID(Kp=Kp, Ki=Ki, Kd=Kd), 8.0, solver, Constant(value=(1.0, 1.0)), load=3.0)
    for k in range(2):
        A = np.array([[0, 1, 0, 0], [-Kp[k], -Kd[k], 1, Kp[k] - 3.0], [-Ki[k], 0, 0, Ki[k]], [0, 0, 0, 0]])
        exact = np.array([(expm(A * t) @ (0.0, 0.0, 0.0, 1.0))[0] for t in result.time])
        tolerance = 1e-7 if solver == "rk45" else 5e-4  # steps of 80 ms
        np.testing.assert_allclose(result["angle/y"][:, k], exact, rtol=0, atol=tolerance)
    np.testing.assert_allclose(result["angle/y"][-1], 1.0, atol=1e-3)


def test_back_calculation_prevents_windup_of_a_limited_pid(solver: str) -> None:
    """Comparison with SciPy with short steps; for Kb = 0 the overshoot is much larger."""
    gains = {"Kp": 10.0, "Ki": 8.0, "Kd": 5.0, "lower": (-0.5, -0.4), "upper": 0.5}
    goal = Constant(value=(2.0, -2.0))
    result = loop(JointPID(Kb=5.0, **gains), 10.0, solver, goal)
    without_back_calculation = loop(JointPID(Kb=0.0, **gains), 10.0, solver, goal)
    for k, (target, low, high) in enumerate(((2.0, -0.5, 0.5), (-2.0, -0.4, 0.5))):

        def flow(_: float, x: np.ndarray, target: float, low: float, high: float) -> list[float]:
            free = 10.0 * (target - x[0]) - 5.0 * x[1] + x[2]
            tau = min(max(free, low), high)
            return [x[1], tau, 8.0 * (target - x[0]) + 5.0 * (tau - free)]

        options = {"rtol": 1e-10, "atol": 1e-12, "max_step": 0.01, "args": (target, low, high)}
        exact = solve_ivp(flow, (0, 10), [0, 0, 0], "DOP853", result.time, **options)
        tolerance = 1e-7 if solver == "rk45" else 1e-4  # steps of 100 ms
        np.testing.assert_allclose(result["angle/y"][:, k], exact.y[0], rtol=0, atol=tolerance)
        overshoots = [
            np.max(one["angle/y"][:, k] * np.sign(target)) - 2.0 for one in (result, without_back_calculation)
        ]
        assert overshoots[0] < 0.5 * overshoots[1]
    assert result["pid/tau"].max() <= 0.5


def test_a_sampled_pid_agrees_with_its_recurrence(solver: str) -> None:
    """Between ticks the position of an inertia is a parabola, which gives an exact recurrence."""
    T, lower, upper = 0.05, np.array([-3.0, -0.5]), np.array([3.0, 0.5])
    controller = SampledJointPID(
        Kp=(10.0, 6.0), Ki=(4.0, 3.0), Kd=(5.0, 4.0), lower=lower, upper=upper, sample_time=T
    )
    result = loop(controller, 5.0, solver, Step(time=0.2, final=(1.0, -1.5)), load=0.2)
    q, qd, integral, angles = np.zeros(2), np.zeros(2), np.zeros(2), []
    for k in range(101):
        angles.append(q)
        e = np.array([1.0, -1.5]) * (k >= 4) - q
        free = np.array([10.0, 6.0]) * e - np.array([5.0, 4.0]) * qd + integral
        tau = np.clip(free, lower, upper)
        winds_up = (free != tau) & ((free - tau) * e > 0)
        integral = integral + np.where(winds_up, 0.0, T * np.array([4.0, 3.0]) * e)
        a = tau - 0.2
        q, qd = q + T * qd + T * T * a / 2, qd + T * a
    np.testing.assert_allclose(result["angle/y"], angles, rtol=0, atol=1e-11)


def test_reversed_limits_of_a_pid_are_refused() -> None:
    for kind in (JointPID, SampledJointPID):
        with pytest.raises(InputError, match=r"lower is 1\.0 and upper is -1\.0"):
            kind(lower=1.0, upper=-1.0)


# -- poses


def test_a_constant_twist_moves_a_frame_on_a_screw_motion(solver: str) -> None:
    """In body axes T = T0 exp([V] t); in world axes the origin moves straight and R = exp([w] t) R0."""
    V = np.array([1.0, -0.5, 0.2, 0.3, 0.8, -0.6])
    p0, Q0 = (0.1, 0.2, 0.3), (2.0, 0.6, -0.4, 1.0)
    builder = DiagramBuilder("d")
    source = builder.add("V", Constant(value=V))
    for axes in ("body", "world"):
        builder.add(axes, PoseIntegration(axes=axes, position=p0, quaternion=Q0), source)
    result = run(builder.build(), 10.0, solver=solver)
    T0 = result["body/T"][0]
    np.testing.assert_allclose(T0[:3, 3], p0)
    wx = np.array([[0, -V[5], V[4]], [V[5], 0, -V[3]], [-V[4], V[3], 0]])
    screw = np.zeros((4, 4))
    screw[:3, :3], screw[:3, 3] = wx, V[:3]
    tolerance = 1e-8 if solver == "rk45" else 1e-5  # steps of 0.1 s at 1 rad/s
    for k in (30, 100):
        t = result.time[k]
        np.testing.assert_allclose(result["body/T"][k], T0 @ expm(screw * t), rtol=0, atol=tolerance)
        np.testing.assert_allclose(result["world/T"][k][:3, :3], expm(wx * t) @ T0[:3, :3], atol=tolerance)
        np.testing.assert_allclose(result["world/T"][k][:3, 3], p0 + V[:3] * t, atol=tolerance)


def test_an_integrated_pose_remains_a_rotation_for_any_step() -> None:
    builder = DiagramBuilder("d")
    source = builder.add("V", SineWave(amplitude=(1.0, 1.0, 1.0, 3.0, 2.0, 4.0), phase=(0, 1, 2, 3, 4, 5)))
    builder.add("pose", PoseIntegration(), source)
    options = SimulationOptions(stop_time=200.0, sample_time=1.0, solver="euler", step=0.1)
    R = simulate(compiled(builder.build()), options)["pose/T"][:, :3, :3]
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.tile(np.eye(3), (201, 1, 1)), atol=1e-14)


def test_the_integrated_velocity_of_a_tool_is_its_pose(puma560: Robot, solver: str) -> None:
    builder = DiagramBuilder("d")
    path = builder.add("path", JTraj(q0=(0.1, 0.5, -0.3, 0.2, 0.7, 0.0), qf=(1.5, -0.4, 0.6, -1.0, 0.3, 2.0)))
    builder.add("fkine", Fkine(robot=puma560), path["q"])
    for axes, kind in (("world", Jacob0), ("body", Jacobe)):
        J = builder.add(f"J {axes}", kind(robot=puma560), path["q"])
        V = builder.add(f"V {axes}", MatrixProduct(), J, path["qd"])
        T0 = np.asarray(ab.Arm(puma560).fkine((0.1, 0.5, -0.3, 0.2, 0.7, 0.0)))
        builder.add(
            axes,
            PoseIntegration(axes=axes, position=T0[:3, 3], quaternion=quaternion(T0[:3, :3])),
            V,
        )
    result = run(builder.build(), 10.0, solver=solver)
    for axes in ("world", "body"):
        np.testing.assert_allclose(result[f"{axes}/T"], result["fkine/T"], rtol=0, atol=1e-6)


def quaternion(R: np.ndarray) -> np.ndarray:
    """Return the quaternion of R from the eigenvector of its axis and its trace."""
    values, vectors = np.linalg.eig(R)
    axis = np.real(vectors[:, int(np.argmin(np.abs(values - 1.0)))])
    s = np.sqrt(1.0 + np.trace(R)) / 2.0
    twist = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return np.array([s, *(np.sqrt(1.0 - s * s) * axis * np.sign(axis @ twist))])


def test_an_invalid_start_quaternion_is_refused() -> None:
    with pytest.raises(InputError, match="the quaternion has 3 numbers"):
        PoseIntegration(quaternion=(1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="the quaternion is zero"):
        PoseIntegration(quaternion=(0.0, 0.0, 0.0, 0.0))
