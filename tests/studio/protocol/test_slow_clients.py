"""A slow client does not block the server, uses bounded memory, and loses no messages."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol import outbox as outbox_module
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.protocol.outbox import Outbox
from armblocks.studio.server.hub import Hub

TIMEOUT_SECONDS = 180.0


class Listener:
    """A client at the other end of an outbox, which receives only when permitted."""

    def __init__(self) -> None:
        self.may_receive = asyncio.Event()
        self.received: list[str | bytes] = []
        self.changed = asyncio.Event()
        self.outbox = Outbox(self._receive, self._receive)
        self.connection = StudioClient(self.outbox.put, self.outbox.put, self.outbox)
        self.sending = asyncio.create_task(self.outbox.send_all())

    async def _receive(self, message: str | bytes) -> None:
        await self.may_receive.wait()
        self.received.append(message)
        self.changed.set()

    async def until(self, kind: str, **members: Any) -> dict[str, Any]:
        async with asyncio.timeout(TIMEOUT_SECONDS):
            while True:
                self.changed.clear()
                for event in map(
                    json.loads, (message for message in self.received if isinstance(message, str))
                ):
                    if event["kind"] == kind and members.items() <= event.items():
                        return event
                await self.changed.wait()

    async def ask(self, hub: Hub, number: int, kind: str, **values: Any) -> Any:
        await hub.answer(self.connection, json.dumps({"number": number, "request": {"kind": kind, **values}}))
        reply = await self.until("reply", number=number)
        assert reply["fault"] is None
        return reply["value"]


def with_pages(folder: Path, scenario: Callable[[Hub, Listener, Listener], Awaitable[None]]) -> None:
    async def main() -> None:
        hub, fast, suspended = Hub(ProjectFolder(folder)), Listener(), Listener()
        fast.may_receive.set()
        for listener in (fast, suspended):
            await hub.welcome(listener.connection)
        try:
            await scenario(hub, fast, suspended)
        finally:
            for listener in (fast, suspended):
                hub.remove_client(listener.connection)
                listener.sending.cancel()
            hub.close()

    asyncio.run(main())


def of_runs(listener: Listener) -> list[str | bytes]:
    return [
        message for message in listener.received if isinstance(message, bytes) or '"kind":"run_' in message
    ]


def test_a_page_suspended_during_a_run_does_not_delay_others_and_gets_all_messages_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox_module, "CONGESTED_BYTES", 20_000)

    async def scenario(hub: Hub, fast: Listener, suspended: Listener) -> None:
        document = await fast.ask(hub, 1, "open_shipped", document_kind="diagram", name="falling_pendulum")
        request = {"kind": "attach", "document": document, "document_kind": "diagram"}
        attach = {"number": 1, "request": request}
        await hub.answer(suspended.connection, json.dumps(attach))
        before = suspended.outbox._size  # pyright: ignore[reportPrivateUsage]
        run = await fast.ask(hub, 2, "run", document=document)
        await fast.until("run_progress", run=run, state="done")
        # The document can be edited as well.
        await fast.ask(hub, 3, "change", document=document, key="1", edit={"kind": "arrange"})
        more = suspended.outbox._size - before  # pyright: ignore[reportPrivateUsage]
        assert sum(map(len, of_runs(fast))) > 200_000
        assert more < 50_000, "messages of the run are stored on disk, not in memory"
        suspended.may_receive.set()
        await suspended.until("run_progress", run=run, state="done")
        assert of_runs(suspended) == of_runs(fast)

    with_pages(tmp_path, scenario)


def test_the_connection_of_an_unresponsive_page_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox_module, "MAX_BYTES", 1_000_000)

    async def scenario(hub: Hub, fast: Listener, suspended: Listener) -> None:
        document = await fast.ask(hub, 1, "open_shipped", document_kind="diagram", name="kr180model")
        attach = {"kind": "attach", "document": document, "document_kind": "diagram"}
        for number in range(100):
            await hub.answer(
                suspended.connection,
                json.dumps({"number": number, "request": attach}),
            )
            if suspended.outbox.closed:
                break
        assert suspended.outbox.closed
        assert suspended.outbox._size == 0  # pyright: ignore[reportPrivateUsage]
        await fast.ask(hub, 2, "change", document=document, key="1", edit={"kind": "arrange"})

    with_pages(tmp_path, scenario)
