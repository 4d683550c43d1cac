"""The interface for opening and displaying one kind of document.

:class:`~armblocks.studio.documents.requests.DocumentRequests` handles the requests of all kinds in the
same way.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Generic

from armblocks.studio.documents.open_files import OpenedT, OpenFiles
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.protocol.messages.documents import Content, ContentChange

Place = tuple[str, ...]
"""The part of a document that a client shows: the path of the sheet of a diagram, ``()`` for a robot."""


@dataclass(frozen=True)
class Opening(Generic[OpenedT]):
    """The documents of a file, and the warnings issued while it was read."""

    opened: Sequence[OpenedT]
    notes: Sequence[str] = field(default_factory=tuple[str, ...])


class Presenter(ABC, Generic[OpenedT]):
    """Opening and display of one kind of document."""

    def __init__(self, files: OpenFiles[OpenedT]) -> None:
        self.files = files

    def open_file(self, path: str) -> Opening[OpenedT]:
        """Open the documents of a project file."""
        return Opening([self.files.open_path(path)])

    @abstractmethod
    def dropped(self, data: bytes, name: str) -> Opening[OpenedT]:
        """Open the documents of a file from outside the project."""

    def place(self, open_file: OpenedT, requested: Place, *, known: bool) -> Place:
        """Return the part to show in a client; ``known``: the client shows the document already."""
        return ()

    @abstractmethod
    def content(self, open_file: OpenedT, place: Place) -> Content:
        """Return the data of a document that a client displays."""

    @abstractmethod
    def change(self, open_file: OpenedT, before: Any, place: Place) -> ContentChange:
        """The difference from ``before``; raises ``UnknownNameError`` if the part was added or removed."""

    def on_shown(self, client: StudioClient, open_file: OpenedT, *, known: bool) -> None:
        """Called after a client was sent a document; ``known``: the client showed the document before."""

    def place_after(self, open_file: OpenedT, before: Any, place: Place) -> Place:
        """Return the displayed part after a change, which may have another name."""
        return place

    async def on_edited(self, open_file: OpenedT, before: Any) -> None:
        """Called after a document changed and its clients were notified."""

    async def on_saved(self, open_file: OpenedT) -> None:
        """Called after the file of a document was written."""
