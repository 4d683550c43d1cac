"""Traces of functions of a robot: inputs with its joint quantities, and coupled joints eliminated."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from casadi import SX, vertcat

from armblocks.dynamics.loads import PAYLOAD_SLOT, WRENCH_SLOT
from armblocks.dynamics.reduction import in_independent_coordinates
from armblocks.equations import Signature, TracedFunction, signature
from armblocks.equations.signatures import Slot
from armblocks.errors import RobotError
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.vectors import Scalar


def robot_trace(
    name: str,
    robot: Robot,
    inputs: Sequence[str],
    output: tuple[str, tuple[int, ...], str],
    equations: Callable[..., SX],
    *,
    of_tree: bool = True,
    more: Sequence[Slot] = (),
) -> TracedFunction:
    """The trace of ``equations``, which have the coordinates of the tree (``of_tree``) or of the robot.

    ``more``: inputs after the named ones, which do not depend on the choice of coordinates.
    """
    check_moves(robot, name)
    if robot.couplings and of_tree:
        names = (*inputs, *(slot.name for slot in more))
        equations = in_independent_coordinates(robot.coordinate_map, names, output[0], equations)
    slots = Signature((*robot_inputs(robot, inputs), *more))
    return TracedFunction.trace(name, slots, signature(output), equations)


def check_moves(robot: Robot, name: str) -> None:
    """Raise RobotError for a robot without moving joints, which has no function ``name``."""
    if robot.n == 0:
        raise RobotError(
            f"no joint moves, so there is no {name}",
            where=f"robot '{robot.name}'",
            allowed="at least one joint that is not fixed",
            fix="give the robot a joint that moves",
        )


def robot_inputs(robot: Robot, names: Sequence[str]) -> Signature:
    """Slots of the named inputs; joint quantities have a unit if it is the same for all joints."""
    units = {entry.unit for entry in robot.speeds}
    unit = units.pop() if len(units) == 1 else ""
    force = {"rad": "N m", "m": "N"}.get(unit, "")
    n = (robot.n,)
    position_unit = unit if robot.nq == robot.nv else ""
    slots = {
        **{name: Slot(name, (robot.nq,), position_unit) for name in ("q", "q0", "q1")},
        "dt": Slot("dt", (), "s"),
        "qd": Slot("qd", n, f"{unit}/s" if unit else ""),
        "qdd": Slot("qdd", n, f"{unit}/s2" if unit else ""),
        "tau": Slot("tau", n, force),
        "wrench": WRENCH_SLOT,
        "payload": PAYLOAD_SLOT,
    }
    return Signature(tuple(slots[name] for name in names))


def body_of_speed(tree: KinematicTree) -> list[int]:
    """For each entry of qd, the index of its body."""
    indices = [0] * tree.n
    for i, body in enumerate(tree.bodies):
        indices[body.speed] = i
    return indices


def column_sum(*terms: Sequence[Scalar]) -> SX:
    """A column of the elementwise sums."""
    return SX(vertcat(*(sum(entry, SX(0.0)) for entry in zip(*terms))))


def differences(a: Sequence[Scalar], b: Sequence[Scalar], c: Sequence[Scalar]) -> list[Scalar]:
    """The entries ``a - b - c``."""
    return [x - y - z for x, y, z in zip(a, b, c)]


def matrix_of_rows(rows: Sequence[Sequence[Scalar]]) -> SX:
    """The matrix with these rows."""
    return SX(vertcat(*(vertcat(*(SX(entry) for entry in row)).T for row in rows)))
