"""Errors of drawn mechanisms name the block, and state what to do."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from drawings import (
    Drawing,
    four_bar,
    pendulum,
    rigid,
    started,
)

import armblocks as ab
from armblocks.blocks import (
    BodyInertia,
    BrickSolid,
    ConnectionPort,
    Constant,
    EnabledSubsystem,
    Gain,
    MechanismConfiguration,
    PlanarJoint,
    ReferenceFrame,
    RevoluteJoint,
    RigidTransform,
    SphericalJoint,
    WorldFrame,
)
from armblocks.diagram import Block, Diagram, DiagramBuilder, PortRef, flat_diagram
from armblocks.errors import ArmblocksError, DiagramError, InputError


def mutated(*extra: tuple[str, Block], lines: tuple[tuple[str, str], ...] = ()) -> DiagramBuilder:
    """The pendulum with further blocks and lines."""
    builder = pendulum()
    for name, block in extra:
        builder.add(name, block)
    for ends in lines:
        builder.connect(*(PortRef(*end.split("/")) for end in ends))
    return builder


def wrong_mechanisms() -> Iterator[tuple[str, Callable[[], DiagramBuilder], str]]:
    turn = RigidTransform(rotation="standard_axis", angle=0.1, translation=(0.1, 0.0, 0.0))
    yield (
        "lonely body",
        lambda: mutated(("ball", BodyInertia())),
        r"block 'ball' \(Inertia\): the block has no frame line.*6-DOF Joint",
    )
    yield (
        "no world",
        lambda: mutated(("ball", BodyInertia()), ("elbow", RevoluteJoint()), lines=(("elbow/F", "ball/R"),)),
        r"block 'elbow' \(Revolute Joint\): the mechanism of 'ball', 'elbow' has no World Frame",
    )
    yield (
        "massless",
        lambda: mutated(("link of 2 m", RevoluteJoint()), lines=(("link of 2 m/B", "rod/F"),)),
        r"block 'link of 2 m' \(Revolute Joint\): no body with mass moves with the joint",
    )
    yield (
        "rigid joint",
        lambda: mutated(("elbow", RevoluteJoint()), lines=(("elbow/B", "rod/F"), ("elbow/F", "hinge/F"))),
        r"block 'elbow' \(Revolute Joint\): the base and the follower of the joint are on the same",
    )
    yield (
        "rigid loop",
        lambda: mutated(("turn", turn), lines=(("turn/B", "rod/B"), ("turn/F", "rod/F"))),
        r"rigid connections form a loop that does not close: a gap of .* mm and 5.73 deg remains",
    )
    yield (
        "two configurations",
        lambda: mutated(("g", MechanismConfiguration()), lines=(("g/C", "rod/F"),)),
        r"the mechanism has 2 Mechanism Configurations: g, gravity",
    )
    yield (
        "second world",
        lambda: mutated(("zero", WorldFrame()), lines=(("zero/W", "rod/F"),)),
        r"block 'zero' \(World Frame\): the frame differs from the World Frame 'world' of the",
    )


WRONG = {name: (build, message) for name, build, message in wrong_mechanisms()}


@pytest.mark.parametrize("name", WRONG)
def test_errors_of_mechanisms_name_the_block(name: str) -> None:
    build, message = WRONG[name]
    with pytest.raises(DiagramError, match=message):
        build().build()


def test_frame_ports_and_signal_ports_cannot_be_connected() -> None:
    builder = pendulum(sense_position=True, actuation="torque")
    builder.add("gain", Gain(gain=1.0))
    with pytest.raises(DiagramError, match=r"'hinge/B' is connected to 'gain', which is not a frame port"):
        builder.connect(builder["gain"], builder["hinge"]["B"])
    with pytest.raises(DiagramError, match=r"'world' is connected to 'hinge', which has several frame ports"):
        builder.connect(builder["world"], builder["hinge"])
    with pytest.raises(InputError, match=r"a line connects 'hinge/B' with itself"):
        builder.connect(builder["hinge"]["B"], builder["hinge"]["B"])


def test_bodies_are_not_in_conditional_subsystems_and_not_commented_through() -> None:
    inner = DiagramBuilder("inside")
    port = inner.add("port", ConnectionPort())
    inner.add("ball", BodyInertia(), R=port)
    builder = pendulum()
    block = EnabledSubsystem(diagram=inner.build())
    part = builder.add("part", block, enable=builder.add("on", Constant(value=1.0)))
    builder.connect(part["port"], builder["rod"]["F"])
    with pytest.raises(DiagramError, match=r"block 'part/ball' \(Inertia\): the block is in a conditional"):
        builder.build()
    with pytest.raises(DiagramError, match=r"a block with frame ports is commented through"):
        pendulum().comment_through("hinge")


def test_a_body_that_is_commented_out_has_no_mass() -> None:
    builder = pendulum(position_target=0.5)
    builder.add("ball", BodyInertia(mass=5.0), R=builder["rod"]["F"])
    heavy = builder.build()
    _, rates = started(ab.with_comments(heavy, {"ball": "out"}))
    _, expected = started(pendulum(position_target=0.5).build())
    np.testing.assert_array_equal(rates["hinge/qd"], expected["hinge/qd"])


def test_joints_at_a_body_that_is_commented_out_remain_connected() -> None:
    """The lines of both joints end at the body; without it, they are still at one frame."""

    def chain(*, ball: bool) -> Diagram:
        builder = pendulum(position_target=0.5)
        end = builder["rod"]["F"]
        if ball:
            end = builder.add("ball", BodyInertia(mass=5.0), R=end)
        elbow = builder.add("elbow", RevoluteJoint(), B=end)
        arm = builder.add("arm", RigidTransform(translation=(0.3, 0.0, 0.0)), B=elbow["F"])
        builder.add("tip", BodyInertia(), R=arm["F"])
        return builder.build()

    _, rates = started(ab.with_comments(chain(ball=True), {"ball": "out"}))
    _, expected = started(chain(ball=False))
    np.testing.assert_array_equal(rates["elbow/qd"], expected["elbow/qd"])


def test_conflicting_targets_name_the_joints() -> None:
    def bars(**targets: object) -> Diagram:
        random = np.random.default_rng(5)
        robot, q = four_bar(random)
        drawing = Drawing(robot, random)
        for k, link in enumerate(robot.links):
            drawing.add(link, RevoluteJoint, q[k : k + 1], np.zeros(1), np.zeros(1))
        for name, given in targets.items():
            drawing.blocks[name] = replace(drawing.blocks[name], **given)  # pyright: ignore[reportCallIssue]
        closure = robot.closures[0]
        drawing.blocks |= {"ground": rigid(closure.first.pose), "tip": rigid(closure.second.pose)}
        drawing.blocks["pin"] = RevoluteJoint()
        drawing.lines += [("world/W", "ground/B"), ("ground/F", "pin/B")]
        drawing.lines += [("pin/F", "tip/F"), ("tip/B", "bar2 after/F")]
        return drawing.diagram()

    high = {"position_target": 0.1, "position_priority": "high"}
    with pytest.raises(DiagramError, match=r"the position targets of high priority, at 'bar0', 'bar1', ca"):
        bars(bar0=high, bar1=high)
    fast = {"velocity_target": 1.0, "velocity_priority": "high"}
    with pytest.raises(DiagramError, match=r"the velocity targets of high priority, at 'bar0', 'bar1', di"):
        bars(bar0=fast, bar1=fast)


def test_a_loop_that_is_too_long_is_refused_at_its_joint() -> None:
    builder = pendulum()
    far = builder.add("far", RigidTransform(translation=(3.0, 0.0, 0.0)), B=builder["world"])
    builder.add("pin", RevoluteJoint(), B=far["F"], F=builder["rod"]["F"])
    message = r"the mechanism cannot be assembled: its loop does not close at this joint; the largest gap"
    with pytest.raises(DiagramError, match=message):
        builder.build()


def wrong_parameters() -> Iterator[tuple[Callable[[], Block], str]]:
    yield lambda: BrickSolid(dimensions=(1.0, 1.0)), r"the dimensions have shape \(2,\)"
    yield lambda: RigidTransform(translation=(1.0, 1.0)), r"translation has shape \(2,\)"
    yield lambda: RigidTransform(matrix=((1.0, 0.0), (0.0, 1.0))), r"the matrix has shape \(2, 2\)"
    yield (
        lambda: RigidTransform(rotation="arbitrary_axis", rotation_axis=(0.0, 0.0, 0.0)),
        r"the rotation axis is 0 0 0",
    )
    yield lambda: BodyInertia(moments=(1.0, 1.0)), r"moments has shape \(2,\)"
    yield lambda: BodyInertia(moments=(1.0, 1.0, 3.0)), r"the principal moments of inertia are 1, 1, 3 kg m2"
    yield lambda: PlanarJoint(position_target=(1.0, 2.0)), r"position_target has 2 numbers.*px, py, rz"
    yield (
        lambda: SphericalJoint(position_target=1.0),
        r"position_target is 1 for all coordinates, among them",
    )
    yield lambda: SphericalJoint(position_target=(0.0,) * 4), r"position_target has a quaternion of zeros"
    yield (
        lambda: RevoluteJoint(lower_limit=1.0, upper_limit=-1.0),
        r"the lower limit 1.0 is above the upper limit -1.0",
    )
    yield lambda: SphericalJoint(upper_limit=1.0), r"upper_limit limits a rotation vector"


@pytest.mark.parametrize(("build", "message"), list(wrong_parameters()))
def test_wrong_parameters_are_refused(build: Callable[[], Block], message: str) -> None:
    with pytest.raises(ArmblocksError, match=re.compile(message)):
        build()


def test_a_static_network_has_no_equations() -> None:
    builder = DiagramBuilder("static")
    world = builder.add("world", WorldFrame())
    builder.add("frame", ReferenceFrame(), R=world)
    builder.add("block", BrickSolid(), R=world)
    assert not flat_diagram(builder.draft()).blocks
