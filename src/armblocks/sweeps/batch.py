"""Runs of one compiled system with different parameters: natively in batches, or one after the other."""

from __future__ import annotations

import ctypes
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Signature, SimulationOptions
from armblocks.errors import SimulationError
from armblocks.integration.native_integrator import Integration
from armblocks.integration.run_point import RunPoint
from armblocks.integration.system import CompiledSystem
from armblocks.integration.workspace import Count, Scalar, Status
from armblocks.simulation.calls import CalledFunction
from armblocks.simulation.first_guess import first_guess
from armblocks.simulation.jumps import max_sides
from armblocks.simulation.plan import DEFAULT_INTERVALS, make_plan
from armblocks.simulation.result import SimulationResult
from armblocks.simulation.simulation import Simulation
from armblocks.sweeps.batch_places import Number, Outcome, Place, Report
from armblocks.sweeps.batch_routine import batch_code
from armblocks.sweeps.lanes import LaneArrays, LaneRuns, lanes_code, reason_against_lanes
from armblocks.sweeps.measure_routines import OPTIONS
from armblocks.sweeps.quantities import Observation

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
PythonMeasure = Callable[[SimulationResult], float]

COMPLETED, STOPPED, FAILED, STEP_LIMIT = STATUSES = ("completed", "stopped", "failed", "step limit")
NATIVE_STEPS = 1_000_000
"""Maximum number of steps of a native run. The limit ends a sweep soon after Ctrl-C; ``run_alone`` repeats
longer runs.
"""
CHECK_SECONDS = 0.05
"""Wall time between two checks for an interruption in ``run_alone``, s."""

_RUNS = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)


@dataclass(frozen=True, kw_only=True, eq=False)
class RunRows:
    """The results of several runs, a row for each run.

    - ``status`` (n,): indices in :data:`STATUSES`.
    - ``messages``: texts for stopped and failed runs.
    - ``measures`` (n, nm): NaN for runs that failed.
    - ``steps``, ``events`` (n,): numbers of steps and of events.
    - ``end_time`` (n,) s.
    - ``kept`` (n, kept, N): samples, NaN after the end of a run.
    - ``general``: the number of runs that the native loop did not complete.
    """

    status: NDArray[np.int8]
    messages: list[str]
    measures: Array
    steps: Integers
    events: Integers
    end_time: Array
    kept: Array
    general: int = 0


