"""Targets and starts of inverse kinematics: conversion and checks of the arguments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeGuard, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError
from armblocks.spatial import Transform
from armblocks.spatial.transform import ORTHONORMALITY

Array = NDArray[np.float64]
Target = Transform | ArrayLike | Sequence[Transform]
"""One pose or several: a Transform, a (4, 4) or (N, 4, 4) array, a list of them, or an SE3 of spatialmath."""

ROUNDING = 1e-12
"""Deviation of ``R' R`` from the identity above which the nearest rotation replaces ``R``."""
FARTHEST = 1e100
"""Greatest coordinate (m) of a target: the squares of greater numbers may overflow."""
_ALLOWED = "a Transform, shape (4, 4), or (N, 4, 4) or a list of Transforms for N poses"


def target_array(T: Target, where: str) -> tuple[Array, bool]:
    """The targets as a C-contiguous array (N, 4, 4), and whether there is a batch.

    Raises InputError for other shapes and types.
    """
    if is_plain(T) and T.shape[-2:] == (4, 4):
        if T.ndim == 2:
            return T, False
        if T.ndim == 3:
            return T, True
    value: Any = T
    if isinstance(value, Transform):
        return value.matrix, False
    if hasattr(value, "A") and not isinstance(value, np.ndarray):  # SE3 of spatialmath: one pose or a list
        value = np.array(value.A)
    elif (
        isinstance(value, list | tuple)
        and value
        and all(isinstance(x, Transform) for x in cast("Sequence[object]", value))
    ):
        value = np.stack([x.matrix for x in cast("Sequence[Transform]", value)])
    array: NDArray[Any]
    try:
        array = np.asarray(cast("ArrayLike", value))
    except (ValueError, TypeError):
        array = np.empty(0, dtype=object)
    if array.dtype.kind not in "fiu":
        raise InputError(
            f"a target pose is not an array of real numbers but {type(T).__name__}",
            where=where,
            allowed=_ALLOWED,
            fix="give the pose as a homogeneous matrix, for example arm.fkine(q)",
        )
    if array.shape[-2:] != (4, 4) or array.ndim > 3:
        raise InputError(
            f"the target poses have the shape {array.shape}",
            where=where,
            allowed=_ALLOWED,
            fix="give homogeneous matrices [R p; 0 0 0 1]",
        )
    plain = np.ascontiguousarray(array, dtype=np.float64)
    return plain if plain.flags.aligned else plain.copy(), array.ndim == 3


def check_distances(targets: Array, batch: bool, where: str) -> None:
    """Raise InputError for targets (N, 16) whose squared distances are not finite numbers."""
    distances = np.abs(targets[:, 3::4])
    far = np.flatnonzero(((distances > FARTHEST) & np.isfinite(distances)).any(axis=1))
    if far.size:
        name = f"target {far[0]}" if batch else "the target"
        raise InputError(
            f"{name} is {float(distances[far[0]].max()):.3g} m away",
            where=where,
            allowed=f"positions up to {FARTHEST:g} m",
            fix="check the unit of the position",
        )


def is_plain(T: object) -> TypeGuard[Array]:
    """Whether native code can read the array in place."""
    return type(T) is np.ndarray and T.dtype == np.float64 and T.flags.c_contiguous and T.flags.aligned


def checked_poses(T: Target, where: str) -> tuple[Array, bool]:
    """The targets (N, 4, 4) with exact rotations, and whether there is a batch.

    Raises InputError for matrices that are not poses.
    """
    targets, batch = target_array(T, where)
    if not batch and _is_exact(targets.tolist()):
        return targets[np.newaxis], False
    targets = targets.reshape(-1, 4, 4)
    R = targets[:, :3, :3]
    x, y, z = (R[:, :, k].T for k in range(3))
    products = [_dot(x, x) - 1.0, _dot(y, y) - 1.0, _dot(z, z) - 1.0, _dot(x, y), _dot(y, z), _dot(z, x)]
    deviation = np.abs(np.stack(products)).max(axis=0)
    volume = _dot(x, (y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]))
    sound = (deviation <= ORTHONORMALITY) & (volume > 0.0) & np.isfinite(targets[:, :3, 3]).all(axis=1)
    sound &= (targets[:, 3] == (0.0, 0.0, 0.0, 1.0)).all(axis=1)
    for k in np.flatnonzero(~sound)[:1]:
        raise_invalid_target(targets[k], int(k) if batch else None, where)
    rounded = np.flatnonzero(deviation > ROUNDING)
    if rounded.size:
        U, _, Vt = np.linalg.svd(R[rounded])
        targets = targets.copy()
        targets[rounded, :3, :3] = U @ Vt
    return targets, batch


