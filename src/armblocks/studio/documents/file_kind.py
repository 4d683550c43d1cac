"""The interface of a kind of file (diagram or robot): creation, reading and writing.

Journal, recovery, saving and detection of changes on disk are common to all kinds.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from armblocks.studio.documents.editable_document import EditableDocument
from armblocks.studio.documents.history import Value
from armblocks.studio.protocol.messages.documents import DocumentKind

DocumentT = TypeVar("DocumentT", bound=EditableDocument[Any])


class FileKind(ABC, Generic[Value, DocumentT]):
    """Creation, reading and writing of one kind of file. Reading methods raise ``ArmblocksError``."""

    name: ClassVar[DocumentKind]
    """Name of the kind, also the suffix of its journals."""

    @abstractmethod
    def new(self) -> Value:
        """Return the initial value of a new document."""

    @abstractmethod
    def shipped(self, name: str) -> Value:
        """Return the shipped example or robot of this name."""

    @abstractmethod
    def document(self, value: Value, version: int = 0) -> DocumentT:
        """Return a document with undo history for a value."""

    @abstractmethod
    def from_file(self, data: bytes, place: Path) -> Value:
        """Read the file at ``place``, whose content is ``data``."""

    @abstractmethod
    def to_file(self, value: Value, place: Path) -> bytes:
        """Return the content of the file at ``place`` for a value."""

    @abstractmethod
    def renamed(self, value: Value, place: Path) -> Value:
        """Return the value with the name that follows from the file name under which it is saved."""

    @abstractmethod
    def from_text(self, text: str, where: str) -> Value:
        """Read a text that :meth:`to_text` has written."""

    @abstractmethod
    def to_text(self, value: Value) -> str:
        """Serialise the value for the journal; may be slow, and may be called in another thread."""

    @abstractmethod
    def parts(self, value: Value) -> int:
        """Return the number of blocks or links."""
