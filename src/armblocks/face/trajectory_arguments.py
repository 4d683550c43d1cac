"""Checks of the arguments of trajectory functions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, counted
from armblocks.robot.plausibility import warn_of_degrees

Array = NDArray[np.float64]


def displacement(name: str, value: ArrayLike, where: str) -> Array:
    """A displacement (3,) of finite numbers, m."""
    vector = as_array(value)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(
            f"{name} = {value!r}",
            where=where,
            allowed="three finite numbers x, y, z, m",
            fix=f"give three finite numbers for {name}",
        )
    return vector


def joint_vector(name: str, value: ArrayLike, where: str) -> Array:
    """A vector of finite numbers (n,); one number gives (1,)."""
    vector = as_array(value)
    vector = vector[None] if vector.ndim == 0 else vector
    if vector.ndim != 1 or vector.size == 0 or not np.isfinite(vector).all():
        raise InputError(
            f"{name} = {value!r}",
            where=where,
            allowed="a vector of finite joint values, one per joint",
            fix="give one finite number for each joint",
        )
    return vector


def ends_of(q0: ArrayLike, qf: ArrayLike, where: str) -> tuple[Array, Array]:
    """Start and end (n,) of a motion. Warns of angles that look like degrees."""
    start, goal = joint_vector("q0", q0, where), joint_vector("qf", qf, where)
    check_same_length(start, {"qf": goal}, where)
    for name, angles in (("q0", start), ("qf", goal)):
        warn_of_degrees(angles, f"{where}, {name}")
    return start, goal


def check_same_length(start: Array, vectors: Mapping[str, Array | None], where: str, of: str = "q0") -> None:
    """Raise InputError for a vector whose length differs from the length of ``start``."""
    for name, vector in vectors.items():
        if vector is not None and vector.shape != start.shape:
            raise InputError(
                f"{name} has {counted(vector.size, 'joint')}",
                where=where,
                allowed=f"{start.size}, the number of joints of {of}",
                fix=f"give {name} as many numbers as {of}",
            )


def end_speed(name: str, value: ArrayLike | None, start: Array, where: str, of: str = "q0") -> Array:
    """A speed (n,) at an end, 0 for ``None``."""
    if value is None:
        return np.zeros_like(start)
    speed = joint_vector(name, value, where)
    check_same_length(start, {name: speed}, where, of)
    return speed


def joint_limits(
    name: str, value: ArrayLike, n: int, where: str, *, infinite: bool = False, of: str = "joint"
) -> Array:
    """Limits (n,) above 0; one number is valid for all joints. ``infinite``: a joint may have no limit."""
    limits = as_array(value)
    is_finite = np.isfinite(limits) | (infinite & (limits == np.inf))
    if limits.shape not in ((), (1,), (n,)) or not is_finite.all() or not (limits > 0.0).all():
        raise InputError(
            f"{name} = {value!r}",
            where=where,
            allowed=f"a number above 0, or {counted(n, 'such number')}, one per {of}",
            fix=f"give {name} as a positive limit",
        )
    return np.broadcast_to(limits, (n,)).copy()


def positive(name: str, value: float, unit: str, where: str) -> float:
    """A finite number above 0."""
    number = as_array(value)
    if number.ndim or not np.isfinite(number) or not number > 0.0:
        raise InputError(
            f"{name} = {value!r}",
            where=where,
            allowed=f"a finite number above 0, in {unit}",
            fix=f"give {name} in {unit}",
        )
    return float(number)


def via_points(name: str, value: ArrayLike, where: str, least: int = 2) -> Array:
    """Points (K, n), finite. Warns of angles that look like degrees."""
    points = as_array(value)
    finite = bool(np.isfinite(points).all())
    if points.ndim != 2 or len(points) < least or not points.shape[1] or not finite:
        raise InputError(
            f"{name} has the shape {points.shape}" + ("" if finite else " with NaN or infinity"),
            where=where,
            allowed=f"finite numbers in {least} or more rows, one row of joint values per point",
            fix=f"give {name} as a list of points, each with one number for each joint",
        )
    warn_of_degrees(points, f"{where}, {name}")
    return points


def ascending(name: str, value: ArrayLike, count: int, where: str) -> Array:
    """Ascending finite times (count,)."""
    times = as_array(value)
    if times.shape != (count,) or not np.isfinite(times).all() or not (np.diff(times) > 0.0).all():
        raise InputError(
            f"{name} has the shape {times.shape}",
            where=where,
            allowed=f"{counted(count, 'ascending time')}, in s",
            fix=f"give {name} one time for each point, in ascending order",
        )
    return times


def sample_times(t: ArrayLike | int, where: str, *, step: float | None = None) -> Array:
    """Times from 0; for a number of samples, times from 0 to 1 or multiples of ``step``."""
    count = sample_count(t)
    if count is not None:
        if count < 2:
            raise InputError(
                f"t = {counted(count, 'sample')}",
                where=where,
                allowed="2 or more, or a vector of times",
                fix="use np.linspace(0, T, N) for times in s",
            )
        return np.linspace(0.0, 1.0, count) if step is None else step * np.arange(float(count))
    times = as_array(t)
    is_ascending = times.ndim == 1 and times.size >= 2 and bool((np.diff(times) > 0).all())
    if not (is_ascending and np.isfinite(times).all() and times[0] == 0.0):
        raise InputError(
            f"t of shape {times.shape}",
            where=where,
            allowed="finite ascending times that start at 0, or a number of samples",
            fix="use np.linspace(0, T, N)",
        )
    return times


def sample_count(t: ArrayLike | int) -> int | None:
    """A number of samples, an integer of Python or NumPy; ``None`` for times."""
    value = np.asarray(t)
    return int(value) if value.ndim == 0 and value.dtype.kind in "iu" else None


def as_array(value: ArrayLike) -> Array:
    """The value as an array of doubles; an empty array if the conversion fails."""
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        return np.empty((0, 0))
