"""A run that can be paused, inspected, tuned and continued; :func:`simulate` uses it for a whole run."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.equations import Signature, SimulationOptions
from armblocks.errors import InputError, SimulationError
from armblocks.integration.native_integrator import Integration
from armblocks.integration.run_point import NO_NUMBERS, RunPoint
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Status
from armblocks.simulation.calls import CalledFunction, Calls
from armblocks.simulation.diagnosis import (
    ended_by_block,
    integration_failure,
    stiffness_hint,
    warnings_of_blocks,
)
from armblocks.simulation.loop_conditions import warnings_of_loops
from armblocks.simulation.plan import (
    ListedTimes,
    LogRequest,
    changed_parameters,
    make_plan,
    parameter_vector,
)
from armblocks.simulation.recording import Recording, Samples
from armblocks.simulation.result import SimulationResult
from armblocks.simulation.run_data import ParameterChange, RunReport
from armblocks.simulation.run_method import RunMethod
from armblocks.simulation.run_part import Change, RunPart, first_window
from armblocks.simulation.run_state import RunState, check_state, slot_names

Array = NDArray[np.float64]

CHUNK_SECONDS = 0.04
"""Approximate wall time between two checks of Ctrl-C and the clock."""


class Simulation:
    """One run in progress, from 0 or an ``initial_state`` to ``options.stop_time``.

    :meth:`advance` continues the run. :meth:`samples` returns the recorded samples. :meth:`set` changes
    tunable parameters from the present time on, without compiling. :meth:`state` returns a state from which
    another run can start. :meth:`result` ends the run. Results do not depend on the division into calls of
    :meth:`advance`.

    Raises the errors of :func:`~armblocks.simulation.simulate` for invalid options and parameters.
    """

    def __init__(
        self,
        compiled: CompiledSystem,
        options: SimulationOptions,
        parameters: Mapping[str, ArrayLike] | ArrayLike | None = None,
        initial_state: RunState | None = None,
        log: LogRequest | None = None,
        calls: Sequence[CalledFunction] = (),
        signals_layout: Signature | None = None,
        times: Array | None = None,
    ) -> None:
        """``times`` (N,) s: the sample times from 0 to the stop time, instead of those of ``options``."""
        if {function.block for function in calls} != set(compiled.called):
            raise InputError(
                f"no function is given for the blocks {', '.join(map(repr, compiled.called))}",
                where=compiled.name,
                allowed="one CalledFunction for each block that is called",
                fix="run the diagram itself, by armblocks.simulate or armblocks.begin",
            )
        self._calls = Calls(compiled, calls) if calls else None
        self.compiled = compiled
        self.options = options
        self._p = parameter_vector(compiled, parameters)
        if initial_state is not None:
            check_state(compiled, initial_state)
        start = 0.0 if initial_state is None else initial_state.time
        plan = make_plan(compiled, options, start, logged=log is not None)
        self._plan = plan if times is None else dataclasses.replace(plan, sample_times=ListedTimes.of(times))
        self._method = RunMethod(compiled, options, self._plan, initial_state)
        self.signals_layout = signals_layout or compiled.signals_layout
        """The layout of the compiled system, possibly with names of the entries of signals in addition."""
        self._recording = Recording(compiled, self._plan.sample_times, log, self.signals_layout)
        self._message = ""
        self._stopped = False
        self._failure: SimulationError | None = None
        self._changed = False
        self._changes: tuple[ParameterChange, ...] = ()
        self._chunk = 1000
        self._wall_time = 0.0

    # Present state.

    @property
    def stop_time(self) -> float:
        """Time at which the run is complete, s."""
        return self._plan.sample_times.stop

    @property
    def time(self) -> float:
        """Present time of the run, s: the end of the last step."""
        return self._parts[-1].time if self._parts else self._plan.sample_times.start

    @property
    def finished(self) -> bool:
        """Whether the run has ended: complete, stopped or failed."""
        if self._stopped or self._failure is not None:
            return True
        return bool(self._parts) and not self._changed and self._parts[-1].status is not Status.PAUSED

    @property
    def recorded(self) -> int:
        """The number of samples recorded so far."""
        return self._recording.recorded

    @property
    def planned(self) -> int:
        """The number of samples of the whole run, unless it ends early."""
        return self._plan.sample_times.count

    @property
    def wall_time(self) -> float:
        """Wall time of the run so far, without pauses, s."""
        return self._wall_time

    @property
    def parameters(self) -> Mapping[str, Array]:
        """The present values of the tunable parameters."""
        return self.compiled.parameters.unpack(self._p)

    # Advancing.

    def advance(
        self,
        until: float | None = None,
        *,
        steps: int | None = None,
        wall_time: float | None = None,
        exactly: bool = False,
    ) -> None:
        """Continue until the time ``until`` (s) is reached, for a number of ``steps``, for a ``wall_time``
        (s).

        The first of these limits applies; without limits the run continues to its end. Steps are not
        shortened, so the reached time may exceed ``until`` by part of a step; a run without the pause has the
        same samples. ``exactly`` ends a step at ``until`` and restarts the integration there, as at a jump of
        a source.

        Raises ``SimulationError`` if the run cannot continue; its ``partial`` has the valid samples. Ctrl-C
        raises ``KeyboardInterrupt``; no samples are lost, and the run can continue.
        """
        if self.finished:
            return
        began, prepared = perf_counter(), self._method.preparation_time
        part = self._current_part()
        pause = np.inf if until is None else float(until)
        if exactly and part.integration is not None and self.time < pause < self.stop_time:
            part.integration.end_step_at(pause)
        try:
            try:
                deadline = np.inf if wall_time is None else began + wall_time
                self._advance_in_chunks(part, steps, pause, deadline)
            finally:
                self._wall_time += perf_counter() - began - (self._method.preparation_time - prepared)
            self._check_end(part)
        except SimulationError as failure:
            self._fail(failure)

    def _advance_in_chunks(self, part: RunPart, steps: int | None, pause: float, deadline: float) -> None:
        """Take steps in chunks until one of three limits: number of steps, simulated time, wall time."""
        left = np.inf if steps is None else max(0, steps)
        budget = deadline - perf_counter()
        while part.status is Status.PAUSED and left >= 1:
            if part.integration is not None and part.other_method_faster:
                part.integration = self._method.change(part.integration)
            started, steps_taken = perf_counter(), part.steps_taken
            chunk = int(min(self._chunk_of(part), left))
            if self._calls is None:
                part.advance(chunk, pause, self._recording.consumer)
            else:
                self._calls.advance(part, chunk, pause, self._recording.consumer)
            now = perf_counter()
            left -= part.steps_taken - steps_taken
            if part.reached(pause) and not part.other_method_faster:
                break
            # At most twice as many steps as before, so that the time of a chunk grows gradually. Events
            # count as steps of a chunk, not as steps taken.
            growth = min(2.0, min(CHUNK_SECONDS, budget) / max(now - started, 1e-6))
            self._chunk = max(100, int(chunk * growth))
            if now >= deadline:
                break

    def _check_end(self, part: RunPart) -> None:
        """Report the block that ended the run. Raises ``SimulationError`` for a failed run."""
        integration = part.integration
        if integration is None or part.status in (Status.PAUSED, Status.DONE):
            return
        if part.status is not Status.STOPPED:
            raise integration_failure(self.compiled, integration, part.p)
        ended = ended_by_block(self.compiled, integration)
        if isinstance(ended, SimulationError):
            raise ended
        self._add_message(ended)

    def _chunk_of(self, part: RunPart) -> int:
        """Number of steps of the next chunk. With a window, the samples of these steps fill about half of the
        window."""
        if part.window is None:
            return self._chunk
        recorded = max(1, part.recorded - part.first)
        return max(1, min(self._chunk, int(part.window // 2 * max(1, part.steps_taken) / recorded)))

    def set(self, parameters: Mapping[str, ArrayLike]) -> None:
        """Change tunable parameters, ``block.parameter``, from the present time on.

        Nothing is compiled. The integration restarts from the present values, exactly as another run from
        :meth:`state` would start, with the breakpoints of the new parameter values.

        Raises ``UnknownNameError`` and ``InputError``.
        """
        if self.finished:
            raise InputError(
                f"the run has ended at {self.time:g} s",
                where=self.compiled.name,
                allowed="changes of parameters before the end of the run",
                fix="begin another run with the new values",
            )
        p = changed_parameters(self.compiled, self._p, parameters)
        if p.tobytes() == self._p.tobytes():
            return
        self._p = p
        if self._parts and self._parts[-1].recorded == 0:
            self._parts.pop()  # the run has not started: begin with the new values
        if self._parts:
            self._changed = True
            values = {name: np.asarray(value, dtype=np.float64) for name, value in parameters.items()}
            self._changes += (ParameterChange(time=self.time, values=values),)

    def stop(self, message: str) -> None:
        """End the run at the present time; ``message`` states the reason in the report."""
        if not self.finished:
            self._stopped = True
            self._message = message

    # Results.

    def samples(self, begin: int = 0) -> Samples:
        """Signals of the recorded samples from number ``begin`` on."""
        return self._recording.samples(begin)

    def state(self) -> RunState:
        """The present state, from which another run can continue."""
        compiled = self.compiled
        integration = self._parts[-1].integration if self._parts else None
        checkpoint = None
        if integration is None:
            point = RunPoint(time=self.time, x=np.empty(0))
        else:
            point = integration.point
            checkpoint = self._method.checkpoint or integration.checkpoint
            if checkpoint is None and integration.status is Status.PAUSED:
                # The run is paused between two steps; the next run continues here.
                checkpoint = integration.present_checkpoint()
        return RunState(
            name=compiled.name,
            time=point.time,
            states=point.x,
            discrete=point.z,
            algebraic=point.w,
            names=slot_names(compiled),
            settings=self._method.settings,
            checkpoint=checkpoint,
            past=point.history,
        )

    def result(self) -> SimulationResult:
        """The samples recorded so far, with the statistics of the run.

        Raises ``SimulationError`` if a signal is not finite; its ``partial`` has the valid samples.
        """
        if self._failure is not None:
            raise self._failure
        if not self._parts:
            self._current_part()
        self._write_remaining()
        result = self._result(None)
        if self._failure is not None:
            raise self._failure
        return result

    # Internal.

    @property
    def _parts(self) -> list[RunPart]:
        return self._recording.parts

    def _current_part(self) -> RunPart:
        """The present part of the run, created at the start and after a change of parameters."""
        if self._parts and not self._changed:
            return self._parts[-1]
        sample_times, begin, window = self._plan.sample_times, self.recorded, self._recording.window
        before = self._parts[-1].integration if self._parts else None
        integration = self._method.begin(self._p, first_window(sample_times, begin, window), before)
        self._write_remaining()
        change = self._end_of_part(self._parts[-1]) if self._parts else None
        recorded = self.options.record_jumps
        self._parts.append(
            RunPart(
                sample_times,
                begin,
                self._p,
                integration,
                window,
                change=change if recorded else None,
                breakpoints=self.compiled.breakpoints(self._p),
                record_jumps=recorded,
            )
        )
        self._changed = False
        return self._parts[-1]

    def _end_of_part(self, before: RunPart) -> Change:
        """The end point and the parameters of the part before a change of parameters."""
        run = before.integration
        return RunPoint(time=before.time, x=NO_NUMBERS) if run is None else run.point, before.p

    def _write_remaining(self) -> None:
        try:
            self._recording.write_remaining()
        except SimulationError as failure:
            self._fail(failure)

    def _fail(self, failure: SimulationError) -> NoReturn:
        """Raise the error with the valid samples, or the error of a signal that is not finite before it."""
        self._result(failure)
        assert self._failure is not None
        raise self._failure

    def _result(self, failure: SimulationError | None) -> SimulationResult:
        """The present result. Sets ``_failure`` to the error of the run, with the result as ``partial``."""
        began = perf_counter()
        samples, compiled = self._recording.valid_samples(), self.compiled
        integrations = self._recording.integrations
        if integrations:
            self._add_message(_missing_jumps(integrations))
            self._add_message(stiffness_hint(compiled, integrations[-1], self._parts[-1].p))
            for warning in warnings_of_blocks(compiled, integrations[-1]):
                self._add_message(warning)
        for warning in warnings_of_loops(compiled, self._recording.in_memory()):
            self._add_message(warning)
        self._failure = failure = samples.failure or failure
        if failure is not None:
            self._message = " ".join(part for part in (failure.what + ".", self._message) if part)
        self._wall_time += perf_counter() - began
        result = SimulationResult(
            name=compiled.name,
            time=samples.time,
            signals_layout=self.signals_layout,
            signals=samples.signals,
            states_layout=compiled.states,
            states=samples.states,
            parameters_layout=compiled.parameters,
            parameter_values=self._p,
            parameter_changes=self._changes,
            aliases=compiled.aliases,
            run=self._report(float(samples.time[-1]) if samples.time.size else 0.0),
            final_state=None if failure is not None else self.state(),
            log=self._recording.file,
            given_jumps=samples.jumps,
        )
        if self.finished:
            self._recording.finish(result)
        if failure is not None:
            failure.partial = result
        return result

    def _report(self, reached: float) -> RunReport:
        """The statistics of the run until the time ``reached``, s."""
        runs, method, calls = self._recording.integrations, self._method, self._calls
        costs = "" if calls is None else calls.summary(self._wall_time)
        return RunReport(
            solver=method.solver,
            reason=method.reason,
            steps=sum(run.accepted for run in runs),
            rejected=sum(run.rejected for run in runs),
            evaluations=sum(run.evaluations for run in runs),
            ticks=sum(run.instants for run in runs),
            events=sum(run.events for run in runs),
            preparation_time=method.preparation_time,
            wall_time=self._wall_time,
            real_time_factor=reached / self._wall_time,
            complete=self._failure is None and self.finished and not self._stopped,
            calls=0 if calls is None else calls.count,
            call_time=0.0 if calls is None else calls.seconds,
            message=". ".join(part for part in (self._message, costs) if part),
        )

    def _add_message(self, text: str) -> None:
        if text and text not in self._message:
            self._message = f"{self._message}. {text}" if self._message else text


def _missing_jumps(integrations: Sequence[Integration]) -> str:
    """A message if a run had too many jumps to record all of them."""
    for run in integrations:
        if run.jumps.end is not None:
            return (
                f"jumps after {run.jumps.end:.4g} s are not recorded, because there are too many; "
                "a log to a file has all of them"
            )
    return ""
