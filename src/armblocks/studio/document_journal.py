"""What the journal of a document says, and the document that it gives back.

Records, one JSON object each; ``version`` is the document's after it, ``at`` when it was made (s since 1970):

``head``
    The first: key, path and example of the document, what was on the disk, and ``armblocks`` that wrote it.
``diagram``
    The whole canonical drawing of a version: before the first edit, and every :data:`SNAPSHOT_EVERY` edits.
    It is written when it is ready, which may be some edits later.
``perform``
    A request of a page that was carried out, as it came.
``replace``
    Another drawing in the place of this one, as one step.
``saved``
    The path, and which version the file holds from then on.
``kept``
    The file holds something else, or is gone, and this drawing is to stay.

An edit is a pure function of drawing and request, so a drawing follows from a snapshot and the requests
after it. The latest snapshot is taken after which no version is missing and every undo finds its step; where
an undo would find none, a snapshot is written in its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from time import time
from typing import Any

from pydantic import TypeAdapter, ValidationError

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram
from armblocks.errors import ArmblocksError, FormatError
from armblocks.studio import messages as say
from armblocks.studio.document import Document
from armblocks.studio.journal import Journal, Record, read_journal
from armblocks.studio.parameter_values import ResolveRobot
from armblocks.studio.project_folder import Fingerprint

SNAPSHOT_EVERY = 200
Performed = say.Change | say.Undo | say.Redo | say.ArrangeBlocks
_PERFORMED: TypeAdapter[Performed] = TypeAdapter(Performed)


@dataclass(kw_only=True)
class JournaledDocument:
    """A document as its journal gives it back, and the journal's file."""

    key: str
    document: Document
    path: str | None
    example: str
    on_disk: Fingerprint | None
    journal_path: Path
    whole: int
    """Bytes of the journal that could be read."""
    began: float
    last: float
    edits: int
    keys: list[str] = field(default_factory=list[str])
    """Keys of the requests that were carried out."""
    missing: str = ""
    """What could not be given back; ``""`` if nothing."""


class DocumentJournal:
    """Writes the journal of one document. Raises ``OSError`` as the disk does."""

    def __init__(self, journal: Journal, folder: Path, resolve_robot: ResolveRobot) -> None:
        self._journal = journal
        self._folder = folder
        self._resolve_robot = resolve_robot
        self.since_snapshot = 0
        self._past = self._future = 0

    @classmethod
    def begin(
        cls,
        path: Path,
        folder: Path,
        resolve_robot: ResolveRobot,
        *,
        key: str,
        file: str | None,
        example: str,
        on_disk: Fingerprint | None,
    ) -> DocumentJournal:
        """A new journal; the drawing itself has to follow (:meth:`snapshot`)."""
        made = cls(Journal(path), folder, resolve_robot)
        head = {"key": key, "path": file, "example": example, "on_disk": _said(on_disk)}
        made._journal.append({"head": {**head, "armblocks": version("armblocks")}, "at": _now()})
        return made

    @classmethod
    def go_on(cls, found: JournaledDocument, folder: Path, resolve_robot: ResolveRobot) -> DocumentJournal:
        """Write on in the journal of a document that it gave back."""
        return cls(Journal(found.journal_path, whole=found.whole), folder, resolve_robot)

    def snapshot_text(self, diagram: Diagram) -> str:
        """A drawing as text; this is what takes long, and may be done in another thread."""
        return formats.diagram_to_bytes(diagram, self._resolve_robot, folder=self._folder).decode()

    def begin_from(self, diagram: Diagram, number: int) -> None:
        """Add the drawing that everything after it begins from: there is none yet, or records are missing."""
        self.snapshot(self.snapshot_text(diagram), number)
        self.since_snapshot = self._past = self._future = 0

    def snapshot(self, text: str, number: int) -> None:
        """Add the whole drawing of a version."""
        self._journal.append({"diagram": text, "version": number, "at": _now()})

    def performed(self, request: Performed, number: int, after: Diagram) -> None:
        """Add a request that was carried out."""
        past, future = _counted(request.kind, self._past, self._future)
        if past < 0 or future < 0:
            self.begin_from(after, number)
            return
        self._past, self._future = past, future
        said = request.model_dump(mode="json", exclude={"document", "base"})
        self._journal.append({"perform": said, "version": number, "at": _now()})
        self.since_snapshot += 1

    def replaced(self, title: str, diagram: Diagram, number: int) -> None:
        """Add that another drawing has taken the place of this one."""
        self._past, self._future = _counted("replace", self._past, self._future)
        text = self.snapshot_text(diagram)
        self._journal.append({"replace": text, "title": title, "version": number, "at": _now()})

    def kept(self, number: int) -> None:
        """Add that the drawing stays, though its file holds something else."""
        self._journal.append({"kept": True, "version": number, "at": _now()})

    def saved(self, path: str, of: int, number: int, on_disk: Fingerprint | None) -> None:
        """Add that the file of this path holds version ``of``."""
        record = {"saved": path, "of": of, "on_disk": _said(on_disk)}
        self._journal.append({**record, "version": number, "at": _now()})

    def sync(self) -> None:
        """Return when the disk has everything; may be called from another thread."""
        self._journal.sync()

    @property
    def waiting(self) -> bool:
        """Whether there is something that the disk may not have."""
        return self._journal.waiting

    def close(self, *, keep: bool) -> None:
        """End the journal; ``keep`` leaves it for a recovery."""
        self._journal.close(keep=keep)


