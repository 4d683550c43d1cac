"""Functions shared by robot blocks: ports with joint units, and traced equations."""

from __future__ import annotations

from casadi import SX

from armblocks.diagram import Block, Port, rate_unit, shape_of
from armblocks.equations import TracedFunction, flatten, unflatten
from armblocks.errors import InputError
from armblocks.robot import Robot


def apply_traced(traced: TracedFunction, *values: SX) -> SX:
    """The result of a traced robot function for other symbols, as an array of its natural shape."""
    flat = [flatten(value, slot.shape) for value, slot in zip(values, traced.inputs)]
    (result,) = traced.casadi_function().call(flat, True, False)
    return unflatten(result, traced.outputs.slots[0].shape)


def coordinate_unit(robot: Robot) -> str:
    """The unit of the coordinates: rad or m, or ``""`` if the robot has joints of both types."""
    units = set(robot.joint_units)
    return units.pop() if len(units) == 1 else ""


def q_port(robot: Robot, name: str = "q") -> Port:
    """A port of joint coordinates (n,)."""
    return Port(name, "joint coordinates", coordinate_unit(robot), (robot.n,), robot.joint_names)


def qd_port(robot: Robot, name: str = "qd") -> Port:
    """A port of joint speeds (n,)."""
    return Port(name, "joint speeds", rate_unit(coordinate_unit(robot)), (robot.n,), robot.joint_names)


def qdd_port(robot: Robot, name: str = "qdd") -> Port:
    """A port of joint accelerations (n,)."""
    return Port(
        name,
        "joint accelerations",
        rate_unit(rate_unit(coordinate_unit(robot))),
        (robot.n,),
        robot.joint_names,
    )


def tau_port(robot: Robot, doc: str) -> Port:
    """A port of joint torques or forces (n,)."""
    unit = {"rad": "N m", "m": "N"}.get(coordinate_unit(robot), "")
    return Port("tau", doc, unit, (robot.n,), robot.joint_names)


def check_joint_values(block: Block, robot: Robot, name: str) -> None:
    """Raise ``InputError`` unless a parameter has one number, or one for each joint."""
    shape = shape_of(block.parameter_value(name))
    if shape not in ((), (robot.n,)):
        raise InputError(
            f"{name} has {shape[0]} joints",
            where=f"{block.type_name()}.{name}",
            allowed=f"{robot.n}, one for each joint of '{robot.name}', or one number for all",
            fix="give one number for each joint of the robot",
        )
