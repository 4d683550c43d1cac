"""The queue of messages to one client, so that a slow client never blocks the server."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable

Payload = str | bytes
"""A message as JSON, or a frame of samples."""
CONGESTED_BYTES = 4 * 2**20
"""Queue size in bytes above which samples of a run are added only as fast as the client receives them."""
MAX_BYTES = 64 * 2**20
"""Queue size in bytes above which the connection is closed. A responsive client reconnects later."""


class Outbox:
    """Queue of messages and frames in sending order. Used on one event loop."""

    def __init__(
        self, send_text: Callable[[str], Awaitable[None]], send_bytes: Callable[[bytes], Awaitable[None]]
    ) -> None:
        self._send_text = send_text
        self._send_bytes = send_bytes
        self._queue: deque[Payload] = deque()
        self._size = 0
        self._added = asyncio.Event()
        self._room = asyncio.Event()
        self._room.set()
        self.closed = False
        """Whether the queue is closed: the client has disconnected, or the queue exceeded its size limit."""

    @property
    def congested(self) -> bool:
        """Whether the queue is so long that no more samples of a run should be added."""
        return not self._room.is_set()

    async def put(self, payload: Payload) -> None:
        """Add a message; does not wait."""
        if self.closed:
            return
        self._queue.append(payload)
        self._size += len(payload)
        self._added.set()
        if self._size > CONGESTED_BYTES:
            self._room.clear()
        if self._size > MAX_BYTES:
            self.close()

    async def room(self) -> None:
        """Wait until :attr:`congested` is false."""
        await self._room.wait()

    async def send_all(self) -> None:
        """Send all messages until the queue is closed; raises connection errors."""
        try:
            while not self.closed:
                while self._queue and not self.closed:
                    payload = self._queue.popleft()
                    await (
                        self._send_text(payload) if isinstance(payload, str) else self._send_bytes(payload)
                    )
                    self._size -= len(payload)
                    if self._size <= CONGESTED_BYTES:
                        self._room.set()
                self._added.clear()
                if not self._queue and not self.closed:
                    await self._added.wait()
        finally:
            self.close()

    def close(self) -> None:
        """Close the queue and discard its messages."""
        self.closed = True
        self._queue.clear()
        self._size = 0
        self._added.set()
        self._room.set()
