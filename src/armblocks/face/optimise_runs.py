"""The runs of an optimisation: measures of many points and scenarios by the native loop over runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import SimulationOptions
from armblocks.errors import InputError
from armblocks.face.measured_run import Chain
from armblocks.face.model import CompiledDiagram
from armblocks.face.optimise_formulas import Formulas
from armblocks.face.sweep_parameters import RunParameters
from armblocks.face.sweep_programs import ProgramRecipe
from armblocks.sweeps.batch import COMPLETED, STATUSES, STOPPED, RunProgram
from armblocks.sweeps.designs import PAIRED, Column, Design, make_design
from armblocks.sweeps.lanes import lanes_of_host
from armblocks.sweeps.scheduling import RunGroup, Scheduler, default_threads

Array = NDArray[np.float64]

LANE_RUNS = 500
"""Number of runs from which on they are computed in lanes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ScenarioGroup:
    """Scenarios with the same equations: their numbers, and columns of their parameters."""

    model: CompiledDiagram
    places: NDArray[np.intp]
    columns: Mapping[str, Column]


@dataclass(frozen=True, kw_only=True, eq=False)
class PointMeasures:
    """The measures ``(N, S, nm)`` of N points and S scenarios, NaN for runs without measures, and the first
    message of such a run."""

    values: Array
    message: str = ""


def scenario_groups(
    model: CompiledDiagram, over: object, runs: int | None, design: str | None, seed: int
) -> tuple[list[ScenarioGroup], Design | None]:
    """The scenarios that the arguments describe; a single one without changes if ``over`` is ``None``."""
    if over is None:
        one = ScenarioGroup(model=model, places=np.zeros(1, dtype=np.intp), columns={})
        return [one], None
    made = make_design(over, runs, design, seed)
    parameters = RunParameters(model, made)
    models: dict[int, tuple[CompiledDiagram, list[NDArray[np.intp]]]] = {}
    for variant, places, _ in parameters.groups(0, made.count):
        models.setdefault(id(variant.model), (variant.model, []))[1].append(places)
    groups: list[ScenarioGroup] = []
    for own, parts in models.values():
        places = np.sort(np.concatenate(parts))
        columns = {name: column[places] for name, column in made.columns.items()}
        groups.append(ScenarioGroup(model=own, places=places, columns=columns))
    return groups, made


class Runs:
    """Computes measures at points of the variables."""

    def __init__(
        self,
        groups: Sequence[ScenarioGroup],
        variables: Sequence[str],
        formulas: Formulas,
        options: SimulationOptions,
        *,
        stops: bool,
        many: int,
        threads: int | None,
    ) -> None:
        """``stops``: whether runs that a block ends have measures. ``many``: about how many runs follow."""
        self.groups, self.variables, self.options = list(groups), list(variables), options
        self.measures, functions = formulas.measures, formulas.functions
        self.scenarios = sum(group.places.size for group in groups)
        self.columns = len(self.measures) + len(functions)
        self._where = where = f"optimisation of '{groups[0].model.diagram.name}'"
        self._valid = [COMPLETED, STOPPED] if stops else [COMPLETED]
        lanes = lanes_of_host() > 1 and many >= LANE_RUNS and not functions
        recipe = ProgramRecipe(options, self.measures, functions, (), None, lanes)
        self._programs = [recipe.program(group.model) for group in groups]
        called = any(program.calls for program in self._programs)
        self._threads = 1 if functions or called else threads or default_threads()
        self.chains = [Chain(group.model, variables, where) for group in groups]
        self.count = 0
        """The number of computed runs."""

    def measured(self, points: Array) -> PointMeasures:
        """The measures at points ``(N, n)``."""
        values = np.full((len(points), self.scenarios, self.columns), np.nan)
        message = ""
        for group, program in zip(self.groups, self._programs):
            rows, text = self._rows(group, program, points)
            values[:, group.places] = rows.reshape(len(points), group.places.size, -1)
            message = message or text
        self.count += values.shape[0] * values.shape[1]
        return PointMeasures(values=values, message=message)

    def parameters(self, group: ScenarioGroup, points: Array) -> RunParameters:
        """The parameters of all runs of a group: all its scenarios at the first point, and so on."""
        count = group.places.size
        columns: dict[str, Column] = {
            name: np.concatenate([column] * len(points)) for name, column in group.columns.items()
        }
        columns |= {name: np.repeat(points[:, k], count) for k, name in enumerate(self.variables)}
        return RunParameters(group.model, Design(columns=columns, count=count * len(points), kind=PAIRED))

    def _rows(self, group: ScenarioGroup, program: RunProgram, points: Array) -> tuple[Array, str]:
        parameters = self.parameters(group, points)
        if parameters.recompiled:
            raise InputError(
                "the variables and the parameters of the scenarios together change the equations",
                where=self._where,
                allowed="scenarios whose equations do not depend on the variables",
                fix="optimise each of these scenarios separately",
            )

        def groups_of(begin: int, end: int) -> list[RunGroup]:
            return [
                RunGroup(program=program, places=places, parameters=p)
                for _, places, p in parameters.groups(begin, end)
            ]

        values = np.full((parameters.design.count, self.columns), np.nan)
        message = ""
        program.interrupted = False  # the end of the previous call has set it
        scheduler = Scheduler(groups_of, self._threads)
        for begin, rows in scheduler.rows(iter([(0, parameters.design.count)])):
            names = np.array(STATUSES)[rows.status]
            valid = np.isin(names, self._valid)
            values[begin : begin + valid.size][valid] = rows.measures[valid]
            invalid = np.flatnonzero(~valid)
            if invalid.size and not message:
                k = int(invalid[0])
                message = f"{names[k]}: {rows.messages[k]}"
        return values, message
