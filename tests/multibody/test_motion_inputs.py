"""Joints with motion inputs have the given motion; their drives have the torques that cause it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from drawings import (
    INERTIA,
    TYPES,
    Array,
    Drawing,
    exchanged,
    four_bar,
    pendulum,
    random_link,
    random_state,
    rigid,
)

import armblocks as ab
from armblocks import dynamics
from armblocks.blocks import (
    Bias,
    Constant,
    Gain,
    Integrator,
    PlanarJoint,
    PositionDrivenArm,
    Ramp,
    RevoluteJoint,
    SineWave,
    SixDofJoint,
)
from armblocks.diagram import Block, Diagram, trace_diagram, with_parameters
from armblocks.dynamics.mechanism import mechanism
from armblocks.errors import DiagramError, InputError, SimulationError
from armblocks.face.diagram_run import tuned_parameters
from armblocks.robot import Robot
from armblocks.robot.joints import Joint, Spherical


def product(a: Array, b: Array) -> Array:
    """The product of two quaternions."""
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))])


def drive(drawing: Drawing, name: str, joint: Joint, qdd: Array, moved: str = "") -> None:
    """Give a drawn joint a motion input with the drawn state and the accelerations ``qdd`` of the robot."""
    block: Any = drawing.blocks[name]
    q, qd = (np.atleast_1d(value).astype(float) for value in (block.position_target, block.velocity_target))
    if drawing.flipped[name]:
        (qdd,) = exchanged(joint, np.array([q[0], *-q[1:]]) if len(q) == 4 else q, qdd)[1:]
    rates, second_rates = qd, qdd
    if isinstance(joint, Spherical):
        rates = 0.5 * product(q, np.array([0.0, *qd]))
        second_rates = 0.5 * (product(rates, np.array([0.0, *qd])) + product(q, np.array([0.0, *qdd])))
    places = [k for k, key in enumerate(("px", "py", "rz")) if not moved or key in moved]
    places = places if moved else list(range(len(q)))
    others = [k for k in range(len(qd)) if k not in places]
    constant: Any = drawing.blocks.pop(f"{name} tau")
    torque = np.atleast_1d(np.asarray(constant.value, dtype=float))
    drawing.wires.remove((f"{name} tau/y", f"{name}/tau"))

    def signal(values: Array) -> Any:
        chosen = values[places]
        return chosen if moved or len(chosen) > 1 else float(chosen[0])

    drawing.blocks |= {
        name: replace(
            block,
            actuation="torque" if moved else "motion",
            moved=moved,
            sense_actuator=True,
            sense_acceleration=True,
        ),
        f"{name} qdd": Constant(value=signal(second_rates)),
        f"{name} qd": Integrator(initial=signal(rates)),
        f"{name} q": Integrator(initial=signal(q)),
    }
    drawing.wires += [(f"{name} qdd/y", f"{name} qd/u"), (f"{name} qd/y", f"{name} q/u")]
    drawing.wires.append((f"{name} q/y", f"{name}/motion"))
    if moved:
        drawing.blocks[f"{name} tau"] = Constant(value=torque[others])
        drawing.wires.append((f"{name} tau/y", f"{name}/tau"))


def signals(diagram: Diagram, tuned: Mapping[str, Any] | None = None) -> dict[str, Array]:
    """The signals at the start by path; ``tuned``: other parameters, without other equations."""
    system = trace_diagram(diagram)
    p = system.parameter_values.copy()
    changed = tuned_parameters(diagram, with_parameters(diagram, dict(tuned or {})))
    assert changed is not None
    for name, value in changed.items():
        p[system.parameters.ranges[name]] = np.ravel(value)
    (x,), (z,) = system.initial_states(p), system.initial_discrete(p)
    (values,) = system.signals(0.0, x, z, (), p)
    return {slot: values[part] for slot, part in system.signals_layout.ranges.items()}


def heavier(robot: Robot) -> tuple[Robot, dict[str, Any]]:
    """A robot with other masses and moments, and the parameters of the drawn bodies."""
    links = [
        replace(link, mass=(1.3 + 0.2 * k) * link.mass, inertia=np.add(link.inertia, 0.03 * np.eye(3)))
        for k, link in enumerate(robot.links)
    ]
    tuned = {f"{link.name} body.mass": link.mass for link in links}
    tuned |= {f"{link.name} body.moments": np.diag(link.inertia) for link in links}
    return replace(robot, links=tuple(links)), tuned


def motion_of(drawing: Drawing, found: dict[str, Array], q: dict[str, Array], port: str) -> Array:
    """The accelerations or torques of all joints, with the signs of the robot."""
    rates = {f"{link.name}/qd": np.atleast_1d(found[f"{link.name}/{port}"]) for link in drawing.robot.links}
    return drawing.accelerations(rates, q)


@pytest.mark.parametrize(
    ("seed", "letters", "driven"),
    [(1, "RPRR", "0 2"), (3, "SRE", "0"), (6, "ESP", "0px,rz 2"), (2, "FR", "")],
)
def test_the_torques_of_drives_cause_the_given_motion_of_the_same_robot(
    seed: int, letters: str, driven: str
) -> None:
    """Forward dynamics of the robot under the torques of drives and all others, also with tuned masses."""
    random = np.random.default_rng(seed)
    links = [
        random_link(random, f"j{k}", None if k == 0 else f"j{random.integers(k)}", TYPES[letter][0]())
        for k, letter in enumerate(letters)
    ]
    robot = Robot(name="tree", links=tuple(links), gravity=(1.0, 2.0, -9.0))
    states = {link.name: random_state(random, link.joint) for link in links}
    drawing = Drawing(robot, random)
    for link, letter in zip(links, letters):
        drawing.add(link, TYPES[letter][1], *states[link.name], sense_actuator=True, sense_acceleration=True)
    chosen = [(int(text[0]), text[1:]) for text in driven.split()]
    given: dict[str, Array] = {}
    for k, moved in chosen:
        given[f"j{k}"] = random.normal(size=links[k].joint.nv)
        drive(drawing, f"j{k}", links[k].joint, given[f"j{k}"], moved)
    diagram, by_joint = drawing.diagram(), {name: state[0] for name, state in states.items()}
    q, qd = (np.concatenate([states[link.name][k] for link in links]) for k in range(2))
    for of_values, tuned in ((robot, {}), heavier(robot)):
        found = signals(diagram, tuned)
        qdd, tau = (motion_of(drawing, found, by_joint, port) for port in ("qdd", "actuator"))
        (expected,) = dynamics.trace_accel(of_values)(q, qd, tau)
        np.testing.assert_allclose(qdd, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
        first = 0
        for link in links:
            if link.name in given:
                moved = dict(chosen)[int(link.name[1:])]
                places = [k for k, key in enumerate(("px", "py", "rz")) if key in moved]
                for k in places or range(link.joint.nv):
                    assert qdd[first + k] == pytest.approx(given[link.name][k], abs=1e-12)
            first += link.joint.nv


def drawn_four_bar(motion: Block | None, **crank: Any) -> tuple[Drawing, Robot, Array]:
    """The four-bar of the tests with a motion input at its crank, and its assembled coordinates."""
    random = np.random.default_rng(5)
    robot, q = four_bar(random)
    drawing = Drawing(robot, random)
    for k, link in enumerate(robot.links):
        drawing.add(link, RevoluteJoint, q[k : k + 1], np.zeros(1), np.zeros(1))
    closure = robot.closures[0]
    drawing.blocks |= {"ground": rigid(closure.first.pose), "tip": rigid(closure.second.pose)}
    drawing.blocks["pin"] = RevoluteJoint()
    drawing.lines += [("world/W", "ground/B"), ("ground/F", "pin/B")]
    drawing.lines += [("pin/F", "tip/F"), ("tip/B", "bar2 after/F")]
    if motion is not None:
        drawing.blocks |= {
            "bar0": RevoluteJoint(actuation="motion", sense_actuator=True, **crank),
            "motion": motion,
            "sign": Gain(gain=-1.0 if drawing.flipped["bar0"] else 1.0),
        }
        drawing.blocks.pop("bar0 tau")
        drawing.wires.remove(("bar0 tau/y", "bar0/tau"))
        drawing.wires += [("motion/y", "sign/u"), ("sign/y", "bar0/motion")]
    return drawing, robot, q


def driven_arm(robot: Robot, motion: Block, q: Array) -> Diagram:
    """A four-bar as a robot with the given motion of its crank."""
    builder = ab.DiagramBuilder("arm")
    torques = builder.add("tau", Constant(value=(0.0, 0.0)))
    vector = builder.add("vector", Gain(gain=(1.0,)), builder.add("motion", motion))
    builder.add("arm", PositionDrivenArm(robot=robot, joints="bar0", q0=q.tolist()), vector, torques)
    return builder.build()


def test_a_loop_moves_as_the_arm_with_given_positions_and_stays_closed() -> None:
    """Drawn four-bar and PositionDrivenArm; the crank has no target, its start follows from the input."""
    motion = Ramp(slope=3.0, initial=1.0)
    drawing, robot, _ = drawn_four_bar(motion)
    settings: Any = {"stop_time": 1.5, "sample_time": 0.05, "rtol": 1e-9, "atol": 1e-10}
    drawn = ab.simulate(drawing.diagram(), **settings)
    q = mechanism(robot).assembled(np.array([1.0, -0.5, -1.5]), ["bar0"])
    expected = ab.simulate(driven_arm(robot, motion, q), **settings)
    sign = -1.0 if drawing.flipped["bar0"] else 1.0
    np.testing.assert_allclose(sign * drawn["bar0/actuator"], expected["arm/drive"][:, 0], atol=1e-6)
    for k in (1, 2):
        other = -1.0 if drawing.flipped[f"bar{k}"] else 1.0
        np.testing.assert_allclose(other * drawn[f"bar{k}/q"], expected["arm/q"][:, k], atol=1e-7)
    other_robot, tuned = heavier(robot)
    at_start = signals(driven_arm(other_robot, motion, q))["arm/drive"]
    assert abs(at_start[0] - expected["arm/drive"][0, 0]) > 0.5
    np.testing.assert_allclose(sign * signals(drawing.diagram(), tuned)["bar0/actuator"], at_start, rtol=1e-9)


def test_the_drive_of_a_pendulum_overcomes_inertia_gravity_spring_and_damper() -> None:
    builder = pendulum(actuation="motion", sense_actuator=True, spring_stiffness=3.0, damping_coefficient=0.2)
    builder.connect(builder.add("sine", SineWave(amplitude=0.5, frequency=3.0)), builder["hinge"]["motion"])
    result = ab.simulate(builder.build(), stop_time=1.0, sample_time=0.1)
    q, qd = 0.5 * np.sin(3.0 * result.time), 1.5 * np.cos(3.0 * result.time)
    torque = -9.0 * INERTIA * q + 2.0 * 9.81 * 0.5 * np.sin(q) + 3.0 * q + 0.2 * qd
    np.testing.assert_allclose(result["hinge/q"], q, atol=1e-15)
    np.testing.assert_allclose(result["hinge/actuator"], torque, atol=1e-12)


def test_actuation_of_loops_beyond_their_freedom_is_refused() -> None:
    drawing, _, _ = drawn_four_bar(Constant(value=1.0))
    drawing.blocks["bar1"] = RevoluteJoint(actuation="motion")
    drawing.wires = [("sign/y", "bar1/motion") if wire[1] == "bar1/tau" else wire for wire in drawing.wires]
    drawing.blocks.pop("bar1 tau")
    message = (
        r"motion inputs at 'bar0', 'bar1' give 2 coordinates, but the loops leave the mechanism 1 degree"
    )
    with pytest.raises(DiagramError, match=message):
        drawing.diagram()


def test_a_drive_at_a_dead_point_is_refused() -> None:
    """The crank of 0.3 m and the bar of 0.9 m in one line: the last bar cannot be moved through it."""
    drawing, robot, _ = drawn_four_bar(None)
    q = mechanism(robot).assembled(np.array([0.5, 0.0, -2.0]), ["bar1"])
    for k in range(3):
        name = f"bar{k}"
        value = -q[k] if drawing.flipped[name] else q[k]
        drawing.blocks[name] = replace(drawing.blocks[name], position_target=float(value))
    drawing.blocks["pin"] = RevoluteJoint(actuation="motion")
    drawing.blocks["motion"] = Constant(value=float(q.sum()))
    drawing.wires.append(("motion/y", "pin/motion"))
    with pytest.raises(DiagramError, match=r"do not permit independent motions of the joints .* 'pin'"):
        drawing.diagram()


def test_motions_that_loops_cannot_follow_are_errors_that_name_the_joint() -> None:
    """The last bar of the four-bar is a rocker: it cannot turn by 3 rad."""
    drawing, _, q = drawn_four_bar(None)
    sign = -1.0 if drawing.flipped["bar0"] else 1.0
    drawing.blocks["pin"] = RevoluteJoint(actuation="motion")
    drawing.blocks["bar0"] = replace(
        drawing.blocks["bar0"], position_target=sign * float(q[0]), actuation="torque"
    )
    drawing.blocks["motion"] = Ramp(slope=3.0, initial=float(q.sum()))
    drawing.wires.append(("motion/y", "pin/motion"))
    with pytest.raises(
        SimulationError, match=r"the loops of the mechanism cannot follow the motion input at"
    ):
        ab.simulate(drawing.diagram(), stop_time=2.0)
    drawing.blocks["motion"] = Bias(bias=float(q.sum()) + 1.6)
    drawing.blocks["zero"] = Constant(value=0.0)
    drawing.wires.append(("zero/y", "motion/u"))
    message = r"the loops of the mechanism cannot reach the start of the motion input at 'pin'; the largest"
    with pytest.raises(DiagramError, match=message):
        drawing.diagram()


def test_wrong_names_of_moved_coordinates_are_refused() -> None:
    with pytest.raises(InputError, match=r"the joint has no coordinate 'rx'.*px, py, rz"):
        PlanarJoint(actuation="motion", moved="px, rx")
    with pytest.raises(InputError, match=r"the joint has no coordinate 'z'.*an empty text"):
        RevoluteJoint(actuation="motion", moved="z")
    with pytest.raises(InputError, match=r"moved names 'px', but the actuation is none"):
        PlanarJoint(moved="px")
    ports = SixDofJoint(actuation="torque", moved="rotation, pz").input_ports()
    assert [port.names for port in ports] == [("pz", "qw", "qx", "qy", "qz"), ("px", "py")]
