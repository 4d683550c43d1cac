"""Rotations, poses and twists as arrays: angles, quaternions, exponential, logarithm, interpolation.

Names are the same as in the Robotics Toolbox. Every function takes one value or N of them: (3, 3) or (N, 3,
3), (4, 4) or (N, 4, 4), (3,) or (N, 3). Poses and rotations may also be a :class:`Transform`, or an ``SE3``,
``SO3``, ``UnitQuaternion`` or ``Twist3`` of spatialmath, except in :func:`r2t` and :func:`rt2tr`.
:func:`trexp` and :func:`trinterp` return objects of spatialmath if their first argument is one; the other
functions return arrays. Angles are in rad, or with ``unit="deg"`` in degrees. NaN gives NaN.

Results are accurate to rounding for all angles, including small angles and half a turn. Sources: Siciliano et
al., Robotics, 2009, chapter 2; Lynch and Park, Modern Robotics, 2017, 3.2 and 3.3; Shepperd, J. Guidance and
Control 1(3), 1978.
"""

from __future__ import annotations

import sys
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import with_argument_errors
from armblocks.errors import InputError, UnknownNameError
from armblocks.spatial.rotation import RPY_CONVENTIONS, SINGULAR
from armblocks.spatial.transform import ORTHONORMALITY, Transform

Array = NDArray[np.float64]
PoseLike: TypeAlias = Any
"""A Transform, an array of one or N rotations or poses, or an object of spatialmath."""

SMALL_ANGLE = 0.1
"""Below this angle, rad, quotients of small numbers are Taylor series."""
UNITS = ("rad", "deg")


# ---- angles ----------------------------------------------------------------------------------------------
@with_argument_errors
def rpy2r(rpy: ArrayLike, order: str = "zyx", *, unit: str = "rad") -> Array:
    """The rotation (3, 3) of roll, pitch, yaw (3,).

    ``order``: ``"zyx"`` is R = Rz(yaw) Ry(pitch) Rx(roll), the default of release 10 and of the Python
    toolbox; ``"xyz"`` and ``"yxz"`` are their other orders. ``"release 9"`` (and 8): R = Rx(roll) Ry(pitch)
    Rz(yaw). ``"release 7"``: R = Rz(roll) Ry(pitch) Rx(yaw). Raises UnknownNameError for another order.
    """
    axes, roll_last = _order(order, "rpy2r")
    angles = _angles(rpy, unit, "rpy2r")
    return _about_three(axes, angles[..., ::-1] if roll_last else angles)


@with_argument_errors
def rpy2tr(rpy: ArrayLike, order: str = "zyx", *, unit: str = "rad") -> Array:
    """The pose (4, 4) without displacement of roll, pitch, yaw (3,); ``order`` as for :func:`rpy2r`."""
    return r2t(rpy2r(rpy, order, unit=unit))


@with_argument_errors
def tr2rpy(T: PoseLike, order: str = "zyx", *, unit: str = "rad") -> Array:
    """Roll, pitch, yaw (3,) of a pose or rotation, ``abs(pitch) <= pi/2``; ``order`` as for :func:`rpy2r`.

    At ``abs(pitch) = pi/2`` roll is 0, as in the toolbox.
    """
    axes, roll_last = _order(order, "tr2rpy")
    R = rotations(T, "tr2rpy")
    if roll_last:
        return _in_unit(_three_angles(R, axes)[..., ::-1], unit, "tr2rpy")
    # The transpose has the order and the signs of all angles reversed.
    return _in_unit(-_three_angles(np.swapaxes(R, -1, -2), axes[::-1])[..., ::-1], unit, "tr2rpy")


@with_argument_errors
def eul2r(angles: ArrayLike, *, unit: str = "rad") -> Array:
    """The rotation (3, 3) of Euler angles phi, theta, psi (3,): R = Rz(phi) Ry(theta) Rz(psi)."""
    return _about_three("zyz", _angles(angles, unit, "eul2r"))


@with_argument_errors
def eul2tr(angles: ArrayLike, *, unit: str = "rad") -> Array:
    """The pose (4, 4) without displacement of Euler angles ZYZ (3,)."""
    return r2t(eul2r(angles, unit=unit))


