"""Runs the native integrator loop: one object per method and system, one :class:`Integration` per run."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.ir_text import Module
from armblocks.compiler.llvm_ir import emit_function
from armblocks.compiler.native import load_code
from armblocks.integration.breakpoints import ends_of_segments
from armblocks.integration.delay_history import ROWS_OF_A_STEP
from armblocks.integration.elimination_plan import JacobianPattern
from armblocks.integration.explicit_method import STIFF_CHECKS
from armblocks.integration.jump_record import JumpRecord
from armblocks.integration.linear_equations import LinearEquationsLayout
from armblocks.integration.loop import POINTERS, loop_text
from armblocks.integration.rosenbrock_method import STABLE_CHECKS
from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.run_point import Checkpoint, RunPoint
from armblocks.integration.workspace import Count, LoopSizes, Scalar, Stage, Status, Workspace

if TYPE_CHECKING:
    from armblocks.compiler.tape import Tape

Vector = NDArray[np.float64]
Integers = NDArray[np.int64]

_ADVANCE = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * POINTERS, ctypes.c_int64)
SAME_INSTANT = 1.0 + 2.0**-50
"""Two times within this factor are equal, as in the native loop."""

INITIAL_CAPACITY = 2 * ROWS_OF_A_STEP
"""Initial capacity of the delay history, rows."""


class NativeIntegrator:
    """The compiled integrator of ``x' = f(t, x, z, w, p)``, including ticks and events."""

    def __init__(
        self,
        sizes: LoopSizes,
        digests: Mapping[str, str],
        tape: Callable[[str], Tape],
        tableau: Tableau,
        pattern: JacobianPattern | None = None,
    ) -> None:
        """``digests`` identify the tapes. ``tape(name)`` returns a tape if the disk cache lacks its code.

        A system without events and ticks needs only ``derivative``, others also :func:`needed_tapes`. A
        Rosenbrock method also needs the ``pattern`` of ``flow_jacobian`` and its tape.
        """
        self.tableau = tableau
        self.layout = None if pattern is None else LinearEquationsLayout(pattern)
        self.sizes = sizes
        self.states = sizes.states
        self.workspace = Workspace(tableau, sizes)
        names = (*needed_tapes(sizes), *(("flow_jacobian",) if pattern else ()))

        def write() -> str:
            module = Module()
            for name in names:
                emit_function(module, tape(name), name)
            for symbol, text in loop_text(tableau, sizes, pattern).items():
                module.add(symbol, text)
            return module.text

        # The code object must stay alive during every call.
        shape = "" if pattern is None else repr((pattern.rows, pattern.columns))
        self.key = ("runge_kutta", tableau.content, repr(sizes), shape, *(digests[name] for name in names))
        self._code = load_code(self.key, write)
        self._advance = _ADVANCE(self._code.address("advance"))

    def begin(
        self,
        start: Vector | RunPoint,
        p: Vector,
        samples: Vector,
        breakpoints: Vector,
        *,
        step: float = 0.0,
        rtol: float = 1e-6,
        atol: float = 1e-9,
        max_step: float = float("inf"),
        checkpoint: Checkpoint | None = None,
        detect_stiffness: bool = False,
        stop: float | None = None,
        span: float | None = None,
        jumps: int = 0,
    ) -> Integration:
        """A run from ``start`` to ``stop``, ready for its first step.

        ``start`` is the state ``(n,)`` at ``samples[0]``, or a point. ``samples (N,)`` s: the recorded times,
        strictly ascending; the last is the default of ``stop``. ``breakpoints (nb,)`` s, in any order: a step
        ends exactly at each breakpoint inside the run. Before a breakpoint, ``f`` is evaluated no later than
        the last double before it; after it, the integration restarts. ``step`` s: grid of a fixed-step
        method, whose times are ``k step``. ``rtol``, ``atol``, ``max_step`` s: for adaptive methods.
        ``checkpoint``: continue another run exactly from its checkpoint.
        ``detect_stiffness``: the run pauses where the other method, explicit or for stiff systems, is faster
        (:attr:`Integration.other_method_faster`). ``span`` s: approximate length of the run, for the
        resolution of events near time 0 (default: ``stop``). ``jumps``: maximum number of rows for both sides
        of the instants; with 0 they are not recorded. Arguments are not checked.
        """
        if not isinstance(start, RunPoint):
            start = RunPoint(time=float(samples[0]), x=start)
        begin_time, stop = start.time, float(samples[-1]) if stop is None else stop
        if checkpoint is not None:
            begin_time = float(checkpoint.reals[Scalar.TIME])
        ends, clamps = ends_of_segments(breakpoints, begin_time, stop)
        run = Integration(self, p, samples, ends, clamps)
        if checkpoint is not None:
            run.restore(checkpoint)
            run.counts[: Count.STAGE] = (0, samples.size, 0, ends.size)
            run.counts[[Count.ACCEPTED, Count.REJECTED, Count.EVALUATIONS, Count.INSTANTS, Count.EVENTS]] = 0
        else:
            run.start_at(start, step=step, first=not start.begun)
        run.reals[Scalar.RTOL] = rtol
        run.reals[Scalar.ATOL] = atol
        run.reals[Scalar.MAX_STEP] = max_step
        run.reals[Scalar.SPAN] = stop if span is None else span
        run.reals[Scalar.PAUSE] = np.inf
        run.reals[Scalar.HALT] = np.inf
        run.jumps.begin(jumps)
        run.update_addresses()
        run.enable_stiffness_detection(
            max(1, int(run.counts[Count.STIFFNESS_DETECTION])) if detect_stiffness else 0
        )
        if stop <= begin_time and not self.sizes.hybrid:
            run.states[0] = start.x
            run.counts[Count.SAMPLE] = 1
            run.status = Status.DONE
        elif stop <= begin_time:
            run.counts[Count.SEGMENT] = run.counts[Count.SEGMENTS]  # process the instant, take no step
        return run

    def continue_run(self, run: Integration) -> Integration:
        """Continue with this method from the state of another method of the same system, between two steps.

        Samples are recorded into the same arrays.
        """
        old, own = run.integrator.workspace, self.workspace
        new = Integration(self, *run.inputs, records=(run.states, run.discrete, run.algebraic))
        new.ensure_capacity(run.reals.size - old.size)
        head = own.stage_derivative(1)  # numbers, x, y, and the derivative at x
        new.reals[:head] = run.reals[:head]
        new.reals[own.z :] = run.reals[old.z :]
        new.counts[:] = run.counts
        new.counts[[Count.STIFFNESS_STEPS, Count.STIFF, Count.NON_STIFF, Count.SHORT_STEPS]] = 0
        new.enable_stiffness_detection(1 + int(run.counts[Count.STIFFNESS_DETECTION]))
        new.jumps.share(run.jumps)
        new.update_addresses()
        return new

    @property
    def address(self) -> int:
        """The address of the native loop, for native code that calls the loop."""
        return self._code.address("advance")

    def advance(self, addresses: tuple[int, ...], max_steps: int) -> Status:
        """Call the native loop. The call releases the interpreter lock."""
        return Status(self._advance(*addresses, max_steps))


