"""Arms with dry friction, end stops and payloads compared with closed forms, energy laws and SciPy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from running import run
from scipy.integrate import solve_ivp
from sticking_reference import StickingArm

import armblocks as ab
from armblocks.blocks import (
    ArmPlant,
    Clock,
    Constant,
    DotProduct,
    ForwardDynamics,
    Integrator,
    Mux,
    PulseGenerator,
    RobotEnergy,
    SineWave,
    Step,
    ZeroOrderHold,
)
from armblocks.diagram import Block, DiagramBuilder
from armblocks.errors import InputError
from armblocks.robot import FrictionModel, JointLimits, Motor, Revolute, Robot, serial_chain, standard_dh
from armblocks.simulation import SimulationResult


@pytest.fixture(params=["rk45", "rk4"])
def solver(request: pytest.FixtureRequest) -> str:
    return request.param


def wheel(**motor: float | tuple[float, float]) -> Robot:
    """A robot with one vertical axis, inertia 2 kg m2, without gravity torque; stops at -1 and 1 rad."""
    link = standard_dh("wheel", inertia=(0, 0, 2.0), mass=1.0)
    joint = Revolute(limits=JointLimits(position=(-1.0, 1.0)))
    return Robot(name="wheel", links=serial_chain([replace(link, motor=Motor(**motor), joint=joint)]))


def pair(gravity: float = 9.81) -> Robot:
    """A robot with two joints in a vertical plane; friction differs between forward and backward motion."""
    limits = JointLimits(position=(-2.0, 0.5))
    links = []
    for name, length, mass, motor in (
        ("upper", 0.5, 3.0, Motor(gear_ratio=50.0, coulomb_friction=(0.12, -0.1), viscous_friction=4e-4)),
        ("lower", 0.4, 2.0, Motor(gear_ratio=-40.0, coulomb_friction=(0.06, -0.07), inertia=1e-4)),
    ):
        link = standard_dh(
            name, a=length, mass=mass, centre_of_mass=(-length / 2, 0, 0), inertia=(0.01, 0.05, 0.05)
        )
        links.append(replace(link, motor=motor, joint=Revolute(limits=limits)))
    return Robot(name="pair", gravity=(0.0, -gravity, 0.0), links=serial_chain(links))


def simulate_arm(
    plant: ArmPlant | ForwardDynamics,
    *torques: Block,
    stop: float,
    solver: str = "rk45",
    inputs: Mapping[str, Block] | None = None,
    torque_period: float | None = None,
) -> SimulationResult:
    """Simulate the arm with joint torques, and record its energy and the work of all torques."""
    builder = DiagramBuilder("d")
    arm = builder.add("arm", plant)
    sources = [builder.add(f"torque {k}", block) for k, block in enumerate(torques)]
    tau = builder.add("tau", Mux(inputs=len(sources)), *sources)
    if torque_period is not None:
        tau = builder.add("held", ZeroOrderHold(sample_time=torque_period), tau)
    builder.connect(tau, arm["tau"])
    for name, block in (inputs or {}).items():
        builder.connect(builder.add(name, block), arm[name])
    builder.add("energy", RobotEnergy(robot=plant.robot), arm["q"], arm["qd"])
    if isinstance(plant, ArmPlant):
        for name, torque in (("input", tau), ("friction", arm["friction"]), ("stop", arm["stop"])):
            power = builder.add(f"{name} power", DotProduct(), torque, arm["qd"])
            builder.add(f"{name} work", Integrator(), power)
    return run(builder.build(), stop, solver=solver)


def energy_balance(actual: SimulationResult) -> np.ndarray:
    """Return the energy minus the work of all torques, which energy conservation keeps constant."""
    energy = actual["energy/kinetic"] + actual["energy/potential"]
    return energy - actual["input work/y"] + actual["friction work/y"] - actual["stop work/y"]


# -- one joint, closed forms


def test_a_joint_breaks_away_exactly_when_the_torque_exceeds_friction(solver: str) -> None:
    """tau = t, friction 0.6 N m, breakaway 0.9 N m: qd' = (t - 0.6) / 2 after 0.9 s."""
    plant = ArmPlant(robot=wheel(gear_ratio=3.0, coulomb_friction=(0.2, -0.1)), breakaway=1.5)
    result = simulate_arm(plant, Clock(), stop=2.0, solver=solver)
    t, qd = result.time, result["arm/qd"][:, 0]
    assert not qd[t <= 0.9].any()
    assert not result["arm/q"][t <= 0.9].any()
    since = np.maximum(t - 0.9, 0.0)
    np.testing.assert_allclose(qd, (0.3 * since + since**2 / 2) / 2, rtol=0, atol=1e-10)
    other = np.abs(t - 0.9) > 1e-9
    expected = np.where(t < 0.9, t, 0.6)
    np.testing.assert_allclose(result["arm/friction"][other, 0], expected[other], rtol=0, atol=1e-12)


