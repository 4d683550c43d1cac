"""Conversion to the other D-H convention changes the rows but not the kinematics and dynamics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from armblocks.errors import RobotError
from armblocks.formats import load_robot
from armblocks.robot import DhConvention, Link, Robot, standard_dh
from armblocks.robot.dh_conversion import converted, reread
from armblocks.robot.shapes import Box
from armblocks.spatial import transl, trotx
from robots_for_tests import evaluate, random_states

STANDARD, MODIFIED = DhConvention.STANDARD, DhConvention.MODIFIED


def arms() -> list[Robot]:
    sliding = load_robot("puma560")
    first = sliding.links[0]
    slide = standard_dh(
        "slide",
        alpha=0.4,
        a=0.1,
        theta=0.3,
        sigma=1,
        offset=0.05,
        mass=2.0,
        centre_of_mass=(0.1, 0.2, 0.3),
        inertia=(0.1, 0.2, 0.15, 0.01, 0.02, 0.03),
    )
    chain = (slide, replace(first, parent="slide"), *sliding.links[1:])
    tooled = replace(sliding, links=chain, tool=transl(0.1, 0.0, 0.2) @ trotx(0.3), base=transl(0, 0, 1))
    return [load_robot("kr180"), load_robot("puma560"), tooled]


@pytest.mark.parametrize("robot", arms(), ids=lambda robot: f"{robot.name}-{robot.joint_letters}")
def test_conversion_keeps_kinematics_and_dynamics(robot: Robot) -> None:
    modified = converted(robot, MODIFIED)
    assert {link.dh.convention for link in modified.links if link.dh} == {MODIFIED}
    assert converted(modified, MODIFIED) is modified
    back = converted(modified, STANDARD)
    for q, qd, qdd in random_states(robot):
        for message in (modified, back):
            for name, inputs in (("fkine", (q,)), ("jacob0", (q,)), ("rne", (q, qd, qdd))):
                expected = evaluate(robot, name, *inputs)
                scale = max(1.0, float(np.abs(expected).max()))
                # Frames are products of the same rotations in another order: some tens of rounding errors.
                assert_allclose(evaluate(message, name, *inputs), expected, rtol=0, atol=2e-13 * scale)
    for link, again in zip(robot.links, back.links):
        # The first conversion moves a constant transform to the tool; the second one leaves it there.
        if link is not robot.links[-1]:
            assert again.dh == link.dh
            assert_allclose(again.I, link.I, rtol=0, atol=1e-14)


def test_conversion_keeps_the_world_poses_of_shapes() -> None:
    boxed = load_robot("kr180").with_link("link3", geometry=(Box(size=(1.0, 1.0, 1.0)),))
    message = converted(boxed, MODIFIED)
    q = [0.1, 0.2, 0.3, 0.4]
    poses = [evaluate(robot, "link_poses", q)[3] for robot in (boxed, message)]
    shapes = [robot.link("link3").geometry for robot in (boxed, message)]
    assert shapes[0] and shapes[1]
    assert_allclose(
        poses[1] @ np.array(shapes[1][0].pose), poses[0] @ np.array(shapes[0][0].pose), atol=1e-13
    )


def test_the_same_rows_in_the_other_convention_are_another_arm() -> None:
    robot = load_robot("kr180")
    other = reread(robot, MODIFIED)
    assert [replace(link.dh, convention=STANDARD) for link in other.links if link.dh] == [
        link.dh for link in robot.links
    ]
    assert not np.allclose(evaluate(other, "fkine", np.zeros(4)), evaluate(robot, "fkine", np.zeros(4)))
    assert reread(other, STANDARD) == robot


def test_robots_that_are_not_a_chain_of_dh_rows_are_refused() -> None:
    robot = load_robot("puma560")
    tree = replace(robot, links=(*robot.links, standard_dh("finger", parent="link2")))
    branched = replace(robot, links=(*robot.links, Link(name="plate", parent=robot.links[-1].name)))
    for other in (tree, branched):
        with pytest.raises(RobotError, match="not a single chain of D-H rows"):
            converted(other, MODIFIED)
    first = reread(robot, MODIFIED).links[0]
    with pytest.raises(RobotError, match="rows of both conventions"):
        converted(replace(robot, links=(first, *robot.links[1:])), STANDARD)
