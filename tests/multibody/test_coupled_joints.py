"""Joints of drawn mechanisms that gears couple: closed forms, energy, starts, motion inputs, refusals."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
import pytest
from drawings import TYPES, Array, Drawing, four_bar, random_link, rigid, started

import armblocks as ab
from armblocks import dynamics
from armblocks.blocks import (
    BodyInertia,
    Constant,
    MechanismConfiguration,
    RevoluteJoint,
    RigidTransform,
    SineWave,
    WorldFrame,
)
from armblocks.blocks.mechanics.mechanics_block import MechanicsBlock
from armblocks.diagram import Diagram, DiagramBuilder, FramePort, parameter, trace_diagram
from armblocks.dynamics.mechanism import mechanism
from armblocks.errors import DiagramError, InputError
from armblocks.multibody.parts import BASE, FOLLOWER, AxisOfCoupling, CouplingPart
from armblocks.robot import Coupling, Robot


@dataclass(frozen=True, kw_only=True)
class Belt(MechanicsBlock):
    """F turns by ``factor`` times the angle of B, plus an angle."""

    title: ClassVar[str] = "Belt"
    factor: float = parameter(1.0, tunable=False, finite=False, doc="angle of F per angle of B")
    angle: float = parameter(0.0, tunable=False, doc="angle of F where that of B is 0", unit="rad")
    kind: str = parameter("revolute", doc="kind of the joint of F")

    def frame_ports(self) -> tuple[FramePort, ...]:
        return (FramePort(BASE, "wheel"), FramePort(FOLLOWER, "other wheel"))

    def part(self) -> CouplingPart:
        return CouplingPart(joints=("revolute", self.kind), offset=self.angle)

    def follower_per_base(self, base: AxisOfCoupling, follower: AxisOfCoupling) -> float:
        if self.factor > 9.0:
            raise InputError(
                "the wheels are too far apart", where="Belt", allowed="a short belt", fix="move the wheels"
            )
        return self.factor


PORTS = {"torque": "tau", "motion": "motion"}


def wheels(belt: Belt | None = None, one: Any = None, other: Any = None) -> DiagramBuilder:
    """Two wheels on joints of the world, with moments of inertia of 0.2 and 0.05 kg m2, and a belt."""
    builder = DiagramBuilder("wheels")
    world = builder.add("world", WorldFrame())
    for name, inertia, given in (("one", 0.2, one), ("other", 0.05, other)):
        values: dict[str, Any] = given or {}
        joint = builder.add(name, RevoluteJoint(sense_position=True, **values), B=world)
        builder.add(f"{name} wheel", BodyInertia(mass=1.0, moments=(inertia,) * 3), R=joint["F"])
        if port := PORTS.get(values.get("actuation", "")):
            builder.connect(builder.add(f"{name} signal", Constant(value=2.0)), joint[port])
    belt = Belt(factor=-3.0) if belt is None else belt
    builder.add("belt", belt, B=builder["one"]["F"], F=builder["other"]["F"])
    return builder


@pytest.mark.parametrize("stated", ["one", "other"])
def test_coupled_wheels_have_one_state_and_the_sum_of_their_inertias(stated: str) -> None:
    """(J1 + n^2 J2) q1'' = tau1 + n (tau2 - k q2 - d q2'), from a start that either joint gives."""
    start = {"position_target": 0.3, "velocity_target": 0.7}
    values: dict[str, Any] = {
        "one": {"actuation": "torque"},
        "other": {"actuation": "torque", "spring_stiffness": 0.5, "damping_coefficient": 0.1},
    }
    values[stated] |= start
    diagram = wheels(Belt(factor=-3.0, angle=0.2), **values).build()
    x, rates = started(diagram)
    assert sorted(x) == ["one/q", "one/qd"]
    q1, qd1 = (0.3, 0.7) if stated == "one" else ((0.3 - 0.2) / -3.0, 0.7 / -3.0)
    assert (x["one/q"][0], x["one/qd"][0]) == (pytest.approx(q1, abs=1e-15), pytest.approx(qd1, abs=1e-15))
    q2, qd2 = 0.2 - 3.0 * q1, -3.0 * qd1
    expected = (2.0 - 3.0 * (2.0 - 0.5 * q2 - 0.1 * qd2)) / (0.2 + 9.0 * 0.05)
    assert rates["one/qd"] == pytest.approx(expected, rel=1e-12)
    result = ab.simulate(diagram, stop_time=1.0, sample_time=0.1)
    np.testing.assert_allclose(result["other/q"], 0.2 - 3.0 * result["one/q"], atol=1e-13)
    assert np.ptp(result["other/q"]) > 1.0


def test_a_motion_input_moves_both_joints_and_its_drive_carries_both_inertias() -> None:
    """Also at the joint that would depend on the other one; a spring at the other joint loads the drive."""
    driven: Any = {"actuation": "motion", "sense_actuator": True}
    builder = DiagramBuilder("driven")
    world = builder.add("world", WorldFrame())
    sine = builder.add("sine", SineWave(amplitude=0.5, frequency=2.0))
    one = builder.add("one", RevoluteJoint(spring_stiffness=0.4, sense_position=True), B=world)
    other = builder.add("other", RevoluteJoint(damping_coefficient=0.3, **driven), sine, B=world)
    builder.add("one wheel", BodyInertia(mass=1.0, moments=(0.2,) * 3), R=one["F"])
    builder.add("other wheel", BodyInertia(mass=1.0, moments=(0.05,) * 3), R=other["F"])
    builder.add("belt", Belt(factor=-3.0), B=one["F"], F=other["F"])
    result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.1)
    q, qd = 0.5 * np.sin(2.0 * result.time), np.cos(2.0 * result.time)
    np.testing.assert_allclose(result["one/q"], -q / 3.0, atol=1e-15)
    torque = (0.05 + 0.2 / 9.0) * -4.0 * q + 0.3 * qd + 0.4 * q / 9.0
    np.testing.assert_allclose(result["other/actuator"], torque, atol=1e-13)