def _checkpoint(run: Integration, reals: Vector, counts: Integers) -> Checkpoint:
    return Checkpoint(reals=reals, counts=counts, method=run.integrator.tableau.name)


def needed_tapes(sizes: LoopSizes) -> tuple[str, ...]:
    """Names of the functions that a loop calls."""
    names = ["derivative"]
    names += ["residual", "residual_jacobian"] if sizes.algebraic else []
    names += ["update"] if sizes.clocks or sizes.captures else []
    names += ["guards", "reset"] if sizes.directions else []
    names += ["delay_bounds", "delay_times", "delay_inputs"] if sizes.delays else []
    return tuple(names)


class Integration:
    """One run. Its whole state is in two arrays, so results do not depend on the number of calls."""

    def __init__(
        self,
        integrator: NativeIntegrator,
        p: Vector,
        samples: Vector,
        ends: Vector,
        clamps: Vector,
        records: tuple[Vector, Vector, Vector] | None = None,
    ) -> None:
        workspace = integrator.workspace
        self.integrator = integrator
        self._history_size = INITIAL_CAPACITY * workspace.history_width if integrator.sizes.delays else 0
        self.reals = np.zeros(workspace.size + self._history_size)
        self.counts = np.zeros(workspace.counts, dtype=np.int64)
        self.counts[Count.SEGMENTS] = ends.size
        self.status = Status.PAUSED
        self._saved = _checkpoint(self, np.full_like(self.reals, np.nan), np.zeros_like(self.counts))
        # Parameters, sample times, ends of the segments, and the latest evaluation time of each segment.
        self.inputs = (np.ascontiguousarray(p), np.ascontiguousarray(samples), ends, clamps)
        self._scratch = np.empty(1 if integrator.layout is None else integrator.layout.length)
        self.jumps = JumpRecord(self.counts, integrator.sizes)
        self.record_at(samples, records)

    def record_at(self, samples: Vector, records: tuple[Vector, Vector, Vector] | None = None) -> None:
        """Record at the times ``samples``, (N,) s, from now on, into new arrays if none are given."""
        sizes, (p, _, ends, clamps) = self.integrator.sizes, self.inputs
        if records is None:
            x, z, w = (np.empty((samples.size, n)) for n in (sizes.states, sizes.discrete, sizes.algebraic))
            records = x, z, w
        self.states, self.discrete, self.algebraic = records
        """States ``(N, n)``, discrete variables ``(N, nz)`` and unknowns of the implicit equations ``(N,
        nw)`` at the sample times. The first ``recorded`` rows are valid."""
        self.counts[Count.SAMPLE] = 0
        self.counts[Count.SAMPLES] = samples.size
        self.inputs = (p, np.ascontiguousarray(samples), ends, clamps)
        self.update_addresses()

    def ensure_capacity(self, numbers: int) -> None:
        """Enlarge the array of doubles, which contains the delay history, to at least ``numbers``
        elements."""
        if numbers <= self._history_size:
            return
        more = np.zeros(numbers - self._history_size)
        self.reals = np.concatenate([self.reals, more])
        saved = np.concatenate([self._saved.reals, more])
        self._saved = _checkpoint(self, saved, self._saved.counts)
        self._history_size = numbers
        self.counts[Count.HISTORY_CAPACITY] = numbers // self.integrator.workspace.history_width
        self.update_addresses()

    def update_addresses(self) -> None:
        """Store the addresses of all arrays. Required after one of them was replaced."""
        arrays = (self.reals, self.counts, *self.inputs, self.states, self.discrete, self.algebraic)
        arrays += (self.jumps.memory, self._saved.reals, self._saved.counts, self._scratch)
        self._addresses = tuple(array.ctypes.data for array in arrays)

    def start_at(self, start: RunPoint, *, step: float, first: bool) -> None:
        """Set the run to a point; with ``first`` the ticks at that time are pending."""
        workspace, sizes = self.integrator.workspace, self.integrator.sizes
        self.reals[Scalar.TIME] = start.time
        self.reals[Scalar.STEP] = step
        self.reals[Scalar.BOUND] = np.inf
        self.reals[Scalar.WINDOW] = np.inf
        self.reals[Scalar.LAST_EVENT] = -np.inf
        self.reals[workspace.last : workspace.last + len(sizes.directions)] = -np.inf
        self.reals[workspace.gap : workspace.gap + len(sizes.directions)] = np.inf
        self.state[:] = start.x
        self._vector(workspace.z, sizes.discrete)[:] = start.z
        self._vector(workspace.w, sizes.algebraic)[:] = start.w
        self.counts[Count.STAGE] = Stage.INSTANT if sizes.hybrid else Stage.START
        self.counts[Count.RESTARTED] = 1
        self.counts[Count.AT_START] = 1
        if sizes.delays:
            self._set_history(start)
        for clock, (period, offset) in enumerate(sizes.clocks):
            number = 0 if first else max(0, int((start.time - offset) / period) - 1)
            while not first and number * period + offset <= start.time * SAME_INSTANT:
                number += 1
            self.counts[Count.END + clock] = number

    def _set_history(self, start: RunPoint) -> None:
        """Set the initial history: the history of the point, or the constant initial values."""
        workspace, lines = self.integrator.workspace, self.integrator.sizes.delays
        history = start.history
        if not history.size:
            before = [start.z[line.value] for line in lines]
            history = np.array([start.time, 0.0, *before, *(0.0 for _ in lines)])
        self.ensure_capacity(2 * history.size)
        self.reals[workspace.history : workspace.history + history.size] = history
        self.counts[Count.HISTORY_ROWS] = history.size // workspace.history_width
        self.counts[Count.HISTORY_CAPACITY] = self._history_size // workspace.history_width
        first = int(Count.END) + len(self.integrator.sizes.clocks)
        self.counts[first : first + len(lines)] = 0
        self.counts[first + len(lines) :] = -1

    def end_step_at(self, time: float) -> None:
        """Add a breakpoint at a later time (s): a step ends exactly there, and the integration restarts."""
        p, samples, *bounds = self.inputs
        ends, clamps = (bound[self.counts[Count.SEGMENT] :] for bound in bounds)
        place = int(np.searchsorted(ends, time))
        if place == ends.size or ends[place] == time:
            return
        self.inputs = (p, samples, np.insert(ends, place, time), np.insert(clamps, place, time))
        self.counts[Count.SEGMENT] = 0
        self.counts[Count.SEGMENTS] = self.inputs[2].size
        self.update_addresses()

    def pause_before_ticks_at(self, time: float) -> None:
        """Return from :meth:`advance` before the ticks of the first instant at a time (s) or later."""
        self.reals[Scalar.HALT] = time

    @property
    def instant_pending(self) -> bool:
        """Whether the ticks and events at the present time are pending."""
        return self.counts[Count.STAGE] in (Stage.INSTANT, Stage.TICKS)

    def next_tick(self, clock: int) -> float:
        """The time of the next tick, s; this may be now while the run is :attr:`instant_pending`."""
        period, offset = self.integrator.sizes.clocks[clock]
        return float(self.counts[Count.END + clock]) * period + offset

    def set_discrete(self, indices: slice, values: Vector) -> None:
        """Set some discrete variables at the present time."""
        self._vector(self.integrator.workspace.z, self.integrator.sizes.discrete)[indices] = values

    def advance(self, max_steps: int, pause: float = np.inf) -> Status:
        """Take at most ``max_steps`` accepted steps, and none that begins at ``pause`` (s) or later."""
        self.reals[Scalar.PAUSE] = pause
        if self.status is Status.PAUSED:
            self.status = self.integrator.advance(self._addresses, max_steps)
            while self.status in (Status.HISTORY_FULL, Status.JUMPS_FULL):
                if self.status is Status.HISTORY_FULL:
                    self.ensure_capacity(2 * self._history_size)
                else:
                    self.jumps.enlarge(self.time)
                    self.update_addresses()
                self.status = self.integrator.advance(self._addresses, max_steps)
        return self.status

    @property
    def checkpoint(self) -> Checkpoint | None:
        """The checkpoint from which a longer run would continue; ``None`` if there is none yet."""
        if np.isnan(self._saved.reals[Scalar.TIME]):
            return None
        return _checkpoint(self, self._saved.reals.copy(), self._saved.counts.copy())

    def restore(self, checkpoint: Checkpoint) -> None:
        """Return to the state of :meth:`present_checkpoint`, and drop later samples."""
        self.ensure_capacity(checkpoint.reals.size - self.integrator.workspace.size)
        self.reals[: checkpoint.reals.size] = checkpoint.reals
        self.counts[:] = checkpoint.counts
        if self.integrator.sizes.delays:
            self.counts[Count.HISTORY_CAPACITY] = (
                self._history_size // self.integrator.workspace.history_width
            )
        self.jumps.enable()
        self.status = Status.PAUSED

    def present_checkpoint(self) -> Checkpoint:
        """A copy of the present arrays, between two calls of :meth:`advance`."""
        return _checkpoint(self, self.reals.copy(), self.counts.copy())

    @property
    def point(self) -> RunPoint:
        """Copies of the present state."""
        workspace, sizes = self.integrator.workspace, self.integrator.sizes
        z, w = self._vector(workspace.z, sizes.discrete), self._vector(workspace.w, sizes.algebraic)
        history = np.empty(0)
        if sizes.delays:
            rows = int(self.counts[Count.HISTORY_ROWS]) * workspace.history_width
            history = self._vector(workspace.history, rows).copy()
        return RunPoint(time=self.time, x=self.state.copy(), z=z.copy(), w=w.copy(), history=history)

    @property
    def trial_unknowns(self) -> Vector:
        """Implicit unknowns at the latest evaluation point, ``(nw,)``; NaN if they were not found."""
        return self._vector(self.integrator.workspace.trial_w, self.integrator.sizes.algebraic)

    def enable_stiffness_detection(self, changes: int) -> None:
        """Pause where another method is faster. ``changes``: 1 plus the number of changes so far, or 0 for
        never.

        With each change, more checks are required before the run returns to an explicit method.
        """
        self.counts[Count.STIFFNESS_DETECTION] = changes
        if not self._explicit:
            self.counts[Count.STIFF] = STABLE_CHECKS * 4 ** min(10, max(0, changes - 2) // 2)

    @property
    def other_method_faster(self) -> bool:
        """Whether the run paused because another method is now faster.

        Stability has limited the steps of an explicit method, or an explicit method could have taken the
        steps of a method for stiff systems.
        """
        if self.status is not Status.PAUSED or not self.counts[Count.STIFFNESS_DETECTION]:
            return False
        if self._explicit:
            return bool(self.counts[Count.STIFF] >= STIFF_CHECKS)
        return bool(self.counts[Count.NON_STIFF] >= self.counts[Count.STIFF])

    @property
    def _explicit(self) -> bool:
        return not self.integrator.tableau.needs_jacobian

    @property
    def instants(self) -> int:
        """The number of instants with ticks so far."""
        return int(self.counts[Count.INSTANTS])

    @property
    def events(self) -> int:
        """The number of fired guards so far."""
        return int(self.counts[Count.EVENTS])

    def positive_guards(self, guards: Sequence[int]) -> list[int]:
        """The entries of ``guards`` that are positive at the present time."""
        signs = self._vector(self.integrator.workspace.signs, len(self.integrator.sizes.directions))
        return [guard for guard in guards if signs[guard] > 0.0]

    def last_fired(self, guard: int) -> float:
        """The last time at which a guard fired, s; minus infinity if it never did."""
        return float(self.reals[self.integrator.workspace.last + guard])

    @property
    def repeating_guards(self) -> list[int]:
        """The guards that fired in most of the latest consecutive close events."""
        workspace, count = self.integrator.workspace, len(self.integrator.sizes.directions)
        repeats = self.reals[workspace.repeats : workspace.repeats + count]
        return [int(k) for k in np.flatnonzero((repeats > 0.0) & (repeats >= 0.5 * repeats.max(initial=0.0)))]

    @property
    def inconsistent_modes(self) -> list[int]:
        """The indices in ``z`` of the inconsistent modes."""
        workspace, modes = self.integrator.workspace, self.integrator.sizes.modes
        contradictions = self.reals[workspace.contradictions : workspace.contradictions + len(modes)]
        return [place for place, inconsistent in zip(modes, contradictions) if inconsistent]

    @property
    def time(self) -> float:
        """Time that the last accepted step reached, s."""
        return float(self.reals[Scalar.TIME])

    @property
    def stop(self) -> float:
        """Time at which the run is complete, s."""
        return float(self.inputs[2][-1])

    @property
    def state(self) -> Vector:
        """State at :attr:`time`, ``(n,)``: a view."""
        return self._vector(self.integrator.workspace.x, self.integrator.states)

    def _vector(self, place: int, size: int) -> Vector:
        return self.reals[place : place + size]

    @property
    def last_step(self) -> float:
        """Length of the last trial step, s."""
        return float(self.reals[Scalar.TRIED])

    @property
    def recorded(self) -> int:
        """The number of recorded samples."""
        return int(self.counts[Count.SAMPLE])

    @property
    def accepted(self) -> int:
        """The number of accepted steps."""
        return int(self.counts[Count.ACCEPTED])

    @property
    def rejected(self) -> int:
        """The number of steps that were rejected because of their error."""
        return int(self.counts[Count.REJECTED])

    @property
    def evaluations(self) -> int:
        """The number of evaluations of the derivative."""
        return int(self.counts[Count.EVALUATIONS])

    def _stage_derivatives(self) -> Vector:
        n, rows = self.integrator.states, self.integrator.tableau.rows
        return self._vector(self.integrator.workspace.stage_derivative(0), rows * n).reshape(rows, n)

    def weighted_errors(self) -> Vector:
        """Error of every state in the last trial step, divided by its tolerance, ``(n,)`` (adaptive
        methods)."""
        weights = np.array(self.integrator.tableau.error_row)
        return self._weighted(weights @ self._stage_derivatives()[: weights.size])

    def weighted_changes(self) -> Vector:
        """Change of the derivative in the last trial step, scaled as :attr:`weighted_errors`, ``(n,)``."""
        K = self._stage_derivatives()
        return self._weighted(K[self.integrator.tableau.end_row] - K[0])

    def _weighted(self, derivative: Vector) -> Vector:
        after = self._vector(self.integrator.workspace.y, self.integrator.states)
        rtol, atol = self.reals[Scalar.RTOL], self.reals[Scalar.ATOL]
        return np.abs(self.last_step * derivative) / (
            atol + rtol * np.maximum(np.abs(self.state), np.abs(after))
        )

    def first_non_finite_stage(self) -> tuple[float, Vector]:
        """Time and state of the first stage of the last trial step with a NaN or infinite derivative."""
        tableau = self.integrator.tableau
        K, h, clamp = self._stage_derivatives(), self.last_step, self.inputs[3][self.counts[Count.SEGMENT]]
        first = tableau.first_stage
        failed = [stage for stage in range(tableau.stages) if not np.isfinite(K[first + stage]).all()]
        stage = failed[0] if failed and np.isfinite(K[0]).all() else 0 if failed else tableau.stages
        row = [*tableau.matrix, tableau.weights][stage]
        state = self.state.copy()
        for weight, derivative in zip(row, K[first:]):
            state += h * weight * derivative
        return min(self.time + [*tableau.nodes, 1.0][stage] * h, float(clamp)), state
