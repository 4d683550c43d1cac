"""The documents that a studio has open: where each comes from, its file, its journal.

Nothing that was drawn is lost: every change is in the journal before it is answered, and on the disk within
:data:`~armblocks.studio.journal.SYNC_SECONDS`. Nothing is overwritten silently: a file that somebody else has
written is noticed, and a drawing that a journal gives back is offered, not put in the file's place.
"""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import secrets
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from datetime import datetime
from pathlib import Path, PurePosixPath

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram
from armblocks.errors import ArmblocksError, FormatError, InputError, UnknownNameError
from armblocks.studio import messages as say
from armblocks.studio.document import Document
from armblocks.studio.document_journal import (
    SNAPSHOT_EVERY,
    DocumentJournal,
    JournaledDocument,
    Performed,
    journaled_document,
)
from armblocks.studio.journal import SYNC_SECONDS, in_use
from armblocks.studio.parameter_values import ResolveRobot
from armblocks.studio.placing import placed
from armblocks.studio.project_folder import Disk, Fingerprint, ProjectFolder
from armblocks.studio.state_folder import StateFolder

MOST_DOCUMENTS = 100
MOST_KEYS = 1000
"""Keys of requests that are remembered, so that one sent twice is done once."""
LOOK_SECONDS = 1.0
"""How often the files are looked at."""


@dataclasses.dataclass(eq=False, kw_only=True)
class OpenDocument:
    """A document with its file, its journal and the background check that looks at it."""

    key: str
    document: Document
    path: str | None
    example: str = ""
    on_disk: Fingerprint | None = None
    disk: Disk = "same"
    seen: deque[str] = dataclasses.field(default_factory=lambda: deque(maxlen=MOST_KEYS))
    journal: DocumentJournal | None = None
    journaled: bool = True
    behind: bool = False
    """Whether the journal lacks something that has happened."""
    checking: asyncio.Task[None] | None = None
    syncing: asyncio.Task[None] | None = None
    snapshot: asyncio.Task[None] | None = None
    saving: asyncio.Lock = dataclasses.field(default_factory=asyncio.Lock)

    def state(self) -> say.DocumentState:
        """Where it stands, for pages."""
        document = self.document
        return say.DocumentState(
            document=self.key,
            version=document.version,
            title=document.diagram.name,
            path=self.path,
            example=self.example,
            dirty=document.dirty,
            undo=document.undo_title,
            redo=document.redo_title,
            disk=self.disk,
            journaled=self.journaled,
        )


