"""Independent columns of a regressor, and the combinations of parameters that data can determine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

INDEPENDENT = 1e-8
"""A column is dependent if its distance from the space of the columns before it is smaller than this
fraction of its length. Rounding errors are 1e-13, and the smallest real distances about 1e-4."""

ROUNDING = 1e-13
"""Sums below this fraction of their terms are rounding errors."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BaseColumns:
    """The independent columns of a regressor W: ``W pi = W[:, base] (pi[base] + K pi[dependent])``.

    ``base`` (b,) and ``dependent`` (d,): indices of columns. ``K`` (b, d). ``without_effect`` (k,): columns
    of zeros. Source: Gautier, *Numerical calculation of the base inertial parameters of robots*, Journal of
    Robotic Systems 1991.
    """

    base: NDArray[np.intp]
    dependent: NDArray[np.intp]
    without_effect: NDArray[np.intp]
    K: Array

    def combined(self, parameters: Array) -> Array:
        """The base parameters (b,) of all parameters (p,); sums that cancel up to rounding errors are 0."""
        shares = self.K * parameters[self.dependent]
        own = parameters[self.base]
        value: Array = own + shares.sum(axis=1)
        size = np.abs(own) + np.abs(shares).sum(axis=1)
        return np.where(np.abs(value) > ROUNDING * size, value, 0.0)

    def expansion(self, count: int) -> Array:
        """The matrix (b, p) from all p parameters to the base parameters."""
        matrix = np.zeros((len(self.base), count))
        matrix[np.arange(len(self.base)), self.base] = 1.0
        matrix[:, self.dependent] = self.K
        return matrix


def base_columns(W: Array, order: Sequence[int]) -> BaseColumns:
    """The independent columns of ``W`` (M, p); columns that come first in ``order`` are preferred."""
    lengths = np.linalg.norm(W, axis=0)
    used = lengths > 1e-14 * lengths.max(initial=0.0)
    basis = np.empty((min(W.shape), W.shape[0]))
    base: list[int] = []
    dependent: list[int] = []
    for column in order:
        if not used[column]:
            continue
        direction = W[:, column] / lengths[column]
        Q = basis[: len(base)]
        for _ in range(2):  # a second pass removes the rounding errors of the first
            direction = direction - Q.T @ (Q @ direction)
        distance = float(np.linalg.norm(direction))
        if distance > INDEPENDENT and len(base) < len(basis):
            basis[len(base)] = direction / distance
            base.append(column)
        else:
            dependent.append(column)
    base.sort()
    dependent.sort()
    scale = lengths[base]
    solution = cast("Any", np.linalg.lstsq)(W[:, base] / scale, W[:, dependent], rcond=None)[0]
    K = np.asarray(solution, dtype=np.float64) / scale[:, None]
    # An entry without effect on the column is a rounding error of 0.
    K[np.abs(K) * scale[:, None] < 1e-9 * lengths[dependent]] = 0.0
    return BaseColumns(
        base=np.array(base, dtype=np.intp),
        dependent=np.array(dependent, dtype=np.intp),
        without_effect=np.flatnonzero(~used),
        K=K,
    )
