"""The queue of messages to one page, so that a slow page never blocks the server."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable

Payload = str | bytes
"""A message as JSON, or a frame of samples."""
BEHIND_BYTES = 4 * 2**20
"""Above this queue size, samples of a run are added only as fast as the page receives them, bytes."""
MOST_BYTES = 64 * 2**20
"""Above this queue size the connection is closed; the page reconnects when it is responsive again, bytes."""


class Outbox:
    """Queue of messages and frames in sending order. Used on one event loop."""

    def __init__(
        self, send_text: Callable[[str], Awaitable[None]], send_bytes: Callable[[bytes], Awaitable[None]]
    ) -> None:
        self._send_text = send_text
        self._send_bytes = send_bytes
        self._waiting: deque[Payload] = deque()
        self._size = 0
        self._news = asyncio.Event()
        self._room = asyncio.Event()
        self._room.set()
        self.given_up = False
        """Whether the queue is closed: the page has disconnected, or the queue exceeded its size limit."""

    @property
    def behind(self) -> bool:
        """Whether the queue is so long that no more samples of a run should be added."""
        return not self._room.is_set()

    async def put(self, payload: Payload) -> None:
        """Add a message; does not wait."""
        if self.given_up:
            return
        self._waiting.append(payload)
        self._size += len(payload)
        self._news.set()
        if self._size > BEHIND_BYTES:
            self._room.clear()
        if self._size > MOST_BYTES:
            self.give_up()

    async def room(self) -> None:
        """Wait until :attr:`behind` is false."""
        await self._room.wait()

    async def empty(self) -> None:
        """Send all messages, also later ones, until the queue is closed; raises connection errors."""
        try:
            while not self.given_up:
                while self._waiting and not self.given_up:
                    payload = self._waiting.popleft()
                    await (
                        self._send_text(payload) if isinstance(payload, str) else self._send_bytes(payload)
                    )
                    self._size -= len(payload)
                    if self._size <= BEHIND_BYTES:
                        self._room.set()
                self._news.clear()
                if not self._waiting and not self.given_up:
                    await self._news.wait()
        finally:
            self.give_up()

    def give_up(self) -> None:
        """Close the queue and discard its messages."""
        self.given_up = True
        self._waiting.clear()
        self._size = 0
        self._news.set()
        self._room.set()
