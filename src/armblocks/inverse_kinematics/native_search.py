"""The search for solutions of a batch of targets as one native function.

Each lane works on one target. When the attempt of a lane ends, the lane continues with the next start of its
target, or with the next target; the other lanes are not affected. Every decision about a target depends only
on the target, its start and the settings, and all operations give the same bits in any number of lanes.
Therefore the results do not depend on the other targets of the batch, on the lanes or on the threads.
"""

from __future__ import annotations

import math

from armblocks.inverse_kinematics.damped_step import MAX_DAMPING, MIN_DAMPING, damped_step
from armblocks.inverse_kinematics.layout import (
    ROWS,
    TARGET,
    Count,
    Limit,
    Number,
    SearchSizes,
    Setting,
    Status,
)
from armblocks.inverse_kinematics.nearest_start import is_pose, nearest
from armblocks.routines.arithmetic import fma, in_all_lanes, select, square_root
from armblocks.routines.lanes import LaneArray, Lanes, Mask
from armblocks.routines.memory import Addresses, Integers, Reals
from armblocks.routines.routine import Program, Routine, external
from armblocks.routines.values import Boolean, Integer, Real

SLOW = 0.7
"""A step is slow if it reduces the squared error to more than this fraction."""
NEAR = 1e-10
"""Weighted squared error below which a small gradient does not end the attempt: the solution is near, and
may be singular."""
FARTHEST = 1e5
"""Coordinates beyond this value end the attempt: the vectorised sine does not support large angles."""
ARRAYS = ("targets", "starts", "settings", "limits", "table", "poses", "q", "numbers", "counts")
"""The pointers of the search, in order; ``counts`` is an array of integers."""

NEAREST = "nearest"
WHOLE_TURN = 2.0 * math.pi
_RUNNING, _CONVERGED, _FAILED = 0.0, 1.0, 2.0


def _evaluate(r: Routine, q: LaneArray, target: LaneArray, error: LaneArray, J: LaneArray) -> None:
    """The error of the pose at ``q`` and its Jacobian, row by row."""


def _integrate(r: Routine, q: LaneArray, qd: LaneArray, dt: LaneArray, new: LaneArray) -> None:
    """The coordinates after a time ``dt`` at constant ``qd``."""


evaluate = external(_evaluate, "evaluate")
integrate = external(_integrate, "integrate")


def define_nearest(program: Program) -> None:
    """Define the choice of starts in a program with the lanes of the table."""
    lanes = program.lanes

    def chosen(r: Routine, target: Reals, settings: Reals, table: LaneArray, previous: Reals) -> Integer:
        return nearest(r, target, settings, table, previous, r.constant_integer(lanes))

    program.define(chosen, NEAREST, inlined=False)


def _nearest(r: Routine, target: Reals, settings: Reals, table: Reals, previous: Reals) -> Integer:
    """See :func:`armblocks.inverse_kinematics.nearest_start.nearest`."""
    raise NotImplementedError


next_start = external(_nearest, NEAREST)


def define_search(program: Program, sizes: SearchSizes, symbol: str) -> None:
    """Define ``void symbol(i64 start, i64 stop, i64 samples, ptr …)`` with the pointers ``ARRAYS``.

    It solves the targets ``start`` to ``stop - 1``. The functions ``evaluate``, ``integrate`` (over the lanes
    of the program) and ``nearest`` are external.
    """

    def search(r: Routine, start: Integer, stop: Integer, samples: Integer, *arrays: Reals) -> None:
        _Search(r, sizes, dict(zip(ARRAYS, arrays)), stop).write(start)

    program.define(search, symbol, public=True, rest=ARRAYS)


def define_single(program: Program, sizes: SearchSizes, symbol: str, search: str) -> None:
    """Define ``void symbol(ptr constant, ptr target, ptr results)``: one target, with few arguments.

    ``constant`` are the addresses of settings, limits, table and poses; ``results`` has q, then the numbers,
    then the counts as doubles.
    """

    def whole(r: Routine, start: Integer, stop: Integer, samples: Integer, *arrays: Reals) -> None:
        """The function of :func:`define_search`."""

    def single(r: Routine, constant: Addresses, target: Reals, results: Reals) -> None:
        zero, one = r.constant_integer(0), r.constant_integer(1)
        given = [constant[k].reals for k in range(4)]
        numbers = results.after(sizes.positions)
        counts = numbers.after(int(Number.COUNT))
        r.call(external(whole, search), zero, one, one, target, results, *given, results, numbers, counts)
        for k in range(Count.COUNT):
            counts[k] = counts.integers[k].to_real()

    program.define(single, symbol, public=True)


