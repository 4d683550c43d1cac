"""Minimisation with values alone: differential evolution, then COBYQA, both of SciPy.

Sources: R. Storn, K. Price, Journal of Global Optimization 11, 1997, 341-359, with the rule of Lampinen for
constraints; T. M. Ragonneau, Model-Based Derivative-Free Optimization Methods and Software, thesis, 2022.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.extras import from_extra

Array = NDArray[np.float64]
Values = Callable[[Array], tuple[Array, Array]]
"""For points ``(N, n)`` the objective ``(N,)`` and rows ``(N, m)``; infinite where there are no values."""

FEASIBILITY = 1e-6
"""Largest violation of a row, relative to its limit, of a point that counts as feasible."""
_LARGE = 1e30
"""The value of a point without a value, for methods that need finite numbers."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Search:
    """A search within the unit cube. ``values``: the functions; ``row_lower``, ``row_upper (m,)``: limits.

    ``start (n,)``: a first point. ``evaluations``: the largest number of evaluated points. ``stop``: a text
    ends the search.
    """

    values: Values
    row_lower: Array
    row_upper: Array
    start: Array
    evaluations: int
    seed: int
    stop: Callable[[], str]


class _Stopped(Exception):  # noqa: N818 - no error
    """Ends a search from inside a function that it calls."""


def violations(rows: Array, lower: Array, upper: Array) -> Array:
    """The largest violation ``(N,)`` of the rows ``(N, m)``, relative to ``1 + |limit|``."""
    if not rows.shape[1]:
        return np.zeros(len(rows))
    with np.errstate(invalid="ignore"):
        low = np.where(np.isfinite(lower), (lower - rows) / (1.0 + np.abs(_finite(lower))), 0.0)
        high = np.where(np.isfinite(upper), (rows - upper) / (1.0 + np.abs(_finite(upper))), 0.0)
    largest = np.maximum(np.maximum(low, high).max(axis=1), 0.0)
    return np.where(np.isfinite(rows).all(axis=1), largest, np.inf)


class _Record:
    """Evaluates points in the unit cube once, and stores the best one."""

    def __init__(self, search: Search) -> None:
        self.search = search
        self._known: dict[bytes, tuple[float, Array]] = {}
        self.best: tuple[float, float, Array] | None = None
        self.count = 0
        self.reason = ""

    def at(self, points: Array) -> tuple[Array, Array]:
        """Objective ``(N,)`` and rows ``(N, m)`` of points ``(N, n)``."""
        points = np.ascontiguousarray(np.clip(points, 0.0, 1.0))
        new = list({p.tobytes(): p for p in points if p.tobytes() not in self._known}.values())
        if new:
            self._check(len(new))
            f, rows = self.search.values(np.array(new))
            self.count += len(new)
            allowed = violations(rows, self.search.row_lower, self.search.row_upper)
            for point, value, row, broken in zip(new, f.tolist(), rows, allowed.tolist()):
                self._known[point.tobytes()] = value, row
                key = (max(broken - FEASIBILITY, 0.0), value)
                if self.best is None or key < self.best[:2]:
                    self.best = (*key, point.copy())
        found = [self._known[p.tobytes()] for p in points]
        return np.array([f for f, _ in found]), np.array([row for _, row in found])

    @property
    def penalty(self) -> float:
        """A value above all known values, for a point without a value."""
        known = np.array([f for f, _ in self._known.values() if np.isfinite(f)])
        return float(known.max() + np.ptp(known) + 1.0) if known.size else _LARGE

    def _check(self, count: int) -> None:
        if self.count and self.count + count > self.search.evaluations:
            self.reason = "the number of evaluations is reached"
            raise _Stopped
        self.reason = self.search.stop()
        if self.reason:
            raise _Stopped


def search_minimum(search: Search, *, global_search: bool) -> tuple[Array, str, bool]:
    """The best point ``(n,)``, the reason of the end, and whether the search has converged.

    With ``global_search`` differential evolution finds the region; COBYQA improves its best point.
    """
    record = _Record(search)
    message, converged = "", False
    try:
        record.at(search.start[np.newaxis])
        if global_search:
            _evolve(record)
        message, converged = _improve(record)
    except _Stopped:
        message = record.reason
    except KeyboardInterrupt:
        if record.best is None:
            raise
        interrupts.answered()
        message = "stopped by Ctrl-C"
    assert record.best is not None
    return record.best[2], message, converged


def _evolve(record: _Record) -> None:
    """Differential evolution: each generation is one call of the functions."""
    with from_extra("analysis", "optimisation"):
        from scipy.optimize import NonlinearConstraint, differential_evolution

    search, n = record.search, record.search.start.size
    members = int(np.clip(10 * n, 20, 120))
    generations = max(1, (search.evaluations * 3 // 4) // members - 1)

    def objective(x: Array) -> Array:
        return record.at(np.atleast_2d(x.T))[0]

    def rows(x: Array) -> Array:
        found = record.at(np.atleast_2d(x.T))[1].T
        return np.where(np.isfinite(found), found, _LARGE * np.where(np.isfinite(upper), 1.0, -1.0)[:, None])

    upper = search.row_upper
    constraints = NonlinearConstraint(rows, search.row_lower, upper) if upper.size else ()
    differential_evolution(
        objective,
        [(0.0, 1.0)] * n,
        init=_first_members(search, members),
        x0=search.start,
        maxiter=generations,
        tol=1e-3,
        atol=0.0,
        polish=False,
        vectorized=True,
        updating="deferred",
        constraints=constraints,
        **_generator(differential_evolution, search.seed),
    )


def _finite(limits: Array) -> Array:
    return np.where(np.isfinite(limits), limits, 0.0)


def _first_members(search: Search, members: int) -> Array:
    """The first generation: a Latin hypercube."""
    generator = np.random.default_rng(search.seed)
    n = search.start.size
    slices = np.array([generator.permutation(members) for _ in range(n)]).T
    return (slices + generator.random((members, n))) / members


def _generator(function: Callable[..., object], seed: int) -> dict[str, int]:
    """The seed by the name that this version of SciPy has for it."""
    import inspect

    return {"rng" if "rng" in inspect.signature(function).parameters else "seed": seed}


def _improve(record: _Record) -> tuple[str, bool]:
    """COBYQA from the best point."""
    with from_extra("analysis", "optimisation"):
        from scipy.optimize import NonlinearConstraint, minimize

    search = record.search
    assert record.best is not None
    start = record.best[2]

    size = 1.0 + np.maximum(np.abs(_finite(search.row_lower)), np.abs(_finite(search.row_upper)))

    def objective(x: Array) -> float:
        value = float(record.at(x[np.newaxis])[0][0])
        return value if np.isfinite(value) else record.penalty

    def rows(x: Array) -> Array:
        found = record.at(x[np.newaxis])[1][0]
        outside = np.where(np.isfinite(search.row_upper), search.row_upper + size, search.row_lower - size)
        return np.where(np.isfinite(found), found, outside) / size

    constraints = (
        [NonlinearConstraint(rows, search.row_lower / size, search.row_upper / size)] if size.size else []
    )
    result = minimize(
        objective,
        start,
        method="COBYQA",
        bounds=[(0.0, 1.0)] * start.size,
        constraints=constraints,
        options={
            "maxfev": max(1, search.evaluations - record.count) + start.size,
            "initial_tr_radius": 0.05,
            "final_tr_radius": 1e-7,
            "feasibility_tol": FEASIBILITY,
        },
    )
    found = bool(result.success)
    return ("converged" if found else str(result.message).rstrip(".").lower()), found
