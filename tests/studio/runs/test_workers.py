"""Worker processes: one is always prepared, a dead one is never used, and a failed start is reported."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from armblocks.errors import SimulationError
from armblocks.studio.runs import workers
from armblocks.studio.runs.workers import Worker, Workers


def with_workers(scenario: Callable[[Workers], Awaitable[None]]) -> None:
    async def main() -> None:
        pool = Workers(delay=0.0)
        try:
            await scenario(pool)
        finally:
            pool.end()

    asyncio.run(main())


async def waiting_worker(pool: Workers) -> Worker:
    """The prepared worker for the next run."""
    waiting = pool._next_worker  # pyright: ignore[reportPrivateUsage]
    assert waiting is not None
    return await waiting


def test_the_next_worker_is_started_while_one_is_in_use() -> None:
    async def scenario(pool: Workers) -> None:
        first = await pool.take()
        ready = await waiting_worker(pool)
        second = await pool.take()
        assert second is ready
        assert second.process.pid != first.process.pid
        first.end()
        second.end()

    with_workers(scenario)


def test_a_worker_that_died_while_waiting_is_not_used() -> None:
    async def scenario(pool: Workers) -> None:
        pool.prepare()
        dead = await waiting_worker(pool)
        assert dead.process.pid is not None
        os.kill(dead.process.pid, signal.SIGTERM)
        await asyncio.to_thread(dead.process.join)
        replacement = await pool.take()
        assert replacement is not dead
        assert replacement.process.is_alive()
        replacement.end()

    with_workers(scenario)


def test_taking_a_worker_starts_a_delayed_one_at_once() -> None:
    async def scenario(pool: Workers) -> None:
        pool.prepare(after=3600.0)
        assert pool._next_worker is None  # pyright: ignore[reportPrivateUsage]
        (await pool.take()).end()

    with_workers(scenario)


def test_a_failed_process_start_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> Worker:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(workers, "Worker", refused)

    async def scenario(pool: Workers) -> None:
        with pytest.raises(SimulationError, match="no process for the run could be started") as failed:
            await pool.take()
        assert failed.value.fix == "close other programs, and run the model again"

    with_workers(scenario)


@pytest.mark.skipif(sys.platform != "linux", reason="on other systems every worker imports its modules")
def test_a_worker_is_not_a_fork_of_the_server() -> None:
    # A fork would hold the server's sockets and the locks of its threads in arbitrary states.
    worker = Worker()
    status = Path(f"/proc/{worker.process.pid}/status").read_text()
    parent = int(next(line for line in status.splitlines() if line.startswith("PPid")).split()[1])
    worker.end()
    assert parent != os.getpid()
