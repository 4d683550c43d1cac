"""Constraints and closed loops: against a formulation in maximal coordinates, references and closed forms."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import armblocks as ab
from armblocks.dynamics import mechanism as mechanism_module
from armblocks.dynamics import (
    trace_accel,
    trace_constrained_motion,
    trace_fkine,
    trace_inertia,
    trace_jacob0,
    trace_rne,
)
from armblocks.dynamics.mechanism import Mechanism
from armblocks.errors import ArmblocksError, AssemblyError, InputError, RobotError, UnknownNameError
from armblocks.robot import Link, Motor, Prismatic, Revolute, Robot, Spherical
from armblocks.robot.constraints import (
    Attachment,
    Coupling,
    RevoluteClosure,
    Rod,
    WeldClosure,
)
from armblocks.spatial import Transform, rotation_about, transl
from maximal_coordinates import accelerations
from mechanisms_for_tests import (
    CLOSURES,
    bricard,
    four_bar,
    parallelograms,
    random_mechanism,
    slider_crank,
)

SEEDS = range(2 * len(CLOSURES))


@pytest.mark.parametrize("seed", SEEDS)
def test_accelerations_equal_those_in_maximal_coordinates(seed: int) -> None:
    robot, q = random_mechanism(seed)
    random = np.random.default_rng(seed)
    mechanism = Mechanism(robot)
    assert np.abs(mechanism.residuals(q)).max() < 1e-12
    qd = mechanism.consistent_speeds(q, random.normal(size=robot.n))
    tau = 3 * random.normal(size=robot.n)
    consistent_q, consistent_qd, qdd, *_ = trace_constrained_motion(robot, near=q)(q, qd, tau)
    expected = accelerations(robot, q, qd, tau)
    assert consistent_q == pytest.approx(q, abs=1e-12)
    assert consistent_qd == pytest.approx(qd, abs=1e-11)
    assert qdd == pytest.approx(expected, abs=1e-10 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("seed", SEEDS[:6])
def test_motor_torques_cause_their_motion(seed: int) -> None:
    """Joints that determine the others get motors; the torques of rne cause the given accelerations."""
    robot, q = random_mechanism(seed)
    mechanism = Mechanism(robot)
    driven = driven_joints(mechanism, q)
    for name in driven:
        motor = Motor(inertia=1e-3, gear_ratio=10.0, viscous_friction=1e-3)
        robot = robot.with_link(name, motor=motor)
    mechanism = Mechanism(robot)
    random = np.random.default_rng(seed)
    qd = mechanism.consistent_speeds(q, random.normal(size=robot.n))
    tau = np.where(np.isin(robot.joint_names, driven), 3 * random.normal(size=robot.n), 0.0)
    qdd = trace_constrained_motion(robot, near=q)(q, qd, tau)[2]
    assert trace_rne(robot)(q, qd, qdd)[0] == pytest.approx(tau, abs=1e-8)


@pytest.mark.parametrize("several", [False, True])
def test_motors_of_coupled_joints_drive_a_mechanism(several: bool) -> None:
    """The motor is at a joint without coordinate: geared to the crank, or turned by crank and rocker."""
    loop = four_bar()
    rotor = Link(name="rotor", mass=0.5, inertia=(0.01,) * 3, motor=Motor(inertia=1e-4, gear_ratio=20.0))
    terms = (("rotor", 1.0), ("crank", -3.0), *([("rocker", 2.0)] if several else []))
    robot = replace(
        loop,
        links=(*loop.links, rotor),
        constraints=(*loop.constraints, Coupling(name="gear", terms=terms, constant=0.1)),
    )
    mechanism = Mechanism(robot)
    q = robot.neutral
    qd = mechanism.consistent_speeds(q, np.array((0.7, 0.0, 0.0)))
    turns = np.array((3.0, 0.0, -2.0 if several else 0.0))  # of the rotor per unit of crank, coupler, rocker
    qdd = trace_constrained_motion(robot)(q, qd, 2.5 * turns)[2]
    assert trace_rne(robot)(q, qd, qdd)[0] == pytest.approx(2.5 * turns, abs=1e-10)
    with pytest.raises(RobotError, match="the joints with motors have 2 degrees of freedom"):
        trace_rne(robot.with_link("coupler", motor=Motor()))


def driven_joints(mechanism: Mechanism, q: np.ndarray) -> list[str]:
    """Joints, as many as degrees of freedom, whose speeds determine all others: columns left by pivoting."""
    J = mechanism.jacobian(q)
    rank = mechanism.robot.nv - mechanism.mobility(q).degrees_of_freedom
    dependent: list[int] = []
    R = J.copy()
    for _ in range(rank):
        k = int(np.argmax(np.linalg.norm(R, axis=0)))
        dependent.append(k)
        direction = R[:, k] / np.linalg.norm(R[:, k])
        R -= np.outer(direction, direction @ R)
    names = mechanism.robot.joint_names
    return [names[k] for k in range(len(names)) if k not in dependent]


def test_the_degree_of_freedom_of_bricard_s_mechanism() -> None:
    """Six joints minus five equations of the closure would leave 0; one equation follows from the others."""
    robot = bricard()
    mobility = Mechanism(robot).mobility(robot.neutral)
    assert mobility.degrees_of_freedom == 1
    assert mobility.redundant == ("last hinge",)


def test_a_planar_loop_has_three_redundant_equations() -> None:
    robot = four_bar()
    mobility = Mechanism(robot).mobility(robot.neutral)
    assert (mobility.degrees_of_freedom, mobility.instantaneous, mobility.singular) == (1, 1, False)
    assert mobility.redundant == ("pin",) * 3


def test_parallelograms_are_singular_when_flat() -> None:
    robot = parallelograms(2)
    mechanism = Mechanism(robot)
    flat = robot.neutral
    flat[:3], flat[3:] = -np.pi / 2, np.pi / 2
    assert np.abs(mechanism.residuals(flat)).max() < 1e-12
    mobility = mechanism.mobility(flat)
    assert (mobility.degrees_of_freedom, mobility.singular) == (1, True)
    assert mobility.instantaneous == 3


@pytest.mark.parametrize("count", [1, 2])
def test_the_branches_of_a_bifurcation_are_motions_of_the_mechanism(count: int) -> None:
    """Flat squares: the parallelogram motion, and one fold about each post: count + 1 branches."""
    robot = parallelograms(count)
    flat = robot.neutral
    flat[: count + 1], flat[count + 1 :] = -np.pi / 2, np.pi / 2
    state = ab.Arm(robot).assemble(flat)
    assert state.bifurcation and len(state.branches) == count + 1
    assert f"bifurcation: {count + 1} branches of the motion cross here" in str(state)
    assert f"at this configuration, of the joints {', '.join(state.free_joints)}" in str(state)
    assert set(state.free_joints) == set(robot.joint_names)
    mechanism = Mechanism(robot)
    for direction in state.branches:
        assert np.linalg.norm(direction) == pytest.approx(1.0)
        assert np.abs(mechanism.jacobian(state.q) @ direction).max() < 0.05
        # The residual along a branch is small to second order: the mechanism moves there.
        other = mechanism.assembled(mechanism.moved(state.q, 0.2 * direction))
        assert np.linalg.norm(other - state.q - 0.2 * direction) < 0.05
    ordinary = ab.Arm(robot).assemble()
    assert not ordinary.bifurcation and ordinary.free_joints == () and ordinary.branches.shape == (0, robot.n)


@pytest.mark.parametrize("build", [four_bar, slider_crank, bricard])
def test_assembly_finds_a_configuration_and_keeps_locked_joints(build: Callable[[], Robot]) -> None:
    robot = build()
    mechanism = Mechanism(robot)
    guess = robot.neutral + 0.1
    name = robot.joint_names[0]
    q = mechanism.assembled(guess, locked=(name,))
    assert q[0] == guess[0]
    assert np.abs(mechanism.residuals(q)).max() < 1e-12


def test_links_that_are_too_short_are_named_with_their_gap() -> None:
    robot = four_bar()
    far = Rod(
        name="far", first=Attachment(), second=Attachment(link="crank", pose=transl(0.3, 0, 0)), length=0.5
    )
    with pytest.raises(AssemblyError) as failure:
        Mechanism(replace(robot, constraints=(far,))).assembled(robot.neutral)
    assert "constraint 'far'" in str(failure.value)
    assert failure.value.gaps == {"far": "200 mm"}


def test_an_assembly_with_a_reversed_axis_does_not_count() -> None:
    """The z axes meet after a rotation by 180 degrees, too, but in opposite directions."""
    link = Link(name="flap", joint=Revolute(axis=(1, 0, 0)))
    hinge = RevoluteClosure(name="hinge", first=Attachment(), second=Attachment(link="flap"))
    mechanism = Mechanism(Robot(name="flap", links=(link,), constraints=(hinge,)))
    assert mechanism.assembled(np.array([3.0])) == pytest.approx([2 * np.pi], abs=1e-9) or (
        mechanism.assembled(np.array([3.0])) == pytest.approx([0.0], abs=1e-9)
    )


def test_speeds_of_locked_joints_that_contradict_are_refused() -> None:
    mechanism = Mechanism(four_bar())
    with pytest.raises(RobotError, match="violate constraint 'pin'"):
        mechanism.consistent_speeds(
            np.zeros(3), np.array([1.0, 0.0, 0.0]), locked=("crank", "coupler", "rocker")
        )


def test_a_coupling_is_a_gear() -> None:
    """Two discs with moments 1 and 2 kg m2, the second one three times as fast: the inertia is 1 + 9 * 2."""
    discs = tuple(
        Link(name=name, mass=1.0, inertia=(0, 0, moment)) for name, moment in (("b", 2.0), ("a", 1.0))
    )
    gear = Coupling(name="gear", terms=(("b", 1.0), ("a", -3.0)))
    robot = Robot(name="gear", links=discs, constraints=(gear,))
    assert robot.joint_names == ("a",)
    assert trace_inertia(robot)(np.zeros(1))[0] == pytest.approx(19.0)
    assert trace_accel(robot)([0.0], [0.0], [1.0])[0] == pytest.approx(1 / 19)


def test_couplings_equal_multipliers() -> None:
    """Random trees with couplings: independent coordinates and a formulation with multipliers agree."""
    random = np.random.default_rng(5)
    for seed in range(4):
        tree, _ = random_mechanism(seed)
        names = [link.name for link in tree.links]
        a, b, c, d = (str(name) for name in random.choice(names, 4, replace=False))
        couplings = (
            Coupling(name="one", terms=((a, 2.0), (b, -1.0), (c, 0.5)), constant=0.3),
            Coupling(name="two", terms=((d, 1.0), (a, 0.7)), constant=-0.1),
        )
        robot = replace(tree, constraints=couplings)
        q, qd, tau = random.uniform(-1, 1, (3, robot.nv))
        coordinates = robot.coordinate_map
        tree_q, tree_qd = coordinates.positions @ q, coordinates.speeds @ qd
        tree_tau = random.normal(size=tree.nv)
        tau = coordinates.speeds.T @ tree_tau
        expected = accelerations(replace(robot.uncoupled, constraints=couplings), tree_q, tree_qd, tree_tau)
        (qdd,) = trace_accel(robot)(q, qd, tau)
        assert coordinates.speeds @ qdd == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
        torque = trace_rne(robot)
        assert torque(q, qd, qdd)[0] == pytest.approx(tau, abs=1e-9)
        (inertia,) = trace_inertia(robot)(q)
        no_speed = np.zeros(robot.nv)
        columns = [torque(q, no_speed, e)[0] for e in np.eye(robot.nv)]
        still = torque(q, no_speed, no_speed)[0]
        assert inertia == pytest.approx(np.array(columns).T - still[:, None], abs=1e-9)
        pose = trace_fkine(robot)
        T0, T1 = (pose(q + h * qd)[0] for h in (-1e-6, 1e-6))
        (J,) = trace_jacob0(robot)(q)
        assert (J @ qd)[:3] == pytest.approx((T1 - T0)[:3, 3] / 2e-6, abs=1e-6)


@pytest.mark.parametrize(
    ("terms", "message"),
    [
        ((("a", 1.0), ("b", 1.0)), "two couplings determine joint 'a'"),
        ((("b", 1.0), ("a", 1.0)), "depend on itself: a -> b -> a"),
        ((("c", 1.0),), "no link named 'c'"),
    ],
)
def test_couplings_that_contradict_are_refused(terms: tuple[tuple[str, float], ...], message: str) -> None:
    links = (Link(name="a"), Link(name="b"))
    first = Coupling(name="first", terms=(("a", 1.0), ("b", -1.0)))
    with pytest.raises(ArmblocksError, match=message):
        Robot(name="pair", links=links, constraints=(first, Coupling(name="second", terms=terms)))


@pytest.mark.parametrize(
    ("terms", "message"), [((), "no joint is coupled"), ((("a", 1.0), ("a", 2.0)), "a joint occurs twice")]
)
def test_a_coupling_names_each_joint_once(terms: tuple[tuple[str, float], ...], message: str) -> None:
    with pytest.raises(RobotError, match=message):
        Coupling(name="pair", terms=terms)


def test_a_state_far_from_the_constraints_has_no_motion() -> None:
    """The result is NaN instead of wrong numbers."""
    motion = trace_constrained_motion(four_bar())
    assert np.isnan(motion(np.full(3, 2.0), np.zeros(3), np.zeros(3))[2]).all()


def test_torques_exist_only_for_motions_that_satisfy_the_constraints() -> None:
    """Errors of 1e-9 are rounding; errors of 1e-3 would give wrong torques without a message."""
    arm = ab.Arm(four_bar().with_link("crank", motor=Motor()))
    state = arm.assemble(qd=[4.0, 0.0, 0.0], locked=("crank",))
    motion = [state.q, state.qd, arm.accel(state.q, state.qd, [2.0, 0.0, 0.0])]
    for k in range(3):
        for error, exists in ((1e-9, True), (1e-3, False)):
            changed = [value + error * np.eye(3)[1] * (i == k) for i, value in enumerate(motion)]
            for loads in ({}, {"payload": 1.0}):
                assert np.isfinite(arm.rne(*changed, **loads)).all() == exists
            assert np.isfinite(arm.gravload(changed[0])).all() == (exists or k > 0)
    fast = [state.q, 1e3 * state.qd, arm.accel(state.q, 1e3 * state.qd, np.zeros(3))]
    assert arm.rne(*fast) == pytest.approx(np.zeros(3), abs=1e-5)


def distant_four_bar() -> Robot:
    """A four-bar linkage whose zeros of the joints are far from all configurations."""
    robot = four_bar()
    for name, offset in (("crank", 0.7), ("coupler", 2.6), ("rocker", -2.9)):
        link = robot.link(name)
        robot = robot.with_link(name, joint=link.joint.with_offset(offset))
    return robot.with_link("crank", motor=Motor())


def test_motions_near_given_coordinates() -> None:
    """Functions of an arm assemble its loops near ``near``, by default anywhere; a run near q0."""
    robot = distant_four_bar()
    q = np.array([-0.7, -2.6, 2.9])
    expected = ab.Arm(four_bar()).accel(np.zeros(3), np.zeros(3), [1.0, 0.0, 0.0])
    for near in (None, q):
        arm = ab.Arm(robot, near=near)
        assert arm.accel(q, np.zeros(3), [1.0, 0.0, 0.0]) == pytest.approx(expected, abs=1e-9)
        torque = arm.rne(q, np.zeros(3), expected)
        assert torque == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    copied = pickle.loads(pickle.dumps(ab.Arm(robot, near=q)))
    assert copied.gravload(q).tolist() == ab.Arm(robot, near=q).gravload(q).tolist()
    with pytest.raises(InputError, match=r"near has the shape \(2,\)"):
        ab.Arm(robot, near=[0.0, 0.0])


def test_a_mechanism_is_assembled_anywhere_if_not_near_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    """At q = 0 the second hinge of the door is reversed, and one start does not leave this configuration."""
    half_turn = Transform(rotation=rotation_about((0, 0, 1), np.pi))
    links = (
        Link(name="door", before=half_turn, mass=1.0, centre_of_mass=(0.5, 0, 0), inertia=(0.1,) * 3),
        Link(name="frame", parent="door", joint=Prismatic(axis=(0, 0, 1)), mass=1.0, inertia=(0.1,) * 3),
    )
    weld = WeldClosure(name="latch", first=Attachment(), second=Attachment(link="frame"))
    monkeypatch.setattr(mechanism_module, "RESTARTS", 0)
    mechanism = Mechanism(Robot(name="door", links=links, constraints=(weld,)))
    with pytest.raises(AssemblyError, match="'latch'"):
        mechanism.assembled(np.zeros(2))
    assert np.cos(mechanism.assembled_anywhere()) == pytest.approx([-1.0, 1.0], abs=1e-12)


def test_a_mechanism_that_fits_nowhere_is_refused() -> None:
    robot = four_bar().with_link("rocker", before=transl(9.0, 0, 0))
    with pytest.raises(AssemblyError, match="satisfies constraint 'pin'"):
        ab.Arm(robot).accel(np.zeros(3), np.zeros(3), np.zeros(3))


def test_a_shaft_with_a_cardan_joint_has_its_ratio_of_speeds() -> None:
    """tan(out) = tan(in) / cos(beta): the speeds differ by cos(beta) / (1 - sin²(beta) cos²(in))."""
    beta = 0.5
    shaft = Transform(rotation=rotation_about((0, 0, 1), beta))
    links = (
        Link(name="in", joint=Revolute(axis=(1, 0, 0)), inertia=(0.01, 0.02, 0.02)),
        Link(name="cross", parent="in", joint=Revolute(axis=(0, 1, 0)), inertia=(5e-4, 3e-4, 3e-4)),
        Link(name="out", parent="cross", inertia=(0.03, 0.02, 0.02)),
    )
    along_x = Transform(rotation=((0, 0, 1), (1, 0, 0), (0, 1, 0)))
    bearing = RevoluteClosure(
        name="bearing", first=Attachment(pose=shaft @ along_x), second=Attachment(link="out", pose=along_x)
    )
    mechanism = Mechanism(Robot(name="cardan", links=links, constraints=(bearing,)))
    assert mechanism.mobility(mechanism.assembled(np.zeros(3))).degrees_of_freedom == 1
    for angle in (0.0, 0.3, 1.2, 2.5):
        q = mechanism.assembled(np.array([angle, 0.0, 0.0]), locked=("in",))
        qd = mechanism.consistent_speeds(q, np.array([1.0, 0.0, 0.0]), locked=("in",))
        axis = np.array(shaft.rotation)[:, 0]
        x = np.array(rotation_about((1, 0, 0), q[0]))
        y = x @ np.array(rotation_about((0, 1, 0), q[1]))
        omega = qd[0] * np.eye(3)[0] + qd[1] * x[:, 1] + qd[2] * y[:, 2]
        expected = np.cos(beta) / (1 - np.sin(beta) ** 2 * np.cos(angle) ** 2)
        assert axis @ omega == pytest.approx(expected, abs=1e-12)


def test_a_robot_without_closures_is_assembled_everywhere() -> None:
    arm = ab.Arm(replace(four_bar(), constraints=()))
    state = arm.assemble([0.1, 0.2, 0.3], [1.0, 2.0, 3.0])
    assert state.q.tolist() == [0.1, 0.2, 0.3] and state.qd.tolist() == [1.0, 2.0, 3.0]
    assert (state.degrees_of_freedom, state.redundant, str(state)) == (3, {}, "3 degrees of freedom")


def test_assemble_refuses_other_sizes_and_unknown_joints() -> None:
    arm = ab.Arm(four_bar())
    with pytest.raises(InputError, match=r"q has the shape \(2,\)"):
        arm.assemble([0.1, 0.2])
    with pytest.raises(InputError, match="qd is not finite"):
        arm.assemble(qd=[np.nan, 0.0, 0.0])
    with pytest.raises(UnknownNameError, match="no joint named 'crnk'"):
        arm.assemble(locked=("crnk",))
    ball = ab.Arm(Robot(name="ball", links=(Link(name="ball", joint=Spherical(), mass=1.0),)))
    with pytest.raises(InputError, match="q has a quaternion of zeros"):
        ball.assemble(np.zeros(4))