@with_argument_errors
def tr2eul(T: PoseLike, *, unit: str = "rad") -> Array:
    """Euler angles ZYZ phi, theta, psi (3,) with 0 <= theta <= pi; phi is 0 if theta is 0 or pi."""
    R = rotations(T, "tr2eul")
    x, y = R[..., 0, 2], R[..., 1, 2]
    phi = np.where(np.hypot(x, y) < SINGULAR, 0.0, np.arctan2(y, x))
    c, s = np.cos(phi), np.sin(phi)
    theta = np.arctan2(c * x + s * y, R[..., 2, 2])
    psi = np.arctan2(c * R[..., 1, 0] - s * R[..., 0, 0], c * R[..., 1, 1] - s * R[..., 0, 1])
    return _in_unit(np.stack([phi, theta, psi], axis=-1), unit, "tr2eul")


@with_argument_errors
def angvec2r(angle: ArrayLike, axis: ArrayLike, *, unit: str = "rad") -> Array:
    """The rotation (3, 3) by an angle about an axis (3,) of any length. Raises InputError for a zero axis."""
    vector = _vectors(axis, 3, "angvec2r")
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    if (length == 0.0).any():
        raise InputError(
            "the axis of a rotation is 0 0 0",
            where="angvec2r",
            allowed="an axis x y z other than zero",
            fix="give (0, 0, 1) for a rotation about z",
        )
    half = 0.5 * _angles(np.asarray(angle, dtype=np.float64)[..., None], unit, "angvec2r", size=1)
    scalar, vector = np.cos(half), np.sin(half) * vector / length
    scalar = np.broadcast_to(scalar, (*vector.shape[:-1], 1))
    return q2r(np.concatenate([scalar, vector], axis=-1))


@with_argument_errors
def tr2angvec(T: PoseLike, *, unit: str = "rad") -> tuple[Array, Array]:
    """The angle, 0 to pi, and the unit axis (3,) of a rotation; the axis of the identity is (0, 0, 0)."""
    vector = _logarithm(rotations(T, "tr2angvec"))
    angle = np.linalg.norm(vector, axis=-1)
    axis = vector / np.where(angle == 0.0, 1.0, angle)[..., None]
    return _in_unit(np.asarray(angle), unit, "tr2angvec"), axis


# ---- quaternions -----------------------------------------------------------------------------------------
@with_argument_errors
def r2q(T: PoseLike) -> Array:
    """The unit quaternion (4,) w x y z with w >= 0 of a pose or rotation, by Shepperd's method."""
    R = rotations(T, "r2q")
    trace = np.trace(R, axis1=-2, axis2=-1)
    diagonal = np.diagonal(R, axis1=-2, axis2=-1)
    antisymmetric = [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]]
    candidates = [np.stack([1.0 + trace, *antisymmetric], axis=-1)]
    for i in range(3):
        parts = [R[..., i, k] + R[..., k, i] for k in range(3)]
        parts[i] = 1.0 + 2.0 * R[..., i, i] - trace
        candidates.append(np.stack([antisymmetric[i], *parts], axis=-1))
    best = np.argmax(np.concatenate([trace[..., None], diagonal], axis=-1), axis=-1)
    chosen: Array = np.choose(best[..., None], candidates)
    unit: Array = chosen / np.linalg.norm(chosen, axis=-1, keepdims=True)
    return np.where(unit[..., :1] < 0.0, -unit, unit)