class RunProgram:
    """Runs of one system with the same settings; the parameters differ."""

    def __init__(
        self,
        compiled: CompiledSystem,
        options: SimulationOptions,
        observation: Observation,
        python_measures: Sequence[PythonMeasure] = (),
        *,
        calls: Sequence[CalledFunction] = (),
        max_steps: int | None = None,
        layout: Signature | None = None,
        lanes: int = 1,
    ) -> None:
        """``python_measures`` follow the measures of ``observation``. ``lanes``: the number of runs that are
        computed at a time, in lanes of vector registers, if the system allows it; a power of two. Raises
        ``InputError`` for invalid options.
        """
        self.compiled = compiled
        self.options = options
        self.observation = observation
        self.python_measures = tuple(python_measures)
        self.calls = tuple(calls)
        self.max_steps = max_steps
        self.layout = layout
        self.plan = make_plan(compiled, options)
        self.interrupted = False
        """Whether ``run_alone`` ends early, with ``KeyboardInterrupt``."""
        # The code is loaded before threads use it; two threads could load the same code twice.
        compiled.prepare(self.plan.tableau)
        _ = batch_code(), observation.expressions and observation.expressions.address
        self.against_lanes = ""
        """The reason why runs are not computed in lanes."""
        self.lanes = 1
        # Without states there is no integration; samples are evaluated in lanes in any case.
        if lanes > 1 and self.native and not python_measures and self.plan.tableau is not None:
            self.against_lanes = reason_against_lanes(compiled, self.plan, lanes)
            self.lanes = 1 if self.against_lanes else lanes
        if self.lanes > 1:
            lanes_code(compiled, self.plan, self.lanes)

    @property
    def native(self) -> bool:
        """Whether the native loop over runs is used."""
        times = self.plan.sample_times
        return not self.calls and times.stop > 0.0 and times.count > 1

    @property
    def columns(self) -> int:
        """The number of measures."""
        return len(self.observation.measures) + len(self.python_measures)

    def empty_rows(self, count: int) -> RunRows:
        """Rows without values."""
        kept, samples = len(self.observation.kept), self.plan.sample_times.count
        return RunRows(
            status=np.zeros(count, dtype=np.int8),
            messages=[""] * count,
            measures=np.full((count, self.columns), np.nan),
            steps=np.zeros(count, dtype=np.int64),
            events=np.zeros(count, dtype=np.int64),
            end_time=np.zeros(count),
            kept=np.full((count, kept, samples), np.nan),
        )

    def simulation(self, p: Array) -> Simulation:
        """One run with parameters ``(np,)``."""
        return Simulation(self.compiled, self.options, p, None, None, self.calls, self.layout)

    def run_alone(self, p: Array, rows: RunRows, row: int) -> None:
        """Compute one run with ``Simulation``, and write its row."""
        run = self.simulation(p)
        result: SimulationResult | None = None
        try:
            self._advance(run)
            if not run.finished:
                rows.status[row] = STATUSES.index(STEP_LIMIT)
                rows.messages[row] = f"not finished after {self.max_steps} steps, at {run.time:.9g} s"
                run.stop("")
            result = run.result()
        except SimulationError as failure:
            rows.status[row] = STATUSES.index(FAILED)
            rows.messages[row] = failure.what
            partial = failure.partial
            if isinstance(partial, SimulationResult):
                rows.steps[row], rows.events[row] = partial.run.steps, partial.run.events
                rows.end_time[row] = partial.time[-1] if partial.time.size else 0.0
            return
        rows.steps[row], rows.events[row] = result.run.steps, result.run.events
        rows.end_time[row] = run.time
        samples = self.observation.samples(result)
        rows.kept[row, :, : samples.shape[1]] = samples
        if rows.status[row] == STATUSES.index(STEP_LIMIT):
            return
        ended = result.run.message.startswith("stopped by block")
        if ended:
            rows.status[row] = STATUSES.index(STOPPED)
            rows.messages[row] = result.run.message.split(". ")[0]
        values = self.observation.measured(result)
        values += [float(measure(result)) for measure in self.python_measures]
        rows.measures[row] = values

    def _advance(self, run: Simulation) -> None:
        """Advance a run to its end or to the maximum number of steps."""
        if self.max_steps is not None:
            run.advance(steps=self.max_steps)
            return
        while not run.finished:
            if self.interrupted:
                raise KeyboardInterrupt
            run.advance(wall_time=CHECK_SECONDS)


class Worker:
    """The memory of one thread that computes runs of a program."""

    def __init__(self, program: RunProgram) -> None:
        self.program = program
        self._batch = NativeBatch(program) if program.native and not program.python_measures else None

    def compute(self, parameters: Array) -> RunRows:
        """The rows of runs with parameters ``(n, np)``."""
        program, count = self.program, len(parameters)
        rows = program.empty_rows(count)
        if self._batch is None:
            remaining: Sequence[int] = range(count)
        else:
            remaining = self._batch.compute(np.ascontiguousarray(parameters), rows)
        for row in remaining:
            if program.interrupted:
                raise KeyboardInterrupt
            program.run_alone(parameters[row], rows, row)
        general = 0 if self._batch is None else len(remaining)
        if self._batch is not None:
            self._batch = self._batch.enlarged()
        return dataclasses.replace(rows, general=general)