class _Search:
    """Emits the search. ``rows`` is the memory of the lanes."""

    def __init__(self, r: Routine, sizes: SearchSizes, arrays: dict[str, Reals], stop: Integer) -> None:
        self.r, self.sizes, self.arrays, self.stop = r, sizes, arrays, stop
        self.lanes = r.program.lanes
        nq, n = sizes.positions, sizes.speeds
        lengths = {"q": nq, "target": TARGET, "error": ROWS, "J": ROWS * n, "step": n, "new": nq, "time": 1}
        lengths |= {"cost": 1, "previous_cost": 1, "slow": 1, "steps": 1, "max_steps": 1, "state": 1}
        lengths |= {"position": 1, "rotation": 1}
        memory = r.local_lanes(sum(lengths.values()))
        self.rows: dict[str, LaneArray] = {}
        first = 0
        for name, length in lengths.items():
            self.rows[name] = memory.after(first)
            first += length
        self.samples = r.local_integers(self.lanes)
        self.attempts = r.local_integers(self.lanes)
        self.previous = r.local_reals(2 * self.lanes)
        self.active = r.integer(self.lanes)
        self.next_sample = r.integer(0)

    def write(self, start: Integer) -> None:
        """The whole function."""
        r, rows = self.r, self.rows
        self.next_sample.value = start
        for row in range(self.sizes.positions):
            rows["q"][row] = 0.0
        for row in range(TARGET):
            rows["target"][row] = float(row % 5 == 0)
        rows["time"][0] = 1.0
        rows["state"][0] = _FAILED
        for lane in r.range(0, self.lanes):
            self.samples[lane] = -1
        ended = r.boolean(True)
        with r.loop() as iteration:
            with r.when(ended.value):
                for lane in r.range(0, self.lanes):
                    with r.when(rows["state"].reals[lane] != _RUNNING):
                        self._continue_lane(lane)
            iteration.leave_unless(self.active.value > 0)
            r.call(evaluate, rows["q"], rows["target"], rows["error"], rows["J"])
            ended.value = self._step()

    # ---- one lane: results, next start, next target -------------------------------------------------------
    def _continue_lane(self, lane: Integer) -> None:
        """Store the result of the attempt that has ended; set the next start, of this target or the next."""
        r = self.r
        with r.part() as ended:
            ended.leave_unless(self.samples[lane] >= 0)
            self._store_result(lane)
            attempt = self.attempts[lane] + 1
            self.attempts[lane] = attempt
            found = self.rows["state"].reals[lane] == _CONVERGED
            limit = self.arrays["settings"][Setting.ATTEMPTS].to_integer()
            with r.when(found | (attempt >= limit)):
                self.samples[lane] = -1
        with r.part() as taking:
            taking.leave_unless(self.samples[lane] < 0)
            with r.loop() as reading:
                sample = self.next_sample.value
                with r.unless(sample < self.stop):
                    # No target is left: the lane repeats its last coordinates without an effect.
                    self.active.value = self.active.value - 1
                    self.rows["state"].reals[lane] = _RUNNING
                    self.rows["max_steps"].reals[lane] = float("inf")
                    self.samples[lane] = -2
                    reading.leave()
                self.next_sample.value = sample + 1
                self._take_target(lane, sample)
                reading.leave_unless(self.samples[lane] < 0)
        with r.when(self.samples[lane] >= 0):
            self._set_start(lane)

    def _take_target(self, lane: Integer, sample: Integer) -> None:
        """Read a target; ``samples[lane]`` stays negative if the target is invalid."""
        r = self.r
        counts, numbers = self._counts(sample), self._numbers(sample)
        for place in range(Number.COUNT):
            numbers[place] = float("inf")
        for k in r.range(0, self.sizes.positions):
            self.arrays["q"][sample * self.sizes.positions + k] = float("nan")
        counts[Count.STEPS] = 0
        counts[Count.ATTEMPTS] = 0
        target = self.arrays["targets"].after(sample * TARGET)
        is_valid = is_pose(r, target) != 0.0
        counts[Count.STATUS] = select(
            is_valid, r.constant_integer(Status.NOT_FOUND), r.constant_integer(Status.INVALID_TARGET)
        )
        with r.when(is_valid):
            self.samples[lane] = sample
            self.attempts[lane] = 0
            self.previous[lane * 2] = -1.0
            self.previous[lane * 2 + 1] = -1.0
            for k in r.range(0, TARGET):
                self.rows["target"].reals[k * self.lanes + lane] = target[k]

    def _set_start(self, lane: Integer) -> None:
        """The start of an attempt: the given start for the first attempt, if any; else the next entry."""
        r, nq, settings = self.r, self.sizes.positions, self.arrays["settings"]
        sample = self.samples[lane]
        given = (settings[Setting.HAS_STARTS] != 0.0) & (self.attempts[lane] == 0)
        q, limits = self.rows["q"].reals, self.arrays["limits"]
        width = max(nq, self.sizes.speeds)
        max_steps = self.rows["max_steps"].reals
        with r.when(given):
            for k in r.range(0, nq):
                value = self.arrays["starts"][sample * nq + k]
                lowest, highest = limits[k + Limit.LOWEST * width], limits[k + Limit.HIGHEST * width]
                value = select(value < lowest, lowest, value)
                q[k * self.lanes + lane] = select(value > highest, highest, value)
            max_steps[lane] = settings[Setting.FIRST_STEPS]
        with r.otherwise():
            target = self.arrays["targets"].after(sample * TARGET)
            previous = self.previous.after(lane * 2)
            index = r.call(next_start, target, settings, self.arrays["poses"], previous)
            entry = select(index < 0, r.constant_integer(0), index)
            for k in r.range(0, nq):
                q[k * self.lanes + lane] = self.arrays["table"][entry * nq + k]
            max_steps[lane] = settings[Setting.STEPS]
        self.rows["state"].reals[lane] = _RUNNING
        self.rows["steps"].reals[lane] = 0.0
        self.rows["slow"].reals[lane] = 0.0
        self.rows["previous_cost"].reals[lane] = float("inf")

    def _store_result(self, lane: Integer) -> None:
        """Store the end of an attempt if it is a solution, or nearer to the target than earlier ends."""
        r, nq = self.r, self.sizes.positions
        sample = self.samples[lane]
        counts, numbers = self._counts(sample), self._numbers(sample)
        found = self.rows["state"].reals[lane] == _CONVERGED
        cost = self.rows["cost"].reals[lane]
        with r.when(found | (cost < numbers[Number.COST])):
            numbers[Number.POSITION_ERROR] = square_root(self.rows["position"].reals[lane])
            numbers[Number.ROTATION_ERROR] = square_root(self.rows["rotation"].reals[lane])
            numbers[Number.COST] = cost
            for k in r.range(0, nq):
                q = self.rows["q"].reals[k * self.lanes + lane]
                self.arrays["q"][sample * nq + k] = self._nearest_turn(sample, k, q)
        with r.when(found):
            counts[Count.STATUS] = Status.CONVERGED
        counts[Count.STEPS] = counts[Count.STEPS] + self.rows["steps"].reals[lane].to_integer()
        counts[Count.ATTEMPTS] = counts[Count.ATTEMPTS] + 1

    def _nearest_turn(self, sample: Integer, k: Integer, q: Real) -> Real:
        """A periodic coordinate, shifted by full turns to the value nearest to the given start, or to 0.

        A coordinate that would leave its limits is unchanged.
        """
        r, limits = self.r, self.arrays["limits"]
        width, nq = max(self.sizes.positions, self.sizes.speeds), self.sizes.positions
        result, reference = r.real(q), r.real(0.0)
        with r.when(limits[k + Limit.PERIODIC * width] != 0.0):
            with r.when(self.arrays["settings"][Setting.HAS_STARTS] != 0.0):
                start = self.arrays["starts"][sample * nq + k]
                reference.value = select(abs(start) <= FARTHEST, start, 0.0)
            turns = (q - reference.value) / WHOLE_TURN
            whole = (turns + select(turns < 0.0, r.constant(-0.5), 0.5)).to_integer().to_real()
            moved = fma(-WHOLE_TURN, whole, q)
            inside = (moved >= limits[k + Limit.LOWEST * width]) & (
                moved <= limits[k + Limit.HIGHEST * width]
            )
            result.value = select(inside, moved, q)
        return result.value

    def _counts(self, sample: Integer) -> Integers:
        return self.arrays["counts"].integers.after(sample * int(Count.COUNT))

    def _numbers(self, sample: Integer) -> Reals:
        return self.arrays["numbers"].after(sample * int(Number.COUNT))

    # ---- all lanes: one step ------------------------------------------------------------------------------
    def _step(self) -> Boolean:
        """Take a step in the lanes that continue; return whether the attempt of a lane has ended."""
        r, rows, n = self.r, self.rows, self.sizes.speeds
        error = [rows["error"][k] for k in range(ROWS)]
        weights = [in_all_lanes(self.arrays["settings"][Setting.WEIGHTS + k]) for k in range(ROWS)]
        counted = [select(weight != 0.0, e, 0.0) for weight, e in zip(weights, error)]
        position, rotation = _square(counted[:3]), _square(counted[3:])
        e = [weight * value for weight, value in zip(weights, counted)]
        cost = _square(e)
        weighted = [[weights[k] * rows["J"][k * n + i] for i in range(n)] for k in range(ROWS)]
        held, gradient = self._held_columns(weighted, e)
        J = [[select(mask, 0.0, value) for mask, value in zip(held, row)] for row in weighted]
        size = _square([value for row in J for value in row])
        stopped = self._states(
            cost, position, rotation, gradient < (self._setting(Setting.FLAT) * cost) * size
        )
        damping = self._setting(Setting.DAMPING) * cost
        damping = select(damping > MAX_DAMPING, MAX_DAMPING, damping) + MIN_DAMPING
        damping = fma(self._setting(Setting.ROOT_DAMPING), square_root(cost), damping)
        dq = self._limited(damped_step(r, J, e, damping))
        for i in range(n):
            rows["step"][i] = dq[i]
        r.call(integrate, rows["q"], rows["step"], rows["time"], rows["new"])
        for k in range(self.sizes.positions):
            rows["q"][k] = select(stopped, rows["q"][k], self._inside(k, rows["new"][k]))
        rows["cost"][0], rows["position"][0], rows["rotation"][0] = cost, position, rotation
        return stopped.any

    def _states(self, cost: Lanes, position: Lanes, rotation: Lanes, flat: Mask) -> Mask:
        """Update the counts and states of the lanes; return the lanes whose attempt has ended."""
        rows = self.rows
        found = (position <= self._setting(Setting.POSITION_TOLERANCE)) & (
            rotation <= self._setting(Setting.ROTATION_TOLERANCE)
        )
        steps = rows["steps"][0] + 1.0
        is_slow = cost > SLOW * rows["previous_cost"][0]
        slow = select(is_slow, rows["slow"][0] + 1.0, 0.0)
        failed = (flat & (cost > NEAR)) | (slow >= self._setting(Setting.SLOW_STEPS))
        failed = failed | (steps >= rows["max_steps"][0]) | ~(cost < float("inf"))
        for k in range(self.sizes.positions):
            failed = failed | (abs(rows["q"][k]) > FARTHEST)
        # A lane without a target has no limit of steps.
        works = rows["max_steps"][0] < float("inf")
        state = select(found, _CONVERGED, select(failed, _FAILED, Lanes.constant(self.r, _RUNNING)))
        state = select(works, state, _RUNNING)
        rows["state"][0], rows["steps"][0], rows["slow"][0] = state, steps, slow
        rows["previous_cost"][0] = cost
        return (found | failed) & works

    def _held_columns(self, J: list[list[Lanes]], e: list[Lanes]) -> tuple[list[Mask], Lanes]:
        """The columns of joints that stay at a limit, and the squared gradient of all other columns."""
        held: list[Mask] = []
        total = Lanes.constant(self.r, 0.0)
        for i, place in enumerate(self.sizes.position_of_speed):
            gradient = J[0][i] * e[0]
            for k in range(1, ROWS):
                gradient = fma(J[k][i], e[k], gradient)
            if place is None:
                held.append(gradient != gradient)
            else:
                q = self.rows["q"][place]
                below = (q <= self._limit(Limit.LOWEST, place)) & (gradient < 0.0)
                held.append(below | ((q >= self._limit(Limit.HIGHEST, place)) & (gradient > 0.0)))
            free = select(held[-1], 0.0, gradient)
            total = fma(free, free, total)
        return held, total

    def _limited(self, dq: list[Lanes]) -> list[Lanes]:
        """The step, shortened so that no joint exceeds its largest step."""
        largest = Lanes.constant(self.r, 1.0)
        for i, value in enumerate(dq):
            relative = abs(value) * self._limit(Limit.STEP, i)
            largest = select(relative > largest, relative, largest)
        factor = 1.0 / largest
        return [value * factor for value in dq]

    def _inside(self, k: int, q: Lanes) -> Lanes:
        """A coordinate within its limits: shifted by a full turn if that suffices, else set to the limit."""
        if k not in self.sizes.position_of_speed:
            return q
        lowest, highest = self._limit(Limit.LOWEST, k), self._limit(Limit.HIGHEST, k)
        periodic = self._limit(Limit.PERIODIC, k) != 0.0
        less, more = q - WHOLE_TURN, q + WHOLE_TURN
        at_top = select(periodic & (less >= lowest), less, highest)
        at_bottom = select(periodic & (more <= highest), more, lowest)
        return select(q > highest, at_top, select(q < lowest, at_bottom, q))

    def _setting(self, place: Setting) -> Lanes:
        return in_all_lanes(self.arrays["settings"][place])

    def _limit(self, row: Limit, place: int) -> Lanes:
        width = max(self.sizes.positions, self.sizes.speeds)
        return in_all_lanes(self.arrays["limits"][row * width + place])


def _square(values: list[Lanes]) -> Lanes:
    total = values[0] * values[0]
    for value in values[1:]:
        total = fma(value, value, total)
    return total