def test_a_sliding_joint_comes_to_rest_and_sticks(solver: str) -> None:
    """-1.5 rad/s, decelerated by (0.3 + 0.25) N m with 2 kg m2; afterwards the speed is exactly 0."""
    robot = wheel(gear_ratio=3.0, coulomb_friction=(0.2, -0.1))
    result = simulate_arm(ArmPlant(robot=robot, qd0=-1.5), Constant(value=0.25), stop=20.0, solver=solver)
    end = 1.5 / ((0.3 + 0.25) / 2.0)
    t = np.minimum(result.time, end)
    np.testing.assert_allclose(result["arm/qd"][:, 0], -1.5 + 0.275 * t, rtol=0, atol=1e-10)
    np.testing.assert_allclose(result["arm/q"][:, 0], -1.5 * t + 0.275 * t**2 / 2, rtol=0, atol=1e-10)
    assert not result["arm/qd"][result.time > end].any()
    assert len(set(result["arm/q"][result.time > end, 0])) == 1


def test_a_joint_reverses_without_sticking_when_the_torque_exceeds_friction(solver: str) -> None:
    """From -1 rad/s with 2 N m: decelerated by 2.3 / 2 rad/s2, then accelerated by 1.4 / 2 rad/s2."""
    robot = wheel(gear_ratio=3.0, coulomb_friction=(0.2, -0.1))
    result = simulate_arm(ArmPlant(robot=robot, qd0=-1.0), Constant(value=2.0), stop=3.0, solver=solver)
    turn = 1.0 / 1.15
    before = np.minimum(result.time, turn)
    expected = -1.0 + 1.15 * before + 0.7 * (result.time - before)
    np.testing.assert_allclose(result["arm/qd"][:, 0], expected, rtol=0, atol=1e-10)


def test_a_hard_stop_ends_the_motion_without_rebound_and_releases_the_joint(solver: str) -> None:
    """1 N m accelerates 2 kg m2 to 1 rad in 2 s; a torque of -1 N m after 3 s moves the joint back."""
    result = simulate_arm(
        ArmPlant(robot=wheel(), stops="hard"),
        Step(time=3.0, initial=1.0, final=-1.0),
        stop=4.0,
        solver=solver,
    )
    t, q = result.time, result["arm/q"][:, 0]
    away = np.maximum(t - 3.0, 0.0)
    expected = np.where(t < 2.0, t**2 / 4, 1.0 - away**2 / 4)
    np.testing.assert_allclose(q, expected, rtol=0, atol=1e-9)
    resting = (t > 2.0 + 1e-9) & (t < 3.0)
    assert set(q[resting]) == {1.0}
    assert not result["arm/qd"][resting].any()
    np.testing.assert_array_equal(result["arm/stop"][resting, 0], -1.0)
    # the impact dissipates the kinetic energy: 1 N m over 1 rad
    balance = energy_balance(result)
    np.testing.assert_allclose(balance[t > 2.0 + 1e-9], balance[0] - 1.0, rtol=0, atol=1e-9)