class OpenDocuments:
    """The open documents of one project folder, by key. Used on one event loop."""

    def __init__(self, folder: ProjectFolder, kept: StateFolder, resolve_robot: ResolveRobot) -> None:
        self.folder = folder
        self.kept = kept
        self._resolve_robot = resolve_robot
        self._open: dict[str, OpenDocument] = {}
        self._same: dict[str, str] = {}
        """Keys under which a page of an earlier server knows a document that is open under another."""
        self._waiting: dict[str, JournaledDocument] = {}
        """Documents that an earlier server left behind, by key."""
        self._unread: dict[str, Path] = {}
        """Journals that could not be read, by what names them to pages."""
        self._look_for_journals()

    def __iter__(self) -> Iterator[OpenDocument]:
        return iter(list(self._open.values()))

    def __contains__(self, key: str) -> bool:
        return key in self._open

    def __getitem__(self, key: str) -> OpenDocument:
        """The open document of this key; raises ``UnknownNameError``."""
        key = self._same.get(key, key)
        if key not in self._open:
            raise UnknownNameError("open document", key, self._open)
        return self._open[key]

    # -- opening and putting away ----------------------------------------------------------------------------

    def open_path(self, path: str, key: str = "") -> OpenDocument:
        """The document of a file, which is read where it is not open yet."""
        place = self.folder.path(path)
        path = place.relative_to(self.folder.root).as_posix()
        for found in self:
            if found.path == path:
                return found
        data, on_disk = self.folder.read_known(path)
        diagram = formats.diagram_from_bytes(
            data,
            place.name,
            BLOCKS,
            self._resolve_robot,
            folder=place.parent,
            draft=True,
            read_library=self.folder.read_library,
        )
        self.kept.use(path)
        return self._add(self._document(diagram), path=path, on_disk=on_disk, key=key)

    def open_example(self, name: str, key: str = "") -> OpenDocument:
        """A new document that begins as a shipped example."""
        known = formats.list_examples()
        if name not in known:
            raise UnknownNameError("example", name, known)
        return self._add(self._document(formats.load_diagram(name, BLOCKS)), example=name, key=key)

    def open_bytes(self, data: bytes, name: str) -> OpenDocument:
        """A new document that begins as the content of a file from elsewhere."""
        diagram = formats.diagram_from_bytes(
            data,
            name,
            BLOCKS,
            self._resolve_robot,
            folder=self.folder.root,
            draft=True,
            read_library=self.folder.read_library,
        )
        return self._add(self._document(diagram))

    def new(self, key: str = "") -> OpenDocument:
        """An empty document."""
        return self._add(self._document(Diagram(name="untitled", blocks={})), key=key)

    def attach(self, request: say.Attach) -> OpenDocument:
        """The document that a page showed before, see :class:`~armblocks.studio.messages.Attach`."""
        key = request.document
        with contextlib.suppress(UnknownNameError):
            return self[key]
        if key in self._waiting:
            return self._restore(self._waiting.pop(key))
        if request.path:
            found = self.open_path(request.path, key)
        else:
            found = self.open_example(request.example, key) if request.example else self.new(key)
        if found.key != key:
            self._same[key] = found.key
        return found

    def close(self, found: OpenDocument, *, discard: bool) -> None:
        """Put a document away; raises ``InputError`` where edits would be lost without a word."""
        if found.document.dirty and not discard:
            raise InputError(
                f"'{found.document.diagram.name}' has edits that no file holds",
                where="the drawing",
                allowed="to save it, or to discard the edits",
                fix="choose one of the two",
            )
        self._put_away(found, keep=False)

    def end(self) -> None:
        """The studio ends: journals of what is not saved stay, the others go."""
        for found in self:
            with contextlib.suppress(OSError):
                self._put_away(found, keep=found.document.dirty)
        for waiting in self._waiting.values():
            if not waiting.document.dirty:
                with contextlib.suppress(OSError):
                    waiting.journal_path.unlink(missing_ok=True)

    def _put_away(self, found: OpenDocument, *, keep: bool) -> None:
        del self._open[found.key]
        for task in (found.checking, found.syncing, found.snapshot):
            if task is not None:
                task.cancel()
        if found.journal is not None:
            found.journal.close(keep=keep)

    def _document(self, diagram: Diagram) -> Document:
        return Document(placed(diagram), self._resolve_robot)

    def _add(
        self,
        document: Document,
        *,
        path: str | None = None,
        example: str = "",
        on_disk: Fingerprint | None = None,
        key: str = "",
    ) -> OpenDocument:
        if len(self._open) >= MOST_DOCUMENTS:
            self._make_room()
        found = OpenDocument(
            key=key or secrets.token_hex(8), document=document, path=path, example=example, on_disk=on_disk
        )
        self._open[found.key] = found
        return found

    def _make_room(self) -> None:
        """Put the document away that was opened first and needs no saving."""
        for found in self:
            if not found.document.dirty:
                self._put_away(found, keep=False)
                return
        raise InputError(
            f"{len(self._open)} documents with unsaved edits are open",
            allowed=f"at most {MOST_DOCUMENTS}",
            fix="save or discard some of them",
            where="studio",
        )

    # -- changing --------------------------------------------------------------------------------------------

    def perform(self, found: OpenDocument, request: Performed) -> bool:
        """Carry a request out, once; ``False`` where it was carried out before. Raises ``ArmblocksError``."""
        if request.key and request.key in found.seen:
            return False
        before, number = found.document.diagram, found.document.version
        found.document.perform(request)
        if request.key:
            found.seen.append(request.key)
        after, version = found.document.diagram, found.document.version
        self._write(found, before, number, lambda journal: journal.performed(request, version, after))
        if found.journal is not None and found.journal.since_snapshot >= SNAPSHOT_EVERY:
            self._snapshot_later(found, found.journal)
        return True

    def reload(self, found: OpenDocument) -> None:
        """Take what the file holds now, as one step that can be undone."""
        if found.path is None:
            raise FormatError(
                "the drawing has no file yet",
                allowed="a file",
                fix="save it under a name",
                where=found.document.diagram.name,
            )
        data, on_disk = self.folder.read_known(found.path)
        place = self.folder.path(found.path)
        read = formats.diagram_from_bytes(
            data,
            place.name,
            BLOCKS,
            self._resolve_robot,
            folder=place.parent,
            draft=True,
            read_library=self.folder.read_library,
        )
        self.replace(found, "reload", placed(read))
        document = found.document
        document.saved = document.diagram
        found.on_disk, found.disk = on_disk, "same"
        self._saved(found, found.path, document.version)

    def replace(self, found: OpenDocument, title: str, diagram: Diagram) -> None:
        """Put another drawing in the place of this one, as one step that can be undone."""
        document, before, number = found.document, found.document.diagram, found.document.version
        document.replace(title, diagram)
        version = document.version
        self._write(found, before, number, lambda journal: journal.replaced(title, diagram, version))

    def keep_mine(self, found: OpenDocument) -> None:
        """What somebody else has written to the file is known; the next save overwrites it."""
        found.disk, found.on_disk = "same", None
        if found.path is not None and self.folder.exists(found.path):
            found.on_disk = self.folder.read_known(found.path)[1]
        self._hold(found)

    def _hold(self, found: OpenDocument) -> None:
        """The drawing is nowhere but here and in its journal: no file holds it any more."""
        document = found.document
        document.saved = None
        self._write(found, document.diagram, document.version, lambda journal: journal.kept(document.version))

    async def save(self, found: OpenDocument, path: str, *, overwrite: bool) -> str:
        """Write the file, under another path if one is given.

        Raises ``FormatError`` where there is no path, where the file has changed on the disk or another one
        would be overwritten, unless ``overwrite``, and where the disk refuses.
        """
        async with found.saving:
            path = path or found.path or ""
            if not path:
                raise FormatError(
                    "the drawing has no file yet",
                    allowed="a path",
                    fix="save it under a name",
                    where=found.document.diagram.name,
                )
            place = self.folder.path(path)
            path = place.relative_to(self.folder.root).as_posix()
            if not overwrite:
                self._refuse_overwriting(found, path)
            document, of = found.document, found.document.version
            written = document.diagram
            diagram = dataclasses.replace(written, name=place.stem) if path != found.path else written

            def write() -> Fingerprint:
                data = formats.diagram_to_bytes(diagram, self._resolve_robot, folder=place.parent)
                return self.folder.write(path, data)

            found.on_disk = await asyncio.to_thread(write)
            found.path, found.disk = path, "same"
            document.written(written, diagram.name)
            self.kept.use(path)
            self._saved(found, path, of)
            return path

    def _saved(self, found: OpenDocument, path: str, of: int) -> None:
        """Note in the journal, where there is one, that the file holds version ``of``."""
        if found.journal is None:
            return
        now, version, on_disk = found.document.diagram, found.document.version, found.on_disk
        self._write(found, now, version, lambda journal: journal.saved(path, of, version, on_disk))

    def _refuse_overwriting(self, found: OpenDocument, path: str) -> None:
        if path != found.path:
            if self.folder.exists(path):
                raise FormatError(
                    "there is such a file already", where=path, fix="overwrite it, or choose another"
                )
            return
        found.disk, found.on_disk = self.folder.compared(path, found.on_disk)
        if found.disk == "changed":
            raise FormatError(
                "the file has changed on the disk since it was opened",
                where=path,
                allowed="to overwrite it, or to save under another name",
                fix="choose one of the two",
            )

    # -- the journal -----------------------------------------------------------------------------------------

    def _write(
        self, found: OpenDocument, before: Diagram, number: int, write: Callable[[DocumentJournal], None]
    ) -> None:
        """Write to the journal, which is begun with the drawing before the first change.

        A disk that refuses keeps nobody from drawing: the pages are told, and the next change tries again.
        """
        try:
            if found.journal is None:
                found.journal, found.behind = self._begin_journal(found), True
            if found.behind:
                found.journal.begin_from(before, number)
                found.behind = False
            write(found.journal)
            found.journaled = True
            self._sync_later(found)
        except OSError:
            found.journaled, found.behind = False, True

    def _begin_journal(self, found: OpenDocument) -> DocumentJournal:
        return DocumentJournal.begin(
            self.kept.journals / f"{found.key}.journal",
            self.folder.root,
            self._resolve_robot,
            key=found.key,
            file=found.path,
            example=found.example,
            on_disk=found.on_disk,
        )

    def _sync_later(self, found: OpenDocument) -> None:
        """See to it that the disk has the journal soon."""
        if found.syncing is not None and not found.syncing.done():
            return

        async def sync() -> None:
            await asyncio.sleep(SYNC_SECONDS)
            if found.journal is not None:
                try:
                    await asyncio.to_thread(found.journal.sync)
                except OSError:
                    found.journaled, found.behind = False, True

        found.syncing = asyncio.get_running_loop().create_task(sync())

    def _snapshot_later(self, found: OpenDocument, journal: DocumentJournal) -> None:
        """Write the whole drawing to the journal; it is made ready in a thread, while edits go on."""
        journal.since_snapshot = 0
        diagram, number = found.document.diagram, found.document.version

        async def snapshot() -> None:
            text = await asyncio.to_thread(journal.snapshot_text, diagram)
            if found.journal is journal:
                with contextlib.suppress(OSError):
                    journal.snapshot(text, number)

        found.snapshot = asyncio.get_running_loop().create_task(snapshot())

    # -- recovery --------------------------------------------------------------------------------------------

    def _look_for_journals(self) -> None:
        """Find what earlier servers left; the journals of another that still runs are not touched."""
        for path in sorted(self.kept.journals.glob("*.journal")):
            if in_use(path):
                continue
            try:
                found = journaled_document(path, self.folder.root, self._resolve_robot)
                self._waiting[found.key] = found
            except (ArmblocksError, OSError):
                self._unread[path.stem] = path

    def recoveries(self) -> list[say.Recovery]:
        """What waits to be recovered, the latest first."""
        found = [self._recovery(entry) for entry in self._waiting.values() if entry.document.dirty]
        found += [_unread_recovery(key, path) for key, path in self._unread.items()]
        return sorted(found, key=lambda entry: -entry.last)

    def _recovery(self, found: JournaledDocument) -> say.Recovery:
        disk = self.folder.compared(found.path, found.on_disk)[0] if found.path else "same"
        return say.Recovery(
            document=found.key,
            title=found.document.diagram.name,
            path=found.path,
            began=found.began,
            last=found.last,
            edits=found.edits,
            blocks=len(found.document.diagram.blocks),
            disk=disk,
            missing=found.missing,
        )

    async def recover(self, request: say.Recover) -> OpenDocument | None:
        """Do with a recovery what the user chose; the document that is open thereby."""
        key = request.document
        if key not in self._waiting and key not in self._unread:
            raise UnknownNameError("drawing to recover", key, [*self._waiting, *self._unread])
        if request.action == "discard":
            path = self._waiting[key].journal_path if key in self._waiting else self._unread[key]
            path.unlink(missing_ok=True)
            self._waiting.pop(key, None)
            self._unread.pop(key, None)
            return None
        if key in self._unread:  # what it lacked may be there now; if not, this says what it is
            found = journaled_document(self._unread[key], self.folder.root, self._resolve_robot)
            del self._unread[key]
        else:
            found = self._waiting.pop(key)
        opened = self._restore(found)
        if request.action == "keep_both":
            await self.save(opened, self._free_path(found), overwrite=False)
        return opened

    def _free_path(self, found: JournaledDocument) -> str:
        """The name of the recovered drawing's own file, beside the one that it came from."""
        origin = PurePosixPath(found.path or f"{found.document.diagram.name}.json")
        when = datetime.fromtimestamp(found.last).strftime("%Y-%m-%d %H.%M.%S")
        wish = f"{origin.stem} recovered {when}"
        names = (f"{wish}.json", *(f"{wish} {k}.json" for k in range(2, 1000)))
        return next(str(p) for name in names if not self.folder.exists(str(p := origin.with_name(name))))

    def _restore(self, found: JournaledDocument) -> OpenDocument:
        """The document of a journal, open again, with its past; its journal goes on."""
        path = found.path
        if path is not None and any(other.path == path for other in self):
            path = None  # the file is open already: this is another drawing, to be saved under another name
        opened = self._add(
            found.document, path=path, example=found.example, on_disk=found.on_disk, key=found.key
        )
        opened.seen.extend(found.keys)
        if path is not None:
            opened.disk, opened.on_disk = self.folder.compared(path, found.on_disk)
        if found.missing:
            # What could not be repeated stays beside, for somebody who can read it.
            with contextlib.suppress(OSError):
                found.journal_path.replace(found.journal_path.with_suffix(".unread"))
                opened.document.saved = None
            return opened
        with contextlib.suppress(OSError):
            opened.journal = DocumentJournal.go_on(found, self.folder.root, self._resolve_robot)
        return opened

    # -- the disk --------------------------------------------------------------------------------------------

    async def watch(self, tell: Callable[[OpenDocument], Awaitable[None]]) -> None:
        """Look at the files again and again; ``tell`` is called for a document whose file has changed."""
        while True:
            await asyncio.sleep(LOOK_SECONDS)
            for found in self:
                if found.path is None or found.saving.locked():
                    continue
                path, known, was = found.path, found.on_disk, found.disk
                disk, now = await asyncio.to_thread(self.folder.compared, path, known)
                if found.on_disk is not known or found.path != path:
                    continue  # it was saved meanwhile
                found.disk, found.on_disk = disk, now
                if disk != was:
                    if disk == "gone":
                        self._hold(found)
                    await tell(found)


def _unread_recovery(key: str, path: Path) -> say.Recovery:
    """What is told of a journal that cannot be read."""
    last = path.stat().st_mtime if path.exists() else 0.0
    return say.Recovery(
        document=key,
        title=key,
        path=None,
        began=last,
        last=last,
        edits=0,
        blocks=0,
        disk="same",
        missing="its journal cannot be read: open it to see why",
    )
