"""Run a compiled system: plan, integrate in native chunks, evaluate the signals, say how it went."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.compiler.integrator_workspace import Status
from armblocks.compiler.native_integrator import Checkpoint, Integration, NativeIntegrator, RunPoint
from armblocks.compiler.rosenbrock_tableau import Tableau
from armblocks.compiler.system import CompiledSystem
from armblocks.equations import Signature, SimulationOptions
from armblocks.errors import SimulationError
from armblocks.simulation.diagnosis import first_bad_signal, integration_failure, stiffness_hint
from armblocks.simulation.plan import Plan, make_plan, parameter_vector
from armblocks.simulation.result import RunReport, SimulationResult
from armblocks.simulation.run_state import RunState, check_state, settings_text, slot_names

Array = NDArray[np.float64]
Progress = Callable[[float, float, float], None]
"""Called with the simulated time (s), the fraction of the whole (0 to 1) and the real-time factor."""

CHUNK_SECONDS = 0.04
"""Wall time between two looks at Ctrl-C and the progress, roughly."""
PROGRESS_SECONDS = 0.06


def simulate(
    compiled: CompiledSystem,
    options: SimulationOptions,
    parameters: Mapping[str, ArrayLike] | ArrayLike | None = None,
    progress: Progress | None = None,
    initial_state: RunState | None = None,
) -> SimulationResult:
    """Run ``compiled`` from 0 to ``options.stop_time`` and record its signals.

    With an ``initial_state``, another run's ``final_state``, it goes on from there to ``stop_time``: bit for
    bit as if that run had not ended, if solver, settings and parameters are the same, else started anew from
    its values; ``run.reason`` says which.

    ``parameters`` changes tunable ones: a mapping from ``block.parameter``, or the flat vector ``(np,)``.
    ``progress(time, fraction, real_time_factor)`` is called at most some 16 times a second and at the end.

    With ``solver="auto"`` a system without states is evaluated directly at all instants. Any other is
    integrated by RK4 where ``step`` is given, else by Dormand-Prince 5(4), until stability and not accuracy
    has held its steps short some thousand times: then Rodas5P goes on. Without a ``sample_time`` the stop
    time is cut into 1000 (10 s in steps of 10 ms); with a fixed step, every step is recorded, or as many of
    them as give at most 10 000 rows.

    Ctrl-C ends the run early: what is there is returned, with ``run.complete`` false.

    Raises ``InputError`` and ``UnknownNameError`` for options and parameters that cannot be run, and
    ``SimulationError`` where a signal or a derivative is not finite or the step becomes too small; its
    ``partial`` is the result up to the last good instant.
    """
    p = parameter_vector(compiled, parameters)
    if initial_state is not None:
        check_state(compiled, initial_state)
    plan = make_plan(compiled, options, 0.0 if initial_state is None else initial_state.time)
    started = perf_counter()
    compiled.prepare(plan.tableau)
    begun = perf_counter()
    return _Run(compiled, options, plan, p, begun, begun - started, progress, initial_state).result()


def _check_initial(compiled: CompiledSystem, layout: Signature, values: Array) -> None:
    """Raise ``SimulationError`` naming the first variable that does not start at finite numbers."""
    for slot in layout:
        given = values[layout.ranges[slot.name]]
        if not np.isfinite(given).all():
            raise SimulationError(
                f"the initial value of state '{slot.name}' is {given.tolist()}",
                where=compiled.name,
                allowed="finite numbers",
                fix="change the block's initial value",
            )


class _Run:
    """One run in progress."""

    def __init__(
        self,
        compiled: CompiledSystem,
        options: SimulationOptions,
        plan: Plan,
        p: Array,
        begun: float,
        preparation_time: float,
        progress: Progress | None,
        initial_state: RunState | None,
    ) -> None:
        self.compiled = compiled
        self.options = options
        self.plan = plan
        self.p = p
        self.begun = begun
        self.preparation_time = preparation_time
        self.progress = progress
        self.initial_state = initial_state
        self.reason = plan.reason
        self.resumption = ""
        self.solver = plan.solver
        self.checkpoint: Checkpoint | None = None
        self.settings = ""
        self.integration: Integration | None = None
        self.message = ""
        self.complete = True
        self.shown = begun

    def result(self) -> SimulationResult:
        instants = self.plan.instants
        failure: SimulationError | None = None
        states, discrete, algebraic = (np.empty((instants.size, 0)) for _ in range(3))
        if self.plan.tableau is not None:
            integration = self.integrate()
            recorded = integration.recorded
            instants = instants[:recorded]
            states, discrete = integration.states[:recorded], integration.discrete[:recorded]
            algebraic = integration.algebraic[:recorded]
            if integration.status not in (Status.DONE, Status.PAUSED):
                failure = integration_failure(self.compiled, integration, self.p)
            self.note_stiffness(integration)
        signals = self.compiled.evaluate_signals(instants, states, discrete, algebraic, self.p)
        bad = first_bad_signal(self.compiled, instants, signals, algebraic)
        if bad is not None:
            failure, good = bad
            instants, states, signals = instants[:good], states[:good], signals[:, :good]
        if failure is not None:
            self.complete = False
            self.message = " ".join(part for part in (failure.what + ".", self.message) if part)
            failure.partial = self.make_result(instants, states, signals, failed=True)
            raise failure
        if self.progress is not None and self.complete:
            self.show(float(instants[-1]))
        return self.make_result(instants, states, signals)

    def integrate(self) -> Integration:
        """Take all steps, in chunks, until the end, a failure or Ctrl-C."""
        compiled, options, plan = self.compiled, self.options, self.plan
        assert plan.tableau is not None
        native = compiled.integrator(plan.tableau)
        step = 0.0 if plan.tableau.adaptive else plan.step
        numbers = (step, options.rtol, options.atol, plan.max_step)
        key = native.key if plan.stiff is None else (*native.key, "auto")
        self.settings = settings_text(key, numbers, self.p)
        checkpoint = None
        if self.initial_state is not None:
            start = self.resume_from(self.initial_state)
            if self.initial_state.settings == self.settings:
                checkpoint = self.initial_state.checkpoint
            how = "exactly as the run before" if checkpoint is not None else "started anew"
            if plan.stiff is not None and checkpoint is not None and checkpoint.method == plan.stiff.name:
                native = self.prepared(plan.stiff)
                self.solver = plan.stiff.name
                self.reason = f"auto: {plan.stiff.title}, as the run before found the system stiff"
            self.resumption = f"; goes on from {start.time:g} s, {how}"
        else:
            start = RunPoint(
                time=0.0,
                x=compiled.initial_states(self.p),
                z=compiled.initial_discrete(self.p),
                w=compiled.initial_algebraic(self.p),
            )
            for layout, values in ((compiled.states, start.x), (compiled.discrete, start.z)):
                _check_initial(compiled, layout, values)
        integration = native.begin(
            start,
            self.p,
            plan.instants,
            compiled.breakpoints(self.p),
            step=plan.step,
            rtol=options.rtol,
            atol=options.atol,
            max_step=plan.max_step,
            checkpoint=checkpoint,
            watch_stiffness=plan.stiff is not None and native.tableau is plan.tableau,
        )
        self.integration = integration
        steps = 1000
        try:
            while integration.status is Status.PAUSED:
                if integration.stiff:
                    integration = self.change_method(integration)
                started = perf_counter()
                integration.advance(steps)
                now = perf_counter()
                # Twice as many steps at most: a chunk never outgrows what the last one took by much.
                steps = max(100, int(steps * min(2.0, CHUNK_SECONDS / max(now - started, 1e-6))))
                if self.progress is not None and now - self.shown >= PROGRESS_SECONDS:
                    self.show(integration.time)
        except KeyboardInterrupt:
            self.complete = False
            self.message = f"stopped by Ctrl-C at {integration.time:g} s of {options.stop_time:g} s"
        return integration

    def prepared(self, tableau: Tableau) -> NativeIntegrator:
        """The native loop of another method; the time to make it counts as preparation."""
        started = perf_counter()
        native = self.compiled.integrator(tableau)
        spent = perf_counter() - started
        self.preparation_time += spent
        self.begun += spent
        return native

    def change_method(self, integration: Integration) -> Integration:
        """The run goes on by the method for stiff systems, from where it stands."""
        first, stiff = self.plan.tableau, self.plan.stiff
        assert first is not None and stiff is not None
        native = self.prepared(stiff)
        self.checkpoint = integration.checkpoint
        self.solver = f"{first.name}, then {stiff.name}"
        self.reason = (
            f"auto: {first.title} until {integration.time:.4g} s, then {stiff.title}, because the system is "
            f"stiff: stability, not accuracy, held the explicit steps at {integration.last_step:.2g} s"
        )
        self.integration = native.take_over(integration)
        return self.integration

    @staticmethod
    def resume_from(state: RunState) -> RunPoint:
        """The values of a saved state."""
        return RunPoint(time=state.time, x=state.states, z=state.discrete, w=state.algebraic, begun=True)

    def final_state(self) -> RunState:
        """What a run needs to go on from where this one stands."""
        compiled, integration = self.compiled, self.integration
        checkpoint = None
        if integration is None:
            point = RunPoint(time=float(self.plan.instants[-1]), x=np.empty(0))
        else:
            point = integration.point
            checkpoint = self.checkpoint or integration.checkpoint
            if checkpoint is None and integration.status is Status.PAUSED:
                checkpoint = integration.now()  # stopped between two steps: the next one goes on from here
        return RunState(
            name=compiled.name,
            time=point.time,
            states=point.x,
            discrete=point.z,
            algebraic=point.w,
            names=slot_names(compiled),
            settings=self.settings,
            checkpoint=checkpoint,
        )

    def show(self, time: float) -> None:
        """Tell the progress."""
        self.shown = perf_counter()
        stop = self.options.stop_time
        assert self.progress is not None
        self.progress(time, time / stop if stop > 0.0 else 1.0, time / (self.shown - self.begun))

    def note_stiffness(self, integration: Integration) -> None:
        hint = stiffness_hint(self.compiled, integration, self.p)
        if hint:
            self.message = f"{self.message}. {hint}" if self.message else hint

    def make_result(
        self, instants: Array, states: Array, signals: Array, *, failed: bool = False
    ) -> SimulationResult:
        compiled, integration = self.compiled, self.integration
        wall_time = perf_counter() - self.begun
        reached = float(instants[-1]) if instants.size else 0.0
        report = RunReport(
            solver=self.solver,
            reason=self.reason + self.resumption,
            steps=0 if integration is None else integration.accepted,
            rejected=0 if integration is None else integration.rejected,
            evaluations=0 if integration is None else integration.evaluations,
            ticks=0 if integration is None else integration.instants,
            events=0 if integration is None else integration.events,
            preparation_time=self.preparation_time,
            wall_time=wall_time,
            real_time_factor=reached / wall_time,
            complete=self.complete,
            message=self.message,
        )
        return SimulationResult(
            name=compiled.name,
            time=instants,
            signals_layout=compiled.signals_layout,
            signals=signals,
            states_layout=compiled.states,
            states=states,
            parameters_layout=compiled.parameters,
            parameter_values=self.p,
            aliases=compiled.aliases,
            run=report,
            final_state=None if failed else self.final_state(),
        )
