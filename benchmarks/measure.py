"""Timing of functions in alternation, medians, and a description of the machine."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

TURN_SECONDS = 0.03
"""Duration of one turn, s. Short functions are called many times, so that cold caches affect one call."""


@dataclass(frozen=True)
class Timing:
    """Seconds per call in each turn (one uninterrupted sequence of calls)."""

    turns: tuple[float, ...]

    @property
    def median(self) -> float:
        return statistics.median(self.turns)

    @property
    def best(self) -> float:
        return min(self.turns)

    def per(self, count: int) -> Timing:
        return Timing(tuple(turn / count for turn in self.turns))

    def times_faster_than(self, other: Timing) -> float:
        """Median over the turns of the time of ``other`` divided by the time of this function."""
        return statistics.median(b / a for a, b in zip(self.turns, other.turns, strict=True))


def in_turn(
    functions: Sequence[Callable[[], object]], repeats: int, warm: int = 1, turn_seconds: float = TURN_SECONDS
) -> list[Timing]:
    """Time the functions in the order A B A B …, so that changes of the clock rate affect all equally."""
    calls: list[int] = []
    for function in functions:
        for _ in range(warm):
            function()
        start = time.perf_counter()
        function()
        calls.append(max(1, round(turn_seconds / (time.perf_counter() - start))))
    seconds: list[list[float]] = [[] for _ in functions]
    for _ in range(repeats):
        for index, function in enumerate(functions):
            start = time.perf_counter()
            for _ in range(calls[index]):
                function()
            seconds[index].append((time.perf_counter() - start) / calls[index])
    return [Timing(tuple(row)) for row in seconds]


def process_in_turn(
    commands: Sequence[Sequence[str]], repeats: int, env: dict[str, str] | None = None
) -> list[Timing]:
    """Time complete processes in alternation (wall time)."""

    def run(command: Sequence[str]) -> Callable[[], object]:
        return lambda: subprocess.run(
            command, check=True, env={**os.environ, **(env or {})}, stdout=subprocess.DEVNULL
        )

    return in_turn([run(command) for command in commands], repeats, turn_seconds=0)


def reachable_peak() -> float:
    """Multiplications and additions per second of one core in a large matrix product.

    A fused multiply-add counts as two operations.
    """
    n = 1024
    a, b = (np.random.default_rng(seed).standard_normal((n, n)) for seed in (0, 1))
    with threadpool_limits(1):
        [timing] = in_turn([lambda: a @ b], 7)
    return 2.0 * n**3 / timing.best


def cpu_name() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def machine_lines(packages: Sequence[str]) -> list[str]:
    """Description of the machine and the package versions, for the first lines of the results."""
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in packages)
    return [
        f"{cpu_name()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}, "
        f"Python {platform.python_version()}",
        versions,
        f"load average at the start {os.getloadavg()[0]:.2f}",
    ]


PYTHON = sys.executable
