"""Functions shared by robot blocks: ports with joint units, and traced equations."""

from __future__ import annotations

import numpy as np
from casadi import SX
from numpy.typing import NDArray

from armblocks import dynamics
from armblocks.diagram import Block, Port, rate_unit, shape_of
from armblocks.dynamics.mechanism import mechanism
from armblocks.equations import TracedFunction, flatten, unflatten
from armblocks.errors import InputError, counted
from armblocks.robot import Robot

MAX_START_RESIDUAL = 1e-6
"""Largest residual of a start state that counts as consistent: m, or cosine of an angle, also per second."""


def apply_traced(traced: TracedFunction, *values: SX) -> SX:
    """The result of a traced robot function for other symbols, as an array of its natural shape."""
    (result,) = apply_all(traced, *values)
    return result


def apply_all(traced: TracedFunction, *values: SX) -> tuple[SX, ...]:
    """All results of a traced robot function for other symbols, each in its natural shape."""
    flat = [flatten(value, slot.shape) for value, slot in zip(values, traced.inputs)]
    results = traced.casadi_function().call(flat, True, False)
    return tuple(unflatten(result, slot.shape) for result, slot in zip(results, traced.outputs))


def coordinate_unit(robot: Robot) -> str:
    """The unit of the integral of the speeds: rad or m, or ``""`` if the robot has joints of both types."""
    units = {entry.unit for entry in robot.speeds}
    return units.pop() if len(units) == 1 else ""


def speed_names(robot: Robot) -> tuple[str, ...]:
    """The names of the entries of qd."""
    return tuple(entry.name for entry in robot.speeds)


def q_port(robot: Robot, name: str = "q", doc: str = "joint coordinates") -> Port:
    """A port of joint coordinates (nq,)."""
    unit = coordinate_unit(robot) if robot.nq == robot.nv else ""
    return Port(name, doc, unit, (robot.nq,), tuple(entry.name for entry in robot.positions))


def qd_port(robot: Robot, name: str = "qd", doc: str = "joint speeds") -> Port:
    """A port of joint speeds (n,)."""
    return Port(name, doc, rate_unit(coordinate_unit(robot)), (robot.n,), speed_names(robot))


def qdd_port(robot: Robot, name: str = "qdd", doc: str = "joint accelerations") -> Port:
    """A port of joint accelerations (n,)."""
    return Port(name, doc, rate_unit(rate_unit(coordinate_unit(robot))), (robot.n,), speed_names(robot))


def reference_ports(robot: Robot) -> tuple[Port, Port, Port]:
    """The ports of the desired motion of a controller: coordinates, speeds and accelerations."""
    return (
        q_port(robot, "qr", "desired joint coordinates"),
        qd_port(robot, "qdr", "desired joint speeds"),
        qdd_port(robot, "qddr", "desired joint accelerations"),
    )


def tau_port(robot: Robot, doc: str) -> Port:
    """A port of joint torques or forces (n,)."""
    unit = {"rad": "N m", "m": "N"}.get(coordinate_unit(robot), "")
    return Port("tau", doc, unit, (robot.n,), speed_names(robot))


def check_joint_values(block: Block, robot: Robot, name: str) -> None:
    """Raise ``InputError`` unless a parameter has one number, or one for each entry of qd."""
    shape = shape_of(block.parameter_value(name))
    if shape not in ((), (robot.n,)):
        raise InputError(
            f"{name} has {counted(shape[0], 'joint')}",
            where=f"{block.type_name()}.{name}",
            allowed=f"{robot.n}, one for each joint of '{robot.name}', or one number for all",
            fix="give one number for each joint of the robot",
        )


def check_start(block: Block, robot: Robot, name: str) -> None:
    """Raise ``InputError`` unless a parameter has values of q.

    They are one number for each entry of q, or one number for all. With ball joints this number is 0 and
    selects the neutral coordinates, because a quaternion of zeros is not a rotation.
    """
    if robot.nq == robot.nv:
        check_joint_values(block, robot, name)
        return
    value = np.asarray(block.parameter_value(name))
    where, allowed = f"{block.type_name()}.{name}", f"{robot.nq}, one for each coordinate, or 0 for all"
    if value.shape not in ((), (robot.nq,)) or (value.shape == () and value != 0.0):
        raise InputError(
            f"{name} is {value:g} for all"
            if value.shape == ()
            else f"{name} has {counted(value.size, 'coordinate')}",
            where=where,
            allowed=allowed,
            fix=f"begin with the neutral coordinates {robot.neutral.tolist()}",
        )
    if value.shape and not (np.abs(norms := ball_norms(robot, value)) > 0.0).all():
        raise InputError(
            f"{name} has a quaternion of zeros ({norms.tolist()} are the lengths of all quaternions)",
            where=where,
            allowed="quaternions w x y z other than zero",
            fix=f"begin with the neutral coordinates {robot.neutral.tolist()}",
        )


