"""The integration method of a run, its start, and the change between two methods during the run."""

from __future__ import annotations

import dataclasses
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import SimulationOptions
from armblocks.errors import SimulationError
from armblocks.integration.native_integrator import Integration, NativeIntegrator
from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.run_point import Checkpoint, RunPoint, fits
from armblocks.integration.system import CompiledSystem
from armblocks.simulation.first_guess import first_guess
from armblocks.simulation.jumps import max_sides
from armblocks.simulation.plan import DEFAULT_INTERVALS, Plan
from armblocks.simulation.run_state import RunState, damaged_state, settings_text

Array = NDArray[np.float64]


class RunMethod:
    """Creates the native loops of a run, and reports the methods and the reasons for their choice."""

    def __init__(
        self,
        compiled: CompiledSystem,
        options: SimulationOptions,
        plan: Plan,
        initial_state: RunState | None,
    ) -> None:
        self._compiled = compiled
        self._options = options
        self._plan = plan
        self._initial_state = initial_state
        self._tableau = plan.tableau
        self._reason = plan.reason
        self._start_reason = ""
        self._changed = False
        self.solver = plan.solver
        """The name of the method, or the names of all methods of the run."""
        self.settings = ""
        """Digest of method, numbers and parameters; it must be equal to continue from a checkpoint."""
        self.checkpoint: Checkpoint | None = None
        """The checkpoint of the loop before a change of the method, which belongs to the same part of the
        run."""
        started = perf_counter()
        compiled.prepare(plan.tableau)
        self.preparation_time = perf_counter() - started
        """Time for creating native loops, s."""

    @property
    def reason(self) -> str:
        """The reason for the method, the times at which the method changed, and the start of the run."""
        return self._reason + self._start_reason

    def begin(self, p: Array, sample_times: Array, before: Integration | None) -> Integration | None:
        """A loop that records at ``sample_times``; ``None`` for a system without integration.

        The loop starts at the present point of the loop ``before``, else from the initial state, else from
        the initial values. Raises ``SimulationError`` for initial values that are not finite.
        """
        if self._tableau is None:
            return None
        compiled, options, plan = self._compiled, self._options, self._plan
        assert plan.tableau is not None
        key = compiled.integrator(plan.tableau).key
        step = 0.0 if plan.tableau.adaptive else plan.step
        numbers = (step, options.rtol, options.atol, plan.max_step)
        self.settings = settings_text(key if plan.stiff is None else (*key, "auto"), numbers, p)
        self.checkpoint = checkpoint = None
        if before is not None:
            start = dataclasses.replace(before.point, begun=True)
        elif self._initial_state is not None:
            start, checkpoint = self._continued_from(self._initial_state)
        else:
            start = _starting_point(compiled, p)
        return self._integrator(self._tableau).begin(
            start,
            p,
            sample_times,
            compiled.breakpoints(p),
            step=plan.step,
            rtol=options.rtol,
            atol=options.atol,
            max_step=plan.max_step,
            checkpoint=checkpoint,
            detect_stiffness=plan.stiff is not None,
            stop=plan.sample_times.stop,
            # Independent of the stop time, so that a shorter run has bitwise the same samples.
            span=DEFAULT_INTERVALS * plan.sample_times.sample_time,
            jumps=max_sides(compiled) if options.record_jumps else 0,
        )

    def change(self, integration: Integration) -> Integration:
        """Continue the run with the other of the two methods, from the present point."""
        first, stiff = self._plan.tableau, self._plan.stiff
        assert first is not None and stiff is not None
        next_tableau = first if self._tableau is stiff else stiff
        native = self._integrator(next_tableau)
        self.checkpoint = integration.checkpoint
        when, step = f"{integration.time:.4g} s", f"{integration.last_step:.2g} s"
        if next_tableau is first:
            self._reason += f"; from {when} {first.title}, because steps of {step} are stable now"
        elif self._changed:
            self._reason += f"; from {when} {stiff.title}"
        else:
            self._reason = (
                f"auto: {first.title} until {when}, then {stiff.title}, because the system is "
                f"stiff: stability, not accuracy, limited the explicit steps to {step}"
            )
        self.solver += f", then {next_tableau.name}"
        self._tableau, self._changed = next_tableau, True
        return native.continue_run(integration)

    def _continued_from(self, state: RunState) -> tuple[RunPoint, Checkpoint | None]:
        """The end point of another run, and its checkpoint if the settings of this run are the same."""
        stiff = self._plan.stiff
        checkpoint = state.checkpoint if state.settings == self.settings else None
        if stiff is not None and checkpoint is not None and checkpoint.method == stiff.name:
            self._tableau, self.solver, self._changed = stiff, stiff.name, True
            self._reason = f"auto: {stiff.title}, because the previous run detected stiffness"
        if checkpoint is not None:
            assert self._tableau is not None  # the settings name a method
            same_method = checkpoint.method == self._tableau.name
            native = self._integrator(self._tableau)
            if not same_method or not fits(checkpoint, native.workspace, native.sizes):
                raise damaged_state(state, self._compiled.name)
        accuracy = "exactly as the previous run" if checkpoint is not None else "with a restart of the solver"
        self._start_reason = f"; continues from {state.time:g} s, {accuracy}"
        start = RunPoint(
            time=state.time,
            x=state.states,
            z=state.discrete,
            w=state.algebraic,
            history=state.past,
            begun=True,
        )
        return start, checkpoint

    def _integrator(self, tableau: Tableau) -> NativeIntegrator:
        """The native loop of a method; the time to create it counts as preparation."""
        started = perf_counter()
        native = self._compiled.integrator(tableau)
        self.preparation_time += perf_counter() - started
        return native


def _starting_point(compiled: CompiledSystem, p: Array) -> RunPoint:
    """The initial values. Raises ``SimulationError`` that names the first variable that is not finite."""
    start = RunPoint(
        time=0.0,
        x=compiled.initial_states(p),
        z=compiled.initial_discrete(p),
        w=compiled.initial_algebraic(p),
    )
    for layout, values in ((compiled.states, start.x), (compiled.discrete, start.z)):
        for slot in layout:
            initial_value = values[layout.ranges[slot.name]]
            if not np.isfinite(initial_value).all():
                raise SimulationError(
                    f"the initial value of state '{slot.name}' is {initial_value.tolist()}",
                    where=compiled.name,
                    allowed="finite numbers",
                    fix="change the block's initial value",
                )
    return dataclasses.replace(start, w=first_guess(compiled, start, p))
