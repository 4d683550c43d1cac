"""A run in a separate process, whose failures do not affect the editor.

The hub's side of it. The worker is :mod:`armblocks.studio.runs.worker`; between them runs a pipe of bytes:
the first byte of a message says whether JSON (``J``) or a frame of samples (``S``) follows.
"""

from __future__ import annotations

import asyncio
import json
import signal
from collections.abc import Awaitable, Callable
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from time import monotonic
from typing import Annotated, Any

from pydantic import TypeAdapter

from armblocks.errors import InputError
from armblocks.studio.protocol.message import AnyOf
from armblocks.studio.protocol.messages import runs as say
from armblocks.studio.runs.workers import Worker

TellRun = Callable[[say.Message | bytes], Awaitable[None]]
_EVENTS: TypeAdapter[say.RunEvent] = TypeAdapter(Annotated[say.RunEvent, AnyOf()])
STOP_SECONDS = 0.8
"""A worker that has not stopped by itself after this long is ended."""
SILENT_SECONDS = 600.0
"""A worker that says nothing for so long, and is not paused, hangs: it is ended."""
MOST_SECONDS = 24 * 3600.0
"""No run lasts longer than this, however long it is paused."""
JOIN_SECONDS = 5.0
"""A process whose pipe is closed is gone after this long."""
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
        self._commands: SimpleQueue[bytes | None] = SimpleQueue()
        self._until = monotonic() + MOST_SECONDS
        self._forced = False
        """Whether it was told to stop and did not."""
        self._broken: str = ""
        """Why it was ended, where it was not told to stop."""
        self._passing: asyncio.Task[None] | None = None

    def start(self, job: dict[str, Any]) -> None:
        """Hand the worker its job, see :func:`armblocks.studio.runs.worker.work`."""
        self.job = {**job, "run": self.key, "document": self.document}
        self._commands.put(json.dumps(self.job).encode())
        for going in (self._read, self._write):
            Thread(target=going, args=(self._worker.pipe,), daemon=True).start()
        self._passing = self._loop.create_task(self._pass_on())

    def obey(self, request: say.RunCommand) -> None:
        """Pass a command on to the worker; raises ``InputError`` where the run has ended."""
        if self.state in ENDED:
            raise InputError("the run has ended", where="run", fix="start the model again")
        self._commands.put(request.model_dump_json().encode())
        if isinstance(request, say.Control) and request.action == "stop":
            self._loop.call_later(STOP_SECONDS, self._force)

    def end(self) -> None:
        """End the run and its process; nobody is told any more."""
        if self._passing is not None:
            self._passing.cancel()
        self._commands.put(None)
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

    def _write(self, pipe: Connection) -> None:
        """In a thread of its own: what the worker is told. One that does not listen keeps nobody waiting."""
        try:
            while (command := self._commands.get()) is not None:
                pipe.send_bytes(command)
        except OSError:  # it is gone: the thread that reads says so
            pass

    async def _heard(self) -> bytes | None:
        """What the worker says next; it is ended where it says nothing, or goes on, for too long."""
        rest = max(self._until - monotonic(), 0.0)
        patience = min(SILENT_SECONDS, rest) if self.state == "running" else rest
        try:
            async with asyncio.timeout(patience):
                return await self._queue.get()
        except TimeoutError:
            if not self._broken:
                long = f"has gone on for {MOST_SECONDS:g} s" if patience == rest else "hangs"
                self._broken = f"the run {long}: it was ended"
            self._worker.process.kill()
            return await self._queue.get()

    async def _pass_on(self) -> None:
        last: say.RunProgress | None = None
        while (message := await self._heard()) is not None:
            if self._broken:
                continue  # it is being ended; what it says of its own end is not so
            if message[:1] == b"S":
                await self._tell_samples(message[1:])
                continue
            event = _EVENTS.validate_json(message[1:])
            if isinstance(event, say.RunProgress):
                self.state, last = event.state, event
            await self._tell(event)
        self._commands.put(None)
        if self.state not in ENDED:
            await asyncio.to_thread(self._worker.process.join, JOIN_SECONDS)
            self.state = "stopped" if self._forced else "failed"
            await self._tell(self._lost(last))

    async def _tell_samples(self, frame: bytes) -> None:
        """Pass a frame on; where the disk does not take it the run is ended."""
        try:
            await self._tell(frame)
        except OSError as error:
            self._broken = f"the samples of the run cannot be kept ({error.strerror}): it was ended"
            self._worker.process.kill()

    def _lost(self, last: say.RunProgress | None) -> say.RunProgress:
        """What is said of a worker that ended without a word."""
        fault = say.Fault(
            what=self._broken or _cause(self._worker.process.exitcode),
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


def _cause(exitcode: int | None) -> str:
    """Why a process ended that said nothing about it."""
    if exitcode is None or exitcode >= 0:
        return "the process of the run ended without a result"
    names = {one.value: one.name for one in signal.Signals}
    name = names.get(-exitcode, f"signal {-exitcode}")
    match name:
        case "SIGKILL":
            return "the system ended the process of the run (SIGKILL): its memory may have been used up"
        case "SIGXCPU":
            return "the run has used all the processor time that it may have (SIGXCPU)"
        case _:
            return f"the process of the run crashed ({name})"
