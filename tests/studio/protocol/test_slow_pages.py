"""A slow page does not block the server, uses bounded memory, and loses no messages."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol import outbox as outbox_module
from armblocks.studio.protocol.outbox import Outbox
from armblocks.studio.protocol.page import Page
from armblocks.studio.server.hub import Hub

TIMEOUT_SECONDS = 180.0


class Listener:
    """A page at the other end of an outbox, which receives only when permitted."""

    def __init__(self) -> None:
        self.listens = asyncio.Event()
        self.heard: list[str | bytes] = []
        self.news = asyncio.Event()
        self.outbox = Outbox(self._hear, self._hear)
        self.page = Page(self.outbox.put, self.outbox.put, self.outbox)
        self.sending = asyncio.create_task(self.outbox.send_all())

    async def _hear(self, message: str | bytes) -> None:
        await self.listens.wait()
        self.heard.append(message)
        self.news.set()

    async def until(self, kind: str, **members: Any) -> dict[str, Any]:
        async with asyncio.timeout(TIMEOUT_SECONDS):
            while True:
                self.news.clear()
                for event in map(json.loads, (message for message in self.heard if isinstance(message, str))):
                    if event["kind"] == kind and members.items() <= event.items():
                        return event
                await self.news.wait()

    async def ask(self, hub: Hub, number: int, kind: str, **values: Any) -> Any:
        await hub.answer(self.page, json.dumps({"number": number, "request": {"kind": kind, **values}}))
        reply = await self.until("reply", number=number)
        assert reply["fault"] is None
        return reply["value"]


def with_pages(folder: Path, scenario: Callable[[Hub, Listener, Listener], Awaitable[None]]) -> None:
    async def main() -> None:
        hub, lively, frozen = Hub(ProjectFolder(folder)), Listener(), Listener()
        lively.listens.set()
        for listener in (lively, frozen):
            await hub.welcome(listener.page)
        try:
            await scenario(hub, lively, frozen)
        finally:
            for listener in (lively, frozen):
                hub.leave(listener.page)
                listener.sending.cancel()
            hub.close()

    asyncio.run(main())


def of_runs(listener: Listener) -> list[str | bytes]:
    return [message for message in listener.heard if isinstance(message, bytes) or '"kind":"run_' in message]


def test_a_page_suspended_during_a_run_delays_nobody_and_gets_all_messages_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox_module, "CONGESTED_BYTES", 20_000)

    async def scenario(hub: Hub, lively: Listener, frozen: Listener) -> None:
        document = await lively.ask(hub, 1, "open_shipped", document_kind="diagram", name="falling_pendulum")
        request = {"kind": "attach", "document": document, "document_kind": "diagram"}
        attach = {"number": 1, "request": request}
        await hub.answer(frozen.page, json.dumps(attach))
        before = frozen.outbox._size  # pyright: ignore[reportPrivateUsage]
        run = await lively.ask(hub, 2, "run", document=document)
        await lively.until("run_progress", run=run, state="done")
        # The document can be edited as well.
        await lively.ask(hub, 3, "change", document=document, key="1", edit={"kind": "arrange"})
        more = frozen.outbox._size - before  # pyright: ignore[reportPrivateUsage]
        assert sum(map(len, of_runs(lively))) > 200_000
        assert more < 50_000, "messages of the run are stored on disk, not in memory"
        frozen.listens.set()
        await frozen.until("run_progress", run=run, state="done")
        assert of_runs(frozen) == of_runs(lively)

    with_pages(tmp_path, scenario)


def test_the_connection_of_an_unresponsive_page_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox_module, "MAX_BYTES", 1_000_000)

    async def scenario(hub: Hub, lively: Listener, frozen: Listener) -> None:
        document = await lively.ask(hub, 1, "open_shipped", document_kind="diagram", name="kr180model")
        attach = {"kind": "attach", "document": document, "document_kind": "diagram"}
        for number in range(100):
            await hub.answer(
                frozen.page,
                json.dumps({"number": number, "request": attach}),
            )
            if frozen.outbox.closed:
                break
        assert frozen.outbox.closed
        assert frozen.outbox._size == 0  # pyright: ignore[reportPrivateUsage]
        await lively.ask(hub, 2, "change", document=document, key="1", edit={"kind": "arrange"})

    with_pages(tmp_path, scenario)
