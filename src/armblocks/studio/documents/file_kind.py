"""The interface of a kind of file (diagram or robot): creation, reading and writing.

Journal, recovery, saving and detection of changes on disk are common to all kinds.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from armblocks.studio.documents.edited import Edited
from armblocks.studio.documents.history import Value
from armblocks.studio.protocol.messages.documents import DocumentKind

EditedT = TypeVar("EditedT", bound=Edited[Any])


class FileKind(ABC, Generic[Value, EditedT]):
    """How one kind of file is begun, read and written. What reads raises ``ArmblocksError``."""

    name: ClassVar[DocumentKind]
    """Also the suffix of its journals."""

    @abstractmethod
    def new(self) -> Value:
        """What a new one begins as."""

    @abstractmethod
    def shipped(self, name: str) -> Value:
        """The shipped one of this name."""

    @abstractmethod
    def edited(self, value: Value, version: int = 0) -> EditedT:
        """One that can be edited."""

    @abstractmethod
    def from_file(self, data: bytes, place: Path) -> Value:
        """What the file at ``place`` holds."""

    @abstractmethod
    def to_file(self, value: Value, place: Path) -> bytes:
        """What the file at ``place`` is to hold."""

    @abstractmethod
    def renamed(self, value: Value, place: Path) -> Value:
        """With the name that it gets from the file under which it is saved."""

    @abstractmethod
    def from_text(self, text: str, where: str) -> Value:
        """What :meth:`to_text` has written."""

    @abstractmethod
    def to_text(self, value: Value) -> str:
        """All of it, for the journal; this is what takes long, and may be done in another thread."""

    @abstractmethod
    def parts(self, value: Value) -> int:
        """How many blocks or links it has."""
