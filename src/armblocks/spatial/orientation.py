"""Conversions between rotation matrices and angles, quaternions or axes, for symbols.

A rotation R = R_ab (3, 3) transforms coordinates in frame b to coordinates in frame a. Quaternions are (s, x,
y, z), the scalar first, as in the toolbox. Singular cases are described below. Otherwise the inverse
conversions are exact to rounding, also close to singular orientations, because the last angle is computed
after removing the other rotations.

Sources: Siciliano et al., Robotics, 2009, 2.4 to 2.6; Shepperd, Quaternion from rotation matrix, J. Guidance
and Control 1(3), 1978; Corke, Robotics Toolbox, releases 7 to 10 (rpy2tr, eul2tr, Quaternion).
"""

from __future__ import annotations

from collections.abc import Sequence

from casadi import SX, atan2, cos, dot, fmax, hypot, if_else, sin, sqrt, vertcat

from armblocks.spatial.rotation import RPY_CONVENTIONS, SINGULAR

SMALLEST = 1e-300
"""A divisor in place of zero, where the quotient is not used."""


def rotation_about_axis(axis: str, angle: SX) -> SX:
    """Rotation by ``angle`` rad about ``x``, ``y`` or ``z``."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    R = SX.zeros(3, 3)
    R[i, i] = 1.0
    R[j, j] = R[k, k] = cos(angle)
    R[k, j], R[j, k] = sin(angle), -sin(angle)
    return R


def from_rpy(roll: SX, pitch: SX, yaw: SX, convention: str) -> SX:
    """The rotation of roll, pitch and yaw (rad) by one of ``RPY_CONVENTIONS``."""
    order, roll_last = RPY_CONVENTIONS[convention]
    angles = (yaw, pitch, roll) if roll_last else (roll, pitch, yaw)
    first, second, third = (rotation_about_axis(axis, angle) for axis, angle in zip(order, angles))
    return first @ second @ third


def to_rpy(R: SX, convention: str) -> tuple[SX, SX, SX]:
    """Roll, pitch, yaw (rad) with abs(pitch) <= pi/2; at abs(pitch) = pi/2 roll is 0, as in the toolbox."""
    order, roll_last = RPY_CONVENTIONS[convention]
    if not roll_last:  # the transpose has the order and the signs of all angles reversed
        third, second, first = _three_angles(R.T, order[::-1])
        return -first, -second, -third
    yaw, pitch, roll = _three_angles(R, order)
    return roll, pitch, yaw


def from_euler(phi: SX, theta: SX, psi: SX) -> SX:
    """R = Rz(phi) Ry(theta) Rz(psi), the Euler angles ZYZ of every release of the toolbox (rad)."""
    about = rotation_about_axis
    return about("z", phi) @ about("y", theta) @ about("z", psi)


def to_euler(R: SX) -> tuple[SX, SX, SX]:
    """phi, theta, psi (rad) with 0 <= theta <= pi; phi is 0 if theta is 0 or pi, as in the toolbox."""
    singular = hypot(R[0, 2], R[1, 2]) < SINGULAR
    phi = if_else(singular, 0.0, atan2(R[1, 2], R[0, 2]))
    c, s = cos(phi), sin(phi)
    theta = atan2(c * R[0, 2] + s * R[1, 2], R[2, 2])
    psi = atan2(c * R[1, 0] - s * R[0, 0], c * R[1, 1] - s * R[0, 1])
    return phi, theta, psi


def from_quaternion(quaternion: SX) -> SX:
    """The rotation of a quaternion (4, 1) of any length; NaN for zero."""
    s, x, y, z = (quaternion[k] for k in range(4))
    scale = 2.0 / dot(quaternion, quaternion)
    rows = (
        (1.0 - scale * (y * y + z * z), scale * (x * y - s * z), scale * (x * z + s * y)),
        (scale * (x * y + s * z), 1.0 - scale * (x * x + z * z), scale * (y * z - s * x)),
        (scale * (x * z - s * y), scale * (y * z + s * x), 1.0 - scale * (x * x + y * y)),
    )
    return matrix(rows)


def to_quaternion(R: SX) -> SX:
    """The unit quaternion (4, 1) with s >= 0, by Shepperd's method, which divides by the largest element.

    A rotation by pi (s = 0) has two such quaternions. The quaternion jumps when the angle passes pi.
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    antisymmetric = (R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1])
    candidates = [vertcat(1.0 + trace, *antisymmetric)]
    for i in range(3):
        parts = [R[i, k] + R[k, i] for k in range(3)]
        parts[i] = 1.0 + 2.0 * R[i, i] - trace
        candidates.append(vertcat(antisymmetric[i], *parts))
    best, size = candidates[0], trace
    for i in range(3):
        greater = R[i, i] > size
        best, size = if_else(greater, candidates[i + 1], best), if_else(greater, R[i, i], size)
    unit = best / sqrt(dot(best, best))
    return if_else(unit[0] < 0.0, -unit, unit)


