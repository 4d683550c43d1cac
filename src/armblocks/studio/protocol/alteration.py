"""What every request says that changes something: a diagram or a robot."""

from __future__ import annotations

from typing import ClassVar, Literal

from armblocks.studio.protocol.message import Request


class Alteration(Request[int]):
    """What changes something that pages edit.

    ``key`` is new for each: sent again after a broken line, it is done once. ``base`` is the version that the
    page ``author`` saw: where another page has changed the same things since, the request is refused. The
    reply is the version that the request makes.
    """

    does: ClassVar[Literal["change", "undo", "redo"]] = "change"
    key: str = ""
    base: int | None = None
    author: str = ""
