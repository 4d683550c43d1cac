"""The connected pages, with their connections and displayed documents."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from starlette.websockets import WebSocketDisconnect

from armblocks.studio.protocol.outbox import Outbox, Said

if TYPE_CHECKING:
    from armblocks.studio.protocol.message import Message

GONE = (RuntimeError, ConnectionError, WebSocketDisconnect)
"""What sending to a page raises that has left."""
SendText = Callable[[str], Awaitable[None]]
SendBytes = Callable[[bytes], Awaitable[None]]


class NoRequestError(ValueError):
    """What a page has sent is no request of the studio."""


@dataclass(eq=False)
class Page:
    """One page. Its documents, runs and robots are the hub's affair."""

    send_text: SendText
    send_bytes: SendBytes
    outbox: Outbox | None = None
    """Through which both send, where the page may be slower than what is sent."""
    shows: dict[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    """Documents that it shows, and the path of the sheet that it looks at."""
    hears: dict[str, int] = field(default_factory=dict[str, int])
    """Runs that it is told from their record, and how far: until then it gets nothing else of them."""

    @property
    def behind(self) -> bool:
        """Whether it has so much to come that it should not get more of a run yet."""
        return self.outbox is not None and self.outbox.behind

    async def room(self) -> None:
        """Return when it is not behind."""
        if self.outbox is not None:
            await self.outbox.room()

    async def tell(self, event: Message) -> None:
        """Send an event; a page that is gone is nobody's trouble."""
        await self.send(event.model_dump_json())

    async def send(self, said: Said) -> None:
        """Send a message or a frame as it is."""
        with contextlib.suppress(*GONE):
            await (self.send_text(said) if isinstance(said, str) else self.send_bytes(said))


class Pages:
    """The pages that are connected to one server."""

    def __init__(self) -> None:
        self._connected: set[Page] = set()

    def __contains__(self, page: Page) -> bool:
        return page in self._connected

    def __iter__(self) -> Iterator[Page]:
        return iter(list(self._connected))

    def add(self, page: Page) -> None:
        """A page has come."""
        self._connected.add(page)

    def discard(self, page: Page) -> None:
        """A page has gone."""
        self._connected.discard(page)

    def showing(self, document: str) -> list[Page]:
        """The pages that show a document."""
        return [page for page in self if document in page.shows]

    async def tell(self, event: Message) -> None:
        """Tell every page."""
        await asyncio.gather(*(page.tell(event) for page in self))

    async def tell_of(self, document: str, event: Message) -> None:
        """Tell every page that shows a document."""
        await asyncio.gather(*(page.tell(event) for page in self.showing(document)))