def from_angle_axis(angle: SX, axis: SX) -> SX:
    """The rotation by ``angle`` rad about ``axis`` (3, 1) of any nonzero length: Rodrigues' formula."""
    half = angle / 2.0
    return from_quaternion(vertcat(cos(half), sin(half) * axis / sqrt(dot(axis, axis))))


def to_angle_axis(R: SX) -> tuple[SX, SX]:
    """The angle, 0 to pi rad, and the unit axis (3, 1); for the identity the axis is (0, 0, 0)."""
    quaternion = to_quaternion(R)
    vector = quaternion[1:]
    length = sqrt(dot(vector, vector))
    axis = if_else(length > 0.0, vector / fmax(length, SMALLEST), SX.zeros(3))
    return 2.0 * atan2(length, quaternion[0]), axis


def fraction_of_rotation(quaternion: SX, s: SX) -> SX:
    """The quaternion (4, 1) of a rotation about the axis of a unit quaternion, by ``s`` times its angle.

    The result is also smooth at the identity, which has no axis: there the vector part is multiplied by
    ``s``.
    """
    vector = quaternion[1:]
    square = dot(vector, vector)
    is_identity = square < 1e-16
    length = sqrt(if_else(is_identity, 1.0, square))
    half = s * atan2(length, quaternion[0])
    return vertcat(if_else(is_identity, 1.0, cos(half)), if_else(is_identity, s, sin(half) / length) * vector)


def quaternion_product(left: SX, right: SX) -> SX:
    """Hamilton's product (4, 1): R(left right) = R(left) R(right)."""
    a, b, c, d = (left[k] for k in range(4))
    s, x, y, z = (right[k] for k in range(4))
    return vertcat(
        a * s - b * x - c * y - d * z,
        a * x + b * s + c * z - d * y,
        a * y - b * z + c * s + d * x,
        a * z + b * y - c * x + d * s,
    )


def matrix(rows: Sequence[Sequence[SX | float]]) -> SX:
    """A matrix from its rows of scalars."""
    result = SX.zeros(len(rows), len(rows[0]))
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            result[i, j] = value
    return result


def _three_angles(R: SX, order: str) -> tuple[SX, SX, SX]:
    """a, b, c with R = Ri(a) Rj(b) Rk(c) for three different axes; c is 0 if cos(b) is 0."""
    i, j, k = ("xyz".index(axis) for axis in order)
    e = 1.0 if (j - i) % 3 == 1 else -1.0
    cosine = hypot(R[i, i], R[i, j])
    b = atan2(e * R[i, k], cosine)
    c = if_else(cosine < SINGULAR, 0.0, atan2(-e * R[i, j], R[i, i]))
    # Column j of R Rk(-c) = Ri(a) Rj(b) does not depend on b.
    sine, cosine = e * sin(c), cos(c)
    a = atan2(e * (sine * R[k, i] + cosine * R[k, j]), sine * R[j, i] + cosine * R[j, j])
    return a, b, c