def test_an_elastic_stop_is_a_spring_and_damper_that_never_pull(solver: str) -> None:
    """Contact with the stop at 1 rad/s: a damped half period, until spring and damper would pull."""
    k, d, J = 800.0, 16.0, 2.0
    plant = ArmPlant(robot=wheel(), stops="elastic", stiffness=k, damping=d, qd0=1.0)
    result = simulate_arm(plant, Constant(value=0.0), stop=1.5, solver=solver)
    decay, w = d / 2 / J, np.sqrt(k / J - (d / 2 / J) ** 2)
    # k x + d x' = 0 at tan(w t) = -d w / (k - d decay)
    contact = (np.pi - np.arctan2(d * w, k - d * decay)) / w
    since = np.clip(result.time - 1.0, 0.0, contact)
    oscillation = np.exp(-decay * since) * np.sin(w * since) / w
    rate = np.exp(-decay * since) * (np.cos(w * since) - decay / w * np.sin(w * since))
    free = np.maximum(result.time - 1.0 - contact, 0.0)
    expected = np.where(result.time < 1.0, result.time, 1.0 + oscillation + rate * free)
    tolerance = 1e-9 if solver == "rk45" else 2e-4  # fixed steps of 15 ms, w = 19.6 rad/s
    np.testing.assert_allclose(result["arm/q"][:, 0], expected, rtol=0, atol=tolerance)
    if solver == "rk45":
        np.testing.assert_allclose(energy_balance(result), energy_balance(result)[0], rtol=0, atol=1e-8)


# -- two coupled joints


def reference(robot: Robot, tau: object, q0: list[float], times: np.ndarray) -> np.ndarray:
    G = np.abs(robot.gear_ratios)
    motors = [motor for motor in robot.motors if motor]
    sliding = np.array([motor.coulomb_friction for motor in motors])
    viscous = G**2 * [motor.viscous_friction for motor in motors]
    arm = StickingArm(ab.Arm(robot), G * sliding[:, 0], G * sliding[:, 1], viscous, tau)  # pyright: ignore[reportArgumentType]
    return arm.run(np.array(q0), np.zeros(len(q0)), times)