@with_argument_errors
def q2r(q: PoseLike) -> Array:
    """The rotation (3, 3) of a quaternion (4,) w x y z of any length. Raises InputError for zero."""
    quaternion = _quaternions(q, "q2r")
    w, x, y, z = np.moveaxis(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@with_argument_errors
def qmul(left: PoseLike, right: PoseLike) -> Array:
    """Hamilton's product (4,) of quaternions: R(left right) = R(left) R(right)."""
    a, b = _quaternions(left, "qmul"), _quaternions(right, "qmul")
    scalar = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(axis=-1, keepdims=True)
    vector = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


@with_argument_errors
def qinterp(q0: PoseLike, q1: PoseLike, s: ArrayLike) -> Array:
    """The unit quaternions from ``q0`` (s = 0) to ``q1`` (s = 1) on the shorter great circle (slerp).

    ``s`` is a number or (N,).
    """
    return r2q(_interpolated(q2r(q0), q2r(q1), np.asarray(s, dtype=np.float64)))


# ---- exponential and logarithm ---------------------------------------------------------------------------
@with_argument_errors
def skew(w: ArrayLike) -> Array:
    """The skew-symmetric matrix (3, 3) of a vector (3,): ``skew(a) b = a × b``."""
    vector = _vectors(w, 3, "skew")
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


@with_argument_errors
def vex(S: ArrayLike) -> Array:
    """The vector (3,) of the skew-symmetric part of a matrix (3, 3): the inverse of :func:`skew`."""
    matrix = np.asarray(S, dtype=np.float64)
    if matrix.shape[-2:] != (3, 3):
        raise _shape_error(matrix.shape, "(3, 3) or (N, 3, 3)", "vex")
    odd = 0.5 * (matrix - np.swapaxes(matrix, -1, -2))
    return np.stack([odd[..., 2, 1], odd[..., 0, 2], odd[..., 1, 0]], axis=-1)


@with_argument_errors
def trexp(S: PoseLike, theta: ArrayLike = 1.0) -> PoseLike:
    """The rotation of ``theta`` times a rotation vector, or the pose of ``theta`` times a twist.

    A rotation vector has the shape (3,), a twist ``v, w`` the shape (6,). A twist of spatialmath gives an
    ``SE3``.
    """
    array, kind = _array_of(S)
    if array.shape[-1:] not in ((3,), (6,)):
        raise _shape_error(array.shape, "(3,) rotation vectors or (6,) twists v w", "trexp")
    vector = array * np.asarray(theta, dtype=np.float64)[..., None]
    if array.shape[-1] == 3:
        return _exponential(vector)
    v, w = vector[..., :3], vector[..., 3:]
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    W = skew(w)
    one_minus_cos = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    V = np.eye(3) + one_minus_cos * W + _angle_minus_sine(angle) * (W @ W)
    return _like(rt2tr(_exponential(w), (V @ v[..., None])[..., 0]), "SE3" if kind else "")


@with_argument_errors
def trlog(T: PoseLike) -> Array:
    """The rotation vector (3,) of a rotation (3, 3), or the twist (6,) ``v, w`` of a pose (4, 4).

    The angle is 0 to pi. :func:`trexp` is the inverse.
    """
    array = pose_array(T, "trlog")
    w = _logarithm(array[..., :3, :3])
    if array.shape[-1] == 3:
        return w
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    W = skew(w)
    inverse = np.eye(3) - 0.5 * W + _cotangent_factor(angle) * (W @ W)
    return np.concatenate([(inverse @ array[..., :3, 3:])[..., 0], w], axis=-1)


@with_argument_errors
def trinterp(T0: PoseLike, T1: PoseLike, s: ArrayLike) -> PoseLike:
    """Poses or rotations from ``T0`` (s = 0) to ``T1`` (s = 1): linear position, shortest rotation.

    ``s`` is a number or (N,). A ``Transform`` gives arrays.
    """
    kind = _array_of(T0)[1]
    first, last = pose_array(T0, "trinterp"), pose_array(T1, "trinterp")
    if first.shape[-1] != last.shape[-1]:
        raise _shape_error(last.shape, f"the shape of T0, {first.shape}", "trinterp")
    part = np.asarray(s, dtype=np.float64)
    R = _interpolated(first[..., :3, :3], last[..., :3, :3], part)
    if first.shape[-1] == 3:
        return _like(R, kind)
    p = first[..., :3, 3] + part[..., None] * (last[..., :3, 3] - first[..., :3, 3])
    return _like(rt2tr(R, p), kind)


@with_argument_errors
def tr2delta(T0: PoseLike, T1: PoseLike) -> Array:
    """The small motion (6,) from ``T0`` to ``T1`` in frame T0: displacement, then ``vex(R0' R1 - I)``.

    The axes are the same as in release 10 and the Python toolbox. Releases up to 9 use world axes, which the
    block ``Tr2Delta`` also supports.
    """
    first, last = pose_array(T0, "tr2delta"), pose_array(T1, "tr2delta")
    if first.shape[-1] != 4 or last.shape[-1] != 4:
        raise _shape_error(first.shape if first.shape[-1] != 4 else last.shape, "(4, 4)", "tr2delta")
    back = np.swapaxes(first[..., :3, :3], -1, -2)
    p = (back @ (last[..., :3, 3:] - first[..., :3, 3:]))[..., 0]
    return np.concatenate([p, vex(back @ last[..., :3, :3] - np.eye(3))], axis=-1)


@with_argument_errors
def delta2tr(d: ArrayLike) -> Array:
    """The matrix (4, 4) ``I + [skew(w) v; 0 0]`` of a small motion (6,) ``v, w``; not exactly a pose."""
    vector = _vectors(d, 6, "delta2tr")
    return rt2tr(np.eye(3) + skew(vector[..., 3:]), vector[..., :3])


@with_argument_errors
def tr2adjoint(T: PoseLike) -> Array:
    """The adjoint (6, 6) of a pose: it maps a twist ``v, w`` in frame b to frame a of T_ab."""
    array = pose_array(T, "tr2adjoint")
    if array.shape[-1] != 4:
        raise _shape_error(array.shape, "(4, 4) or (N, 4, 4)", "tr2adjoint")
    R = array[..., :3, :3]
    result = np.zeros((*array.shape[:-2], 6, 6))
    result[..., :3, :3] = result[..., 3:, 3:] = R
    result[..., :3, 3:] = skew(array[..., :3, 3]) @ R
    return result


# ---- parts of poses --------------------------------------------------------------------------------------
@with_argument_errors
def rt2tr(R: ArrayLike, p: ArrayLike) -> Array:
    """The pose (4, 4) of a rotation (3, 3) and a position (3,), m."""
    rotation, position = np.asarray(R, dtype=np.float64), np.asarray(p, dtype=np.float64)
    batch = np.broadcast_shapes(rotation.shape[:-2], position.shape[:-1])
    T = np.zeros((*batch, 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = rotation, position, 1.0
    return T


@with_argument_errors
def r2t(R: ArrayLike) -> Array:
    """The pose (4, 4) without displacement of a rotation (3, 3)."""
    return rt2tr(R, np.zeros(3))


def rotations(T: PoseLike, where: str) -> Array:
    """The rotations (…, 3, 3) of poses or rotations. Raises InputError for other shapes and matrices."""
    return pose_array(T, where)[..., :3, :3]


def pose_array(T: PoseLike, where: str) -> Array:
    """Poses (…, 4, 4) or rotations (…, 3, 3) as an array. Raises InputError."""
    array, _ = _array_of(T)
    if array.shape[-2:] not in ((3, 3), (4, 4)) or array.ndim > 3:
        raise _shape_error(array.shape, "(3, 3) or (4, 4), or N of them", where)
    R = array[..., :3, :3]
    error = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(-2, -1))
    if (error > ORTHONORMALITY).any():
        raise InputError(
            f"a matrix is not a rotation: R'R differs from the identity by {np.max(error):.3g}",
            where=where,
            allowed=f"at most {ORTHONORMALITY:g}, and a determinant of 1",
            fix="give the matrix with more digits",
        )
    if ((np.cross(R[..., 0], R[..., 1]) * R[..., 2]).sum(axis=-1) < 0).any():
        raise InputError(
            "a matrix is not a rotation but a reflection: its determinant is -1",
            where=where,
            allowed="a determinant of 1",
            fix="reverse one of the three axes",
        )
    return array


def _array_of(value: PoseLike) -> tuple[Array, str]:
    """The numbers of a value, and the name of its class if it belongs to spatialmath."""
    if isinstance(value, Transform):
        return value.matrix, ""
    kind = cast("type[object]", type(value))
    if kind.__module__.partition(".")[0] == "spatialmath":
        return np.asarray(value.A, dtype=np.float64), kind.__name__
    try:
        return np.asarray(cast("ArrayLike", value), dtype=np.float64), ""
    except (TypeError, ValueError):
        raise InputError(
            f"{kind.__name__} is not an array of numbers",
            where="armblocks.spatial",
            allowed="arrays, Transform, and objects of spatialmath",
            fix="give a NumPy array",
        ) from None


def _like(array: Array, kind: str) -> PoseLike:
    """The array, or an object of spatialmath of a class with this name."""
    if not kind:
        return array
    make = getattr(sys.modules["spatialmath"], kind)
    return make(array if array.ndim == 2 else list(array), check=False)


# ---- numbers ---------------------------------------------------------------------------------------------
def _order(order: str, where: str) -> tuple[str, bool]:
    if order not in RPY_CONVENTIONS:
        raise UnknownNameError("order of roll, pitch and yaw", order, RPY_CONVENTIONS, where=where)
    return RPY_CONVENTIONS[order]


def _vectors(value: PoseLike, size: int, where: str) -> Array:
    array, _ = _array_of(value)
    if array.shape[-1:] != (size,) or array.ndim > 2:
        raise _shape_error(array.shape, f"({size},) or (N, {size})", where)
    return array


def _quaternions(value: PoseLike, where: str) -> Array:
    quaternion = _vectors(value, 4, where)
    if (np.linalg.norm(quaternion, axis=-1) == 0.0).any():
        raise InputError(
            "a quaternion is 0 0 0 0, which is not a rotation",
            where=where,
            allowed="quaternions w x y z other than zero",
            fix="1 0 0 0 is the quaternion without rotation",
        )
    return quaternion


def _angles(value: ArrayLike, unit: str, where: str, *, size: int = 3) -> Array:
    if unit not in UNITS:
        raise UnknownNameError("unit of angles", unit, UNITS, where=where)
    angles = _vectors(value, size, where)
    return np.deg2rad(angles) if unit == "deg" else angles


def _in_unit(angles: Array, unit: str, where: str) -> Array:
    if unit not in UNITS:
        raise UnknownNameError("unit of angles", unit, UNITS, where=where)
    return np.rad2deg(angles) if unit == "deg" else angles


def _shape_error(shape: tuple[int, ...], allowed: str, where: str) -> InputError:
    return InputError(
        f"the shape is {shape}", where=where, allowed=allowed, fix="give one value, or N along the first axis"
    )


def _about(axis: str, angle: Array) -> Array:
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    R = np.zeros((*angle.shape, 3, 3))
    R[..., i, i] = 1.0
    R[..., j, j] = R[..., k, k] = np.cos(angle)
    R[..., k, j] = np.sin(angle)
    R[..., j, k] = -R[..., k, j]
    return R


def _about_three(axes: str, angles: Array) -> Array:
    first, second, third = (_about(axis, angles[..., k]) for k, axis in enumerate(axes))
    return first @ second @ third


def _three_angles(R: Array, order: str) -> Array:
    """a, b, c with R = Ri(a) Rj(b) Rk(c) for three different axes; c is 0 if cos(b) is 0."""
    i, j, k = ("xyz".index(axis) for axis in order)
    e = 1.0 if (j - i) % 3 == 1 else -1.0
    cosine = np.hypot(R[..., i, i], R[..., i, j])
    b = np.arctan2(e * R[..., i, k], cosine)
    c = np.where(cosine < SINGULAR, 0.0, np.arctan2(-e * R[..., i, j], R[..., i, i]))
    # Column j of R Rk(-c) = Ri(a) Rj(b) does not depend on b.
    sine, cosine = e * np.sin(c), np.cos(c)
    a = np.arctan2(
        e * (sine * R[..., k, i] + cosine * R[..., k, j]), sine * R[..., j, i] + cosine * R[..., j, j]
    )
    return np.stack([a, b, c], axis=-1)


def _exponential(w: Array) -> Array:
    """The rotation of a rotation vector, by its quaternion."""
    angle = np.linalg.norm(w, axis=-1, keepdims=True)
    return q2r(np.concatenate([np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * w], axis=-1))


def _logarithm(R: Array) -> Array:
    """The rotation vector of a rotation, by its quaternion: accurate also near half a turn."""
    quaternion = r2q(R)
    scalar, vector = quaternion[..., :1], quaternion[..., 1:]
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    tiny = length < 1e-9
    factor = np.where(tiny, 2.0, 2.0 * np.arctan2(length, scalar) / np.where(tiny, 1.0, length))
    return factor * vector


def _interpolated(first: Array, last: Array, s: Array) -> Array:
    w = _logarithm(np.swapaxes(first, -1, -2) @ last)
    return first @ _exponential(s[..., None] * w)


def _angle_minus_sine(angle: Array) -> Array:
    """``(a - sin a) / a³``."""
    square = angle * angle
    series = 1 / 6 - square * (1 / 120 - square * (1 / 5040 - square / 362880))
    safe = np.where(angle < SMALL_ANGLE, 1.0, angle)
    return np.where(angle < SMALL_ANGLE, series, (safe - np.sin(safe)) / safe**3)


def _cotangent_factor(angle: Array) -> Array:
    """``(1 - (a/2) cot(a/2)) / a²``."""
    square = angle * angle
    series = 1 / 12 + square * (1 / 720 + square * (1 / 30240 + square / 1209600))
    safe = np.where(angle < SMALL_ANGLE, 1.0, angle)
    return np.where(angle < SMALL_ANGLE, series, (1.0 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2)
