"""The interface for opening and displaying one kind of document.

The requests themselves are carried out by :class:`~armblocks.studio.documents.desk.DocumentDesk`, in the same
way for every kind.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Generic

from armblocks.studio.documents.open_files import OpenedT, OpenFiles
from armblocks.studio.protocol.messages.documents import Content, ContentChange
from armblocks.studio.protocol.page import Page

Place = tuple[str, ...]
"""Which part of a document a page shows: of a diagram the path of the sheet, of a robot always all."""


@dataclass(frozen=True)
class Opening(Generic[OpenedT]):
    """The documents of a file, and what was said when it was read."""

    opened: Sequence[OpenedT]
    notes: Sequence[str] = field(default_factory=tuple[str, ...])


class Presenter(ABC, Generic[OpenedT]):
    """How one kind of document is opened and shown."""

    def __init__(self, files: OpenFiles[OpenedT]) -> None:
        self.files = files

    def open_file(self, path: str) -> Opening[OpenedT]:
        """The documents of a file of the project."""
        return Opening([self.files.open_path(path)])

    @abstractmethod
    def dropped(self, data: bytes, name: str) -> Opening[OpenedT]:
        """The documents of a file from elsewhere: no file of the project holds them."""

    def place(self, found: OpenedT, wished: Place, *, known: bool) -> Place:
        """The part to show to a page; ``known``: the page shows the document already."""
        return ()

    @abstractmethod
    def content(self, found: OpenedT, place: Place) -> Content:
        """What a page shows of a document."""

    @abstractmethod
    def change(self, found: OpenedT, before: Any, place: Place) -> ContentChange:
        """How that differs from what it was. Raises ``UnknownNameError`` where the part came or is gone."""

    def shown(self, page: Page, found: OpenedT, *, known: bool) -> None:
        """A page has been shown a document; ``known``: not for the first time."""

    def changed(self, found: OpenedT) -> None:
        """A document has changed, and the pages have been told."""

    async def saved(self, found: OpenedT) -> None:
        """The file of a document has been written."""
