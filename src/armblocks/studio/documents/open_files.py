"""The open diagrams or robots of a studio: origin, file and journal of each.

Every change is written to the journal before the reply, and flushed to disk within
:data:`~armblocks.studio.documents.journal.SYNC_SECONDS`. No file is overwritten without confirmation: changes
by other programs are detected. Recovered work is opened as a new value and does not replace the file.
"""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import secrets
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from datetime import datetime
from pathlib import PurePosixPath
from typing import Any, Generic, TypeVar

from armblocks.errors import FormatError, InputError, UnknownNameError
from armblocks.studio.documents.file_journal import SNAPSHOT_EVERY, FileJournal, JournaledFile
from armblocks.studio.documents.file_kind import DocumentT, FileKind
from armblocks.studio.documents.journal import SYNC_SECONDS
from armblocks.studio.documents.project_folder import DiskState, Fingerprint, ProjectFolder
from armblocks.studio.documents.recoverable_files import RecoverableFiles
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.protocol.messages import documents as document_messages

MAX_OPEN_DOCUMENTS = 100
MAX_KEYS = 1000
"""Number of stored request keys; they ensure that a request that is sent twice is applied once."""
WATCH_SECONDS = 1.0
"""Interval at which files are checked for changes, s."""


@dataclasses.dataclass(eq=False, kw_only=True)
class OpenFile(Generic[DocumentT]):
    """An edited document with its file and its journal."""

    key: str
    document: DocumentT
    path: str | None = None
    origin: str = ""
    """The shipped example or robot from which it was created."""
    on_disk: Fingerprint | None = None
    disk: DiskState = "same"
    request_keys: deque[str] = dataclasses.field(default_factory=lambda: deque(maxlen=MAX_KEYS))
    journal: FileJournal | None = None
    journaled: bool = True
    incomplete: bool = False
    """Whether the journal lacks a change of the document."""
    syncing: asyncio.Task[None] | None = None
    snapshot: asyncio.Task[None] | None = None
    saving: asyncio.Lock = dataclasses.field(default_factory=asyncio.Lock)

    def state(self) -> document_messages.DocumentState:
        """The state of the document as clients show it."""
        document = self.document
        return document_messages.DocumentState(
            document=self.key,
            kind=document.kind,
            version=document.version,
            title=document.value.name,
            path=self.path,
            origin=self.origin,
            dirty=document.dirty,
            undo=document.undo_title,
            redo=document.redo_title,
            disk=self.disk,
            journaled=self.journaled,
        )

    def cancel_tasks(self) -> None:
        """Cancel the pending tasks of the document, which is closed."""
        for task in (self.syncing, self.snapshot):
            if task is not None:
                task.cancel()


OpenedT = TypeVar("OpenedT", bound=OpenFile[Any])


