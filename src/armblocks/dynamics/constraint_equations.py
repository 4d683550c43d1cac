"""The equations of closures: residuals, and their Jacobian with respect to the speeds.

The residual of a relation is 0 where it is satisfied. The Jacobian J (m, n) of all m relations maps the
speeds to the rates of the residuals, ``d/dt residual = J qd``, also where the residuals are not 0.
Source: Featherstone, *Rigid Body Dynamics Algorithms*, 8.2 (loop constraints).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from casadi import SX, horzcat, vertcat

from armblocks.dynamics.joint_motion import entries
from armblocks.dynamics.kinematics import Pose, body_poses, constant_pose, frame_pose
from armblocks.robot.constraints import (
    Attachment,
    Distance,
    NoDisplacement,
    Perpendicular,
    Relation,
)
from armblocks.robot.tree import BASE, Frame, KinematicTree
from armblocks.spatial import Transform
from armblocks.spatial.vectors import Scalar, Vector, add, cross, dot, scale, subtract


@dataclass(frozen=True, eq=False)
class ConstraintEquations:
    """The relations of all closures at one q, in the order of the robot's constraints.

    ``names``: the closure of each relation. ``residuals`` (m,), ``rows`` (m, n): J of the tree, in the
    order of its speeds.
    """

    n: int
    names: tuple[str, ...]
    residuals: tuple[Scalar, ...]
    rows: tuple[tuple[Scalar, ...], ...]

    def subset(self, indices: Sequence[int]) -> ConstraintEquations:
        """The relations with these indices."""
        names, residuals, rows = self.names, self.residuals, self.rows
        return ConstraintEquations(
            self.n,
            tuple(names[i] for i in indices),
            tuple(residuals[i] for i in indices),
            tuple(rows[i] for i in indices),
        )

    @property
    def residual_vector(self) -> SX:
        """The residuals as a column (m, 1)."""
        return SX(vertcat(*(SX(value) for value in self.residuals))) if self.residuals else SX(0, 1)

    @property
    def jacobian(self) -> SX:
        """J (m, n); entries that are zero for all q are structural zeros."""
        if not self.rows:
            return SX(0, self.n)
        return SX(vertcat(*(horzcat(*(_structural(entry) for entry in row)) for row in self.rows)))


def constraint_equations(tree: KinematicTree, q: SX) -> ConstraintEquations:
    """The relations of the closures of loops at ``q``, the coordinates of all joints of the tree."""
    ground = constant_pose(Transform())
    bodies = body_poses(tree, entries(q), ground)
    names: list[str] = []
    residuals: list[Scalar] = []
    rows: list[tuple[Scalar, ...]] = []
    for closure in tree.robot.closures:
        frames = FramePair.of(tree, closure.first, closure.second, bodies, ground)
        for relation in closure.relations:
            residual, row = frames.equation(relation)
            names.append(closure.name)
            residuals.append(residual)
            rows.append(tuple(row))
    return ConstraintEquations(tree.n, tuple(names), tuple(residuals), tuple(rows))


def attached_frame(tree: KinematicTree, attachment: Attachment) -> Frame:
    """The frame of an attachment, fixed to a body of the tree or to the base."""
    return tree.attached(attachment.link, attachment.pose)


@dataclass(frozen=True, eq=False)
class FramePair:
    """Two frames a and b, such as those of a closure, in base axes, and the motion of b relative to a.

    ``displacement``: from the origin of a to the origin of b. ``point_columns``, ``angular_columns``: by
    index in qd, the velocity of the origin of b relative to frame a, and the angular velocity of b relative
    to a, per unit speed. Joints that move both frames, or none, are absent: they do not change the relative
    pose.
    """

    n: int
    a: Pose
    b: Pose
    displacement: Vector
    point_columns: dict[int, Vector]
    angular_columns: dict[int, Vector]

    @classmethod
    def of(
        cls,
        tree: KinematicTree,
        first: Attachment,
        second: Attachment,
        bodies: Sequence[Pose],
        ground: Pose,
    ) -> FramePair:
        """The frames of two attachments."""
        ends = [attached_frame(tree, end) for end in (first, second)]
        a, b = (frame_pose(end, bodies, ground) for end in ends)
        moved = [set[int]() if end.body == BASE else {end.body, *tree.ancestors(end.body)} for end in ends]
        points: dict[int, Vector] = {}
        angles: dict[int, Vector] = {}
        for sign, own, other in ((-1.0, *moved), (1.0, *reversed(moved))):
            for i in sorted(own - other):
                body, pose = tree.bodies[i], bodies[i]
                w = scale(sign * body.angular, pose.z)
                v = cross(w, subtract(b.p, pose.p)) if body.angular else (0.0, 0.0, 0.0)
                points[body.speed] = add(v, scale(sign * body.linear, pose.z))
                angles[body.speed] = w
        return cls(tree.n, a, b, subtract(b.p, a.p), points, angles)

    def equation(self, relation: Relation) -> tuple[Scalar, list[Scalar]]:
        """The residual of a relation and its row of J."""
        match relation:
            case NoDisplacement(axis):
                direction = _axis(self.a, axis)
                # The axis rotates with a; the velocity of the point is relative to a, so this is exact.
                return dot(direction, self.displacement), self._row(self.point_columns, direction)
            case Perpendicular(first, second):
                e, f = _axis(self.a, first), _axis(self.b, second)
                # d/dt (e . f) = (w_b - w_a) . (f x e)
                return dot(e, f), self._row(self.angular_columns, cross(f, e))
            case Distance(length):
                d = self.displacement
                residual = (dot(d, d) - length * length) * (0.5 / length)
                return residual, self._row(self.point_columns, scale(1.0 / length, d))

    def _row(self, columns: dict[int, Vector], direction: Vector) -> list[Scalar]:
        row: list[Scalar] = [0.0] * self.n
        for index, column in columns.items():
            row[index] = dot(direction, column)
        return row


def _axis(pose: Pose, index: int) -> Vector:
    return (pose.x, pose.y, pose.z)[index]


def _structural(entry: Scalar) -> SX:
    """The entry; an exact zero as a structural zero, so that products with it are omitted."""
    value = SX(entry)
    return SX(1, 1) if value.is_zero() else value
