"""Three-vectors and rotation matrices as tuples of floats, so that descriptions can be compared and hashed.

Rotations by multiples of 90 degrees are exact: ``cos(pi/2)`` is 0 and not 6e-17. The matrices of an arm with
perpendicular axes then have exact zeros, and the traced equations omit all terms with these factors.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, counted
from armblocks.rounded_functions import cos, sin

Vector3: TypeAlias = tuple[float, float, float]
"""x, y, z."""
Matrix3: TypeAlias = tuple[Vector3, Vector3, Vector3]
"""Three rows."""

IDENTITY3: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

SINGULAR = 2.2e-15
"""Cosine of the middle of three angles below which the orientation is singular: ten rounding errors.

At a singular orientation only the sum or the difference of the other two angles is determined.
"""


RPY_CONVENTIONS: Mapping[str, tuple[str, bool]] = {
    "zyx": ("zyx", True),
    "xyz": ("xyz", True),
    "yxz": ("yxz", True),
    "release 9": ("xyz", False),
    "release 7": ("zyx", False),
}
"""Order of the axes from the left, and whether roll is the last angle (else it is the first).

``zyx``: R = Rz(yaw) Ry(pitch) Rx(roll), the toolbox's default since release 10; ``xyz`` and ``yxz`` are the
other orders of release 10. ``release 9`` (and 8): R = Rx(roll) Ry(pitch) Rz(yaw). ``release 7``: R = Rz(roll)
Ry(pitch) Rx(yaw), which releases 8 and 9 call ``zyx``.
"""


def vector3(value: ArrayLike, *, where: str = "") -> Vector3:
    """Three numbers in any array shape of size 3 as a tuple; raises InputError for a wrong count."""
    array = _numbers(value, where)
    if array.size != 3:
        raise InputError(
            f"{counted(array.size, 'number is', 'numbers are')} given",
            where=where,
            allowed="3 numbers x y z",
            fix="give x, y and z",
        )
    x, y, z = (float(number) + 0.0 for number in array.ravel())
    return x, y, z


def matrix3(value: ArrayLike, *, where: str = "") -> Matrix3:
    """A (3, 3) array as three rows of floats; raises InputError for a wrong shape."""
    array = _numbers(value, where)
    if array.shape != (3, 3):
        raise InputError(
            f"the shape is {array.shape}",
            where=where,
            allowed="shape (3, 3)",
            fix="give three rows of three numbers",
        )
    return vector3(array[0]), vector3(array[1]), vector3(array[2])


def _numbers(value: ArrayLike, where: str) -> NDArray[np.float64]:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"{value!r} is not an array of numbers",
            where=where,
            allowed="numbers, lists of them, or arrays",
            fix="give numbers",
        ) from None


def cos_exact(angle: float) -> float:
    """cos of an angle (rad); exactly 1, 0 or -1 for multiples of pi/2, up to rounding of the angle."""
    quarter = _quarter_turn(angle)
    return cos(angle) if quarter is None else (1.0, 0.0, -1.0, 0.0)[quarter]


def sin_exact(angle: float) -> float:
    """sin of an angle (rad); exactly 1, 0 or -1 for multiples of pi/2, up to rounding of the angle."""
    quarter = _quarter_turn(angle)
    return sin(angle) if quarter is None else (0.0, 1.0, 0.0, -1.0)[quarter]


def _quarter_turn(angle: float) -> int | None:
    """``angle / (pi/2)`` modulo four for multiples of pi/2, within four roundings; None for other angles."""
    if not math.isfinite(angle):
        return None
    turns = round(angle / (math.pi / 2))
    near = abs(angle - turns * (math.pi / 2)) <= 4 * math.ulp(max(abs(angle), math.pi / 2))
    return turns % 4 if near and (turns or angle == 0) else None


def rotation_x(angle: float) -> Matrix3:
    """Rotation by ``angle`` rad about x."""
    c, s = cos_exact(angle), sin_exact(angle)
    return (1.0, 0.0, 0.0), (0.0, c, 0.0 - s), (0.0, s, c)


def rotation_y(angle: float) -> Matrix3:
    """Rotation by ``angle`` rad about y."""
    c, s = cos_exact(angle), sin_exact(angle)
    return (c, 0.0, s), (0.0, 1.0, 0.0), (0.0 - s, 0.0, c)


def rotation_z(angle: float) -> Matrix3:
    """Rotation by ``angle`` rad about z."""
    c, s = cos_exact(angle), sin_exact(angle)
    return (c, 0.0 - s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)


def rotation_about(axis: Vector3, angle: float) -> Matrix3:
    """Rotation by ``angle`` rad about the unit vector ``axis`` k: ``c I + s [k] + (1 - c) k k'``."""
    x, y, z = axis
    c, s = cos_exact(angle), sin_exact(angle)
    v = 1.0 - c
    return (
        (c + v * x * x, v * x * y - s * z, v * x * z + s * y),
        (v * x * y + s * z, c + v * y * y, v * y * z - s * x),
        (v * x * z - s * y, v * y * z + s * x, c + v * z * z),
    )
