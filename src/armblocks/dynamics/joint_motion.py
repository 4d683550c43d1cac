"""The motion of the frames on both sides of a joint."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from casadi import OP_NEG, SX, cos, sin

from armblocks.dynamics.ball_joints import ball_rotation
from armblocks.robot.tree import Body, KinematicTree
from armblocks.spatial.vectors import Rotation, RotationZ, Scalar, Vector, add, rotate


@dataclass(frozen=True, eq=False)
class JointMotion:
    """The motion of a body's joint at one q: ``rotation``, about z except for ball joints, and ``p``.

    ``p`` is the position of the body's origin in the parent body's frame, m.
    """

    body: Body
    rotation: RotationZ | Rotation
    p: Vector

    def to_body(self, a: Vector) -> Vector:
        """A vector, transformed from axes of the parent body to axes of the body."""
        return self.rotation.rotate_back(self.to_joint(a))

    def to_joint(self, a: Vector) -> Vector:
        """A vector, transformed from axes of the parent body to axes of the unrotated joint."""
        R = self.body.placement.rotation
        return rotate((_column(R, 0), _column(R, 1), _column(R, 2)), a)

    def to_parent(self, a: Vector) -> Vector:
        """A vector, transformed from axes of the body to axes of the parent body."""
        return rotate(self.body.placement.rotation, self.rotation.rotate(a))


def joint_motions(tree: KinematicTree, q: SX) -> list[JointMotion]:
    """The motion of every body's joint; ``q`` column (nq, 1)."""
    return [_motion(body, entries(q)) for body in tree.bodies]


def entries(x: SX | Sequence[Scalar]) -> list[Scalar]:
    """The entries of a column, as scalars."""
    return [x[i] for i in range(x.numel())] if isinstance(x, SX) else list(x)


def cos_sin(variable: Scalar, constant: float) -> RotationZ:
    """cos and sin of ``variable + constant``; a constant multiple of 90 degrees needs no operations."""
    quarters = round(constant / (math.pi / 2))
    if abs(constant - quarters * (math.pi / 2)) > 4 * math.ulp(max(abs(constant), math.pi / 2)):
        variable, quarters = variable + constant, 0
    variable = SX(variable)
    if variable.is_op(OP_NEG):
        # The joints of a parallelogram have opposite angles.
        c, s = cos(variable.dep()), -sin(variable.dep())
    else:
        c, s = cos(variable), sin(variable)
    match quarters % 4:
        case 0:
            return RotationZ(c, s)
        case 1:
            return RotationZ(-s, c)
        case 2:
            return RotationZ(-c, -s)
        case _:
            return RotationZ(s, -c)


def _motion(body: Body, coordinates: Sequence[Scalar]) -> JointMotion:
    p: Vector = body.placement.translation
    if body.ball is not None:
        return JointMotion(body, ball_rotation(body, coordinates), p)
    q = coordinates[body.position]
    rotation = cos_sin(body.angular * q, body.angular * body.offset) if body.angular else RotationZ(1.0, 0.0)
    if body.linear:
        shift = body.linear * q + body.linear * body.offset
        p = add(p, rotate(body.placement.rotation, (0.0, 0.0, shift)))
    return JointMotion(body, rotation, p)


def _column(R: tuple[tuple[float, float, float], ...], j: int) -> tuple[float, float, float]:
    return R[0][j], R[1][j], R[2][j]
