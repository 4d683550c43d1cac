"""Arms with friction that sticks, end stops, payloads: closed forms, laws, and an integration with SciPy."""

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
    """One vertical axis, inertia 2 kg m2, which gravity does not turn; stops at -1 and 1 rad."""
    link = standard_dh("wheel", inertia=(0, 0, 2.0), mass=1.0)
    joint = Revolute(limits=JointLimits(position=(-1.0, 1.0)))
    return Robot(name="wheel", links=serial_chain([replace(link, motor=Motor(**motor), joint=joint)]))


def pair(gravity: float = 9.81) -> Robot:
    """Two joints in a vertical plane, whose friction differs forwards and backwards."""
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


def driven(
    plant: ArmPlant | ForwardDynamics,
    *torques: Block,
    stop: float,
    solver: str = "rk45",
    inputs: Mapping[str, Block] | None = None,
    held: float | None = None,
) -> SimulationResult:
    """The arm under torques of its joints, with its energy and the work of all that acts on it."""
    builder = DiagramBuilder("d")
    arm = builder.add("arm", plant)
    sources = [builder.add(f"torque {k}", block) for k, block in enumerate(torques)]
    tau = builder.add("tau", Mux(inputs=len(sources)), *sources)
    if held is not None:
        tau = builder.add("held", ZeroOrderHold(sample_time=held), tau)
    builder.connect(tau, arm["tau"])
    for name, block in (inputs or {}).items():
        builder.connect(builder.add(name, block), arm[name])
    builder.add("energy", RobotEnergy(robot=plant.robot), arm["q"], arm["qd"])
    if isinstance(plant, ArmPlant):
        for name, torque in (("input", tau), ("friction", arm["friction"]), ("stop", arm["stop"])):
            power = builder.add(f"{name} power", DotProduct(), torque, arm["qd"])
            builder.add(f"{name} work", Integrator(), power)
    return run(builder.build(), stop, solver=solver)


def energy_balance(found: SimulationResult) -> np.ndarray:
    """Energy so far, less the work done by torques and stops and against friction: constant by law."""
    energy = found["energy/kinetic"] + found["energy/potential"]
    return energy - found["input work/y"] + found["friction work/y"] - found["stop work/y"]


# -- one joint, in closed form


def test_a_joint_breaks_away_exactly_where_the_torque_exceeds_friction(solver: str) -> None:
    """tau = t against 0.6 at the joint, 0.9 to break away: qd' = (t - 0.6) / 2 from 0.9 s on."""
    plant = ArmPlant(robot=wheel(gear_ratio=3.0, coulomb_friction=(0.2, -0.1)), breakaway=1.5)
    found = driven(plant, Clock(), stop=2.0, solver=solver)
    t, qd = found.time, found["arm/qd"][:, 0]
    assert not qd[t <= 0.9].any()
    assert not found["arm/q"][t <= 0.9].any()
    since = np.maximum(t - 0.9, 0.0)
    np.testing.assert_allclose(qd, (0.3 * since + since**2 / 2) / 2, rtol=0, atol=1e-10)
    other = np.abs(t - 0.9) > 1e-9
    expected = np.where(t < 0.9, t, 0.6)
    np.testing.assert_allclose(found["arm/friction"][other, 0], expected[other], rtol=0, atol=1e-12)


def test_a_joint_slides_to_a_stop_and_stays_there(solver: str) -> None:
    """-3 rad/s against 0.3 N m of 2 kg m2 … in 20 s, and exactly 0 from then on."""
    robot = wheel(gear_ratio=3.0, coulomb_friction=(0.2, -0.1))
    found = driven(ArmPlant(robot=robot, qd0=-1.5), Constant(value=0.25), stop=20.0, solver=solver)
    end = 1.5 / ((0.3 + 0.25) / 2.0)
    t = np.minimum(found.time, end)
    np.testing.assert_allclose(found["arm/qd"][:, 0], -1.5 + 0.275 * t, rtol=0, atol=1e-10)
    np.testing.assert_allclose(found["arm/q"][:, 0], -1.5 * t + 0.275 * t**2 / 2, rtol=0, atol=1e-10)
    assert not found["arm/qd"][found.time > end].any()
    assert len(set(found["arm/q"][found.time > end, 0])) == 1


