"""Failures of a run's process are reported; the editor and the next run work."""

from __future__ import annotations

import asyncio
import ctypes
import json
import os
import signal
import sys
from collections.abc import Awaitable, Callable
from multiprocessing.connection import Connection
from pathlib import Path
from time import monotonic
from typing import Any

import pytest

from armblocks.errors import SimulationError
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.runs import process as run_process
from armblocks.studio.runs import report as run_report
from armblocks.studio.runs import worker as run_worker
from armblocks.studio.runs import workers
from armblocks.studio.runs.history import RunHistory
from armblocks.studio.server.hub import Hub

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of POSIX")
TIMEOUT_SECONDS = 60.0
"""Time limit far above any normal waiting time, s, so that a hang fails the test."""


class Client:
    """A client that runs models and collects the messages of the runs."""

    def __init__(self, folder: Path) -> None:
        self.hub = Hub(ProjectFolder(folder))
        self.events: list[dict[str, Any]] = []
        self.received = asyncio.Event()
        self.connection = StudioClient(self._receive, self._receive_frame)
        self._number = 0

    async def _receive(self, text: str) -> None:
        self.events.append(json.loads(text))
        self.received.set()

    async def _receive_frame(self, data: bytes) -> None:
        del data

    async def ask(self, kind: str, **values: Any) -> Any:
        self._number += 1
        await self.hub.answer(
            self.connection, json.dumps({"number": self._number, "request": {"kind": kind, **values}})
        )
        reply = next(e for e in reversed(self.events) if e["kind"] == "reply")
        assert reply["fault"] is None, reply["fault"]
        return reply["value"]

    async def until(self, run: str, *states: str) -> dict[str, Any]:
        """Wait for the first message that reports one of these states of a run."""
        async with asyncio.timeout(TIMEOUT_SECONDS):
            while True:
                self.received.clear()
                for event in self.events:
                    if event["kind"] == "run_progress" and event["run"] == run and event["state"] in states:
                        return event
                await self.received.wait()

    def pid(self, run: str) -> int:
        pid = self.hub.runs.processes[run]._worker.process.pid  # pyright: ignore[reportPrivateUsage]
        assert pid is not None
        return pid


def run_scenario(folder: Path, scenario: Callable[[Client], Awaitable[None]]) -> None:
    async def main() -> None:
        client = Client(folder)
        await client.hub.welcome(client.connection)
        try:
            await scenario(client)
        finally:
            client.hub.close()

    asyncio.run(main())


def in_worker(monkeypatch: pytest.MonkeyPatch, start_worker: Callable[[Connection], None]) -> None:
    """Replace the start of the next workers; they then continue as usual."""
    monkeypatch.setattr(workers, "_work", start_worker)


# The following functions run in workers.


def crash(pipe: Connection) -> None:
    def fault(_: RunHistory) -> None:
        ctypes.string_at(0)

    RunHistory.add_snapshot = fault
    run_worker.work(pipe)


def hang_in_python(pipe: Connection) -> None:
    def forever(_: RunHistory) -> None:
        while True:
            pass

    RunHistory.add_snapshot = forever
    run_worker.work(pipe)


def hang_in_native_code(pipe: Connection) -> None:
    def forever(_: RunHistory) -> None:
        ctypes.PyDLL(None).pause()  # Python's global lock is held meanwhile

    RunHistory.add_snapshot = forever
    run_worker.work(pipe)


def use_up_memory(pipe: Connection) -> None:
    def more(_: RunHistory) -> None:
        blocks_of_memory: list[bytes] = []
        while True:
            blocks_of_memory.append(bytes(64 * 2**20))

    run_worker.MAX_MEMORY_BYTES = 4 * 2**30
    RunHistory.add_snapshot = more
    run_worker.work(pipe)


def use_up_the_processor(pipe: Connection) -> None:
    run_worker.MAX_CPU_SECONDS = 1
    hang_in_python(pipe)


def fail_unexpectedly(pipe: Connection) -> None:
    def defect(_: RunHistory) -> None:
        raise KeyError("something")

    RunHistory.add_snapshot = defect
    run_worker.work(pipe)


DEATHS: list[tuple[Callable[[Connection], None], str]] = [
    (crash, "the process of the run crashed (SIGSEGV)"),
    (use_up_memory, "the run exceeds its memory limit"),
    (use_up_the_processor, "the run has exceeded its limit of processor time (SIGXCPU)"),
    (fail_unexpectedly, "armblocks has a defect (KeyError: 'something')"),
]


@pytest.mark.parametrize(("death", "words"), DEATHS)
def test_a_failed_worker_is_reported_and_the_next_run_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, death: Callable[[Connection], None], words: str
) -> None:
    async def scenario(client: Client) -> None:
        document = await client.ask("open_shipped", document_kind="diagram", name="falling_pendulum")
        with monkeypatch.context() as patch:
            in_worker(patch, death)
            client.hub.runs.workers.prepare()
            run = await client.ask("run", document=document)
            last = await client.until(run, "failed", "done")
            assert last["state"] == "failed"
            assert last["fault"]["what"] == words
            assert last["fault"]["where"] == "run"
            assert last["fault"]["fix"]
            client.hub.runs.workers.end()  # the next worker was prepared with the same fault
        assert await client.ask("ping") is None
        await client.ask("change", document=document, key="1", edit={"kind": "arrange"})
        again = await client.ask("run", document=document)
        assert (await client.until(again, "done", "failed"))["state"] == "done"

    run_scenario(tmp_path, scenario)


