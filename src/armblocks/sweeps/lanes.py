"""Runs of one compiled system in the lanes of vector registers: memory, and models without lanes."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.native import NativeCode
from armblocks.compiler.target import host_target
from armblocks.equations import SimulationOptions
from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.lane_frame import LanePlace, LaneWorkspace, SharedCount, SharedNumber, SharedPlace
from armblocks.integration.lane_loop import lane_code
from armblocks.integration.system import CompiledSystem
from armblocks.simulation.plan import Plan
from armblocks.sweeps.batch_places import Place
from armblocks.sweeps.batch_routine import batch_code

MAX_MEMORY = 256_000_000
"""Maximum memory for the states of all samples of all lanes, bytes."""

_RUNS = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 2, *[ctypes.c_int64] * 2)


def reason_against_lanes(compiled: CompiledSystem, plan: Plan, lanes: int = 8) -> str:
    """The reason why the runs of a system cannot be computed in lanes; empty if they can."""
    sizes, tableau = compiled.sizes, plan.tableau
    if tableau is None or not sizes.states:
        return "the model has no continuous states"
    if not isinstance(tableau, ButcherTableau):
        return f"the solver {tableau.name} solves linear equations"
    for part, present in (
        ("delayed signals", sizes.delays),
        ("implicit equations", sizes.algebraic),
        ("sampled blocks", sizes.clocks),
        ("events", sizes.directions),
        ("discrete states", sizes.discrete),
    ):
        if present:
            return f"the model has {part}"
    if plan.sample_times.count * sizes.states * 8 * lanes > MAX_MEMORY:
        return "a run has too many samples"
    return ""


@dataclass(frozen=True, kw_only=True, eq=False)
class LaneArrays:
    """The arrays of the run of one lane, see :class:`armblocks.sweeps.batch.RunMemory`."""

    reals: NDArray[np.float64]
    counts: NDArray[np.int64]
    jumps: NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class _Lane:
    """All arrays of a lane; ``table``: the addresses for the functions of a batch."""

    run: LaneArrays
    ends: NDArray[np.float64]
    clamps: NDArray[np.float64]
    states: NDArray[np.float64]
    table: NDArray[np.int64]


class LaneRuns:
    """The native loop over runs in lanes, and its memory."""

    def __init__(
        self,
        compiled: CompiledSystem,
        options: SimulationOptions,
        plan: Plan,
        arrays: Sequence[LaneArrays],
        max_steps: int,
    ) -> None:
        """``arrays``: the arrays of each lane. ``max_steps``: the maximum number of steps of a run."""
        tableau = plan.tableau
        assert isinstance(tableau, ButcherTableau)
        lanes, segments = len(arrays), compiled.breakpoint_count + 1
        self._code = lanes_code(compiled, plan, lanes)
        self._call = _RUNS(self._code.address("runs"))
        samples = plan.sample_times.part(0, plan.sample_times.count)
        self._lanes = [
            _Lane(
                run=lane,
                ends=np.empty(segments),
                clamps=np.empty(segments),
                states=np.empty((samples.size, compiled.sizes.states)),
                table=np.zeros(Place.END, dtype=np.int64),
            )
            for lane in arrays
        ]
        size = LaneWorkspace(tableau, compiled.sizes).size
        memory = np.zeros((size + 1) * lanes)
        unused = -memory.ctypes.data // 8 % lanes  # a row is aligned to its size
        self._memory = memory[unused : unused + size * lanes]
        self._shared = np.zeros(SharedNumber.END)
        self._shared[SharedNumber.STEP], self._shared[SharedNumber.MAX_STEP] = plan.step, plan.max_step
        self._shared[SharedNumber.RTOL], self._shared[SharedNumber.ATOL] = options.rtol, options.atol
        self._counts = np.zeros(SharedCount.END, dtype=np.int64)
        self._counts[SharedCount.MAX_STEPS] = max_steps
        self._counts[SharedCount.STIFFNESS_DETECTION] = plan.stiff is not None
        self._samples = np.append(samples, np.inf)
        self._runs = np.zeros(lanes, dtype=np.int64)
        self._addresses = self._table()

    def _table(self) -> NDArray[np.int64]:
        """The addresses of all arrays."""
        addresses = np.zeros(SharedPlace.END + len(self._lanes) * LanePlace.END, dtype=np.int64)
        code = batch_code()
        addresses[SharedPlace.START] = code.address("run.start")
        addresses[SharedPlace.FINISH] = code.address("run.finish")
        addresses[SharedPlace.SAMPLES] = self._samples.ctypes.data
        addresses[SharedPlace.SHARED] = self._shared.ctypes.data
        addresses[SharedPlace.COUNTS] = self._counts.ctypes.data
        for number, lane in enumerate(self._lanes):
            begin = SharedPlace.END + number * LanePlace.END
            for place, array in (
                (LanePlace.TABLE, lane.table),
                (LanePlace.REALS, lane.run.reals),
                (LanePlace.COUNTS, lane.run.counts),
                (LanePlace.ENDS, lane.ends),
                (LanePlace.CLAMPS, lane.clamps),
                (LanePlace.STATES, lane.states),
                (LanePlace.JUMPS, lane.run.jumps),
                (LanePlace.RUN, self._runs[number:]),
            ):
                addresses[begin + place] = array.ctypes.data
        return addresses

    def compute(self, table: NDArray[np.int64], numbers: NDArray[np.int64], count: int) -> None:
        """Compute the first ``count`` runs of a batch with this table of addresses and these numbers.

        The functions of the batch write the results. The outcome of a run that the lanes do not complete
        remains :attr:`Outcome.OTHER`.
        """
        self._addresses[SharedPlace.PARAMETERS] = table[Place.PARAMETERS]
        self._addresses[SharedPlace.NUMBERS] = numbers.ctypes.data
        for lane in self._lanes:
            own, run = lane.table, lane.run
            own[:] = table
            own[Place.REALS], own[Place.COUNTS] = run.reals.ctypes.data, run.counts.ctypes.data
            own[Place.ENDS], own[Place.CLAMPS] = lane.ends.ctypes.data, lane.clamps.ctypes.data
            own[Place.STATES], own[Place.JUMPS] = lane.states.ctypes.data, run.jumps.ctypes.data
        self._call(self._memory.ctypes.data, self._addresses.ctypes.data, 0, count)


def lanes_code(compiled: CompiledSystem, plan: Plan, lanes: int) -> NativeCode:
    """The native loop of a system in lanes."""
    assert isinstance(plan.tableau, ButcherTableau)
    derivative = "derivative"
    return lane_code(
        compiled.sizes, compiled.digest(derivative), lambda: compiled.tape(derivative), plan.tableau, lanes
    )


def lanes_of_host() -> int:
    """The number of lanes of the vector registers of this processor."""
    return host_target().lanes
