"""Arm Plant with closed loops and coupled joints: dry friction, stops, payloads and sticking."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from casadi import SX, Function
from scipy.integrate import solve_ivp

import armblocks as ab
from armblocks import blocks
from armblocks.dynamics.lockable_mechanism import MechanismEquations, check_lockable
from armblocks.dynamics.mechanism import Mechanism
from armblocks.errors import InputError, RobotError
from armblocks.robot import Coupling, JointLimits, Motor, Revolute, Robot, Screw
from maximal_coordinates import accelerations
from mechanisms_for_tests import four_bar, random_mechanism, slider_crank

BREAK = 12.0
"""Coulomb friction of the crank, N m: it holds the four-bar at some positions only."""


def with_motor(robot: Robot, name: str, **motor: object) -> Robot:
    return robot.with_link(name, motor=Motor(**motor))  # pyright: ignore[reportArgumentType]


def run(robot: Robot, stop_time: float, qd: float = 0.0, **settings: object) -> ab.SimulationResult:
    """A run without torques from the neutral configuration, with a speed of the first joint."""
    speeds = np.zeros(robot.n)
    speeds[0] = qd
    start = ab.Arm(robot).assemble(qd=speeds, locked=robot.joint_names[:1])
    builder = ab.DiagramBuilder("held")
    torque = builder.add("torque", blocks.Constant(value=np.zeros(robot.n)))
    builder.add("held", blocks.ArmPlant(robot=robot, q0=start.q, qd0=start.qd, **settings), torque)
    return ab.simulate(builder.build(), stop_time=stop_time, rtol=1e-9, atol=1e-11)


def test_without_dry_friction_it_is_forward_dynamics() -> None:
    robot = with_motor(slider_crank(), "crank", inertia=0.01, gear_ratio=3.0, viscous_friction=0.02)
    start = ab.Arm(robot).assemble(qd=[4.0, 0, 0], locked=["crank"])
    builder = ab.DiagramBuilder("pair")
    torque = builder.add("torque", blocks.Constant(value=(1.0, 0.0, 0.0)))
    for name, kind in (("held", blocks.ArmPlant), ("free", blocks.ForwardDynamics)):
        builder.add(name, kind(robot=robot, q0=start.q, qd0=start.qd), torque)
    result = ab.simulate(builder.build(), stop_time=1.0, rtol=1e-9, atol=1e-11)
    for port in ("q", "qd", "qdd"):
        assert result[f"held/{port}"] == pytest.approx(result[f"free/{port}"], abs=2e-6)


@pytest.mark.parametrize("seed", [20, 23, 27])
def test_locked_joints_are_held_by_the_torque_that_gives_them_no_acceleration(seed: int) -> None:
    """Random spatial mechanisms at rest, each independent joint locked: against maximal coordinates."""
    robot, q = random_mechanism(seed)
    symbols = [SX.sym(name, size) for name, size in (("q", robot.nq), *((k, robot.n) for k in "vtf"))]
    equations = MechanismEquations(robot, symbols[0], symbols[1], None, None, q)
    motion = Function("motion", symbols, equations.motion(*symbols[2:]))
    rest, tau = np.zeros(robot.n), np.random.default_rng(seed).normal(size=robot.n)
    for k in range(robot.n):
        try:
            check_lockable(robot, [k], q, "test")
        except RobotError:
            continue
        free = np.where(np.arange(robot.n) == k, 0.0, 1.0)
        qdd, held = (np.asarray(value.full())[:, 0] for value in motion(q, rest, tau, free))
        assert qdd[k] == 0.0
        expected = accelerations(robot, q, rest, tau - np.where(free == 0.0, held, 0.0))
        assert qdd == pytest.approx(expected, abs=1e-8 * max(1.0, np.abs(expected).max()))


def test_a_payload_and_a_wrench_act_on_a_mechanism() -> None:
    """As in arm.accel, which has both; the mechanism rests and starts to move."""
    robot, payload = four_bar(), (2.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0)
    wrench = (3.0, 4.0, 0.0, 0.0, 0.0, 1.5)
    builder = ab.DiagramBuilder("loaded")
    inputs = [
        builder.add(f"c{k}", blocks.Constant(value=v)) for k, v in enumerate(((0.0,) * 3, wrench, payload))
    ]
    builder.add("held", blocks.ArmPlant(robot=robot, payload_input=True, wrench_input=True), *inputs)
    result = ab.simulate(builder.build(), stop_time=0.01)
    expected = ab.Arm(robot).accel(np.zeros(3), np.zeros(3), np.zeros(3), wrench=wrench, payload=payload)
    assert result["held/qdd"][0] == pytest.approx(expected, rel=1e-9)


def test_a_four_bar_with_dry_friction_comes_to_rest_as_in_maximal_coordinates() -> None:
    """The reference integrates until the crank stops. Its holding torque determines the next motion."""
    robot = with_motor(four_bar(), "crank", coulomb_friction=BREAK)
    result = run(robot, 1.5, qd=1.5)
    frictionless = four_bar()
    mechanism = Mechanism(frictionless)
    start = ab.Arm(frictionless).assemble(qd=[1.5, 0, 0], locked=["crank"])
    t, y = 0.0, np.concatenate((start.q, start.qd))
    while t < 1.5:
        direction = np.sign(y[3])

        def rates(_: float, y: np.ndarray, direction: float = direction) -> np.ndarray:
            torque = np.array((-direction * BREAK, 0.0, 0.0))
            return np.concatenate((y[3:], accelerations(frictionless, y[:3], y[3:], torque)))

        def rest(_: float, y: np.ndarray, direction: float = direction) -> float:
            return direction * y[3]

        rest.terminal, rest.direction = True, -1.0  # type: ignore[attr-defined]
        part = solve_ivp(rates, (t, 1.5), y, rtol=1e-7, atol=1e-9, events=rest)
        t, y = part.t[-1], part.y[:, -1]
        if t >= 1.5:
            break
        y[3:] = 0.0
        # The torque that holds the crank: the motion with and without a torque is linear in it.
        free, pushed = (accelerations(frictionless, y[:3], y[3:], np.array((k, 0, 0)))[0] for k in (0, 1))
        holding = free / (pushed - free)
        if abs(holding) <= BREAK:
            break
        y[3] = np.sign(holding) * 1e-12
        y[3:] = mechanism.consistent_speeds(y[:3], y[3:], ["crank"])
    assert t < 1.5, "the reference comes to rest"
    assert result["held/q"][-1] == pytest.approx(y[:3], abs=1e-5)
    after = result.time > t + 0.01
    assert after.any() and not result["held/qd"][after][:, 0].any()
    assert result["held/friction"][-1, 0] == pytest.approx(holding, abs=1e-4)
    assert max(np.abs(mechanism.residuals(q)).max() for q in result["held/q"]) < 1e-12


def test_a_mechanism_at_rest_stays_at_rest_until_its_friction_is_overcome() -> None:
    """A crank that starts at rest: the other joints are free although their modes start at 0."""
    robot = with_motor(four_bar(), "crank", coulomb_friction=BREAK)
    weight = ab.Arm(with_motor(four_bar(), "crank")).gravload(np.zeros(3))[0]
    assert 1.0 < weight < BREAK
    builder = ab.DiagramBuilder("rest")
    ramp = builder.add("ramp", blocks.Ramp(slope=10.0))
    passive = builder.add("passive", blocks.Constant(value=(0.0, 0.0)))
    torque = builder.add("torque", blocks.Mux(inputs=2), ramp, passive)
    builder.add("held", blocks.ArmPlant(robot=robot), torque)
    result = ab.simulate(builder.build(), stop_time=3.0)
    begins = (BREAK + weight) / 10.0  # s
    assert begins < 3.0
    still = result.time < begins - 1e-3
    assert not result["held/qd"][still, 0].any() and not result["held/q"][still, 0].any()
    assert np.abs(result["held/qd"][still]).max() < 1e-14  # the others have rounding errors
    assert (result["held/qd"][result.time > begins + 1e-2, 0] > 0.0).all()
    holding = 10.0 * result.time[still] - weight
    assert result["held/friction"][still, 0] == pytest.approx(holding, abs=1e-8)


def test_a_crank_at_its_hard_stop_holds_the_mechanism() -> None:
    crank = Revolute(limits=JointLimits(position=(-1.2, 0.3)))
    robot = four_bar().with_link("crank", joint=crank)
    result = run(robot, 2.0, qd=6.0, stops="hard")
    assert 0.29 < result["held/q"][:, 0].max() <= 0.3
    assert result["held/q"][-1, 0] == -1.2 and np.abs(result["held/qd"][-1]).max() < 1e-24
    # The stop holds the weights of all links: minus the torque of gravity at the crank.
    held = ab.Arm(with_motor(robot, "crank"))
    assert result["held/stop"][-1, 0] == pytest.approx(held.gravload(result["held/q"][-1])[0], rel=1e-6)
    rates = Mechanism(robot).jacobian(result["held/q"][-1]) @ result["held/qd"][-1]
    assert np.abs(rates).max() < 1e-24


def geared(reverse: bool, **motor: object) -> Robot:
    """Two joints with the coupling lower = -2 upper; a motor at the lower or at the upper joint."""
    links = (
        ab.Link(name="upper", mass=2.0, centre_of_mass=(0.3, 0, 0), inertia=(0.1, 0.1, 0.1)),
        ab.Link(
            name="lower",
            parent="upper",
            before=ab.Transform(translation=(0.6, 0, 0)),
            mass=1.0,
            centre_of_mass=(0.2, 0, 0),
            inertia=(0.1, 0.1, 0.1),
        ),
    )
    gear = Coupling(name="gear", terms=(("lower", 1.0), ("upper", 2.0)))
    robot = Robot(name="geared", links=links, gravity=(0, -9.81, 0), constraints=(gear,))
    return with_motor(robot, "lower" if reverse else "upper", **motor)


def test_dry_friction_of_a_coupled_joint_is_that_of_its_coordinate_times_the_gear() -> None:
    own = run(geared(False, coulomb_friction=(5.0, -3.0), viscous_friction=0.8), 1.5, qd=2.0)
    other = run(geared(True, coulomb_friction=(1.5, -2.5), viscous_friction=0.2), 1.5, qd=2.0)
    assert other["held/q"] == pytest.approx(own["held/q"], abs=1e-7)
    assert other["held/friction"] == pytest.approx(own["held/friction"], abs=1e-5)
    assert np.ptp(own["held/q"]) > 0.3


def test_joints_that_cannot_be_held_together_are_refused() -> None:
    robot = with_motor(with_motor(four_bar(), "crank", coulomb_friction=1.0), "rocker", coulomb_friction=1.0)
    message = "act at the joints 'crank', 'rocker', which are not independent: the mechanism has 1 degree of"
    with pytest.raises(RobotError, match=message):
        blocks.ArmPlant(robot=robot)
    with pytest.raises(InputError, match="q0 violates constraint 'pin'"):
        blocks.ArmPlant(robot=four_bar(), q0=(0.1, 0.0, 0.0))
    loop = four_bar()
    extra = ab.Link(name="extra", joint=Screw(pitch=0.1), mass=1.0, motor=Motor(coulomb_friction=1.0))
    sum_ = Coupling(name="sum", terms=(("extra", 1.0), ("crank", 1.0), ("rocker", 1.0)))
    mixed = replace(loop, links=(*loop.links, extra), constraints=(*loop.constraints, sum_))
    with pytest.raises(RobotError, match="joint 'extra' has Coulomb friction and depends on 2 coordinates"):
        blocks.ArmPlant(robot=mixed)
