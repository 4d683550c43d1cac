"""Python functions that are called at ticks of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Shape
from armblocks.errors import ArmblocksError, SimulationError, counted
from armblocks.integration.native_integrator import Integration
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Status
from armblocks.simulation.run_part import Consumer, RunPart

Array = NDArray[np.float64]
SAME_INSTANT = 1.0 + 2.0**-50
"""Two times within this factor are equal, as in the native loop."""


@dataclass(frozen=True, kw_only=True)
class CalledFunction:
    """A block whose outputs Python computes at the ticks of a clock.

    ``inputs`` and ``outputs``: index in ``z`` and shape by port; after an update with the tick marked, the
    entries of the inputs have the input values. ``call(t, inputs)`` returns the outputs.
    """

    block: str
    clock: int
    inputs: Mapping[str, tuple[slice, Shape]]
    outputs: Mapping[str, tuple[slice, Shape]]
    call: Callable[[float, Mapping[str, Any]], Mapping[str, Any]]


class Calls:
    """The functions of one run, in dependency order within a tick.

    The native loop returns just before a tick. The tick is evaluated on a copy to get the inputs of a
    function, and the function is called. The loop then continues with its results and processes the tick. All
    blocks that tick at that time therefore read the new values.
    """

    def __init__(self, compiled: CompiledSystem, functions: Sequence[CalledFunction]) -> None:
        self._compiled = compiled
        self._functions = tuple(functions)
        self._clocks = sorted({function.clock for function in functions})
        self._called_at: dict[int, float] = {}
        self.count = 0
        self.seconds = 0.0
        """The computing time of the functions, s."""

    def advance(self, part: RunPart, steps: int, pause: float, consume: Consumer | None) -> None:
        """Take steps like :meth:`RunPart.advance`; call the functions that are due.

        Raises ``SimulationError`` if a function fails.
        """
        integration = part.integration
        assert integration is not None  # a system with ticks has an integration
        end = part.steps_taken + steps
        while True:
            if integration.instant_pending:
                self._call_due_functions(integration, part.p)
            integration.pause_before_ticks_at(self._next_tick(integration))
            part.advance(max(0, end - part.steps_taken), pause, consume)
            if part.status is not Status.PAUSED or not (
                integration.instant_pending and self._due_clocks(integration)
            ):
                return

    def summary(self, wall_time: float) -> str:
        """A sentence about the cost of the calls."""
        names = ", ".join(f"'{function.block}'" for function in self._functions)
        share = 100.0 * self.seconds / wall_time if wall_time > 0.0 else 0.0
        cost = f"{self.seconds:.3g} s, {share:.0f} % of the run"
        return f"Python was called {counted(self.count, 'time')} for {names}: {cost}"

    def _next_tick(self, integration: Integration) -> float:
        """The next tick, s, whose functions have not been called."""
        ticks = {clock: integration.next_tick(clock) for clock in self._clocks}
        return min(
            tick + self._compiled.sizes.clocks[clock][0] if self._called_at.get(clock) == tick else tick
            for clock, tick in ticks.items()
        )

    def _is_called(self, integration: Integration, clock: int) -> bool:
        return self._called_at.get(clock) == integration.next_tick(clock)

    def _due_clocks(self, integration: Integration) -> list[int]:
        """The clocks that tick now and whose functions have not been called."""
        until = integration.time * SAME_INSTANT
        return [
            clock
            for clock in self._clocks
            if integration.next_tick(clock) <= until and not self._is_called(integration, clock)
        ]

    def _call_due_functions(self, integration: Integration, p: Array) -> None:
        due = self._due_clocks(integration)
        if not due:
            return
        time, until = integration.time, integration.time * SAME_INSTANT
        clocks = range(len(self._compiled.sizes.clocks))
        ticking = np.array([float(integration.next_tick(clock) <= until) for clock in clocks])
        for function in self._functions:
            if function.clock not in due:
                continue
            point = integration.point
            z = self._compiled.updated(time, point.x, point.z, point.w, p, ticking)
            inputs = {
                port: _input_value(z[places], shape) for port, (places, shape) in function.inputs.items()
            }
            for port, value in self._call(function, time, inputs).items():
                integration.set_discrete(function.outputs[port][0], value)
        self._called_at |= {clock: integration.next_tick(clock) for clock in due}

    def _call(self, function: CalledFunction, time: float, inputs: Mapping[str, Any]) -> Mapping[str, Array]:
        """The flat results of one function. Raises ``SimulationError`` if it fails."""
        where = f"block '{function.block}' at t = {time:.9g} s"
        start = perf_counter()
        try:
            results = function.call(time, inputs)
        except ArmblocksError as error:
            raise SimulationError(error.what, where=where, allowed=error.allowed, fix=error.fix) from error
        self.seconds += perf_counter() - start
        self.count += 1
        flat_results: dict[str, Array] = {}
        for port, value in results.items():
            shape = function.outputs[port][1]
            array = np.asarray(value, dtype=np.float64)
            if array.shape != shape or not np.isfinite(array).all():
                raise SimulationError(
                    f"'{port}' is {str(value)[:80]}, of shape {array.shape}",
                    where=where,
                    allowed=f"finite numbers of shape {shape}",
                    fix="correct the function, or declare the shapes of its results",
                )
            flat_results[port] = array.ravel()
        return flat_results


def _input_value(values: Array, shape: Shape) -> Any:
    """An input of the function: a number, or a copy of an array."""
    return values.reshape(shape).copy() if shape else float(values[0])
