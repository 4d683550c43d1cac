"""The result of a fit of a diagram to measurements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram import Diagram
from armblocks.errors import counted, shortened_list
from armblocks.face.estimates import (
    Comparison,
    cell,
    comparison_chart,
    confidence_intervals,
    correlations,
    standard_errors,
    summary_line,
    value_of,
)
from armblocks.face.text_table import text_table
from armblocks.face.trajectory_report import save_picture
from armblocks.pictures.numbers import table_number
from armblocks.pictures.picture import Picture
from armblocks.pictures.style import FIGURE_WIDTH

Array = NDArray[np.float64]

_STRONG = 0.95
_MOST_PANELS = 12


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedSignal(metaclass=ArgumentErrors):
    """Measured and fitted values of one entry of a signal in one experiment: ``time`` (N,) s, with NaN gaps.

    ``noise``: the standard deviation of its measurement, in its ``unit``.
    """

    name: str
    unit: str
    experiment: int
    time: Array = field(repr=False)
    measured: Array = field(repr=False)
    fitted: Array = field(repr=False)
    noise: float

    @property
    def residuals(self) -> Array:
        """Measured minus fitted values (N,)."""
        return self.measured - self.fitted

    @property
    def explained(self) -> float:
        """The explained part of the deviation from the mean, in % (MATLAB's normalised RMS fit)."""
        used = np.isfinite(self.measured)
        measured, residuals = self.measured[used], self.residuals[used]
        size = float(np.linalg.norm(measured - measured.mean())) if used.any() else 0.0
        return 100.0 * (1.0 - float(np.linalg.norm(residuals)) / size) if size else float("nan")


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class FitResult(metaclass=ArgumentErrors):
    """Fitted parameters of a diagram. ``print`` shows them as a table.

    - ``diagram``: the diagram with the fitted values.
    - ``parameters``: the names of the k fitted numbers.
    - ``values``, ``start`` (k,): the fitted values and the values at the start of the search.
    - ``covariance`` (k, k): NaN for parameters that the measurements do not determine.
    - ``bounds`` (k, 2): the lowest and highest values.
    - ``condition``: condition number of the weighted derivatives with columns of length 1.
    - ``signals``: measured and fitted signals of all experiments.
    - ``message``: the reason why the search ended.
    - ``stopped``: whether the search ended early.
    - ``differences``: parameters that were differentiated by differences of runs, with the reason.
    """

    diagram: Diagram = field(repr=False)
    parameters: tuple[str, ...]
    values: Array
    start: Array
    covariance: Array
    bounds: Array
    degrees_of_freedom: int
    condition: float
    signals: tuple[FittedSignal, ...]
    evaluations: int
    message: str
    stopped: bool
    differences: Mapping[str, str] = field(default_factory=dict[str, str], repr=False)
    ignored: tuple[str, ...] = field(default=(), repr=False)

    def __getitem__(self, parameter: str) -> float:
        """The value of a parameter. Raises UnknownNameError."""
        return value_of(parameter, self.parameters, self.values, "fitted parameter", self.diagram.name)

    @property
    def standard_errors(self) -> Array:
        """The standard errors (k,); NaN for parameters that the measurements do not determine."""
        return standard_errors(self.covariance)

    @property
    def not_identified(self) -> tuple[str, ...]:
        """The parameters that the measurements do not determine; their values are near the start."""
        errors = self.standard_errors.tolist()
        return tuple(name for name, error in zip(self.parameters, errors) if error != error)

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """The parameters whose values are at a bound; their standard errors ignore the bound."""
        low, high = self.bounds.T
        near = 1e-5 * np.maximum(np.abs(self.values), np.abs(self.start))
        at_bound = (self.values - low <= near) | (high - self.values <= near)
        return tuple(name for name, there in zip(self.parameters, at_bound.tolist()) if there)

    @property
    def correlation(self) -> Array:
        """The correlations (k, k) of the estimates."""
        return correlations(self.covariance)

    def confidence_intervals(self, level: float = 0.95) -> Array:
        """Lower and upper ends (k, 2) of the intervals that contain each parameter with this probability.

        They are valid for independent, normally distributed noise, and where the signals are nearly linear in
        the parameters within the intervals.
        """
        return confidence_intervals(self.values, self.covariance, self.degrees_of_freedom, level)

    def table(self) -> list[dict[str, float | str]]:
        """One row for each parameter."""
        intervals = self.confidence_intervals()
        return [
            {
                "parameter": name,
                "value": float(self.values[k]),
                "standard error": float(self.standard_errors[k]),
                "lower 95 %": float(intervals[k, 0]),
                "upper 95 %": float(intervals[k, 1]),
                "start": float(self.start[k]),
            }
            for k, name in enumerate(self.parameters)
        ]

    @property
    def summary(self) -> str:
        """The condition number and the degrees of freedom, as a sentence."""
        return summary_line(self.condition, self.degrees_of_freedom)

    @property
    def findings(self) -> tuple[str, ...]:
        """Sentences on undetermined parameters, bounds, correlations, differences, the reason for the end."""
        found: list[str] = []
        if self.stopped:
            found.append(f"the search ended early: {self.message}; the values are the best so far")
        if self.not_identified:
            found.append(
                "not identified, because the signals do not depend on them or only on combinations: "
                + shortened_list(list(self.not_identified))
            )
        if np.isinf(self.standard_errors).any():
            found.append(
                "the standard errors are unknown: give more measured values than parameters, or noise="
            )
        if self.at_bounds:
            found.append("at a bound: " + shortened_list(list(self.at_bounds)))
        with np.errstate(invalid="ignore"):
            i, j = np.nonzero(np.triu(np.abs(self.correlation) > _STRONG, 1))
        pairs = [f"{self.parameters[a]} and {self.parameters[b]}" for a, b in zip(i.tolist(), j.tolist())]
        if pairs:
            found.append("correlated by more than 0.95: " + "; ".join(pairs[:5]))
        found += [f"{name} by differences of runs: {why}" for name, why in self.differences.items()]
        if self.ignored:
            found.append("columns that are not signals: " + shortened_list(list(self.ignored)))
        return tuple(found)

    def picture(self, width: float = FIGURE_WIDTH) -> Picture:
        """Measured and fitted signals over time, one panel for each signal; experiments in sequence."""
        names = list(dict.fromkeys(signal.name for signal in self.signals))[:_MOST_PANELS]
        units = {signal.name: signal.unit for signal in self.signals}
        rows = [
            Comparison(
                quantity=name,
                unit=units[name],
                measured=self._series(name, "measured"),
                fitted=self._series(name, "fitted"),
            )
            for name in names
        ]
        description = "Measured and fitted signals and their differences."
        time = np.concatenate(list(self._times.values()))
        return comparison_chart(time, rows, f"Fit of {self.diagram.name}", description, width)

    @property
    def _times(self) -> dict[int, Array]:
        """The times of each experiment with a measured signal."""
        return {signal.experiment: signal.time for signal in self.signals}

    def _series(self, name: str, line: str) -> Array:
        """The values of a signal in all experiments, NaN where it was not measured."""
        parts = {signal.experiment: getattr(signal, line) for signal in self.signals if signal.name == name}
        return np.concatenate([parts.get(k, np.full(len(time), np.nan)) for k, time in self._times.items()])

    def plot(self, *, save: str | PathLike[str] | None = None) -> Picture:
        """The picture of signals and residuals; ``save``: the ``.svg`` or ``.png`` file to write."""
        picture = self.picture()
        if save is not None:
            save_picture(picture, save, "FitResult.plot")
        return picture

    def __repr__(self) -> str:
        return (
            f"<FitResult {self.diagram.name}: {counted(len(self.parameters), 'parameter')}, {self.message}>"
        )

    def __str__(self) -> str:
        names = ("value", "standard error", "lower 95 %", "upper 95 %", "start")
        heads = ["parameter", *names]
        rows = [[str(row["parameter"]), *(cell(row[name], 5) for name in names)] for row in self.table()]
        evaluations = counted(self.evaluations, "evaluation")
        lines = [f"{self.diagram.name}: {self.message} after {evaluations}", *text_table(heads, rows), ""]
        signal_rows = [
            [
                f"{signal.name} ({signal.experiment})" if self._several else signal.name,
                table_number(signal.noise, 4),
                signal.unit,
                f"{signal.explained:.2f} %",
            ]
            for signal in self.signals
        ]
        lines += text_table(["signal", "noise", "unit", "explained"], signal_rows)
        lines += ["", self.summary]
        return "\n".join([*lines, *self.findings])

    @property
    def _several(self) -> bool:
        return any(signal.experiment > 1 for signal in self.signals)
