"""Batches on several threads.

The threads take shares of the samples in native code, without the interpreter lock. A thread that starts late
finds fewer shares, or none, and the caller does not wait for it. Waking a sleeping thread takes 0.05 ms, on a
busy machine much longer, and the whole batch of a robot model may take 0.5 ms.
"""

from __future__ import annotations

import ctypes
import os
import threading
import time
from collections.abc import Callable, Sequence
from functools import cache
from queue import SimpleQueue

_SMALLEST_PART = 2048
"""Number of samples that justify another thread."""
_SMALLEST_SHARE = 512
_SHARES_PER_THREAD = 16
_RUNNING = 1
# Iterations of a loop, 1 to 4 ns each.
_HOLD = 2_000
"""Time for which a finished helper leaves the interpreter lock to the calling thread."""
_PATIENCE = 50_000
"""Time for which the calling thread spins for helpers before it sleeps."""

Shares = Callable[..., None]
"""Function of :func:`~armblocks.compiler.batch.emit_shares`: job, hold, patience, addresses of the arrays."""


def worth_while(samples: int, threads: int) -> int:
    """The number of threads that a batch can use."""
    return min(threads, max(1, samples // _SMALLEST_PART))


def evaluate_in_threads(
    shares: Shares, samples: int, addresses: Sequence[int], threads: int, code: object
) -> None:
    """Evaluate all samples. ``code`` keeps the machine code alive until the last thread has left it."""
    share = max(_SMALLEST_SHARE, -(-samples // (threads * _SHARES_PER_THREAD)))
    share += -share % 64  # whole cache lines
    job = (ctypes.c_int64 * 4)(0, 0, share, samples)

    def help_out() -> None:
        # If the batch is complete, this takes no share and does not access the arrays.
        shares(job, _HOLD, 0, *addresses)
        _ = code

    for _ in range(threads - 1):
        _helpers().give(help_out)
    try:
        shares(job, 0, _PATIENCE, *addresses)
    finally:
        _wait_for_helpers(job)


def _wait_for_helpers(job: ctypes.Array[ctypes.c_int64]) -> None:
    """Sleep while a helper is still at work. An interrupt is raised afterwards: the arrays are in use."""
    interrupt: BaseException | None = None
    while job[_RUNNING]:
        try:
            time.sleep(5e-5)
        except BaseException as error:
            interrupt = error
    if interrupt is not None:
        raise interrupt


class _Helpers:
    """A pool of waiting threads. It grows to the largest number that was busy at the same time, up to a
    limit."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._work: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._lock = threading.Lock()
        self._threads = self._busy = 0

    def give(self, work: Callable[[], None]) -> None:
        """Run ``work``, which must not raise, in a free thread."""
        with self._lock:
            self._busy += 1
            another = self._threads < min(self._busy, self._limit)
            self._threads += another
        if another:
            threading.Thread(target=self._run, name="armblocks", daemon=True).start()
        self._work.put(work)

    def _run(self) -> None:
        while True:
            work = self._work.get()
            work()
            del work  # it holds memory
            with self._lock:
                self._busy -= 1


@cache
def _helpers() -> _Helpers:
    return _Helpers(max(64, os.cpu_count() or 1))


if hasattr(os, "register_at_fork"):
    # Threads do not survive a fork: the child process starts new ones.
    os.register_at_fork(after_in_child=_helpers.cache_clear)
