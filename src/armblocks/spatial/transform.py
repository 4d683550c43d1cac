"""Rigid transforms between frames: ``p_a = T_ab p_b``."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import ArgumentError, InputError, counted
from armblocks.rounded_functions import atan2, cos, hypot, sin
from armblocks.spatial.rotation import (
    IDENTITY3,
    SINGULAR,
    Matrix3,
    Vector3,
    matrix3,
    rotation_x,
    rotation_y,
    rotation_z,
    vector3,
)

ORTHONORMALITY = 1e-8
"""Maximum deviation of ``R' R`` from the identity. Matrices with eight digits are accepted, matrices with
four digits are not."""


@dataclass(frozen=True, init=False)
class Transform(metaclass=ArgumentErrors):
    """The pose of frame b in frame a: ``p_a = rotation p_b + translation`` (m).

    Transforms are values: they are equal if their numbers are equal. ``T_ac = T_ab @ T_bc``. Raises
    InputError if ``rotation`` is not a rotation matrix. NaN is accepted here; the robot rejects it with an
    error that names the link.
    """

    rotation: Matrix3
    translation: Vector3

    def __init__(
        self,
        *unnamed: object,
        rotation: ArrayLike = IDENTITY3,
        translation: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        if unnamed:
            raise ArgumentError(
                f"{counted(len(unnamed), 'argument is', 'arguments are')} given without names",
                where="Transform",
                allowed="rotation and translation by name",
                fix="write Transform.from_matrix(T) for a (4, 4) matrix, else Transform(rotation=…)",
            )
        R = matrix3(rotation, where="rotation of a transform")
        p = vector3(translation, where="translation of a transform")
        _check_rotation(R)
        object.__setattr__(self, "rotation", R)
        object.__setattr__(self, "translation", p)

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> Transform:
        """The transform of a homogeneous (4, 4) matrix. Raises InputError if the last row is not 0 0 0 1."""
        T = np.asarray(matrix, dtype=np.float64)
        if T.shape != (4, 4):
            raise InputError(
                f"a transform has shape {T.shape}",
                allowed="shape (4, 4)",
                where="Transform.from_matrix",
                fix="give four rows of four numbers",
            )
        if not np.array_equal(T[3], (0.0, 0.0, 0.0, 1.0)) and np.isfinite(T).all():
            raise InputError(
                f"the last row of a transform is {T[3].tolist()}",
                allowed="0 0 0 1",
                fix="pass the pose of a frame as [R p; 0 0 0 1]",
                where="Transform.from_matrix",
            )
        return cls(rotation=T[:3, :3], translation=T[:3, 3])

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The homogeneous matrix, a new (4, 4) array."""
        T = np.eye(4)
        T[:3, :3] = self.rotation
        T[:3, 3] = self.translation
        return T

    @property
    def R(self) -> NDArray[np.float64]:
        """The rotation, a new (3, 3) array."""
        return np.array(self.rotation)

    @property
    def p(self) -> NDArray[np.float64]:
        """The translation in m, a new (3,) array."""
        return np.array(self.translation)

    @property
    def rpy(self) -> Vector3:
        """Roll, pitch, yaw (rad) with R = Rz(yaw) Ry(pitch) Rx(roll); roll is 0 if abs(pitch) is pi/2.

        For symbols there is :func:`armblocks.spatial.orientation.to_rpy` with the convention ``zyx``.
        """
        (_, xy, xz), (_, yy, yz), (zx, zy, zz) = self.rotation
        cosine = hypot(zz, zy)
        roll = 0.0 if cosine < SINGULAR else atan2(zy, zz)
        # The y axis of Rz(yaw) Ry(pitch) does not depend on the pitch.
        c, s = cos(roll), sin(roll)
        return roll, atan2(-zx, cosine), atan2(s * xz - c * xy, c * yy - s * yz)

    @cached_property
    def is_identity(self) -> bool:
        """Whether the transform is the identity."""
        return self == Transform()

    def __matmul__(self, other: Transform) -> Transform:
        """Composition: ``T_ac = T_ab @ T_bc``."""
        R_ab, R_bc = self.rotation, other.rotation
        columns = tuple(zip(*R_bc))
        # Sums of three products in a fixed order, so that products of quarter turns are exact.
        rotation = tuple(tuple(_dot(row, column) for column in columns) for row in R_ab)
        return Transform(rotation=rotation, translation=self.apply(other.translation))

    def apply(self, point: Vector3) -> Vector3:
        """The coordinates in frame a of a point (m) in frame b."""
        x, y, z = (_dot(row, point) + offset for row, offset in zip(self.rotation, self.translation))
        return x, y, z

    def inverse(self) -> Transform:
        """The pose of frame a in frame b."""
        columns = tuple(zip(*self.rotation))
        return Transform(
            rotation=columns, translation=tuple(0.0 - _dot(column, self.translation) for column in columns)
        )


def transl(x: float, y: float, z: float) -> Transform:
    """Translation by x, y, z m."""
    return Transform(translation=(x, y, z))


def trotx(angle: float) -> Transform:
    """Rotation by ``angle`` rad about x."""
    return Transform(rotation=rotation_x(angle))


def troty(angle: float) -> Transform:
    """Rotation by ``angle`` rad about y."""
    return Transform(rotation=rotation_y(angle))


def trotz(angle: float) -> Transform:
    """Rotation by ``angle`` rad about z."""
    return Transform(rotation=rotation_z(angle))


def _dot(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    return sum(x * y for x, y in zip(a, b)) + 0.0


def _check_rotation(rotation: Matrix3) -> None:
    R = np.array(rotation)
    if not np.isfinite(R).all():
        return
    error = float(np.abs(R.T @ R - np.eye(3)).max())
    if error > ORTHONORMALITY:
        raise InputError(
            f"the rotation matrix is not orthonormal: R'R differs from the identity by {error:.3g}",
            allowed=f"at most {ORTHONORMALITY:g}",
            fix="give the matrix with more digits, or build it from angles with trotx, troty, trotz",
            where="rotation of a transform",
        )
    if np.linalg.det(R) < 0:
        raise InputError(
            "the rotation matrix is a reflection (its determinant is -1)",
            allowed="determinant +1",
            fix="check the signs of the axes",
            where="rotation of a transform",
        )