@pytest.mark.parametrize("hang", [hang_in_python, hang_in_native_code])
def test_stop_ends_a_run_in_any_state_of_its_worker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hang: Callable[[Connection], None]
) -> None:
    in_worker(monkeypatch, hang)

    async def scenario(client: Client) -> None:
        document = await client.ask("open_shipped", document_kind="diagram", name="falling_pendulum")
        run = await client.ask("run", document=document)
        pid = client.pid(run)
        for _ in range(3000):  # more than the capacity of the pipe: sending must not block
            await client.ask("speed", run=run, speed=1.0)
        await client.ask("control", run=run, action="stop")
        last = await client.until(run, "stopped", "failed", "done")
        assert (last["state"], last["fault"]) == ("stopped", None)
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)

    assert run_process.STOP_SECONDS < 1.0  # leaves time for the system to end the process
    run_scenario(tmp_path, scenario)


def test_a_hung_worker_is_killed_without_a_stop_request(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_worker(monkeypatch, hang_in_python)
    monkeypatch.setattr(run_process, "SILENT_SECONDS", 1.0)

    async def scenario(client: Client) -> None:
        document = await client.ask("open_shipped", document_kind="diagram", name="falling_pendulum")
        run = await client.ask("run", document=document)
        assert (await client.until(run, "failed"))["fault"][
            "what"
        ] == "the run does not respond; it was ended"

    run_scenario(tmp_path, scenario)


def test_a_paused_run_is_ended_at_the_time_limit(tmp_path: Path) -> None:
    async def scenario(client: Client) -> None:
        document = await client.ask("open_shipped", document_kind="diagram", name="falling_pendulum")
        run = await client.ask("run", document=document, speed=0.1)
        await client.until(run, "running")
        await client.ask("control", run=run, action="pause")
        await client.until(run, "paused")
        client.hub.runs.processes[run]._deadline = monotonic() + 0.2  # pyright: ignore[reportPrivateUsage]
        await client.ask("control", run=run, action="back")
        last = await client.until(run, "failed")
        assert (
            last["fault"]["what"]
            == f"the run exceeds its time limit of {run_process.MAX_SECONDS:g} s; it was ended"
        )

    run_scenario(tmp_path, scenario)


def test_a_killed_worker_is_reported_and_its_samples_remain(tmp_path: Path) -> None:
    async def scenario(client: Client) -> None:
        document = await client.ask("open_shipped", document_kind="diagram", name="falling_pendulum")
        run = await client.ask("run", document=document, speed=1.0)
        await client.until(run, "running")
        os.kill(client.pid(run), signal.SIGKILL)
        last = await client.until(run, "failed")
        assert "(SIGKILL): the memory may be exhausted" in last["fault"]["what"]
        late: list[str | bytes] = []

        async def receive(text: str | bytes) -> None:
            late.append(text)

        other = StudioClient(receive, receive)
        await client.hub.welcome(other)
        request = {"kind": "attach", "document": document, "document_kind": "diagram"}
        attach = {"number": 1, "request": request}
        await client.hub.answer(other, json.dumps(attach))
        assert any(isinstance(text, bytes) for text in late), (
            "a client that connects later receives the samples"
        )

    run_scenario(tmp_path, scenario)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full exists only on Linux")
def test_a_run_whose_samples_do_not_fit_on_disk_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(**_: object) -> object:
        return Path("/dev/full").open("r+b", buffering=0)

    async def scenario(client: Client) -> None:
        document = await client.ask("open_shipped", document_kind="diagram", name="falling_pendulum")
        with monkeypatch.context() as patch:
            patch.setattr("armblocks.studio.runs.record.tempfile.TemporaryFile", full)
            run = await client.ask("run", document=document)
        last = await client.until(run, "failed", "done")
        assert last["state"] == "failed"
        assert last["fault"]["what"] == (
            "the samples of the run cannot be stored (No space left on device); the run was ended"
        )
        again = await client.ask("run", document=document)
        assert (await client.until(again, "done", "failed"))["state"] == "done"

    run_scenario(tmp_path, scenario)


def crash_in_the_report(pipe: Connection, job: dict[str, Any]) -> None:
    del pipe, job
    ctypes.string_at(0)


def defect_in_the_report(pipe: Connection, job: dict[str, Any]) -> None:
    def defect(_: object) -> None:
        raise KeyError("something")

    run_report.begin_run = defect  # pyright: ignore[reportAttributeAccessIssue]
    run_report.send_report(pipe, job)


@pytest.mark.parametrize(
    ("death", "words"),
    [
        (crash_in_the_report, "the report exceeded its time or memory limit"),
        (defect_in_the_report, "armblocks has a defect (KeyError)"),
    ],
)
def test_a_report_whose_process_fails_raises_an_error_with_the_reason(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    death: Callable[[Connection, dict[str, Any]], None],
    words: str,
) -> None:
    monkeypatch.setattr(run_report, "send_report", death)

    async def scenario(client: Client) -> None:
        document = await client.ask("open_shipped", document_kind="diagram", name="falling_pendulum")
        run = await client.ask("run", document=document)
        await client.until(run, "done")
        with pytest.raises(SimulationError) as refused:
            await client.hub.runs.report(document)
        assert refused.value.what == words

    run_scenario(tmp_path, scenario)
