"""The table of request handlers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from armblocks.studio.protocol.message import ReplyT, Request

if TYPE_CHECKING:
    from armblocks.studio.protocol.clients import StudioClient

RequestT = TypeVar("RequestT", bound=Request[Any])
Handler = Callable[["StudioClient", RequestT], Awaitable[Any]]


class RequestHandlers:
    """One handler for each class of requests. A test checks completeness and the types of the replies."""

    def __init__(self) -> None:
        self._handlers: dict[type[Request[Any]], Handler[Any]] = {}

    def on(self, request: type[RequestT], handler: Handler[RequestT]) -> None:
        """Register the handler of a class of requests; the handler returns the value of the reply."""
        self._handlers[request] = handler

    async def reply_to(self, client: StudioClient, request: Request[ReplyT]) -> ReplyT:
        """Return the value of the reply to a request. Raises ``ArmblocksError`` if the request is refused."""
        return await self._handlers[type(request)](client, request)

    @property
    def handlers(self) -> Mapping[type[Request[Any]], Handler[Any]]:
        """Return the handler of each class of requests."""
        return self._handlers