def coupled_tree(random: np.random.Generator, *, loop: bool) -> Robot:
    """A carrier with two coupled joints and a slider beyond one of them, perhaps with a four-bar."""
    parents = {"j0": None, "j1": "j0", "j2": "j0", "j3": "j2"}
    links = [
        random_link(random, name, parent, TYPES["P" if name == "j3" else "R"][0]())
        for name, parent in parents.items()
    ]
    couplings = [Coupling(name="belt", terms=(("j2", 1.0), ("j1", 2.5)), constant=0.4)]
    closures: list[Any] = []
    if loop:
        bars, _ = four_bar(random)
        links = [*bars.links, *(replace(link, parent=link.parent or "bar1") for link in links)]
        closures = list(bars.closures)
        links.append(random_link(random, "fly", None, TYPES["R"][0]()))
        couplings.append(Coupling(name="crank", terms=(("fly", 1.0), ("bar0", -1.5))))
    return Robot(
        name="tree", links=tuple(links), gravity=(1.0, 2.0, -9.0), constraints=(*closures, *couplings)
    )


@pytest.mark.parametrize(("seed", "loop"), [(1, False), (3, True)])
def test_a_mechanism_with_couplings_has_the_accelerations_of_the_same_robot(seed: int, loop: bool) -> None:
    """Torques at all joints, among them dependent ones; joints drawn in both directions."""
    random = np.random.default_rng(seed)
    robot = coupled_tree(random, loop=loop)
    q, qd = robot.neutral + 0.4 * random.normal(size=robot.nq), random.normal(size=robot.nv)
    if loop:
        q[:3] = four_bar(random)[1]
        q = mechanism(robot).assembled(q)
        qd = mechanism(robot).consistent_speeds(q, qd)
    tree, offsets = robot.coordinate_map, robot.coordinate_map.offsets
    names = [link.name for link in robot.tree_links]
    of_tree = tree.positions @ q + np.array([offsets.get(name, 0.0) for name in names])
    rates, tau = tree.speeds @ qd, random.normal(size=len(names))
    drawing = Drawing(robot, random)
    for k, link in enumerate(robot.links):
        kind = TYPES["P" if link.name == "j3" else "R"][1]
        drawing.add(
            link, kind, *(values[k : k + 1] for values in (of_tree, rates, tau)), sense_acceleration=True
        )
    add_belts(drawing, robot)
    diagram = drawing.diagram()
    found = signals_at_start(diagram)
    (qdd,) = dynamics.trace_accel(robot)(q, qd, tree.speeds.T @ tau)
    expected = tree.speeds @ np.ravel(qdd)
    signs = np.array([-1.0 if drawing.flipped[name] else 1.0 for name in names])
    actual = signs * np.array([float(found[f"{name}/qdd"][0]) for name in names])
    np.testing.assert_allclose(actual, expected, rtol=1e-8, atol=1e-9 * np.abs(expected).max())
    assert len(started(diagram)[0]) == 2 * robot.nv


