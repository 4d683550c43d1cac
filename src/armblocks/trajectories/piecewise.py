"""Piecewise polynomials of time with several columns: the exact form of the joint trajectories."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.trajectories.quintic import Motion

Array = NDArray[np.float64]

_SAME_TIME = 1e-12
"""Times of several joints that differ by less than this part of the duration are one time."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PiecewisePolynomial:
    """Polynomials of ``t - times[k]`` between the times ``times[k]`` and ``times[k + 1]``.

    ``times`` (K + 1,) s, ascending. ``coefficients`` (K, m, n): for each piece the coefficients of the powers
    0 to m - 1 of n joints, rad or m divided by s to the power. Piece k includes its start, the last piece
    also its end. Outside, the joints are at rest at the first and last position, as with
    :class:`~armblocks.trajectories.Quintic`.

    ``end`` (3, n), optional: position, speed and acceleration at the last time. With it a motion ends with
    speeds of exactly 0; a rounding error of 1e-17 would cause Coulomb friction.
    """

    times: Array
    coefficients: Array
    end: Array | None = None

    @property
    def duration(self) -> float:
        """Time from the start to the end, s."""
        return float(self.times[-1] - self.times[0])

    @property
    def width(self) -> int:
        """Number of joints n."""
        return self.coefficients.shape[2]

    def at(self, t: ArrayLike, side: str = "right") -> Motion[Array]:
        """Return positions, speeds, accelerations (n,) at the time ``t`` (s), or (N, n) for times (N,).

        Where an acceleration jumps, ``side`` selects its limit: ``"right"`` after the jump, ``"left"``
        before it.
        """
        time = np.asarray(t, dtype=np.float64)
        first, last = self.times[0], self.times[-1]
        clipped = np.clip(time, first, last)
        index = np.searchsorted(self.times, clipped, side="right" if side == "right" else "left") - 1
        piece = np.clip(index, 0, len(self.coefficients) - 1)
        q, qd, qdd = _polynomials(self.coefficients[piece], clipped - self.times[piece])
        if self.end is not None:
            at_end = (time >= last)[..., None]
            q, qd, qdd = (np.where(at_end, value, known) for value, known in zip(self.end, (q, qd, qdd)))
        outside = ((time < first) | (time > last))[..., None]
        return Motion(q, np.where(outside, 0.0, qd), np.where(outside, 0.0, qdd))

    def pieces(self) -> tuple[Motion[Array], Motion[Array]]:
        """Return the motions (K, n) at the start and at the end of each piece."""
        lengths = np.diff(self.times)
        starts = Motion(*_polynomials(self.coefficients, np.zeros(len(lengths))))
        ends = Motion(*_polynomials(self.coefficients, lengths))
        if self.end is not None:
            for value, known in zip(ends, self.end):
                value[-1] = known
        return starts, ends

    def stretched(self, factor: float) -> PiecewisePolynomial:
        """Return the same path with all times multiplied by ``factor``."""
        powers = factor ** -np.arange(self.coefficients.shape[1], dtype=np.float64)
        rates = np.array([1.0, 1.0 / factor, 1.0 / factor**2])
        end = None if self.end is None else self.end * rates[:, None]
        first = self.times[0]
        times = first + (self.times - first) * factor
        return PiecewisePolynomial(times=times, coefficients=self.coefficients * powers[:, None], end=end)


def _polynomials(coefficients: Array, u: Array) -> tuple[Array, Array, Array]:
    """Values and two derivatives at ``u`` (…) of polynomials with the coefficients (…, m, n)."""
    m = coefficients.shape[-2]
    powers = np.ones((*u.shape, m))
    for k in range(1, m):
        np.multiply(powers[..., k - 1], u, out=powers[..., k])
    derived = [powers, np.zeros_like(powers), np.zeros_like(powers)]
    derived[1][..., 1:] = powers[..., :-1] * np.arange(1.0, m)
    derived[2][..., 2:] = powers[..., :-2] * (np.arange(2.0, m) * np.arange(1.0, m - 1))
    q, qd, qdd = (np.einsum("...m,...mn->...n", part, coefficients) for part in derived)
    return q, qd, qdd


def hermite(
    times: Array, starts: Sequence[Array], ends: Sequence[Array], *, end: Array | None = None
) -> PiecewisePolynomial:
    """Pieces with given values and derivatives at both ends: 2, or with accelerations 3 arrays (K, n) each.

    Two arrays (positions, speeds) give cubic pieces, three give quintic pieces. ``times`` (K + 1,).
    """
    h = np.diff(times)[:, None]
    q0, qd0, q1, qd1 = starts[0], starts[1], ends[0], ends[1]
    if len(starts) == 2:
        a, b = (q1 - q0) / h - qd0, qd1 - qd0
        powers = [q0, qd0, (3.0 * a - b) / h, (b - 2.0 * a) / (h * h)]
    else:
        qdd0, qdd1 = starts[2], ends[2]
        # Differences that determine the powers 3 to 5: position, speed, acceleration, scaled to the length 1.
        a = (q1 - q0) - h * (qd0 + h * qdd0 / 2.0)
        b = h * (qd1 - qd0 - h * qdd0)
        c = h * h * (qdd1 - qdd0)
        cubes = [(10 * a - 4 * b + c / 2), (-15 * a + 7 * b - c), (6 * a - 3 * b + c / 2)]
        powers = [q0, qd0, qdd0 / 2.0, *(cube / h**k for k, cube in enumerate(cubes, 3))]
    return PiecewisePolynomial(times=times, coefficients=np.stack(powers, axis=1), end=end)


