"""A second formulation of constrained mechanisms: all bodies free, all joints and closures as constraints.

It shares no code with :mod:`armblocks.dynamics`. Poses and velocities come from the description alone. The
accelerations solve the Newton-Euler equations of all bodies together with the second derivatives of all
relations, by NumPy's least squares. The joints of the tree are revolute, prismatic or fixed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.robot import Link, Prismatic, Revolute, Robot
from armblocks.robot.constraints import (
    Closure,
    Coupling,
    Distance,
    NoDisplacement,
    Perpendicular,
    Relation,
)
from armblocks.spatial import Transform

Array = NDArray[np.float64]
XYZ = tuple(NoDisplacement(k) for k in range(3))
Z_PARALLEL = (Perpendicular(0, 2), Perpendicular(1, 2))
AXES_PARALLEL = (*Z_PARALLEL, Perpendicular(0, 1))
JOINT_RELATIONS: dict[type, tuple[Relation, ...]] = {
    Revolute: (*XYZ, *Z_PARALLEL),
    Prismatic: (*XYZ[:2], *AXES_PARALLEL),
}


class Body(NamedTuple):
    """Rotation, position, angular and linear velocity of a link's frame in world axes."""

    R: Array
    p: Array
    w: Array
    v: Array


class Frame(NamedTuple):
    """A frame on a link; z is the axis of a joint."""

    link: str | None
    R: Array
    p: Array


def body_states(robot: Robot, q: Array, qd: Array) -> dict[str | None, Body]:
    """The states of the base (None) and of all links."""
    base = np.asarray(robot.base.matrix)
    bodies: dict[str | None, Body] = {None: Body(base[:3, :3], base[:3, 3], np.zeros(3), np.zeros(3))}
    index = {link.name: k for k, link in enumerate(robot.tree_links)}
    remaining = list(robot.links)
    while remaining:
        link = next(link for link in remaining if link.parent in bodies)
        remaining.remove(link)
        parent, k = bodies[link.parent], index.get(link.name)
        T = np.asarray(link.pose(None if k is None else [q[k]]).matrix)
        p = parent.p + parent.R @ T[:3, 3]
        w, v = parent.w, parent.v + np.cross(parent.w, p - parent.p)
        if k is not None:
            near, _ = joint_frames(link)
            axis, origin = parent.R @ near.R[:, 2], parent.p + parent.R @ near.p
            if isinstance(link.joint, Revolute):
                w, v = w + qd[k] * axis, v + qd[k] * np.cross(axis, p - origin)
            else:
                v = v + qd[k] * axis
        bodies[link.name] = Body(parent.R @ T[:3, :3], p, w, v)
    return bodies


def joint_frames(link: Link) -> tuple[Frame, Frame]:
    """The frames on both sides of a link's joint, with z along its axis."""
    z = np.asarray(link.joint.axis)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    align = Transform(rotation=np.column_stack((x, np.cross(z, x), z)))
    near = np.asarray((link.before @ align).matrix)
    far = np.asarray((link.after.inverse() @ align).matrix)
    return Frame(link.parent, near[:3, :3], near[:3, 3]), Frame(link.name, far[:3, :3], far[:3, 3])


class Equations:
    """The second derivatives of relations as functions of the accelerations of all bodies."""

    def __init__(self, robot: Robot, q: Array, qd: Array) -> None:
        self.bodies = body_states(robot, q, qd)
        self.names = [link.name for link in robot.links]
        self.size = 6 * len(self.names)

    def row(self, relation: Relation, a: Frame, b: Frame) -> tuple[Array, float]:
        """The coefficients of the accelerations (a, alpha of each link), and the rest."""
        rest = self._second_derivative(relation, a, b, np.zeros(self.size))
        coefficients = np.zeros(self.size)
        for link in {a.link, b.link} - {None}:
            first = 6 * self.names.index(link)
            for k in range(first, first + 6):
                unit = np.eye(self.size)[k]
                coefficients[k] = self._second_derivative(relation, a, b, unit) - rest
        return coefficients, rest

    def _second_derivative(self, relation: Relation, a: Frame, b: Frame, accelerations: Array) -> float:
        (pa, ea), (pb, eb) = (self._motion(frame, accelerations) for frame in (a, b))
        d = [y - x for x, y in zip(pa, pb)]
        match relation:
            case NoDisplacement(axis):
                u, w = [e[:, axis] for e in ea], d
            case Perpendicular(first, second):
                u, w = [e[:, first] for e in ea], [e[:, second] for e in eb]
            case Distance(length):
                return float(2 * (d[1] @ d[1]) + 2 * (d[0] @ d[2])) / (2 * length)
            case _:
                raise AssertionError(relation)
        return float(u[2] @ w[0] + 2 * (u[1] @ w[1]) + u[0] @ w[2])

    def _motion(self, frame: Frame, accelerations: Array) -> tuple[list[Array], list[Array]]:
        """Position, velocity and acceleration of a frame's origin and of its axes."""
        body = self.bodies[frame.link]
        linear, alpha = np.zeros(3), np.zeros(3)
        if frame.link is not None:
            k = 6 * self.names.index(frame.link)
            linear, alpha = accelerations[k : k + 3], accelerations[k + 3 : k + 6]
        W, A = _cross(body.w), _cross(alpha)
        r, E = body.R @ frame.p, body.R @ frame.R
        point = [body.p + r, body.v + W @ r, linear + A @ r + W @ W @ r]
        return point, [E, W @ E, A @ E + W @ W @ E]


