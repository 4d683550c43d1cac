"""A run that can be paused, looked at, tuned and taken up again: what :func:`simulate` does in one go."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler.integrator_workspace import Status
from armblocks.compiler.native_integrator import Checkpoint, Integration, NativeIntegrator, RunPoint
from armblocks.compiler.rosenbrock_tableau import Tableau
from armblocks.compiler.system import CompiledSystem
from armblocks.equations import Signature, SimulationOptions
from armblocks.errors import InputError, SimulationError
from armblocks.simulation.calls import CalledFunction, Calls
from armblocks.simulation.diagnosis import (
    assertion_failure,
    first_bad_signal,
    integration_failure,
    stiffness_hint,
)
from armblocks.simulation.first_guess import first_guess
from armblocks.simulation.plan import LogRequest, changed_parameters, make_plan, parameter_vector
from armblocks.simulation.result import LoggedFile, ParameterChange, RunReport, SimulationResult, signal_path
from armblocks.simulation.run_state import RunState, check_state, settings_text, slot_names
from armblocks.simulation.stretch import Rows, Stretch, first_window

if TYPE_CHECKING:
    from armblocks.simulation.run_log import RunLog

Array = NDArray[np.float64]

CHUNK_SECONDS = 0.04
"""Wall time between two looks at Ctrl-C and the clock, roughly."""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Recorded instants of a run that goes on: ``time (N,)`` s and ``signals (ny, N)``.

    ``begin`` is the number of the first, ``end`` that of the one which comes next. ``samples["block/port"]``
    is ``(N, *shape)``.
    """

    begin: int
    time: Array
    signals: Array
    layout: Signature
    aliases: Mapping[str, str]

    @property
    def end(self) -> int:
        """Number of the instant after these."""
        return self.begin + self.time.size

    def __getitem__(self, name: str) -> Array:
        path = signal_path(name, self.layout, self.aliases, "samples")
        rows = self.signals[self.layout.ranges[path]]
        return rows.T.reshape(self.time.size, *self.layout[path].shape)


