"""Events of a loop: guards whose sign changes, resets, and mode iteration.

A guard fires when its sign is the opposite of its stored sign and the change has the direction of the guard.
Signs are stored after every step, tick and event. A guard with the value zero keeps its stored sign. A guard
that is zero at the start of the run has no sign until its value is nonzero. If a guard is zero right after it
fired, its stored sign depends on its direction: a guard of one direction gets the sign that it had before the
event, and a guard of both directions has no sign until its value is nonzero.
"""

from __future__ import annotations

from armblocks.integration import system_functions
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import SAME_BELOW, Frame, copy
from armblocks.integration.guard_functions import GuardFunctions
from armblocks.integration.method import Method
from armblocks.integration.ranked_events import RankedEvents
from armblocks.integration.records import Records
from armblocks.integration.undecided_modes import UndecidedModes
from armblocks.integration.workspace import Count, Scalar, Status
from armblocks.routines.arithmetic import select
from armblocks.routines.memory import IntegerVariable, Reals, RealVariable
from armblocks.routines.values import Boolean, Integer, Real

ITERATIONS_TOGETHER, MAX_ITERATIONS_PER_MODE = 8, 32
"""Mode iteration changes all inconsistent modes together in the first ``ITERATIONS_TOGETHER`` iterations plus
one for each mode. It ends after ``MAX_ITERATIONS_PER_MODE`` iterations for each mode."""
START_ITERATIONS = 400
"""The maximum number of resets at the start of a run is this number plus the number of guards. Loops of
sampled values converge within it."""


