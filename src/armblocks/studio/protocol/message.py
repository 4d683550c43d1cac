"""What all messages between front end and server have in common, and how the messages of a class are found.

A request says which value its reply has: ``class Find(Request[list[Found]])``. The union that pydantic reads
and the types of the front end follow from :func:`messages_of`: a message is added by its class alone, in a
file of :mod:`armblocks.studio.protocol.messages`.
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
    """A value that travels between front end and server: unknown members are refused.

    Its validator is built when it is first used: then every file of messages is imported, see :class:`AnyOf`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


class Request(Message, Generic[ReplyT]):
    """What a front end asks of the server. The type argument is the type of the value in the reply."""


class Event(Message):
    """What the server tells a front end of its own accord."""


class Edit(Message):
    """One step of work on a document, as data: what can be undone."""


class Fault(Message):
    """Why a request was refused, in the parts of an ``ArmblocksError``."""

    what: str
    where: str
    allowed: str
    fix: str


def reply_type(request: type[Request[Any]]) -> Any:
    """The type of the value in the reply to a request."""
    for base in request.__mro__:
        given = base.__pydantic_generic_metadata__["args"] if issubclass(base, Request) else ()
        if given and not isinstance(given[0], TypeVar):
            return given[0]
    raise TypeError(f"{request.__name__} does not say which reply it has")


def messages_of(base: type[MessageT]) -> dict[str, type[MessageT]]:
    """The messages of a class by their kind: of all classes below it those that have one."""
    list(modules_in("armblocks.studio.protocol.messages"))  # imports them
    found = {kind: message for message in _below(base) if (kind := kind_of(message))}
    return dict(sorted(found.items()))


def kind_of(message: type[Message]) -> str:
    """The kind by which a message is told from others of its class; ``""`` where it has none."""
    field = message.model_fields.get("kind")
    given = get_args(field.annotation) if field is not None else ()
    return given[0] if len(given) == 1 else ""


def _below(base: type[MessageT]) -> Iterator[type[MessageT]]:
    for message in base.__subclasses__():
        yield message
        yield from _below(message)


class AnyOf:
    """Marks a member as any message of a class, told apart by kind: ``Annotated[Event, AnyOf()]``."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        base = source.__pydantic_generic_metadata__["origin"] or source
        members = tuple(messages_of(base).values())
        return handler.generate_schema(Annotated[Union[members], Field(discriminator="kind")])  # noqa: UP007
