"""The text messages of the websocket: numbered requests, their replies, and events.

A front end sends a :class:`Request` with a number of its own choosing; the server answers each with a
:class:`Reply` of the same number, and sends an :class:`Event` whenever something happened: also to the other
front ends that show the same document. Samples of a run come as binary frames, see
:mod:`armblocks.studio.protocol.frames`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from armblocks.studio.protocol.message import AnyOf, Event, Fault, Message, Request


class Envelope(Message):
    """A request with its number."""

    number: int
    request: Annotated[Request[Any], AnyOf()]


class Reply(Event):
    """The answer to a request: ``fault`` where it was refused."""

    kind: Literal["reply"] = "reply"
    number: int
    value: Any = None
    fault: Fault | None = None


class ServerMessage(Message):
    """Only for the types of the front end: everything that the server sends as text."""

    event: Annotated[Event, AnyOf()]
