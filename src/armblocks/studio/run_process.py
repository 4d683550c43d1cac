"""A run in a process of its own: what it does to itself, the editor survives.

The hub's side of it. The worker is :mod:`armblocks.studio.run_worker`; between them runs a pipe of bytes: the
first byte of a message says whether JSON (``J``) or a frame of samples (``S``) follows.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any

from pydantic import TypeAdapter

from armblocks.errors import InputError
from armblocks.studio import messages as say
from armblocks.studio.workers import Worker

TellRun = Callable[[say.Message | bytes], Awaitable[None]]
_EVENTS: TypeAdapter[say.RunEvent] = TypeAdapter(say.RunEvent)
STOP_SECONDS = 1.0
"""A worker that has not stopped by itself after this long is ended."""
ENDED = ("done", "stopped", "failed")


class RunProcess:
    """One run of one document. Made by the hub; ``tell`` gets its events and frames, on the hub's loop."""

    def __init__(self, key: str, document: str, worker: Worker, tell: TellRun) -> None:
        self.key = key
        self.document = document
        self.state = "running"
        self.job: dict[str, Any] = {}
        """What the worker was given."""
        self._worker = worker
        self._tell = tell
        self._loop = asyncio.get_running_loop()
        self._queue: asyncio.Queue[bytes | None] = asyncio.Queue()
        self._forced = False
        """Whether it was told to stop and did not."""
        self._passing: asyncio.Task[None] | None = None

    def start(self, job: dict[str, Any]) -> None:
        """Hand the worker its job, see :func:`armblocks.studio.run_worker.work`."""
        self.job = {**job, "run": self.key, "document": self.document}
        self._worker.pipe.send_bytes(json.dumps(self.job).encode())
        Thread(target=self._read, args=(self._worker.pipe,), daemon=True).start()
        self._passing = self._loop.create_task(self._pass_on())

    def obey(self, request: say.Control | say.SetSpeed | say.Rewind | say.Tune) -> None:
        """Pass a command on to the worker; raises ``InputError`` where the run has ended."""
        if self.state in ENDED:
            raise InputError("the run has ended", where="run", fix="start the model again")
        self._worker.pipe.send_bytes(request.model_dump_json().encode())
        if isinstance(request, say.Control) and request.action == "stop":
            self._loop.call_later(STOP_SECONDS, self._force)

    def end(self) -> None:
        """End the run and its process."""
        self._worker.end()

    def _force(self) -> None:
        if self.state not in ENDED:
            self._forced = True
            self._worker.process.kill()

    def _read(self, pipe: Connection) -> None:
        """In a thread of its own: everything that the worker says, and ``None`` when it is gone."""
        try:
            while True:
                message = pipe.recv_bytes()
                self._loop.call_soon_threadsafe(self._queue.put_nowait, message)
        except (EOFError, OSError):
            pass
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._queue.put_nowait, None)

    async def _pass_on(self) -> None:
        last: say.RunProgress | None = None
        while (message := await self._queue.get()) is not None:
            if message[:1] == b"S":
                await self._tell(message[1:])
                continue
            event = _EVENTS.validate_json(message[1:])
            if isinstance(event, say.RunProgress):
                self.state, last = event.state, event
            await self._tell(event)
        if self.state not in ENDED:
            self.state = "stopped" if self._forced else "failed"
            await self._tell(self._lost(last))

    def _lost(self, last: say.RunProgress | None) -> say.RunProgress:
        """What is said of a worker that ended without a word."""
        fault = say.Fault(
            what="the process of the run ended without a result",
            where="run",
            allowed="a run within the limits of memory and time",
            fix="run the model again; if it happens again, record fewer samples or shorten the run",
        )
        return say.RunProgress(
            run=self.key,
            state="stopped" if self._forced else "failed",
            time=last.time if last else 0.0,
            real_time_factor=0.0,
            message="stopped" if self._forced else "",
            fault=None if self._forced else fault,
        )
