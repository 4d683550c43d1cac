"""Designs whose runs differ in single parameters, for the sensitivity indices of Sobol and of Morris.

The rows of a design are groups of d + 2 or d + 1 runs for d parameters. The estimators are a few lines; SALib
(Herman, Usher 2017) has the same estimators, but needs three further packages and its own tables of runs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.designs import SOBOL, unit_points
from armblocks.errors import InputError

Array = NDArray[np.float64]

SALTELLI, MORRIS = SENSITIVITY_DESIGNS = ("saltelli", "morris")
LEVELS = 4
"""Number of levels of each parameter in the design of Morris; a step crosses half of them."""
STEP = 0.5
"""The step of a parameter in the design of Morris, as a change of its probability."""
RESAMPLES = 200
"""Number of bootstrap resamples for confidence intervals."""


def group_size(kind: str, dimensions: int) -> int:
    """The number of runs in a group."""
    return dimensions + (2 if kind == SALTELLI else 1)


def sensitivity_points(kind: str, runs: int | None, dimensions: int, seed: int) -> Array:
    """The probabilities of the parameters of all runs, ``(runs, dimensions)``.

    - ``saltelli``: each group has a point A, a point B, and for each parameter A with the value of B. A and B
      are points of a scrambled Sobol sequence (Saltelli et al., Computer Physics Communications 181, 2010).
    - ``morris``: each group is a path in which the parameters change one after the other, in random order
      (Morris, Technometrics 33, 1991).

    Raises ``InputError`` for other numbers of runs.
    """
    size = group_size(kind, dimensions)
    if runs is None or runs < 2 * size or runs % size:
        raise InputError(
            f"runs is {runs} for the design '{kind}' of {dimensions} parameters",
            allowed=f"a multiple of {size}, at least {2 * size}",
            where="sweep",
            fix=f"write for example runs={100 * size}",
        )
    groups = runs // size
    if kind == SALTELLI:
        both = unit_points(SOBOL, groups, 2 * dimensions, seed)
        a, b = both[:, :dimensions], both[:, dimensions:]
        points = np.stack([a, b, *([a] * dimensions)], axis=1)
        for k in range(dimensions):
            points[:, 2 + k, k] = b[:, k]
        return points.reshape(runs, dimensions)
    generator = np.random.default_rng(seed)
    low = (generator.integers(0, LEVELS // 2, (groups, dimensions)) + 0.5) / LEVELS
    upwards = generator.random((groups, dimensions)) < 0.5
    order = np.argsort(generator.random((groups, dimensions)), axis=1)
    place = np.argsort(order, axis=1)  # the step in which each parameter changes
    changed = np.arange(size)[None, :, None] > place[:, None, :]
    points = low[:, None, :] + STEP * (changed == upwards[:, None, :])
    return points.reshape(runs, dimensions)


@dataclass(frozen=True, eq=False)
class SobolValues:
    """First-order and total indices ``(d,)`` with the half widths of their 95 % confidence intervals."""

    first: Array
    first_error: Array
    total: Array
    total_error: Array
    groups: int


def sobol_values(values: Array, dimensions: int) -> SobolValues:
    """Sobol indices of the values ``(runs,)`` of a design ``saltelli``.

    First order: Saltelli et al. 2010, table 2 (b); total: Jansen, Computer Physics Communications 117, 1999.
    Groups with a value that is not finite are omitted. The intervals are those of a bootstrap.
    """
    table = values.reshape(-1, dimensions + 2)
    table = table[np.isfinite(table).all(axis=1)]
    groups = len(table)
    if groups < 2:
        nothing = np.full(dimensions, np.nan)
        return SobolValues(nothing, nothing, nothing, nothing, groups)
    table = table - table[:, :2].mean()
    scale = np.abs(table).max()
    table = table / scale if scale > 0.0 else table
    a, b, mixed = table[:, :1], table[:, 1:2], table[:, 2:]
    # The means of these terms over the groups give the indices.
    terms = np.hstack([b * (mixed - a), 0.5 * (a - mixed) ** 2, 0.5 * (a + b), 0.5 * (a**2 + b**2)])

    def indices(means: Array) -> tuple[Array, Array]:
        variance = means[..., -1:] - means[..., -2:-1] ** 2
        variance = np.where(variance > 0.0, variance, np.nan)
        return means[..., :dimensions] / variance, means[..., dimensions : 2 * dimensions] / variance

    first, total = indices(terms.mean(axis=0))
    generator = np.random.default_rng(0)
    resampled = np.array(
        [terms[generator.integers(0, groups, groups)].mean(axis=0) for _ in range(RESAMPLES)]
    )
    errors = [1.96 * np.std(part, axis=0) for part in indices(resampled)]
    return SobolValues(first, errors[0], total, errors[1], groups)


@dataclass(frozen=True, eq=False)
class MorrisValues:
    """Mean, mean of the absolute values and standard deviation ``(d,)`` of the elementary effects."""

    mean: Array
    mean_absolute: Array
    deviation: Array
    groups: int


def morris_values(values: Array, points: Array) -> MorrisValues:
    """The elementary effects of the values ``(runs,)`` of a design ``morris`` with ``points (runs, d)``.

    An effect is the change of the value for a change of the parameter by its whole range (probability 0 to
    1), extrapolated from a step over half of it. Paths with a value that is not finite are omitted.
    """
    dimensions = points.shape[1]
    table = values.reshape(-1, dimensions + 1)
    path = points.reshape(-1, dimensions + 1, dimensions)
    valid = np.isfinite(table).all(axis=1)
    table, path = table[valid], path[valid]
    groups = len(table)
    if groups < 2:
        nothing = np.full(dimensions, np.nan)
        return MorrisValues(nothing, nothing, nothing, groups)
    steps = np.diff(path, axis=1)
    number = np.abs(steps).argmax(axis=2)
    elementary_effect = np.diff(table, axis=1) / np.take_along_axis(steps, number[..., None], axis=2)[..., 0]
    effects = np.empty((groups, dimensions))
    np.put_along_axis(effects, number, elementary_effect, axis=1)
    return MorrisValues(
        effects.mean(axis=0), np.abs(effects).mean(axis=0), effects.std(axis=0, ddof=1), groups
    )