def test_a_joint_turns_round_at_once_where_the_torque_is_strong(solver: str) -> None:
    """From -1 rad/s under 2 N m: slowed by 2.3 / 2, then driven by 1.4 / 2."""
    robot = wheel(gear_ratio=3.0, coulomb_friction=(0.2, -0.1))
    found = driven(ArmPlant(robot=robot, qd0=-1.0), Constant(value=2.0), stop=3.0, solver=solver)
    turn = 1.0 / 1.15
    before = np.minimum(found.time, turn)
    expected = -1.0 + 1.15 * before + 0.7 * (found.time - before)
    np.testing.assert_allclose(found["arm/qd"][:, 0], expected, rtol=0, atol=1e-10)


def test_a_hard_stop_ends_the_motion_without_rebound_and_lets_go(solver: str) -> None:
    """1 N m turns 2 kg m2 from 0: at 1 rad after 2 s; a torque of -1 from 3 s on leads back."""
    found = driven(
        ArmPlant(robot=wheel(), stops="hard"),
        Step(time=3.0, initial=1.0, final=-1.0),
        stop=4.0,
        solver=solver,
    )
    t, q = found.time, found["arm/q"][:, 0]
    away = np.maximum(t - 3.0, 0.0)
    expected = np.where(t < 2.0, t**2 / 4, 1.0 - away**2 / 4)
    np.testing.assert_allclose(q, expected, rtol=0, atol=1e-9)
    resting = (t > 2.0 + 1e-9) & (t < 3.0)
    assert set(q[resting]) == {1.0}
    assert not found["arm/qd"][resting].any()
    np.testing.assert_array_equal(found["arm/stop"][resting, 0], -1.0)
    # the impact took the kinetic energy: 1 N m over 1 rad
    balance = energy_balance(found)
    np.testing.assert_allclose(balance[t > 2.0 + 1e-9], balance[0] - 1.0, rtol=0, atol=1e-9)


def test_an_elastic_stop_is_a_spring_with_a_damper_that_never_pulls(solver: str) -> None:
    """Into the stop at 1 rad/s: a damped half swing, until spring and damper would pull."""
    k, d, J = 800.0, 16.0, 2.0
    plant = ArmPlant(robot=wheel(), stops="elastic", stiffness=k, damping=d, qd0=1.0)
    found = driven(plant, Constant(value=0.0), stop=1.5, solver=solver)
    decay, w = d / 2 / J, np.sqrt(k / J - (d / 2 / J) ** 2)
    # k x + d x' = 0 where tan(w t) = -d w / (k - d decay)
    contact = (np.pi - np.arctan2(d * w, k - d * decay)) / w
    since = np.clip(found.time - 1.0, 0.0, contact)
    over = np.exp(-decay * since) * np.sin(w * since) / w
    rate = np.exp(-decay * since) * (np.cos(w * since) - decay / w * np.sin(w * since))
    free = np.maximum(found.time - 1.0 - contact, 0.0)
    expected = np.where(found.time < 1.0, found.time, 1.0 + over + rate * free)
    tolerance = 1e-9 if solver == "rk45" else 2e-4  # fixed steps of 15 ms, w = 19.6 rad/s
    np.testing.assert_allclose(found["arm/q"][:, 0], expected, rtol=0, atol=tolerance)
    if solver == "rk45":
        np.testing.assert_allclose(energy_balance(found), energy_balance(found)[0], rtol=0, atol=1e-8)


# -- two joints that feel one another


def reference(robot: Robot, tau: object, q0: list[float], times: np.ndarray) -> np.ndarray:
    G = np.abs(robot.gear_ratios)
    motors = [motor for motor in robot.motors if motor]
    sliding = np.array([motor.coulomb_friction for motor in motors])
    viscous = G**2 * [motor.viscous_friction for motor in motors]
    arm = StickingArm(ab.Arm(robot), G * sliding[:, 0], G * sliding[:, 1], viscous, tau)  # pyright: ignore[reportArgumentType]
    return arm.run(np.array(q0), np.zeros(len(q0)), times)


