"""The queue of messages to one page. A slow page never blocks the server."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable

Said = str | bytes
"""A message as JSON, or a frame of samples."""
BEHIND_BYTES = 4 * 2**20
"""A page that has so much to come is told of a run no faster than it listens."""
MOST_BYTES = 64 * 2**20
"""A page that has so much to come is given up; when it listens again it comes anew."""


class Outbox:
    """Messages and frames in the order in which they are to go. Used on one event loop."""

    def __init__(
        self, send_text: Callable[[str], Awaitable[None]], send_bytes: Callable[[bytes], Awaitable[None]]
    ) -> None:
        self._send_text = send_text
        self._send_bytes = send_bytes
        self._waiting: deque[Said] = deque()
        self._size = 0
        self._news = asyncio.Event()
        self._room = asyncio.Event()
        self._room.set()
        self.given_up = False
        """Whether nothing goes any more: the page has left, or has not listened for too long."""

    @property
    def behind(self) -> bool:
        """Whether the page has so much to come that no more of a run should be added."""
        return not self._room.is_set()

    async def put(self, said: Said) -> None:
        """Add what is to be sent; returns at once."""
        if self.given_up:
            return
        self._waiting.append(said)
        self._size += len(said)
        self._news.set()
        if self._size > BEHIND_BYTES:
            self._room.clear()
        if self._size > MOST_BYTES:
            self.give_up()

    async def room(self) -> None:
        """Return when the page is not behind."""
        await self._room.wait()

    async def empty(self) -> None:
        """Send what is there, and what comes, until it is given up; raises what sending raises."""
        try:
            while not self.given_up:
                while self._waiting and not self.given_up:
                    said = self._waiting.popleft()
                    await (self._send_text(said) if isinstance(said, str) else self._send_bytes(said))
                    self._size -= len(said)
                    if self._size <= BEHIND_BYTES:
                        self._room.set()
                self._news.clear()
                if not self._waiting and not self.given_up:
                    await self._news.wait()
        finally:
            self.give_up()

    def give_up(self) -> None:
        """Forget what is there; nothing goes any more."""
        self.given_up = True
        self._waiting.clear()
        self._size = 0
        self._news.set()
        self._room.set()
