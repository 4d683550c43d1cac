"""Sensitivities at instants whose times may depend on parameters.

Let signals jump at an instant ``s`` that depends on a parameter, with ``s_p = ds/dp``. The derivative of
``x(s(p); p)``, called the derivative along the instant, is ``S* = S + x' s_p``. Every jump at the instant
transforms ``S*`` by its total derivative, and there may be several jumps::

    S* = S- + f- s_p,    S* := R_x S* + R_z Z* + R_w W* + R_p + R_t s_p (each jump),    S+ = S* - f+ s_p

For a single jump this is the saltation matrix of Hiskens and Pai, IEEE Trans. Circuits and Systems I 47,
2000, 204-220. Likewise ``Z* = Z + z' s_p``, where z' is 0 except for left limits and delayed values.

``s_p`` is 0 at ticks. At a zero of a guard it is ``-g_p / g'``. For a source that jumps at a known time it is
the derivative of this time. For the arrival of a delayed jump see
:mod:`armblocks.equations.sensitivity_delays`. A guard that fires because of one of these jumps belongs to the
same instant. If instants with different derivatives coincide, the instant of this guard is unknown. ``mixed``
then stores the time and one of the guards. ``tie`` stores them for a guard that is 0 after an instant, see
:mod:`armblocks.equations.sensitivity_ties`. ``limit of block`` stores the time of an instant after which a
held signal of a block is at a limit, see :mod:`armblocks.equations.held_limits`. ``sampled`` stores the time
and the number of a discrete variable that has sampled a signal at a limit, see
:mod:`armblocks.equations.sampled_limits`.

Each jump at an instant is a call of ``reset``. The first call replaces S by S*. An added guard fires after
all other guards; its call replaces S* by S. There are two such guards, which alternate, because a guard that
has just fired cannot fire again at once.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import cached_property
from itertools import accumulate

from casadi import (
    SX,
    Function,
    densify,
    dot,
    fabs,
    fmax,
    fmin,
    if_else,
    is_equal,
    jtimes,
    logic_and,
    logic_not,
    logic_or,
    sign,
    vertcat,
    vertsplit,
)

from armblocks.equations.hybrid_system import EventRanks
from armblocks.equations.sampled_limits import Sampling
from armblocks.equations.sensitivity_delays import DelayedSensitivities
from armblocks.equations.sensitivity_layout import Columns, any_marked, limit_name
from armblocks.equations.sensitivity_ties import AT_ZERO, MOVES, Ties
from armblocks.equations.side_differences import combined, without_derivative

LOCATION_TOLERANCE = 1e-8
"""A guard whose zero is within this relative time counts as located; otherwise it has jumped."""
SAME_INSTANT = 2.0**-48
"""Relative tolerance of equal times."""
SAME_DERIVATIVE = 1e-6
"""Relative tolerance of equal time derivatives of events."""
JUST_BEFORE = 1.0 - 2.0**-49
"""Factor from a time to a time just before it, and before all breakpoints of the same instant."""
NEVER = -1.0
"""The time of an event that has not occurred, s."""


class Instants:
    """Changes of sensitivities at instants: ``update``, ``reset`` and guards of the whole system.

    ``limits``: the distances of held signals from their limits by block, functions of ``t, x, z, w, p``.
    """

    def __init__(
        self, columns: Columns, delays: DelayedSensitivities, limits: Mapping[str, Function]
    ) -> None:
        self.columns = columns
        self.delays = delays
        self.limits = limits
        c, system = columns, columns.system
        self.guards = len(system.guard_directions)
        self.time = c.add("instant", 1, NEVER)
        """The time of the present or latest instant, s."""
        self.known, self.open = c.add("known", 1), c.add("open", 1)
        """Whether ``s_p`` of the instant is known, and whether S is S*, the derivative along the instant."""
        self.arms = c.add("arms", 2, 1.0)
        """The values of the two added guards that end an instant; a change of sign makes a guard fire."""
        self.mixed, self.ticked = c.add("mixed", 2, [NEVER, 0.0]), c.add("ticked", 1)
        self.tie, self.latest_tie = c.add("tie", 2, [NEVER, 0.0]), c.add("latest tie", 2, [NEVER, 0.0])
        """The first and the latest instant with a guard that is 0 after it: the time and this guard."""
        self.sampling = Sampling(system) if system.clocks else None
        self.sampled = c.add("sampled", 2, [NEVER, 0.0])
        """The first instant at which a signal at a limit is sampled: the time and the discrete variable."""
        self.limit_times = {block: c.add(limit_name(block), 1, NEVER) for block in limits}
        self.located = c.add("located", self.guards)
        self.instant_p = [c.add(f"instant by {name}", 1) for name in c.names]
        self.flow = c.value(system.derivative)
        delays.set_flow(self.flow)
        captured = c.value(system.update, SX.zeros(len(system.clocks)))
        self.captured = captured
        self.left_limits = [i for i in range(c.z.numel()) if not is_equal(captured[i], c.z[i], 1)]
        self.left_limit_rates = c.add("rate of left limits", len(self.left_limits))
        self.g = c.value(system.guards)
        self.g_rate = self.over_time(self.g)
        self.times, self.moving_breakpoints = self._breakpoints()
        self.ties = Ties(columns, delays, self.g, self.g_rate) if self.guards else None

    def _breakpoints(self) -> tuple[SX, list[int]]:
        """The breakpoints, and the indices of breakpoints that depend on the parameters."""
        c = self.columns
        (p,) = c.system.breakpoints.arguments
        times = vertcat(*c.system.breakpoints.results, SX(0, 1))
        (times,) = Function("f", [p], [times]).call([c.p], True, False)
        of_times = [jtimes(times, c.p, seed) for seed in c.seeds] if times.numel() else []
        moving = [k for k in range(times.numel()) if any(not rates[k].is_zero() for rates in of_times)]
        return times, moving

    def source(self, index: int) -> str:
        """The block with a parameter on which the breakpoint with this index depends."""
        c = self.columns
        names = zip(c.names, c.seeds)
        movers = [name for name, seed in names if not jtimes(self.times, c.p, seed)[index].is_zero()]
        return movers[0].rpartition(".")[0]

    def over_time(self, expression: SX) -> SX:
        """The time derivative along the flow."""
        c = self.columns
        return c.derivative_along(
            expression, t=1.0, x=self.flow, z=self.delays.rate_along, w=c.V, p=SX.zeros(c.p.numel())
        )

    def by_parameter(self, expression: SX, k: int) -> SX:
        """The total derivative with respect to parameter ``k`` with the present sensitivities."""
        c = self.columns
        return c.derivative_along(expression, t=0.0, x=c.S[k], z=self.delays.Z[k], w=c.W[k], p=c.seeds[k])

    # Added guards.

    def all_guards(self) -> SX:
        c = self.columns
        at_instant = fabs(c.t - self.time) <= SAME_INSTANT * c.t
        return vertcat(
            self.g,
            self.arms,
            *(c.t - self.times[k] + 1e-300 for k in self.moving_breakpoints),
            *self.delays.guards(at_instant),
            1.0,
        )

    def directions(self) -> tuple[int, ...]:
        """The directions of the added guards.

        The last guard never fires. The loop marks it where a call changes following modes only.
        """
        return 0, 0, *[1] * (len(self.moving_breakpoints) + 2 * self.delays.n), 0

    def ranks(self, own: EventRanks) -> EventRanks:
        """The ranks of all guards. Guards of sources and of arriving delayed jumps come first, with a
        negative rank, because they change only derivatives. Guards of delay inputs that jumped come after the
        guards of the system, and guards that end an instant come last."""
        n, last = self.delays.n, max(own.guards)
        added = (last + 2, last + 2, *[-1] * (len(self.moving_breakpoints) + n), *[last + 1] * n, last + 2)
        return dataclasses.replace(
            own,
            guards=(*own.guards, *added),
            recaptured_states=own.recaptured_states * (len(self.columns.names) + 1),
        )

    # Just before an instant.

    def update(self, m: SX) -> SX:
        """``update`` of the augmented system: at ticks, whose times are fixed, and just before an instant."""
        c = self.columns
        begins = dot(m, m) == 0.0 if m.numel() else SX(1.0)
        updated = c.value(c.system.update, m)
        Z = [self._captured_by(updated, k) for k in range(len(c.names))]
        left_values = {
            "instant": c.t,
            "known": SX(0.0),
            "open": SX(0.0),
            "ticked": SX(0.0),
            "located": self._located(),
            "rate of left limits": vertcat(
                *(self.over_time(self.captured)[k] for k in self.left_limits), SX(0, 1)
            ),
            **{f"instant by {name}": SX(0.0) for name in c.names},
            **self.delays.begin(),
        }
        added = {
            **c.added,
            **{name: if_else(begins, new, c.added[name]) for name, new in left_values.items()},
        }
        added["ticked"] = if_else(begins, 0.0, 1.0)
        # Events that come before the ticks of the same instant; the time of the ticks is fixed.
        moved = logic_and(self.open, any_marked(vertcat(*self.instant_p)))
        number = SX(1.0)
        for k in range(self.guards):
            number = if_else(self.located[k], float(k + 1), number)
        mixes = logic_and(logic_and(logic_not(begins), moved), self.mixed[0] < 0.0)
        added["mixed"] = if_else(mixes, vertcat(c.t, number), self.mixed)
        tie = if_else(self.latest_tie[0] < 0.0, self._resting_tie(), self.latest_tie)
        added["tie"] = if_else(logic_and(begins, self.tie[0] < 0.0), tie, self.tie)
        added["latest tie"] = if_else(begins, SX([NEVER, 0.0]), self.latest_tie)
        if self.sampling is not None:
            along = [self._present_along(k) for k in range(len(c.names))]
            row = self.sampling.first(updated, Z, m, along, self._events_now())
            found = logic_and(logic_and(logic_not(begins), row > 0.0), self.sampled[0] < 0.0)
            added["sampled"] = if_else(found, vertcat(c.t, row), self.sampled)
        for block, time in self.limit_times.items():
            stays = logic_and(logic_and(begins, time < 0.0), self._stays_at_limit(block))
            added[limit_name(block)] = if_else(stays, fmax(self.time, 0.0), time)
        return vertcat(updated, *Z, *added.values())

    def _stays_at_limit(self, block: str) -> SX:
        """Whether a held signal of a block has been at a limit since the last instant."""
        c = self.columns
        at = [c.t * JUST_BEFORE, c.x, c.z, c.w, c.p]
        limits, equalities = self.limits[block].call(at, True, False)
        stays = self._moved_zero(limits)
        if equalities.numel():
            stays = logic_or(stays, logic_and(self._moved_zero(equalities), self._sides_differ))
        return logic_and(self._lasts, stays)

    def _moved_zero(self, distances: SX) -> SX:
        """Whether a distance is 0 and depends on a parameter."""
        moves = SX.zeros(distances.numel())
        for k in range(len(self.columns.names)):
            moves = logic_or(moves, fabs(self.by_parameter(distances, k)) > MOVES)
        return any_marked(logic_and(fabs(distances) <= AT_ZERO, moves))

    @cached_property
    def _sides_differ(self) -> SX:
        """Whether a signal or the flow has no derivative just before the present time."""
        c = self.columns
        at = [c.t * JUST_BEFORE, c.x, c.z, c.w, c.p]
        direction = [combined([self._present_along(k)[j] for k in range(len(c.names))]) for j in range(5)]

        def values(*point: SX) -> SX:
            parts = (c.system.signals, c.system.derivative)
            functions = [Function("f", list(part.arguments), list(part.results)) for part in parts]
            return densify(vertcat(*(f.call(list(point), True, False)[0] for f in functions)))

        present = values(*at)
        rate = combined([self.by_parameter(present, k) for k in range(len(c.names))])

        def change(step: float) -> SX:
            return values(*(value + step * part for value, part in zip(at, direction))) - present

        return any_marked(without_derivative(change, rate, fabs(present)))

    def _resting_tie(self) -> SX:
        """The time of the last instant and the number of a guard that has been 0 since then, or never."""
        c = self.columns
        if self.ties is None:
            return SX([NEVER, 0.0])
        x, z = [c.x, *c.S], [c.z, *self.delays.Z]
        number = self.ties.first(x, z, [SX(0.0)] * len(c.names), SX(0.0), t=c.t * JUST_BEFORE, stays=True)
        tied = logic_and(self._lasts, number > 0.0)
        return if_else(tied, vertcat(fmax(self.time, 0.0), number), SX([NEVER, 0.0]))

    @property
    def _lasts(self) -> SX:
        """Whether there is time between the last instant and the present one."""
        return self.columns.t * JUST_BEFORE > self.time

    def _located(self) -> SX:
        """Whether each guard passes zero now."""
        is_near = fabs(self.g) <= LOCATION_TOLERANCE * fabs(self.g_rate) * fmax(1.0, self.columns.t)
        return logic_and(is_near, logic_and(self.g_rate != 0.0, self.columns.t > 0.0))

    def _events_now(self) -> SX:
        """The events of guards that pass zero now and whose times depend on a parameter."""
        moves = SX.zeros(self.guards)
        for k in range(len(self.columns.names)):
            moves = logic_or(moves, fabs(self.by_parameter(self.g, k)) > MOVES * fabs(self.g_rate))
        direction = sign(self.g_rate)
        fires = SX(self.columns.system.guard_directions) * direction >= 0.0
        return if_else(logic_and(logic_and(self._located(), moves), fires), direction, 0.0)

    def _captured_by(self, updated: SX, k: int) -> SX:
        """The derivative of an update with respect to parameter ``k``."""
        t, x, z, w, p = self._present_along(k)
        return self.columns.derivative_along(updated, t=t, x=x, z=z, w=w, p=p)

    def _present_along(self, k: int) -> tuple[SX, SX, SX, SX, SX]:
        """The derivatives of ``t, x, z, w, p`` with respect to parameter ``k``; between the events of an
        instant, along the instant."""
        c, instant = self.columns, self.open * self.instant_p[k]
        z = self.delays.Z[k] + self.delays.rate_along * instant
        return instant, c.S[k], z, c.W[k], c.seeds[k]

    # At an instant.

    def reset(self, e: SX) -> tuple[SX, SX]:
        """All states and discrete variables after the events ``e``, including events of the added guards."""
        c, d, names = self.columns, self.delays, self.columns.names
        counts = [self.guards, 2, len(self.moving_breakpoints), d.n, d.n, 1]
        own, arms, sources, arrived, jumped, follows = vertsplit(e, [0, *accumulate(counts)])
        fired, no_event = any_marked(own), logic_not(any_marked(e[:-1]))
        others = logic_or(any_marked(vertcat(own, sources, arrived, jumped)), no_event)
        first = logic_not(self.known)
        instants, mixed = self._instants(own, no_event, sources, arrived)
        leaves = logic_and(self.open, logic_not(others))
        enters = logic_and(logic_not(self.open), any_marked(vertcat(*instants)))

        # The derivatives before or after the instant.
        left_side = logic_and(first, any_marked(sources))
        t = if_else(left_side, c.t * JUST_BEFORE, c.t)
        flow = c.value_at(c.system.derivative, t, c.x, d.before_arrival(arrived), c.w)
        along = [_times(flow, if_else(leaves, -1.0, enters) * instant) for instant in instants]
        S = [known + step for known, step in zip(c.S, along)]
        Z = [self._with_left_limits(c.Z[k], first, instants[k]) for k in range(len(names))]

        n, changes_values = c.x.numel(), logic_or(fired, no_event)
        # A call for following modes changes no state, and therefore no derivative of a state.
        changes_derivatives = logic_and(changes_values, follows == 0.0)
        after = c.value(c.system.reset, own)
        changed = [
            c.derivative_along(
                after,
                t=instant,
                x=S[k],
                z=self._with_left_limits(d.Z[k], first, instant) + d.rate_along * instant,
                w=c.W[k] + c.V * (enters * instant),
                p=c.seeds[k],
            )
            for k, instant in enumerate(instants)
        ]
        parts = [vertsplit(column, [0, n, n + c.z.numel()]) for column in (after, *changed)]
        jumps = [changes_values, *[changes_derivatives] * len(names)]
        x = [if_else(jump, part[0], present) for jump, part, present in zip(jumps, parts, (c.x, *S))]
        z = [if_else(jump, part[1], present) for jump, part, present in zip(jumps, parts, (c.z, *Z))]

        opened = logic_and(logic_or(self.open, enters), logic_not(leaves))
        repeats = logic_and(opened, others)
        second = logic_and(repeats, arms[0] != 0.0)
        # A guard that waits for events of other ranks has already changed its sign.
        sets = logic_and(repeats, logic_or(enters, arms[1] != 0.0))
        flips = vertcat(logic_and(sets, logic_not(second)), second)
        caused = logic_or(logic_not(first), any_marked(vertcat(sources, arrived)))
        changes = {
            "known": SX(1.0),
            "open": opened,
            "arms": if_else(flips, -self.arms, self.arms),
            "mixed": if_else(logic_and(mixed > 0.0, self.mixed[0] < 0.0), vertcat(c.t, mixed), self.mixed),
            **{f"instant by {name}": instant for name, instant in zip(names, instants)},
            # A signal that jumped before the first reset jumped at a tick, whose time is fixed.
            **d.after(arrived, jumped, [if_else(caused, instant, 0.0) for instant in instants]),
        }
        if self.ties is not None:
            number = self.ties.first(x, z, instants, opened)
            ties = logic_and(number > 0.0, c.t > 0.0)
            changes["latest tie"] = if_else(ties, vertcat(c.t, number), SX([NEVER, 0.0]))
        added = [changes.get(name, present) for name, present in c.added.items()]
        return vertcat(*x), vertcat(*z, *added)

    def _with_left_limits(self, Z: SX, first: SX, instant: SX) -> SX:
        """Z with the sensitivities of left limits taken along the instant at the first reset."""
        corrected = SX(Z)
        for number, index in enumerate(self.left_limits):
            corrected[index] = corrected[index] + first * instant * self.left_limit_rates[number]
        return corrected

    def _instants(self, own: SX, no_event: SX, sources: SX, arrived: SX) -> tuple[list[SX], SX]:
        """The derivatives of this instant with respect to the parameters, and the number (from 1) of a guard
        with different derivatives, or 0."""
        located = logic_and(logic_or(own != 0.0, no_event), self.located)
        marks = vertcat(located, SX.zeros(2), sources != 0.0, arrived != 0.0)
        # A guard that fired without a located zero was moved by a jump, perhaps by one at a fixed time.
        at_fixed = [
            self.ticked,
            *(self._is_now(k) for k in range(self.times.numel()) if k not in self.moving_breakpoints),
        ]
        jumped = logic_and(own != 0.0, logic_not(self.located))
        follows = vertcat(jumped, SX.zeros(2), sources != 0.0, SX.zeros(arrived.numel()))
        follows = logic_and(follows, any_marked(vertcat(*at_fixed)))
        later = vertcat(
            self._fire_later(own, vertcat(sources, arrived)), SX.zeros(marks.numel() - self.guards)
        )
        instants: list[SX] = []
        arrivals = self.delays.arrivals(arrived)
        differing = SX.zeros(marks.numel())
        for k, known in enumerate(self.instant_p):
            steady = if_else(self.g_rate == 0.0, 1.0, self.g_rate)
            by_guards = -self.by_parameter(self.g, k) / steady
            derivatives = vertcat(by_guards, SX.zeros(2), self._times_by_parameter(k), arrivals[k])
            mean = dot(if_else(marks, derivatives, 0.0), marks) / fmax(dot(marks, marks), 1.0)
            differs = fabs(derivatives - mean) > SAME_DERIVATIVE * (1.0 + fabs(mean))
            differs = logic_or(logic_and(logic_or(marks, later), differs), logic_and(follows, mean != 0.0))
            differing = logic_or(differing, differs)
            instants.append(if_else(self.known, known, mean))
        last = SX(0.0)
        for number in range(differing.numel()):
            last = if_else(differing[number], float(number + 1), last)
        return instants, if_else(self.known, 0.0, last)

    def _fire_later(self, own: SX, others: SX) -> SX:
        """Whether each guard has a located zero now and a higher rank than the guards that fire."""
        system = self.columns.system
        if system.ranks is None:
            return SX.zeros(self.guards)
        rank = if_else(any_marked(others), -1.0, float(max(system.ranks.guards)))
        for number, own_rank in enumerate(system.ranks.guards):
            rank = if_else(own[number] != 0.0, fmin(rank, float(own_rank)), rank)
        later = SX(system.ranks.guards) > rank
        locates = SX([float(number in system.locating_guards) for number in range(self.guards)])
        passes = self.g_rate * SX(system.guard_directions) >= 0.0
        return logic_and(logic_and(later, logic_not(locates)), logic_and(self.located, passes))

    def _is_now(self, k: int) -> SX:
        """Whether breakpoint ``k`` is this instant."""
        return fabs(self.columns.t - self.times[k]) <= SAME_INSTANT * self.columns.t

    def _times_by_parameter(self, k: int) -> SX:
        c = self.columns
        moving = vertcat(*(self.times[index] for index in self.moving_breakpoints), SX(0, 1))
        return densify(jtimes(moving, c.p, c.seeds[k])) if self.moving_breakpoints else moving


def _times(flow: SX, shift: SX) -> SX:
    """The change of states along a shift of time: 0 without a shift, also where inconsistent modes give a
    flow that is not a number."""
    return if_else(shift == 0.0, 0.0, flow * shift)
