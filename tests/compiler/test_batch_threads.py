"""Batches on several threads: late, busy and interrupted helper threads."""

import ctypes
import threading
from collections.abc import Callable

import numpy as np
import pytest
from small_functions import mixed, same_bits

from armblocks.compiler import batch_threads, compile_function


class Later:
    """Helper threads whose work the test runs later."""

    def __init__(self) -> None:
        self.work: list[Callable[[], None]] = []

    def give(self, work: Callable[[], None]) -> None:
        self.work.append(work)


def test_a_call_does_not_wait_for_a_late_helper_which_then_writes_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    later = Later()
    monkeypatch.setattr(batch_threads, "_helpers", lambda: later)
    kernel = compile_function(mixed())
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(9_000, 3)), rng.normal(size=(9_000, 3))
    expected = kernel(a, b)
    out = np.empty((9_000, 11))
    kernel(a, b, out=out, threads=4)
    assert same_bits(out, expected)
    assert len(later.work) == 3
    out[:] = 5.0
    del kernel  # the machine code stays in memory while a helper may still run it
    for work in later.work:
        work()
    assert (out == 5.0).all()


@pytest.mark.parametrize("samples", [4096, 4097, 10_000, 32_767])
def test_every_sample_is_evaluated_once(samples: int) -> None:
    evaluations = np.zeros(samples, dtype=int)
    lock = threading.Lock()

    def shares(job: ctypes.Array[ctypes.c_int64], hold: int, patience: int) -> None:
        """Process a job as the native code does."""
        with lock:
            job[1] += 1
        while True:
            with lock:
                start = job[0]
                job[0] += job[2]
            if start >= job[3]:
                break
            evaluations[start : min(start + job[2], job[3])] += 1
        with lock:
            job[1] -= 1

    batch_threads.evaluate_in_threads(shares, samples, (), 3, None)
    assert (evaluations == 1).all()


def test_an_interrupt_is_raised_after_all_helpers_have_stopped_writing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    running: list[int] = []

    def sleep(seconds: float) -> None:
        running.append(job[1])
        if len(running) == 1:
            raise KeyboardInterrupt
        if len(running) == 3:
            job[1] = 0

    monkeypatch.setattr(batch_threads, "_helpers", Later)
    monkeypatch.setattr(batch_threads.time, "sleep", sleep)

    def shares(shared_job: ctypes.Array[ctypes.c_int64], hold: int, patience: int) -> None:
        nonlocal job
        job = shared_job
        job[1] = 1  # a helper is still working when the caller has finished

    job: ctypes.Array[ctypes.c_int64]
    with pytest.raises(KeyboardInterrupt):
        batch_threads.evaluate_in_threads(shares, 5000, (), 2, None)
    assert running == [1, 1, 1]


def test_helper_threads_are_reused_and_limited_in_number() -> None:
    helpers = batch_threads._Helpers(limit=3)
    begun, go_on, done = threading.Semaphore(0), threading.Event(), threading.Semaphore(0)

    def work() -> None:
        begun.release()
        go_on.wait()
        done.release()

    for _ in range(5):
        helpers.give(work)
    for _ in range(3):
        assert begun.acquire(timeout=60)
    assert helpers._threads == 3
    go_on.set()
    for _ in range(5):
        assert done.acquire(timeout=60)
    for _ in range(20):  # jobs in sequence start no new threads
        helpers.give(done.release)
        assert done.acquire(timeout=60)
    assert helpers._threads == 3


def test_small_batches_stay_on_one_thread() -> None:
    assert [batch_threads.worth_while(samples, 4) for samples in (0, 4095, 4096, 6144, 10**6)] == [
        1,
        1,
        2,
        3,
        4,
    ]
