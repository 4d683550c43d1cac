"""``armblocks bench``: measures the time of a robot's kernels on this machine; takes seconds."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from armblocks.cli.completion import complete_robots
from armblocks.cli.terminal import STRONG, results_console, table
from armblocks.errors import counted

if TYPE_CHECKING:
    from armblocks import Arm

METHODS: dict[str, tuple[str, ...]] = {
    "fkine": ("q",),
    "jacob0": ("q",),
    "gravload": ("q",),
    "inertia": ("q",),
    "coriolis": ("q", "qd"),
    "rne": ("q", "qd", "qdd"),
    "accel": ("q", "qd", "tau"),
}
"""The measured functions, with their inputs."""

_REPEATS = 5
"""Number of repeats. Their minimum is reported, because other load affects it least."""


def bench(
    robot: Annotated[
        str, typer.Option(help="A shipped robot's name, or a robot file.", autocompletion=complete_robots)
    ] = "puma560",
    samples: Annotated[int, typer.Option(min=1, max=10_000_000, help="Size of the batch.")] = 100_000,
    threads: Annotated[
        int, typer.Option(min=1, max=1024, help="Number of threads of the third time column.")
    ] = 2,
) -> None:
    """Time the kernels of one robot: single calls, a batch on one thread and on several threads."""
    import armblocks as ab

    arm = ab.load_robot(robot)
    console = results_console()
    console.print(
        f"{arm.name}, {counted(len(arm.robot.joints), 'joint')}; batches of {samples:,}; {os.cpu_count()} "
        "processors; "
        f"the minimum of {_REPEATS} repeats, ns per evaluation",
        style=STRONG,
    )
    columns = ("one call", "batch", f"{threads} threads", "multiplies", "adds", "fused", "others")
    rows = table(("method", "left"), *((name, "right") for name in columns))
    for method, inputs in METHODS.items():
        rows.add_row(method, *_row(arm, method, inputs, samples, threads))
    console.print(rows)


def _row(arm: Arm, method: str, inputs: Sequence[str], samples: int, threads: int) -> list[str]:
    import numpy as np

    generator = np.random.default_rng(0)
    sizes = [arm.nq if name == "q" else arm.n for name in inputs]
    batch = [generator.uniform(-1.0, 1.0, (samples, size)) for size in sizes]
    single = [np.ascontiguousarray(values[0]) for values in batch]
    call = getattr(arm, method)
    out = call(*batch)
    count = arm.operation_count(method)
    calls = 2000

    def many_single_calls() -> None:
        for _ in range(calls):
            call(*single)

    times = (
        _min_time(many_single_calls) / calls,
        _min_time(lambda: call(*batch, out=out)) / samples,
        _min_time(lambda: call(*batch, out=out, threads=threads)) / samples,
    )
    others = count.divisions + count.square_roots + count.comparisons + count.others + count.function_calls
    counts = (count.multiplies, count.adds, count.fused_multiply_adds, others)
    return [*(f"{seconds * 1e9:,.1f}" for seconds in times), *(str(number) for number in counts)]


def _min_time(function: Callable[[], object]) -> float:
    """Minimum time of a call over all repeats, s."""
    best = float("inf")
    for _ in range(_REPEATS):
        start = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - start)
    return best
