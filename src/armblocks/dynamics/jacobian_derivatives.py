"""Derivatives of the Jacobian of the tool: along a motion, and for each degree of freedom.

They are exact derivatives of the traced Jacobian. With a ball joint, the derivative for one of its speeds is
taken along ``q̇ = N(q) qd``, so that ``dJ/dt`` is the sum of all derivatives times the speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from casadi import SX, jtimes, mtimes, reshape, vec, vertcat

from armblocks.dynamics.ball_joints import position_rates
from armblocks.dynamics.jacobian import jacobian_matrix, world_columns
from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.reduction import reduced_columns, tree_coordinates
from armblocks.equations import Signature, Slot, TracedFunction, signature
from armblocks.errors import RobotError
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree

Equations = Callable[..., SX]


def trace_jacob0_dot(robot: Robot, frame: str | None = None) -> TracedFunction:
    """``Jd (6, n)``: the time derivative of ``jacob0`` for the speeds ``qd``, rows as ``jacob0``."""

    def equations(q: SX, qd: SX) -> SX:
        return _along(_jacobian(robot, frame, q), q, _rates(robot, q, entries(qd)))

    return _traced("jacob0_dot", robot, ("q", "qd"), (6, robot.n), equations)


def trace_jacob_dot(robot: Robot, frame: str | None = None) -> TracedFunction:
    """``a (6,)``: ``dJ/dt qd``, the acceleration of the tool for ``qdd = 0``; m/s², rad/s²."""

    def equations(q: SX, qd: SX) -> SX:
        return SX(mtimes(_along(_jacobian(robot, frame, q), q, _rates(robot, q, entries(qd))), qd))

    return _traced("jacob_dot", robot, ("q", "qd"), (6,), equations)


def trace_hessian0(robot: Robot, frame: str | None = None) -> TracedFunction:
    """``H (n, 6, n)``: ``H[k]`` is the derivative of ``jacob0`` for a unit speed of degree of freedom k."""

    def equations(q: SX) -> SX:
        J = _jacobian(robot, frame, q)
        units = [[1.0 if i == k else 0.0 for i in range(robot.n)] for k in range(robot.n)]
        return SX(vertcat(*(_along(J, q, _rates(robot, q, unit)) for unit in units)))

    return _traced("hessian0", robot, ("q",), (robot.n, 6, robot.n), equations)


JACOBIAN_DERIVATIVES: Mapping[str, Callable[..., TracedFunction]] = {
    "jacob0_dot": trace_jacob0_dot,
    "jacob_dot": trace_jacob_dot,
    "hessian0": trace_hessian0,
}
"""The functions of this module by name; all take ``frame``."""


def _jacobian(robot: Robot, frame: str | None, q: SX) -> SX:
    tree, coordinates = KinematicTree.of(robot).with_tool_at(frame), robot.coordinate_map
    if not robot.couplings:
        return jacobian_matrix(world_columns(tree, entries(q)))
    J = jacobian_matrix(world_columns(tree, entries(tree_coordinates(coordinates, q))))
    return reduced_columns(coordinates, J)


def _rates(robot: Robot, q: SX, qd: Sequence[SX | float]) -> SX:
    return SX(vertcat(*position_rates(robot, entries(q), qd)))


def _along(J: SX, q: SX, rates: SX) -> SX:
    """The derivative of a matrix along the rates of q."""
    return SX(reshape(jtimes(vec(J), q, rates), *J.shape))


def _traced(
    name: str, robot: Robot, inputs: Sequence[str], shape: tuple[int, ...], equations: Equations
) -> TracedFunction:
    if robot.n == 0:
        raise RobotError(
            f"no joint moves, so there is no {name}",
            where=f"robot '{robot.name}'",
            allowed="at least one joint that is not fixed",
            fix="give the robot a joint that moves",
        )
    slots = {"q": Slot("q", (robot.nq,), ""), "qd": Slot("qd", (robot.n,), "")}
    used = Signature(tuple(slots[entry] for entry in inputs))
    return TracedFunction.trace(name, used, signature((name, shape, "")), equations)