class Simulation:
    """One run in progress, from 0 or an ``initial_state`` to ``options.stop_time``.

    :meth:`advance` goes on, :meth:`samples` gives what is recorded so far, :meth:`set` changes tunable
    parameters from here on without compiling anything, :meth:`state` is what another run can start from,
    :meth:`result` ends it. However a run is cut into calls of :meth:`advance`, its numbers are the same bits.

    Raises what :func:`~armblocks.simulation.simulate` raises for options and parameters that cannot be run.
    """

    def __init__(
        self,
        compiled: CompiledSystem,
        options: SimulationOptions,
        parameters: Mapping[str, ArrayLike] | ArrayLike | None = None,
        initial_state: RunState | None = None,
        log: LogRequest | None = None,
        calls: Sequence[CalledFunction] = (),
    ) -> None:
        if {function.block for function in calls} != set(compiled.called):
            raise InputError(
                f"nothing says what Python calls for {', '.join(map(repr, compiled.called))}",
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
        self._plan = make_plan(compiled, options, start, logged=log is not None)
        started = perf_counter()
        compiled.prepare(self._plan.tableau)
        self._preparation_time = perf_counter() - started
        self._initial_state = initial_state
        self._tableau = self._plan.tableau
        self._solver = self._plan.solver
        self._reason = self._plan.reason
        self._changed_method = False
        self._resumption = ""
        self._checkpoint: Checkpoint | None = None
        self._settings = ""
        self._message = ""
        self._stopped = False
        self._failure: SimulationError | None = None
        self._stretches: list[Stretch] = []
        self._changed = False
        self._changes: tuple[ParameterChange, ...] = ()
        self._chunk = 1000
        self._spent = 0.0
        self._log: RunLog | None = None
        self._window: int | None = None
        if log is not None:
            from armblocks.simulation.run_log import (
                RunLog,
                window_rows,
            )  # a run without a log loads no writers

            self._log = RunLog(
                log,
                compiled.signals_layout,
                compiled.aliases,
                compiled.states.size,
                self._plan.instants.count,
            )
            self._window = window_rows(1 + compiled.states.size + compiled.signals_layout.size)

    # Where the run stands.

    @property
    def stop_time(self) -> float:
        """Time at which the run is complete, s."""
        return self._plan.instants.stop

    @property
    def time(self) -> float:
        """Time that is reached, s: the end of the last step."""
        return self._stretches[-1].time if self._stretches else self._plan.instants.start

    @property
    def finished(self) -> bool:
        """Whether nothing is left to do: complete, stopped or failed."""
        if self._stopped or self._failure is not None:
            return True
        return bool(self._stretches) and not self._changed and self._stretches[-1].status is not Status.PAUSED

    @property
    def recorded(self) -> int:
        """How many instants are recorded so far."""
        return self._stretches[-1].recorded if self._stretches else 0

    @property
    def planned(self) -> int:
        """How many instants the whole run records, if nothing ends it early."""
        return self._plan.instants.count

    @property
    def wall_time(self) -> float:
        """Time that the run has taken so far, without pauses, s."""
        return self._spent

    @property
    def parameters(self) -> Mapping[str, Array]:
        """The tunable parameters as they are now."""
        return self.compiled.parameters.unpack(self._p)

    # Going on.

    def advance(
        self,
        until: float | None = None,
        *,
        steps: int | None = None,
        wall_time: float | None = None,
        exactly: bool = False,
    ) -> None:
        """Go on until the time ``until`` (s) is reached, for a number of ``steps``, for a ``wall_time`` (s).

        Whatever comes first; without any of them, to the end. A step is never cut short, so the time reached
        may be later than ``until`` by a part of a step; what is recorded until then is the same as without
        the pause. ``exactly`` ends a step at ``until`` and starts anew there, as at a jump of a source.

        Raises ``SimulationError``, with all that is good so far as its ``partial``, where the run cannot go
        on. Ctrl-C leaves by ``KeyboardInterrupt``; nothing is lost, and the run can go on.
        """
        if self.finished:
            return
        began = perf_counter()
        stretch = self._current()
        pause = np.inf if until is None else float(until)
        integration = stretch.integration
        if exactly and integration is not None and self.time < pause < self.stop_time:
            integration.cut_at(pause)
        left = np.inf if steps is None else max(0, steps)
        budget = np.inf if wall_time is None else wall_time
        try:
            while stretch.status is Status.PAUSED and left >= 1:
                if stretch.integration is not None and stretch.integration.wants_other:
                    stretch.integration = self._change_method(stretch.integration)
                started, taken = perf_counter(), self._steps_of(stretch)
                chunk = int(min(self._chunk_of(stretch), left))
                self._go(stretch, chunk, pause)
                now = perf_counter()
                taken = self._steps_of(stretch) - taken
                left -= taken
                other = stretch.integration is not None and stretch.integration.wants_other
                if taken < chunk and not other:
                    break  # at the pause, or at the end
                # Twice as many steps at most: a chunk never outgrows what the last one took by much.
                growth = min(2.0, min(CHUNK_SECONDS, budget) / max(now - started, 1e-6))
                self._chunk = max(100, int(taken * growth))
                if now - began >= budget:
                    break
        finally:
            self._spent += perf_counter() - began
        if stretch.status is Status.STOPPED:
            assert integration is not None
            self._ended_by(integration)
        elif stretch.status not in (Status.PAUSED, Status.DONE):
            assert integration is not None
            self._fail(integration_failure(self.compiled, integration, stretch.p))

    def _go(self, stretch: Stretch, steps: int, pause: float) -> None:
        """Take some steps; where Python functions are due on the way, they are called."""
        consume, integration = None if self._log is None else self._consume, stretch.integration
        if self._calls is None or integration is None:
            stretch.advance(steps, pause, consume)
            return
        left = steps + self._steps_of(stretch)
        while True:
            try:
                self._calls.make(integration, stretch.p)
            except SimulationError as failure:
                self._fail(failure)
            stretch.advance(max(0, left - self._steps_of(stretch)), pause, consume)
            if stretch.status is not Status.PAUSED or not self._calls.waits(integration):
                return

    @staticmethod
    def _steps_of(stretch: Stretch) -> int:
        return stretch.recorded if stretch.integration is None else stretch.integration.accepted

    def _chunk_of(self, stretch: Stretch) -> int:
        """How many steps to take at once: with a window, about as many as fill half of it at most."""
        if self._window is None:
            return self._chunk
        steps = max(1, self._steps_of(stretch))
        recorded = max(1, stretch.recorded - stretch.first)
        return max(1, min(self._chunk, int(self._window // 2 * steps / recorded)))

    def set(self, parameters: Mapping[str, ArrayLike]) -> None:
        """Give tunable parameters, ``block.parameter``, other values from the time reached on.

        Nothing is compiled. The run starts anew from its values there, exactly as another run would from
        its :meth:`state`, with the breakpoints that follow from the new values.

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
        if self._stretches and self._stretches[-1].recorded == 0:
            self._stretches.pop()  # not even the start has happened: begin with the new values
        if self._stretches:
            self._changed = True
            values = {name: np.asarray(value, dtype=np.float64) for name, value in parameters.items()}
            self._changes += (ParameterChange(time=self.time, values=values),)

    def stop(self, message: str) -> None:
        """End the run where it stands; ``message`` says why in its report."""
        if not self.finished:
            self._stopped = True
            self._message = message

    # What there is.

    def samples(self, begin: int = 0) -> Samples:
        """Signals at the recorded instants from number ``begin`` on."""
        parts, compiled = self._rows(begin), self.compiled
        nothing = np.empty((compiled.signals_layout.size, 0))
        return Samples(
            begin=parts[0].begin if parts else min(begin, self.recorded),
            time=_joined([rows.time for rows in parts] or [np.empty(0)]),
            signals=_joined([rows.signals(compiled) for rows in parts] or [nothing], axis=1),
            layout=compiled.signals_layout,
            aliases=compiled.aliases,
        )

    def state(self) -> RunState:
        """What a run needs to go on from where this one stands."""
        compiled = self.compiled
        integration = self._stretches[-1].integration if self._stretches else None
        checkpoint = None
        if integration is None:
            point = RunPoint(time=self.time, x=np.empty(0))
        else:
            point = integration.point
            checkpoint = self._checkpoint or integration.checkpoint
            if checkpoint is None and integration.status is Status.PAUSED:
                checkpoint = integration.now()  # stopped between two steps: the next one goes on from here
        return RunState(
            name=compiled.name,
            time=point.time,
            states=point.x,
            discrete=point.z,
            algebraic=point.w,
            names=slot_names(compiled),
            settings=self._settings,
            checkpoint=checkpoint,
            past=point.past,
        )

    def result(self) -> SimulationResult:
        """All that is recorded so far, and how the run went.

        Raises ``SimulationError``, with the good part as its ``partial``, where a signal is not finite.
        """
        if self._failure is not None:
            raise self._failure
        if not self._stretches:
            self._current()
        return self._assembled(None)

    # Behind it.

    def _current(self) -> Stretch:
        """The stretch that goes on: made at the start, and after a change of parameters."""
        if self._stretches and not self._changed:
            return self._stretches[-1]
        plan, begin = self._plan, self.recorded
        integration = None
        if self._tableau is not None:
            integration = self._begin_integration(first_window(plan.instants, begin, self._window))
        if self._stretches:
            self._hand_over(self._stretches[-1])
        self._stretches.append(Stretch(plan.instants, begin, self._p, integration, self._window))
        self._changed = False
        return self._stretches[-1]

    def _begin_integration(self, instants: Array) -> Integration:
        compiled, options, plan = self.compiled, self.options, self._plan
        assert plan.tableau is not None and self._tableau is not None
        key = compiled.integrator(plan.tableau).key
        step = 0.0 if plan.tableau.adaptive else plan.step
        numbers = (step, options.rtol, options.atol, plan.max_step)
        self._settings = settings_text(key if plan.stiff is None else (*key, "auto"), numbers, self._p)
        self._checkpoint = checkpoint = None
        state = self._initial_state
        if self._stretches:
            before = self._stretches[-1].integration
            assert before is not None
            start = dataclasses.replace(before.point, begun=True)
        elif state is not None:
            start = RunPoint(
                time=state.time,
                x=state.states,
                z=state.discrete,
                w=state.algebraic,
                past=state.past,
                begun=True,
            )
            if state.settings == self._settings:
                checkpoint = state.checkpoint
            how = "exactly as the run before" if checkpoint is not None else "started anew"
            if plan.stiff is not None and checkpoint is not None and checkpoint.method == plan.stiff.name:
                self._tableau, self._solver, self._changed_method = plan.stiff, plan.stiff.name, True
                self._reason = f"auto: {plan.stiff.title}, as the run before found the system stiff"
            self._resumption = f"; goes on from {start.time:g} s, {how}"
        else:
            start = _starting_point(compiled, self._p)
        return self._prepared(self._tableau).begin(
            start,
            self._p,
            instants,
            compiled.breakpoints(self._p),
            step=plan.step,
            rtol=options.rtol,
            atol=options.atol,
            max_step=plan.max_step,
            checkpoint=checkpoint,
            watch_stiffness=plan.stiff is not None,
            stop=plan.instants.stop,
        )

    def _prepared(self, tableau: Tableau) -> NativeIntegrator:
        """The native loop of a method; the time to make it counts as preparation."""
        started = perf_counter()
        native = self.compiled.integrator(tableau)
        spent = perf_counter() - started
        self._preparation_time += spent
        self._spent -= spent
        return native

    def _change_method(self, integration: Integration) -> Integration:
        """The run goes on by the other method of the two, from where it stands."""
        first, stiff = self._plan.tableau, self._plan.stiff
        assert first is not None and stiff is not None
        following = first if self._tableau is stiff else stiff
        native = self._prepared(following)
        self._checkpoint = integration.checkpoint
        when, step = f"{integration.time:.4g} s", f"{integration.last_step:.2g} s"
        if following is first:
            self._reason += f"; from {when} {first.title}, as steps of {step} are stable now"
        elif self._changed_method:
            self._reason += f"; from {when} {stiff.title}"
        else:
            self._reason = (
                f"auto: {first.title} until {when}, then {stiff.title}, because the system is "
                f"stiff: stability, not accuracy, held the explicit steps at {step}"
            )
        self._solver += f", then {following.name}"
        self._tableau, self._changed_method = following, True
        return native.take_over(integration)

    def _rows(self, begin: int = 0) -> list[Rows]:
        return [rows for rows in (part.rows(begin) for part in self._stretches) if rows.time.size]

    def _ended_by(self, integration: Integration) -> None:
        """Say which block has ended the run; raises where it is one that fails it."""
        compiled = self.compiled
        guard = integration.positive(compiled.sizes.stops)[0]
        block, time = compiled.guard_names[guard], f"{integration.time:.9g} s"
        if compiled.guard_actions[guard] == "fail":
            self._fail(assertion_failure(compiled, block, integration.time))
        self._note(f"stopped by block '{block}' at {time}")

    def _note_warnings(self, integration: Integration) -> None:
        """What blocks have to say that only warn."""
        compiled = self.compiled
        for guard, action in enumerate(compiled.guard_actions):
            fired = integration.last_fired(guard)
            if action == "warn" and (fired > -np.inf or integration.positive([guard])):
                when = f"last from {fired:.9g} s on" if fired > -np.inf else "from the start on"
                self._note(f"assertion '{compiled.guard_names[guard]}' did not hold, {when}")

    def _consume(self, rows: Rows) -> None:
        """Write a window to the log; rows that are there already, after an interruption, are left out."""
        assert self._log is not None
        rows = rows.after(self._log.rows)
        if not rows.time.size:
            return
        compiled = self.compiled
        signals = rows.signals(compiled)
        bad = first_bad_signal(compiled, rows.time, signals, rows.algebraic)
        good = rows.time.size if bad is None else bad[1]
        self._log.append(rows.time[:good], rows.states[:good], signals[:, :good])
        if bad is not None:
            self._fail(bad[0])

    def _hand_over(self, stretch: Stretch) -> None:
        """What a stretch still holds goes into the log."""
        if self._log is not None and self._failure is None:
            stretch.settle()
            self._consume(stretch.rows())

    def _fail(self, failure: SimulationError) -> None:
        """Raise with what is good so far."""
        self._failure = failure
        self._assembled(failure)

    def _assembled(self, failure: SimulationError | None) -> SimulationResult:
        """The result; raises the failure with it as its ``partial``."""
        began = perf_counter()
        compiled = self.compiled
        if failure is None or self._failure is None:
            self._hand_over(self._stretches[-1])
        if self._log is None:
            parts = self._rows() or [self._stretches[-1].rows()]
            time = _joined([rows.time for rows in parts])
            states = _joined([rows.states for rows in parts])
            signals = _joined([rows.signals(compiled) for rows in parts], axis=1)
            bad = first_bad_signal(compiled, time, signals, _joined([rows.algebraic for rows in parts]))
            if bad is not None:
                failure, good = bad
                time, states, signals = time[:good], states[:good], signals[:, :good]
        else:
            time, states, signals = self._log.view(compiled.signals_layout.size)
        integrations = [part.integration for part in self._stretches if part.integration is not None]
        if integrations:
            self._note(stiffness_hint(compiled, integrations[-1], self._stretches[-1].p))
            self._note_warnings(integrations[-1])
        if failure is not None:
            self._failure = failure
            self._message = " ".join(part for part in (failure.what + ".", self._message) if part)
        self._spent += perf_counter() - began
        reached = float(time[-1]) if time.size else 0.0
        result = SimulationResult(
            name=compiled.name,
            time=time,
            signals_layout=compiled.signals_layout,
            signals=signals,
            states_layout=compiled.states,
            states=states,
            parameters_layout=compiled.parameters,
            parameter_values=self._p,
            parameter_changes=self._changes,
            aliases=compiled.aliases,
            run=RunReport(
                solver=self._solver,
                reason=self._reason + self._resumption,
                steps=sum(run.accepted for run in integrations),
                rejected=sum(run.rejected for run in integrations),
                evaluations=sum(run.evaluations for run in integrations),
                ticks=sum(run.instants for run in integrations),
                events=sum(run.events for run in integrations),
                preparation_time=self._preparation_time,
                wall_time=self._spent,
                real_time_factor=reached / self._spent,
                complete=failure is None and self.finished and not self._stopped,
                calls=0 if self._calls is None else self._calls.count,
                call_time=0.0 if self._calls is None else self._calls.seconds,
                message=self._told(),
            ),
            final_state=None if failure is not None else self.state(),
            log=None if self._log is None else LoggedFile(path=self._log.path, rows=self._log.rows),
        )
        if self._log is not None and (self.finished or failure is not None):
            self._log.finish(result)
        if failure is not None:
            failure.partial = result
            raise failure
        return result

    def _told(self) -> str:
        """What a person should know, and what calls of Python cost."""
        costs = "" if self._calls is None else self._calls.told(self._spent)
        return ". ".join(part for part in (self._message, costs) if part)

    def _note(self, hint: str) -> None:
        if hint and hint not in self._message:
            self._message = f"{self._message}. {hint}" if self._message else hint


def _joined(parts: Sequence[Array], axis: int = 0) -> Array:
    """One array; without a copy where there is one part."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=axis)


def _starting_point(compiled: CompiledSystem, p: Array) -> RunPoint:
    """The initial values. Raises ``SimulationError`` naming the first variable that is not finite."""
    start = RunPoint(
        time=0.0,
        x=compiled.initial_states(p),
        z=compiled.initial_discrete(p),
        w=compiled.initial_algebraic(p),
    )
    for layout, values in ((compiled.states, start.x), (compiled.discrete, start.z)):
        for slot in layout:
            given = values[layout.ranges[slot.name]]
            if not np.isfinite(given).all():
                raise SimulationError(
                    f"the initial value of state '{slot.name}' is {given.tolist()}",
                    where=compiled.name,
                    allowed="finite numbers",
                    fix="change the block's initial value",
                )
    return dataclasses.replace(start, w=first_guess(compiled, start, p))
