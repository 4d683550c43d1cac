"""Journals: append-only records of the unsaved edits of a diagram or a robot.

There is one file for each edited document, in the studio's state folder outside the project. A record is one
line of JSON preceded by its length and CRC-32, so that a record cut off by a crash is detected and skipped::

    <length> <crc32> {"change": …}\n

:mod:`armblocks.studio.documents.file_journal` defines the content of the records; this module writes them,
flushes them to disk and reads them. While a journal is open its file is locked, so that no other studio uses
it. The system releases the lock when the process ends, also after a crash.
"""

from __future__ import annotations

import json
import os
import sys
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from threading import Lock
from typing import Any

from armblocks.errors import FormatError
from armblocks.files import sync_folder

SYNC_SECONDS = 1.0
"""The caller of :meth:`Journal.append` calls :meth:`Journal.sync` within this time, s."""
MAX_BYTES = 256 * 2**20
"""A larger journal is not read, bytes."""
Record = Mapping[str, Any]


class Journal:
    """The open journal of one diagram or robot. Raises the ``OSError`` of the disk."""

    def __init__(self, path: Path, *, whole: int = 0) -> None:
        """Open the file at ``path``, keep its first ``whole`` bytes and truncate the rest."""
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        self.path = path
        self.size = whole
        self._named = path.exists()
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o600)
        self._waiting = False
        self._using = Lock()
        if not _locked(self._file):
            os.close(self._file)
            raise BlockingIOError(f"{path} is the journal of another studio")
        os.ftruncate(self._file, whole)
        os.lseek(self._file, whole, os.SEEK_SET)

    def append(self, record: Record) -> None:
        """Write a record; the next :meth:`sync` flushes it. A partly written record is removed again, so that
        later records can be read."""
        line = _line(record)
        try:
            rest = memoryview(line)
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError:
            os.ftruncate(self._file, self.size)
            os.lseek(self._file, self.size, os.SEEK_SET)
            raise
        self.size += len(line)
        self._waiting = True

    def sync(self) -> None:
        """Flush every record to disk; may be called from another thread."""
        with self._using:
            if self._waiting and self._file >= 0:
                self._waiting = False
                os.fsync(self._file)
                if not self._named:
                    sync_folder(self.path.parent)
                    self._named = True

    @property
    def waiting(self) -> bool:
        """Whether some records have not been flushed to disk."""
        return self._waiting

    def close(self, *, keep: bool) -> None:
        """Close the journal; with ``keep`` its file remains for a recovery, otherwise it is deleted."""
        try:
            if keep:
                self.sync()
        finally:
            with self._using:
                os.close(self._file)
                self._file = -1
            if not keep:
                self.path.unlink(missing_ok=True)


def read_journal(path: Path) -> tuple[list[Record], int]:
    """Return the records of a journal up to the first incomplete one, and their length in bytes.

    Raises ``FormatError`` if no record is complete.
    """
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FormatError(
                "the journal is too large",
                where=str(path),
                allowed=f"{MAX_BYTES} bytes",
                fix="save the document, which starts another journal",
            )
        data = path.read_bytes()
    except OSError as error:
        raise FormatError(
            f"the journal cannot be read ({error.strerror})",
            where=str(path),
            fix="check the permissions of the file, or open the document's own file",
        ) from error
    records: list[Record] = []
    whole = 0
    for record, end in _records(data):
        records.append(record)
        whole = end
    if not records:
        raise FormatError("the journal contains no complete record", where=str(path), fix="delete it")
    return records, whole


def in_use(path: Path) -> bool:
    """Whether a running studio has this journal open."""
    try:
        descriptor = os.open(path, os.O_RDWR)
    except OSError:
        return False
    try:
        return not _locked(descriptor)
    finally:
        os.close(descriptor)


def _locked(descriptor: int) -> bool:
    """Lock an open file until it is closed; return ``False`` if another process holds the lock."""
    try:
        if sys.platform == "win32":
            import msvcrt

            # A byte far beyond the records: on Windows a locked range cannot be read.
            os.lseek(descriptor, 2**40, os.SEEK_SET)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _line(record: Record) -> bytes:
    text = json.dumps(record, separators=(",", ":"), ensure_ascii=False).encode()
    return b"%d %08x %s\n" % (len(text), zlib.crc32(text), text)


def _records(data: bytes) -> Iterator[tuple[Record, int]]:
    """Yield each complete record with the position of its end."""
    position = 0
    while position < len(data):
        length, first, rest = data[position : position + 40].partition(b" ")
        checksum, second, _ = rest.partition(b" ")
        start = position + len(length) + len(checksum) + 2
        if not (first and second and length.isdigit()):
            return
        text = data[start : start + int(length)]
        whole = len(text) == int(length) and data[start + len(text) : start + len(text) + 1] == b"\n"
        if not whole or b"%08x" % zlib.crc32(text) != checksum:
            return
        position = start + len(text) + 1
        yield json.loads(text), position
