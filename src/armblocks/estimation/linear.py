"""Weighted linear least squares from several sensors with unknown noise, with covariances.

The rows of each sensor (each joint's torque) have the same unknown standard deviation. Rows are compressed to
triangular factors as they arrive, so that millions of samples need the memory of one part of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_ROUNDS = 50
_CONVERGED = 1e-8
"""The noise estimates have converged when they change by at most this fraction in one round."""
RANK_TOLERANCE = 1e-10
"""Singular values of the matrix with columns of length 1 below this fraction of the largest value are 0."""


@dataclass(eq=False)
class Rows:
    """Compressed rows of one sensor: the triangular factor of ``[X y]`` for its ``columns``.

    ``count`` is the number of rows.
    """

    columns: NDArray[np.intp]
    factor: Array
    count: int = 0

    @classmethod
    def without_rows(cls, columns: NDArray[np.intp]) -> Rows:
        """No rows yet."""
        return cls(columns, np.empty((0, len(columns) + 1)))

    def add(self, X: Array, y: Array) -> None:
        """Add rows ``X`` (N, columns) and measured values ``y`` (N,)."""
        if not len(y):
            return
        new = np.column_stack([X, y])
        # Blocks that fit into the processor's cache are factorised first: this is several times faster.
        height = max(4 * new.shape[1], 64)
        blocks = len(new) // height
        parts = [self.factor, new[blocks * height :]]
        if blocks > 1:
            stack = new[: blocks * height].reshape(blocks, height, -1)
            parts.append(_triangular(stack).reshape(-1, new.shape[1]))
        else:
            parts.append(new[: blocks * height])
        self.factor = _triangular(np.vstack(parts))
        self.count += len(y)

    def squares(self, parameters: Array) -> float:
        """The sum of the squared residuals for all parameters."""
        residual = self.factor[:, -1] - self.factor[:, :-1] @ parameters[self.columns]
        return float(residual @ residual)


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearFit:
    """The weighted least-squares estimate.

    ``values`` (b,): estimates; directions that the rows do not determine keep the values of the start.
    ``covariance`` (b, b): of the determined directions. ``unknown`` (b,): whether a parameter is not
    determined. ``deviations`` (n,): the standard deviation of each sensor's noise. ``condition``: of the
    weighted matrix with columns of length 1, without undetermined directions. ``rank``.
    """

    values: Array
    covariance: Array
    unknown: NDArray[np.bool_]
    deviations: Array
    condition: float
    rank: int


def weighted_fit(sensors: Sequence[Rows], start: Array, deviations: Array | None = None) -> LinearFit:
    """The estimate of the parameters from the rows of all sensors.

    ``deviations`` (n,): known standard deviations; ``None``: they are estimated from the residuals and the
    weights are repeated until both agree (iterated weighted least squares: the maximum-likelihood estimate of
    normally distributed noise, with unbiased variances). ``start`` (b,): values of undetermined directions.
    """
    if deviations is not None:
        return _fit(sensors, start, deviations)
    # The first weights: each sensor's residual of its own least squares, or its measured values.
    # Values that are all 0 have no size of their own.
    sizes = np.array([_size(rows) for rows in sensors])
    sizes[sizes == 0.0] = sizes.max(initial=0.0) or 1.0
    sigma = np.array([_own_deviation(rows, size) for rows, size in zip(sensors, sizes)])
    fit = _fit(sensors, start, sigma)
    for _ in range(_ROUNDS):
        new = np.array([_deviation(rows, fit, old, size) for rows, old, size in zip(sensors, sigma, sizes)])
        converged = bool(np.all(np.abs(new - sigma) <= _CONVERGED * sigma))
        sigma = new
        fit = _fit(sensors, start, sigma)
        if converged:
            break
    return fit


def _triangular(matrix: Array) -> Array:
    """The triangular factors of matrices (…, m, k)."""
    return np.asarray(cast("Any", np.linalg.qr)(matrix, mode="r"), dtype=np.float64)


def _size(rows: Rows) -> float:
    """The root mean square of the measured values."""
    return float(np.linalg.norm(rows.factor[:, -1])) / max(rows.count, 1) ** 0.5


def _own_deviation(rows: Rows, size: float) -> float:
    """The deviation of the residual of a sensor's rows alone, above 0."""
    corner = rows.factor[-1, -1] if len(rows.factor) == rows.factor.shape[1] else 0.0
    freedom = max(rows.count - len(rows.columns), 1)
    return max(abs(float(corner)) / freedom**0.5, 1e-9 * size)


def _deviation(rows: Rows, fit: LinearFit, old: float, size: float) -> float:
    """The standard deviation of a sensor, with the remaining degrees of freedom of its rows."""
    X = rows.factor[:, :-1]
    covariance = fit.covariance[np.ix_(rows.columns, rows.columns)]
    used = float(np.einsum("ij,jk,ik->", X, covariance, X)) / old**2
    freedom = rows.count - min(used, rows.count - 1.0)
    return max((rows.squares(fit.values) / max(freedom, 1.0)) ** 0.5, 1e-12 * size)


def _fit(sensors: Sequence[Rows], start: Array, sigma: Array) -> LinearFit:
    A, y = stacked(sensors, len(start), sigma)
    lengths = np.linalg.norm(A, axis=0)
    scale = np.where(lengths > 0.0, lengths, 1.0)
    # A triangular factor with at least as many rows as columns, so that Vt is complete.
    padding = np.zeros((max(len(start) - len(A), 0), len(start) + 1))
    R = _triangular(np.vstack([np.column_stack([A / scale, y - A @ start]), padding]))
    U, s, Vt = np.linalg.svd(R[: len(start), :-1])
    rank = int(np.sum(s > RANK_TOLERANCE * s.max(initial=0.0)))
    V = Vt[:rank].T
    steps = V @ ((U[:, :rank].T @ R[: len(start), -1]) / s[:rank]) / scale
    half = V / s[:rank] / scale[:, None]
    undetermined = np.abs(Vt[rank:]).max(axis=0, initial=0.0) > 1e-6
    return LinearFit(
        values=start + steps,
        covariance=half @ half.T,
        unknown=undetermined,
        deviations=sigma,
        condition=float(s[0] / s[rank - 1]) if rank else float("inf"),
        rank=rank,
    )


def stacked(sensors: Sequence[Rows], count: int, sigma: Array) -> tuple[Array, Array]:
    """The rows of all sensors divided by their standard deviations: matrix (m, count) and values (m,)."""
    parts: list[Array] = []
    values: list[Array] = []
    for rows, deviation in zip(sensors, sigma.tolist()):
        part = np.zeros((len(rows.factor), count))
        part[:, rows.columns] = rows.factor[:, :-1] / deviation
        parts.append(part)
        values.append(rows.factor[:, -1] / deviation)
    return np.vstack(parts), np.concatenate(values)
