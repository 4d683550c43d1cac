"""Recording of a run: the samples within each step, and the checkpoint for a longer run."""

from __future__ import annotations

from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import Frame, copy
from armblocks.integration.method import Method
from armblocks.integration.workspace import Count, Stage
from armblocks.routines.arithmetic import select
from armblocks.routines.memory import Reals
from armblocks.routines.values import Boolean, Integer, Real


class Records:
    """Emits the recording of states, discrete variables and implicit unknowns."""

    def __init__(self, frame: Frame, method: Method, evaluation: Evaluation, point: Reals) -> None:
        self.frame = frame
        self.method = method
        self.evaluation = evaluation
        self.point = point
        self.extra_done = frame.r.integer(0)
        """Whether the extra stages of the step are evaluated."""

    def samples(self, time: Real, until: Real, h: Real | None) -> None:
        """Record all sample times up to ``until``: the state y at ``until``, interpolated states before it.

        If ``h`` is None there is no step, and all these sample times are recorded with the state x.
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
            self.others(instant, sample, row)
            f.increase(Count.SAMPLE)

    def others(self, instant: Real, sample: Integer, x: Reals) -> None:
        """Record ``z`` and ``w`` of a sample; ``w`` is solved for the recorded state ``x``."""
        f, places, sizes = self.frame, self.frame.places, self.frame.sizes
        if sizes.delays or sizes.algebraic:
            self.point[0] = instant
            self.evaluation.solve(self.point, x)
        for out, place, count in (
            (f.arrays.out_z, places.z, sizes.discrete),
            (f.arrays.out_w, places.trial_w, sizes.algebraic),
        ):
            if count:
                copy(f.r, f.vector(place), out.after(sample * count), count)

    def extra_stages_once(self, time: Real, h: Real) -> None:
        """Evaluate the extra stages of the dense output, unless this is already done for the present step."""
        if not self.method.has_extra_stages:
            return
        with self.frame.r.when(self.extra_done.value == 0):
            self.method.extra_stages(time, h)
            self.extra_done.value = 1

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
            f.keep()
            r.copy(f.reals, arrays.saved_reals, self._length())
            r.copy(f.counts, arrays.saved_counts, f.places.counts)
            fresh = f.count[Count.FRESH].value != 0
            stage = select(fresh, r.constant_integer(Stage.START), Stage.RUNNING)
            arrays.saved_counts[Count.STARTED] = stage
            f.count[Count.SAVED].value = 1

    def _length(self) -> Integer | int:
        """Length of the array of doubles including the stored rows of the delay history."""
        f, places = self.frame, self.frame.places
        if not f.sizes.delays:
            return places.size
        return f.counts[Count.HISTORY_ROWS] * places.history_width + places.history
