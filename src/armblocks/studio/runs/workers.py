"""The pool of worker processes: each is used once, and the next worker is started in advance.

On Linux, a worker is forked from a process that has imported all modules for a run and does nothing else
(Python's fork server). The worker starts within milliseconds and shares the memory of these modules. On other
systems every worker imports the modules itself, in advance.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import sys
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

from armblocks.errors import SimulationError

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerContext, SpawnContext

PRELOADED = (
    "__main__",
    "armblocks.studio.runs.worker",
    "armblocks.studio.runs.report",
    "armblocks.studio.runs.checks",
)
"""Modules that the fork server imports."""


def process_context() -> ForkServerContext | SpawnContext:
    """The start method of processes; the server is never forked, because it has threads and sockets."""
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(PRELOADED))
    return context


async def process_reply(
    send_reply: Callable[[Connection, dict[str, Any]], None], job: Mapping[str, Any], seconds: float
) -> bytes:
    """Return the message that ``send_reply`` sends in a new process; ``b""`` if it sends none in time."""
    context = process_context()
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=send_reply, args=(sender, dict(job)), daemon=True)
    await asyncio.to_thread(process.start)
    sender.close()
    try:
        return await asyncio.to_thread(_received, receiver, seconds)
    finally:
        process.kill()
        receiver.close()


def _received(pipe: Connection, seconds: float) -> bytes:
    try:
        return pipe.recv_bytes() if pipe.poll(seconds) else b""
    except (EOFError, OSError):
        return b""


def _work(pipe: Connection) -> None:
    from armblocks.studio.runs.worker import work  # the server does not need these imports

    work(pipe)


class Worker:
    """A process that has imported all modules and waits for a run."""

    def __init__(self) -> None:
        context = process_context()
        self.pipe, sender = context.Pipe()
        self.process = context.Process(target=_work, args=(sender,), daemon=True)
        self.process.start()
        sender.close()

    def end(self) -> None:
        """Kill the process. Its end of the pipe closes: a thread that reads the pipe gets an EOFError."""
        self.process.kill()


NEXT_WORKER_DELAY_SECONDS = 0.5
"""Delay between the start of a run and the start of the next worker, so that the run starts alone, s."""


class Workers:
    """Provides workers; during a run the next worker is started in advance."""

    def __init__(self, delay: float = NEXT_WORKER_DELAY_SECONDS) -> None:
        self._delay = delay
        self._next_worker: asyncio.Task[Worker] | None = None
        self._timer: asyncio.TimerHandle | None = None

    def prepare(self, after: float = 0.0) -> None:
        """Start a worker after ``after`` seconds, if none is waiting."""
        if self._timer is not None:
            self._timer.cancel()
        if after > 0.0:
            self._timer = asyncio.get_running_loop().call_later(after, self.prepare)
        elif self._next_worker is None:
            self._next_worker = asyncio.get_running_loop().create_task(asyncio.to_thread(Worker))

    async def take(self) -> Worker:
        """Return a worker for one run. Raises ``SimulationError`` if no process can be started."""
        while True:
            self.prepare()
            starting, self._next_worker = self._next_worker, None
            assert starting is not None
            try:
                worker = await starting
            except (OSError, EOFError) as error:
                raise SimulationError(
                    f"no process for the run could be started ({error})",
                    where="run",
                    allowed="a separate process for each run",
                    fix="close other programs, and run the model again",
                ) from None
            if worker.process.is_alive():
                self.prepare(after=self._delay)
                return worker

    def end(self) -> None:
        """Kill the waiting worker."""
        if self._timer is not None:
            self._timer.cancel()
        if self._next_worker is None:
            return
        if (
            self._next_worker.done()
            and not self._next_worker.cancelled()
            and self._next_worker.exception() is None
        ):
            self._next_worker.result().end()
        self._next_worker.cancel()
        self._next_worker = None
