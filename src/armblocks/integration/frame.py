"""The shared frame of a native loop: arrays of the run, variables in registers, return paths."""

from __future__ import annotations

from dataclasses import dataclass

from armblocks.integration.workspace import Count, LoopSizes, Scalar, Status, Workspace
from armblocks.routines.arithmetic import minimum, select
from armblocks.routines.memory import Integers, Reals, RealVariable
from armblocks.routines.routine import Part, Routine
from armblocks.routines.values import Boolean, Integer, Real

SAME_ABOVE, SAME_BELOW = 1.0 + 2.0**-50, 1.0 - 2.0**-50
"""Two times are the same instant if their ratio is between these factors."""

REALS = (Scalar.TIME, Scalar.STEP, Scalar.TRIED)
COUNTS = (
    Count.SAMPLE,
    Count.SEGMENT,
    Count.STAGE,
    Count.GRID,
    Count.ACCEPTED,
    Count.REJECTED,
    Count.EVALUATIONS,
    Count.RESTARTED,
    Count.SAVED,
    Count.STIFFNESS_STEPS,
    Count.STIFF,
    Count.NON_STIFF,
    Count.SHORT_STEPS,
)
"""The entries of the arrays of doubles and of integers that are variables during a call of the loop."""


@dataclass(frozen=True, kw_only=True)
class Arrays:
    """The arguments of the native loop.

    ``reals`` and ``counts`` hold the state of the run, ``p`` the parameters. ``samples`` are the instants to
    record and ``out`` their states, ``(N, n)``; ``out_z``, ``out_w`` are likewise the discrete variables and
    the unknowns. ``jumps`` are both sides of the instants, see :class:`Records`. ``ends`` are the ends of the
    segments between breakpoints and ``clamps`` the latest time at which each segment may evaluate its
    derivative. ``saved_reals`` and ``saved_counts`` receive the state from which a run with a later end would
    continue. ``scratch`` is the memory for the linear equations of a step. The loop returns after at most
    ``max_steps`` accepted steps.
    """

    reals: Reals
    counts: Integers
    p: Reals
    samples: Reals
    ends: Reals
    clamps: Reals
    out: Reals
    out_z: Reals
    out_w: Reals
    jumps: Reals
    saved_reals: Reals
    saved_counts: Integers
    scratch: Reals
    max_steps: Integer


class Frame:
    """The routine of a loop with its arrays and its variables.

    Scalars that change in every step are variables during a call of the loop. Between calls the arrays hold
    them: :meth:`store_variables` writes them there.
    """

    def __init__(self, r: Routine, arrays: Arrays, workspace: Workspace, sizes: LoopSizes) -> None:
        self.r = r
        self.arrays = arrays
        self.workspace = workspace
        self.sizes = sizes
        self.n = sizes.states
        reals, counts = arrays.reals, arrays.counts
        self.reals = reals
        self.counts = counts
        self.p = arrays.p
        scalars = (*REALS, Scalar.BOUND) if sizes.hybrid else REALS
        counters = (*COUNTS, Count.INSTANTS) if sizes.hybrid else COUNTS
        self.scalar = {place: r.real(reals[place]) for place in scalars}
        self.count = {place: r.integer(counts[place]) for place in counters}
        self.max_step = reals[Scalar.MAX_STEP]
        self.pause = reals[Scalar.PAUSE]
        self.samples = counts[Count.SAMPLES]
        self.segments = counts[Count.SEGMENTS]
        segment = self.count[Count.SEGMENT].value
        self.end = r.real(arrays.ends[segment])
        """The end of the present piece: the time of the next tick, event or breakpoint."""
        self.clamp = r.real(arrays.clamps[segment])
        """The latest time at which the derivative may be evaluated in this piece."""
        self.last_end = arrays.ends[self.segments - 1]
        self.steps_of_call = r.integer(0)
        """Steps accepted in this call."""
        self.status = r.integer(Status.DONE)
        self.h = r.real(0.0)
        """Length of the current trial step."""
        self.new_time = r.real(0.0)
        """Time at the end of the trial step."""
        self.body: Part | None = None
        """The part that contains the whole loop: leaving it returns the status."""

    @property
    def time(self) -> RealVariable:
        """Time that the last accepted step reached."""
        return self.scalar[Scalar.TIME]

    def just_before(self, time: Real) -> Real:
        """The time of the left limits of an instant: the last double before it. Several breakpoints at one
        instant may have different times; the left limits are then those before the earliest."""
        before = select(time > 0.0, (time.bits() - 1).from_bits(), time)
        segment = self.count[Count.SEGMENT].value
        ended = select(segment > 0, segment - 1, self.r.constant_integer(0))
        at_breakpoint = (segment > 0) & (self.arrays.ends[ended] == time)
        return select(at_breakpoint, minimum(before, self.arrays.clamps[ended]), before)

    def vector(self, place: int) -> Reals:
        """A vector of the workspace."""
        return self.reals.after(place)

    def copy(self, source: int, target: int, count: int) -> None:
        """Copy a vector of the workspace."""
        copy(self.r, self.vector(source), self.vector(target), count)

    def increase(self, place: Count) -> None:
        """Increment a counter."""
        counter = self.count[place]
        counter.value = counter.value + 1

    def leave(self, status: Status) -> None:
        """Return from the loop."""
        assert self.body is not None
        self.status.value = status
        self.body.leave()

    def leave_unless(self, condition: Boolean, status: Status) -> None:
        """Return from the loop if the condition fails."""
        with self.r.unless(condition):
            self.leave(status)

    def store_variables(self) -> None:
        """Write the variables to the arrays."""
        for place, variable in self.scalar.items():
            self.reals[place] = variable.value
        for place, counter in self.count.items():
            self.counts[place] = counter.value


def copy(r: Routine, source: Reals, target: Reals, count: int) -> None:
    """Copy ``count`` values."""
    for i in r.each(count):
        target[i] = source[i]
