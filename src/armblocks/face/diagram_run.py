"""A run that can be paused, inspected, tuned and continued; parameters and signals have block paths."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram import Diagram, flat_diagram, with_parameters
from armblocks.diagram.mask_tuning import dependent_parameters, mask_parameters, tunable_parameters
from armblocks.errors import InputError
from armblocks.simulation import RunState, Samples, Simulation, SimulationResult

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Array = NDArray[np.float64]


class DiagramRun(metaclass=ArgumentErrors):
    """A run of a diagram, created by :func:`armblocks.begin`.

    >>> run = begin("van_der_pol_pid")
    >>> run.advance(10.0)
    >>> run.set("PID.P", 3.0)
    >>> run.advance()
    >>> result = run.result()
    """

    def __init__(self, diagram: Diagram, simulation: Simulation) -> None:
        self.diagram = diagram
        self.simulation = simulation

    def __reduce__(self) -> tuple[object, ...]:
        raise InputError(
            "a run in progress cannot be copied or pickled",
            allowed="its diagram, run.state() and run.result()",
            fix="continue elsewhere with simulate(run.diagram, initial_state=run.state())",
            where=self.diagram.name,
        )

    @property
    def time(self) -> float:
        """Current time of the run, s."""
        return self.simulation.time

    @property
    def stop_time(self) -> float:
        """Time at which the run is complete, s."""
        return self.simulation.stop_time

    @property
    def finished(self) -> bool:
        """Whether the run has ended: complete, stopped or failed."""
        return self.simulation.finished

    @property
    def recorded(self) -> int:
        """Number of samples recorded so far."""
        return self.simulation.recorded

    @property
    def parameters(self) -> Mapping[str, Array]:
        """The current values of the tunable parameters, by ``block.parameter``."""
        return self.simulation.parameters

    def advance(
        self,
        until: float | None = None,
        *,
        steps: int | None = None,
        wall_time: float | None = None,
        exactly: bool = False,
    ) -> None:
        """Continue until a time (s), for a number of steps or for a wall time (s); by default to the end.

        Steps are not shortened, so the reached time may exceed ``until`` by part of a step; ``exactly`` ends
        a step at ``until``. See :meth:`armblocks.simulation.Simulation.advance`.

        Raises ``SimulationError`` with the valid samples so far as its ``partial``.
        """
        self.simulation.advance(until, steps=steps, wall_time=wall_time, exactly=exactly)

    def set(self, path: str, value: ArrayLike) -> None:
        """Change a tunable parameter, ``"block.parameter"``, from the current time on.

        Nothing is compiled. Raises ``UnknownNameError`` for a name that does not exist, ``InputError`` for
        one that is not tunable, a value that its block does not allow, and a run that has ended.
        """
        self.set_all({path: value})

    def set_all(self, values: Mapping[str, ArrayLike]) -> None:
        """Change several tunable parameters at once, ``{"limit.lower": 2.0, "limit.upper": 3.0}``.

        Parameters that limit each other are checked together. Raises as :meth:`set`; no value is then
        changed.
        """
        changed = with_parameters(self.diagram, values)
        tuned = tuned_parameters(self.diagram, changed)
        if tuned is None:
            masks = mask_parameters(self.diagram)
            dependents = [
                name
                for path in values
                if path in masks
                for name in dependent_parameters(self.diagram, path).structural
            ]
            why = f": '{dependents[0]}', which depends on it, is not tunable" if dependents else ""
            path_list = ", ".join(f"'{path}'" for path in values)
            names = [name for name, _, _ in tunable_parameters(self.diagram)]
            raise InputError(
                f"parameter {path_list} cannot take this value during a run{why}",
                where=self.diagram.name,
                allowed=f"tunable parameters, with unchanged shape: {', '.join(names)}",
                fix="end the run, change the diagram and begin another run",
            )
        self.simulation.set(tuned)
        self.diagram = changed

    def samples(self, begin: int = 0) -> Samples:
        """The recorded samples from index ``begin`` on: ``samples["block/port"]``."""
        return self.simulation.samples(begin)

    def state(self) -> RunState:
        """The current state; another run continues from it: ``simulate(…, initial_state=run.state())``."""
        return self.simulation.state()

    def stop(self, message: str = "stopped") -> None:
        """End the run at the current time."""
        self.simulation.stop(message)

    def result(self) -> SimulationResult:
        """The samples recorded so far, with the statistics of the run."""
        return self.simulation.result()


def tuned_parameters(before: Diagram, after: Diagram) -> dict[str, Array] | None:
    """The tunable parameters, ``block.parameter``, that differ; ``None`` if the equations differ."""
    flat = flat_diagram(before)
    blocks, other_blocks = flat.blocks, flat_diagram(after).blocks
    if list(blocks) != list(other_blocks):
        return None
    tuned: dict[str, Array] = {}
    for name, block in blocks.items():
        other = other_blocks[name]
        if other is block:
            continue
        if type(other) is not type(block):
            return None
        structure = [rule.name for rule in block.structure_of_the_run()]
        if any(block.parameter_value(name) != other.parameter_value(name) for name in structure):
            return None
        for rule in block.inputs_of_the_run():
            old, new = block.parameter_value(rule.name), other.parameter_value(rule.name)
            numbers: tuple[Array, Array] = (np.asarray(old), np.asarray(new))
            if numbers[0].shape != numbers[1].shape:
                return None
            if numbers[0].tobytes() != numbers[1].tobytes():
                tuned[f"{flat.owner(name)}.{rule.name}"] = numbers[1]
    return tuned
