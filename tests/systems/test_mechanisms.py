"""Runs of mechanisms with closed loops: published references, closed forms and conserved quantities.

The reference energies come from minimal coordinates (Lagrange's equations, DOP853 at 1e-13) and agree with
maximal coordinates and projection to 1e-11.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import armblocks as ab
from armblocks import blocks
from armblocks.diagram import Block
from armblocks.dynamics.mechanism import Mechanism
from armblocks.errors import InputError, RobotError
from armblocks.robot import Coupling, Link, Motor, Robot, Spherical
from mechanisms_for_tests import bricard, four_bar, parallelograms, slider_crank


def run(
    robot: Robot, qd: list[float], stop_time: float, sample_time: float, **settings: object
) -> ab.SimulationResult:
    """A run without torques, from the neutral configuration with the speed of the first joint."""
    locked = robot.joint_names[:1] if any(qd) else ()
    start = ab.Arm(robot).assemble(qd=qd, locked=locked)
    builder = ab.DiagramBuilder("mechanism")
    torque = builder.add("torque", blocks.Constant(value=np.zeros(robot.n)))
    builder.add("plant", blocks.ForwardDynamics(robot=robot, q0=start.q, qd0=start.qd), torque)
    return ab.simulate(builder.build(), stop_time=stop_time, sample_time=sample_time, **settings)


REFERENCES = {
    "four-bar": (
        four_bar,
        [4.0, 0.0, 0.0],
        [0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
        [0.723896609848, 0.001113828900, 0.887430338158, 3.327239524739, 5.484027739448, 7.746629520883],
    ),
    "slider-crank": (
        slider_crank,
        [5.0, 0.0, 0.0],
        [0.0, 0.6, 1.2, 1.8, 2.4, 3.0],
        [1.380755216551, 0.015054352314, 5.286601556151, 0.016598523280, 5.216347674470, 0.134278802034],
    ),
    "bricard": (
        bricard,
        [0.0] * 5,
        [0.0, 0.5, 1.0, 2.0, 3.0],
        [0.0, 3.40637266228117, 7.0982373487917, 0.952791384633765, 5.78695299378934],
    ),
}


@pytest.mark.parametrize("name", REFERENCES)
def test_kinetic_energies_equal_the_references(name: str) -> None:
    build, qd, times, energies = REFERENCES[name]
    robot = build()
    result = run(robot, qd, times[-1], 0.1, rtol=1e-9, atol=1e-11)
    rows = [int(np.argmin(np.abs(result.time - t))) for t in times]
    kinetic = ab.Arm(robot).kinetic_energy(result["plant/q"], result["plant/qd"])
    assert kinetic[rows] == pytest.approx(energies, abs=2e-8)


@pytest.mark.parametrize("build", [four_bar, bricard])
def test_loops_stay_closed_at_default_tolerances(build: Callable[[], Robot]) -> None:
    robot = build()
    result = run(robot, [3.0] + [0.0] * (robot.n - 1) if robot.n == 3 else [0.0] * 5, 100.0, 1.0)
    mechanism = Mechanism(robot)
    assert max(np.abs(mechanism.residuals(q)).max() for q in result["plant/q"]) < 1e-14
    rates = [np.abs(mechanism.jacobian(q) @ qd).max() for q, qd in zip(result["plant/q"], result["plant/qd"])]
    assert max(rates) < 1e-12


def test_parallelograms_pass_their_flat_position_without_a_change_of_branch() -> None:
    """The posts stay parallel: one pendulum, 7 rods. In the flat position the rank of the equations drops."""
    robot = parallelograms(3)
    result = run(robot, [-1.0] * 4 + [1.0] * 3, 10.0, 0.5, rtol=1e-9, atol=1e-11)
    inertia, moment = 4 / 3 + 3, 9.81 * (4 / 2 + 3)
    pendulum = solve_ivp(
        lambda t, y: [y[1], moment / inertia * np.sin(y[0])],
        (0.0, 10.0),
        [0.0, 1.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        t_eval=result.time,
    ).y[0]
    assert pendulum.max() > 4 * np.pi
    for post in result["plant/q"][:, :4].T:
        assert -post == pytest.approx(pendulum, abs=1e-6)


def test_a_start_beside_the_constraints_is_refused_with_the_gap() -> None:
    with pytest.raises(InputError, match=r"q0 violates constraint 'pin' by 119.9 mm"):
        blocks.ForwardDynamics(robot=four_bar(), q0=(0.1, 0.0, 0.0))
    with pytest.raises(InputError, match=r"qd0 violates constraint 'pin' by 1.2 per second"):
        blocks.ForwardDynamics(robot=four_bar(), qd0=(1.0, 0.0, 0.0))


def controlled(law: Block, qr: np.ndarray, q0: np.ndarray, robot: Robot) -> ab.SimulationResult:
    """A robot that starts at ``q0`` and is controlled by a law with the constant reference ``qr``."""
    builder, zero = ab.DiagramBuilder("controlled"), np.zeros(robot.n)
    plant = builder.add("plant", blocks.ForwardDynamics(robot=robot, q0=q0))
    signals = {"qr": qr, "qdr": zero, "qddr": zero}
    constants = {name: builder.add(name, blocks.Constant(value=value)) for name, value in signals.items()}
    control = builder.add("control", law)
    for port in law.input_ports():
        builder.connect(
            plant[port.name] if port.name in ("q", "qd") else constants[port.name], control[port.name]
        )
    builder.connect(control, plant["tau"])
    return ab.simulate(builder.build(), stop_time=1.0, sample_time=0.05, rtol=1e-9, atol=1e-11)


def test_controllers_of_closed_loops_control_the_joints_with_a_motor() -> None:
    """The error of the crank decays with critical damping; only its motor has a torque.

    The references of the other joints violate the loop, as those of an interpolation of all joints do.
    """
    robot = four_bar().with_link("crank", motor=Motor(inertia=1e-3, gear_ratio=10.0, viscous_friction=1e-3))
    arm = ab.Arm(robot)
    start = arm.assemble([0.2, 0.0, 0.0], locked=("crank",)).q
    reference = np.array([0.0, 0.07, -0.05])
    result = controlled(blocks.ComputedTorque(robot=robot, Kp=100.0, Kd=20.0), reference, start, robot)
    t = result.time
    assert result["plant/q"][:, 0] == pytest.approx(0.2 * (1 + 10 * t) * np.exp(-10 * t), abs=1e-7)
    assert not result["control/tau"][:, 1:].any()
    for law in (
        blocks.GravityCompensation(robot=robot, Kp=300.0, Kd=60.0),
        blocks.FeedForward(robot=robot, Kp=300.0, Kd=60.0),
    ):
        result = controlled(law, reference, start, robot)
        holding = arm.gravload(arm.assemble([0.0, 0.0, 0.0], locked=("crank",)).q)
        assert result["plant/q"][-1, 0] == pytest.approx(0.0, abs=0.01)
        assert not result["control/tau"][:, 1:].any()
        expected = holding[0] - 300.0 * result["plant/q"][-1, 0] - 60.0 * result["plant/qd"][-1, 0]
        assert result["control/tau"][-1, 0] == pytest.approx(expected, abs=0.1)


def test_controllers_of_closed_loops_name_missing_motors() -> None:
    with pytest.raises(
        RobotError, match="the joints with motors have 0 degrees of freedom, the mechanism has 1"
    ):
        blocks.ComputedTorque(robot=four_bar())
    loop = four_bar()
    rotor = Link(name="rotor", mass=0.5, inertia=((0.01, 0, 0), (0, 0.01, 0), (0, 0, 0.01)), motor=Motor())
    sum_ = Coupling(name="sum", terms=(("rotor", 1.0), ("crank", -3.0), ("rocker", 2.0)))
    summed = replace(loop, links=(*loop.links, rotor), constraints=(*loop.constraints, sum_))
    with pytest.raises(RobotError, match="the motor of joint 'rotor' drives a sum of several joints"):
        blocks.FeedForward(robot=summed)
    ball = Link(name="ball", joint=Spherical(), mass=1.0, inertia=rotor.inertia, motor=Motor())
    more = replace(loop, links=(*loop.links, ball)).with_link("crank", motor=Motor())
    with pytest.raises(InputError, match="joint 'ball' of robot 'four-bar' has a motor and a quaternion"):
        blocks.GravityCompensation(robot=more)
    passive = more.with_link("ball", motor=None)
    with pytest.raises(RobotError, match="the joints with motors have 1 degree"):
        blocks.GravityCompensation(robot=passive)


def test_computed_torque_moves_a_palletiser_with_its_linkages() -> None:
    """The errors of the four axes decay with critical damping: e = e0 (1 + 10 t) exp(-10 t)."""
    robot, q0 = ab.load_robot("irb660").robot, np.array([0.1, -0.2, 0.15, 0.3])
    builder = ab.DiagramBuilder("palletiser")
    zero = builder.add("zero", blocks.Constant(value=np.zeros(4)))
    plant = builder.add("plant", blocks.ForwardDynamics(robot=robot, q0=q0))
    law = blocks.ComputedTorque(robot=robot, Kp=100.0, Kd=20.0)
    control = builder.add("control", law, zero, zero, zero, plant["q"], plant["qd"])
    builder.connect(control, plant["tau"])
    result = ab.simulate(builder.build(), stop_time=1.0, rtol=1e-9, atol=1e-11)
    t = result.time[:, None]
    assert result["plant/q"] == pytest.approx(q0 * (1 + 10 * t) * np.exp(-10 * t), abs=1e-7)
