"""Quantities of a workspace: sampled coordinates, the position of the tool, and measures of mobility.

The number of a sample determines its coordinates by an additive recurrence (a Kronecker sequence),
``u_k = frac(start + k step)``, with low discrepancy for steps that are linearly independent over the rational
numbers. Source: Niederreiter, *Random Number Generation and Quasi-Monte Carlo Methods*, SIAM 1992, section
3.1. Each sample is therefore computed independently, in any thread.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from casadi import SX, cos, fabs, floor, fmax, fmin, if_else, sin, sqrt, vertcat

from armblocks.dynamics.base_parameters import regrouped
from armblocks.dynamics.friction import joint_friction, rotor_torques
from armblocks.dynamics.jacobian import columns_at, jacobian_matrix, singular_value_product
from armblocks.dynamics.joint_motion import entries, joint_motions
from armblocks.dynamics.kinematics import body_poses, constant_pose, frame_pose
from armblocks.dynamics.loads import with_payload
from armblocks.dynamics.reduction import (
    generalised_forces,
    reduced_columns,
    tree_coordinates,
    tree_speeds,
)
from armblocks.dynamics.rnea import rnea
from armblocks.dynamics.robot_trace import column_sum
from armblocks.dynamics.springs import spring_torques
from armblocks.equations import Signature, TracedFunction, signature
from armblocks.equations.signatures import Slot
from armblocks.robot.joints.motions import AxisMotion
from armblocks.robot.robot import Robot
from armblocks.robot.tree import KinematicTree
from armblocks.spatial.vectors import Scalar

MEASURES = ("manipulability", "singularity", "condition", "limits", "payload")
"""The names of the measures, in the order of :class:`armblocks.Workspace`."""
ROWS = {"all": slice(0, 6), "trans": slice(0, 3), "rot": slice(3, 6)}
"""Rows of the Jacobian by the name of the axes."""
SWEEPS = 7
"""Sweeps of Jacobi rotations; six vectors are orthogonal to rounding after five or six."""
NO_LEVER = 1e-9
"""Torque of a payload of 1 kg, N m or N, below which the payload does not load the joint."""
SHIFTS = 3
"""Uniform numbers of a random rotation."""


def uniform_count(robot: Robot) -> int:
    """The number of uniform numbers of a sample: one for each coordinate, three for a quaternion."""
    motions = [motion for joint in robot.joints for motion in joint.motions]
    return sum(1 if isinstance(motion, AxisMotion) else SHIFTS for motion in motions)


def trace_workspace_coordinates(robot: Robot) -> TracedFunction:
    """``q (nq,)`` of the sample with the number ``k``; inputs as of :func:`trace_workspace`."""

    def equations(k: SX, start: SX, step: SX, low: SX, width: SX) -> SX:
        return SX(vertcat(*_sampled(robot, k, start, step, low, width)))

    outputs = signature(("q", (robot.nq,), ""))
    return TracedFunction.trace("workspace_coordinates", _sample_inputs(robot), outputs, equations)


def trace_workspace(
    robot: Robot, measures: Sequence[str], axes: str, frame: str | None = None
) -> TracedFunction:
    """``point (3,)`` m of the frame, ``inside ()`` 1 or 0, and one number for each of the ``measures``.

    Inputs: ``k ()`` number of the sample; ``start``, ``step``, ``low``, ``width`` (d,) of the d uniform
    numbers. With the measure ``"payload"`` also ``torque (n,)`` limits, ``centre (3,)`` m of the payload in
    the axes of the frame, ``qd``, ``qdd`` (n,). ``inside`` is 0 where a joint that couplings determine is
    beyond its limits. ``axes``: a key of ``ROWS``.
    """
    tree = KinematicTree.of(robot).with_tool_at(frame)

    def equations(k: SX, start: SX, step: SX, low: SX, width: SX, *loads: SX) -> tuple[SX, ...]:
        q = SX(vertcat(*_sampled(robot, k, start, step, low, width)))
        ground = constant_pose(tree.base)
        bodies = body_poses(tree, entries(tree_coordinates(robot.coordinate_map, q)), ground)
        tool = frame_pose(tree.tool, bodies, ground)
        of_tree = jacobian_matrix(columns_at(tree, bodies, tool.p))
        J = reduced_columns(robot.coordinate_map, of_tree) if robot.couplings else of_tree
        values = [_measure(name, robot, SX(J[ROWS[axes], :]), q, loads, frame) for name in measures]
        return (SX(vertcat(*tool.p)), _inside(robot, q), *values)

    more = payload_slots(robot) if "payload" in measures else ()
    outputs = signature(("point", (3,), "m"), ("inside", (), ""), *((name, (), "") for name in measures))
    inputs = Signature((*_sample_inputs(robot), *more))
    return TracedFunction.trace("workspace", inputs, outputs, equations)


def trace_payload_capacity(robot: Robot, frame: str | None = None) -> TracedFunction:
    """``mass ()`` kg: the largest mass at the frame at ``q`` within the torque limits; other inputs as of
    :func:`trace_workspace`."""

    def equations(q: SX, *loads: SX) -> SX:
        return payload_capacity(robot, q, loads, frame)

    inputs = Signature((Slot("q", (robot.nq,), ""), *payload_slots(robot)))
    return TracedFunction.trace("payload_capacity", inputs, signature(("mass", (), "kg")), equations)


def payload_slots(robot: Robot) -> tuple[Slot, ...]:
    """The inputs of the measure ``"payload"`` after the coordinates."""
    n = (robot.n,)
    return Slot("torque", n, ""), Slot("centre", (3,), "m"), Slot("qd", n, ""), Slot("qdd", n, "")


def _sample_inputs(robot: Robot) -> Signature:
    d = (uniform_count(robot),)
    return Signature((Slot("k", (), ""), *(Slot(name, d, "") for name in ("start", "step", "low", "width"))))


def _sampled(robot: Robot, k: SX, start: SX, step: SX, low: SX, width: SX) -> list[Scalar]:
    """The coordinates of sample k: uniform in their ranges; rotations are uniform (Shoemake, *Graphics Gems
    III*, 1992, "Uniform random rotations")."""
    u = start + k * step
    u = u - floor(u)
    q: list[Scalar] = []
    at = 0
    for joint in robot.joints:
        for motion in joint.motions:
            if isinstance(motion, AxisMotion):
                q.append(low[at] + width[at] * u[at])
                at += 1
                continue
            inner, outer = sqrt(1.0 - u[at]), sqrt(u[at])
            first, second = 2.0 * math.pi * u[at + 1], 2.0 * math.pi * u[at + 2]
            q += [outer * cos(second), inner * sin(first), inner * cos(first), outer * sin(second)]
            at += SHIFTS
    return q


def _measure(name: str, robot: Robot, J: SX, q: SX, loads: Sequence[SX], frame: str | None) -> SX:
    match name:
        case "manipulability":
            return singular_value_product([entries(SX(J[:, k])) for k in range(J.shape[1])])
        case "singularity":
            return _least(singular_values(J))
        case "condition":
            values = singular_values(J)
            largest = -_least([-value for value in values])
            return SX(_least(values) / (largest + (largest == 0.0)))
        case "limits":
            return _limit_margin(robot, q)
        case _:
            return payload_capacity(robot, q, loads, frame)


def singular_values(J: SX) -> list[SX]:
    """The min(rows, columns) singular values, not sorted, by Jacobi rotations of the shorter side.

    The rows (or columns) are made orthogonal pair by pair; their lengths are the singular values, with small
    relative errors. Source: Golub and Van Loan, *Matrix Computations*, 8.6.3 (one-sided Jacobi).
    """
    shorter = J if J.shape[0] <= J.shape[1] else J.T
    vectors: list[Sequence[Scalar]] = [entries(SX(shorter[i, :].T)) for i in range(shorter.shape[0])]
    count = len(vectors)
    for _ in range(SWEEPS if count > 2 else 1):
        for i in range(count):
            for j in range(i + 1, count):
                a, b = vectors[i], vectors[j]
                c = _dot(a, b)
                d = _dot(b, b) - _dot(a, a)
                size = fabs(d) + sqrt(d * d + 4.0 * c * c)
                t = 2.0 * c * if_else(d < 0.0, -1.0, 1.0) / (size + (size == 0.0))
                cosine = 1.0 / sqrt(1.0 + t * t)
                sine = cosine * t
                vectors[i] = [cosine * x - sine * y for x, y in zip(a, b)]
                vectors[j] = [sine * x + cosine * y for x, y in zip(a, b)]
    return [SX(sqrt(_dot(vector, vector))) for vector in vectors]


def payload_capacity(robot: Robot, q: SX, loads: Sequence[SX], frame: str | None) -> SX:
    """The largest mass (kg) at the frame within the torque limits; ``loads``: torque, centre, qd, qdd.

    The torques are linear in the mass: ``tau = tau0 + m d``. The capacity is 0 where ``tau0`` alone exceeds a
    limit, and infinite where the payload loads no joint with a limit.
    """
    limits, centre, qd, qdd = loads
    tree = regrouped(KinematicTree.of(robot)).with_tool_at(frame)
    C = robot.coordinate_map
    q, qd, qdd = tree_coordinates(C, q), tree_speeds(C, qd), tree_speeds(C, qdd)
    rates, accelerations = entries(qd), entries(qdd)
    unit = SX(vertcat(1.0, centre, SX.zeros(6, 1)))
    empty, loaded = (
        column_sum(rnea(body, joint_motions(body, q), rates, accelerations, tree.gravity))
        for body in (tree, with_payload(tree, unit))
    )
    own = empty + column_sum(
        rotor_torques(tree.robot, accelerations), joint_friction(tree.robot, rates), spring_torques(tree, q)
    )
    lever = loaded - empty
    if robot.couplings:
        own, lever = generalised_forces(C, own), generalised_forces(C, lever)
    capacity = SX(math.inf)
    for tau, d, limit in zip(entries(own), entries(lever), entries(limits)):
        felt = fabs(d) > NO_LEVER
        room = fmax(0.0, limit - if_else(d < 0.0, -1.0, 1.0) * tau)
        mass = if_else(felt, room / (fabs(d) + (d == 0.0)), math.inf)
        holds = if_else(fabs(tau) <= limit, math.inf, 0.0)
        capacity = fmin(capacity, fmin(mass, holds))
    return SX(capacity)


def _limit_margin(robot: Robot, q: SX) -> SX:
    """The distance to the nearest joint limit, divided by half the range: 1 in the middle, 0 at a limit."""
    margin = SX(1.0)
    ranges = [(entry, *ends) for entry, ends in zip(entries(q), robot.qlim.tolist())]
    for value, low, high in (*ranges, *_dependent_ranges(robot, q)):
        if math.isfinite(low) and math.isfinite(high) and high > low:
            margin = fmin(margin, 1.0 - fabs(value - 0.5 * (low + high)) / (0.5 * (high - low)))
    return SX(margin)


def _inside(robot: Robot, q: SX) -> SX:
    inside = SX(1.0)
    for value, low, high in _dependent_ranges(robot, q):
        inside = inside * (value >= low) * (value <= high)
    return SX(inside)


def _dependent_ranges(robot: Robot, q: SX) -> list[tuple[Scalar, float, float]]:
    """The coordinates and limits of the joints that depend on several coordinates; :attr:`Robot.qlim`
    contains the limits of joints that depend on one coordinate."""
    found: list[tuple[Scalar, float, float]] = []
    for joint in robot.coupled_joints:
        if len(joint.factors) > 1 and joint.limits.position is not None:
            value: Scalar = joint.constant
            for index, factor in joint.factors.items():
                position = robot.position_of_speed[index]
                assert position is not None, "couplings are between joints with one coordinate"
                value = value + factor * q[position]
            found.append((value, *joint.limits.position))
    return found


def _least(values: Sequence[SX]) -> SX:
    least = values[0]
    for value in values[1:]:
        least = fmin(least, value)
    return SX(least)


def _dot(a: Sequence[Scalar], b: Sequence[Scalar]) -> Scalar:
    total: Scalar = 0.0
    for x, y in zip(a, b):
        total = total + x * y
    return total
