"""The joint-space inertia matrix by the composite-rigid-body algorithm, and its factors."""

from __future__ import annotations

from collections.abc import Sequence

from casadi import SX

from armblocks.dynamics.joint_motion import JointMotion
from armblocks.robot.tree import BASE, KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Scalar, Vector, add, cross, rotate_symmetric

SquareMatrix = list[list[Scalar]]
"""Rows of scalars; entries that are zero for all q are the number 0."""


def crba(tree: KinematicTree, joints: Sequence[JointMotion]) -> SquareMatrix:
    """The inertia matrix of the rigid bodies and rotors, in the order of the *bodies*.

    ``tree`` may have regrouped parameters. Source: Featherstone, *Rigid Body Dynamics Algorithms*, table 6.2,
    with three-vectors in body frames.
    """
    n = tree.n
    bodies = tree.bodies
    M: SquareMatrix = [[0.0] * n for _ in range(n)]
    composite = [body.inertia for body in bodies]
    for i in reversed(range(n)):
        body, inertia = bodies[i], composite[i]
        # 1. Add each composite body to the composite body of its parent.
        if body.parent != BASE:
            composite[body.parent] = composite[body.parent].plus(_in_parent(inertia, joints[i]))
        # 2. The wrench that gives the composite body unit acceleration of joint i.
        h, S = inertia.first, inertia.second
        force: Vector = (-body.angular * h[1], body.angular * h[0], body.linear * inertia.mass)
        moment: Vector = (
            body.angular * S.xz + body.linear * h[1],
            body.angular * S.yz - body.linear * h[0],
            body.angular * S.zz,
        )
        M[i][i] = body.angular * moment[2] + body.linear * force[2] + body.reflected_inertia
        # 3. Torque at the ancestor joints (toward the base).
        j = i
        while bodies[j].parent != BASE:
            force_in_parent = joints[j].to_parent(force)
            moment = add(joints[j].to_parent(moment), cross(joints[j].p, force_in_parent))
            force = force_in_parent
            j = bodies[j].parent
            M[i][j] = M[j][i] = bodies[j].angular * moment[2] + bodies[j].linear * force[2]
    return M


def _in_parent(inertia: RigidInertia, joint: JointMotion) -> RigidInertia:
    """A body's inertia in its parent's frame."""
    second = rotate_symmetric(joint.body.placement.rotation, joint.rotation.rotate_symmetric(inertia.second))
    return RigidInertia(inertia.mass, joint.to_parent(inertia.first), second).shifted(joint.p)


class FactoredInertia:
    """The factors of the inertia matrix: ``M = L' D L``, in the order of the bodies.

    They are computed from the tips to the base, so that entries that are zero between branches stay zero.
    Source: Featherstone, *Rigid Body Dynamics Algorithms*, 6.5 (tables 6.3 and 6.4).
    """

    def __init__(self, tree: KinematicTree, M: SquareMatrix) -> None:
        n = tree.n
        H = [list(row) for row in M]
        self._ancestors = [tree.ancestors(k) for k in range(n)]
        self._inverse_pivots: list[SX] = [SX(0.0)] * n
        self._factors = H
        for k in reversed(range(n)):
            # This is 1 / H[k][k]. With that expression CasADi would replace every product with it by a
            # division.
            self._inverse_pivots[k] = 2.0 / (SX(H[k][k]) + H[k][k])
            factors = {i: H[k][i] * self._inverse_pivots[k] for i in self._ancestors[k]}
            for i in self._ancestors[k]:
                for j in (i, *self._ancestors[i]):
                    H[i][j] = H[i][j] - factors[i] * H[k][j]
            for i in self._ancestors[k]:
                H[k][i] = factors[i]

    def solve(self, b: Sequence[Scalar]) -> list[SX]:
        """``x`` with ``M x = b``, both in the order of the bodies."""
        n = len(b)
        x = [SX(entry) for entry in b]
        for k in reversed(range(n)):
            for i in self._ancestors[k]:
                x[i] = x[i] - self._factors[k][i] * x[k]
        for i in range(n):
            x[i] = x[i] * self._inverse_pivots[i]
            for j in self._ancestors[i]:
                x[i] = x[i] - self._factors[i][j] * x[j]
        return x
