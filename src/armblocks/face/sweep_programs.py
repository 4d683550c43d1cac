"""The programs of the models of a sweep, and the recipe from which another process makes the same program."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import SimulationOptions
from armblocks.errors import InputError
from armblocks.face.model import CompiledDiagram
from armblocks.face.python_calls import called_functions
from armblocks.face.sweep_parameters import RunParameters, Variant
from armblocks.simulation import SimulationResult
from armblocks.sweeps.batch import RunProgram
from armblocks.sweeps.lanes import lanes_of_host
from armblocks.sweeps.measures import Measure, observe, signal_entries
from armblocks.sweeps.scheduling import GroupsOf, RunGroup
from armblocks.sweeps.tables import Layout


@dataclass(frozen=True)
class ProgramRecipe:
    """The settings of the program of a sweep. ``lanes``: whether lanes are requested."""

    options: SimulationOptions
    measures: tuple[Measure, ...]
    functions: tuple[Callable[[SimulationResult], float], ...]
    keep: tuple[str, ...]
    max_steps: int | None
    lanes: bool

    def kept(self, model: CompiledDiagram) -> tuple[str, ...]:
        """The names of all kept scalars."""
        layout, aliases = model.signals_layout, model.compiled.aliases
        return tuple(entry for name in self.keep for entry in signal_entries(name, layout, aliases))

    def program(self, model: CompiledDiagram) -> RunProgram:
        """The program of a model on this machine."""
        compiled, layout = model.compiled, model.signals_layout
        return RunProgram(
            compiled,
            self.options,
            observe(self.measures, self.kept(model), layout, compiled.aliases),
            self.functions,
            calls=called_functions(model.diagram, compiled),
            max_steps=self.max_steps,
            layout=layout,
            lanes=lanes_of_host() if self.lanes else 1,
        )


class Programs:
    """The program of each model of a sweep."""

    def __init__(self, recipe: ProgramRecipe) -> None:
        self.recipe = recipe
        self._known: dict[int, tuple[CompiledDiagram, RunProgram]] = {}

    def layout(
        self, parameters: RunParameters, names: tuple[str, ...], *, text_file: bool
    ) -> tuple[Layout, NDArray[np.float64]]:
        """The layout of the table, and the sample times ``(N,)``, s."""
        first = parameters.variants[0]
        kept = self.kept(first)
        for variant in {id(variant.model): variant for variant in parameters.variants}.values():
            different = set(self.kept(variant)).symmetric_difference(kept)
            if different:
                raise InputError(
                    f"the kept signal '{min(different)}' does not exist in all runs",
                    allowed="signals with equal shapes in all runs",
                    where="sweep",
                    fix="keep single entries",
                )
        times = self.of(first).plan.sample_times
        layout = Layout(
            design=parameters.design,
            measures=names,
            kept=kept,
            samples=times.count,
            text_file=text_file,
        )
        return layout, times.part(0, times.count)

    def groups_of(self, parameters: RunParameters) -> GroupsOf:
        """The function that returns the groups of a range of runs."""

        def groups(begin: int, end: int) -> list[RunGroup]:
            return [
                RunGroup(program=self.of(variant), places=places, parameters=p)
                for variant, places, p in parameters.groups(begin, end)
            ]

        return groups

    def kept(self, variant: Variant) -> tuple[str, ...]:
        """The names of all kept scalars."""
        return self.recipe.kept(variant.model)

    def of(self, variant: Variant) -> RunProgram:
        """The program of a variant's model."""
        model = variant.model
        entry = self._known.get(id(model))
        if entry is None:
            # The reference keeps the model alive, so that its id stays unique.
            entry = self._known[id(model)] = (model, self.recipe.program(model))
        return entry[1]

    def maker(self, program: RunProgram) -> Callable[[], RunProgram]:
        """A function that makes the program again, in another process."""
        model = next(model for model, known in self._known.values() if known is program)
        return partial(self.recipe.program, model)

    @property
    def general_reason(self) -> str:
        """The reason for not using the native loop over runs; empty if it is used."""
        programs = [program for _, program in self._known.values()]
        if any(program.calls for program in programs):
            return "the model calls Python functions"
        return "" if all(program.native for program in programs) else "the runs have no duration"

    @property
    def against_lanes(self) -> str:
        """The reason why runs of a model are not computed in lanes; empty if there is none."""
        return next((p.against_lanes for _, p in self._known.values() if p.against_lanes), "")
