"""The records of the journal of a diagram or a robot, and its recovery.

Each record is a JSON object; ``version`` is the version after it, ``at`` the time of writing (s since 1970):

``head``
    The first record: key, path, origin, fingerprint of the file on disk, and version of ``armblocks``.
``whole``
    The complete canonical document of a version, written before the first edit and every
    :data:`SNAPSHOT_EVERY` edits. Serialisation runs in a thread, so some later edits may precede the record.
``perform``
    A request of a client that was applied, unchanged; ``continued`` where it extended the previous undo step.
``replace``
    A new value that replaced the document as one undo step.
``saved``
    The path, and the version that the file contains from now on.
``kept``
    The file contains another value or was deleted; the open document is unchanged.

An edit is a pure function of document and request, so every version follows from a snapshot and the requests
after it. Recovery starts from the latest snapshot after which no version is missing and no undo needs a step
from before the snapshot. Where an undo would need such a step, a snapshot is written instead of the request.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from time import time
from typing import Annotated, Any, Generic

from pydantic import TypeAdapter, ValidationError

from armblocks.errors import ArmblocksError, FormatError, counted
from armblocks.studio.documents.file_kind import DocumentT, FileKind
from armblocks.studio.documents.journal import Journal, Record, read_journal
from armblocks.studio.documents.older_journals import converted
from armblocks.studio.documents.project_folder import Fingerprint
from armblocks.studio.protocol.message import AnyOf
from armblocks.studio.protocol.messages.documents import Alteration

SNAPSHOT_EVERY = 200
_ALTERATIONS: TypeAdapter[Alteration] = TypeAdapter(Annotated[Alteration, AnyOf()])


@dataclass(kw_only=True)
class JournaledFile(Generic[DocumentT]):
    """A diagram or robot recovered from its journal, and the path of the journal."""

    key: str
    document: DocumentT
    path: str | None
    origin: str
    on_disk: Fingerprint | None
    journal_path: Path
    whole: int
    """Number of bytes at the start of the journal that could be read."""
    began: float
    last: float
    edits: int
    keys: list[str] = field(default_factory=list[str])
    """Keys of the requests that were applied."""
    missing: str = ""
    """Description of the edits that could not be recovered; ``""`` if there are none."""


class FileJournal:
    """Writes the journal of one diagram or robot. Raises the ``OSError`` of the disk."""

    def __init__(self, journal: Journal, kind: FileKind[Any, Any]) -> None:
        self._journal = journal
        self._kind = kind
        self.since_snapshot = 0
        self._undo_count = self._redo_count = 0

    @classmethod
    def begin(
        cls,
        path: Path,
        kind: FileKind[Any, Any],
        *,
        key: str,
        file: str | None,
        origin: str,
        on_disk: Fingerprint | None,
    ) -> FileJournal:
        """Create a journal; the first snapshot must follow (:meth:`begin_from`)."""
        file_journal = cls(Journal(path), kind)
        head = {"key": key, "path": file, "origin": origin, "on_disk": _fingerprint_dict(on_disk)}
        file_journal._journal.append({"head": {**head, "armblocks": version("armblocks")}, "at": _now()})
        return file_journal

    @classmethod
    def continue_from(cls, recovered: JournaledFile[Any], kind: FileKind[Any, Any]) -> FileJournal:
        """Continue the journal from which a document was recovered."""
        return cls(Journal(recovered.journal_path, whole=recovered.whole), kind)

    def begin_from(self, value: Any, number: int, done: str = "") -> None:
        """Write a first snapshot: the journal is new, or records are missing before it.

        ``done``: key of the request that led to this value.
        """
        self.snapshot(self._kind.to_text(value), number, done)
        self.since_snapshot = self._undo_count = self._redo_count = 0

    def snapshot(self, text: str, number: int, done: str = "") -> None:
        """Write a snapshot: the complete document of a version, as text."""
        self._journal.append({"whole": text, "version": number, "at": _now(), "done": done})

    def write_request(self, request: Alteration, number: int, after: Any, *, continued: bool = False) -> None:
        """Write an applied request; write a snapshot instead if its undo step precedes the last snapshot."""
        does = "continue" if continued else request.does
        undo_count, redo_count = _step_counts(does, self._undo_count, self._redo_count)
        if undo_count < 0 or redo_count < 0:
            self.begin_from(after, number, request.key)
            return
        self._undo_count, self._redo_count = undo_count, redo_count
        stored = request.model_dump(mode="json", exclude={"document", "base"})
        self._journal.append({"perform": stored, "does": does, "version": number, "at": _now()})
        self.since_snapshot += 1

    def write_replacement(self, title: str, value: Any, number: int) -> None:
        """Write that another value has replaced the document."""
        self._undo_count, self._redo_count = _step_counts("change", self._undo_count, self._redo_count)
        text = self._kind.to_text(value)
        self._journal.append({"replace": text, "title": title, "version": number, "at": _now()})

    def write_unsaved(self, number: int) -> None:
        """Write that the document is unchanged although its file contains another value."""
        self._journal.append({"kept": True, "version": number, "at": _now()})

    def write_saved(self, path: str, of: int, number: int, on_disk: Fingerprint | None) -> None:
        """Write that the file at this path contains version ``of``."""
        record = {"saved": path, "of": of, "on_disk": _fingerprint_dict(on_disk)}
        self._journal.append({**record, "version": number, "at": _now()})

    def sync(self) -> None:
        """Flush all records to disk; may be called from another thread."""
        self._journal.sync()

    @property
    def waiting(self) -> bool:
        """Whether some records have not been flushed to disk."""
        return self._journal.waiting

    def close(self, *, keep: bool) -> None:
        """Close the journal; with ``keep`` its file remains for a recovery, otherwise it is deleted."""
        self._journal.close(keep=keep)


def journaled_file(path: Path, kind: FileKind[Any, DocumentT]) -> JournaledFile[DocumentT]:
    """Return the document of a journal with as many of its edits as can be replayed.

    Raises ``FormatError`` if the journal contains no complete snapshot.
    """
    records, whole = read_journal(path)
    try:
        return _replayed(records, path, whole, kind)
    except (KeyError, TypeError, AttributeError) as error:
        raise FormatError(
            "this is not a journal of the studio", where=str(path), fix="open the document's own file"
        ) from error


def _replayed(
    records: Sequence[Record], path: Path, whole: int, kind: FileKind[Any, DocumentT]
) -> JournaledFile[DocumentT]:
    head = records[0]["head"]
    number, text = _snapshot(records, str(path))
    recovered = JournaledFile(
        key=str(head["key"]),
        document=kind.document(kind.from_text(text, path.name), number),
        path=head["path"],
        origin=head["origin"],
        on_disk=_fingerprint(head["on_disk"]),
        journal_path=path,
        whole=whole,
        began=records[0]["at"],
        last=records[-1]["at"],
        edits=0,
    )
    _Replay(recovered, kind, first=not any("saved" in record for record in records)).run(records)
    return recovered


def _snapshot(records: Sequence[Record], where: str) -> tuple[int, str]:
    """Return the latest snapshot from which all later records, undo included, can be repeated."""
    snapshots = [(record["version"], record["whole"]) for record in records if "whole" in record]
    if not snapshots:
        raise FormatError("the journal contains no complete document", where=where, fix="it can be deleted")
    for number, text in sorted(snapshots, reverse=True):
        if _is_repeatable(records, number):
            return number, text
    return max(snapshots)


def _is_repeatable(records: Sequence[Record], number: int) -> bool:
    """Whether all records after a version can be repeated: no version is missing, no undo goes beyond it."""
    undo_count = redo_count = 0
    for record in records:
        if record.get("version", 0) <= number or "whole" in record or "kept" in record:
            continue
        if record["version"] != number + 1:
            return False
        number += 1
        if "saved" not in record:  # saving under another name renames the value: a new version
            undo_count, redo_count = _step_counts(record.get("does", "change"), undo_count, redo_count)
        if undo_count < 0 or redo_count < 0:
            return False
    return True


def _step_counts(does: str, undo_count: int, redo_count: int) -> tuple[int, int]:
    """Numbers of undo and redo steps after a request; negative where the request needs one more step."""
    match does:
        case "undo":
            return undo_count - 1, redo_count + 1
        case "redo":
            return undo_count + 1, redo_count - 1
        case "continue":
            return undo_count or -1, redo_count
        case _:
            return undo_count + 1, 0


class _Replay(Generic[DocumentT]):
    def __init__(
        self, recovered: JournaledFile[DocumentT], kind: FileKind[Any, DocumentT], *, first: bool
    ) -> None:
        self._recovered = recovered
        self._kind = kind
        self._start = recovered.document.version
        # A snapshot equals the content of the file only if no edit precedes it.
        if not first or self._start > 0:
            recovered.document.saved = None
        self._values = {self._start: recovered.document.value}

    def run(self, records: Sequence[Record]) -> None:
        """Apply the records in order, up to the first that fails."""
        recovered = self._recovered
        for index, record in enumerate(records):
            number = int(record.get("version", 0))
            if "perform" in record:
                recovered.keys.append(record["perform"]["key"])
            if record.get("done"):
                recovered.keys.append(record["done"])
            if "saved" in record:
                self._save(record, number)
            elif "kept" in record and number >= self._start:
                recovered.document.saved = None
            elif number > self._start and ("perform" in record or "replace" in record):
                try:
                    self._step(record)
                except Exception as error:  # also a defect: the edits before it are recovered
                    lost = sum(1 for later in records[index:] if "perform" in later)
                    what = error.what if isinstance(error, ArmblocksError) else _defect_text(error)
                    recovered.missing = f"the last {counted(lost, 'edit')} could not be repeated: {what}"
                    break
                self._values[recovered.document.version] = recovered.document.value
            recovered.edits += "perform" in record
            if recovered.edits == 1 and "perform" in record:
                recovered.began = record["at"]

    def _step(self, record: Record) -> None:
        document = self._recovered.document
        if "perform" in record:
            document.perform(_ALTERATIONS.validate_python({**converted(record["perform"]), "document": ""}))
            return
        document.replace(record["title"], self._kind.from_text(record["replace"], "journal"))

    def _save(self, record: Record, number: int) -> None:
        recovered = self._recovered
        recovered.path, recovered.on_disk = record["saved"], _fingerprint(record["on_disk"])
        recovered.edits = 0
        if number < self._start:
            return
        saved_value = self._values.get(record["of"])
        name = Path(record["saved"]).stem
        if saved_value is None:
            recovered.document.saved = None
        elif number > recovered.document.version:
            recovered.document.mark_saved(saved_value, name)
        else:
            recovered.document.saved = saved_value
        self._values[recovered.document.version] = recovered.document.value


def _defect_text(error: Exception) -> str:
    if isinstance(error, ValidationError):
        return "the record is invalid"
    return f"armblocks has a defect ({type(error).__name__})"


def _fingerprint_dict(fingerprint: Fingerprint | None) -> dict[str, Any] | None:
    return None if fingerprint is None else fingerprint.as_dict()


def _fingerprint(stored: dict[str, Any] | None) -> Fingerprint | None:
    return None if stored is None else Fingerprint(**stored)


def _now() -> float:
    return round(time(), 1)