class OpenFiles(ABC, Generic[OpenedT]):
    """The open documents of one kind in one project folder, by key. Used on one event loop."""

    def __init__(self, folder: ProjectFolder, state_folder: StateFolder, kind: FileKind[Any, Any]) -> None:
        self.folder = folder
        self.state_folder = state_folder
        self.kind = kind
        self._open: dict[str, OpenedT] = {}
        self._renamed_keys: dict[str, str] = {}
        """Keys that clients of an earlier server use for documents that are now open under another key."""
        self.recoverable = RecoverableFiles(folder, state_folder.journals, kind)
        self._notify: Callable[[OpenedT], Awaitable[None]] | None = None

    @abstractmethod
    def _create(self, key: str, document: Any) -> OpenedT:
        """Create the open document of this class."""

    def __iter__(self) -> Iterator[OpenedT]:
        return iter(list(self._open.values()))

    def __len__(self) -> int:
        return len(self._open)

    def __contains__(self, key: str) -> bool:
        return self._renamed_keys.get(key, key) in self._open

    def __getitem__(self, key: str) -> OpenedT:
        """Return the open document with this key; raises ``UnknownNameError``."""
        key = self._renamed_keys.get(key, key)
        if key not in self._open:
            raise UnknownNameError(f"open {self.kind.name}", key, self._open)
        return self._open[key]

    # -- opening and closing ---------------------------------------------------------------------------------

    def open_path(self, path: str, key: str = "") -> OpenedT:
        """Return the document of a file; the file is read if it is not open yet."""
        place = self.folder.path(path)
        path = place.relative_to(self.folder.root).as_posix()
        for open_file in self:
            if open_file.path == path:
                return open_file
        data, on_disk = self.folder.read_known(path)
        value = self.kind.from_file(data, place)
        self.state_folder.add_recent(path)
        return self.add(value, path=path, on_disk=on_disk, key=key)

    def open_shipped(self, name: str, key: str = "") -> OpenedT:
        """Open a copy of a shipped example or robot."""
        return self.add(self.kind.shipped(name), origin=name, key=key)

    def new(self, key: str = "") -> OpenedT:
        """Open a new document."""
        return self.add(self.kind.new(), key=key)

    def attach(self, key: str, path: str | None = None, origin: str = "") -> OpenedT:
        """Reopen a document for a client: :class:`~armblocks.studio.protocol.messages.documents.Attach`."""
        with contextlib.suppress(UnknownNameError):
            return self[key]
        if key in self.recoverable:
            return self._restore(self.recoverable.take(key))
        if path:
            open_file = self.open_path(path, key)
        else:
            open_file = self.open_shipped(origin, key) if origin else self.new(key)
        if open_file.key != key:
            self._renamed_keys[key] = open_file.key
        return open_file

    def add(
        self,
        value: Any,
        *,
        path: str | None = None,
        origin: str = "",
        on_disk: Fingerprint | None = None,
        key: str = "",
    ) -> OpenedT:
        """Open a value as a document, under the given key or a new key."""
        open_file = self._add(self.kind.document(value), key or secrets.token_hex(8))
        open_file.path, open_file.origin, open_file.on_disk = path, origin, on_disk
        return open_file

    def close(self, open_file: OpenedT, *, discard: bool) -> None:
        """Close a document; raises ``InputError`` if it has unsaved edits and ``discard`` is false."""
        if open_file.document.dirty and not discard:
            raise InputError(
                f"'{open_file.document.value.name}' has unsaved edits",
                where=f"the {open_file.document.noun}",
                allowed="saving the document, or discarding its edits",
                fix="choose one of the two",
            )
        self._close(open_file, keep=False)

    def close_all(self) -> None:
        """Close all documents when the studio ends; journals of unsaved documents remain."""
        for open_file in self:
            with contextlib.suppress(OSError):
                self._close(open_file, keep=open_file.document.dirty)
        self.recoverable.delete_saved()

    def _close(self, open_file: OpenedT, *, keep: bool) -> None:
        del self._open[open_file.key]
        open_file.cancel_tasks()
        if open_file.journal is not None:
            open_file.journal.close(keep=keep)

    def open_value(self, value: Any) -> OpenedT:
        """Open a value from outside the project; it is journaled at once, because no file contains it."""
        open_file = self.add(value)
        self._mark_unsaved(open_file)
        return open_file

    def _add(self, document: Any, key: str) -> OpenedT:
        if len(self._open) >= MAX_OPEN_DOCUMENTS:
            self._close_earliest_saved()
        open_file = self._open[key] = self._create(key, document)
        return open_file

    def _close_earliest_saved(self) -> None:
        """Close the earliest opened document that has no unsaved edits."""
        for open_file in self:
            if not open_file.document.dirty:
                self._close(open_file, keep=False)
                return
        raise InputError(
            f"{len(self._open)} {self.kind.name}s with unsaved edits are open",
            allowed=f"at most {MAX_OPEN_DOCUMENTS}",
            fix="save or discard some of them",
            where="studio",
        )

    # -- changing --------------------------------------------------------------------------------------------

    def perform(self, open_file: OpenedT, request: document_messages.Alteration) -> bool:
        """Apply a request; return ``False`` if it was applied before. Raises ``ArmblocksError``."""
        if request.key and request.key in open_file.request_keys:
            return False
        document, before, number = open_file.document, open_file.document.value, open_file.document.version
        document.perform(request)
        if request.key:
            open_file.request_keys.append(request.key)
        after, version = document.value, document.version
        continued = request.does == "change" and document.continued
        self._write(
            open_file,
            before,
            number,
            lambda journal: journal.write_request(request, version, after, continued=continued),
        )
        if open_file.journal is not None and open_file.journal.since_snapshot >= SNAPSHOT_EVERY:
            self._snapshot_later(open_file, open_file.journal)
        return True

    def reload(self, open_file: OpenedT, key: str = "") -> None:
        """Replace the document by the content of its file, as one undo step; once for each ``key``."""
        if key and key in open_file.request_keys:
            return
        if open_file.path is None:
            raise self._no_file(open_file)
        data, on_disk = self.folder.read_known(open_file.path)
        self.replace(open_file, "reload", self.kind.from_file(data, self.folder.path(open_file.path)))
        document = open_file.document
        document.saved = document.value
        open_file.on_disk, open_file.disk = on_disk, "same"
        self._saved(open_file, open_file.path, document.version)
        if key:
            open_file.request_keys.append(key)

    def replace(self, open_file: OpenedT, title: str, value: Any) -> None:
        """Replace the value of a document, as one undo step."""
        document, before, number = open_file.document, open_file.document.value, open_file.document.version
        document.replace(title, value)
        version = document.version
        self._write(
            open_file, before, number, lambda journal: journal.write_replacement(title, value, version)
        )

    def ignore_file_change(self, open_file: OpenedT) -> None:
        """Accept that another program has written the file; the next save overwrites it."""
        open_file.disk, open_file.on_disk = "same", None
        if open_file.path is not None and self.folder.exists(open_file.path):
            open_file.on_disk = self.folder.read_known(open_file.path)[1]
        self._mark_unsaved(open_file)

    def _mark_unsaved(self, open_file: OpenedT) -> None:
        """Mark the document as contained in no file, and note this in the journal."""
        document = open_file.document
        document.saved = None
        self._write(
            open_file,
            document.value,
            document.version,
            lambda journal: journal.write_unsaved(document.version),
        )

    async def save(self, open_file: OpenedT, path: str, *, overwrite: bool) -> str:
        """Write the file, under another path if one is given.

        Raises ``FormatError`` if there is no path or the write fails. Unless ``overwrite`` is true,
        also raises it if the file has changed on disk or another file would be replaced.
        """
        async with open_file.saving:
            path = path or open_file.path or ""
            if not path:
                raise self._no_file(open_file)
            target = self.folder.path(path)
            path = target.relative_to(self.folder.root).as_posix()
            if not overwrite:
                self._refuse_overwriting(open_file, path)
            document, of = open_file.document, open_file.document.version
            written = document.value
            value = self.kind.renamed(written, target) if path != open_file.path else written

            def write() -> Fingerprint:
                return self.folder.write(path, self.kind.to_file(value, target))

            open_file.on_disk = await asyncio.to_thread(write)
            open_file.path, open_file.disk = path, "same"
            document.mark_saved(written, value.name)
            self.state_folder.add_recent(path)
            self._saved(open_file, path, of)
            return path

    def _no_file(self, open_file: OpenedT) -> FormatError:
        return FormatError(
            f"the {open_file.document.noun} has no file yet",
            allowed="a path",
            fix="save it under a name",
            where=f"{self.kind.name} '{open_file.document.value.name}'",
        )

    def _saved(self, open_file: OpenedT, path: str, of: int) -> None:
        """Write to an existing journal that the file contains version ``of``."""
        if open_file.journal is None:
            return
        value, version, on_disk = open_file.document.value, open_file.document.version, open_file.on_disk
        self._write(
            open_file, value, version, lambda journal: journal.write_saved(path, of, version, on_disk)
        )

    def _refuse_overwriting(self, open_file: OpenedT, path: str) -> None:
        if path != open_file.path:
            if self.folder.exists(path):
                raise FormatError(
                    "the file already exists", where=path, fix="overwrite it, or choose another name"
                )
            return
        open_file.disk, open_file.on_disk = self.folder.compared(path, open_file.on_disk)
        if open_file.disk == "changed":
            raise FormatError(
                "the file has changed on the disk since it was opened",
                where=path,
                allowed="overwriting it, or saving under another name",
                fix="choose one of the two",
            )

    # -- the journal -----------------------------------------------------------------------------------------

    def _write(
        self, open_file: OpenedT, before: Any, number: int, write: Callable[[FileJournal], None]
    ) -> None:
        """Write to the journal; a new journal starts with a snapshot of the value before the change.

        A disk error does not prevent edits: clients are notified, and the next change tries again.
        """
        try:
            if open_file.journal is None:
                open_file.journal, open_file.incomplete = self._begin_journal(open_file), True
            if open_file.incomplete:
                open_file.journal.begin_from(before, number)
                open_file.incomplete = False
            write(open_file.journal)
            open_file.journaled = True
            self._sync_later(open_file)
        except OSError:
            open_file.journaled, open_file.incomplete = False, True

    def _begin_journal(self, open_file: OpenedT) -> FileJournal:
        return FileJournal.begin(
            self.state_folder.journals / f"{open_file.key}.{self.kind.name}",
            self.kind,
            key=open_file.key,
            file=open_file.path,
            origin=open_file.origin,
            on_disk=open_file.on_disk,
        )

    def _sync_later(self, open_file: OpenedT) -> None:
        """Flush the journal to disk within :data:`SYNC_SECONDS`."""
        if open_file.syncing is not None and not open_file.syncing.done():
            return

        async def sync() -> None:
            await asyncio.sleep(SYNC_SECONDS)
            if open_file.journal is not None:
                try:
                    await asyncio.to_thread(open_file.journal.sync)
                except OSError:
                    open_file.journaled, open_file.incomplete = False, True
                    if self._notify is not None:
                        await self._notify(open_file)

        open_file.syncing = asyncio.get_running_loop().create_task(sync())

    def _snapshot_later(self, open_file: OpenedT, journal: FileJournal) -> None:
        """Write a snapshot to the journal; a thread serialises the document while edits continue."""
        journal.since_snapshot = 0
        value, number = open_file.document.value, open_file.document.version

        async def snapshot() -> None:
            text = await asyncio.to_thread(self.kind.to_text, value)
            if open_file.journal is journal:
                with contextlib.suppress(OSError):
                    journal.snapshot(text, number)

        open_file.snapshot = asyncio.get_running_loop().create_task(snapshot())

    # -- recovery --------------------------------------------------------------------------------------------

    async def recover(self, request: document_messages.Recover) -> OpenedT | None:
        """Apply the user's choice for a recoverable document; return the document if it is now open."""
        key = request.document
        if request.action == "discard":
            self.recoverable.discard(key)
            return None
        recovered = self.recoverable.take(key)
        opened = self._restore(recovered)
        if request.action == "keep_both":
            await self.save(opened, self._free_path(recovered), overwrite=False)
        return opened

    def _free_path(self, recovered: JournaledFile[Any]) -> str:
        """A free file name for a recovered document, in the folder of its former file."""
        origin = PurePosixPath(recovered.path or f"{recovered.document.value.name}.json")
        time = datetime.fromtimestamp(recovered.last).strftime("%Y-%m-%d %H.%M.%S")
        stem = f"{origin.stem} recovered {time}"
        names = (f"{stem}.json", *(f"{stem} {k}.json" for k in range(2, 1000)))
        return next(str(p) for name in names if not self.folder.exists(str(p := origin.with_name(name))))

    def _restore(self, recovered: JournaledFile[Any]) -> OpenedT:
        """Reopen a recovered document with its history and continue its journal."""
        path = recovered.path
        if path is not None and any(other.path == path for other in self):
            path = None  # the file is already open: this document needs another name
        opened = self._add(recovered.document, recovered.key)
        opened.path, opened.origin, opened.on_disk = path, recovered.origin, recovered.on_disk
        opened.request_keys.extend(recovered.keys)
        if path is not None:
            opened.disk, opened.on_disk = self.folder.compared(path, recovered.on_disk)
        if recovered.missing:
            # A journal with records that could not be repeated is kept under another suffix for inspection.
            with contextlib.suppress(OSError):
                recovered.journal_path.replace(recovered.journal_path.with_suffix(".unread"))
                opened.document.saved = None
            return opened
        with contextlib.suppress(OSError):
            opened.journal = FileJournal.continue_from(recovered, self.kind)
        return opened

    # -- the disk --------------------------------------------------------------------------------------------

    async def watch(self, notify: Callable[[OpenedT], Awaitable[None]]) -> None:
        """Check the files periodically; ``notify`` is called for a document whose file has changed or whose
        journal cannot be written.
        """
        self._notify = notify
        while True:
            await asyncio.sleep(WATCH_SECONDS)
            for open_file in self:
                if open_file.path is None or open_file.saving.locked():
                    continue
                path, old_fingerprint, old_state = open_file.path, open_file.on_disk, open_file.disk
                disk, fingerprint = await asyncio.to_thread(self.folder.compared, path, old_fingerprint)
                if open_file.on_disk is not old_fingerprint or open_file.path != path:
                    continue  # it has been saved since
                open_file.disk, open_file.on_disk = disk, fingerprint
                if disk != old_state:
                    if disk == "gone":
                        self._mark_unsaved(open_file)
                    await notify(open_file)
