"""Prescribed motions: against maximal coordinates, other descriptions of a motion, and closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import (
    AccelerationDrivenArm,
    ArmPlant,
    Constant,
    ForwardDynamics,
    PositionDrivenArm,
    Ramp,
    Scope,
    SineWave,
)
from armblocks.diagram import Block
from armblocks.dynamics import (
    trace_accel,
    trace_constrained_motion,
    trace_hybrid_dynamics,
    trace_hybrid_dynamics_loaded,
    trace_rne,
    trace_rne_loaded,
)
from armblocks.dynamics.ball_joints import motion_of_rates
from armblocks.dynamics.mechanism import Mechanism
from armblocks.errors import InputError, RobotError, SimulationError, UnknownNameError
from armblocks.formats import load_robot
from armblocks.robot import Coupling, Link, Motor, PrescribedMotion, Robot, Spherical, serial_chain
from armblocks.robot.joints import Fixed, Free
from armblocks.spatial import transl
from maximal_coordinates import accelerations
from mechanisms_for_tests import four_bar, random_mechanism
from robots_for_tests import RANDOM_ROBOTS, random_states


def driven(robot: Robot, *joints: str) -> Robot:
    """The robot with prescribed motions of some joints."""
    given = (PrescribedMotion(name=f"motion of {joint}", joint=joint) for joint in joints)
    return replace(robot, constraints=(*robot.constraints, *given))


def independent_joints(robot: Robot, q: np.ndarray, random: np.random.Generator) -> list[str]:
    """Some joints that move independently: a part of those that pivoting leaves."""
    mechanism = Mechanism(robot)
    R, dependent = mechanism.jacobian(q), list[int]()
    for _ in range(robot.nv - mechanism.mobility(q).degrees_of_freedom):
        k = int(np.argmax(np.linalg.norm(R, axis=0)))
        dependent.append(k)
        direction = R[:, k] / np.linalg.norm(R[:, k])
        R -= np.outer(direction, direction @ R)
    names = [name for k, name in enumerate(robot.joint_names) if k not in dependent]
    return sorted(random.choice(names, random.integers(1, len(names) + 1), replace=False).tolist())


@pytest.mark.parametrize("seed", range(3))
def test_the_torques_of_drives_cause_the_given_accelerations_in_maximal_coordinates(seed: int) -> None:
    """All joints of random loop mechanisms under the resulting torques, in another formulation."""
    plain, q = random_mechanism(seed)
    random = np.random.default_rng(seed)
    joints = independent_joints(plain, q, random)
    robot = driven(plain, *joints)
    chosen = np.isin(plain.joint_names, joints)
    qd = Mechanism(plain).consistent_speeds(q, random.normal(size=plain.n))
    tau, qdd = 3.0 * random.normal(size=(2, plain.n))
    found, torques = trace_hybrid_dynamics(robot, near=q)(q, qd, tau, qdd)
    assert found[chosen].tolist() == qdd[chosen].tolist()
    assert torques[~chosen].tolist() == tau[~chosen].tolist()
    expected = accelerations(plain, q, qd, torques)
    assert found == pytest.approx(expected, abs=1e-9 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("robot", [RANDOM_ROBOTS[0], load_robot("irb460")], ids=lambda robot: robot.name)
def test_trees_with_joints_of_all_types_couplings_and_loads(robot: Robot) -> None:
    """Forward dynamics under the torques of the drives has the same accelerations; so has rne."""
    random = np.random.default_rng(11)
    joints = random.choice(robot.joint_names, max(1, len(robot.joint_names) // 2), replace=False)
    prescribed = driven(robot, *joints.tolist())
    load = (random.normal(size=6), [1.5, 0.1, 0, 0.2, 0.1, 0.1, 0.1, 0, 0, 0])
    for q, qd, x in random_states(robot, 2):
        found, torques = trace_hybrid_dynamics(prescribed)(q, qd, x, 2.0 - x)
        assert found == pytest.approx(trace_accel(robot)(q, qd, torques)[0], rel=1e-8, abs=1e-8)
        loaded, torques = trace_hybrid_dynamics_loaded(prescribed)(q, qd, x, 2.0 - x, *load)
        expected = trace_rne_loaded(prescribed)(q, qd, loaded, *load)[0]
        assert torques == pytest.approx(expected, rel=1e-8, abs=1e-8)


def run(block: Block, motion: Block, tau: tuple[float, ...] = (), time: float = 2.0) -> ab.SimulationResult:
    """A run of an arm whose input ``motion`` is the first output of a block."""
    builder = ab.DiagramBuilder("driven")
    inputs = [builder.add("motion", motion)]
    if tau:
        inputs.append(builder.add("tau", Constant(value=tau)))
    arm = builder.add("arm", block, *inputs)
    builder.add("scope", Scope(inputs=4), *(arm[name] for name in ("q", "qd", "qdd", "drive")))
    return ab.simulate(builder.build(), stop_time=time, sample_time=0.1, rtol=1e-9, atol=1e-11)


def test_a_loop_turned_by_its_crank_stays_closed_and_needs_the_torque_of_inverse_dynamics() -> None:
    loop = four_bar()
    start = ab.Arm(loop).assemble(qd=[1.5, 0.0, 0.0], locked=("crank",))
    by_position = PositionDrivenArm(robot=loop, joints="crank", q0=start.q)
    by_acceleration = AccelerationDrivenArm(robot=driven(loop, "crank"), q0=start.q, qd0=start.qd)
    results = [
        run(by_position, Ramp(slope=(1.5,)), (0.0, 0.0), 4.5),
        run(by_acceleration, Constant(value=(0.0,)), (0.0, 0.0), 4.5),
    ]
    motions = [[result[f"arm/{name}"] for name in ("q", "qd", "qdd", "drive")] for result in results]
    for one, other in zip(*motions):
        assert one == pytest.approx(other, abs=1e-6)
    q, qd, qdd, drive = motions[0]
    assert q[:, 0] == pytest.approx(1.5 * results[0].time, abs=1e-14)
    mechanism, rne = Mechanism(loop), trace_rne(driven(loop, "crank"))
    assert max(np.abs(mechanism.residuals(row)).max() for row in q) < 1e-13
    for k in range(0, len(q), 10):
        assert rne(q[k], qd[k], qdd[k])[0] == pytest.approx([*drive[k], 0.0, 0.0], abs=1e-9)


def test_a_top_on_an_accelerated_base_moves_as_in_another_gravity() -> None:
    """Einstein's lift: a base with the acceleration a is a base at rest in the gravity g - a."""
    top = Link(
        name="top",
        parent="lift",
        joint=Spherical(),
        mass=2.0,
        centre_of_mass=(0, 0, 0.3),
        inertia=(0.1, 0.1, 0.05),
    )
    lift = Link(name="lift", joint=Free(), mass=1.0, inertia=(1, 1, 1))
    robot = Robot(name="lift with top", links=(lift, top))
    a = np.array([0.5, -0.2, 3.0])
    fixed = Robot(name="top", links=(replace(top, parent=None),), gravity=(-0.5, 0.2, -9.81 - 3.0))
    q0, qd0 = [0.9, 0.1, 0.2, 0.0], [0.0, 0.3, 20.0]
    start = {"q0": [*robot.neutral[:7], *q0], "qd0": [0.0] * 6 + qd0}
    moved = run(
        AccelerationDrivenArm(robot=robot, joints="lift", **start),
        Constant(value=[*a, 0.0, 0.0, 0.0]),
        (0.0, 0.0, 0.0),
        1.0,
    )
    builder = ab.DiagramBuilder("fixed")
    torque = builder.add("tau", Constant(value=(0.0, 0.0, 0.0)))
    builder.add("arm", ForwardDynamics(robot=fixed, q0=q0, qd0=qd0), torque)
    still = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.1, rtol=1e-9, atol=1e-11)
    assert moved["arm/q"][:, 7:] == pytest.approx(still["arm/q"], abs=1e-6)
    assert moved["arm/q"][-1, :3] == pytest.approx(0.5 * a, abs=1e-8)


