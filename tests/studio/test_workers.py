"""Processes for runs: one is always there, a dead one is given to nobody, and what is missing is said."""

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


def with_workers(going: Callable[[Workers], Awaitable[None]]) -> None:
    async def whole() -> None:
        pool = Workers(pause=0.0)
        try:
            await going(pool)
        finally:
            pool.end()

    asyncio.run(whole())


async def waiting_worker(pool: Workers) -> Worker:
    """The worker that the next run will get."""
    made = pool._next  # pyright: ignore[reportPrivateUsage]
    assert made is not None
    return await made


def test_the_next_worker_is_made_while_one_is_used() -> None:
    async def going(pool: Workers) -> None:
        first = await pool.take()
        ready = await waiting_worker(pool)
        second = await pool.take()
        assert second is ready
        assert second.process.pid != first.process.pid
        first.end()
        second.end()

    with_workers(going)


def test_a_worker_that_died_while_it_waited_is_given_to_nobody() -> None:
    async def going(pool: Workers) -> None:
        pool.prepare()
        dead = await waiting_worker(pool)
        assert dead.process.pid is not None
        os.kill(dead.process.pid, signal.SIGTERM)
        await asyncio.to_thread(dead.process.join)
        given = await pool.take()
        assert given is not dead
        assert given.process.is_alive()
        given.end()

    with_workers(going)


def test_a_worker_that_is_wanted_later_is_made_at_once_when_it_is_taken() -> None:
    async def going(pool: Workers) -> None:
        pool.prepare(after=3600.0)
        assert pool._next is None  # pyright: ignore[reportPrivateUsage]
        (await pool.take()).end()

    with_workers(going)


def test_a_system_that_gives_no_process_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> Worker:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(workers, "Worker", refused)

    async def going(pool: Workers) -> None:
        with pytest.raises(SimulationError, match="no process for the run could be started") as failed:
            await pool.take()
        assert failed.value.fix == "close other programs, and run the model again"

    with_workers(going)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere every worker imports for itself")
def test_a_worker_is_no_copy_of_the_server() -> None:
    # A copy would hold the server's sockets, and its threads' locks as they happened to be.
    worker = Worker()
    status = Path(f"/proc/{worker.process.pid}/status").read_text()
    parent = int(next(line for line in status.splitlines() if line.startswith("PPid")).split()[1])
    worker.end()
    assert parent != os.getpid()
