"""Elimination of states, inputs and outputs with an error estimate for every entry.

The rank decisions of :mod:`armblocks.analysis.reduction` and :mod:`armblocks.analysis.zeros` compare an entry
with its own error, not with the norm of a matrix: a slow or weakly coupled part is kept beside a fast or
strongly coupled one. Gaussian elimination is used instead of rotations because it preserves zeros. Entries of
a diagram that are exactly 0 stay 0, and the decisions about them are exact. The growth of errors in large
dense parts is avoided by reflections.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.scaling import ScaledSystem

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

EPSILON = float(np.finfo(np.float64).eps)
THRESHOLD = 10.0
"""An entry is zero if it is at most this many times its estimated error."""
MAX_ELIMINATED = 8
"""An irreducible part with more states is transformed by a reflection instead of eliminations."""


class SystemMatrix:
    """The matrix ``[[A, B], [C, D]]`` of a scaled system and the variances of its entries.

    The states of an irreducible diagonal block of A may be the result of a change of basis. The errors of
    their entries are therefore ``n eps`` times norms: in a diagonal block the smaller of the norms of the row
    and the column of an entry, else the norm of the block. An entry of D does not depend on the basis: it is
    zero if it is at most ``eps`` times the smaller norm. Entries that are exactly 0 have no
    error. Rounding errors are added to the variances as if they were independent.
    """

    def __init__(self, system: ScaledSystem) -> None:
        n = self.order = system.A.shape[0]
        self.values = np.block([[system.A, system.B], [system.C, system.D]])
        self.relative_error = max(n, 1) * EPSILON
        errors = np.empty(self.values.shape)
        squares = self.values**2
        labels = self.labels = np.empty(n, dtype=np.intp)
        for k, part in enumerate(system.parts):
            labels[part] = k
        groups = np.arange(len(system.parts))
        member = (labels[:, None] == groups).astype(np.float64)
        errors[:n, :n] = np.sqrt(member.T @ squares[:n, :n] @ member)[labels][:, labels]
        errors[:n, n:] = np.sqrt(member.T @ squares[:n, n:])[labels]
        errors[n:, :n] = np.sqrt(squares[n:, :n] @ member)[:, labels]
        for part in system.parts:
            block = np.ix_(part, part)
            errors[block] = _smaller_norms(self.values[block])
        errors *= self.relative_error
        errors[n:, n:] = EPSILON / THRESHOLD * _smaller_norms(self.values)[n:, n:]
        self.variances = np.where(self.values != 0.0, errors**2, 0.0)

    def largest(self, rows: Indices, columns: Indices) -> tuple[int, int] | None:
        """Row and column of the largest entry of a part of the matrix; ``None`` if all its entries are zero.

        Entries that cannot be distinguished from zero are set to 0.
        """
        if not rows.size or not columns.size:
            return None
        part = np.ix_(rows, columns)
        values = self.values[part]
        if not values.any():
            return None
        # The estimates grow in a long elimination; the errors of eliminations with pivoting do not.
        lengths = np.linalg.norm(self.values[rows], axis=1)[:, None]
        larger = np.maximum(lengths, np.linalg.norm(self.values[:, columns], axis=0))
        limits = 10.0 * self.relative_error * larger
        errors = np.fmin(np.sqrt(self.variances[part]), limits)
        negligible = np.abs(values) <= THRESHOLD * errors
        values = np.where(negligible, 0.0, values)
        self.values[part] = values
        self.variances[part] = np.where(negligible, 0.0, self.variances[part])
        i, k = np.unravel_index(int(np.argmax(np.abs(values))), values.shape)
        return (int(rows[i]), int(columns[k])) if values[i, k] != 0.0 else None

    def subtract_row(self, source: int, targets: Indices, factors: Array, variances: Array) -> None:
        """Subtract ``factors`` (k,) times the row ``source`` from the rows ``targets`` (k,)."""
        _subtract(self.values, self.variances, source, targets, factors, variances)

    def subtract_column(self, source: int, targets: Indices, factors: Array, variances: Array) -> None:
        """Subtract ``factors`` (k,) times the column ``source`` from the columns ``targets`` (k,)."""
        _subtract(self.values.T, self.variances.T, source, targets, factors, variances)

    def add_rows(self, sources: Indices, target: int, factors: Array, variances: Array) -> None:
        """Add ``factors`` (k,) times the rows ``sources`` (k,) to the row ``target``."""
        _accumulate(self.values, self.variances, sources, target, factors, variances)

    def add_columns(self, sources: Indices, target: int, factors: Array, variances: Array) -> None:
        """Add ``factors`` (k,) times the columns ``sources`` (k,) to the column ``target``."""
        _accumulate(self.values.T, self.variances.T, sources, target, factors, variances)

    def concentrate(self, states: Indices, column: int) -> None:
        """Transform the states such that few of the given states have an entry in this column.

        In each irreducible part with many entries, a Householder reflection leaves one of them.
        """
        states = states[self.values[states, column] != 0.0]
        for label in np.unique(self.labels[states]).tolist():
            part = states[self.labels[states] == label]
            if part.size <= MAX_ELIMINATED:
                continue
            vector = self.values[part, column]
            length = float(np.linalg.norm(vector))
            normal = vector / length
            angles = self.variances[part, column] / length**2
            k = int(np.argmax(np.abs(normal)))
            normal[k] += math.copysign(1.0, normal[k])
            normal /= np.linalg.norm(normal)
            _reflect(self.values, self.variances, part, normal, angles, k)
            _reflect(self.values.T, self.variances.T, part, normal, angles, k)
            rest = np.delete(part, k)
            self.values[rest, column] = self.variances[rest, column] = 0.0

    def ratios(self, numerators: tuple[Indices, int], pivot: tuple[int, int]) -> tuple[Array, Array]:
        """Entries of a column divided by the pivot, and the variances of the quotients."""
        value = self.values[pivot]
        factors = self.values[numerators] / value
        with np.errstate(over="ignore", invalid="ignore"):
            variances = (self.variances[numerators] + factors**2 * self.variances[pivot]) / value**2
        return factors, variances

    def transposed(self) -> SystemMatrix:
        """The matrix of the dual system; both objects share their entries."""
        dual = object.__new__(SystemMatrix)
        dual.order, dual.relative_error, dual.labels = self.order, self.relative_error, self.labels
        dual.values, dual.variances = self.values.T, self.variances.T
        return dual


def _smaller_norms(matrix: Array) -> Array:
    """For each entry the smaller of the norms of its row and its column."""
    return np.minimum(np.linalg.norm(matrix, axis=1)[:, None], np.linalg.norm(matrix, axis=0))


def _subtract(
    values: Array, variances: Array, source: int, targets: Indices, factors: Array, factor_variances: Array
) -> None:
    used = factors != 0.0
    targets, factors, factor_variances = targets[used], factors[used, None], factor_variances[used, None]
    if not targets.size:
        return
    columns = np.flatnonzero(values[source])
    part = np.ix_(targets, columns)
    row = values[source, columns]
    products = factors * row
    values[part] -= products
    with np.errstate(over="ignore", invalid="ignore"):
        rounding = (EPSILON * np.abs(products)) ** 2
        variances[part] += factors**2 * variances[source, columns] + factor_variances * row**2 + rounding


def _reflect(values: Array, variances: Array, part: Indices, normal: Array, angles: Array, k: int) -> None:
    """Reflect the rows ``part``; ``angles`` are the variances of the reflected direction."""
    rows, errors = values[part], variances[part]
    squares = normal**2
    rows = rows - 2.0 * np.outer(normal, normal @ rows)
    # The entry (i, k) of the reflection I - 2 v v' is squared.
    with np.errstate(over="ignore", invalid="ignore"):
        errors = (1.0 - 4.0 * squares)[:, None] * errors + 4.0 * np.outer(squares, squares @ errors)
        errors = np.maximum(errors, 0.0) + (EPSILON * rows) ** 2 + np.outer(angles, rows[k] ** 2)
        errors[k] += angles @ rows**2
    values[part], variances[part] = rows, errors


def _accumulate(
    values: Array, variances: Array, sources: Indices, target: int, factors: Array, factor_variances: Array
) -> None:
    used = factors != 0.0
    sources, factors, factor_variances = sources[used], factors[used, None], factor_variances[used, None]
    if not sources.size:
        return
    products = factors * values[sources]
    values[target] += products.sum(axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        rounding = (EPSILON * np.abs(products)) ** 2
        errors = factors**2 * variances[sources] + factor_variances * values[sources] ** 2 + rounding
        variances[target] += errors.sum(axis=0)