def test_rates_of_a_quaternion_of_any_length_are_a_rotation() -> None:
    """Q = c(t) (cos(b t²/2), 0, 0, sin(b t²/2)): the angle is b t², w = 2 b t about z."""
    robot = Robot(name="ball", links=(Link(name="ball", joint=Spherical()),))
    b, t = 0.7, 0.9
    c, c1, c2 = 2.0 + t * t, 2.0 * t, 2.0
    cos, sin = np.cos(b * t * t / 2), np.sin(b * t * t / 2)
    p, p1, p2 = (
        np.array([cos, 0, 0, sin]),
        b * t * np.array([-sin, 0, 0, cos]),
        b * np.array([-sin, 0, 0, cos]) - (b * t) ** 2 * np.array([cos, 0, 0, sin]),
    )
    rates, second = c1 * p + c * p1, c2 * p + 2 * c1 * p1 + c * p2
    speeds, accelerations_ = motion_of_rates(robot, (c * p).tolist(), rates.tolist(), second.tolist())
    assert speeds == pytest.approx([0, 0, 2 * b * t], abs=1e-14)
    assert accelerations_ == pytest.approx([0, 0, 2 * b], abs=1e-14)


def test_an_arm_whose_joints_are_all_prescribed_needs_no_mass() -> None:
    """Without names and without constraints all joints are prescribed; massless links have no inertia."""
    links = serial_chain(
        [Link(name="a"), Link(name="b", mass=2.0, centre_of_mass=(0.5, 0, 0)), Link(name="c")]
    )
    robot = Robot(name="pair", links=links, gravity=(0, -9.81, 0))
    result = run(PositionDrivenArm(robot=robot), SineWave(amplitude=(0.3, 0.2, 0.1)))
    q, qd, qdd, drive = (result[f"arm/{name}"] for name in ("q", "qd", "qdd", "drive"))
    assert qd[:, 0] == pytest.approx(0.3 * np.cos(result.time), abs=1e-15)
    assert drive == pytest.approx(ab.Arm(robot).rne(q, qd, qdd), abs=1e-12)


