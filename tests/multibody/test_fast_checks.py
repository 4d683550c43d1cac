"""Checks of diagrams do not trace the equations of mechanisms, and find the same faults."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from drawings import TYPES, Drawing, four_bar, pendulum, random_link, random_state, rigid

from armblocks.blocks import (
    BodyInertia,
    Constant,
    DiscreteTransferFunction,
    Gain,
    PrismaticJoint,
    RevoluteJoint,
    RigidTransform,
    TransformSensor,
)
from armblocks.diagram import Diagram, DiagramBuilder, flat_diagram, infer_shapes
from armblocks.diagram import model as analysis
from armblocks.diagram.block_equations import block_equations
from armblocks.diagram.features import SlotKind
from armblocks.dynamics.base_parameters import regrouped
from armblocks.dynamics.forward import check_accelerations_exist
from armblocks.errors import RobotError
from armblocks.multibody import gathering
from armblocks.multibody.mechanism import Mechanism
from armblocks.multibody.moving_masses import every_joint_moves_mass
from armblocks.robot import Robot
from armblocks.robot.tree import KinematicTree
from armblocks.studio.sheet.check import check


def from_own_acceleration() -> DiagramBuilder:
    """A motion input that depends on the acceleration of its own joint."""
    builder = pendulum(actuation="motion", sense_acceleration=True)
    builder.connect(builder.add("gain", Gain(gain=0.5), builder["hinge"]["qdd"]), builder["hinge"]["motion"])
    return builder


def loop_at_ticks() -> DiagramBuilder:
    builder = pendulum(actuation="torque", sense_acceleration=True)
    direct = DiscreteTransferFunction(numerator=(1.0, 0.5), denominator=(1.0, -0.5), sample_time=0.1)
    builder.connect(builder.add("filter", direct, builder["hinge"]["qdd"]), builder["hinge"]["tau"])
    return builder


def wrong_shape() -> DiagramBuilder:
    builder = pendulum(actuation="torque")
    builder.connect(builder.add("three", Constant(value=(1.0, 2.0, 3.0))), builder["hinge"]["tau"])
    return builder


def no_mass() -> DiagramBuilder:
    builder = pendulum()
    builder.add("slide", PrismaticJoint(), B=builder["rod"]["F"])
    return builder


def point_on_axis() -> DiagramBuilder:
    builder = pendulum()
    joint = builder.add("spin", RevoluteJoint(), B=builder["rod"]["F"])
    builder.add("point", BodyInertia(mass=1.0), R=joint["F"])
    return builder


def measured_motion() -> DiagramBuilder:
    """A motion input from the sensor of another part of the mechanism: no loop, although it seems to be."""
    builder = pendulum()
    side = builder.add("side", RigidTransform(translation=(1.0, 0.0, 0.0)), B=builder["world"]["W"])
    joint = builder.add("other", PrismaticJoint(actuation="motion", sense_actuator=True), B=side["F"])
    builder.add("load", BodyInertia(mass=1.0), R=joint["F"])
    sensor = builder.add(
        "sensor",
        TransformSensor(sense_position=False, sense_distance=True),
        B=builder["world"]["W"],
        F=builder["rod"]["F"],
    )
    builder.connect(sensor["d"], builder["other"]["motion"])
    return builder


DRAWINGS = [
    from_own_acceleration,
    loop_at_ticks,
    wrong_shape,
    no_mass,
    point_on_axis,
    measured_motion,
    pendulum,
]


@pytest.mark.parametrize("draw", DRAWINGS, ids=lambda draw: draw.__name__)
def test_findings_are_those_of_all_equations(
    draw: Callable[[], DiagramBuilder], monkeypatch: pytest.MonkeyPatch
) -> None:
    builder = draw()
    found = check(builder.draft())
    monkeypatch.setattr(analysis, "_known_equations", lambda *_: {})
    monkeypatch.setattr(gathering, "every_joint_moves_mass", lambda _: False)
    assert check(builder.draft()) == found
    assert bool(found[0]) == (draw not in (measured_motion, pendulum))


def test_known_dependences_contain_those_of_the_equations() -> None:
    """Trees of all joint types with a sensor, and a loop."""
    for seed, letters in enumerate(("RPSE", "UCR", "loop")):
        random = np.random.default_rng(seed)
        if letters == "loop":
            diagram = drawn_loop(random)
        else:
            robot = random_tree(random, letters)
            drawing = Drawing(robot, random)
            for link, letter in zip(robot.links, letters):
                drawing.add(link, TYPES[letter][1], *random_state(random, link.joint))
            end = f"{robot.links[-1].name} after/F"
            drawing.blocks["sensor"] = TransformSensor(sense_acceleration=True)
            drawing.lines += [("world/W", "sensor/B"), (end, "sensor/F")]
            diagram = drawing.diagram()
        flat, shapes = flat_diagram(diagram), infer_shapes(diagram)
        path, block = next(entry for entry in flat.blocks.items() if isinstance(entry[1], Mechanism))
        assert not analysis.diagram_model(diagram, traced=False).flow_order.loops
        known = block.known_dependences()
        for group in block_equations(block, shapes.inputs[path]).groups:
            for slot in group.slots:
                assert slot.kind in (SlotKind.OUTPUT, SlotKind.RECORD)
                assert set(group.inputs) <= set(known[slot.name]), slot.name


def drawn_loop(random: np.random.Generator) -> Diagram:
    robot, q = four_bar(random)
    drawing = Drawing(robot, random)
    for k, link in enumerate(robot.links):
        drawing.add(link, RevoluteJoint, q[k : k + 1], np.zeros(1), np.zeros(1))
    closure = robot.closures[0]
    drawing.blocks |= {"ground": rigid(closure.first.pose), "tip": rigid(closure.second.pose)}
    drawing.blocks["pin"] = RevoluteJoint()
    drawing.lines += [("world/W", "ground/B"), ("ground/F", "pin/B")]
    drawing.lines += [("pin/F", "tip/F"), ("tip/B", "bar2 after/F")]
    return drawing.diagram()


def random_tree(random: np.random.Generator, letters: str) -> Robot:
    links = [
        random_link(random, f"j{k}", None if k == 0 else f"j{random.integers(k)}", TYPES[letter][0]())
        for k, letter in enumerate(letters)
    ]
    return Robot(name="tree", links=tuple(links))


def test_the_fast_condition_of_masses_holds_only_for_regular_inertia_matrices() -> None:
    """Random trees, some with small, flat or massless links."""
    random = np.random.default_rng(3)
    held = singular = 0
    for _ in range(20):
        robot = random_tree(random, "".join(random.choice(list("RPCSUEF"), size=3)))
        links = list(robot.links)
        place, kind = random.integers(3), random.integers(5)
        scale = 10.0 ** -random.integers(0, 20)
        rod = np.outer(*(2 * [random.normal(size=3)]))
        changed = (
            {},
            {"mass": 0.0, "inertia": np.zeros((3, 3))},
            {"inertia": np.zeros((3, 3)), "centre_of_mass": np.zeros(3)},
            {"inertia": np.trace(rod) * np.eye(3) - rod},
            {"mass": scale * links[place].mass, "inertia": scale * np.asarray(links[place].inertia)},
        )[kind]
        links[place] = replace(links[place], **changed)
        robot = replace(robot, links=tuple(links))
        try:
            check_accelerations_exist(regrouped(KinematicTree.of(robot)))
            regular = True
        except RobotError:
            regular, singular = False, singular + 1
        assert regular or not every_joint_moves_mass(robot)
        held += every_joint_moves_mass(robot)
    assert held >= 5
    assert singular >= 1
