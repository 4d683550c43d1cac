"""A run in a separate process, whose failures do not affect the editor.

This module runs in the server; :mod:`armblocks.studio.runs.worker` runs in the process. They communicate
through a pipe of bytes. The first byte of a message is ``J`` for JSON or ``S`` for a frame of samples.
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
from armblocks.studio.protocol.messages import runs as run_messages
from armblocks.studio.runs.workers import Worker

NotifyRun = Callable[[run_messages.Message | bytes], Awaitable[None]]
_EVENTS: TypeAdapter[run_messages.RunEvent] = TypeAdapter(Annotated[run_messages.RunEvent, AnyOf()])
STOP_SECONDS = 0.8
"""Time after which a worker that has not ended after ``stop`` is killed, s."""
SILENT_SECONDS = 600.0
"""Time without a message after which a running worker counts as hung and is killed, s."""
MAX_SECONDS = 24 * 3600.0
"""Longest duration of a run, pauses included, s."""
JOIN_SECONDS = 5.0
"""Time within which a process ends after its pipe was closed, s."""
FINAL_STATES = ("done", "stopped", "failed")


class RunProcess:
    """One run of one document. The hub creates it; ``notify`` receives its events and frames."""

    def __init__(self, key: str, document: str, worker: Worker, notify: NotifyRun) -> None:
        self.key = key
        self.document = document
        self.state = "running"
        self.job: dict[str, Any] = {}
        """The job that was sent to the worker."""
        self._worker = worker
        self._notify = notify
        self._loop = asyncio.get_running_loop()
        self._queue: asyncio.Queue[bytes | None] = asyncio.Queue()
        self._commands: SimpleQueue[bytes | None] = SimpleQueue()
        self._deadline = monotonic() + MAX_SECONDS
        self._killed = False
        """Whether the worker was killed because it did not end after ``stop``."""
        self._failure: str = ""
        """The reason for killing the worker, other than ``stop``."""
        self._forward_task: asyncio.Task[None] | None = None

    def start(self, job: dict[str, Any]) -> None:
        """Send the worker its job, see :func:`armblocks.studio.runs.worker.work`."""
        self.job = {**job, "run": self.key, "document": self.document}
        self._commands.put(json.dumps(self.job).encode())
        pipe = self._worker.pipe
        writer = Thread(target=self._write, args=(pipe,), daemon=True)
        writer.start()
        Thread(target=self._read, args=(pipe, writer), daemon=True).start()
        self._forward_task = self._loop.create_task(self._forward_messages())

    def send_command(self, request: run_messages.RunCommand) -> None:
        """Send a command to the worker; raises ``InputError`` if the run has ended."""
        if self.state in FINAL_STATES:
            raise InputError("the run has ended", where="run", fix="start the model again")
        self._commands.put(request.model_dump_json().encode())
        if isinstance(request, run_messages.Control) and request.action == "stop":
            self._loop.call_later(STOP_SECONDS, self._kill_if_active)

    def end(self) -> None:
        """Kill the process of the run; no more messages are forwarded."""
        if self._forward_task is not None:
            self._forward_task.cancel()
        self._commands.put(None)
        self._worker.end()

    def _kill_if_active(self) -> None:
        if self.state not in FINAL_STATES:
            self._killed = True
            self._worker.process.kill()

    def _read(self, pipe: Connection, writer: Thread) -> None:
        """Receive all messages of the worker, in a separate thread; ``None`` marks the end of the process.

        The pipe is closed last: until both threads have ended, no other file may get its file descriptor.
        """
        try:
            while True:
                message = pipe.recv_bytes()
                self._loop.call_soon_threadsafe(self._queue.put_nowait, message)
        except (EOFError, OSError):
            pass
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._queue.put_nowait, None)
        self._commands.put(None)
        writer.join()
        pipe.close()

    def _write(self, pipe: Connection) -> None:
        """Send commands to the worker in a separate thread; a hung worker does not block the server."""
        try:
            while (command := self._commands.get()) is not None:
                pipe.send_bytes(command)
        except OSError:  # the process has ended; `_read` reports this
            pass

    async def _next_message(self) -> bytes | None:
        """Return the next message of the worker; kill a worker that sends no message or runs for too long."""
        remaining = max(self._deadline - monotonic(), 0.0)
        timeout = min(SILENT_SECONDS, remaining) if self.state == "running" else remaining
        try:
            async with asyncio.timeout(timeout):
                return await self._queue.get()
        except TimeoutError:
            if not self._failure:
                reason = (
                    f"exceeds its time limit of {MAX_SECONDS:g} s"
                    if timeout == remaining
                    else "does not respond"
                )
                self._failure = f"the run {reason}; it was ended"
            self._worker.process.kill()
            return await self._queue.get()

    async def _forward_messages(self) -> None:
        last: run_messages.RunProgress | None = None
        while (message := await self._next_message()) is not None:
            if self._failure:
                continue  # the worker is being killed; its last messages are not valid
            if message[:1] == b"S":
                await self._forward_samples(message[1:])
                continue
            event = _EVENTS.validate_json(message[1:])
            if isinstance(event, run_messages.RunProgress):
                self.state, last = event.state, event
            await self._notify(event)
        self._commands.put(None)
        if self.state not in FINAL_STATES:
            await asyncio.to_thread(self._worker.process.join, JOIN_SECONDS)
            self.state = "stopped" if self._killed else "failed"
            await self._notify(self._final_progress(last))

    async def _forward_samples(self, frame: bytes) -> None:
        """Forward a frame; end the run if the disk cannot store it."""
        try:
            await self._notify(frame)
        except OSError as error:
            self._failure = f"the samples of the run cannot be stored ({error.strerror}); the run was ended"
            self._worker.process.kill()

    def _final_progress(self, last: run_messages.RunProgress | None) -> run_messages.RunProgress:
        """The final progress message for a worker that ended without one."""
        fault = run_messages.Fault(
            what=self._failure or _cause(self._worker.process.exitcode),
            where="run",
            allowed="a run within the memory and time limits",
            fix="run the model again; if it happens again, record fewer samples or shorten the run",
        )
        return run_messages.RunProgress(
            document=self.document,
            run=self.key,
            state="stopped" if self._killed else "failed",
            time=last.time if last else 0.0,
            real_time_factor=0.0,
            message="stopped" if self._killed else "",
            fault=None if self._killed else fault,
        )


def _cause(exitcode: int | None) -> str:
    """The reason for the end of a process that sent no result."""
    if exitcode is None or exitcode >= 0:
        return "the process of the run ended without a result"
    names = {entry.value: entry.name for entry in signal.Signals}
    name = names.get(-exitcode, f"signal {-exitcode}")
    match name:
        case "SIGKILL":
            return "the system ended the process of the run (SIGKILL): the memory may be exhausted"
        case "SIGXCPU":
            return "the run has exceeded its limit of processor time (SIGXCPU)"
        case _:
            return f"the process of the run crashed ({name})"
