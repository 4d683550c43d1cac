"""Step control: adaptive steps from the error estimate, fixed steps on a grid, detection of minimum steps.

Adaptive step control as in SciPy's ``RK45`` (Hairer, Norsett, Wanner I, II.4): root-mean-square norm of
the error over ``atol + rtol max(|x|, |x_new|)``, safety factor 0.9, step factors 0.2 to 10, no growth right
after a rejection, the same choice of the first step. Step counts are therefore comparable with SciPy's.
"""

from __future__ import annotations

from armblocks.integration.butcher_tableau import Row
from armblocks.integration.frame import SAME_ABOVE, Frame
from armblocks.integration.method import Method
from armblocks.integration.records import Records
from armblocks.integration.schedule import Schedule
from armblocks.integration.workspace import Count, Scalar, Status
from armblocks.routines.arithmetic import fma, inverse_root, maximum, minimum, select
from armblocks.routines.routine import Routine
from armblocks.routines.values import Real

SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0
"""Safety factor of the step length, and the minimum and the maximum ratio of consecutive step lengths."""
SHORT_CHECK_INTERVAL, SHORT_DECREASE = 64, 8
"""Number of steps between two checks for needlessly short steps (a power of two), and the decrease of their
count at a check without a short step."""
SHORT_CHANGE, RESOLVED = 1000.0, 4.0
"""A step is needlessly short if ``h |f(end) - f(start)|``, in units of the tolerance, is below the smaller of
``SHORT_CHANGE`` and ``RESOLVED * rtol^(2/(q + 1) - 1)``; q is the order of the error estimate. A step across
a jump of ``f`` is accepted once this change is below 1 over the smallest weight of the error, some hundreds.
For a smooth solution of rate L the change is ``(h L)^2 / rtol``, and the error estimate makes ``(h L)^2``
about 10 to 50 times ``rtol^(2/(q + 1))``, which is more than ``RESOLVED``."""
MAX_FURTHER_STEPS = 1e8
"""Maximum number of further steps that a run with needlessly short steps may need; above it, the run ends."""


class Steps:
    """Emits one accepted step of the loop: trials until the error is small enough, or one fixed step."""

    def __init__(self, frame: Frame, method: Method, records: Records, schedule: Schedule) -> None:
        self.frame = frame
        self.method = method
        self.records = records
        self.schedule = schedule

    def write(self) -> None:
        """Emit the step up to its acceptance."""
        error = self.method.tableau.error_row
        if error is not None:
            self._adaptive(error)
        else:
            self._fixed()

    def trial(self, time: Real, new_time: Real) -> Real:
        """Emit the stages of a step to ``new_time``; return its length."""
        f = self.frame
        if f.sizes.hybrid:
            self.records.extra_stages_done.value = 0
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
                # 1e-30 replaces an exact zero. The step factor reaches its upper bound far above this norm.
                bounded = minimum(maximum(norm, 1e-30), 1e30)
                ideal = SAFETY * inverse_root(bounded, method.tableau.error_order + 1)
                # An infinite new state makes the tolerance infinite and the norm zero, so it is checked
                # separately.
                accepted.leave_when((norm < 1.0) & method.sums.all_finite(method.y))
                f.increase(Count.REJECTED)
                growth.value = 1.0
                # A NaN norm compares false, so the step is reduced by SHRINK; likewise for an infinite new
                # state.
                measured = norm >= 1.0
                shrunk = h * select(measured, maximum(ideal, SHRINK), SHRINK)
                length.value = shrunk
                attempt.again_unless(shrunk < shortest)
            finite = norm * 0.0 == 0.0
            self.schedule.handle_non_finite(time, finite, accepted)
            f.leave(Status.STEP_TOO_SMALL)
        method.check_stiffness(h)
        self._check_short_steps(h)
        following = self.schedule.next_step_length(h * minimum(ideal, growth.value))
        f.scalar[Scalar.STEP].value = following

    def _check_short_steps(self, h: Real) -> None:
        """Check at intervals whether the step is needlessly short; end the run if most steps are.

        If the equations jump without an event, for example a sign in a feedback loop, every method shrinks
        its steps until the jump is within the tolerance. Stability has the same effect on the steps of an
        explicit method. Steps that are limited by the end of a piece or by ``max_step`` are not checked.
        """
        f, r, method = self.frame, self.frame.r, self.method
        tableau, short = method.tableau, f.count[Count.SHORT_STEPS]
        with r.when(f.count[Count.ACCEPTED].value & (SHORT_CHECK_INTERVAL - 1) == 0):
            new_time = f.new_time.value
            with r.when((new_time < f.end.value) & (h < f.max_step)):
                power = resolved_change(r, f.reals[Scalar.RTOL], tableau.error_order)
                with r.when(method.derivative_change(h) < minimum(r.constant(SHORT_CHANGE), power)):
                    short.value = short.value + 1
                    far = f.last_end - new_time > MAX_FURTHER_STEPS * h
                    long = short.value >= method.short_checks
                    with r.when(far & long):
                        f.leave(Status.MINIMUM_STEP)
                with r.otherwise():
                    less = short.value - SHORT_DECREASE
                    short.value = select(less > 0, less, 0)

    def _fixed(self) -> None:
        """Emit one step to the next grid point ``k STEP`` (never accumulated), or to the end of the piece."""
        f, r, schedule = self.frame, self.frame.r, self.schedule
        grid = f.count[Count.GRID]
        time, spacing, end = f.time.value, f.scalar[Scalar.STEP].value, f.end.value
        with r.part() as search:
            instant = grid.value.to_real() * spacing
            with r.when(instant <= schedule.passed_until(time, spacing)):
                f.increase(Count.GRID)
                search.again()
        # A grid point within rounding before the end is the end. Otherwise a step of 1e-16 s would follow.
        last = fma(spacing, 1e-9, instant) >= end
        new_time = schedule.fixed_step_end(time, select(last, end, instant))
        self.records.checkpoint(new_time * SAME_ABOVE >= f.last_end)
        self.method.prepare(time)
        schedule.take_fixed_step(self.trial, time, new_time)


def resolved_change(r: Routine, rtol: Real, order: int) -> Real:
    """``RESOLVED rtol^(2/(q + 1) - 1)`` for an error estimate of order q."""
    # rtol^(-1/(q+1)) to the power q - 1
    root = inverse_root(rtol, order + 1)
    power = r.constant(RESOLVED)
    for _ in range(order - 1):
        power = power * root
    return power
