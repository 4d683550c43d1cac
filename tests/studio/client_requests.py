"""A client that sends requests to a hub, without a network."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from armblocks.errors import InputError
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.server.hub import Hub, StudioClient

Events = list[dict[str, Any]]


def run_scenario(
    folder: Path,
    scenario: Callable[[Hub, Callable[..., Awaitable[Any]], Events], Awaitable[None]],
    *,
    runs: bool = False,
) -> Events:
    """Let a client send requests to a hub; return the events that it received. ``runs``: models may run."""
    received: Events = []

    async def main() -> None:
        hub = Hub(ProjectFolder(folder))

        async def receive(text: str) -> None:
            received.append(json.loads(text))

        async def receive_bytes(data: bytes) -> None:
            assert runs, "samples arrived without a run"

        client = StudioClient(receive, receive_bytes)
        await hub.welcome(client)
        number = 0

        async def ask(kind: str, **values: Any) -> Any:
            nonlocal number
            number += 1
            await hub.answer(client, json.dumps({"number": number, "request": {"kind": kind, **values}}))
            reply = next(
                event for event in received if event["kind"] == "reply" and event["number"] == number
            )
            if reply["fault"]:
                raise InputError(reply["fault"]["what"], fix=reply["fault"]["fix"])
            return reply["value"]

        await scenario(hub, ask, received)
        hub.close()

    asyncio.run(main())
    return received