def test_a_mechanism_with_as_many_drives_as_freedom_may_have_links_without_mass() -> None:
    """The coupler alone has a mass; the accelerations follow from the loop, the torque from rne."""
    loop = four_bar().with_link("rocker", mass=0.0, inertia=np.zeros((3, 3)))
    robot, q = driven(loop, "crank"), loop.neutral
    qd = Mechanism(loop).consistent_speeds(q, np.array([1.5, 0.0, 0.0]), ("crank",))
    qdd, tau = trace_hybrid_dynamics(robot)(q, qd, np.zeros(3), np.array([0.7, 0.0, 0.0]))
    assert trace_rne(robot)(q, qd, qdd)[0] == pytest.approx(tau, abs=1e-10)
    heavy, _ = trace_hybrid_dynamics(driven(four_bar(), "crank"))(
        q, qd, np.zeros(3), np.array([0.7, 0.0, 0.0])
    )
    assert qdd == pytest.approx(heavy, abs=1e-10)
    with pytest.raises(RobotError, match="joint 'rocker' has no inertia to accelerate"):
        trace_constrained_motion(loop)


@pytest.mark.parametrize(
    ("links", "constraints", "message"),
    [
        ((Link(name="a"), Link(name="b", joint=Fixed())), ("b",), "joint 'b' is fixed"),
        ((Link(name="a"),), ("a", "a"), "constraint 'drive0' already prescribes joint 'a'"),
        ((Link(name="a"), Link(name="b")), ("b",), "joint 'b' already follows from coupling 'gear'.*'a'"),
    ],
)
def test_prescribed_motions_that_contradict_the_robot_are_refused(
    links: tuple[Link, ...], constraints: tuple[str, ...], message: str
) -> None:
    gear = (Coupling(name="gear", terms=(("b", 1.0), ("a", -2.0))),) if "gear" in message else ()
    given = (PrescribedMotion(name=f"drive{k}", joint=joint) for k, joint in enumerate(constraints))
    with pytest.raises(RobotError, match=message):
        Robot(name="r", links=links, constraints=(*gear, *given))


