"""Inverse kinematics of a traced pose error: the native search, its table of starts and its arrays."""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler import Kernel
from armblocks.compiler.batch import emit_shares
from armblocks.compiler.batch_threads import evaluate_in_threads, useful_threads
from armblocks.compiler.ir_text import Module
from armblocks.compiler.lane_function import emit_lane_function
from armblocks.compiler.native import NativeCode, load_code
from armblocks.compiler.program_text import add_program
from armblocks.compiler.target import host_target
from armblocks.inverse_kinematics.layout import TARGET, Count, Limit, Number, SearchSizes, Setting
from armblocks.inverse_kinematics.native_search import ARRAYS, define_nearest, define_search, define_single
from armblocks.inverse_kinematics.nearest_start import BLOCK
from armblocks.routines.routine import Program

Array = NDArray[np.float64]

MIN_TARGETS_PER_THREAD = 64
"""Minimum number of targets for each thread."""
MIN_SHARE = 16
"""Minimum number of targets of a share."""
_NUMBERS, _COUNTS, _HAS_STARTS = int(Number.COUNT), int(Count.COUNT), int(Setting.HAS_STARTS)


@dataclass(frozen=True, kw_only=True)
class StartTable:
    """Starts of the search: coordinates ``q`` (K, nq) and the poses (K, 4, 4) there."""

    q: Array
    poses: Array

    @classmethod
    def of(cls, q: Array, poses: Array) -> StartTable:
        """The table in the memory layout of the native search."""
        lanes = host_target().lanes
        count = q.shape[0]
        blocks = -(-count // lanes)
        rows = np.full((blocks * lanes, BLOCK), np.inf)
        rows[:count, :-1] = poses.reshape(count, 16)[:, : BLOCK - 1]
        rows[:, -1] = np.arange(blocks * lanes)
        blocked = _aligned((blocks, BLOCK, lanes))
        blocked[...] = rows.reshape(blocks, lanes, BLOCK).transpose(0, 2, 1)
        return cls(q=np.ascontiguousarray(q), poses=blocked)

    @cached_property
    def addresses(self) -> tuple[int, int]:
        """The addresses of the coordinates and of the poses."""
        return _address(self.q), _address(self.poses)


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """Limits of the coordinates: ``lowest``, ``highest`` (nq,), infinite without a limit.

    ``periodic`` (nq,): coordinates whose pose repeats after 2 π. ``largest_step`` (n,): of one iteration.
    """

    lowest: Array
    highest: Array
    periodic: NDArray[np.bool_]
    largest_step: Array


@dataclass(frozen=True, kw_only=True)
class SearchSettings:
    """Settings of a search.

    Tolerances in m and rad. ``weights`` (6,): of the rows of the error, 0 for rows that do not count.
    ``pose_weights`` (12,): of the squared differences of the entries of poses, for the order of the starts.
    """

    position_tolerance: float
    rotation_tolerance: float
    weights: Array
    pose_weights: Array
    attempts: int
    damping: float = 0.03
    first_steps: int = 50
    steps: int = 15
    slow_steps: int = 4
    flat: float = 1e-6
    root_damping: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Solutions:
    """``q`` (N, nq); ``numbers`` (N, 3) and ``counts`` (N, 3) in the order of ``Number`` and ``Count``."""

    q: Array
    numbers: Array
    counts: NDArray[np.int64]


class InverseKinematics:
    """The compiled search of a pose error (:mod:`armblocks.inverse_kinematics.native_search`).

    ``error``: a kernel ``(q, T) -> (error, J)``; ``integrate``: a kernel ``(q, qd, dt) -> q``.
    """

    def __init__(self, error: Kernel, integrate: Kernel, position_of_speed: tuple[int | None, ...]) -> None:
        self.error, self.integrate = error, integrate
        (nq,), (_, n) = error.inputs["q"].shape, error.outputs["J"].shape
        self.sizes = SearchSizes(positions=nq, speeds=n, position_of_speed=position_of_speed)
        self._code: dict[int, tuple[NativeCode, Callable[..., None], Callable[..., None]]] = {}
        self._lock = threading.Lock()

    def solve(
        self,
        targets: Array,
        starts: Array | None,
        settings: Array,
        bounds: Array,
        table: StartTable,
        threads: int = 1,
    ) -> Solutions:
        """Search for a solution of each of the targets (N, 16), from ``starts`` (N, nq) if they are given.

        ``settings`` and ``bounds`` are arrays of :func:`settings_array` and :meth:`bounds_array`. Arrays are
        C-contiguous; they are not checked.
        """
        N, nq = targets.shape[0], self.sizes.positions
        # The results are in one array, because finding the address of an array takes as long as a search
        # step.
        width = nq + _NUMBERS + _COUNTS
        results = np.empty(N * width)
        q, rest = results[: N * nq].reshape(N, nq), results[N * nq :]
        numbers = rest[: N * _NUMBERS].reshape(N, _NUMBERS)
        counts = rest[N * _NUMBERS :].view(np.int64).reshape(N, _COUNTS)
        settings[_HAS_STARTS] = starts is not None
        first, given = _address(results), _address(targets)
        addresses = (
            *(given, first if starts is None else _address(starts), _address(settings), _address(bounds)),
            *(table.addresses[0], table.addresses[1], first),
            *(first + 8 * N * nq, first + 8 * N * (nq + _NUMBERS)),
        )
        code, search, shares = self._loaded(1 if N == 1 else host_target().lanes)
        workers = useful_threads(N, threads, MIN_TARGETS_PER_THREAD)
        if workers == 1:
            search(0, N, N, *addresses)
        else:
            evaluate_in_threads(shares, N, addresses, workers, code=code, minimum=MIN_SHARE)
        return Solutions(q=q, numbers=numbers, counts=counts)

    def of_one_target(
        self, settings: Array, bounds: Array, table: StartTable
    ) -> Callable[[Array], tuple[Array, list[float]]]:
        """A function of one target (4, 4): :meth:`solve` from the table, with less overhead.

        It returns q (nq,), the numbers in the order of ``Number`` and the counts in the order of ``Count``.
        """
        settings = settings.copy()
        settings[_HAS_STARTS] = 0.0
        code = self._loaded(1)[0]
        search = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(code.address("single"))
        nq = self.sizes.positions
        # Passing ctypes arrays takes less time than finding the addresses of NumPy arrays.
        memory, of_target = ctypes.c_double * (nq + _NUMBERS + _COUNTS), ctypes.c_double * TARGET
        constant = np.array([_address(settings), _address(bounds), *table.addresses], dtype=np.uint64)
        kept = code, settings, bounds, table, constant  # the memory at these addresses
        addresses = _address(constant)

        def one(target: Array) -> tuple[Array, list[float]]:
            _ = kept
            results: Any = memory()
            writable: Any = target if target.flags.writeable else target.copy()
            search(addresses, of_target.from_buffer(writable), results)
            return np.frombuffer(results, dtype=np.float64, count=nq), results[nq:]

        return one

    def bounds_array(self, bounds: Bounds) -> Array:
        """The array of limits for :meth:`solve`."""
        rows = np.zeros((int(Limit.COUNT), max(self.sizes.positions, self.sizes.speeds)))
        nq, n = self.sizes.positions, self.sizes.speeds
        rows[Limit.LOWEST, :nq], rows[Limit.HIGHEST, :nq] = bounds.lowest, bounds.highest
        rows[Limit.PERIODIC, :nq], rows[Limit.STEP, :n] = bounds.periodic, 1.0 / bounds.largest_step
        return rows

    def _loaded(self, lanes: int) -> tuple[NativeCode, Callable[..., None], Callable[..., None]]:
        return self._code.get(lanes) or self._load(lanes)

    def _load(self, lanes: int) -> tuple[NativeCode, Callable[..., None], Callable[..., None]]:
        with self._lock:
            if lanes not in self._code:
                key = (self.error.digest, self.integrate.digest, repr(self.sizes), str(lanes))
                code = load_code(("inverse kinematics", *key), lambda: self._write(lanes))
                pointers = [ctypes.c_void_p] * len(ARRAYS)
                search = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 3, *pointers)
                shares = ctypes.CFUNCTYPE(None, ctypes.c_void_p, *[ctypes.c_int64] * 2, *pointers)
                addresses = code.address("search"), code.address("search.shares")
                self._code[lanes] = code, search(addresses[0]), shares(addresses[1])
            return self._code[lanes]

    def _write(self, lanes: int) -> str:
        module = Module()
        emit_lane_function(module, self.error.tape, "evaluate", lanes)
        emit_lane_function(module, self.integrate.tape, "integrate", lanes)
        of_table = Program(host_target().lanes)
        define_nearest(of_table)
        add_program(module, of_table)
        program = Program(lanes)
        define_search(program, self.sizes, "search")
        if lanes == 1:
            define_single(program, self.sizes, "single", "search")
        add_program(module, program)
        emit_shares(module, ARRAYS, "search")
        return module.text


