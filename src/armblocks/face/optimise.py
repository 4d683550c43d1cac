"""``optimise``: parameter values of a diagram that minimise an objective under constraints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Unpack, cast

import numpy as np
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.diagram import Diagram, with_parameters
from armblocks.errors import InputError, UnknownNameError
from armblocks.extras import require
from armblocks.face.model import CompiledDiagram, compile_diagram
from armblocks.face.optimise_formulas import Formulas, PythonFunction, Target, conditions
from armblocks.face.optimise_result import OptimisationResult
from armblocks.face.optimise_runs import Runs, scenario_groups
from armblocks.face.optimise_search import GRADIENT, SEARCH, Optimisation, optimised
from armblocks.face.optimise_statistics import MEAN, Statistics
from armblocks.face.optimise_summary import summarised
from armblocks.face.optimise_variables import Bounds, Variables
from armblocks.face.settings import RunSettings, check_settings, takes_settings, with_settings
from armblocks.simulation import SimulationResult
from armblocks.sweeps.measures import Measure

Array = NDArray[np.float64]
Progress = Callable[[int, float], None]
"""A function of the number of evaluated points, and of the smallest objective so far (NaN: none is valid)."""

METHODS = ("auto", GRADIENT, SEARCH)


@takes_settings
@interrupts.kept()
def optimise(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    variables: Mapping[str, Bounds] | Sequence[str] | str,
    objective: str | Measure | Callable[[SimulationResult], float],
    constraints: object = None,
    *,
    over: object = None,
    runs: int | None = None,
    design: str | None = None,
    statistic: str | float = MEAN,
    share: float = 1.0,
    method: str = "auto",
    start: Mapping[str, float] | None = None,
    starts: int = 1,
    seed: int = 0,
    evaluations: int | None = None,
    allow_stops: bool = False,
    parameters: Mapping[str, object] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
    **settings: Unpack[RunSettings],
) -> OptimisationResult:
    """Find the values of ``variables`` that minimise ``objective`` and satisfy ``constraints``.

    - ``variables``: ``{"pid.P": (0.1, 10)}`` with bounds, or a list of names with the bounds of their blocks.
      Variables are tunable parameters, one entry ``"g.gain[1]"``, start values, and parameters of masks.
      ``ab.loguniform(low, high)`` instead of bounds selects a logarithmic scale. The search begins at the
      values of the diagram, or at ``start``.
    - ``objective``: a formula of measures, ``"itae({ref/y} - {plant/y}) + 0.1 * rms(pid/y)"``, or a Python
      function of the result. The measures are those of :func:`sweep`. Variables in braces are numbers,
      ``"{pid.P}^2"``.
    - ``constraints``: a string ``"overshoot(plant/y, final=1) <= 5"``, ``"0.2 <= {pid.P}/{pid.I}"``, a tuple
      ``(function, low, high)`` with a Python function of the result, or a list of these.
    - ``over``: a design of uncertain parameters, as ``vary`` of :func:`sweep`, with ``runs``, ``design`` and
      ``seed``. The objective is then the ``statistic`` over these scenarios: ``"mean"``, ``"worst"``, or the
      quantile of a probability, ``0.9``. The constraints hold in the ``share`` of the scenarios, by default
      in all.
    - ``method``: ``gradient`` is the interior-point method Ipopt with the exact derivatives of
      :func:`sensitivity`. It begins at ``starts`` points; all but the first are the best points of a sweep
      over the bounds. ``search`` needs no derivatives: differential evolution over the bounds, then COBYQA.
      ``auto`` uses ``gradient`` if all derivatives exist; the result states the reason.
    - ``evaluations``: the largest number of evaluated points.
    - ``allow_stops``: whether runs that a block ends count with their measures until then; otherwise they
      count as failed.
    - ``parameters``: values of other parameters.
    - ``progress(evaluations, objective)`` is called after each step. Ctrl-C ends the search with the best
      values so far.

    Raises ``UnknownNameError`` and ``InputError`` for invalid arguments, also where ``gradient`` is not
    possible; ``SimulationError`` if no run has a value; ``MissingLibraryError`` without the extra
    ``analysis``.
    """
    check_settings(settings, optimise)
    require("analysis", "optimisation")
    model = compile_diagram(diagram)
    if parameters:
        model = CompiledDiagram(with_parameters(model.diagram, parameters))
    where = f"optimisation of '{model.diagram.name}'"
    _check(method, starts, evaluations, where)
    varied = Variables(model, variables, start or {}, where)
    statistics = Statistics.checked(statistic, share, where)
    groups, made = scenario_groups(model, over, runs, design, seed)
    _check_clash(varied, made.columns if made is not None else {}, where)
    options = with_settings(model.diagram.settings, settings)
    limits = conditions(constraints, where)
    targets: list[Target] = [_target(objective, where), *(limit.target for limit in limits)]
    formulas = Formulas(targets, varied.names, where)
    many = (500 if evaluations is None else evaluations) * sum(group.places.size for group in groups)
    problem = Optimisation(
        variables=varied,
        formulas=formulas,
        conditions=limits,
        statistics=statistics,
        runs=Runs(groups, varied.names, formulas, options, stops=allow_stops, many=many, threads=threads),
        seed=seed,
        progress=progress,
        where=where,
    )
    outcome = optimised(problem, method, starts, evaluations, allow_stops=allow_stops)
    return summarised(problem, outcome, model.diagram, _name(objective), made, options)


def _target(objective: object, where: str) -> Target:
    if isinstance(objective, str | Measure) or callable(objective):
        return cast("Target", objective)
    raise InputError(
        f"the objective is {objective!r:.60}",
        where=where,
        allowed="a formula of measures as text, a Measure, or a function of the result",
        fix="write for example 'itae({reference/y} - {plant/y})'",
    )


def _name(objective: str | Measure | PythonFunction) -> str:
    if isinstance(objective, str | Measure):
        return " ".join(str(objective).split())
    return str(getattr(objective, "__name__", "function"))


def _check(method: str, starts: object, evaluations: object, where: str) -> None:
    if method not in METHODS:
        raise UnknownNameError("method", method, METHODS, where=where)
    for name, number in (("starts", starts), ("evaluations", evaluations)):
        whole = isinstance(number, int | np.integer) and not isinstance(number, bool)
        if number is not None and (not whole or cast("int", number) < 1):
            raise InputError(
                f"{name} is {number!r}, not an integer above 0",
                where=where,
                allowed="1, 2, 3 …",
                fix=f"omit {name}",
            )


def _check_clash(variables: Variables, columns: Mapping[str, object], where: str) -> None:
    """Raise ``InputError`` for a parameter that is a variable and differs between scenarios."""
    for name in columns:
        clash = [own for own in variables.names if own == name or own.startswith(f"{name}[")]
        clash += [own for own in variables.names if name.startswith(f"{own}[")]
        if clash:
            raise InputError(
                f"'{name}' is a variable, and the scenarios have values of it",
                where=where,
                allowed="parameters of the scenarios that are not variables",
                fix="remove it from over or from the variables",
            )
