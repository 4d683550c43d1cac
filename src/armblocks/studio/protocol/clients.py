"""The connected clients, with their connections and the documents that they show."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from starlette.websockets import WebSocketDisconnect

from armblocks.studio.protocol.outbox import Outbox, Payload

if TYPE_CHECKING:
    from armblocks.studio.protocol.message import Message

DISCONNECTED = (RuntimeError, ConnectionError, WebSocketDisconnect)
"""Exceptions raised by sending to a disconnected client."""
SendText = Callable[[str], Awaitable[None]]
SendBytes = Callable[[bytes], Awaitable[None]]


class InvalidRequestError(ValueError):
    """The text from a client is not a request of the studio."""


@dataclass(eq=False)
class StudioClient:
    """One connected browser tab. The hub manages its documents, runs and robots."""

    send_text: SendText
    send_bytes: SendBytes
    outbox: Outbox | None = None
    """The queue through which both functions send, if there is one."""
    shows: dict[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    """Displayed documents, with the path of the displayed sheet."""
    records_in_progress: dict[str, int] = field(default_factory=dict[str, int])
    """Runs whose record is being sent, with the number of sent messages. Their live messages are withheld."""

    @property
    def congested(self) -> bool:
        """Whether its queue is so long that no more samples of a run should be added."""
        return self.outbox is not None and self.outbox.congested

    async def room(self) -> None:
        """Wait until :attr:`congested` is false."""
        if self.outbox is not None:
            await self.outbox.room()

    async def notify(self, event: Message) -> None:
        """Send an event; a disconnected client is ignored."""
        await self.send(event.model_dump_json())

    async def send(self, payload: Payload) -> None:
        """Send a message or a frame without conversion."""
        with contextlib.suppress(*DISCONNECTED):
            await (self.send_text(payload) if isinstance(payload, str) else self.send_bytes(payload))


class Clients:
    """The clients that are connected to one server."""

    def __init__(self) -> None:
        self._connected: set[StudioClient] = set()

    def __contains__(self, client: StudioClient) -> bool:
        return client in self._connected

    def __iter__(self) -> Iterator[StudioClient]:
        return iter(list(self._connected))

    def add(self, client: StudioClient) -> None:
        """Add a client that has connected."""
        self._connected.add(client)

    def discard(self, client: StudioClient) -> None:
        """Remove a client that has disconnected."""
        self._connected.discard(client)

    def showing(self, document: str) -> list[StudioClient]:
        """The clients that show a document."""
        return [client for client in self if document in client.shows]

    async def notify(self, event: Message) -> None:
        """Send an event to every client."""
        await asyncio.gather(*(client.notify(event) for client in self))

    async def notify_showing(self, document: str, event: Message) -> None:
        """Send an event to every client that shows a document."""
        await asyncio.gather(*(client.notify(event) for client in self.showing(document)))