@dataclass(frozen=True, kw_only=True, eq=False)
class RunMemory:
    """The arrays of one run before its first step, see :class:`~armblocks.integration.frame.Arrays`."""

    advance: int
    reals: Array
    counts: Integers
    samples: Array
    states: Array
    discrete: Array
    algebraic: Array
    jumps: Array
    scratch: Array
    places: Mapping[Number, int]
    integration: Integration | None = None
    """The owner of the arrays."""


class NativeBatch:
    """The arrays of the native loop over runs."""

    def __init__(self, program: RunProgram, doublings: int = 0) -> None:
        """``doublings``: how often the initial memory for jumps is doubled."""
        self._program = program
        self._doublings, self._jumps_full = doublings, False
        compiled, observation = program.compiled, program.observation
        self._memory = memory = _run_memory(program, doublings)
        arrays = {**_run_arrays(memory), **_observation_arrays(compiled, observation, memory)}
        self._arrays: dict[Place, NDArray[np.generic]] = arrays
        self._addresses = np.zeros(Place.END, dtype=np.int64)
        self._addresses[Place.ADVANCE] = memory.advance
        functions = compiled.addresses
        for place, name in (
            (Place.INITIAL_STATES, "initial_states"),
            (Place.INITIAL_DISCRETE, "initial_discrete"),
            (Place.BREAKPOINTS, "breakpoints"),
            (Place.SIGNALS, "signals"),
        ):
            self._addresses[place] = functions[name]
        expressions = observation.expressions
        self._addresses[Place.EXPRESSIONS] = 0 if expressions is None else expressions.address
        for place, array in arrays.items():
            self._addresses[place] = array.ctypes.data
        sizes = compiled.sizes
        steps = NATIVE_STEPS if program.max_steps is None else min(NATIVE_STEPS, program.max_steps)
        numbers = {
            Number.PARAMETERS: compiled.parameters.size,
            Number.STATES: sizes.states,
            Number.DISCRETE: sizes.discrete,
            Number.ALGEBRAIC: sizes.algebraic,
            Number.SIGNALS: compiled.signals_layout.size,
            Number.SAMPLES: memory.samples.size,
            Number.BREAKPOINTS: compiled.breakpoint_count,
            Number.REALS: memory.reals.size,
            Number.COUNTS: memory.counts.size,
            **memory.places,
            Number.DELAYS: len(sizes.delays),
            Number.STOPS: len(sizes.stops),
            Number.USED: len(observation.used),
            Number.QUANTITIES: len(observation.quantities),
            Number.MEASURES: len(observation.measures),
            Number.KEPT: len(observation.kept),
            Number.MAX_STEPS: steps,
            Number.SIDES: len(memory.jumps),
        }
        self._numbers = np.array([numbers[place] for place in Number if place in numbers], dtype=np.int64)
        self._call = _RUNS(batch_code().address("runs"))
        self._lanes = _lane_runs(program, doublings, steps) if program.lanes > 1 else None

    def enlarged(self) -> NativeBatch:
        """A batch with twice the memory for jumps if a run has needed more, up to the maximum of a run."""
        full = len(self._memory.jumps) >= max_sides(self._program.compiled)
        if not self._jumps_full or full:
            return self
        return NativeBatch(self._program, self._doublings + 1)

    def compute(self, parameters: Array, rows: RunRows) -> list[int]:
        """Write the rows of runs with parameters ``(n, np)``.

        Returns the runs that ``run_alone`` must compute.
        """
        compiled, count = self._program.compiled, len(parameters)
        reports = np.zeros((count, Report.END), dtype=np.int64)
        results = rows.measures if rows.measures.shape[1] else np.empty((count, 1))
        guesses = self._guesses(parameters)
        for place, array in (
            (Place.PARAMETERS, parameters),
            (Place.GUESSES, guesses),
            (Place.RESULTS, results),
            (Place.REPORTS, reports),
            (Place.END_TIMES, rows.end_time),
            (Place.KEPT_VALUES, rows.kept),
        ):
            self._addresses[place] = array.ctypes.data
        status = reports[:, Report.STATUS]
        addresses, numbers = self._addresses.ctypes.data, self._numbers.ctypes.data
        if self._lanes is None:
            self._call(addresses, numbers, 0, count)
        else:
            status[:] = Outcome.OTHER
            self._lanes.compute(self._addresses, self._numbers, count)
            for row in np.flatnonzero(status == Outcome.OTHER).tolist():
                self._call(addresses, numbers, row, row + 1)
        rows.steps[:], rows.events[:] = reports[:, Report.STEPS], reports[:, Report.EVENTS]
        states = reports[status == Outcome.OTHER, Report.GUARD]
        self._jumps_full = bool((states == Status.JUMPS_FULL).any())
        remaining = np.flatnonzero((status == Outcome.OTHER) | (status == Outcome.LIMIT)).tolist()
        for row in np.flatnonzero(status == Outcome.STOPPED).tolist():
            guard = int(reports[row, Report.GUARD])
            if compiled.guard_actions[guard] == "fail":
                remaining.append(row)
                rows.measures[row] = np.nan
                rows.kept[row] = np.nan
                continue
            rows.status[row] = STATUSES.index(STOPPED)
            block, end = compiled.guard_names[guard], rows.end_time[row]
            rows.messages[row] = f"stopped by block '{block}' at {end:.9g} s"
        return remaining

    def _guesses(self, parameters: Array) -> Array:
        """The guesses of the implicit unknowns, ``(n, nw)``."""
        compiled = self._program.compiled
        guesses = np.empty((len(parameters), compiled.algebraic.size))
        for row in range(len(parameters)) if compiled.algebraic.size else ():
            p = parameters[row]
            x, z = compiled.initial_states(p), compiled.initial_discrete(p)
            start = RunPoint(time=0.0, x=x, z=z, w=compiled.initial_algebraic(p))
            finite = np.isfinite(x).all() and np.isfinite(z).all()
            guesses[row] = first_guess(compiled, start, p) if finite else start.w
        return guesses


