"""The objective and the constraints of an optimisation over the scenarios of a design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError
from armblocks.face.optimise_formulas import Condition
from armblocks.optimisation.search import violations

Array = NDArray[np.float64]

MEAN, WORST = "mean", "worst"


@dataclass(frozen=True, kw_only=True)
class Statistics:
    """How values of S scenarios become one number.

    ``objective``: ``mean``, ``worst`` (the largest), or a probability whose quantile counts. ``share``: the
    share of the scenarios in which a constraint holds.
    """

    objective: str | float = MEAN
    share: float = 1.0

    @staticmethod
    def checked(objective: object, share: object, where: str) -> Statistics:
        """Raises ``InputError`` for other values."""
        number = isinstance(objective, int | float) and not isinstance(objective, bool)
        if objective not in (MEAN, WORST) and not (number and 0.0 < float(str(objective)) < 1.0):
            raise InputError(
                f"the statistic is {objective!r}",
                where=where,
                allowed="'mean', 'worst', or the probability of a quantile, such as 0.9",
                fix="give statistic='worst' for the largest objective of all scenarios",
            )
        if isinstance(share, bool) or not isinstance(share, int | float) or not 0.0 < share <= 1.0:
            raise InputError(
                f"the share is {share!r}",
                where=where,
                allowed="the share of the scenarios in which the constraints hold, above 0 and up to 1",
                fix="omit share, or give for example share=0.95",
            )
        return Statistics(
            objective=objective if isinstance(objective, str) else float(str(objective)), share=share
        )

    @property
    def smooth(self) -> bool:
        """Whether the numbers have derivatives or are largest values."""
        return isinstance(self.objective, str) and self.share == 1.0

    def objectives(self, values: Array) -> Array:
        """The objective ``(N,)`` of values ``(N, S)``; infinite where a scenario has no value."""
        if isinstance(self.objective, float):
            # Runs without a value are worse than all others.
            known = np.where(np.isfinite(values), values, np.inf)
            return _quantile(known, self.objective)
        found = values.mean(axis=1) if self.objective == MEAN else values.max(axis=1)
        return np.where(np.isfinite(values).all(axis=1), found, np.inf)

    def rows(self, values: Array, conditions: Sequence[Condition]) -> Array:
        """The rows ``(N, m)`` of constraints with values ``(N, S, k)``: for each one the value that has to
        be below its upper limit, and the value that has to be above its lower limit; NaN without values."""
        columns: list[Array] = []
        for k, condition in enumerate(conditions):
            low = np.where(np.isfinite(values[..., k]), values[..., k], -np.inf)
            high = np.where(np.isfinite(values[..., k]), values[..., k], np.inf)
            if np.isfinite(condition.high):
                columns.append(_quantile(high, self.share))
            if np.isfinite(condition.low):
                columns.append(-_quantile(-low, self.share))
        rows = np.stack(columns, axis=1) if columns else np.empty((len(values), 0))
        return np.where(np.isfinite(rows), rows, np.nan)


def _quantile(values: Array, probability: float) -> Array:
    """The smallest value that at least this share of the values ``(N, S)`` does not exceed, ``(N,)``."""
    ordered = np.sort(values, axis=1)
    count = ordered.shape[1]
    return ordered[:, max(0, int(np.ceil(probability * count - 1e-9)) - 1)]


def row_limits(conditions: Sequence[Condition]) -> tuple[Array, Array]:
    """The limits of the rows of :meth:`Statistics.rows`."""
    limits: list[tuple[float, float]] = []
    for condition in conditions:
        if np.isfinite(condition.high):
            limits.append((-np.inf, condition.high))
        if np.isfinite(condition.low):
            limits.append((condition.low, np.inf))
    pairs = np.array(limits).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def violation(rows: Array, conditions: Sequence[Condition]) -> Array:
    """The largest relative violation ``(N,)`` of rows ``(N, m)``."""
    return violations(rows, *row_limits(conditions))
