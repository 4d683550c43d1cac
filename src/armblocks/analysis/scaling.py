"""Scaling of states, inputs and outputs so that the entries of a system have similar magnitudes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.modes import irreducible_parts

Array = NDArray[np.float64]

MAX_SWEEPS = 30
"""Maximum number of passes over all states."""
MAX_LOGARITHM = 200.0
"""Maximum binary logarithm of a factor, so that no square of an entry overflows."""


class ScaledSystem(NamedTuple):
    """A system in units in which its entries have similar magnitudes.

    ``inputs`` (nu,) and ``outputs`` (ny,) are the factors, powers of two, of the columns of B and D and of
    the rows of C and D. ``parts`` are the states of the irreducible diagonal blocks of A.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    inputs: Array
    outputs: Array
    parts: list[list[int]]


def balanced(A: Array, B: Array, C: Array) -> tuple[Array, Array, Array]:
    """The same system with its states scaled by powers of two, which causes no rounding errors.

    For each state the norms of its column in ``[A; C]`` and of its row in ``[A, B]`` are made as equal as
    possible (Osborne, J. ACM 7, 1960, 338-345, with inputs and outputs as in TB01ID of SLICOT).
    """
    factors = balancing_factors(A, B, C)
    return A * factors / factors[:, None], B / factors[:, None], C * factors


def balancing_factors(A: Array, B: Array, C: Array) -> Array:
    """The powers of two ``f`` (nx,) of :func:`balanced`: ``x = f x_balanced``."""
    a, b, c = A.copy(), B.copy(), C.copy()
    factors = np.ones(a.shape[0])
    for _ in range(MAX_SWEEPS):
        changed = False
        for k in range(a.shape[0]):
            column = math.hypot(_length(np.delete(a[:, k], k)), _length(c[:, k]))
            row = math.hypot(_length(np.delete(a[k], k)), _length(b[k]))
            if column == 0.0 or row == 0.0:
                continue
            factor = 2.0 ** round(math.log2(row / column) / 2.0)
            if factor != 1.0 and column * factor + row / factor < 0.95 * (column + row):
                a[:, k] *= factor
                c[:, k] *= factor
                a[k] /= factor
                b[k] /= factor
                factors[k] *= factor
                changed = True
        if not changed:
            break
    return factors


def scaled(A: Array, B: Array, C: Array, D: Array) -> ScaledSystem:
    """The same system with states, inputs and outputs scaled by powers of two.

    The states of each irreducible diagonal block of A are balanced. A factor for each of these blocks, each
    input and each output gives the connections between them the magnitude of A, as far as possible: the sum
    of the squared logarithms is minimal (Curtis and Reid, IMA J. Appl. Math. 10, 1972, 118-124). The result
    does not depend on the units of states, inputs, outputs and time.
    """
    a, b, c = A.copy(), B.copy(), C.copy()
    n, (ny, nu) = A.shape[0], D.shape
    parts = irreducible_parts(A)
    for part in parts:
        block = np.ix_(part, part)
        none = np.empty((0, len(part)))
        factors = balancing_factors(a[block], none.T, none)
        a[:, part], c[:, part] = a[:, part] * factors, c[:, part] * factors
        a[part], b[part] = a[part] / factors[:, None], b[part] / factors[:, None]
    matrix = np.block([[a, b], [c, D]])
    groups = [*parts, *([n + k] for k in range(max(nu, ny)))]
    columns, rows = _group_factors(matrix, groups, len(parts), nu, ny)
    matrix = matrix * columns / rows[:, None]
    return ScaledSystem(
        matrix[:n, :n], matrix[:n, n:], matrix[n:, :n], matrix[n:, n:], columns[n:], 1.0 / rows[n:], parts
    )


def _group_factors(
    matrix: Array, groups: list[list[int]], count: int, nu: int, ny: int
) -> tuple[Array, Array]:
    """Factors of the columns and divisors of the rows of ``[[A, B], [C, D]]``, equal within each group.

    The first ``count`` groups are states, which have the same factor for columns and rows.
    """
    n = matrix.shape[0] - ny
    sizes = _block_norms(matrix, groups, nu, ny)
    rates = np.diag(sizes)[:count]
    size = float(rates.max(initial=0.0)) or 1.0
    unknowns = count + nu + ny
    laplacian, right = 1e-9 * np.eye(unknowns), np.zeros(unknowns)
    for i, k in np.argwhere(sizes > 0.0).tolist():
        if i == k and i < count:
            continue
        row, column = (i if i < count else i + nu), k
        # D determines the factors of ports without other connections only.
        weight = 1e-4 if i >= count and k >= count else 1.0
        excess = weight * math.log2(float(sizes[i, k]) / size)
        laplacian[[row, column], [row, column]] += weight
        laplacian[[row, column], [column, row]] -= weight
        right[column] -= excess
        right[row] += excess
    logarithms = np.round(np.linalg.solve(laplacian, right)) if unknowns else right
    logarithms = np.clip(logarithms, -MAX_LOGARITHM, MAX_LOGARITHM)
    columns, rows = np.ones(n + nu), np.ones(n + ny)
    for k in range(count):
        columns[groups[k]] = rows[groups[k]] = np.exp2(logarithms[k])
    columns[n:] = np.exp2(logarithms[count : count + nu])
    rows[n:] = np.exp2(logarithms[count + nu :])
    return columns, rows


def _block_norms(matrix: Array, groups: list[list[int]], nu: int, ny: int) -> Array:
    """The Frobenius norms of the blocks of ``[[A, B], [C, D]]`` between groups of states and ports."""
    n = matrix.shape[0] - ny
    member = np.zeros((len(groups), n + max(nu, ny)))
    for k, group in enumerate(groups):
        member[k, group] = 1.0
    row_sets = member[:, : n + ny][: len(groups) - max(nu - ny, 0)]
    column_sets = member[:, : n + nu][: len(groups) - max(ny - nu, 0)]
    return np.sqrt(row_sets @ matrix**2 @ column_sets.T)


def _length(vector: Array) -> float:
    return float(np.linalg.norm(vector))
