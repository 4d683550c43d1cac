"""The runs of the open diagrams: at most one for each diagram, in a separate process."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Mapping
from typing import Any

from armblocks.diagram import Diagram
from armblocks.errors import InputError, UnknownNameError
from armblocks.studio.protocol.clients import Clients, StudioClient
from armblocks.studio.protocol.message import Message
from armblocks.studio.protocol.messages import runs as run_messages
from armblocks.studio.protocol.request_handlers import RequestHandlers
from armblocks.studio.runs.process import RunProcess
from armblocks.studio.runs.record import RunRecord
from armblocks.studio.runs.report import report_of
from armblocks.studio.runs.workers import Workers
from armblocks.studio.sheet.open_documents import OpenDocuments
from armblocks.studio.sheet.renames import PathNames

FIRST_WORKER_DELAY_SECONDS = 1.5
"""Delay of the first worker process after a client has connected, so that the client can draw first, s."""


class DiagramRuns:
    """Starts runs, passes commands to them, and sends their messages to all clients that show the diagram."""

    def __init__(
        self, clients: Clients, diagrams: OpenDocuments, job: Callable[[Diagram], dict[str, Any]]
    ) -> None:
        self.processes: dict[str, RunProcess] = {}
        self.workers = Workers()
        self._clients = clients
        self._diagrams = diagrams
        self._job = job
        self._records: dict[str, RunRecord] = {}
        self._names: dict[str, PathNames] = {}
        self._send_tasks: set[asyncio.Task[None]] = set()

    def register(self, handlers: RequestHandlers) -> None:
        """Register the handlers of the requests about runs."""
        handlers.on(run_messages.Run, self._run)
        for command in (run_messages.Control, run_messages.SetSpeed, run_messages.Rewind, run_messages.Tune):
            handlers.on(command, self._command)

    def run_key(self, document: str) -> str | None:
        """The key of the run of a diagram, or ``None``."""
        return next((run.key for run in self.processes.values() if run.document == document), None)

    def on_shown(self, client: StudioClient, document: str) -> None:
        """Send a client that opened a diagram the record of its run; start the process of the next run."""
        if (run := self.run_key(document)) is not None:
            self._send_later(client, run, 0)
        self.workers.prepare(after=FIRST_WORKER_DELAY_SECONDS)

    async def rename(self, document: str, renamed: Mapping[str, str]) -> None:
        """Notify the clients of a diagram's run about renamed blocks: old path to new path."""
        if (run := self.run_key(document)) is None:
            return
        self._names[run].rename(renamed)
        if self._names[run].started:
            await self._notify_showing(run, document, _renamed(run, renamed))

    async def report(self, document: str) -> bytes:
        """Return the report of the last run of a diagram as HTML; raises ``ArmblocksError``."""
        key = self._diagrams[document].key
        jobs = [run.job for run in self.processes.values() if run.document == key]
        if not jobs:
            raise InputError("there is no run for a report", where="report", fix="run the model first")
        return await report_of(jobs[-1])

    def close(self) -> None:
        """End every run."""
        for task in self._send_tasks:
            task.cancel()
        for run in self.processes.values():
            run.end()
        for record in self._records.values():
            record.close()
        self.workers.end()

    # -- requests --------------------------------------------------------------------------------------------

    async def _run(self, _: StudioClient, request: run_messages.Run) -> str:
        open_file = self._diagrams[request.document]
        key, names = secrets.token_hex(8), PathNames()

        async def notify(event: Message | bytes) -> None:
            if isinstance(event, run_messages.RunTuned):
                event = event.model_copy(update={"parameter": names.present(event.parameter)})
            await self._notify_showing(key, open_file.key, event)
            if isinstance(event, run_messages.RunStarted):
                names.started = True
                for renamed in names.renames:
                    await self._notify_showing(key, open_file.key, _renamed(key, renamed))

        worker = await self.workers.take()
        for other in list(self.processes.values()):
            if other.document == open_file.key:
                other.end()
                del self.processes[other.key]
                self._records.pop(other.key).close()
                del self._names[other.key]
        job = {**self._job(open_file.document.diagram), "speed": request.speed, "tuned": request.tuned}
        run = RunProcess(key, open_file.key, worker, notify)
        self.processes[key], self._records[key], self._names[key] = run, RunRecord(), names
        run.start(job)
        return run.key

    async def _command(self, _: StudioClient, request: run_messages.RunCommand) -> None:
        if request.run not in self.processes:
            raise UnknownNameError("run", request.run, self.processes)
        if isinstance(request, run_messages.Tune):
            names = self._names[request.run]
            original = {names.original(path): value for path, value in request.values.items()}
            request = request.model_copy(update={"values": original})
        self.processes[request.run].send_command(request)

    # -- messages to clients ---------------------------------------------------------------------------------

    async def _notify_showing(self, run: str, document: str, event: Message | bytes) -> None:
        """Record a message of a run, and send it to all clients that show the diagram."""
        payload = event if isinstance(event, bytes) else event.model_dump_json()
        record = self._records[run]
        record.append(payload)
        for client in [
            client for client in self._clients.showing(document) if run not in client.records_in_progress
        ]:
            if client.congested:
                self._send_later(client, run, len(record) - 1)
            else:
                await client.send(payload)

    def _send_later(self, client: StudioClient, run: str, begin: int) -> None:
        """Send a client the messages of a run from number ``begin`` on, as fast as the client receives them.

        This is for clients that have just connected or are congested. Live messages of the run are withheld
        from the client until it has received the record.
        """
        client.records_in_progress[run] = begin
        task = asyncio.get_running_loop().create_task(self._notify(client, run))
        self._send_tasks.add(task)
        task.add_done_callback(self._send_tasks.discard)

    async def _notify(self, client: StudioClient, run: str) -> None:
        record = self._records[run]
        while (
            client.records_in_progress[run] < len(record)
            and self._records.get(run) is record
            and client in self._clients
        ):
            client.records_in_progress[run] += 1
            await client.send(record[client.records_in_progress[run] - 1])
            await client.room()
        del client.records_in_progress[run]


def _renamed(run: str, renamed: Mapping[str, str]) -> run_messages.RunRenamed:
    return run_messages.RunRenamed(run=run, renamed=dict(renamed))
