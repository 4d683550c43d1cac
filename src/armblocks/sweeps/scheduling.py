"""Runs of several programs in threads; the results come in the order of the runs."""

from __future__ import annotations

import dataclasses
import os
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from threading import local
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from armblocks.sweeps.batch import RunProgram, RunRows, Worker

Array = NDArray[np.float64]

FIRST_RUNS, MAX_RUNS = 16, 20_000
"""Number of runs of the first tasks, and maximum number of runs of a task."""
TASK_SECONDS = 0.1
"""Approximate wall time of a task, s."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RunGroup:
    """Runs of one program: their indices ``places`` in a task, and their parameters ``(n, np)``."""

    program: RunProgram
    places: NDArray[np.intp]
    parameters: Array


GroupsOf = Callable[[int, int], Sequence[RunGroup]]
"""The groups of the runs ``begin`` to ``end - 1``."""


def default_threads() -> int:
    """The number of processor cores that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


class Scheduler:
    """Computes runs in ``threads`` threads.

    Ctrl-C cancels the waiting tasks; tasks in progress end at their next check of ``interrupted``.
    """

    def __init__(self, groups_of: GroupsOf, threads: int) -> None:
        self._groups_of = groups_of
        self._threads = threads
        self._memory = local()
        self._programs: dict[int, RunProgram] = {}
        self._seconds_of_a_run = 0.0

    def rows(self, ranges: Iterator[tuple[int, int]]) -> Generator[tuple[int, RunRows]]:
        """The results of ranges of runs ``(begin, end)``: pairs of the first run's number and rows."""
        pending: deque[tuple[int, Future[RunRows]]] = deque()
        pool = ThreadPoolExecutor(self._threads, thread_name_prefix="armblocks-sweep")
        tasks = self._tasks(ranges)
        try:
            while True:
                while len(pending) < 2 * self._threads and (task := next(tasks, None)) is not None:
                    begin, groups, count = task
                    pending.append((begin, pool.submit(self._compute, groups, count)))
                if not pending:
                    return
                begin, future = pending[0]
                rows = future.result()
                pending.popleft()
                yield begin, rows
        finally:
            for program in self._programs.values():
                program.interrupted = True
            for _, future in pending:
                future.cancel()
            pool.shutdown(wait=True)

    def _tasks(self, ranges: Iterator[tuple[int, int]]) -> Iterator[tuple[int, Sequence[RunGroup], int]]:
        """The tasks of all ranges; the measured time of a run determines the number of runs per task."""
        for first, last in ranges:
            begin = first
            while begin < last:
                seconds = self._seconds_of_a_run
                size = int(TASK_SECONDS / seconds) if seconds else FIRST_RUNS
                end = min(last, begin + max(1, min(size, MAX_RUNS)))
                groups = self._groups_of(begin, end)
                for group in groups:
                    self._programs[id(group.program)] = group.program
                yield begin, groups, end - begin
                begin = end

    def _compute(self, groups: Sequence[RunGroup], count: int) -> RunRows:
        """The rows of one task."""
        started = perf_counter()
        parts = [(group.places, self._worker(group.program).compute(group.parameters)) for group in groups]
        rows = parts[0][1] if len(parts) == 1 else joined(groups[0].program.empty_rows(count), parts)
        self._seconds_of_a_run = max(1e-7, (perf_counter() - started) / count)
        return rows

    def _worker(self, program: RunProgram) -> Worker:
        """The memory of this thread for a program."""
        workers: dict[int, Worker] = self._memory.__dict__.setdefault("workers", {})
        worker = workers.get(id(program))
        if worker is None:
            worker = workers[id(program)] = Worker(program)
        return worker


def joined(rows: RunRows, parts: Sequence[tuple[NDArray[np.intp], RunRows]]) -> RunRows:
    """Rows of several groups in the order of the runs."""
    general = 0
    for places, part in parts:
        for name in ("status", "measures", "steps", "events", "end_time", "kept"):
            getattr(rows, name)[places] = getattr(part, name)
        for place, message in zip(places.tolist(), part.messages):
            rows.messages[place] = message
        general += part.general
    return dataclasses.replace(rows, general=general)