def test_sticking_and_sliding_of_two_joints_agree_with_the_scipy_reference() -> None:
    robot, q0 = pair(gravity=2.0), [-1.2, 0.3]
    torques = (SineWave(amplitude=9.0, frequency=2.0), SineWave(amplitude=4.0, frequency=3.1, phase=1.0))

    def tau(t: float) -> np.ndarray:
        return np.array([9.0 * np.sin(2.0 * t), 4.0 * np.sin(3.1 * t + 1.0)])

    plant = ArmPlant(robot=robot, q0=q0)
    by_rk45, by_rk4 = (simulate_arm(plant, *torques, stop=5.0, solver=solver) for solver in ("rk45", "rk4"))
    exact = reference(robot, tau, q0, by_rk45.time)
    rests = (exact[:, 2:] == 0.0).sum(axis=0)
    assert rests.min() > 5, "each joint must stick in some samples"
    # Oscillation of two joints with rtol 1e-10; RK4 has steps of 50 ms
    for result, tolerance in ((by_rk45, 1e-7), (by_rk4, 2e-3)):
        np.testing.assert_array_equal(result.time, by_rk45.time)
        np.testing.assert_allclose(result["arm/q"], exact[:, :2], rtol=0, atol=tolerance)
        assert ((result["arm/qd"] == 0.0) == (exact[:, 2:] == 0.0)).all()
    balance = energy_balance(by_rk45)
    np.testing.assert_allclose(balance, balance[0], rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    "tau", [(9.0, 3.5), (-7.0, 5.0), (14.0, 0.0), (2.0, -2.0), (10.0, 9.0), (-12.0, -3.0)]
)
def test_joints_stick_or_slide_consistently_after_a_torque_step(tau: tuple[float, float]) -> None:
    """No gravity, at rest, with a torque from the start and from a tick, in all combinations of joints."""
    robot, q0 = pair(gravity=0.0), [0.1, -1.4]
    plant = ArmPlant(robot=robot, q0=q0)
    times = np.linspace(0.0, 0.3, 101)
    exact = reference(robot, lambda t: np.array(tau), q0, times)
    result = simulate_arm(plant, *(Constant(value=one) for one in tau), stop=0.3)
    np.testing.assert_allclose(result["arm/q"], exact[:, :2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(result["arm/qd"], exact[:, 2:], rtol=0, atol=1e-8)
    steps = [Step(time=0.15, final=one) for one in tau]
    result = simulate_arm(plant, *steps, stop=0.45, torque_period=0.15)
    for name, columns in (("arm/q", exact[:, :2]), ("arm/qd", exact[:, 2:])):
        at = [np.interp(result.time - 0.15, times, column) for column in columns.T]
        np.testing.assert_allclose(result[name], np.array(at).T, rtol=0, atol=1e-4)
    stuck = (exact[-1, 2:] == 0.0) & (exact[1, 2:] == 0.0)
    assert not result["arm/qd"][:, stuck].any()


def test_an_arm_falls_comes_to_rest_and_stays_at_rest(solver: str) -> None:
    result = simulate_arm(
        ArmPlant(robot=pair(), q0=[-0.3, 0.2]), *[Constant(value=0.0)] * 2, stop=20.0, solver=solver
    )
    assert not result["arm/qd"][-30:].any()
    assert len({tuple(q) for q in result["arm/q"][-30:]}) == 1
    np.testing.assert_array_equal(result["arm/qdd"][-30:], 0.0)
    # friction compensates the gravity load
    hold = ab.Arm(pair()).gravload(result["arm/q"][-1])
    np.testing.assert_allclose(-result["arm/friction"][-1], hold, rtol=1e-12)


def test_an_arm_without_dry_friction_agrees_with_forward_dynamics(solver: str) -> None:
    robot = pair().nofriction(viscous=False)
    torques = SineWave(amplitude=9.0, frequency=2.0), Constant(value=1.0)
    result = simulate_arm(ArmPlant(robot=robot, q0=0.1), *torques, stop=1.0, solver=solver)
    plain = simulate_arm(ForwardDynamics(robot=robot, q0=0.1), *torques, stop=1.0, solver=solver)
    np.testing.assert_allclose(result["arm/q"], plain["arm/q"], rtol=0, atol=1e-9)


def test_an_impact_at_a_hard_stop_changes_the_speed_of_the_other_joint(solver: str) -> None:
    """Only the stop has an impulse: M (qd+ - qd-) is 0 at the other joint; then both joints are free."""
    robot = pair(gravity=0.0).nofriction()
    arm, q0, qd0 = ab.Arm(robot), (0.0, -1.0), (1.0, 0.3)

    def flow(_: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[2:], arm.accel(x[:2], x[2:], np.zeros(2))])

    def at_stop(_: float, x: np.ndarray) -> float:
        return x[0] - 0.5

    at_stop.terminal = True
    first = solve_ivp(flow, (0.0, 1.0), [*q0, *qd0], "DOP853", rtol=1e-12, atol=1e-13, events=at_stop)
    q, qd = np.split(first.y[:, -1], 2)
    M = np.asarray(arm.inertia(q))
    after = np.array([0.0, qd[1] + M[1, 0] * qd[0] / M[1, 1]])
    after_impact = solve_ivp(flow, (first.t[-1], 0.7), [*q, *after], "DOP853", rtol=1e-12, atol=1e-13)
    # the centrifugal torque moves the joint away from its stop immediately
    assert after_impact.y[2, -1] < 0.0
    zero = [Constant(value=0.0)] * 2
    result = simulate_arm(ArmPlant(robot=robot, stops="hard", q0=q0, qd0=qd0), *zero, stop=0.7, solver=solver)
    assert result.run.events == 1, "the joint leaves the stop at the time of the impact"
    np.testing.assert_allclose(result["arm/q"][-1], after_impact.y[:2, -1], rtol=0, atol=1e-8)
    np.testing.assert_allclose(result["arm/qd"][-1], after_impact.y[2:, -1], rtol=0, atol=1e-8)
    dissipated = 0.5 * qd @ M @ qd - 0.5 * after @ M @ after
    balance = energy_balance(result)
    expected = balance[0] - np.where(result.time > first.t[-1], dissipated, 0.0)
    np.testing.assert_allclose(balance, expected, rtol=0, atol=1e-8)


def test_energy_of_a_falling_puma_is_balanced_by_friction_and_elastic_stops(puma560: Robot) -> None:
    """Six joints that stick, slide and reach their stops: only friction and dampers dissipate energy."""
    plant = ArmPlant(robot=puma560, q0=(0.3, 0.9, 0.4, 0.5, 0.8, 0.2), stops="elastic")
    torques = [
        SineWave(amplitude=a, frequency=f) for a, f in ((30, 2), (60, 3), (20, 1), (1, 4), (1, 5), (1, 3))
    ]
    result = simulate_arm(plant, *torques, stop=4.0)
    assert result.run.events > 20
    assert (result["arm/qd"] == 0.0).any()
    balance = energy_balance(result)
    # about 1000 J are converted, at rtol 1e-10
    np.testing.assert_allclose(balance, balance[0], rtol=0, atol=1e-5)


# -- payloads


def test_a_dropped_payload_changes_the_acceleration_but_not_the_speed() -> None:
    robot = pair().nofriction()
    payload = np.array([2.0, 0.05, 0.0, 0.1, 0.01, 0.02, 0.02, 0.0, 0.0, 0.0])
    step = Step(time=0.3, initial=payload, final=np.zeros(10))
    wrench = (1.0, 2.0, 0.0, 0.0, 0.0, 0.5)
    result = simulate_arm(
        ArmPlant(robot=robot, payload_input=True, wrench_input=True),
        Constant(value=1.0),
        Constant(value=2.0),
        stop=0.6,
        inputs={"payload": step, "wrench": Constant(value=wrench)},
    )
    traced = ab.dynamics.trace_accel_loaded(robot)
    for k in (20, 49, 50, 80):
        carried = payload if k < 50 else np.zeros(10)
        (qdd,) = traced(result["arm/q"][k], result["arm/qd"][k], (1.0, 2.0), wrench, carried)
        np.testing.assert_allclose(result["arm/qdd"][k], np.ravel(qdd), rtol=1e-11)
    jump = np.abs(np.diff(result["arm/qd"], axis=0)).max(axis=1)
    assert jump[49] < 1.2 * max(jump[48], jump[50])


# -- rejected parameters


def test_friction_that_drives_a_joint_is_refused() -> None:
    robot = pair().with_friction_model(FrictionModel.SIGNED_GEAR)
    with pytest.raises(
        InputError, match="the Coulomb friction of joint 'lower' has the direction of the motion"
    ):
        ArmPlant(robot=robot)


def test_a_start_position_beyond_a_hard_stop_is_refused() -> None:
    with pytest.raises(InputError, match=r"joint 'upper' starts at 0\.7, beyond its stop"):
        ArmPlant(robot=pair(), stops="hard", q0=(0.7, 0.0))
    ArmPlant(robot=pair(), stops="elastic", q0=(0.7, 0.0))


def test_parameters_for_another_number_of_joints_are_refused() -> None:
    with pytest.raises(InputError, match="breakaway has 3 joints"):
        ArmPlant(robot=pair(), breakaway=(1.0, 1.0, 1.0))


def test_each_torque_pulse_moves_a_joint_by_the_same_angle() -> None:
    """Pulses of 0.5 s, 0.5 N m above friction: the joint moves equally far during and after each pulse."""
    robot = wheel(gear_ratio=1.0, coulomb_friction=(0.5, -0.5))
    pulses = PulseGenerator(amplitude=1.0, period=2.0, width=25.0)
    result = simulate_arm(ArmPlant(robot=robot), pulses, stop=8.0)
    # 0.25 rad/s2 for 0.5 s, then -0.25 rad/s2 until rest: 2 * 0.25 * 0.5^2 / 2 per pulse
    angles = result["arm/q"][result.time.searchsorted([1.5, 3.5, 5.5, 7.5]), 0]
    np.testing.assert_allclose(angles, 0.0625 * np.arange(1, 5), rtol=0, atol=1e-10)
