"""Recording of a run: samples within each step, both sides of each jump, the checkpoint for a longer run.

A jump has two rows: the left limit and the value. A row of the record has the time of the evaluation, the
number of samples recorded before it, ``x``, ``z`` and ``w``.
"""

from __future__ import annotations

from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import Frame, copy
from armblocks.integration.method import Method
from armblocks.integration.workspace import Count, LoopSizes, Stage, Status
from armblocks.routines.arithmetic import maximum, select
from armblocks.routines.memory import Reals
from armblocks.routines.values import Boolean, Integer, Real

JUMP_ROWS_OF_A_STEP = 4
"""Rows that must be free before a step: a step has one instant at its end."""


def row_width(sizes: LoopSizes) -> int:
    """Length of a row of the record of the jumps."""
    return 2 + sizes.states + sizes.discrete + sizes.algebraic


class Records:
    """Emits the recording of states, discrete variables and implicit unknowns."""

    def __init__(self, frame: Frame, method: Method, evaluation: Evaluation, point: Reals) -> None:
        self.frame = frame
        self.method = method
        self.evaluation = evaluation
        self.point = point
        self.extra_stages_done = frame.r.integer(0)
        """Whether the extra stages of the step are evaluated."""

    def samples(self, time: Real, until: Real, h: Real | None) -> None:
        """Record all sample times up to ``until``: the state y at ``until``, interpolated states before it.

        If ``h`` is None there is no step, and all these sample times are recorded with the state x. A sample
        time just before the instant ``time``, within rounding, is recorded with the values of the instant.
        """
        f, r, method = self.frame, self.frame.r, self.method
        with r.loop() as loop:
            sample = f.count[Count.SAMPLE].value
            loop.leave_unless(sample < f.samples)
            instant = f.arrays.samples[sample]
            loop.leave_unless(instant <= until)
            row = f.arrays.out.after(sample * f.n)
            if h is None:
                copy(r, method.x, row, f.n)
            else:
                with r.when(instant < until):
                    self.extra_stages_once(time, h)
                    method.interpolate(instant, time, h, row)
                with r.otherwise():
                    copy(r, method.y, row, f.n)
            self.discrete_and_unknowns(maximum(instant, time) if h is None else instant, sample, row)
            f.increase(Count.SAMPLE)

    def discrete_and_unknowns(self, instant: Real, sample: Integer, x: Reals) -> None:
        """Record ``z`` and ``w`` of a sample; ``w`` is solved for the recorded state ``x``."""
        f, workspace, sizes = self.frame, self.frame.workspace, self.frame.sizes
        if sizes.delays or sizes.algebraic:
            self.point[0] = instant
            self.evaluation.solve(self.point, x)
        for out, place, count in (
            (f.arrays.out_z, workspace.z, sizes.discrete),
            (f.arrays.out_w, workspace.trial_w, sizes.algebraic),
        ):
            if count:
                copy(f.r, f.vector(place), out.after(sample * count), count)

    def ensure_capacity(self) -> None:
        """Return from the loop if the record of the jumps has no memory for another step."""
        counts = self.frame.counts
        self.frame.leave_unless(counts[Count.JUMPS] < counts[Count.JUMPS_CAPACITY], Status.JUMPS_FULL)

    @property
    def jumps_recorded(self) -> Boolean:
        """Whether jumps are recorded."""
        return self.frame.counts[Count.JUMPS_RECORDED] != 0

    def record_side(self, time: Real, sample: Integer, x: Reals) -> None:
        """Record one side of a jump: ``x``, ``z``, and the latest solution ``w``. ``sample`` is the
        number of samples before this side."""
        f, workspace, sizes = self.frame, self.frame.workspace, self.frame.sizes
        number = f.counts[Count.JUMPS]
        row = f.arrays.jumps.after(number * row_width(sizes))
        f.counts[Count.JUMPS] = number + 1
        row[0], row[1] = time, sample.to_real()
        copy(f.r, x, row.after(2), f.n)
        if sizes.discrete:
            copy(f.r, f.vector(workspace.z), row.after(2 + f.n), sizes.discrete)
        if sizes.algebraic:
            copy(f.r, f.vector(workspace.trial_w), row.after(2 + f.n + sizes.discrete), sizes.algebraic)

    def extra_stages_once(self, time: Real, h: Real) -> None:
        """Evaluate the extra stages of the dense output, unless this is already done for the present step."""
        if not self.method.has_extra_stages:
            return
        with self.frame.r.when(self.extra_stages_done.value == 0):
            self.method.extra_stages(time, h)
            self.extra_stages_done.value = 1

    def checkpoint(self, condition: Boolean) -> None:
        """Save the state once, before the first step that the end of the run limits. A longer run continues
        here.

        Before the first step after a restart, the restart itself is saved, because the end of the run limits
        the choice of the first step's length. A step that would end at the end of the run without the limit
        counts as limited too, because a longer run records that time with this step.
        """
        f, r, arrays = self.frame, self.frame.r, self.frame.arrays
        unsaved = f.count[Count.SAVED].value == 0
        with r.when(condition & unsaved):
            f.store_variables()
            r.copy(f.reals, arrays.saved_reals, self._length())
            r.copy(f.counts, arrays.saved_counts, f.workspace.counts)
            after_restart = f.count[Count.RESTARTED].value != 0
            stage = select(after_restart, r.constant_integer(Stage.START), Stage.RUNNING)
            arrays.saved_counts[Count.STAGE] = stage
            f.count[Count.SAVED].value = 1

    def _length(self) -> Integer | int:
        """Length of the array of doubles including the stored rows of the delay history."""
        f, workspace = self.frame, self.frame.workspace
        if not f.sizes.delays:
            return workspace.size
        return f.counts[Count.HISTORY_ROWS] * workspace.history_width + workspace.history
