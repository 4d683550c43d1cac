"""The text messages of the websocket: numbered requests, their replies, and events.

A front end sends a :class:`Request` with a number that it chooses. The server answers with a :class:`Reply`
of the same number. It sends an :class:`Event` after each change, also to the other front ends that show the
same document. Samples of a run are sent as binary frames, see :mod:`armblocks.studio.protocol.frames`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from armblocks.studio.protocol.message import AnyOf, Event, Fault, Message, Request


class Envelope(Message):
    """A request with its number."""

    number: int
    request: Annotated[Request[Any], AnyOf()]


class Reply(Event):
    """The reply to a request; ``fault`` is set if the request was refused."""

    kind: Literal["reply"] = "reply"
    number: int
    value: Any = None
    fault: Fault | None = None


class ServerMessage(Message):
    """All text messages of the server, for the generated types of the front end."""

    event: Annotated[Event, AnyOf()]
