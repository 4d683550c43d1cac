"""What all messages between page and server have in common."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Message(BaseModel):
    """A value that travels between page and server: unknown members are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Fault(Message):
    """Why a request was refused, in the parts of an ``ArmblocksError``."""

    what: str
    where: str
    allowed: str
    fix: str