def add_belts(drawing: Drawing, robot: Robot) -> None:
    """Draw the couplings of a robot, and the pin that closes the four-bar."""
    for closure in robot.closures:
        drawing.blocks |= {"ground": rigid(closure.first.pose), "tip": rigid(closure.second.pose)}
        drawing.blocks["pin"] = RevoluteJoint()
        drawing.lines += [("world/W", "ground/B"), ("ground/F", "pin/B")]
        drawing.lines += [("pin/F", "tip/F"), ("tip/B", "bar2 after/F")]
    for coupling in robot.couplings:
        (dependent, _), (independent, factor) = coupling.terms
        drawing.blocks[coupling.name] = Belt(factor=-factor, angle=coupling.constant)
        drawing.lines += [
            (f"{coupling.name}/B", f"{independent} after/B"),
            (f"{coupling.name}/F", f"{dependent} after/B"),
        ]


def signals_at_start(diagram: Diagram) -> dict[str, Array]:
    system = trace_diagram(diagram)
    p = system.parameter_values
    (x,), (z,) = system.initial_states(p), system.initial_discrete(p)
    (values,) = system.signals(0.0, x, z, (), p)
    return {slot: values[part] for slot, part in system.signals_layout.ranges.items()}


def test_coupled_pendulums_keep_their_energy_and_their_poses_are_recorded() -> None:
    """Lagrange's equation of one coordinate, of eccentric bodies at both joints."""
    builder = DiagramBuilder("pendulums")
    world = builder.add("world", WorldFrame())
    builder.add("settings", MechanismConfiguration(gravity=(0.0, -9.81, 0.0)), C=world)
    for name, start, centre in (("one", 2.4, (0.0, -0.3, 0.0)), ("other", 0.0, (0.2, 0.0, 0.1))):
        joint = builder.add(name, RevoluteJoint(position_target=start, sense_position=True), B=world)
        body = BodyInertia(mass=1.5, centre_of_mass=centre, moments=(0.02,) * 3)
        builder.add(f"{name} body", body, R=joint["F"])
    builder.add("belt", Belt(factor=-1.7), B=builder["one"]["F"], F=builder["other"]["F"])
    result = ab.simulate(builder.build(), stop_time=3.0, sample_time=0.1, rtol=1e-10, atol=1e-12)
    q, qd = result["one/q"], result["one/qd"]
    inertia = (0.02 + 1.5 * 0.09) + 1.7**2 * (0.02 + 1.5 * 0.04)
    potential = 1.5 * 9.81 * (-0.3 * np.cos(q) + 0.2 * np.sin(-1.7 * q))
    energy = 0.5 * inertia * qd**2 + potential
    np.testing.assert_allclose(energy, energy[0], atol=1e-8)
    assert np.ptp(potential) > 1.0
    poses = result["world/poses"]
    np.testing.assert_allclose(poses[:, 2, 1, 0], np.sin(-1.7 * q), atol=1e-12)


def test_a_gear_train_follows_its_joint_with_the_exact_target() -> None:
    """Three wheels in a circle of belts whose product is 1; the last of these belts is redundant."""

    def train(last: float, **middle: Any) -> DiagramBuilder:
        builder = wheels(Belt(factor=2.0), one={"position_target": 9.0})
        third = builder.add("third", RevoluteJoint(sense_position=True, **middle), B=builder["world"]["W"])
        builder.add("third wheel", BodyInertia(mass=1.0, moments=(1.0,) * 3), R=third["F"])
        builder.add("second belt", Belt(factor=3.0), B=builder["other"]["F"], F=third["F"])
        builder.add("third belt", Belt(factor=last), B=third["F"], F=builder["one"]["F"])
        return builder

    high: Any = {"position_target": 0.6, "position_priority": "high", "velocity_target": 1.2}
    x, rates = started(train(1.0 / 6.0, **high, spring_stiffness=2.0).build())
    assert {name: value[0] for name, value in x.items()} == {"third/q": 0.6, "third/qd": 1.2}
    assert rates["third/qd"] == pytest.approx(-1.2 / (1.0 + 0.05 / 9.0 + 0.2 / 36.0), rel=1e-12)
    with pytest.raises(DiagramError, match=r"lock it: joint '(one|other|third)' cannot move.*product of all"):
        train(0.5).build()


