"""A diagram that is being run: paused, looked at, tuned and taken up again, by the names of its blocks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import Diagram, flat_diagram, with_parameters
from armblocks.diagram.mask_tuning import followers, mask_parameters, tunable_parameters
from armblocks.errors import InputError
from armblocks.simulation import RunState, Samples, Simulation, SimulationResult

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Array = NDArray[np.float64]


class DiagramRun:
    """One run of a diagram, made by :func:`armblocks.begin`.

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
            fix="go on elsewhere with simulate(run.diagram, initial_state=run.state())",
            where=self.diagram.name,
        )

    @property
    def time(self) -> float:
        """Time that is reached, s."""
        return self.simulation.time

    @property
    def stop_time(self) -> float:
        """Time at which the run is complete, s."""
        return self.simulation.stop_time

    @property
    def finished(self) -> bool:
        """Whether nothing is left to do: complete, stopped or failed."""
        return self.simulation.finished

    @property
    def recorded(self) -> int:
        """How many instants are recorded so far."""
        return self.simulation.recorded

    @property
    def parameters(self) -> Mapping[str, Array]:
        """The tunable parameters, ``block.parameter``, as they are now."""
        return self.simulation.parameters

    def advance(
        self,
        until: float | None = None,
        *,
        steps: int | None = None,
        wall_time: float | None = None,
        exactly: bool = False,
    ) -> None:
        """Go on until a time (s), for a number of steps or for a wall time (s); else to the end.

        A step is never cut short, so the time reached may be later than ``until`` by a part of a step;
        ``exactly`` ends a step there. See :meth:`armblocks.simulation.Simulation.advance`.

        Raises ``SimulationError``, with all that is good so far as its ``partial``.
        """
        self.simulation.advance(until, steps=steps, wall_time=wall_time, exactly=exactly)

    def set(self, path: str, value: ArrayLike) -> None:
        """Give a tunable parameter, ``"block.parameter"``, another value from the time reached on.

        Nothing is compiled. Raises ``UnknownNameError`` for a name that does not exist, ``InputError`` for
        one that is not tunable, a value that its block does not allow, and a run that has ended.
        """
        changed = with_parameters(self.diagram, {path: value})
        tuned = tuned_parameters(self.diagram, changed)
        if tuned is None:
            follows = (
                followers(self.diagram, path).structural if path in mask_parameters(self.diagram) else []
            )
            why = f": '{follows[0]}', which follows from it, belongs to the structure" if follows else ""
            names = [name for name, _, _ in tunable_parameters(self.diagram)]
            raise InputError(
                f"parameter '{path}' cannot take this value while the diagram runs{why}",
                where=self.diagram.name,
                allowed=f"tunable parameters, of the shape that they have: {', '.join(names)}",
                fix="end the run, change the diagram and begin another run",
            )
        self.simulation.set(tuned)
        self.diagram = changed

    def samples(self, begin: int = 0) -> Samples:
        """Signals at the recorded instants from number ``begin`` on: ``samples["block/port"]``."""
        return self.simulation.samples(begin)

    def state(self) -> RunState:
        """What another run can go on from: ``simulate(diagram, initial_state=run.state())``."""
        return self.simulation.state()

    def stop(self, message: str = "stopped") -> None:
        """End the run where it stands."""
        self.simulation.stop(message)

    def result(self) -> SimulationResult:
        """All that is recorded so far, and how the run went."""
        return self.simulation.result()


def tuned_parameters(before: Diagram, after: Diagram) -> dict[str, Array] | None:
    """The tunable parameters, ``block.parameter``, that differ; ``None`` where the equations differ too."""
    flat = flat_diagram(before)
    blocks, others = flat.blocks, flat_diagram(after).blocks
    if list(blocks) != list(others):
        return None
    tuned: dict[str, Array] = {}
    for name, block in blocks.items():
        other = others[name]
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