def test_two_joints_stick_and_slip_as_scipy_finds_event_by_event() -> None:
    robot, q0 = pair(gravity=2.0), [-1.2, 0.3]
    torques = (SineWave(amplitude=9.0, frequency=2.0), SineWave(amplitude=4.0, frequency=3.1, phase=1.0))

    def tau(t: float) -> np.ndarray:
        return np.array([9.0 * np.sin(2.0 * t), 4.0 * np.sin(3.1 * t + 1.0)])

    plant = ArmPlant(robot=robot, q0=q0)
    by_rk45, by_rk4 = (driven(plant, *torques, stop=5.0, solver=solver) for solver in ("rk45", "rk4"))
    exact = reference(robot, tau, q0, by_rk45.time)
    rests = (exact[:, 2:] == 0.0).sum(axis=0)
    assert rests.min() > 5, "both joints have to stick for a while"
    # Two joints that swing at 1e-10; RK4 has steps of 50 ms
    for found, tolerance in ((by_rk45, 1e-7), (by_rk4, 2e-3)):
        np.testing.assert_array_equal(found.time, by_rk45.time)
        np.testing.assert_allclose(found["arm/q"], exact[:, :2], rtol=0, atol=tolerance)
        assert ((found["arm/qd"] == 0.0) == (exact[:, 2:] == 0.0)).all()
    balance = energy_balance(by_rk45)
    np.testing.assert_allclose(balance, balance[0], rtol=0, atol=1e-7)


@pytest.mark.parametrize(
    "tau", [(9.0, 3.5), (-7.0, 5.0), (14.0, 0.0), (2.0, -2.0), (10.0, 9.0), (-12.0, -3.0)]
)
def test_who_sticks_follows_a_sudden_torque(tau: tuple[float, float]) -> None:
    """Weightless, at rest, under a torque from the start and from a tick: each combination of joints."""
    robot, q0 = pair(gravity=0.0), [0.1, -1.4]
    plant = ArmPlant(robot=robot, q0=q0)
    times = np.linspace(0.0, 0.3, 101)
    exact = reference(robot, lambda t: np.array(tau), q0, times)
    found = driven(plant, *(Constant(value=one) for one in tau), stop=0.3)
    np.testing.assert_allclose(found["arm/q"], exact[:, :2], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found["arm/qd"], exact[:, 2:], rtol=0, atol=1e-8)
    late = [Step(time=0.15, final=one) for one in tau]
    found = driven(plant, *late, stop=0.45, held=0.15)
    for name, columns in (("arm/q", exact[:, :2]), ("arm/qd", exact[:, 2:])):
        at = [np.interp(found.time - 0.15, times, column) for column in columns.T]
        np.testing.assert_allclose(found[name], np.array(at).T, rtol=0, atol=1e-4)
    stuck = (exact[-1, 2:] == 0.0) & (exact[1, 2:] == 0.0)
    assert not found["arm/qd"][:, stuck].any()


def test_an_arm_falls_to_rest_and_rests_for_ever(solver: str) -> None:
    found = driven(
        ArmPlant(robot=pair(), q0=[-0.3, 0.2]), *[Constant(value=0.0)] * 2, stop=20.0, solver=solver
    )
    assert not found["arm/qd"][-30:].any()
    assert len({tuple(q) for q in found["arm/q"][-30:]}) == 1
    np.testing.assert_array_equal(found["arm/qdd"][-30:], 0.0)
    # friction holds what gravity asks for
    hold = ab.Arm(pair()).gravload(found["arm/q"][-1])
    np.testing.assert_allclose(-found["arm/friction"][-1], hold, rtol=1e-12)


def test_without_dry_friction_it_is_the_plain_robot(solver: str) -> None:
    robot = pair().nofriction(viscous=False)
    torques = SineWave(amplitude=9.0, frequency=2.0), Constant(value=1.0)
    found = driven(ArmPlant(robot=robot, q0=0.1), *torques, stop=1.0, solver=solver)
    plain = driven(ForwardDynamics(robot=robot, q0=0.1), *torques, stop=1.0, solver=solver)
    np.testing.assert_allclose(found["arm/q"], plain["arm/q"], rtol=0, atol=1e-9)


def test_an_impact_at_a_hard_stop_is_felt_by_the_other_joint(solver: str) -> None:
    """Only the stop's impulse acts, so M (qd+ - qd-) is 0 at the other joint; then both are free again."""
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
    then = solve_ivp(flow, (first.t[-1], 0.7), [*q, *after], "DOP853", rtol=1e-12, atol=1e-13)
    # the centrifugal torque leads the joint away from its stop at once
    assert then.y[2, -1] < 0.0
    zero = [Constant(value=0.0)] * 2
    found = driven(ArmPlant(robot=robot, stops="hard", q0=q0, qd0=qd0), *zero, stop=0.7, solver=solver)
    assert found.run.events == 1, "it leaves the stop in the instant of the impact"
    np.testing.assert_allclose(found["arm/q"][-1], then.y[:2, -1], rtol=0, atol=1e-8)
    np.testing.assert_allclose(found["arm/qd"][-1], then.y[2:, -1], rtol=0, atol=1e-8)
    lost = 0.5 * qd @ M @ qd - 0.5 * after @ M @ after
    balance = energy_balance(found)
    expected = balance[0] - np.where(found.time > first.t[-1], lost, 0.0)
    np.testing.assert_allclose(balance, expected, rtol=0, atol=1e-8)