def accelerations(robot: Robot, q: Array, qd: Array, tau: Array) -> Array:
    """qdd (n,) for joint torques minus friction."""
    return _solved(robot, q, qd, tau)[0]


def reactions(robot: Robot, q: Array, qd: Array, tau: Array, relations: Sequence[int]) -> dict[str, Array]:
    """The wrench (6,) of the parent on each link, and of the first link of each closure on the second one.

    Forces, then moments about the origin of the link's frame, in world axes. ``relations``: the indices of
    independent relations of the closures, which alone transmit forces.
    """
    return _solved(robot, q, qd, tau, relations)[1]


def _solved(
    robot: Robot, q: Array, qd: Array, tau: Array, relations: Sequence[int] | None = None
) -> tuple[Array, dict[str, Array]]:
    """qdd (n,), and the wrenches of :func:`reactions`."""
    equations = Equations(robot, q, qd)
    n = equations.size
    M, force = np.zeros((n, n)), np.zeros(n)
    for k, link in zip(range(0, n, 6), robot.links):
        M[k : k + 6, k : k + 6], force[k : k + 6] = newton_euler(robot, link, equations.bodies[link.name])
    rows, rest = [np.zeros(n)][:0], [0.0][:0]
    speeds: list[tuple[Array, float]] = []
    owners: list[tuple[str, str | None]] = []
    drives: dict[str, Array] = {}
    for link in robot.links:
        a, b = joint_frames(link)
        for relation in JOINT_RELATIONS.get(type(link.joint), (*XYZ, *AXES_PARALLEL)):
            row, value = equations.row(relation, a, b)
            rows.append(row)
            rest.append(value)
            owners.append((link.name, link.name))
        drives[link.name] = np.zeros(n)
        if link.joint.moves:
            row, value = _coordinate(equations, link, a, b)
            drives[link.name] = tau[len(speeds)] * row
            force += drives[link.name]
            speeds.append((row, value))
    for index, (name, second, row, value) in enumerate(_constraint_rows(robot, equations, speeds)):
        drives[name] = np.zeros(n)
        if relations is not None and index not in relations:
            continue
        rows.append(row)
        rest.append(value)
        owners.append((name, second))
    J = np.array(rows)
    system = np.block([[M, J.T], [J, np.zeros((len(J), len(J)))]])
    solution = np.linalg.lstsq(system, np.concatenate((force, -np.array(rest))), rcond=1e-11)[0]
    wrenches = {name: drive.copy() for name, drive in drives.items()}
    for (name, _), row, multiplier in zip(owners, rows, solution[n:]):
        wrenches[name] -= multiplier * row
    on_link: dict[str, Array] = {}
    for name, link in owners:
        if link is not None:
            k = 6 * equations.names.index(link)
            on_link[name] = wrenches[name][k : k + 6]
    return np.array([row @ solution[:n] + value for row, value in speeds]), on_link


def _coordinate(equations: Equations, link: Link, a: Frame, b: Frame) -> tuple[Array, float]:
    """The acceleration of a joint's coordinate: displacement along z, or rotation about z."""
    if isinstance(link.joint, Prismatic):
        return equations.row(NoDisplacement(2), a, b)
    z = equations.bodies[a.link].R @ a.R[:, 2]
    row = np.zeros(equations.size)
    for sign, name in ((1.0, b.link), (-1.0, a.link)):
        if name is not None:
            k = 6 * equations.names.index(name)
            row[k + 3 : k + 6] += sign * z
    return row, 0.0


def _constraint_rows(
    robot: Robot, equations: Equations, speeds: list[tuple[Array, float]]
) -> Iterator[tuple[str, str | None, Array, float]]:
    """The name of each constraint, the link that its wrench acts on, and its equation."""
    names = [link.name for link in robot.tree_links]
    for constraint in robot.constraints:
        if isinstance(constraint, Coupling):
            terms = [(speeds[names.index(joint)], factor) for joint, factor in constraint.terms]
            yield (
                constraint.name,
                None,
                np.sum([factor * row for (row, _), factor in terms], axis=0),
                float(sum(factor * value for (_, value), factor in terms)),
            )
        elif isinstance(constraint, Closure):
            a, b = (Frame(end.link, *_parts(end.pose)) for end in (constraint.first, constraint.second))
            for relation in constraint.relations:
                yield constraint.name, b.link, *equations.row(relation, a, b)


def newton_euler(robot: Robot, link: Link, body: Body) -> tuple[Array, Array]:
    """Mass matrix (6, 6) about the frame's origin and applied minus gyroscopic forces, in world axes."""
    m, g = link.mass, np.asarray(robot.gravity)
    c = body.R @ np.asarray(link.centre_of_mass)
    C, W = _cross(c), _cross(body.w)
    moments = body.R @ np.asarray(link.inertia) @ body.R.T - m * C @ C
    M = np.block([[m * np.eye(3), -m * C], [m * C, moments]])
    return M, np.concatenate((m * (g - W @ W @ c), m * C @ g - W @ moments @ body.w))


def _parts(pose: Transform) -> tuple[Array, Array]:
    T = np.asarray(pose.matrix)
    return T[:3, :3], T[:3, 3]


def _cross(a: Array) -> Array:
    x, y, z = a
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
