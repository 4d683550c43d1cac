"""Fit of a diagram's parameters to measured signals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.diagram import Diagram, with_parameters
from armblocks.errors import DiagramError, InputError, SimulationError, UnknownNameError
from armblocks.estimation.nonlinear import NonlinearFit, nonlinear_fit
from armblocks.extras import require
from armblocks.face.fit_data import read_experiments, read_measurement
from armblocks.face.fit_model import (
    FittedParameters,
    FittedRun,
    parameter_rule,
    reasons_without_derivative,
)
from armblocks.face.fit_result import FitResult, FittedSignal
from armblocks.face.linearizing import resolved_diagram
from armblocks.face.model import CompiledDiagram, compile_diagram
from armblocks.face.settings import RunSettings, check_settings, takes_settings, with_settings

Array = NDArray[np.float64]
Progress = Callable[[int, float], None]


@takes_settings
@interrupts.kept()
def fit(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    parameters: str | Sequence[str],
    data: Any,
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    start: Mapping[str, float] | None = None,
    noise: Mapping[str, float] | None = None,
    values: Mapping[str, object] | None = None,
    evaluations: int = 200,
    progress: Progress | None = None,
    **settings: Unpack[RunSettings],
) -> FitResult:
    """Find the values of ``parameters`` with which the signals of a diagram are nearest to measured ones.

    - ``parameters``: the names of :func:`sensitivity`: ``"plant.mass"``, one entry ``"g.gain[1]"``, a
      parameter of a mask; initial values of states are parameters as well. The search begins at the values of
      the diagram, or at ``start``.
    - ``data``: a dictionary ``{"t": times, "plant/y": values}``, a data frame or a file with a column for
      each measured signal. The times (s) need not be equally spaced; NaN are missing values, and two rows
      with one time are both sides of a jump. ``data`` may also be an :class:`Experiment`, which has its own
      parameters such as its input, or a list of several experiments, which are fitted together.
    - ``bounds``: lowest and highest values by name, by default the bounds of the block or mask.
    - ``noise``: known standard deviations of signals by name; otherwise each signal has unknown noise, which
      is estimated and determines its weight.
    - ``values``: values of parameters that are not fitted.
    - ``progress(evaluations, squares)`` is called after every evaluation. Ctrl-C ends the search with the
      best values so far.

    Method: nonlinear least squares within bounds (SciPy's trust-region reflective method), with the exact
    derivatives of :func:`sensitivity`. Parameters without an exact derivative are differentiated by
    differences of runs, and the result names them. The run begins at 0; its settings are as in
    :func:`simulate`.

    Raises UnknownNameError for unknown names, InputError for unsuitable data, SimulationError if the run with
    the first values fails, MissingLibraryError without the extra ``analysis``.
    """
    check_settings(settings, fit)
    require("analysis", "parameter estimation")
    resolved = resolved_diagram(diagram, values, "fit")
    where = f"fit of '{resolved.name}'"
    names = (parameters,) if isinstance(parameters, str) else tuple(parameters)
    if not names or evaluations < 1 or int(evaluations) != evaluations:
        raise InputError(
            "no parameter is named" if not names else f"evaluations = {evaluations}",
            where=where,
            allowed="one or more parameters, and an integer number of evaluations, 1 or more",
            fix="name the parameters to be fitted",
        )
    fitted = FittedParameters(resolved, compile_diagram(resolved).system, names, where)
    theta = fitted.start.copy()
    for name, value in (start or {}).items():
        theta[_index(fitted, name, where)] = value
    limits = _bounds(resolved, fitted, bounds or {}, where)
    if not ((limits[:, 0] <= theta) & (theta <= limits[:, 1])).all():
        k = int(np.argmin((limits[:, 0] <= theta) & (theta <= limits[:, 1])))
        raise InputError(
            f"'{fitted.entries[k]}' starts at {theta[k]:g}, outside its bounds",
            where=where,
            allowed=f"{limits[k, 0]:g} to {limits[k, 1]:g}",
            fix="change the bounds, or give start= a value within them",
        )
    runs = _runs(resolved, fitted, data, settings, where)
    problem = _Problem(runs, noise or {}, where)
    found = nonlinear_fit(
        problem.evaluate,
        theta,
        (limits[:, 0], limits[:, 1]),
        deviations=problem.known_noise,
        scales=problem.scales,
        evaluations=evaluations,
        observe=progress,
    )
    return _result(resolved, fitted, problem, found, theta, limits)


def _index(fitted: FittedParameters, name: str, where: str) -> int:
    if name not in fitted.entries:
        raise UnknownNameError("fitted parameter", name, fitted.entries, where=where)
    return fitted.entries.index(name)


def _bounds(
    diagram: Diagram, fitted: FittedParameters, given: Mapping[str, tuple[float, float]], where: str
) -> Array:
    """The bounds (k, 2): as given, else the bounds of the block or mask."""
    limits = np.tile([-np.inf, np.inf], (len(fitted.entries), 1))
    for k in range(len(limits)):
        rule = parameter_rule(diagram, fitted.whole_of(k))
        above = -np.inf if rule.above is None else rule.above
        limits[k] = max(rule.minimum, above), rule.maximum
    for name, pair in given.items():
        chosen = [k for k, entry in enumerate(fitted.entries) if name in (entry, fitted.whole_of(k))]
        if not chosen:
            raise UnknownNameError("fitted parameter", name, fitted.entries, where=where)
        low, high = (float(end) for end in pair)
        if not low < high:
            raise InputError(
                f"the bounds of '{name}' are {low:g} and {high:g}",
                where=where,
                allowed="a lower and a higher number; -np.inf and np.inf for none",
                fix="give the bounds in ascending order",
            )
        limits[chosen] = low, high
    return limits


def _runs(
    diagram: Diagram, fitted: FittedParameters, data: object, settings: RunSettings, where: str
) -> list[FittedRun]:
    """The runs of all experiments."""
    runs: list[FittedRun] = []
    for number, experiment in enumerate(read_experiments(data, where), 1):
        clash = [name for name in experiment.parameters if name in fitted.wholes]
        if clash:
            raise InputError(
                f"experiment {number} has the fitted parameter '{clash[0]}'",
                where=where,
                allowed="parameters of an experiment that are not fitted",
                fix="remove it from the experiment or from the fitted parameters",
            )
        own = with_parameters(diagram, experiment.parameters) if experiment.parameters else diagram
        place = f"{where}, experiment {number}"
        measurement = read_measurement(experiment.data, compile_diagram(own).system, place)
        options = with_settings(own.settings, {**settings, "stop_time": float(measurement.time[-1])})
        reasons = reasons_without_derivative(own, fitted, list(measurement.signals))
        runs.append(FittedRun(own, fitted, measurement, options, reasons))
    return runs


class _Problem:
    """The residuals of all experiments, in the order of the measured entries of signals."""

    def __init__(self, runs: Sequence[FittedRun], noise: Mapping[str, float], where: str) -> None:
        self.runs = runs
        self.columns = [_elements(run) for run in runs]
        self.sensors = list(dict.fromkeys(name for names, _ in self.columns for name in names))
        self.units = {name: unit for names, units in self.columns for name, unit in zip(names, units)}
        measured = {name: np.empty(0) for name in self.sensors}
        self.measured = [np.hstack(list(run.measurement.signals.values())) for run in runs]
        for (names, _), values in zip(self.columns, self.measured):
            for name, column in zip(names, values.T):
                measured[name] = np.concatenate([measured[name], column[np.isfinite(column)]])
        self.sensors = [name for name in self.sensors if measured[name].size]
        sizes = [
            float(np.std(measured[name])) or float(np.abs(measured[name]).max()) for name in self.sensors
        ]
        self.scales = np.array([size or 1.0 for size in sizes])
        self.known_noise = self._known(noise, where)
        self.first = True

    def _known(self, noise: Mapping[str, float], where: str) -> Array | None:
        if not noise:
            return None
        found: list[float] = []
        aliases = {alias: path for run in self.runs for alias, path in run.aliases.items()}
        given: dict[str, float] = {}
        for name, value in noise.items():
            head, bracket, index = name.rpartition("[") if name not in aliases else (name, "", "")
            given[aliases.get(head, head) + bracket + index if head else name] = value
        for name in self.sensors:
            value = given.get(name, given.get(name.rpartition("[")[0], np.nan))
            if not 0.0 < value < np.inf:
                raise InputError(
                    f"the noise of the signal '{name}' is {value:g}",
                    where=where,
                    allowed="a standard deviation above 0 for every measured signal, or none at all",
                    fix="add it to noise=",
                )
            found.append(float(value))
        return np.array(found)

    def evaluate(self, theta: Array) -> tuple[list[Array], list[Array]] | None:
        """Residuals and derivatives of each sensor; ``None`` if a run fails, except the first run."""
        residuals: dict[str, list[Array]] = {name: [] for name in self.sensors}
        derivatives: dict[str, list[Array]] = {name: [] for name in self.sensors}
        for run, (names, _), measured in zip(self.runs, self.columns, self.measured):
            try:
                outputs, sensitivities = run.evaluate(theta)
            except (SimulationError, DiagramError):
                if self.first:
                    raise
                return None
            for k, name in enumerate(names):
                used = np.isfinite(measured[:, k])
                if name in residuals:
                    residuals[name].append(measured[used, k] - outputs[used, k])
                    derivatives[name].append(-sensitivities[used, k])
        self.first = False
        return (
            [np.concatenate(residuals[name]) for name in self.sensors],
            [np.concatenate(derivatives[name]) for name in self.sensors],
        )


def _elements(run: FittedRun) -> tuple[list[str], list[str]]:
    """The names and units of the measured entries of an experiment."""
    slots = [run.layout[path] for path in run.paths]
    names = [element for slot in slots for element in slot.elements]
    return names, [slot.unit for slot in slots for _ in slot.elements]


def _result(
    diagram: Diagram,
    fitted: FittedParameters,
    problem: _Problem,
    found: NonlinearFit,
    start: Array,
    limits: Array,
) -> FitResult:
    signals: list[FittedSignal] = []
    noise = dict(zip(problem.sensors, found.deviations.tolist()))
    for number, (run, (names, units), measured) in enumerate(
        zip(problem.runs, problem.columns, problem.measured), 1
    ):
        outputs = run.outputs(found.values)
        for k, (name, unit) in enumerate(zip(names, units)):
            if name in noise and np.isfinite(measured[:, k]).any():
                signals.append(
                    FittedSignal(
                        name=name,
                        unit=unit,
                        experiment=number,
                        time=run.measurement.time,
                        measured=measured[:, k],
                        fitted=outputs[:, k],
                        noise=noise[name],
                    )
                )
    return FitResult(
        diagram=with_parameters(diagram, fitted.values(found.values)),
        parameters=tuple(fitted.entries),
        values=found.values,
        start=start,
        covariance=found.covariance,
        bounds=limits,
        degrees_of_freedom=found.degrees_of_freedom,
        condition=found.condition,
        signals=tuple(signals),
        evaluations=found.evaluations,
        message=found.message,
        stopped=found.stopped,
        differences={name: why for run in problem.runs for name, why in run.reasons.items()},
        ignored=tuple(dict.fromkeys(name for run in problem.runs for name in run.measurement.ignored)),
    )