def test_motions_that_the_mechanism_does_not_have_are_refused() -> None:
    loop = four_bar()
    with pytest.raises(
        RobotError,
        match="the prescribed joints 'crank', 'rocker' have 2 degrees of freedom, the mechanism has 1",
    ):
        PositionDrivenArm(robot=driven(loop, "crank", "rocker"))
    # A second loop in series: two degrees of freedom, but crank and rocker of one loop are one of them.
    free = Link(name="free", mass=1.0, inertia=(1, 1, 1))
    two = replace(loop, links=(*loop.links, free))
    with pytest.raises(
        RobotError, match="do not permit independent motions of the prescribed joints 'crank', 'rocker'"
    ):
        PositionDrivenArm(robot=two, joints="crank, rocker")
    with pytest.raises(UnknownNameError, match="no joint named 'crnk'"):
        PositionDrivenArm(robot=loop, joints="crnk")
    massless = Robot(name="m", links=serial_chain([Link(name="a", mass=1.0), Link(name="b")]))
    with pytest.raises(RobotError, match="joint 'b' has no inertia to accelerate"):
        AccelerationDrivenArm(robot=massless, joints="a")
    assert AccelerationDrivenArm(robot=massless, joints="a", payload_input=True)
    with pytest.raises(SimulationError, match="the input of 'arm/"):
        run(PositionDrivenArm(robot=loop, joints="rocker"), Ramp(slope=(1.0,)), (0.0, 0.0), 4.0)


def test_functions_for_given_torques_name_the_prescribed_joint() -> None:
    robot = driven(four_bar(), "crank")
    zero = np.zeros(3)
    for call in (
        lambda: ab.Arm(robot).accel(zero, zero, zero),
        lambda: ForwardDynamics(robot=robot),
        lambda: ArmPlant(robot=robot),
        lambda: ab.Arm(robot).parametric(["crank"]).accel(zero, zero, zero, np.zeros((1, 10))),
    ):
        with pytest.raises(RobotError, match="the motion of joint 'crank' is prescribed"):
            call()
    with pytest.raises(RobotError, match="no joint has a prescribed motion"):
        trace_hybrid_dynamics(four_bar())
    assert not hasattr(ab.Arm(four_bar()), "hybrid_dynamics")
    with pytest.raises(RobotError, match="the joints with motors or prescribed motions have 2 degrees"):
        trace_rne(robot.with_link("rocker", motor=Motor()))
    assert robot.with_link("rocker", mass=1.0).prescribed_joints == ("crank",)


def test_a_start_that_violates_a_loop_is_refused() -> None:
    with pytest.raises(InputError, match="q0 violates constraint 'pin'"):
        AccelerationDrivenArm(robot=four_bar(), joints="crank", q0=(0.1, 0.0, 0.0))


def test_a_file_without_prescribed_motions_warns(tmp_path: Path) -> None:
    pair = Robot(name="pair", links=serial_chain([Link(name="a"), Link(name="b", before=transl(1, 0, 0))]))
    for suffix in (".urdf", ".sdf", ".xml"):
        with pytest.warns(match="the prescribed motion of joint 'a' is not part of the"):
            ab.save_robot(driven(pair, "a"), tmp_path / f"robot{suffix}")
