"""Memory pool of large results: reuse only when no array refers to the memory, and bounded size."""

import gc
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from small_functions import mixed, same_bits

from armblocks.compiler import compile_function
from armblocks.compiler.result_memory import MIN_REUSED, ResultMemory, new_result, result_memory


def address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def test_memory_is_reused_once_no_array_refers_to_it() -> None:
    pool = ResultMemory(limit=1 << 20)
    first = pool.new_array((50, 4, 5))
    assert first.shape == (50, 4, 5)
    assert first.dtype == np.float64
    assert first.flags.c_contiguous
    assert first.flags.writeable
    assert first.flags.aligned
    first[...] = 7.0
    start, view = address(first), memoryview(first[3:4])
    del first
    assert pool.idle == 0  # the view refers to it
    second = pool.new_array((1000,))
    second[...] = 8.0
    assert address(second) != start
    assert (np.asarray(view) == 7.0).all()
    del view
    assert 8000 <= pool.idle <= 9000
    assert address(pool.new_array((25, 40))) == start


def test_idle_memory_of_another_size_is_not_reused() -> None:
    pool = ResultMemory(limit=1 << 20)
    array = pool.new_array((1000,))
    del array
    assert pool.new_array((2000,)).size == 2000  # the idle memory is too small
    assert pool.new_array((100,)).size == 100  # the idle memory is much larger
    assert pool.idle > 8 * 3000


def test_idle_memory_is_bounded_and_can_be_freed() -> None:
    pool = ResultMemory(limit=50_000)
    results = [pool.new_array((1000,)) for _ in range(20)]
    results.clear()
    assert 40_000 < pool.idle <= 50_000
    assert pool.new_array((10_000,)).size == 10_000  # larger than the idle memory
    assert pool.idle <= 50_000  # and above the limit of the pool
    pool.clear()
    assert pool.idle == 0


def test_no_two_results_share_memory() -> None:
    """Four threads allocate and drop results of random size; each result is checked when it is dropped."""
    pool = ResultMemory(limit=200_000)
    overwritten: list[float] = []

    def work(seed: int) -> None:
        rng = np.random.default_rng(seed)
        held: list[np.ndarray] = []
        for turn in range(400):
            if len(held) > rng.integers(6):
                dropped = held.pop(rng.integers(len(held)))
                overwritten.extend(dropped[dropped != dropped[0]])
            result = pool.new_array((int(rng.integers(1, 3000)),))
            result[...] = 1000 * seed + turn
            held.append(result)

    workers = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert overwritten == []
    assert pool.idle <= 200_000


def test_small_results_own_their_memory() -> None:
    assert new_result((MIN_REUSED - 1,)).flags.owndata
    assert not new_result((MIN_REUSED,)).flags.owndata


@pytest.fixture
def no_collection() -> Iterator[None]:
    """Disable garbage collection, which would free the idle memory that the test expects."""
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures("no_collection")
def test_large_batches_in_pool_memory_are_correct() -> None:
    kernel = compile_function(mixed())
    rng = np.random.default_rng(1)
    count = MIN_REUSED // 11 + 100
    a, b = rng.normal(size=(count, 3)), rng.normal(size=(count, 3))
    expected = kernel.entry(a, b, out=np.empty((count, 11)))
    first = kernel.entry(a, b)
    start = address(first)
    assert not first.flags.owndata
    assert same_bits(first, expected)
    second = kernel.entry(b, a)
    assert not np.shares_memory(first, second)
    assert same_bits(first, expected)
    del first
    assert address(kernel.entry(a, b, threads=2)) == start
    del second
    assert result_memory().idle > 0
    gc.collect()
    assert result_memory().idle == 0
