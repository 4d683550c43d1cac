"""Batches on several threads: late, busy and interrupted helper threads."""

import ctypes
import threading
from collections.abc import Callable

import numpy as np
import pytest
from small_functions import mixed, same_bits

from armblocks.compiler import batch_threads, compile_function


class DeferredHelpers:
    """Helper threads whose work the test runs later."""

    def __init__(self) -> None:
        self.work: list[Callable[[], None]] = []

    def submit(self, work: Callable[[], None]) -> None:
        self.work.append(work)


def test_a_call_does_not_wait_for_a_late_helper_which_then_writes_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    helpers = DeferredHelpers()
    monkeypatch.setattr(batch_threads, "_helpers", lambda: helpers)
    kernel = compile_function(mixed())
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(9_000, 3)), rng.normal(size=(9_000, 3))
    expected = kernel(a, b)
    out = np.empty((9_000, 11))
    kernel(a, b, out=out, threads=4)
    assert same_bits(out, expected)
    assert len(helpers.work) == 3
    out[:] = 5.0
    del kernel  # the machine code stays in memory while a helper may still run it
    for work in helpers.work:
        work()
    assert (out == 5.0).all()


@pytest.mark.parametrize("samples", [4096, 4097, 10_000, 32_767])
def test_every_sample_is_evaluated_once(samples: int) -> None:
    evaluations = np.zeros(samples, dtype=int)
    lock = threading.Lock()

    def evaluate_job(job: ctypes.Array[ctypes.c_int64], hold: int, patience: int) -> None:
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

    batch_threads.evaluate_in_threads(evaluate_job, samples, (), 3, None)
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

    monkeypatch.setattr(batch_threads, "_helpers", DeferredHelpers)
    monkeypatch.setattr(batch_threads.time, "sleep", sleep)

    def evaluate_job(shared_job: ctypes.Array[ctypes.c_int64], hold: int, patience: int) -> None:
        nonlocal job
        job = shared_job
        job[1] = 1  # a helper is still working when the caller has finished

    job: ctypes.Array[ctypes.c_int64]
    with pytest.raises(KeyboardInterrupt):
        batch_threads.evaluate_in_threads(evaluate_job, 5000, (), 2, None)
    assert running == [1, 1, 1]


def test_helper_threads_are_reused_and_limited_in_number() -> None:
    helpers = batch_threads._Helpers(limit=3)
    started, proceed, done = threading.Semaphore(0), threading.Event(), threading.Semaphore(0)

    def work() -> None:
        started.release()
        proceed.wait()
        done.release()

    for _ in range(5):
        helpers.submit(work)
    for _ in range(3):
        assert started.acquire(timeout=60)
    assert helpers._threads == 3
    proceed.set()
    for _ in range(5):
        assert done.acquire(timeout=60)
    for _ in range(20):  # jobs in sequence start no new threads
        helpers.submit(done.release)
        assert done.acquire(timeout=60)
    assert helpers._threads == 3


def test_small_batches_stay_on_one_thread() -> None:
    assert [batch_threads.useful_threads(samples, 4) for samples in (0, 4095, 4096, 6144, 10**6)] == [
        1,
        1,
        2,
        3,
        4,
    ]