def _run_memory(program: RunProgram, doublings: int) -> RunMemory:
    """The arrays of a run, whose start values the native loop replaces."""
    compiled, options, plan = program.compiled, program.options, program.plan
    sizes, samples = compiled.sizes, plan.sample_times.part(0, plan.sample_times.count)
    if plan.tableau is None:
        sides = 2 * (compiled.breakpoint_count + 1) if options.record_jumps else 0
        places = (Number.X, Number.Z, Number.W, Number.SIGNS, Number.HISTORY)
        return RunMemory(
            advance=0,
            reals=np.zeros(Scalar.END),
            counts=np.zeros(Count.END, dtype=np.int64),
            samples=samples,
            states=np.empty(0),
            discrete=np.empty(0),
            algebraic=np.empty(0),
            jumps=np.empty((sides, 2)),
            scratch=np.empty(1),
            places=dict.fromkeys(places, 0),
        )
    start = RunPoint(
        time=0.0, x=np.zeros(sizes.states), z=np.zeros(sizes.discrete), w=np.zeros(sizes.algebraic)
    )
    run = compiled.integrator(plan.tableau).begin(
        start,
        compiled.parameter_values,
        samples,
        np.empty(0),
        step=plan.step,
        rtol=options.rtol,
        atol=options.atol,
        max_step=plan.max_step,
        detect_stiffness=plan.stiff is not None,
        stop=plan.sample_times.stop,
        span=DEFAULT_INTERVALS * plan.sample_times.sample_time,
        jumps=max_sides(compiled) if options.record_jumps else 0,
    )
    for _ in range(doublings):
        run.jumps.enlarge(0.0)
    layout, workspace = run.integrator.layout, run.integrator.workspace
    return RunMemory(
        advance=run.integrator.address,
        reals=run.reals,
        counts=run.counts,
        samples=run.inputs[1],
        states=run.states,
        discrete=run.discrete,
        algebraic=run.algebraic,
        jumps=run.jumps.memory,
        scratch=np.empty(1 if layout is None else layout.length),
        places={
            Number.X: workspace.x,
            Number.Z: workspace.z,
            Number.W: workspace.w,
            Number.SIGNS: workspace.signs,
            Number.HISTORY: workspace.history,
        },
        integration=run,
    )


