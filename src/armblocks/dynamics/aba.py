"""Forward dynamics without the inertia matrix: the articulated-body algorithm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from casadi import SX, mtimes, vertcat

from armblocks.dynamics.ball_joints import axis_accelerations, speed_rates
from armblocks.dynamics.joint_motion import JointMotion
from armblocks.dynamics.rnea import Wrench
from armblocks.robot.tree import BASE, KinematicTree
from armblocks.spatial.inertia import RigidInertia
from armblocks.spatial.vectors import Matrix, Scalar, Vector, multiply


def aba(
    tree: KinematicTree,
    joints: Sequence[JointMotion],
    qd: Sequence[Scalar],
    tau: Sequence[Scalar],
    gravity: Vector,
    on_bodies: Mapping[int, Wrench] | None = None,
) -> list[SX]:
    """Joint accelerations from the joint torques minus friction, in the order of qd.

    ``on_bodies``: wrenches that bodies exert on the surroundings, each in its body's frame. Spatial vectors
    have the angular part first. The cost is proportional to n instead of n^3, an advantage for long chains.
    Source: Featherstone, *Rigid Body Dynamics Algorithms*, table 7.1, which numbers the passes in the same
    way; rotor inertia is added to the inertia of each joint.
    """
    bodies = tree.bodies
    X = [_motion_transform(joint) for joint in joints]
    S = [SX(vertcat(0.0, 0.0, body.angular, 0.0, 0.0, body.linear)) for body in bodies]
    IA = [_matrix_of(body.inertia) for body in bodies]
    v: list[SX] = []
    c: list[SX] = []
    pA: list[SX] = []
    # 1. Outward: velocities and velocity-product terms.
    for i, body in enumerate(bodies):
        vJ = S[i] * qd[body.speed]
        inherited = SX(6, 1) if body.parent == BASE else mtimes(X[i], v[body.parent])
        v.append(inherited + vJ)
        c.append(_cross_motion(v[i], vJ))
        bias = -mtimes(_cross_matrix(v[i]).T, mtimes(IA[i], v[i]))
        if on_bodies and i in on_bodies:
            bias = bias + vertcat(*on_bodies[i].moment, *on_bodies[i].force)
        pA.append(bias)
    # The rotors of ball joints have the accelerations qdd; the bodies have the accelerations of a series of
    # axes.
    shift = axis_accelerations(tree, qd, [0.0] * tree.n)
    U: list[SX] = [SX(6, 1)] * tree.n
    d: list[SX] = [SX(1, 1)] * tree.n
    u: list[SX] = [SX(1, 1)] * tree.n
    # 2. Inward: articulated inertias and bias forces.
    for i in reversed(range(tree.n)):
        body = bodies[i]
        U[i] = mtimes(IA[i], S[i])
        pivot = mtimes(S[i].T, U[i]) + body.reflected_inertia
        # This is 1 / pivot. With that expression CasADi would replace every product with d by a division.
        d[i] = 2.0 / (pivot + pivot)
        rotor = body.reflected_inertia * shift[body.speed]
        u[i] = tau[body.speed] + rotor - mtimes(S[i].T, pA[i])
        if body.parent != BASE:
            Ia = IA[i] - mtimes(U[i], U[i].T) * d[i]
            pa = pA[i] + mtimes(Ia, c[i]) + U[i] * (d[i] * u[i])
            IA[body.parent] = IA[body.parent] + mtimes(mtimes(X[i].T, Ia), X[i])
            pA[body.parent] = pA[body.parent] + mtimes(X[i].T, pa)
    # 3. Outward: accelerations.
    ground = SX(vertcat(0.0, 0.0, 0.0, -gravity[0], -gravity[1], -gravity[2]))
    a: list[SX] = []
    qdd: list[SX] = [SX(1, 1)] * tree.n
    for i, body in enumerate(bodies):
        carried = mtimes(X[i], ground if body.parent == BASE else a[body.parent]) + c[i]
        qdd[body.speed] = d[i] * (u[i] - mtimes(U[i].T, carried))
        a.append(carried + S[i] * qdd[body.speed])
    return speed_rates(tree, qd, qdd)


def _motion_transform(joint: JointMotion) -> SX:
    """The transform of motion vectors from the parent body to the body: ``[E 0; -E [p]x E]``."""
    R = multiply(joint.body.placement.rotation, joint.rotation.matrix())
    E = _sx(R).T
    lower = -mtimes(E, _skew(joint.p))
    return _stack(E, SX(3, 3), lower, E)


def _matrix_of(inertia: RigidInertia) -> SX:
    """The spatial inertia ``[I, [h]x; [h]x', m 1]``."""
    S = inertia.second
    second: Matrix = ((S.xx, S.xy, S.xz), (S.xy, S.yy, S.yz), (S.xz, S.yz, S.zz))
    m = inertia.mass
    hx = _skew(inertia.first)
    return _stack(_sx(second), hx, hx.T, _sx(((m, 0.0, 0.0), (0.0, m, 0.0), (0.0, 0.0, m))))


def _cross_matrix(v: SX) -> SX:
    """The matrix ``v x`` for motion vectors; minus its transpose is ``v x*`` for forces."""
    w = _skew((v[0], v[1], v[2]))
    return _stack(w, SX(3, 3), _skew((v[3], v[4], v[5])), w)


def _cross_motion(v: SX, m: SX) -> SX:
    return mtimes(_cross_matrix(v), m)


def _skew(a: Vector) -> SX:
    x, y, z = a
    return _sx(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def _sx(A: Matrix) -> SX:
    result = SX(3, 3)
    for i in range(3):
        for j in range(3):
            entry = SX(A[i][j])
            if not entry.is_zero():
                result[i, j] = entry
    return result


def _stack(a: SX, b: SX, c: SX, d: SX) -> SX:
    """``[a b; c d]`` of four (3, 3) blocks."""
    result = SX(6, 6)
    result[:3, :3], result[:3, 3:], result[3:, :3], result[3:, 3:] = a, b, c, d
    return result
