"""Sensitivity indices of the measures of sweeps: Sobol and Morris."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.face.trajectory_report import text_table
from armblocks.pictures.numbers import table_number
from armblocks.sweeps.sensitivity_designs import group_size, morris_values, sobol_values

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class SobolIndices(metaclass=ArgumentErrors):
    """Sobol indices of a measure, from :meth:`armblocks.SweepResult.sobol`; arrays ``(d,)`` for d parameters.

    - ``first``: the share of the variance that the parameter causes alone.
    - ``total``: the share that would remain if all other parameters were known. The difference comes from
      interactions.
    - ``first_error``, ``total_error``: half widths of the 95 % confidence intervals, from a bootstrap.
    - ``groups``: the number of groups of runs.
    - ``omitted``: the number of groups with a failed run.

    Indices are NaN if the measure is constant.
    """

    measure: str
    parameters: tuple[str, ...]
    first: Array
    first_error: Array
    total: Array
    total_error: Array
    groups: int
    omitted: int

    def __repr__(self) -> str:
        head = f"<SobolIndices of {self.measure}, {_counted(self.groups, self.omitted)}>"
        columns = (self.first, self.first_error, self.total, self.total_error)
        heads = ("parameter", "first order", "±", "total", "±")
        return _table(head, heads, self.parameters, columns, -self.total)


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MorrisEffects(metaclass=ArgumentErrors):
    """Elementary effects of Morris on a measure, from :meth:`armblocks.SweepResult.morris`; arrays ``(d,)``.

    An effect is the change of the measure if the parameter passes its whole distribution, extrapolated from
    half of it.

    - ``mean_absolute``: the importance of the parameter (mu*).
    - ``mean``: smaller than ``mean_absolute`` in magnitude if the direction changes.
    - ``deviation``: large for nonlinear parameters and for interactions (sigma).
    - ``groups``: the number of paths.
    - ``omitted``: the number of paths with a failed run.
    """

    measure: str
    parameters: tuple[str, ...]
    mean: Array
    mean_absolute: Array
    deviation: Array
    groups: int
    omitted: int

    def __repr__(self) -> str:
        head = f"<MorrisEffects of {self.measure}, {_counted(self.groups, self.omitted)}>"
        columns = (self.mean_absolute, self.mean, self.deviation)
        heads = ("parameter", "mean absolute", "mean", "deviation")
        return _table(head, heads, self.parameters, columns, -self.mean_absolute)


def sobol_indices(measure: str, parameters: tuple[str, ...], values: Array) -> SobolIndices:
    """The indices of the values ``(runs,)`` of a design ``saltelli``."""
    found = sobol_values(values, len(parameters))
    return SobolIndices(
        measure=measure,
        parameters=parameters,
        first=found.first,
        first_error=found.first_error,
        total=found.total,
        total_error=found.total_error,
        groups=found.groups,
        omitted=values.size // group_size("saltelli", len(parameters)) - found.groups,
    )


def morris_effects(measure: str, parameters: tuple[str, ...], values: Array, points: Array) -> MorrisEffects:
    """The effects on the values ``(runs,)`` of a design ``morris`` with ``points (runs, d)``."""
    found = morris_values(values, points)
    return MorrisEffects(
        measure=measure,
        parameters=parameters,
        mean=found.mean,
        mean_absolute=found.mean_absolute,
        deviation=found.deviation,
        groups=found.groups,
        omitted=values.size // group_size("morris", len(parameters)) - found.groups,
    )


def _counted(groups: int, omitted: int) -> str:
    return f"{groups} groups" + (f", {omitted} omitted because of failed runs" if omitted else "")


def _table(
    head: str, heads: Sequence[str], parameters: Sequence[str], columns: Sequence[Array], order: Array
) -> str:
    rows: list[list[str]] = [
        [str(parameters[k]), *(table_number(float(column[k]), 3) for column in columns)]
        for k in np.argsort(order, kind="stable").tolist()
    ]
    return "\n".join([head, *(f"  {line}" for line in text_table(heads, rows))])