def _lane_runs(program: RunProgram, doublings: int, max_steps: int) -> LaneRuns:
    """The loop in lanes, with the arrays of a run for each lane."""
    memories = [_run_memory(program, doublings) for _ in range(program.lanes)]
    arrays = [LaneArrays(reals=memory.reals, counts=memory.counts, jumps=memory.jumps) for memory in memories]
    return LaneRuns(program.compiled, program.options, program.plan, arrays, max_steps)


def _run_arrays(memory: RunMemory) -> dict[Place, NDArray[np.generic]]:
    """The arrays of a run, and copies of their initial contents."""
    return {
        Place.REALS: memory.reals,
        Place.COUNTS: memory.counts,
        Place.SAMPLES: memory.samples,
        Place.FIRST_REALS: memory.reals.copy(),
        Place.FIRST_COUNTS: memory.counts.copy(),
        Place.FIRST_SAMPLES: memory.samples.copy(),
        Place.STATES: memory.states,
        Place.DISCRETE: memory.discrete,
        Place.ALGEBRAIC: memory.algebraic,
        Place.JUMPS: memory.jumps,
        Place.SAVED_REALS: np.empty_like(memory.reals),
        Place.SAVED_COUNTS: np.empty_like(memory.counts),
        Place.SCRATCH: memory.scratch,
    }


def _observation_arrays(
    compiled: CompiledSystem, observation: Observation, memory: RunMemory
) -> dict[Place, NDArray[np.generic]]:
    """The tables of quantities and measures, and the memory for signals, jumps and series."""
    sizes, ny = compiled.sizes, compiled.signals_layout.size
    sides, count, breakpoints = len(memory.jumps), memory.samples.size, compiled.breakpoint_count
    ne = 0 if observation.expressions is None else observation.expressions.count
    table: list[int] = []
    indices: list[int] = []
    for quantity in observation.quantities:
        table += [quantity.row, len(indices), len(quantity.used)]
        indices += [observation.used.index(row) for row in quantity.used]
    measures = observation.measures
    integers = {
        Place.USED: observation.used,
        Place.QUANTITIES: table,
        Place.QUANTITY_SIGNALS: indices,
        Place.MEASURES: [measure.address for measure in measures],
        Place.MEASURE_QUANTITIES: [measure.quantity for measure in measures],
        Place.KEPT: observation.kept,
        Place.STOPS: sizes.stops,
        Place.DELAYED: [line.value for line in sizes.delays],
    }
    lengths = {
        Place.ENDS: breakpoints + 1,
        Place.CLAMPS: breakpoints + 1,
        Place.BREAKPOINT_TIMES: breakpoints,
        Place.INSTANTS: count,
        Place.VALUES: ny * count,
        Place.EXPRESSION_VALUES: ne * count,
        Place.SIDE_TIMES: sides,
        Place.SIDE_STATES: sides * sizes.states,
        Place.SIDE_DISCRETE: sides * sizes.discrete,
        Place.SIDE_ALGEBRAIC: sides * sizes.algebraic,
        Place.SIDE_VALUES: sides * ny,
        Place.SIDE_EXPRESSIONS: sides * ne,
        Place.JUMP_TIMES: sides,
        Place.SERIES_TIMES: sides + count,
        Place.SERIES_VALUES: sides + count,
    }
    options = [measure.all_options for measure in measures]
    return {
        **{place: np.array([*values], dtype=np.int64) for place, values in integers.items()},
        **{place: np.empty(max(1, length)) for place, length in lengths.items()},
        Place.JUMPING: np.empty((len(observation.used) + 1) * max(1, sides), dtype=np.int64),
        Place.MEASURE_OPTIONS: np.array(options, dtype=np.float64).reshape(-1, OPTIONS),
    }
