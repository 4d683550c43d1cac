"""The equations of ball joints: quaternions, and speeds that are not rates of coordinates.

In the tree of bodies a ball joint is a series of three bodies (:class:`armblocks.robot.tree.Body`). The first
body has the rotation of the whole joint. The angular velocity (wx wy wz) of the joint is the sum of three
angular velocities: about the x axis of the first, the y axis of the second and the z axis of the third body.
The algorithms treat each axis as fixed in the body before it, but all three are fixed in the last body. The
velocities do not depend on this difference; the angular accelerations do, see :func:`axis_accelerations`.

Source: Featherstone, *Rigid Body Dynamics Algorithms*, 4.4 and 4.5 (quaternions, ``q̇ ≠ qd``).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from casadi import SX, atan2, cos, fabs, fmax, if_else, sin, sqrt

from armblocks.robot.joints import AxisMotion, Motion
from armblocks.robot.robot import Robot
from armblocks.robot.tree import Body, KinematicTree
from armblocks.spatial.vectors import Matrix, Rotation, RotationZ, Scalar, Vector, cross, dot, scale

Quaternion = tuple[Scalar, Scalar, Scalar, Scalar]
"""w x y z."""

SHRINK, GROW = 2.0**-520, 2.0**600
"""Factors of quaternions whose squared length is outside ``SQUARES``; powers of two do not round."""
SQUARES = 1e-280, 1e280
TINY = 1e-32
"""Smallest square of an angle: its sine and tangent equal the angle, and higher derivatives, which divide by
powers of it, are finite."""


def ball_rotation(body: Body, q: Sequence[Scalar]) -> Rotation | RotationZ:
    """The rotation of one of the three bodies of a ball joint relative to the body before it."""
    if body.ball != 0:
        return RotationZ(1.0, 0.0)
    w, x, y, z = _moderate(q[body.position : body.position + 4])
    # The quaternion in the axes of the first body, which are y, z, x of the joint.
    return Rotation(rotation_of((w, y, z, x)))


def rotation_of(quaternion: Quaternion) -> Matrix:
    """The rotation matrix of a quaternion of any length above zero: ``R(k q) = R(q)``."""
    w, x, y, z = quaternion
    s = 2.0 / (w * w + x * x + y * y + z * z)
    sx, sy, sz = s * x, s * y, s * z
    return (
        (1.0 - (sy * y + sz * z), sx * y - sz * w, sx * z + sy * w),
        (sx * y + sz * w, 1.0 - (sx * x + sz * z), sy * z - sx * w),
        (sx * z - sy * w, sy * z + sx * w, 1.0 - (sx * x + sy * y)),
    )


def _moderate(quaternion: Sequence[Scalar]) -> Quaternion:
    """A multiple of a quaternion whose squared length neither overflows nor underflows.

    Quaternions of lengths between 1e-140 and 1e140 are unchanged.
    """
    w, x, y, z = quaternion
    square = SX(w * w + x * x + y * y + z * z)
    factor = if_else(square < SQUARES[0], GROW, if_else(square > SQUARES[1], SHRINK, 1.0))
    return factor * w, factor * x, factor * y, factor * z


def axis_accelerations(tree: KinematicTree, qd: Sequence[Scalar], qdd: Sequence[Scalar]) -> Sequence[Scalar]:
    """The accelerations of the bodies' joints if each axis were fixed in the body before it, by ``speed``.

    The angular velocity is ``w = wx x + wy y + wz z`` in axes that are fixed in the last body, and the
    angular acceleration is ``w'``. For a series of three axes the algorithms add the cross products
    ``wx x × wy y + (wx x + wy y) × wz z = (wy wz, -wx wz, wx wy)``, which are therefore subtracted here.
    """
    return _without_cross_products(tree, qd, qdd, 1.0)


def speed_rates(tree: KinematicTree, qd: Sequence[Scalar], accelerations: Sequence[SX]) -> list[SX]:
    """``qdd`` from the accelerations of :func:`axis_accelerations`."""
    return [SX(entry) for entry in _without_cross_products(tree, qd, accelerations, -1.0)]


def _without_cross_products(
    tree: KinematicTree, qd: Sequence[Scalar], accelerations: Sequence[Scalar], sign: float
) -> Sequence[Scalar]:
    balls = [body.speed for body in tree.bodies if body.ball == 0]
    if not balls:
        return accelerations
    changed = list(accelerations)
    for k in balls:
        wx, wy, wz = qd[k : k + 3]
        changed[k] = changed[k] - sign * (wy * wz)
        changed[k + 1] = changed[k + 1] + sign * (wx * wz)
        changed[k + 2] = changed[k + 2] - sign * (wx * wy)
    return changed


def structure_matrix(tree: KinematicTree, qd: Sequence[Scalar]) -> SX | None:
    """``W(qd)`` (n, n): ``[w]×`` on the diagonal for each ball joint, else zero; None without ball joints.

    ``W[l][j] = sum_i qd_i c_ij^l`` with the structure coefficients of the speeds, ``[X_i, X_j] = c_ij^l X_l``
    for the vector fields that belong to unit speeds (Hamel's symbols).
    """
    balls = [body.speed for body in tree.bodies if body.ball == 0]
    if not balls:
        return None
    W = SX(tree.n, tree.n)
    for k in balls:
        x, y, z = qd[k : k + 3]
        W[k, k + 1], W[k, k + 2], W[k + 1, k + 2] = -z, y, -x
        W[k + 1, k], W[k + 2, k], W[k + 2, k + 1] = z, -y, x
    return W


def position_rates(robot: Robot, q: Sequence[Scalar], qd: Sequence[Scalar]) -> list[Scalar]:
    """The rates of the coordinates, ``q̇ = N(q) qd``: ``qd`` itself, and for a quaternion Q ``Q (0, w) / 2``.

    The length of a quaternion is constant.
    """
    rates: list[Scalar] = []
    for is_ball, coordinates, speeds in _motions(robot, q, qd):
        rates += [0.5 * entry for entry in _product(coordinates, (0.0, *speeds))] if is_ball else speeds
    return rates


def integrated(robot: Robot, q: Sequence[Scalar], qd: Sequence[Scalar], dt: Scalar) -> list[Scalar]:
    """The coordinates after the time ``dt`` at constant ``qd``; quaternions have length 1."""
    result: list[Scalar] = []
    for is_ball, coordinates, speeds in _motions(robot, q, qd):
        if is_ball:
            result += _product(_unit(coordinates), _exponential(scale(0.5 * dt, _three(speeds))))
        else:
            result += [coordinates[0] + speeds[0] * dt]
    return result


def difference(robot: Robot, q0: Sequence[Scalar], q1: Sequence[Scalar]) -> list[Scalar]:
    """The constant ``qd`` that leads from ``q0`` to ``q1`` in unit time; angles of balls are at most π."""
    result: list[Scalar] = []
    for (is_ball, start, _), (_, end, _) in zip(_motions(robot, q0), _motions(robot, q1)):
        if is_ball:
            w, x, y, z = _moderate(start)
            result += scale(2.0, _logarithm(_product((w, -x, -y, -z), _moderate(end))))
        else:
            result += [end[0] - start[0]]
    return result


def normalised(robot: Robot, q: Sequence[Scalar]) -> list[Scalar]:
    """The coordinates with quaternions of length 1."""
    result: list[Scalar] = []
    for is_ball, coordinates, _ in _motions(robot, q):
        result += _unit(coordinates) if is_ball else coordinates
    return result


def motion_of_rates(
    robot: Robot, q: Sequence[Scalar], rates: Sequence[Scalar], second_rates: Sequence[Scalar]
) -> tuple[list[Scalar], list[Scalar]]:
    """``qd`` and ``qdd`` (n,) from the first and second time derivatives of ``q`` (nq,), of any length.

    For a quaternion Q of any length, ``w = 2 vec(Q* Q') / |Q|²``, and its derivative.
    """
    motions = [motion for joint in robot.joints for motion in joint.motions]
    return speeds_of_rates(motions, q, rates, second_rates)


def speeds_of_rates(
    motions: Sequence[Motion], q: Sequence[Scalar], rates: Sequence[Scalar], second_rates: Sequence[Scalar]
) -> tuple[list[Scalar], list[Scalar]]:
    """As :func:`motion_of_rates`, for a sequence of elementary motions."""
    speeds: list[Scalar] = []
    accelerations: list[Scalar] = []
    position = 0
    for motion in motions:
        part = slice(position, position + len(motion.positions))
        position = part.stop
        if isinstance(motion, AxisMotion):
            speeds += rates[part]
            accelerations += second_rates[part]
            continue
        Q, rate = q[part], rates[part]
        conjugate = (Q[0], -Q[1], -Q[2], -Q[3])
        square = Q[0] * Q[0] + Q[1] * Q[1] + Q[2] * Q[2] + Q[3] * Q[3]
        growth = 2.0 * (Q[0] * rate[0] + Q[1] * rate[1] + Q[2] * rate[2] + Q[3] * rate[3])
        w = [2.0 * value / square for value in _product(conjugate, rate)[1:]]
        second = _product(conjugate, second_rates[part])[1:]
        speeds += w
        accelerations += [(2.0 * a - growth * b) / square for a, b in zip(second, w)]
    return speeds, accelerations


def rotation_vector(quaternion: Sequence[Scalar]) -> Vector:
    """The rotation vector (rad), of length at most π, of a quaternion w x y z of any length but zero."""
    return scale(2.0, _logarithm(_moderate(quaternion)))


def _motions(
    robot: Robot, q: Sequence[Scalar], qd: Sequence[Scalar] = ()
) -> Iterator[tuple[bool, Sequence[Scalar], Sequence[Scalar]]]:
    """For each elementary motion of the joints: whether it is a ball, and its parts of q and qd."""
    position = speed = 0
    for joint in robot.joints:
        for motion in joint.motions:
            nq, nv = len(motion.positions), len(motion.speeds)
            coordinates, speeds = q[position : position + nq], qd[speed : speed + nv]
            yield not isinstance(motion, AxisMotion), coordinates, speeds
            position, speed = position + nq, speed + nv


def _three(values: Sequence[Scalar]) -> Vector:
    x, y, z = values
    return x, y, z


def _unit(quaternion: Sequence[Scalar]) -> Quaternion:
    w, x, y, z = _moderate(quaternion)
    factor = 1.0 / sqrt(w * w + x * x + y * y + z * z)
    return w * factor, x * factor, y * factor, z * factor


def _product(a: Sequence[Scalar], b: Sequence[Scalar]) -> Quaternion:
    """The product of two quaternions."""
    (s, *u), (t, *v) = a, b
    x, y, z = cross(_three(u), _three(v))
    return (
        s * t - dot(_three(u), _three(v)),
        s * v[0] + t * u[0] + x,
        s * v[1] + t * u[1] + y,
        s * v[2] + t * u[2] + z,
    )


def _exponential(half: Vector) -> Quaternion:
    """The unit quaternion of a rotation by twice the vector ``half``."""
    angle = _length(half, SX(1.0))
    x, y, z = scale(sin(angle) / angle, half)
    return cos(angle), x, y, z


def _logarithm(quaternion: Quaternion) -> Vector:
    """The vector ``half`` of at most π/2 whose exponential is plus or minus the quaternion's direction."""
    w, x, y, z = quaternion
    length = _length((x, y, z), SX(w))
    factor = atan2(length, fabs(w)) / length
    return scale(if_else(SX(w) < 0.0, -factor, factor), (x, y, z))


def _length(vector: Vector, unit: SX) -> SX:
    """The length of a vector, at least the root of ``TINY`` times ``unit``.

    A bound, unlike a condition, causes no event where the vector passes zero.
    """
    return sqrt(fmax(SX(dot(vector, vector)), TINY * unit * unit))
