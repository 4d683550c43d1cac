"""Batches on several threads.

The threads take shares (ranges of samples) in native code, without the interpreter lock. A thread that starts
late finds fewer shares, or none, and the caller does not wait for it. This matters because waking a thread
takes 0.05 ms, on a busy machine much longer, and a whole batch of a robot model may take only 0.5 ms.
"""

from __future__ import annotations

import ctypes
import os
import threading
import time
from collections.abc import Callable, Sequence
from functools import cache
from queue import SimpleQueue

_MIN_SAMPLES_PER_THREAD = 2048
"""Minimum number of samples for each thread."""
_MIN_SHARE = 512
"""Minimum number of samples of a share."""
_SHARES_PER_THREAD = 16
_ACTIVE_THREADS = 1
"""Index of the number of active threads in the job."""
_HOLD = 2_000
"""Iterations (1 to 4 ns each) for which a finished helper leaves the interpreter lock to the caller."""
_PATIENCE = 50_000
"""Iterations (1 to 4 ns each) for which the calling thread spins for helpers before it sleeps."""

Shares = Callable[..., None]
"""Function of :func:`~armblocks.compiler.batch.emit_shares`: job, hold, patience, addresses of the arrays."""


def useful_threads(samples: int, threads: int, minimum: int = _MIN_SAMPLES_PER_THREAD) -> int:
    """The number of threads for a batch: at most ``threads``, each with the ``minimum`` number of samples."""
    return min(threads, max(1, samples // minimum))


def evaluate_in_threads(
    shares: Shares,
    samples: int,
    addresses: Sequence[int],
    threads: int,
    code: object,
    minimum: int = _MIN_SHARE,
) -> None:
    """Evaluate all samples, in shares of at least ``minimum`` samples.

    ``code`` keeps the machine code alive until the last thread has left it.
    """
    share = max(minimum, -(-samples // (threads * _SHARES_PER_THREAD)))
    share += -share % 64  # whole cache lines
    job = (ctypes.c_int64 * 4)(0, 0, share, samples)

    def take_shares() -> None:
        # If the batch is complete, this takes no share and does not access the arrays.
        shares(job, _HOLD, 0, *addresses)
        _ = code

    for _ in range(threads - 1):
        _helpers().submit(take_shares)
    try:
        shares(job, 0, _PATIENCE, *addresses)
    finally:
        _wait_for_helpers(job)


def _wait_for_helpers(job: ctypes.Array[ctypes.c_int64]) -> None:
    """Sleep until no helper is active. An interrupt is raised afterwards, because the arrays are in use."""
    interrupt: BaseException | None = None
    while job[_ACTIVE_THREADS]:
        try:
            time.sleep(5e-5)
        except BaseException as error:
            interrupt = error
    if interrupt is not None:
        raise interrupt


class _Helpers:
    """A pool of threads, which grows with the number of simultaneous jobs, up to a limit."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._lock = threading.Lock()
        self._threads = self._busy = 0

    def submit(self, work: Callable[[], None]) -> None:
        """Run ``work``, which must not raise, in a free thread."""
        with self._lock:
            self._busy += 1
            needs_thread = self._threads < min(self._busy, self._limit)
            self._threads += needs_thread
        if needs_thread:
            threading.Thread(target=self._run, name="armblocks", daemon=True).start()
        self._jobs.put(work)

    def _run(self) -> None:
        while True:
            work = self._jobs.get()
            work()
            del work  # frees the machine code that the function refers to
            with self._lock:
                self._busy -= 1


@cache
def _helpers() -> _Helpers:
    return _Helpers(max(64, os.cpu_count() or 1))


if hasattr(os, "register_at_fork"):
    # Threads do not survive a fork: the child process starts new threads.
    os.register_at_fork(after_in_child=_helpers.cache_clear)
