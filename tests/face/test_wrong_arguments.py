"""Wrong arguments of constructors: the error names the class, the argument and the correct name."""

from collections.abc import Callable

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import BLOCKS, Fkine, Gain, RobotPlot
from armblocks.errors import ArmblocksError

ARM = ab.load_robot("twolink")
LINKS = ARM.robot.links


def robot(**values: object) -> ab.Robot:
    return ab.Robot(name="x", links=LINKS, **values)


def add_block(*args: object, **named: object) -> object:
    return ab.DiagramBuilder("d").add("g", *args, **named)


WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "name of a parameter": (lambda: Gain(gian=2.0), r"Gain: there is no argument named 'gian'.*'gain'\?"),
    "no name": (lambda: Gain(2.0), r"1 argument is given without names.*Fix: write Gain\(gain=…\)"),
    "field of a robot": (lambda: ab.Robot(nme="x"), r"Robot: there is no argument named 'nme'.*'name'"),
    "field of a link": (lambda: ab.Link(mas=3), r"Link: there is no argument named 'mas'.*'mass'"),
    "field of a motor": (lambda: ab.Motor(gear=3), r"Motor: there is no argument named 'gear'.*'gear_ratio'"),
    "field of a joint": (lambda: ab.Revolute(axs=3), r"Revolute: there is no argument named 'axs'.*'axis'"),
    "field of limits": (lambda: ab.JointLimits(sped=3), r"JointLimits: there is no argument named 'sped'"),
    "field of a row": (lambda: ab.DhRow(alfa=3), r"DhRow: there is no argument named 'alfa'.*'alpha'"),
    "field of a payload": (lambda: ab.Payload(mas=3), r"Payload: there is no argument named 'mas'"),
    "a setting": (
        lambda: ab.SimulationOptions(stp=3),
        r"SimulationOptions: there is no argument named 'stp'",
    ),
    "base": (lambda: robot(base=np.eye(3)), r"base of robot 'x': the pose is neither a Transform nor"),
    "tool": (lambda: robot(tool="up"), r"tool of robot 'x': the pose is a str"),
    "links": (
        lambda: ab.Robot(name="x", links=[1]),
        r"'x', link number 1: a value of type int.*: a Link",
    ),
    "mass": (lambda: ab.Link(name="x", mass="much"), r"mass of link 'x': 'much' is not a number"),
    "joint": (lambda: ab.Link(name="x", joint=3), r"joint of link 'x': a value of type int was given"),
    "friction": (lambda: ab.Motor(coulomb_friction="b"), r"coulomb_friction of a motor: 'b' is not an array"),
    "arm": (lambda: ab.Arm(3), r"Arm: a value of type int was given. Allowed: a Robot"),
    "payload": (lambda: ab.Payload(mass="much"), r"not made of 1 \+ 3 \+ 6 finite numbers"),
    "trajectory": (lambda: ab.jtraj(["a"], [1], 3), r"jtraj: q0 = \['a'\]"),
    "robot of a block": (lambda: Fkine(robot=3), r"Fkine.robot: the value is 3. Allowed: a Robot, or an Arm"),
    "a block": (lambda: add_block(3), r"a value of type int is added instead of a block"),
    "a matrix without a name": (lambda: ab.Transform(np.eye(4)), r"write Transform.from_matrix\(T\) for a"),
    "a source": (lambda: add_block(Gain(), 3), r"an output is a int.*add a Constant block"),
}


DIAGRAM = ab.load_diagram("van_der_pol_pid")
WRONG_TYPES: dict[str, tuple[Callable[[], object], str]] = {
    "compile_diagram": (lambda: ab.simulate(3), "a Diagram, or the name or path of a diagram"),
    "load_robot": (lambda: ab.load_robot(3), "the name of a shipped robot, or the path of a file"),
    "load_table": (lambda: ab.load_table(3), "the path of a file"),
    "save_robot": (lambda: ab.save_robot(3, "x.json"), "an Arm, a Robot, or the name or path of a robot"),
    "save_diagram": (lambda: ab.save_diagram(3, "x.json"), "a Diagram"),
    "to_python": (lambda: ab.to_python(3), "a Diagram"),
    "draw_diagram": (lambda: ab.draw_diagram(3, "x.svg"), "a Diagram"),
    "diagram_difference": (lambda: ab.diagram_difference(DIAGRAM, 3), "a Diagram"),
    "block_example": (lambda: ab.block_example(3), "a block class or its name"),
    "write_report": (lambda: ab.write_report("x", DIAGRAM, 3), "the result of simulate"),
}


@pytest.mark.parametrize("where", WRONG_TYPES)
def test_a_value_of_a_wrong_type_is_rejected_with_the_allowed_types(where: str) -> None:
    call, allowed = WRONG_TYPES[where]
    with pytest.raises(ArmblocksError, match=f"{where}: a value of type int was given. Allowed: {allowed}"):
        call()


@pytest.mark.parametrize("case", WRONG)
def test_wrong_arguments_raise_an_error_of_the_package(case: str) -> None:
    call, words = WRONG[case]
    with pytest.raises(ArmblocksError, match=words):
        call()


def test_every_block_refuses_an_unknown_argument() -> None:
    for name, kind in BLOCKS.items():
        with pytest.raises(ArmblocksError, match=rf"^{name}: there is no argument named 'no_such_name'"):
            kind(no_such_name=1)


def test_a_matrix_is_accepted_as_a_pose() -> None:
    T = ab.Transform(translation=(1.0, 2.0, 3.0))
    assert robot(base=T.matrix, tool=T.matrix.tolist()) == robot(base=T, tool=T)
    assert ab.Link(name="x", before=T.matrix) == ab.Link(name="x", before=T)


def test_blocks_accept_an_arm_in_place_of_its_robot() -> None:
    block = RobotPlot(robot=ARM)
    assert block == RobotPlot(robot=ARM.robot)
    assert block.robot is ARM.robot
    other = ARM.nofriction()
    assert block.with_parameters(robot=other).robot is other.robot
    diagram = ab.DiagramBuilder("masked")
    diagram.parameter("robot", ARM, kind="robot")
    assert diagram.build().mask_values["robot"] == ARM.robot