def test_a_driven_crank_with_a_wheel_has_the_motion_that_its_torque_causes() -> None:
    """The torque of the drive of a four-bar, whose crank turns a wheel, at the crank of the same robot."""
    random = np.random.default_rng(5)
    robot = coupled_tree(random, loop=True)
    q = mechanism(robot).assembled(np.concatenate([four_bar(random)[1], np.zeros(robot.nq - 3)]))
    drawing = Drawing(robot, random)
    names, tree = [link.name for link in robot.tree_links], robot.coordinate_map
    of_tree = tree.positions @ q + np.array([tree.offsets.get(name, 0.0) for name in names])
    torques = np.where(np.array(names) == "fly", 0.7, 0.0)
    for k, link in enumerate(robot.links):
        kind = TYPES["P" if link.name == "j3" else "R"][1]
        state = (of_tree[k : k + 1], np.zeros(1), torques[k : k + 1])
        drawing.add(link, kind, *state, sense_acceleration=True, sense_actuator=True)
    sign = -1.0 if drawing.flipped["bar0"] else 1.0
    crank: Any = drawing.blocks["bar0"]
    drawing.blocks |= {
        "bar0": replace(crank, actuation="motion"),
        "bar0 tau": SineWave(amplitude=0.3, frequency=1.0, phase=0.8, bias=sign * q[0] - 0.3 * np.sin(0.8)),
    }
    drawing.wires[drawing.wires.index(("bar0 tau/y", "bar0/tau"))] = ("bar0 tau/y", "bar0/motion")
    add_belts(drawing, robot)
    found = signals_at_start(drawing.diagram())
    torques[0] = sign * float(found["bar0/actuator"][0])
    qd = np.array([sign * float(found[f"{name}/qd"][0]) for name in robot.joint_names[:1]])
    speeds = mechanism(robot).consistent_speeds(q, np.concatenate([qd, np.zeros(robot.nv - 1)]), ["bar0"])
    (qdd,) = dynamics.trace_accel(robot)(q, speeds, tree.speeds.T @ torques)
    assert sign * float(found["bar0/qdd"][0]) == pytest.approx(-0.3 * np.sin(0.8) * sign, rel=1e-12)
    for name, expected in zip(robot.joint_names, np.ravel(qdd)):
        flip = -1.0 if drawing.flipped[name] else 1.0
        assert flip * float(found[f"{name}/qdd"][0]) == pytest.approx(float(expected), rel=1e-8)


@pytest.mark.parametrize(
    ("one", "other", "belt", "message"),
    [
        (
            {"position_target": 0.3, "position_priority": "high"},
            {"position_target": 0.3, "position_priority": "high"},
            {},
            r"position target 0.3 of high priority cannot be met: .* give 0.6",
        ),
        (
            {"velocity_target": 1.0, "velocity_priority": "high"},
            {"velocity_target": 0.0, "velocity_priority": "high"},
            {},
            r"velocity target 0 of high priority cannot be met: .* give 2",
        ),
        (
            {"actuation": "motion"},
            {"position_target": 0.3, "position_priority": "high"},
            {},
            r"position of the joint follows from the motion input of 'one'",
        ),
        (
            {"actuation": "motion"},
            {"actuation": "motion"},
            {},
            r"coupling 'belt' determines the motion of the joint from 'one', .* can have no motion input",
        ),
        ({}, {}, {"factor": 0.0}, r"'belt'.*the motion of F per motion of B is 0"),
        ({}, {}, {"factor": -math.inf}, r"the motion of F per motion of B is -inf"),
        ({}, {}, {"kind": "prismatic"}, r"no body carries both a revolute joint .* prismatic"),
        ({}, {}, {}, r"the z axis of frame F is not parallel to the axis of joint 'other'"),
        ({}, {}, {"factor": 99.0}, r"the wheels are too far apart"),
        ({}, {}, {}, r"several pairs of joints connect frames B and F with one body: 'one' and"),
        ({}, {}, {}, r"lock it: the coupling contradicts others"),
    ],
)
def test_couplings_that_cannot_work_are_refused_by_name(
    one: Any, other: Any, belt: dict[str, Any], message: str
) -> None:
    values: Any = {"factor": 2.0, **belt}
    builder = wheels(Belt(**values), one, other)
    if "several" in message:
        world = builder["world"]["W"]
        builder.add("third", RevoluteJoint(), B=world, F=builder["other"]["F"])
    if "contradicts" in message:
        second = Belt(factor=2.0, angle=0.3)
        builder.add("second", second, B=builder["one"]["F"], F=builder["other"]["F"])
    if "parallel" in message:
        turned = builder.add("turn", RigidTransform(rotation="standard_axis", axis="x", angle=0.5))
        builder.draw_line(turned["B"], builder["other"]["F"])
        builder.add("turned belt", Belt(), B=builder["one"]["F"], F=turned["F"])
    with pytest.raises(DiagramError, match=message):
        builder.build()