class Events:
    """Emits the code for guards and modes. ``point`` is the variable that holds the time of an evaluation."""

    def __init__(
        self, frame: Frame, method: Method, records: Records, evaluation: Evaluation, point: RealVariable
    ) -> None:
        self.frame = frame
        self.method = method
        self.records = records
        self.evaluation = evaluation
        self.point = point
        self.guards = len(frame.sizes.directions)
        self.modes = len(frame.sizes.modes)
        program, workspace, sizes = frame.r.program, frame.workspace, frame.sizes
        self.functions = GuardFunctions(program, workspace, sizes)
        self.ranked = RankedEvents(program, workspace, sizes) if sizes.guard_ranks else None
        self.undecided = (
            UndecidedModes(program, workspace, sizes, self.functions, evaluation.implicit)
            if sizes.may_be_undecided
            else None
        )
        self.x, self.new_x = frame.vector(workspace.x), frame.vector(workspace.new_x)

    def mark_fired(self, time: Real, x: Reals) -> Integer:
        """Evaluate all guards and mark the guards that fire; return the number of these guards and of
        inconsistent modes."""
        f = self.frame
        self.point.value = time
        t = self.point.memory
        self.evaluation.solve(t, x)
        count = f.r.call(self.functions.mark_fired, t, x, f.reals, f.p)
        if self.undecided is None:
            return count
        return count - f.r.call(self.undecided.accept, t, x, f.reals, f.p)

    def make_modes_consistent(self, time: Real, *, last: bool = True) -> None:
        """At the start of the run, apply resets without events until states and modes are consistent.

        A mode may change a signal on which another mode depends. The reset is therefore repeated until
        nothing changes. The maximum number is ``START_ITERATIONS`` plus the number of guards. ``last``:
        whether the ticks of the start are complete.
        """
        f, r, workspace = self.frame, self.frame.r, self.frame.workspace
        counter, fired = Count.AT_START, f.vector(workspace.fired)
        with r.when(f.counts[counter] != 0):
            self.point.value = time
            for i in r.each(self.guards):
                fired[i] = 0.0
            if self.modes:
                self._make_following_modes_consistent()
            f.counts[counter] = self.guards + START_ITERATIONS
            with r.part() as iteration:
                self.evaluation.solve(self.point.memory, self.x)
                self.reset()
                same = r.real(1.0)
                for before, after, count in (
                    (workspace.x, workspace.new_x, f.n),
                    (workspace.z, workspace.new_z, f.sizes.discrete),
                ):
                    for i in r.each(count):
                        old, new = f.vector(before)[i], f.vector(after)[i]
                        same.value = select(old != new, 0.0, same.value)
                self.apply_reset()
                remaining = f.counts[counter] - 1
                f.counts[counter] = remaining
                iteration.again_when((same.value == 0.0) & (remaining > 0))
            f.counts[counter] = 0 if last else 1

    def _make_following_modes_consistent(self) -> None:
        """Make the following modes consistent, before the stateful modes."""
        f, r, functions, t = self.frame, self.frame.r, self.functions, self.point.memory
        iterations = r.integer(0)
        with r.loop() as loop:
            self.evaluation.solve(t, self.x)
            functions.evaluate(r, t, self.x, f.reals, f.p)
            iterations.value = iterations.value + 1
            loop.leave_unless(iterations.value < ITERATIONS_TOGETHER + self.modes)
            loop.leave_unless(r.call(functions.any_inconsistent, f.reals, r.constant_boolean(True)))
            self._reset_following_modes(iterations)

    def reset(self) -> None:
        """Compute ``new_x`` and ``new_z`` for the events that are marked in ``fired``."""
        f, workspace = self.frame, self.frame.workspace
        z, unknowns, fired, new_z = (
            f.vector(place) for place in (workspace.z, workspace.trial_w, workspace.fired, workspace.new_z)
        )
        t = self.point.memory
        f.r.call(system_functions.reset, t, self.x, z, unknowns, f.p, fired, self.new_x, new_z)

    def apply_reset(self) -> None:
        """Copy the states and discrete variables of the reset to ``x`` and ``z``."""
        f, workspace = self.frame, self.frame.workspace
        f.copy(workspace.new_x, workspace.x, f.n)
        f.copy(workspace.new_z, workspace.z, f.sizes.discrete)

    def process(self, time: Real) -> None:
        """Iterate over modes and guards until all modes are consistent and no guard fires.

        1. Following modes are made consistent. Before that the signals do not have their values of this
           instant, so no state or stateful mode may change.
        2. All other guards that fire cause one reset. Guards of higher ranks wait: see
           :mod:`armblocks.diagram.event_order`.
        3. If none fires, inconsistent stateful modes take their consistent values.

        In the first iterations all inconsistent modes change together, then only the first of them. With this
        least index rule the iteration ends for every complementarity problem with a P-matrix (Murty 1974). If
        the iteration does not end, no choice of the modes is consistent, and the run ends.
        """
        f, r = self.frame, self.frame.r
        self._iterate(time)
        self._store_previous_modes()
        r.call(self.functions.store_signs, f.reals, r.constant_boolean(False))
        self._end_instant()
        workspace, derivatives = f.workspace, f.vector(f.workspace.guard_derivatives)
        f.copy(workspace.guards, workspace.guards_before, self.guards)
        for i in r.each(self.guards):
            derivatives[i] = float("nan")

    def process_before_ticks(self, time: Real, level: int) -> None:
        """Process the events that come before the ticks of this level; at the start of the run, the resets
        without events.

        All other modes and signs have their values only after the ticks, so none is stored here.
        """
        f, r, last_rank = self.frame, self.frame.r, self.frame.sizes.ranks_before_ticks[level]
        if last_rank >= 0:
            starts = f.counts[Count.AT_START] != 0
            self.make_modes_consistent(time, last=False)
            with r.unless(starts):
                self._iterate(time, last_rank)

    def _iterate(self, time: Real, last_rank: int | None = None) -> None:
        """The iteration of :meth:`process`; with a ``last_rank``, only events up to this rank."""
        f, r, functions = self.frame, self.frame.r, self.functions
        yes, no = r.constant_boolean(True), r.constant_boolean(False)
        iterations = r.integer(0)
        with r.loop() as loop:
            loop.leave_when(self.mark_fired(time, self.x) == 0)
            f.count[Count.RESTARTED].value = 1
            # An iteration counts as a step, so that a call with few steps returns soon even at many events.
            f.steps_of_call.value = f.steps_of_call.value + 1
            if self.modes:
                with r.when(r.call(functions.any_inconsistent, f.reals, yes)):
                    if last_rank is not None:
                        loop.leave_unless(iterations.value < ITERATIONS_TOGETHER + self.modes)
                    self._iterate_following_modes(time, iterations)
                    loop.again()
                with r.unless(r.call(functions.any_fired, f.reals, no)):
                    if last_rank is not None:
                        loop.leave()
                    else:
                        loop.leave_unless(r.call(functions.any_inconsistent, f.reals, no))
                        self._iterate_stateful_modes(time, iterations)
                        loop.again()
            if self.ranked is None:
                rank = None
                r.call(functions.store_signs, f.reals, no)
            else:
                rank = r.call(self.ranked.select_lowest, f.reals)
                if last_rank is not None:
                    loop.leave_when(rank > last_rank)
                self._begin_reset(self.ranked, rank)
            self._count_events(time, yes, bounds=True)
            self._recapture(rank)
            self._store_previous_modes(rank)
            self.reset()
            self.apply_reset()
            self._store_fired_signs()

    def _iterate_following_modes(self, time: Real, iterations: IntegerVariable) -> None:
        """One iteration of the following modes."""
        f, r, functions = self.frame, self.frame.r, self.functions
        r.call(functions.any_fired, f.reals, r.constant_boolean(True))
        self._count_iteration_without_event(time, iterations)
        self._reset_following_modes(iterations)
        self.evaluation.solve(self.point.memory, self.x)
        if f.sizes.tangents is not None:
            functions.evaluate(r, self.point.memory, self.x, f.reals, f.p)
            r.call(functions.store_tangent_signs, f.reals)

    def _reset_following_modes(self, iterations: IntegerVariable) -> None:
        """Give inconsistent following modes their consistent values; no state changes.

        The last guard of a system with derivatives marks this call: derivatives of states change only along
        the instant.
        """
        f, fired = self.frame, self.frame.vector(self.frame.workspace.fired)
        marks = f.sizes.tangents is not None and self.guards > f.sizes.tangents[2]
        if marks:
            fired[self.guards - 1] = 1.0
        self.reset()
        if marks:
            fired[self.guards - 1] = 0.0
        self._restrict_mode_changes(iterations, follows=True)
        f.r.call(self.functions.copy_following_modes, f.reals)

    def _iterate_stateful_modes(self, time: Real, iterations: IntegerVariable) -> None:
        """One iteration of the stateful modes, without an event."""
        f, r = self.frame, self.frame.r
        r.call(self.functions.store_signs, f.reals, r.constant_boolean(False))
        self._count_iteration_without_event(time, iterations)
        self.reset()
        self._restrict_mode_changes(iterations, follows=False)
        self.apply_reset()
        self._store_fired_signs()

    def _begin_reset(self, ranked: RankedEvents, rank: Integer) -> None:
        """Prepare the reset for events of this rank."""
        f, r = self.frame, self.frame.r
        r.call(ranked.store_signs, f.reals, rank)
        if ranked.hold_controls is not None:
            r.call(ranked.hold_controls, f.reals, rank)
            self.evaluation.solve(self.point.memory, self.x)

    def _recapture(self, rank: Integer | None) -> None:
        """Capture the present values that belong to hysteresis modes, before the reset of this iteration;
        with a ``rank``, only values up to this rank."""
        f, r, workspace = self.frame, self.frame.r, self.frame.workspace
        if not f.sizes.recaptured_states:
            return
        z, new_z, unknowns, ticking = (
            f.vector(place) for place in (workspace.z, workspace.new_z, workspace.trial_w, workspace.ticking)
        )
        for clock in range(len(f.sizes.clocks)):
            ticking[clock] = 0.0
        t = self.point.memory
        r.call(system_functions.update, t, self.x, z, unknowns, f.p, ticking, new_z)
        recaptured = r.integers("captured.again", f.sizes.recaptured_states)
        for i in r.each(len(f.sizes.recaptured_states)):
            value = new_z[recaptured[i]]
            if rank is not None:
                ranks = r.integers("captured.ranks", f.sizes.recaptured_ranks)
                value = select(ranks[i] > rank, z[recaptured[i]], value)
            z[recaptured[i]] = value

    def _store_previous_modes(self, rank: Integer | None = None) -> None:
        """Store the present values of hysteresis modes as their previous values.

        In a subsystem that is being enabled, the previous values are the values before the instant. With a
        ``rank``, only modes up to this rank are stored.
        """
        f, r = self.frame, self.frame.r
        z = f.vector(f.workspace.z)
        ranks = f.sizes.hysteresis_ranks or (0,) * len(f.sizes.hysteresis_modes)
        places = [(*entry, rank) for entry, rank in zip(f.sizes.hysteresis_modes, ranks)]
        always = [entry for entry in places if entry[2] < 0]
        gated = [entry for entry in places if entry[2] >= 0]
        for kind, entries in (("always", always), ("gated", gated)):
            if not entries:
                continue
            modes, before, working, of_rank = (
                r.integers(f"mode.{role}.{kind}", indices)
                for role, indices in zip(("remembering", "before", "working", "rank"), zip(*entries))
            )
            for i in r.each(len(entries)):
                value = z[modes[i]]
                if kind == "gated":
                    value = select(z[working[i]] != 0.0, value, z[before[i]])
                if rank is not None:
                    value = select(of_rank[i] > rank, z[before[i]], value)
                z[before[i]] = value

    def _end_instant(self) -> None:
        """Give disabled guards their present signs, and set the momentary values to 0."""
        f, r = self.frame, self.frame.r
        if self.functions.store_disabled_signs:
            r.call(self.functions.store_disabled_signs, f.reals)
        if f.sizes.momentary_states:
            z, momentary = f.vector(f.workspace.z), r.integers("momentary", f.sizes.momentary_states)
            for i in r.each(len(f.sizes.momentary_states)):
                z[momentary[i]] = 0.0

    def _count_iteration_without_event(self, time: Real, iterations: IntegerVariable) -> None:
        """Count an iteration without an event. After too many of them the inconsistent modes become
        undecided; if no further mode can, return from the loop."""
        f = self.frame
        self._count_events(time, iterations.value == 0, bounds=False)
        iterations.value = iterations.value + 1
        with f.r.unless(iterations.value < MAX_ITERATIONS_PER_MODE * self.modes):
            if self.undecided is None:
                f.leave(Status.INCONSISTENT_MODES)
            else:
                marked = f.r.call(self.undecided.mark, f.reals)
                f.leave_unless(marked != 0, Status.INCONSISTENT_MODES)
                iterations.value = 1

    def _restrict_mode_changes(self, iterations: IntegerVariable, *, follows: bool) -> None:
        """Keep the values of consistent modes. After many iterations only the first inconsistent mode
        changes."""
        f, r = self.frame, self.frame.r
        one_by_one = iterations.value > ITERATIONS_TOGETHER + self.modes
        r.call(self.functions.restrict_mode_changes, f.reals, r.constant_boolean(follows), one_by_one)

    def _store_fired_signs(self) -> None:
        """Store the signs after the reset of the guards that fired; other guards keep their stored signs."""
        f, r, t = self.frame, self.frame.r, self.point.memory
        self.evaluation.solve(t, self.x)
        self.functions.evaluate(r, t, self.x, f.reals, f.p)
        r.call(self.functions.store_signs, f.reals, r.constant_boolean(True))

    def _count_events(self, time: Real, first: Boolean, *, bounds: bool) -> None:
        """Count the events; return from the loop if they are endless. With ``bounds`` the next step is
        limited."""
        f = self.frame
        bound = f.r.call(self.functions.count_events, time, f.reals, f.counts, first)
        if bounds:
            f.scalar[Scalar.BOUND].value = bound
        # ``count_events`` returns a negative bound for endless events.
        f.leave_unless(bound >= 0.0, Status.ENDLESS_EVENTS)

    def end_run(self, time: Real) -> None:
        """If a guard that ends the run is positive, record this instant, unless it is recorded, and
        return."""
        f, r = self.frame, self.frame.r
        if not f.sizes.stops:
            return
        signs = [f.vector(f.workspace.signs)[k] for k in f.sizes.stops]
        positive: Boolean = signs[0] > 0.0
        for sign in signs[1:]:
            positive = positive | (sign > 0.0)
        with r.when(positive):
            number = f.count[Count.SAMPLE].value
            before = number - 1
            first = before < 0
            latest = f.arrays.samples[select(first, 0, before)]
            later = latest < time * SAME_BELOW
            with r.when((number < f.samples) & (first | later)):
                f.arrays.samples[number] = time
                row = f.arrays.out.after(number * f.n)
                copy(r, self.x, row, f.n)
                self.records.discrete_and_unknowns(time, number, row)
                f.increase(Count.SAMPLE)
            f.leave(Status.STOPPED)
