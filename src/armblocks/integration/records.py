"""Records of a run: the sample instants that a step passes, and the checkpoint for a longer run."""

from __future__ import annotations

from armblocks.integration.evaluation import Evaluation
from armblocks.integration.frame import Frame, copy
from armblocks.integration.method import Method
from armblocks.integration.workspace import Count, Stage
from armblocks.routines.arithmetic import select
from armblocks.routines.memory import Reals
from armblocks.routines.values import Boolean, Integer, Real


class Records:
    """Writes the recording of states, and of discrete variables and unknowns where there are any."""

    def __init__(self, frame: Frame, method: Method, evaluation: Evaluation, point: Reals) -> None:
        self.frame = frame
        self.method = method
        self.evaluation = evaluation
        self.point = point
        self.extra_done = frame.r.integer(0)
        """Whether the extra stages of the step are evaluated."""

    def samples(self, time: Real, until: Real, h: Real | None) -> None:
        """Record every sample instant not after ``until``: the state itself there, interpolated before.

        Without a step ``h`` there is no before, and the state is x.
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
        """What else than the state a sample instant records: ``z``, and ``w`` for the state just written."""
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
        """The stages that only the dense output needs, where a step needs them for the first time."""
        if not self.method.has_extra_stages:
            return
        with self.frame.r.when(self.extra_done.value == 0):
            self.method.extra_stages(time, h)
            self.extra_done.value = 1

    def checkpoint(self, condition: Boolean) -> None:
        """Save the state, once, before the end of the run first bounds a step: a longer run goes on here.

        The first step after a start is saved as the start, because the end bounds the choice of its length. A
        step that ends at the instant of the run's end counts as bounded: a longer run records that instant
        with this step.
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
        """Length of the array of doubles, with the history of delayed signals as far as it is kept."""
        f, places = self.frame, self.frame.places
        if not f.sizes.delays:
            return places.size
        return f.counts[Count.HISTORY_ROWS] * places.history_width + places.history