def test_energy_of_a_falling_puma_goes_into_friction_and_elastic_stops(puma560: Robot) -> None:
    """Six joints that stick, slip and meet their stops: only friction and dampers take energy."""
    plant = ArmPlant(robot=puma560, q0=(0.3, 0.9, 0.4, 0.5, 0.8, 0.2), stops="elastic")
    torques = [
        SineWave(amplitude=a, frequency=f) for a, f in ((30, 2), (60, 3), (20, 1), (1, 4), (1, 5), (1, 3))
    ]
    found = driven(plant, *torques, stop=4.0)
    assert found.run.events > 20
    assert (found["arm/qd"] == 0.0).any()
    balance = energy_balance(found)
    # some 1000 J go through, at rtol 1e-10
    np.testing.assert_allclose(balance, balance[0], rtol=0, atol=1e-5)


# -- loads


def test_a_payload_that_is_dropped_changes_the_acceleration_and_no_speed() -> None:
    robot = pair().nofriction()
    payload = np.array([2.0, 0.05, 0.0, 0.1, 0.01, 0.02, 0.02, 0.0, 0.0, 0.0])
    step = Step(time=0.3, initial=payload, final=np.zeros(10))
    wrench = (1.0, 2.0, 0.0, 0.0, 0.0, 0.5)
    found = driven(
        ArmPlant(robot=robot, payload_input=True, wrench_input=True),
        Constant(value=1.0),
        Constant(value=2.0),
        stop=0.6,
        inputs={"payload": step, "wrench": Constant(value=wrench)},
    )
    traced = ab.dynamics.trace_accel_loaded(robot)
    for k in (20, 49, 50, 80):
        carried = payload if k < 50 else np.zeros(10)
        (qdd,) = traced(found["arm/q"][k], found["arm/qd"][k], (1.0, 2.0), wrench, carried)
        np.testing.assert_allclose(found["arm/qdd"][k], np.ravel(qdd), rtol=1e-11)
    jump = np.abs(np.diff(found["arm/qd"], axis=0)).max(axis=1)
    assert jump[49] < 1.2 * max(jump[48], jump[50])


# -- refusals


def test_friction_that_drives_is_refused() -> None:
    robot = pair().with_friction_model(FrictionModel.SIGNED_GEAR)
    with pytest.raises(InputError, match="the Coulomb friction of joint 'lower' drives it"):
        ArmPlant(robot=robot)


def test_a_start_behind_a_hard_stop_is_refused() -> None:
    with pytest.raises(InputError, match=r"joint 'upper' starts at 0\.7, beyond its stop"):
        ArmPlant(robot=pair(), stops="hard", q0=(0.7, 0.0))
    ArmPlant(robot=pair(), stops="elastic", q0=(0.7, 0.0))


def test_a_count_that_is_not_the_robots_is_refused() -> None:
    with pytest.raises(InputError, match="breakaway has 3 joints"):
        ArmPlant(robot=pair(), breakaway=(1.0, 1.0, 1.0))


def test_pulses_of_torque_move_a_joint_in_jerks() -> None:
    """0.5 N m beyond friction for half of each second: each pulse gives and takes the same distance."""
    robot = wheel(gear_ratio=1.0, coulomb_friction=(0.5, -0.5))
    pulses = PulseGenerator(amplitude=1.0, period=2.0, width=25.0)
    found = driven(ArmPlant(robot=robot), pulses, stop=8.0)
    # 0.25 rad/s2 for 0.5 s, then -0.25 until rest: 2 * 0.25 * 0.5^2 / 2 a pulse
    moved = found["arm/q"][found.time.searchsorted([1.5, 3.5, 5.5, 7.5]), 0]
    np.testing.assert_allclose(moved, 0.0625 * np.arange(1, 5), rtol=0, atol=1e-10)