def check_consistent_start(block: Block, robot: Robot, q_name: str, qd_name: str) -> None:
    """Raise ``InputError`` if the start values of q and qd violate the constraints of the robot."""
    if not robot.closures:
        return
    functions = mechanism(robot)
    q = start_numbers(block, robot, q_name)
    qd = np.broadcast_to(np.asarray(block.parameter_value(qd_name), dtype=float), (robot.n,))
    rates = functions.jacobian(q) @ qd
    for name, values, unit in (
        (q_name, functions.residuals(q), ""),
        (qd_name, rates / max(1.0, float(np.abs(qd).max(initial=0.0))), " per second"),
    ):
        worst = int(np.argmax(np.abs(values)))
        if abs(values[worst]) > MAX_START_RESIDUAL:
            constraint = functions.names[worst]
            gap = functions.gaps(q)[constraint] if name == q_name else f"{abs(values[worst]):.3g}{unit}"
            raise InputError(
                f"{name} violates constraint '{constraint}' by {gap}",
                where=f"{block.type_name()}.{name}",
                allowed="a state that satisfies the constraints of the robot",
                fix="take q and qd of arm.assemble(q0, qd0)",
            )


def start_numbers(block: Block, robot: Robot, name: str) -> NDArray[np.float64]:
    """The initial q (nq,) of a parameter that :func:`check_start` accepted, as numbers."""
    given = np.asarray(block.parameter_value(name), dtype=float)
    return given if given.shape else robot.neutral + given


def check_no_closures(block: Block, robot: Robot) -> None:
    """Raise ``InputError`` for a robot with closed loops, whose coordinates are not independent."""
    if robot.closures:
        raise InputError(
            f"robot '{robot.name}' has closed loops, such as '{robot.closures[0].name}'",
            where=block.type_name(),
            allowed="robots without closed loops, whose joints move independently",
            fix="compute the motion by arm.ikine, which supports closed loops, and play it by the block "
            "Trajectory",
        )


def start_coordinates(robot: Robot, given: SX) -> SX:
    """The initial q (nq,) of a parameter that :func:`check_start` accepted."""
    if robot.nq == robot.nv or given.numel() == robot.nq:
        return given
    return SX(robot.neutral) + given


def coordinate_rates(robot: Robot, q: SX, qd: SX) -> SX:
    """dq/dt (nq,): ``qd`` itself without ball joints."""
    return qd if robot.nq == robot.nv else apply_traced(dynamics.trace_position_rates(robot), q, qd)


def normalised_coordinates(robot: Robot, q: SX) -> SX:
    """``q`` with quaternions of length 1: integration keeps their length only up to its errors."""
    return q if robot.nq == robot.nv else apply_traced(dynamics.trace_normalised(robot), q)


def ball_norms(robot: Robot, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """The length of each quaternion in ``q``."""
    norms: list[float] = []
    position = 0
    for joint in robot.joints:
        for motion in joint.motions:
            count = len(motion.positions)
            if motion.positions != motion.speeds:
                norms.append(float(np.linalg.norm(q[position : position + count])))
            position += count
    return np.array(norms)


def check_speeds_are_rates(block: Block, robot: Robot) -> None:
    """Raise ``InputError`` for a robot with ball joints, if the equations of a block subtract coordinates."""
    if robot.nq != robot.nv:
        names = [link.name for link in robot.moving_links if link.joint.nq != link.joint.nv]
        raise InputError(
            f"joint '{names[0]}' of robot '{robot.name}' has a quaternion as coordinates",
            where=block.type_name(),
            allowed="robots whose joint speeds are the rates of the joint coordinates",
            fix="replace the joint by revolute joints, or build the controller from other blocks",
        )
