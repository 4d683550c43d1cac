"""Reuse of the memory of large results that no array refers to any more.

The C library takes the memory of a large array from the system, and returns it when the array is deleted. The
system clears each page at its first write, which takes longer than most kernels: 58 MB take 4.7 ms, the
evaluation 3.9 ms (puma560 ``jacob0``, 200 000 samples, AMD EPYC, pages of 2 MB). The C library itself reuses
at most 32 MB. Reused pages need no clearing.
"""

from __future__ import annotations

import gc
import math
from collections import deque
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.equations import Shape

Array = NDArray[np.float64]

MIN_REUSED = 1 << 19
"""Minimum number of doubles (4 MiB) of memory that is reused. The C library reuses smaller blocks itself."""
MAX_IDLE_BYTES = 128 * 1024 * 1024
"""Maximum number of bytes that a process keeps for later results."""


def new_result(shape: Shape) -> Array:
    """A new array for a result, with undefined numbers."""
    return np.empty(shape) if math.prod(shape) < MIN_REUSED else result_memory().new_array(shape)


@cache
def result_memory() -> ResultMemory:
    """The pool of this process. A full garbage collection (``gc.collect()``) empties it."""
    memory = ResultMemory(MAX_IDLE_BYTES)

    def clear_after_collection(phase: str, info: Mapping[str, int]) -> None:
        if phase == "stop" and info["generation"] == 2:
            memory.clear()

    gc.callbacks.append(clear_after_collection)
    return memory


class ResultMemory:
    """A pool of memory for large results.

    At most ``limit`` bytes that no array refers to are kept. Calls from several threads are safe, because
    ``append`` and ``pop`` of a deque are atomic.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._idle: deque[Array] = deque()  # oldest first

    @property
    def idle(self) -> int:
        """Bytes that are kept for later results."""
        return sum(memory.nbytes for memory in tuple(self._idle))

    def new_array(self, shape: Shape) -> Array:
        """An array of this shape, with undefined numbers."""
        return np.asarray(_Lease(self, self._take(math.prod(shape)), shape))

    def give_back(self, memory: Array) -> None:
        """Keep memory that no array refers to any more; free the oldest blocks above the limit."""
        self._idle.append(memory)
        while self.idle > self._limit:
            try:
                self._idle.popleft()
            except IndexError:  # another thread has taken the block
                break

    def clear(self) -> None:
        """Free all memory that no array refers to."""
        self._idle.clear()

    def _take(self, count: int) -> Array:
        for _ in range(len(self._idle)):
            try:
                memory = self._idle.pop()
            except IndexError:
                break
            if count <= memory.size <= 2 * count:
                return memory
            self._idle.appendleft(memory)  # the size is unsuitable: this block will be freed first
        return np.empty(count + count // 8)  # larger, so that a slightly larger result can reuse the block


class _Lease:
    """The owner of the memory of one result; arrays that are views of it keep it alive."""

    __slots__ = ("_memory", "_pool", "_shape")

    def __init__(self, pool: ResultMemory, memory: Array, shape: Shape) -> None:
        self._pool = pool
        self._memory = memory
        self._shape = shape

    @property
    def __array_interface__(self) -> dict[str, Any]:
        return {**self._memory.__array_interface__, "shape": self._shape}

    def __del__(self) -> None:
        self._pool.give_back(self._memory)