def _is_exact(T: list[list[float]]) -> bool:
    """Whether a matrix is a pose up to rounding; plain Python is faster than NumPy for one matrix."""
    (a, b, c, x), (d, e, f, y), (g, h, i, z), last = T
    products = (
        *(a * a + b * b + c * c - 1.0, d * d + e * e + f * f - 1.0, g * g + h * h + i * i - 1.0),
        *(a * d + b * e + c * f, d * g + e * h + f * i, g * a + h * b + i * c),
    )
    volume = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    finite = (x + y + z) * 0.0 == 0.0
    return max(map(abs, products)) <= ROUNDING and volume > 0.0 and finite and last == [0.0, 0.0, 0.0, 1.0]


def _dot(a: Sequence[Array] | Array, b: Sequence[Array] | Array) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def raise_invalid_target(T: Array, index: int | None, where: str) -> None:
    """Raise an InputError with the reason why the matrix ``T`` (4, 4) is not a pose."""
    name = "the target" if index is None else f"target {index}"
    allowed, fix = "a homogeneous matrix [R p; 0 0 0 1]", "give the pose of a frame in the world"
    if not np.isfinite(T).all():
        what = f"{name} is not finite"
    elif not np.array_equal(T[3], (0.0, 0.0, 0.0, 1.0)):
        what = f"the last row of {name} is {T[3].tolist()}"
    elif np.linalg.det(T[:3, :3]) <= 0.0:
        what, allowed = f"the rotation of {name} is not a rotation but a reflection", "determinant +1"
        fix = "check the signs of the axes"
    else:
        error = float(np.abs(T[:3, :3].T @ T[:3, :3] - np.eye(3)).max())
        what = f"the rotation of {name} is not orthonormal: R'R differs from the identity by {error:.3g}"
        allowed = f"at most {ORTHONORMALITY:g}"
        fix = "give the matrix with more digits, or build it from angles with trotx, troty, trotz"
    raise InputError(what, where=where, allowed=allowed, fix=fix)


def start_array(q0: ArrayLike | None, nq: int, count: int | None, where: str) -> Array | None:
    """The starts (N, nq), C-contiguous; ``count`` is N, or None for one target. Raises InputError."""
    if q0 is None:
        return None
    rows = 1 if count is None else count
    try:
        array = np.asarray(q0, dtype=np.float64)
    except (ValueError, TypeError):
        array = np.full(nq, np.nan)
    if array.shape == (nq,) and np.isfinite(array).all():
        return np.ascontiguousarray(np.broadcast_to(array, (rows, nq)))
    if count is not None and array.shape == (rows, nq) and np.isfinite(array).all():
        return np.ascontiguousarray(array)
    allowed = f"finite numbers of the shape ({nq},)" + (f" or ({rows}, {nq})" if count is not None else "")
    shapes: list[tuple[int, ...]] = [(nq,), (rows, nq)][: 1 if count is None else 2]
    raise InputError(
        "q0 is not finite" if array.shape in shapes else f"q0 has the shape {array.shape}",
        where=where,
        allowed=allowed,
        fix="give the coordinates of one configuration, or of one for each target",
    )


def mask_array(mask: Sequence[float] | ArrayLike | None, where: str) -> tuple[float, ...]:
    """Six ones and zeros, 1 for each used component of the error. Raises InputError for other values."""
    if mask is None:
        return (1.0,) * 6
    try:
        values = np.asarray(mask, dtype=np.float64)
    except (ValueError, TypeError):
        values = np.empty(0)
    if values.shape != (6,) or not np.isin(values, (0.0, 1.0)).all() or not values.any():
        raise InputError(
            f"mask={mask!r}",
            where=where,
            allowed="six numbers 0 or 1, at least one of them 1: x, y, z, then rotations about x, y, z",
            fix="write 0 for each direction in which the pose may differ, as in mask=[1, 1, 1, 1, 1, 0]",
        )
    return tuple(values.tolist())