def chained(parts: Sequence[PiecewisePolynomial]) -> PiecewisePolynomial:
    """The motions one after the other, from the time 0."""
    degree = max(part.coefficients.shape[1] for part in parts)
    coefficients = [
        np.pad(part.coefficients, ((0, 0), (0, degree - part.coefficients.shape[1]), (0, 0)))
        for part in parts
    ]
    lengths = np.concatenate([np.diff(part.times) for part in parts])
    times = np.append(0.0, np.cumsum(lengths))
    return PiecewisePolynomial(times=times, coefficients=np.concatenate(coefficients), end=parts[-1].end)


def joined(joints: Sequence[PiecewisePolynomial]) -> PiecewisePolynomial:
    """The motion of several joints as one; each has its own times, with the same start and end."""
    if len(joints) == 1:
        return joints[0]
    every = np.unique(np.concatenate([joint.times for joint in joints]))
    gap = _SAME_TIME * (every[-1] - every[0])
    keep = np.append(True, np.diff(every) > gap)
    keep[-1], times = True, every
    if len(every) > 2 and every[-1] - every[-2] <= gap:
        keep[-2] = len(every) == 2
    times = every[keep]
    degree = max(joint.coefficients.shape[1] for joint in joints)
    middles = (times[:-1] + times[1:]) / 2.0
    columns: list[Array] = []
    for joint in joints:
        piece = np.clip(np.searchsorted(joint.times, middles) - 1, 0, len(joint.coefficients) - 1)
        moved = _moved(joint.coefficients[piece], times[:-1] - joint.times[piece])
        columns.append(np.pad(moved, ((0, 0), (0, degree - moved.shape[1]), (0, 0))))
    ends = [joint.end for joint in joints]
    end = None if any(e is None for e in ends) else np.hstack([e for e in ends if e is not None])
    return PiecewisePolynomial(times=times, coefficients=np.concatenate(columns, axis=2), end=end)


def _moved(coefficients: Array, shift: Array) -> Array:
    """The coefficients (K, m, n) of the same polynomials about points that lie ``shift`` (K,) later."""
    m = coefficients.shape[1]
    moved = np.zeros_like(coefficients)
    for j in range(m):
        for i in range(j, m):
            moved[:, j] += math.comb(i, j) * coefficients[:, i] * (shift ** (i - j))[:, None]
    return moved


def extremes(curve: PiecewisePolynomial, order: int) -> tuple[Array, Array]:
    """Smallest and largest value (n,) of the derivative of an ``order`` (0, 1 or 2), exact to rounding.

    Extremes are at the ends of pieces, or at the zeros of the next derivative, which are eigenvalues of
    companion matrices.
    """
    starts, ends = curve.pieces()
    values = np.concatenate([starts[order], ends[order]])
    low, high = values.min(axis=0), values.max(axis=0)
    lengths = np.diff(curve.times)
    K, m, n = np.shape(curve.coefficients)
    # Powers of u / length, so that the zeros within a piece are between 0 and 1.
    powers: Array = np.power(lengths[:, None], np.arange(float(m)))
    scaled = np.multiply(curve.coefficients, powers[:, :, None])
    derivative = _derivative(scaled, order + 1)
    degree = derivative.shape[1] - 1
    if degree < 1:
        return low, high
    rows = np.moveaxis(derivative, 1, 2).reshape(K * n, degree + 1)
    largest = np.abs(rows).max(axis=1)
    # A tiny number replaces a leading coefficient of 0: its extra zero is far outside the piece.
    leading = rows[:, -1]
    tiny = 1e-12 * np.where(largest > 0.0, largest, 1.0)
    leading = np.where(np.abs(leading) < tiny, tiny, leading)
    companion = np.zeros((K * n, degree, degree))
    companion[:, np.arange(1, degree), np.arange(degree - 1)] = 1.0
    companion[:, :, -1] = -rows[:, :-1] / leading[:, None]
    roots = np.linalg.eigvals(companion).real.reshape(K, n, degree)
    fraction = np.clip(roots, 0.0, 1.0)
    for k in range(degree):
        u = fraction[:, :, k] * lengths[:, None]
        found = _column_values(curve.coefficients, u, order)
        low, high = np.minimum(low, found.min(axis=0)), np.maximum(high, found.max(axis=0))
    return low, high


def _derivative(coefficients: Array, order: int) -> Array:
    """The coefficients (K, m - order, n) of a derivative of polynomials with the coefficients (K, m, n)."""
    derived: Array = coefficients
    for _ in range(order):
        powers = np.arange(1.0, derived.shape[1])
        derived = np.multiply(derived[:, 1:], powers[:, None])
    return derived


def _column_values(coefficients: Array, u: Array, order: int) -> Array:
    """Derivatives (K, n) of an order at separate points ``u`` (K, n) of the columns."""
    derivative = _derivative(coefficients, order)
    value = np.zeros_like(u)
    for power in range(derivative.shape[1] - 1, -1, -1):
        value = value * u + derivative[:, power]
    return value
