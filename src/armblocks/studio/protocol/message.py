"""The base classes of all messages between front end and server, and the search for the messages of a class.

A request declares the type of the value in its reply: ``class Find(Request[list[FoundBlock]])``. The union
that pydantic reads and the types of the front end follow from :func:`messages_of`. A new message needs only
its class, in a file of :mod:`armblocks.studio.protocol.messages`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Generic, TypeVar, Union, get_args

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema

from armblocks.package_folder import modules_in

ReplyT = TypeVar("ReplyT")
MessageT = TypeVar("MessageT", bound="Message")


class Message(BaseModel):
    """A value that front end and server exchange; unknown fields are rejected.

    The validator is built at its first use, when all files of messages are imported; see :class:`AnyOf`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


class Request(Message, Generic[ReplyT]):
    """A message from a front end to the server. The type argument is the type of the value in the reply."""


class Event(Message):
    """A message from the server to front ends that is not a reply."""


class Edit(Message):
    """One undoable change of a document, as data."""


class Fault(Message):
    """The reason for a refused request: the fields of an ``ArmblocksError``."""

    what: str
    where: str
    allowed: str
    fix: str


def reply_type(request: type[Request[Any]]) -> Any:
    """Return the type of the value in the reply to a request."""
    for base in request.__mro__:
        arguments = base.__pydantic_generic_metadata__["args"] if issubclass(base, Request) else ()
        if arguments and not isinstance(arguments[0], TypeVar):
            return arguments[0]
    raise TypeError(f"{request.__name__} does not declare the type of its reply")


def messages_of(base: type[MessageT]) -> dict[str, type[MessageT]]:
    """Return the subclasses of a message class that have a kind, by kind."""
    list(modules_in("armblocks.studio.protocol.messages"))  # imports them
    messages = {kind: message for message in _subclasses(base) if (kind := kind_of(message))}
    return dict(sorted(messages.items()))


def kind_of(message: type[Message]) -> str:
    """Return the kind that identifies a message within its class; ``""`` for a class without a kind."""
    field = message.model_fields.get("kind")
    kinds = get_args(field.annotation) if field is not None else ()
    return kinds[0] if len(kinds) == 1 else ""


def _subclasses(base: type[MessageT]) -> Iterator[type[MessageT]]:
    for message in base.__subclasses__():
        yield message
        yield from _subclasses(message)


class AnyOf:
    """Marks a field that takes any message of a class, selected by kind: ``Annotated[Event, AnyOf()]``."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        base = source.__pydantic_generic_metadata__["origin"] or source
        members = tuple(messages_of(base).values())
        return handler.generate_schema(Annotated[Union[members], Field(discriminator="kind")])  # noqa: UP007
