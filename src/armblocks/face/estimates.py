"""Common parts of results of estimations: values, intervals, charts of measured and fitted data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError, UnknownNameError
from armblocks.estimation.student_t import t_factor
from armblocks.pictures.numbers import table_number
from armblocks.pictures.picture import Picture
from armblocks.report.charts.time_chart import Panel, Trace, time_chart

Array = NDArray[np.float64]


def value_of(parameter: str, parameters: Sequence[str], values: Array, kind: str, where: str) -> float:
    """The value of a parameter. Raises UnknownNameError."""
    if parameter not in parameters:
        raise UnknownNameError(kind, parameter, parameters, where=where)
    return float(values[list(parameters).index(parameter)])


def standard_errors(covariance: Array) -> Array:
    """The standard errors (k,) of estimates with this covariance (k, k)."""
    return np.sqrt(np.diag(covariance))


def correlations(covariance: Array) -> Array:
    """The correlations (k, k) of estimates with this covariance (k, k)."""
    errors = standard_errors(covariance)
    return covariance / np.outer(errors, errors)


def confidence_intervals(values: Array, covariance: Array, degrees_of_freedom: int, level: float) -> Array:
    """Lower and upper ends (k, 2) of the intervals of Student's t distribution. Raises InputError."""
    if not 0.0 < level < 1.0:
        raise InputError(
            f"level = {level!r}",
            where="confidence_intervals",
            allowed="a probability between 0 and 1",
            fix="use 0.95",
        )
    half = t_factor(level, float(max(degrees_of_freedom, 1))) * standard_errors(covariance)
    return np.stack([values - half, values + half], axis=1)


def cell(value: float | str, digits: int) -> str:
    """A number in a table; empty for strings and for numbers that are not finite."""
    return table_number(value, digits) if isinstance(value, float) and np.isfinite(value) else ""


def summary_line(condition: float, degrees_of_freedom: int) -> str:
    """The sentence on the condition of an estimation."""
    return f"condition number {condition:.4g}, {degrees_of_freedom} degrees of freedom"


@dataclass(frozen=True, eq=False, kw_only=True)
class Comparison:
    """Measured and fitted values (N,) of one quantity, NaN where there are none."""

    quantity: str
    unit: str
    measured: Array
    fitted: Array


def comparison_chart(
    time: Array, rows: Sequence[Comparison], title: str, description: str, width: float
) -> Picture:
    """A panel for each quantity with measured values, fitted values and residuals over ``time`` (N,).

    Experiments, whose times begin again, follow each other; lines are interrupted at gaps.
    """
    shown, breaks = with_gaps(time)
    panels: list[Panel] = []
    for row in rows:
        lines = {"measured": row.measured, "fitted": row.fitted, "residual": row.measured - row.fitted}
        traces = tuple(
            Trace(label=label, values=np.insert(values, breaks, np.nan), index=k)
            for k, (label, values) in enumerate(lines.items())
        )
        panels.append(Panel(quantity=row.quantity, unit=row.unit, traces=traces))
    return time_chart(shown, panels, title=title, description=description, width=width)


def with_gaps(time: Array) -> tuple[Array, NDArray[np.intp]]:
    """Times for a chart: later experiments follow earlier experiments; and where lines are interrupted."""
    steps = np.diff(time)
    usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 1.0
    restart = np.flatnonzero(steps <= 0.0)
    shifted = time.copy()
    for k in restart.tolist():
        shifted[k + 1 :] += shifted[k] - time[k + 1] + usual
    gaps = np.flatnonzero(np.diff(shifted) > 3.0 * usual)
    breaks = np.union1d(restart, gaps) + 1
    return np.insert(shifted, breaks, shifted[breaks - 1] if len(breaks) else []), breaks
