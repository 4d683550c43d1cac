"""The pool of worker processes: each is used once, and the next one is started in advance.

On Linux a worker is a copy of a process that has imported all that a run needs and does nothing else
(Python's fork server): it is there in some milliseconds and shares that memory. Elsewhere every worker
imports for itself, ahead of time.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import sys
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from armblocks.errors import SimulationError

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerContext, SpawnContext

COPIED = ("__main__", "armblocks.studio.runs.worker", "armblocks.studio.runs.report")
"""Modules that the process imports of which workers are copies."""


def process_context() -> ForkServerContext | SpawnContext:
    """How processes of the studio begin: never as a copy of the server, which has threads and sockets."""
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(COPIED))
    return context


def _work(pipe: Connection) -> None:
    from armblocks.studio.runs.worker import work  # the server itself need not import what only a run needs

    work(pipe)


class Worker:
    """A process that waits for a run, with all that is slow to import already there."""

    def __init__(self) -> None:
        context = process_context()
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs,), daemon=True)
        self.process.start()
        theirs.close()

    def end(self) -> None:
        """End the process at once."""
        self.process.kill()
        self.pipe.close()


PAUSE_SECONDS = 0.5
"""A run that begins has the machine for itself for so long: then the next worker is made."""


class Workers:
    """Gives out workers; while one runs, the next is made aside."""

    def __init__(self, pause: float = PAUSE_SECONDS) -> None:
        self._pause = pause
        self._next: asyncio.Task[Worker] | None = None
        self._later: asyncio.TimerHandle | None = None

    def prepare(self, after: float = 0.0) -> None:
        """Have a worker made, if none is, ``after`` so many seconds in which others may need the machine."""
        if self._later is not None:
            self._later.cancel()
        if after > 0.0:
            self._later = asyncio.get_running_loop().call_later(after, self.prepare)
        elif self._next is None:
            self._next = asyncio.get_running_loop().create_task(asyncio.to_thread(Worker))

    async def take(self) -> Worker:
        """A worker for one run. Raises ``SimulationError`` where the system gives no process."""
        while True:
            self.prepare()
            made, self._next = self._next, None
            assert made is not None
            try:
                worker = await made
            except (OSError, EOFError) as error:
                raise SimulationError(
                    f"no process for the run could be started ({error})",
                    where="run",
                    allowed="a process of its own for each run",
                    fix="close other programs, and run the model again",
                ) from None
            if worker.process.is_alive():
                self.prepare(after=self._pause)
                return worker

    def end(self) -> None:
        """End the worker that waits."""
        if self._later is not None:
            self._later.cancel()
        if self._next is None:
            return
        if self._next.done() and not self._next.cancelled() and self._next.exception() is None:
            self._next.result().end()
        self._next.cancel()
        self._next = None
