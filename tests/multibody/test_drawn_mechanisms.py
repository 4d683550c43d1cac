"""Mechanisms drawn from bodies and joints move like closed forms, and like the same mechanism as a robot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from drawings import (
    GRAVITY,
    INERTIA,
    TYPES,
    Array,
    Drawing,
    four_bar,
    pendulum,
    random_link,
    random_state,
    rigid,
    started,
)
from scipy.integrate import solve_ivp

import armblocks as ab
from armblocks import dynamics
from armblocks.blocks import (
    BLOCKS,
    BodyInertia,
    BrickSolid,
    ConnectionPort,
    Gain,
    LeadScrewJoint,
    MechanismConfiguration,
    PrismaticJoint,
    RevoluteJoint,
    RigidTransform,
    Subsystem,
    WeldJoint,
    WorldFrame,
)
from armblocks.diagram import DiagramBuilder, trace_diagram, with_parameters
from armblocks.dynamics.mechanism import mechanism
from armblocks.face.diagram_run import tuned_parameters
from armblocks.formats import diagram_from_bytes, diagram_to_bytes, load_robot
from armblocks.robot import Link, Robot


@pytest.mark.parametrize(("seed", "letters"), [(1, "RPR"), (2, "CUP"), (3, "SRE"), (4, "FR")])
def test_a_random_tree_has_the_accelerations_of_the_same_robot(seed: int, letters: str) -> None:
    random = np.random.default_rng(seed)
    links: list[Link] = []
    for k, letter in enumerate(letters):
        parent = None if k == 0 else f"j{random.integers(k)}"
        links.append(random_link(random, f"j{k}", parent, TYPES[letter][0]()))
    robot = Robot(name="tree", links=tuple(links), gravity=GRAVITY)
    states = {link.name: random_state(random, link.joint) for link in links}
    drawing = Drawing(robot, random)
    for link, letter in zip(links, letters):
        drawing.add(link, TYPES[letter][1], *states[link.name])
    diagram = drawing.diagram()
    heavier = replace(
        robot,
        links=tuple(
            replace(link, mass=1.7 * link.mass, inertia=np.add(link.inertia, 0.03 * np.eye(3)))
            for link in links
        ),
    )
    tuned = tuned_parameters(
        diagram,
        with_parameters(
            diagram,
            {f"{link.name} body.mass": 1.7 * link.mass for link in links}
            | {f"{link.name} body.moments": np.diag(link.inertia) + 0.03 for link in links},
        ),
    )
    assert tuned is not None, "masses and moments of inertia are inputs of the compiled system"
    q, qd, tau = (np.concatenate([states[link.name][k] for link in links]) for k in range(3))
    for of_values, values in ((robot, {}), (heavier, tuned)):
        _, rates = started(diagram, values)
        (expected,) = dynamics.trace_accel(of_values)(q, qd, tau)
        found = drawing.accelerations(rates, {name: state[0] for name, state in states.items()})
        np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("cut", [False, True], ids=["closure", "measured closure"])
@pytest.mark.parametrize("name", ["pin", "a pin"])
def test_a_four_bar_has_the_accelerations_of_the_same_robot(cut: bool, name: str) -> None:
    """The loop is closed at the pin; a measured pin has a coordinate, so that a bar is cut instead."""
    random = np.random.default_rng(5)
    robot, q = four_bar(random)
    qd = mechanism(robot).consistent_speeds(q, np.array([1.0, 0.0, 0.0]), ["bar0"])
    tau = np.array([2.0, 0.3, -0.4])
    drawing = Drawing(robot, random)
    priority = {"position_priority": "high", "velocity_priority": "high"} if cut else {}
    for k, link in enumerate(robot.links):
        drawing.add(link, RevoluteJoint, q[k : k + 1], qd[k : k + 1], tau[k : k + 1], **priority)
    closure = robot.closures[0]
    drawing.blocks |= {
        "ground": rigid(closure.first.pose),
        "tip": rigid(closure.second.pose),
        name: RevoluteJoint(sense_position=cut),
    }
    drawing.lines += [
        ("world/W", "ground/B"),
        ("ground/F", f"{name}/B"),
        (f"{name}/F", "tip/F"),
        ("tip/B", "bar2 after/F"),
    ]
    states, rates = started(drawing.diagram())
    (expected,) = dynamics.trace_accel(robot, q)(q, qd, tau)
    found = drawing.accelerations(rates, {})
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    assert (f"{name}/q" in states) is cut
    if cut:  # the pin turns from the ground to the last bar
        difference = float(states[f"{name}/q"][0]) - float(q.sum())
        assert math.cos(difference) == pytest.approx(1.0, abs=1e-12)


def test_the_sensitivity_of_a_closed_loop_is_the_difference_of_runs() -> None:
    builder = pendulum(position_target=0.3, spring_stiffness=5.0)
    far = builder.add("far", RigidTransform(translation=(0.4, 0.0, 0.0)), B=builder["world"])
    other = builder.add("other", RevoluteJoint(position_target=0.3), B=far["F"])
    rod = builder.add("other rod", RigidTransform(translation=(0.0, -0.5, 0.0)), B=other["F"])
    near, end = (builder.add(name, RevoluteJoint()) for name in ("near", "end"))
    builder.connect(builder["rod"]["F"], near["B"])
    builder.connect(rod["F"], end["B"])
    bar = RigidTransform(translation=(0.4, 0.0, 0.0))
    builder.add("bar", bar, B=near["F"], F=end["F"])
    builder.add("load", BodyInertia(mass=1.5), R=near["F"])
    diagram, parameters = builder.build(), {"hinge.spring_stiffness": 5.0, "load.mass": 1.5}
    settings = {"stop_time": 0.4, "rtol": 1e-9, "atol": 1e-10}
    found = ab.sensitivity(diagram, [*parameters], "hinge/q", **settings)
    for name, value in parameters.items():
        low, high = (
            ab.simulate(with_parameters(diagram, {name: value + step}), **settings)["hinge/q"]
            for step in (-1e-3, 1e-3)
        )
        np.testing.assert_allclose(found["hinge/q", name][-1], (high - low)[-1] / 0.002, rtol=1e-4)


def test_a_pendulum_with_spring_damper_and_torque_follows_its_equation() -> None:
    builder = pendulum(
        position_target=0.7,
        velocity_target=-1.0,
        spring_stiffness=3.0,
        equilibrium_position=0.2,
        damping_coefficient=0.4,
        actuation="torque",
        sense_position=True,
        sense_acceleration=True,
        sense_actuator=True,
    )
    hinge = builder["hinge"]
    builder.add("controller", Gain(gain=-2.0), hinge["q"])
    builder.connect(builder["controller"], hinge["tau"])
    result = ab.simulate(builder.build(), stop_time=3.0, rtol=1e-10, atol=1e-10)

    def rates(_: float, y: Array) -> list[float]:
        torque = -2.0 * y[0] - 3.0 * (y[0] - 0.2) - 0.4 * y[1] - 2.0 * 9.81 * 0.5 * math.sin(y[0])
        return [y[1], torque / INERTIA]

    expected = solve_ivp(rates, (0, 3), [0.7, -1.0], rtol=1e-11, atol=1e-11, t_eval=result.time)
    np.testing.assert_allclose(result["hinge/q"], expected.y[0], atol=1e-8)
    np.testing.assert_allclose(result["hinge/actuator"], -2.0 * result["hinge/q"], atol=1e-12)
    accelerations = [rates(0.0, y)[1] for y in np.column_stack([result["hinge/q"], result["hinge/qd"]])]
    np.testing.assert_allclose(result["hinge/qdd"], accelerations, atol=1e-9)


def test_a_cart_with_a_pole_follows_its_equations() -> None:
    """Cart 2 kg on a slider along x, pole of 0.3 kg with its centre 0.25 m from the pivot."""
    builder = DiagramBuilder("cart-pole")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", MechanismConfiguration(), C=world)
    along_x = builder.add(
        "along x", RigidTransform(rotation="standard_axis", axis="y", angle=math.pi / 2), B=world
    )
    slider = builder.add("slider", PrismaticJoint(), B=along_x["F"])
    builder.add("cart", BodyInertia(mass=2.0), R=slider["F"])
    about_y = builder.add(
        "about y",
        RigidTransform(rotation="sequence", sequence="yxz", angles=(-math.pi / 2, -math.pi / 2, 0.0)),
        B=slider["F"],
    )
    hinge = builder.add("hinge", RevoluteJoint(position_target=0.4, velocity_target=0.5), B=about_y["F"])
    arm = builder.add("arm", RigidTransform(translation=(0.0, -0.25, 0.0)), B=hinge["F"])
    builder.add("pole", BodyInertia(mass=0.3, moments=(0.01, 0.0, 0.01)), R=arm["F"])
    result = ab.simulate(builder.build(), stop_time=2.0, rtol=1e-10, atol=1e-10)
    m, M, L, J, g = 0.3, 2.0, 0.25, 0.01, 9.80665

    def rates(_: float, y: Array) -> list[float]:
        _, v, a, w = y  # the pole is above the cart at a = 0, and leans along +x for a > 0
        A = np.array([[M + m, m * L * math.cos(a)], [m * L * math.cos(a), J + m * L * L]])
        b = [m * L * w * w * math.sin(a), m * g * L * math.sin(a)]
        vd, wd = np.linalg.solve(A, b)
        return [v, vd, w, wd]

    expected = solve_ivp(rates, (0, 2), [0, 0, 0.4, 0.5], rtol=1e-11, atol=1e-11, t_eval=result.time)
    np.testing.assert_allclose(result["slider/q"], expected.y[0], atol=1e-7)
    np.testing.assert_allclose(result["hinge/q"], expected.y[2], atol=1e-7)


def test_a_limit_pushes_back_and_keeps_the_energy_without_damping() -> None:
    builder = pendulum(position_target=1.0, lower_limit=-0.1, limit_stiffness=1e4, limit_damping=0.0)
    result = ab.simulate(builder.build(), stop_time=3.0, rtol=1e-9, atol=1e-9)
    q, qd = result["hinge/q"], result["hinge/qd"]
    energy = 0.5 * INERTIA * qd**2 - 9.81 * np.cos(q)
    free = q > -0.1
    assert q.min() == pytest.approx(
        -0.1 - math.sqrt(2 * 9.81 * (math.cos(0.1) - math.cos(1.0)) / 1e4), abs=2e-3
    )
    np.testing.assert_allclose(energy[free], energy[0], atol=1e-6)


def test_a_lead_screw_turns_and_translates() -> None:
    """The weight along the axis turns the screw: (I + m h^2) qdd = -m g h with h = lead / (2 pi)."""
    builder = DiagramBuilder("screw")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", MechanismConfiguration(), C=world)
    screw = builder.add("screw", LeadScrewJoint(lead=0.4), B=world)
    builder.add("nut", BodyInertia(mass=2.0, moments=(0.1, 0.1, 0.1)), R=screw["F"])
    _, rates = started(builder.build())
    h = 0.4 / (2 * math.pi)
    assert rates["screw/qd"] == pytest.approx(-2.0 * 9.80665 * h / (0.1 + 2.0 * h * h), rel=1e-12)


def test_solids_of_one_rigid_group_are_one_body() -> None:
    """A brick, and the same brick as two halves that a weld and a transform join, have equal motions."""
    builder = pendulum(position_target=0.5)
    _, whole = started(builder.build())
    builder = pendulum(position_target=0.5)
    halves = BrickSolid(dimensions=(0.15, 0.4, 0.1), mass_from="mass", mass=1.0)
    split = DiagramBuilder("halves")
    base = builder.build()
    for name, block in base.blocks.items():
        split.add(name, halves if name == "brick" else block)
    for line in base.frame_lines:
        if "brick" not in str(line):
            split.connect(*line.ends)
    left = split.add("left", RigidTransform(translation=(-0.075, 0.0, 0.0)), B=split["rod"]["F"])
    right = split.add("right", RigidTransform(translation=(0.15, 0.0, 0.0)), B=split["brick"]["R"])
    split.add("weld", WeldJoint(), B=left["F"], F=split["brick"]["R"])
    split.add("second", halves, R=right["F"])
    _, parts = started(split.build())
    assert parts["hinge/qd"] == pytest.approx(whole["hinge/qd"], rel=1e-12)


def test_subsystems_do_not_change_signals_states_and_parameters_except_their_paths() -> None:
    builder = DiagramBuilder("nested")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", MechanismConfiguration(gravity=(0.0, -9.81, 0.0)), C=world)
    inner = DiagramBuilder("leg")
    hip = inner.add("hip", ConnectionPort())
    hinge = inner.add(
        "hinge", RevoluteJoint(position_target=0.7, actuation="torque", sense_velocity=True), B=hip
    )
    inner.connect(inner.input("tau"), hinge["tau"])
    inner.output("speed", hinge["qd"])
    rod = inner.add("rod", RigidTransform(translation=(0.0, -0.5, 0.0)), B=hinge["F"])
    inner.add("foot", ConnectionPort(side="right"), C=rod["F"])
    leg = builder.add("leg", Subsystem(diagram=inner.build()), hip=world)
    builder.connect(builder.add("damper", Gain(gain=-0.3), leg["speed"]), leg["tau"])
    brick = BrickSolid(dimensions=(0.3, 0.4, 0.1), mass_from="mass", mass=2.0)
    builder.add("brick", brick, R=leg["foot"])
    flat = pendulum(position_target=0.7, actuation="torque", sense_velocity=True)
    flat.connect(flat.add("damper", Gain(gain=-0.3), flat["hinge"]["qd"]), flat["hinge"]["tau"])
    nested_run = ab.simulate(builder.build(), stop_time=1.0)
    flat_run = ab.simulate(flat.build(), stop_time=1.0)
    np.testing.assert_array_equal(nested_run["leg/hinge/q"], flat_run["hinge/q"])
    np.testing.assert_array_equal(nested_run["leg/speed"], flat_run["hinge/qd"])
    system = trace_diagram(builder.build())
    assert system.states.names == ("leg/hinge/q", "leg/hinge/qd")
    assert "leg/hinge.damping_coefficient" in system.parameters.names
    assert not any("mechanism" in name for name in (*system.aliases, *system.signals_layout.names))


def test_stiffness_damping_and_targets_are_tuned_without_a_new_trace() -> None:
    diagram = pendulum(position_target=0.7).build()
    values = {"hinge.spring_stiffness": 5.0, "hinge.damping_coefficient": 0.1, "hinge.position_target": 0.2}
    tuned = ab.simulate(diagram, stop_time=1.0, parameters=values)
    rebuilt = ab.simulate(with_parameters(diagram, values), stop_time=1.0)
    np.testing.assert_array_equal(tuned["hinge/q"], rebuilt["hinge/q"])
    run = ab.begin(diagram)
    run.advance(0.2)
    run.set("hinge.damping_coefficient", 2.0)
    run.advance(0.4)
    unset = pendulum(position_target=0.7, position_priority="none").build()
    assert started(unset)[0]["hinge/q"] == 0.0


def test_files_copies_and_differences_keep_frame_lines() -> None:
    diagram = pendulum().build()
    data = diagram_to_bytes(diagram, load_robot)
    assert b'"hinge/F -- rod/B"' in data
    assert diagram_from_bytes(data, "pendulum", BLOCKS, load_robot) == diagram
    line = diagram.frame_lines[0]
    less = replace(diagram, frame_lines=diagram.frame_lines[1:])
    difference = ab.diagram_difference(diagram, less)
    assert [entry.line for entry in difference.lines_removed] == [line]
    assert not difference.lines_added
