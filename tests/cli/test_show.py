"""``armblocks show`` for robots unlike the shipped ones: trees, prismatic joints, modified D-H parameters."""

import io
import math

import pytest
from rich.console import Console

from armblocks.cli.show import print_robot
from armblocks.robot import Fixed, JointLimits, Link, Prismatic, Revolute, Robot, modified_dh, standard_dh
from armblocks.robot.dh_table import dh_table, kinematics_text
from armblocks.spatial import transl


def printed_robot(robot: Robot, width: int = 80) -> str:
    stream = io.StringIO()
    print_robot(robot, Console(width=width, file=stream, highlight=False, markup=False))
    return stream.getvalue()


@pytest.fixture
def tree() -> Robot:
    limits = JointLimits(position=(-0.5, 1.25), speed=2.0, torque=300.0)
    trunk = Link(name="trunk", joint=Prismatic(limits=limits), mass=10.0, after=transl(0, 0, 0.5))
    links = (
        trunk,
        Link(name="left", parent="trunk", joint=Revolute(axis=(0, 1, 0)), before=transl(0, 0.2, 0), mass=1.0),
        Link(
            name="right", parent="trunk", joint=Revolute(axis=(0, 1, 0)), before=transl(0, -0.2, 0), mass=1.0
        ),
        Link(name="hand", parent="right", joint=Fixed(), mass=0.1),
    )
    return Robot(name="torso", links=links, base=transl(0, 0, 1.0))


def test_a_tree_is_printed_by_parents_and_axes(tree: Robot) -> None:
    lines = [" ".join(line.split()) for line in printed_robot(tree).splitlines()]
    assert "torso (3 axis, PRR)" in lines
    assert "trunk (base) prismatic 0 0 1 0, 0, 0.5" in lines
    assert "right trunk revolute 0 1 0 0, -0.2, 0" in lines
    assert "hand right fixed 0, 0, 0" in lines


def test_a_tree_as_text_has_a_line_for_each_link(tree: Robot) -> None:
    lines = [" ".join(line.split()) for line in kinematics_text(tree).splitlines()]
    assert lines[0] == "link parent joint axis at q = 0: x, y, z m"
    assert "right trunk revolute 0 1 0 0, -0.2, 0" in lines


def test_a_prismatic_joint_has_limits_in_metres(tree: Robot) -> None:
    lines = [" ".join(line.split()) for line in printed_robot(tree).splitlines()]
    assert "trunk -0.5 m 1.25 m 2 m/s 300 N" in lines


def test_a_base_that_is_not_the_identity_is_printed(tree: Robot) -> None:
    text = printed_robot(tree)
    assert "base =\n" in text
    assert "tool = identity" in text


def test_the_variable_of_a_prismatic_joint_is_in_the_column_of_d() -> None:
    slide = standard_dh("slide", theta=math.pi / 2, a=0.25, sigma=1, offset=0.125)
    lines = dh_table(Robot(name="slider", links=(slide,)))
    assert lines[3] == "| slide |     1.571|         q|      0.25|         0|     0.125|"


def test_the_header_names_modified_denavit_hartenberg_parameters() -> None:
    robot = Robot(
        name="craig", links=(modified_dh("one", alpha=0.5), modified_dh("two", parent="one", a=1.0))
    )
    assert printed_robot(robot).startswith("craig (2 axis, RR, modDH)\n")


@pytest.mark.parametrize("width", [60, 80, 160])
def test_the_names_of_many_links_are_wrapped_to_the_width(width: int) -> None:
    links = tuple(
        standard_dh(f"link{k}", a=0.1, mass=1.0 + k, parent=f"link{k - 1}" if k else None) for k in range(20)
    )
    text = printed_robot(Robot(name="snake", links=links), width)
    assert max(len(line.rstrip()) for line in text.splitlines()) <= max(
        width, 66
    )  # the D-H table with these names is 65 columns wide
    assert all(f"link{k}" in text for k in range(20))
