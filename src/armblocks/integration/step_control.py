"""Control of the step: adaptive steps by their error, fixed steps on a grid, and runs of minimum steps.

Step control is that of SciPy's ``RK45`` (Hairer, Norsett, Wanner I, II.4): root-mean-square norm of the error
over ``atol + rtol max(|x|, |x_new|)``, safety 0.9, factors 0.2 to 10, no growth right after a rejection, the
same choice of the first step. Step counts can therefore be laid beside SciPy's.
"""

from __future__ import annotations

from armblocks.integration.butcher_tableau import Row
from armblocks.integration.course import Course
from armblocks.integration.frame import SAME_ABOVE, Frame
from armblocks.integration.method import Method
from armblocks.integration.records import Records
from armblocks.integration.workspace import Count, Scalar, Status
from armblocks.routines.arithmetic import fma, inverse_root, maximum, minimum, select
from armblocks.routines.values import Real

SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0
SHORT_EVERY, SHORT_BACK = 64, 8
"""Steps between two checks (a power of two), and how many checks each takes back that finds nothing wrong."""
SHORT_CHANGE, RESOLVED = 1000.0, 4.0
"""What a step that is short for good reason changes at least, in tolerances: ``h |f(end) - f(start)|``. A
jump of ``f`` passes where it is below 1 over the least weight of the error, some hundreds; a smooth solution
of rate L changes by ``(h L)^2 / rtol``, where the error makes ``(h L)^2`` about 10 to 50 times
``rtol^(2/(q + 1))`` for a method whose error is of order q; ``RESOLVED`` is less."""
MOST_STEPS = 1e8
"""A run of minimum steps is ended where it has more steps than these before it."""


class Steps:
    """Writes one accepted step of the loop: trials until the error is small enough, or one fixed step."""

    def __init__(self, frame: Frame, method: Method, records: Records, course: Course) -> None:
        self.frame = frame
        self.method = method
        self.records = records
        self.course = course

    def write(self) -> None:
        """The step, up to the place where it is accepted."""
        error = self.method.tableau.error_row
        if error is not None:
            self._adaptive(error)
        else:
            self._fixed()

    def trial(self, time: Real, new_time: Real) -> Real:
        """Stages of a step to ``new_time``; gives its length."""
        f = self.frame
        if f.sizes.hybrid:
            self.records.extra_done.value = 0
        h = new_time - time
        f.new_time.value = new_time
        f.h.value = h
        f.scalar[Scalar.TRIED].value = h
        self.method.stages(time, h, new_time)
        return h

    def _adaptive(self, error: Row) -> None:
        """Try steps until the error is small enough."""
        f, r, method = self.frame, self.frame.r, self.method
        length = f.scalar[Scalar.STEP]
        time = f.time.value
        following = (time.bits() + 1).from_bits()
        shortest = 10.0 * (following - time)
        length.value = minimum(maximum(length.value, shortest), f.max_step)
        new_time = minimum(time + length.value, f.end.value)
        self.records.checkpoint(new_time * SAME_ABOVE >= f.last_end)
        method.prepare(time)
        growth = r.real(GROW)
        with r.part() as accepted:
            with r.part() as attempt:
                h = self.trial(time, minimum(time + length.value, f.end.value))
                norm = method.error_norm(h, error)
                # 1e-30 stands for an exact zero: the factor is at its upper bound long before.
                bounded = minimum(maximum(norm, 1e-30), 1e30)
                ideal = SAFETY * inverse_root(bounded, method.tableau.error_order + 1)
                # An infinite new state makes its own error vanish beside it, so it is checked apart.
                accepted.leave_when((norm < 1.0) & method.all_finite(method.y))
                f.increase(Count.REJECTED)
                growth.value = 1.0
                # A NaN compares false and takes the strongest reduction; so does an infinite new state.
                measured = norm >= 1.0
                shrunk = h * select(measured, maximum(ideal, SHRINK), SHRINK)
                length.value = shrunk
                attempt.again_unless(shrunk < shortest)
            finite = norm * 0.0 == 0.0
            self.course.not_finite(time, finite, accepted)
            f.leave(Status.STEP_TOO_SMALL)
        method.watch(h)
        self._watch_short_steps(h)
        following = self.course.next_length(h * minimum(ideal, growth.value))
        f.scalar[Scalar.STEP].value = following

    def _watch_short_steps(self, h: Real) -> None:
        """Now and then, check whether steps stay short though next to nothing changes; end such a run.

        Where equations jump without an event, such as a sign that answers itself, steps shrink until the jump
        is within the tolerance, however good the method is. The same is seen where stability holds an
        explicit method short. Steps that an end or ``max_step`` cuts say nothing.
        """
        f, r, method = self.frame, self.frame.r, self.method
        tableau, short = method.tableau, f.count[Count.SHORT]
        with r.when(f.count[Count.ACCEPTED].value & (SHORT_EVERY - 1) == 0):
            new_time = f.new_time.value
            with r.when((new_time < f.end.value) & (h < f.max_step)):
                # rtol^(2/(q+1) - 1), that is rtol^(-1/(q+1)) to the power q - 1
                root = inverse_root(f.reals[Scalar.RTOL], tableau.error_order + 1)
                power = r.constant(RESOLVED)
                for _ in range(tableau.error_order - 1):
                    power = power * root
                with r.when(method.change(h) < minimum(r.constant(SHORT_CHANGE), power)):
                    short.value = short.value + 1
                    far = f.last_end - new_time > MOST_STEPS * h
                    long = short.value >= method.short_checks
                    with r.when(far & long):
                        f.leave(Status.MINIMUM_STEP)
                with r.otherwise():
                    less = short.value - SHORT_BACK
                    short.value = select(less > 0, less, 0)

    def _fixed(self) -> None:
        """One step to the next grid instant, which is ``k STEP`` and never a sum, or to the segment's end."""
        f, r, course = self.frame, self.frame.r, self.course
        grid = f.count[Count.GRID]
        time, spacing, end = f.time.value, f.scalar[Scalar.STEP].value, f.end.value
        with r.part() as search:
            instant = grid.value.to_real() * spacing
            with r.when(instant <= course.passed(time, spacing)):
                f.increase(Count.GRID)
                search.again()
        # An instant a rounding error before the end is the end: no step of 1e-16 s.
        last = fma(spacing, 1e-9, instant) >= end
        new_time = course.bounded(time, select(last, end, instant))
        self.records.checkpoint(new_time * SAME_ABOVE >= f.last_end)
        self.method.prepare(time)
        course.try_finite(self.trial, time, new_time)
