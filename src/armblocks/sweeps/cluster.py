"""Runs of a sweep on the workers of a Dask cluster.

A task has some runs of about 0.1 s in total: the parameters, and the model by its content, from which a
worker makes the program of the runs. The worker keeps the program for later tasks, and takes compiled code
from its own disk cache. The scheduler of Dask repeats the tasks of lost workers; the results of each task are
used once.
"""

from __future__ import annotations

import threading
import uuid
from collections import OrderedDict, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from importlib import metadata
from time import perf_counter
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError
from armblocks.extras import from_extra
from armblocks.sweeps.batch import RunProgram, RunRows, Worker
from armblocks.sweeps.scheduling import GroupsOf, RunGroup, Scheduler, joined

Array = NDArray[np.float64]
Part = tuple[str, NDArray[np.intp], Array]
"""The name of a program, the places of its runs in the task, and their parameters."""
Make = Callable[[], RunProgram]

CONNECT_SECONDS = 10.0
"""Maximum time for the connection to a scheduler, s."""
TASKS_OF_A_THREAD = 3
"""Number of tasks that wait or run for each thread of the cluster."""
KEPT_PROGRAMS = 8
"""Number of programs that a thread of a worker keeps."""

_kept = threading.local()


@contextmanager
def connected(scheduler: object) -> Generator[Any]:
    """A client of a scheduler, given by its address or as a client of ``dask.distributed``.

    Raises ``InputError`` if no scheduler answers, and ``MissingLibraryError`` without the extra ``cluster``.
    """
    if not isinstance(scheduler, str):
        if not (hasattr(scheduler, "submit") and hasattr(scheduler, "nthreads")):
            raise InputError(
                f"the scheduler is {scheduler!r:.80}",
                allowed="an address such as 'tcp://192.168.0.5:8786', or a client of dask.distributed",
                where="sweep",
                fix="start one with 'dask scheduler', and give its address",
            )
        yield scheduler
        return
    with from_extra("cluster", "sweeps on a cluster"):
        from distributed import Client
    make_client = cast("Any", Client)
    try:
        client = make_client(scheduler, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no Dask scheduler answers at '{scheduler}' ({error})",
            allowed="the address that 'dask scheduler' prints, such as 'tcp://192.168.0.5:8786'",
            where="sweep",
            fix="start a scheduler and workers, and check address and port",
        ) from None
    with client:
        yield client


class ClusterScheduler(Scheduler):
    """Computes runs on a cluster. Ctrl-C cancels the tasks that are not finished."""

    def __init__(self, groups_of: GroupsOf, client: Any, maker_of: Callable[[RunProgram], Make]) -> None:
        """``maker_of(program)``: a function that makes the program again on a worker."""
        super().__init__(groups_of, 1)
        self._client = client
        self._maker_of = maker_of
        self._makers: dict[int, tuple[str, Any]] = {}

    def rows(self, ranges: Iterator[tuple[int, int]]) -> Generator[tuple[int, RunRows]]:
        """The results of ranges of runs ``(begin, end)``: pairs of the first run's number and rows."""
        pending: deque[tuple[int, Any]] = deque()
        tasks = self._tasks(ranges)
        most, checked = 0, float("-inf")
        try:
            while True:
                if perf_counter() - checked > 1.0:  # the number of workers changes
                    most = TASKS_OF_A_THREAD * max(1, sum(self._client.nthreads().values()))
                    checked = perf_counter()
                while len(pending) < most and (task := next(tasks, None)) is not None:
                    begin, groups, count = task
                    pending.append((begin, self._submit(groups, count)))
                if not pending:
                    return
                begin, future = pending[0]
                rows, seconds = future.result()
                pending.popleft()
                self._seconds_of_a_run = max(1e-7, seconds / rows.status.size)
                yield begin, rows
        finally:
            if pending:
                self._client.cancel([future for _, future in pending])

    def _submit(self, groups: Sequence[RunGroup], count: int) -> Any:
        """Start a task."""
        known = [self._maker(group.program) for group in groups]
        parts = [(name, group.places, group.parameters) for (name, _), group in zip(known, groups)]
        makers = [future for _, future in known]
        return self._client.submit(compute_parts, parts, makers, count, package_version(), pure=False)

    def _maker(self, program: RunProgram) -> tuple[str, Any]:
        """The name of a program, and the function that makes it, as the result of a task: each worker
        receives it once, and a lost one is repeated."""
        known = self._makers.get(id(program))
        if known is None:
            future = self._client.submit(unchanged, self._maker_of(program), pure=False)
            known = self._makers[id(program)] = (uuid.uuid4().hex, future)
        return known


def unchanged(value: Make) -> Make:
    """The same function, as the result of a task."""
    return value


def compute_parts(
    parts: Sequence[Part], makers: Sequence[Make], count: int, version: str
) -> tuple[RunRows, float]:
    """Compute the runs of one task on a worker; returns their rows and the time, s.

    Raises ``InputError`` if the worker has another version of the package.
    """
    if package_version() != version:
        raise InputError(
            f"a worker of the cluster has armblocks {package_version()}",
            allowed=f"the version of this machine, {version}",
            where="sweep",
            fix="install the same version on all machines",
        )
    workers = [_worker(name, make) for (name, _, _), make in zip(parts, makers, strict=True)]
    started = perf_counter()
    rows = [
        (places, worker.compute(parameters))
        for worker, (_, places, parameters) in zip(workers, parts, strict=True)
    ]
    whole = rows[0][1] if len(rows) == 1 else joined(workers[0].program.empty_rows(count), rows)
    return whole, perf_counter() - started


def package_version() -> str:
    """The version of this package."""
    return metadata.version("armblocks")


def _worker(name: str, make: Make) -> Worker:
    """The memory of this thread for a program."""
    workers: OrderedDict[str, Worker] = _kept.__dict__.setdefault("workers", OrderedDict())
    if name not in workers:
        workers[name] = Worker(make())
    workers.move_to_end(name)
    while len(workers) > KEPT_PROGRAMS:
        workers.popitem(last=False)
    return workers[name]
