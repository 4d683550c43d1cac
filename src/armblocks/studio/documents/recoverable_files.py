"""Journals of earlier servers, whose unsaved work can be recovered or discarded."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

from armblocks.errors import ArmblocksError, UnknownNameError
from armblocks.studio.documents.file_journal import JournaledFile, journaled_file
from armblocks.studio.documents.file_kind import FileKind
from armblocks.studio.documents.journal import in_use
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.messages import documents as document_messages


class RecoverableFiles:
    """The recoverable documents of one kind in one project folder, by key."""

    def __init__(self, folder: ProjectFolder, journals: Path, kind: FileKind[Any, Any]) -> None:
        self._folder = folder
        self._kind = kind
        self._read: dict[str, JournaledFile[Any]] = {}
        self._unread: dict[str, Path] = {}
        """Journals that could not be read, by the key under which clients refer to them."""
        for path in sorted(journals.glob(f"*.{kind.name}")):
            if in_use(path):  # another running server uses it
                continue
            try:
                journaled = journaled_file(path, kind)
                self._read[journaled.key] = journaled
            except (ArmblocksError, OSError):
                self._unread[path.stem] = path

    def __contains__(self, key: str) -> bool:
        return key in self._read or key in self._unread

    def descriptions(self) -> list[document_messages.Recovery]:
        """Descriptions of the unsaved documents, for clients."""
        descriptions = [self._offer(entry) for entry in self._read.values() if entry.document.dirty]
        return [*descriptions, *(self._unread_offer(key, path) for key, path in self._unread.items())]

    def take(self, key: str) -> JournaledFile[Any]:
        """Return a recovered document and remove it from the recoverable documents.

        A journal that could not be read is read again: a missing file may exist by now. Raises
        ``UnknownNameError`` for an unknown key, ``ArmblocksError`` if the journal still cannot be read.
        """
        self._check_key(key)
        if key in self._unread:
            journaled = journaled_file(self._unread[key], self._kind)
            del self._unread[key]
            return journaled
        return self._read.pop(key)

    def discard(self, key: str) -> None:
        """Delete a journal; raises ``UnknownNameError``."""
        self._check_key(key)
        path = self._read[key].journal_path if key in self._read else self._unread[key]
        path.unlink(missing_ok=True)
        self._read.pop(key, None)
        self._unread.pop(key, None)

    def delete_saved(self) -> None:
        """Delete the journals of documents that have no unsaved edits, when the studio ends."""
        for entry in self._read.values():
            if not entry.document.dirty:
                with contextlib.suppress(OSError):
                    entry.journal_path.unlink(missing_ok=True)

    def _check_key(self, key: str) -> None:
        if key not in self:
            raise UnknownNameError(f"{self._kind.name} to recover", key, [*self._read, *self._unread])

    def _offer(self, journaled: JournaledFile[Any]) -> document_messages.Recovery:
        disk = self._folder.compared(journaled.path, journaled.on_disk)[0] if journaled.path else "same"
        return document_messages.Recovery(
            kind=self._kind.name,
            document=journaled.key,
            title=journaled.document.value.name,
            path=journaled.path,
            began=journaled.began,
            last=journaled.last,
            edits=journaled.edits,
            parts=self._kind.parts(journaled.document.value),
            disk=disk,
            missing=journaled.missing,
        )

    def _unread_offer(self, key: str, path: Path) -> document_messages.Recovery:
        """Description of a journal that cannot be read, for clients."""
        last = path.stat().st_mtime if path.exists() else 0.0
        return document_messages.Recovery(
            kind=self._kind.name,
            document=key,
            title=key,
            path=None,
            began=last,
            last=last,
            edits=0,
            parts=0,
            disk="same",
            missing="its journal cannot be read: open it to see why",
        )