def settings_array(settings: SearchSettings, table: StartTable) -> Array:
    """The array of settings for :meth:`InverseKinematics.solve`."""
    values = np.zeros(int(Setting.COUNT))
    values[Setting.POSITION_TOLERANCE] = settings.position_tolerance**2
    values[Setting.ROTATION_TOLERANCE] = settings.rotation_tolerance**2
    values[Setting.DAMPING] = settings.damping
    values[Setting.FIRST_STEPS], values[Setting.STEPS] = settings.first_steps, settings.steps
    values[Setting.SLOW_STEPS], values[Setting.ATTEMPTS] = settings.slow_steps, settings.attempts
    values[Setting.ROOT_DAMPING] = settings.root_damping
    values[Setting.FLAT] = settings.flat
    values[Setting.BLOCKS] = table.poses.shape[0]
    values[Setting.WEIGHTS : Setting.WEIGHTS + 6] = settings.weights
    values[Setting.POSE_WEIGHTS : Setting.POSE_WEIGHTS + 12] = settings.pose_weights
    return values


def _address(array: NDArray[Any]) -> int:
    return array.__array_interface__["data"][0]


def _aligned(shape: tuple[int, ...]) -> Array:
    """A new array whose first number is aligned to 64 bytes, the size of a row of lanes."""
    count = int(np.prod(shape))
    memory = np.empty(count + 8)
    first = -(memory.ctypes.data // 8) % 8
    return memory[first : first + count].reshape(shape)
