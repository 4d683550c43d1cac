"""Gear Constraint and Rack and Pinion Constraint: directions, closed forms, energy, refusals."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from drawings import random_pose, rigid, started

import armblocks as ab
from armblocks.blocks import (
    BodyInertia,
    Constant,
    GearConstraint,
    MechanismConfiguration,
    PrismaticJoint,
    RackAndPinionConstraint,
    RevoluteJoint,
    RigidTransform,
    WorldFrame,
)
from armblocks.diagram import DiagramBuilder, PortRef
from armblocks.errors import DiagramError, InputError
from armblocks.spatial import Transform, rotation_x

HALF_TURN = Transform(rotation=rotation_x(math.pi))
RATIO, J1, J2 = 2.5, 0.03, 0.4


@pytest.mark.parametrize(
    ("gear_type", "opposite", "reverse"),
    [
        ("external", False, False),
        ("internal", True, False),
        ("external", True, True),
        ("internal", False, True),
    ],
)
def test_gears_turn_as_their_teeth_on_a_turning_carrier(
    gear_type: str, opposite: bool, reverse: bool
) -> None:
    """Lagrange's equations of carrier c and gear a: the other gear turns by -a / ratio relative to c.

    The joint of the second gear has the opposite axis, or its base at the gear, without another motion.
    """
    builder = DiagramBuilder("planet")
    world = builder.add("world", WorldFrame())
    carrier = builder.add("carrier", RevoluteJoint(position_target=0.3, velocity_target=0.2), B=world)
    builder.add("arm", BodyInertia(mass=1.0, moments=(0.5,) * 3), R=carrier["F"])
    first = builder.add("first", RevoluteJoint(actuation="torque", velocity_target=2.0), B=carrier["F"])
    builder.connect(builder.add("torque", Constant(value=0.7)), first["tau"])
    builder.add("first gear", BodyInertia(mass=2.0, moments=(J1,) * 3), R=first["F"])
    turned = HALF_TURN if opposite else Transform()
    place = rigid(Transform(translation=(0.6, 0.0, 0.0)) @ turned)
    place = builder.add("place", place, B=carrier["F"])
    second = builder.add("second", RevoluteJoint(), **{"F" if reverse else "B": place["F"]})
    body = second["B" if reverse else "F"]
    builder.add("second gear", BodyInertia(mass=3.0, moments=(J2,) * 3), R=body)
    back = builder.add("off the axis", rigid(Transform(translation=(0.1, 0.2, 0.3)) @ turned), B=body)
    gear = GearConstraint(gear_type=gear_type, ratio=RATIO)
    builder.add("gears", gear, B=first["F"], F=back["F"])
    x, rates = started(builder.build())
    n = (1.0 if gear_type == "internal" else -1.0) / RATIO
    M = np.array([[0.5 + J1 + 3.0 * 0.36 + J2, J1 + n * J2], [J1 + n * J2, J1 + n * n * J2]])
    found = [rates["carrier/qd"][0], rates["first/qd"][0]]
    np.testing.assert_allclose(found, np.linalg.solve(M, [0.0, 0.7]), rtol=1e-12)
    assert {name.split("/")[0] for name in x} == {"carrier", "first"}
    run = ab.simulate(builder.build(), stop_time=0.3, sample_time=0.1)
    sign = (-1.0 if opposite else 1.0) * (-1.0 if reverse else 1.0)
    np.testing.assert_allclose(run["second/q"], sign * n * run["first/q"], atol=1e-14)


@pytest.mark.parametrize(("seed", "side"), [(0, "left"), (1, "right"), (2, "left")])
def test_a_rack_follows_the_pitch_point_of_its_pinion(seed: int, side: str) -> None:
    """The displacement of the rack is angle (axis x radius vector), in any pose of the mechanism."""
    random = np.random.default_rng(seed)
    pinion, radius = random_pose(random), 0.2
    phi, depth, along = random.uniform(-3.0, 3.0, 3)
    r = radius * np.array([math.cos(phi), math.sin(phi), 0.0])
    z = np.cross([0.0, 0.0, 1.0], r / radius) * (1.0 if side == "left" else -1.0)
    x = r / radius
    rail = pinion @ Transform(
        rotation=np.column_stack((x, np.cross(z, x), z)), translation=r + [0.0, 0.0, depth] + along * z
    )
    builder = DiagramBuilder("rack")
    world = builder.add("world", WorldFrame())
    at_pinion, at_rail = (
        builder.add(name, rigid(pose), B=world) for name, pose in (("at pinion", pinion), ("at rail", rail))
    )
    shaft = builder.add("shaft", RevoluteJoint(position_target=0.3), B=at_pinion["F"])
    slider = builder.add("slider", PrismaticJoint(), B=at_rail["F"])
    builder.add("pinion", BodyInertia(mass=1.0, moments=(0.1,) * 3), R=shaft["F"])
    builder.add("rack", BodyInertia(mass=2.0, moments=(0.1,) * 3), R=slider["F"])
    mesh = RackAndPinionConstraint(radius=radius, offset=0.05)
    builder.add("mesh", mesh, B=shaft["F"], F=slider["F"])
    run = ab.simulate(builder.build(), stop_time=0.1)
    moved = 0.05 * rail.R[:, 2] + 0.3 * np.cross(pinion.R[:, 2], pinion.R @ r)
    np.testing.assert_allclose(run["slider/q"][-1] * rail.R[:, 2], moved, atol=1e-12)


def hoist() -> DiagramBuilder:
    """A motor shaft drives a pinion by gears of ratio 4; the rack of 2 kg hangs in gravity along -y."""
    builder = DiagramBuilder("hoist")
    world = builder.add("world", WorldFrame())
    builder.add("gravity", MechanismConfiguration(gravity=(0.0, -9.81, 0.0)), C=world)
    motor = builder.add("motor", RevoluteJoint(sense_position=True, velocity_target=3.0), B=world)
    place = builder.add("place", RigidTransform(translation=(0.5, 0.0, 0.0)), B=world)
    shaft = builder.add("shaft", RevoluteJoint(), B=place["F"])
    guide = RigidTransform(
        translation=(0.1, 0.0, 0.0), rotation="standard_axis", axis="x", angle=-math.pi / 2
    )
    guide = builder.add("guide", guide, B=place["F"])
    slider = builder.add("slider", PrismaticJoint(sense_position=True), B=guide["F"])
    for name, joint, moment in (("rotor", motor, 0.001), ("pinion", shaft, 0.01), ("rack", slider, 0.1)):
        builder.add(f"{name} body", BodyInertia(mass=2.0, moments=(moment,) * 3), R=joint["F"])
    builder.add("gears", GearConstraint(ratio=4.0), B=motor["F"], F=shaft["F"])
    builder.add("mesh", RackAndPinionConstraint(radius=0.1), B=shaft["F"], F=slider["F"])
    return builder


def test_a_hoist_of_gears_and_rack_has_its_closed_form_and_keeps_its_energy() -> None:
    """One coordinate: the rack rises by -0.1 / 4 m per radian of the motor."""
    run = ab.simulate(hoist().build(), stop_time=1.0, sample_time=0.1)
    effective = 0.001 + 0.01 / 16.0 + 2.0 * 0.025**2
    acceleration = 2.0 * 9.81 * 0.025 / effective
    np.testing.assert_allclose(run["motor/q"], 3.0 * run.time + 0.5 * acceleration * run.time**2, rtol=1e-9)
    np.testing.assert_allclose(run["slider/q"], -0.025 * run["motor/q"], rtol=1e-12)
    energy = 0.5 * effective * run["motor/qd"] ** 2 + 2.0 * 9.81 * run["slider/q"]
    np.testing.assert_allclose(energy, energy[0], atol=1e-8)


def _cross_axes(builder: DiagramBuilder) -> None:
    builder.add("bevel", GearConstraint(), B=builder["motor"]["F"], F=_beside(builder)["F"])


def _beside(builder: DiagramBuilder) -> Any:
    """The follower of a revolute joint about x."""
    turn = RigidTransform(rotation="standard_axis", axis="y", angle=math.pi / 2)
    turn = builder.add("turn", turn, B=builder["world"]["W"])
    other = builder.add("across", RevoluteJoint(), B=turn["F"])
    builder.add("body", BodyInertia(mass=1.0, moments=(1.0,) * 3), R=other["F"])
    return other


def _rack_along_the_axis(builder: DiagramBuilder) -> None:
    slider = builder.add("along", PrismaticJoint(), B=builder["place"]["F"])
    builder.add("body", BodyInertia(mass=1.0, moments=(1.0,) * 3), R=slider["F"])
    builder.add("wrong", RackAndPinionConstraint(), B=builder["shaft"]["F"], F=slider["F"])


def _wrong_radius(builder: DiagramBuilder) -> None:
    mesh = RackAndPinionConstraint(radius=0.12)
    builder.add("wrong", mesh, B=builder["shaft"]["F"], F=builder["slider"]["F"])


def _gear_on_rack(builder: DiagramBuilder) -> None:
    builder.add("wrong", GearConstraint(), B=builder["shaft"]["F"], F=builder["slider"]["F"])


def _gear_on_one_body(builder: DiagramBuilder) -> None:
    builder.add("wrong", GearConstraint(), B=builder["shaft"]["F"], F=builder["shaft"]["F"])


def _gear_to_another_mechanism(builder: DiagramBuilder) -> None:
    lone = builder.add("lone", BodyInertia(mass=1.0))
    builder.add("wrong", GearConstraint(), B=builder["shaft"]["F"], F=lone["R"])


def _gear_to_another_carrier(builder: DiagramBuilder) -> None:
    far = builder.add("far", RevoluteJoint(), B=builder["motor"]["F"])
    builder.add("body", BodyInertia(mass=1.0, moments=(1.0,) * 3), R=far["F"])
    builder.add("wrong", GearConstraint(), B=builder["shaft"]["F"], F=far["F"])


@pytest.mark.parametrize(
    ("add", "message"),
    [
        (_cross_axes, r"'bevel'.*the axes of the two gears are not parallel"),
        (_rack_along_the_axis, r"'wrong'.*does not move at a right angle to the axis of the pinion"),
        (_wrong_radius, r"'wrong'.*the rack is 100 mm from the axis of the pinion, whose radius is 120 mm"),
        (_gear_on_rack, r"'wrong'.*no body carries both a revolute joint to the body of frame B and a rev"),
        (_gear_on_one_body, r"'wrong'.*no body carries both a revolute joint"),
        (_gear_to_another_mechanism, r"'wrong'.*no body carries both a revolute joint"),
        (_gear_to_another_carrier, r"'wrong'.*no body carries both a revolute joint"),
    ],
)
def test_gears_and_racks_that_cannot_mesh_are_refused_by_name(
    add: Callable[[DiagramBuilder], None], message: str
) -> None:
    builder = hoist()
    add(builder)
    with pytest.raises(DiagramError, match=message):
        builder.build()


def test_ratio_and_radius_are_positive() -> None:
    with pytest.raises(InputError, match=r"ratio"):
        GearConstraint(ratio=0.0)
    with pytest.raises(InputError, match=r"radius"):
        RackAndPinionConstraint(radius=-0.1)


def test_a_joint_that_closes_a_loop_may_carry_a_gear() -> None:
    """A parallelogram whose fourth joint turns a wheel: the inertia of the wheel acts at all cranks."""
    builder = DiagramBuilder("parallelogram")
    world = builder.add("world", WorldFrame())
    beside = builder.add("beside", RigidTransform(translation=(1.0, 0.0, 0.0)), B=world)
    left = builder.add("left", RevoluteJoint(sense_velocity=True, velocity_target=2.0), B=world)
    right = builder.add("right", RevoluteJoint(), B=beside["F"])
    ends: list[PortRef] = []
    for name, joint in (("left", left), ("right", right)):
        builder.add(f"{name} crank", BodyInertia(mass=1.0, moments=(0.2,) * 3), R=joint["F"])
        end = builder.add(f"{name} end", RigidTransform(translation=(0.0, 0.5, 0.0)), B=joint["F"])
        ends.append(end["F"])
    rod = builder.add("rod", RevoluteJoint(), B=ends[0])
    builder.add("rod body", BodyInertia(mass=3.0, moments=(0.1,) * 3), R=rod["F"])
    far = builder.add("far", RigidTransform(translation=(1.0, 0.0, 0.0)), B=rod["F"])
    builder.add("pin", RevoluteJoint(), B=far["F"], F=ends[1])
    wheel = builder.add("wheel", RevoluteJoint(actuation="torque"), B=world)
    builder.add("wheel body", BodyInertia(mass=1.0, moments=(0.05,) * 3), R=wheel["F"])
    builder.connect(builder.add("torque", Constant(value=0.9)), wheel["tau"])
    builder.add("gears", GearConstraint(ratio=0.5), B=right["F"], F=wheel["F"])
    run = ab.simulate(builder.build(), stop_time=0.5, sample_time=0.1)
    acceleration = -2.0 * 0.9 / (0.2 + 0.2 + 3.0 * 0.25 + 4.0 * 0.05)
    start = run["left/qd"][0]
    np.testing.assert_allclose(run["left/qd"], start + acceleration * run.time, atol=1e-6)
    assert abs(start) > 0.1