def journaled_document(path: Path, folder: Path, resolve_robot: ResolveRobot) -> JournaledDocument:
    """The document that a journal gives back, as far as it can be carried out.

    Raises ``FormatError`` where the journal does not say even one drawing.
    """
    records, whole = read_journal(path)
    try:
        return _replayed(records, path, whole, folder, resolve_robot)
    except (KeyError, TypeError, AttributeError) as error:
        raise FormatError(
            "this is no journal of the studio", where=str(path), fix="open the drawing's own file"
        ) from error


def _replayed(
    records: Sequence[Record], path: Path, whole: int, folder: Path, resolve_robot: ResolveRobot
) -> JournaledDocument:
    head = records[0]["head"]
    number, text = _snapshot(records, str(path))
    diagram = formats.diagram_from_bytes(
        text.encode(), path.name, BLOCKS, resolve_robot, folder=folder, draft=True
    )
    found = JournaledDocument(
        key=head["key"],
        document=Document(diagram, resolve_robot, version=number),
        path=head["path"],
        example=head["example"],
        on_disk=_fingerprint(head["on_disk"]),
        journal_path=path,
        whole=whole,
        began=records[0]["at"],
        last=records[-1]["at"],
        edits=0,
    )
    _Replay(found, resolve_robot, folder, first=not any("saved" in r for r in records)).run(records)
    return found


def _snapshot(records: Sequence[Record], where: str) -> tuple[int, str]:
    """The latest snapshot after which no undo reaches further back than it."""
    found = [(record["version"], record["diagram"]) for record in records if "diagram" in record]
    if not found:
        raise FormatError("the journal holds no whole drawing", where=where, fix="it can be deleted")
    for number, text in sorted(found, reverse=True):
        if _follows(records, number):
            return number, text
    return max(found)


def _follows(records: Sequence[Record], number: int) -> bool:
    """Whether all after a version can be repeated: no version is missing, no undo reaches back of it."""
    past = future = 0
    for record in records:
        if record.get("version", 0) <= number or "diagram" in record or "kept" in record:
            continue
        if record["version"] != number + 1:
            return False
        number += 1
        if "saved" not in record:  # saved under another name, which is a version of its own
            kind = record["perform"]["kind"] if "perform" in record else "replace"
            past, future = _counted(kind, past, future)
        if past < 0 or future < 0:
            return False
    return True


def _counted(kind: str, past: int, future: int) -> tuple[int, int]:
    if kind == "undo":
        return past - 1, future + 1
    return (past + 1, future - 1) if kind == "redo" else (past + 1, 0)


class _Replay:
    def __init__(
        self, found: JournaledDocument, resolve_robot: ResolveRobot, folder: Path, *, first: bool
    ) -> None:
        self._found = found
        self._resolve_robot = resolve_robot
        self._folder = folder
        self._start = found.document.version
        # What a snapshot shows is what the file holds only before the first edit.
        if not first or self._start > 0:
            found.document.saved = None
        self._diagrams = {self._start: found.document.diagram}

    def run(self, records: Sequence[Record]) -> None:
        """Carry out what the records say, until one cannot be."""
        found = self._found
        for place, record in enumerate(records):
            number = int(record.get("version", 0))
            if "perform" in record:
                found.keys.append(record["perform"]["key"])
            if "saved" in record:
                self._save(record, number)
            elif "kept" in record and number >= self._start:
                found.document.saved = None
            elif number > self._start and ("perform" in record or "replace" in record):
                try:
                    self._step(record)
                except (ArmblocksError, ValidationError) as error:
                    lost = sum(1 for later in records[place:] if "perform" in later)
                    what = error.what if isinstance(error, ArmblocksError) else "it is not understood"
                    found.missing = f"the last {lost} edits could not be repeated: {what}"
                    break
                self._diagrams[found.document.version] = found.document.diagram
            found.edits += "perform" in record
            if found.edits == 1 and "perform" in record:
                found.began = record["at"]

    def _step(self, record: Record) -> None:
        document = self._found.document
        if "perform" in record:
            document.perform(_PERFORMED.validate_python({**record["perform"], "document": ""}))
            return
        diagram = formats.diagram_from_bytes(
            record["replace"].encode(),
            "journal",
            BLOCKS,
            self._resolve_robot,
            folder=self._folder,
            draft=True,
        )
        document.replace(record["title"], diagram)

    def _save(self, record: Record, number: int) -> None:
        found = self._found
        found.path, found.on_disk = record["saved"], _fingerprint(record["on_disk"])
        found.edits = 0
        if number < self._start:
            return
        holds = self._diagrams.get(record["of"])
        name = Path(record["saved"]).stem
        if holds is None:
            found.document.saved = None
        elif number > found.document.version:
            found.document.written(holds, name)
        else:
            found.document.saved = holds
        self._diagrams[found.document.version] = found.document.diagram


def _said(fingerprint: Fingerprint | None) -> dict[str, Any] | None:
    return None if fingerprint is None else fingerprint.said()


def _fingerprint(said: dict[str, Any] | None) -> Fingerprint | None:
    return None if said is None else Fingerprint(**said)


def _now() -> float:
    return round(time(), 1)
