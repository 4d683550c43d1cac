"""Force elements and sensors of drawn mechanisms have the forces of robots and exact derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import GRAVITY, TYPES, Drawing, pendulum, random_link, random_pose, random_state, rigid, started

import armblocks as ab
from armblocks import dynamics
from armblocks.blocks import (
    BodyInertia,
    Constant,
    Derivative,
    ExternalForceAndTorque,
    InternalForce,
    RevoluteJoint,
    SpringAndDamperForce,
    TransformSensor,
    WorldFrame,
)
from armblocks.diagram import DiagramBuilder, trace_diagram
from armblocks.errors import DiagramError, InputError
from armblocks.robot import Attachment, LineSpring, Robot
from armblocks.spatial import Transform

SEED = 11


def drawn_chain(letters: str = "RSP") -> tuple[Drawing, Robot, dict[str, tuple[np.ndarray, ...]]]:
    """A random chain, as a robot and as a drawing, and its state by joint: q, qd, tau."""
    random = np.random.default_rng(SEED)
    links = [
        random_link(random, f"j{k}", f"j{k - 1}" if k else None, TYPES[letter][0]())
        for k, letter in enumerate(letters)
    ]
    robot = Robot(name="chain", links=tuple(links), gravity=GRAVITY)
    drawing = Drawing(robot, random)
    states = {link.name: random_state(random, link.joint) for link in links}
    for link, letter in zip(links, letters):
        drawing.add(link, TYPES[letter][1], *states[link.name])
    return drawing, robot, states


def columns(robot: Robot, states: dict[str, tuple[np.ndarray, ...]]) -> list[np.ndarray]:
    return [np.concatenate([states[link.name][k] for link in robot.links]) for k in range(3)]


@pytest.mark.parametrize("resolution", ["attached", "world"])
def test_an_external_force_and_torque_have_the_effect_of_a_wrench_at_the_tip(resolution: str) -> None:
    drawing, robot, states = drawn_chain()
    q, qd, tau = columns(robot, states)
    force, torque = np.array([3.0, -2.0, 5.0]), np.array([0.4, 0.7, -0.3])
    poses = dynamics.trace_link_poses(robot)(q)[0]
    R = poses[len(robot.links), :3, :3] if resolution == "world" else np.eye(3)
    drawing.blocks |= {
        "load": ExternalForceAndTorque(torque=True, resolution=resolution),
        "force": Constant(value=R @ force),
        "torque": Constant(value=R @ torque),
    }
    drawing.lines.append(("load/F", f"{robot.links[-1].name} after/F"))
    drawing.wires += [("force/y", "load/force"), ("torque/y", "load/torque")]
    _, rates = started(drawing.diagram())
    on_surroundings = np.concatenate([-force, -torque])
    (expected,) = dynamics.trace_accel_loaded(robot)(q, qd, tau, on_surroundings, np.zeros(10))
    found = drawing.accelerations(rates, {name: state[0] for name, state in states.items()})
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("kind", ["spring", "given force"])
def test_a_spring_between_two_bodies_is_that_of_the_robot(kind: str) -> None:
    drawing, robot, states = drawn_chain("RRP")
    q, qd, tau = columns(robot, states)
    at = random_pose(np.random.default_rng(3))
    first, second = Attachment(link="j0", pose=at), Attachment(link="j2")
    spring = LineSpring(name="spring", first=first, second=second, stiffness=40.0, length=0.3)
    sprung = ab.Robot(name="sprung", links=robot.links, gravity=GRAVITY, springs=(spring,))
    drawing.blocks["at"] = rigid(at)
    if kind == "spring":
        drawing.blocks["force"] = SpringAndDamperForce(spring_stiffness=40.0, natural_length=0.3)
    else:
        poses = dynamics.trace_link_poses(robot)(q)[0]
        ends = poses[1] @ at.matrix, poses[3]
        distance = np.linalg.norm(ends[1][:3, 3] - ends[0][:3, 3])
        drawing.blocks |= {"force": InternalForce(), "f": Constant(value=-40.0 * (distance - 0.3))}
        drawing.wires.append(("f/y", "force/f"))
    drawing.lines += [("j0 after/F", "at/B"), ("at/F", "force/B"), ("force/F", "j2 after/F")]
    _, rates = started(drawing.diagram())
    (expected,) = dynamics.trace_accel(sprung)(q, qd, tau)
    np.testing.assert_allclose(drawing.accelerations(rates, {}), expected, rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("frame", ["world", "base"])
def test_velocities_and_accelerations_of_a_sensor_are_the_derivatives_of_its_position(frame: str) -> None:
    drawing, robot, states = drawn_chain()
    q = columns(robot, states)[0]
    drawing.blocks |= {
        "sensor": TransformSensor(
            measurement_frame=frame,
            sense_velocity=True,
            sense_acceleration=True,
            sense_rotation=True,
            sense_angular_velocity=True,
            sense_angular_acceleration=True,
            sense_distance=True,
        ),
        "rate": Derivative(),
        "second rate": Derivative(),
        "turning rate": Derivative(),
    }
    drawing.lines += [("j0 after/F", "sensor/B"), ("j2 after/F", "sensor/F")]
    drawing.wires += [("sensor/p", "rate/u"), ("sensor/v", "second rate/u"), ("sensor/w", "turning rate/u")]
    system = trace_diagram(drawing.diagram())
    p = system.parameter_values
    (x,), (z,) = system.initial_states(p), system.initial_discrete(p)
    signals = system.signals_layout.unpack(system.signals(0.0, x, z, (), p)[0])
    close = {"rtol": 1e-9, "atol": 1e-9}
    np.testing.assert_allclose(signals["sensor/v"], signals["rate/y"], **close)
    np.testing.assert_allclose(signals["sensor/a"], signals["second rate/y"], **close)
    np.testing.assert_allclose(signals["sensor/alpha"], signals["turning rate/y"], **close)
    poses = dynamics.trace_link_poses(robot)(q)[0]
    relative = np.linalg.inv(poses[1]) @ poses[3]
    np.testing.assert_allclose(signals["sensor/R"], relative[:3, :3], atol=1e-12)
    expected = relative[:3, 3] if frame == "base" else poses[3][:3, 3] - poses[1][:3, 3]
    np.testing.assert_allclose(signals["sensor/p"], expected, atol=1e-12)
    assert signals["sensor/d"] == pytest.approx(np.linalg.norm(expected))


def test_the_energy_of_a_closed_loop_with_springs_is_constant() -> None:
    """A parallelogram linkage of two pendulums and a coupler, with a spring across its diagonal."""
    builder = DiagramBuilder("parallelogram")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", ab.blocks.MechanismConfiguration(gravity=(0.0, -9.81, 0.0)), C=world)
    side = builder.add("side", rigid(Transform(translation=(1.0, 0.0, 0.0))), B=world)
    ends = []
    for name, at in (("left", world), ("right", side["F"])):
        joint = builder.add(f"{name} pin", RevoluteJoint(position_target=0.4), B=at)
        rod = builder.add(f"{name} rod", rigid(Transform(translation=(0.0, -0.6, 0.0))), B=joint["F"])
        builder.add(f"{name} mass", BodyInertia(mass=1.5), R=rod["F"])
        ends.append(builder.add(f"{name} end", RevoluteJoint(), B=rod["F"])["F"])
    coupler = builder.add("coupler", rigid(Transform(translation=(1.0, 0.0, 0.0))), B=ends[0], F=ends[1])
    builder.add("coupler mass", BodyInertia(mass=2.0, moments=(0.1, 0.1, 0.1)), R=coupler["B"])
    builder.add("spring", SpringAndDamperForce(spring_stiffness=30.0), B=world, F=coupler["F"])
    result = ab.simulate(builder.build(), stop_time=2.0, rtol=1e-10, atol=1e-10)
    q, qd = result["left pin/q"], result["left pin/qd"]
    corner = np.stack([0.6 * np.sin(q) + 1.0, -0.6 * np.cos(q)])
    energy = 0.5 * 5.0 * 0.36 * qd**2 - 5.0 * 9.81 * 0.6 * np.cos(q) + 0.5 * 30.0 * (corner**2).sum(axis=0)
    assert np.ptp(q) > 0.1
    np.testing.assert_allclose(energy, energy[0], atol=1e-7)


def test_sensors_and_forces_without_purpose_are_refused() -> None:
    with pytest.raises(InputError, match="there is neither a force nor a torque"):
        ExternalForceAndTorque(force=False)
    with pytest.raises(InputError, match="the sensor has no output"):
        TransformSensor(sense_position=False)
    builder = DiagramBuilder("static")
    world = builder.add("world", WorldFrame())
    builder.add("sensor", TransformSensor(), B=world, F=world)
    with pytest.raises(DiagramError, match=r"block 'sensor' \(Transform Sensor\): no joint of the mechanism"):
        builder.build()
    builder = pendulum()
    builder.add("ball", BodyInertia())
    builder.add("band", SpringAndDamperForce(), B=builder["rod"]["F"], F=builder["ball"])
    with pytest.raises(DiagramError, match="no chain of joints and rigid connections leads from the"):
        builder.build()
