"""What is typed is not lost: an append-only record of a drawing beside its last save.

One file per open drawing, in the studio's own folder and not in the project. It begins with the drawing as it
was when the journal was opened and goes on with one record per change. A record is a line of JSON behind its
length and CRC-32, so that a record torn by a crash is recognised and left out::

    <length> <crc32> {"document": …}\n

Every record holds the whole canonical drawing only now and then (:data:`SNAPSHOT_EVERY`); between them stand
the edits. Records reach the disk (``fsync``) within :data:`SYNC_SECONDS`.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from time import monotonic
from typing import Any

from armblocks.errors import FormatError

SYNC_SECONDS = 1.0
SNAPSHOT_EVERY = 200
MOST_BYTES = 256 * 2**20
"""A journal larger than this is not read back."""


class Journal:
    """The open journal of one drawing."""

    def __init__(self, path: Path, head: dict[str, Any]) -> None:
        """Begin anew with ``head``: what is needed to find and show the drawing without the records."""
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        self.path = path
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0), 0o600)
        self._synced = monotonic()
        self._waiting = False
        self.append(head)
        self.sync()

    def append(self, record: dict[str, Any]) -> None:
        """Add a record; it is on the disk after the next :meth:`sync`, or at once if that is due."""
        os.write(self._file, _line(record))
        self._waiting = True
        if monotonic() - self._synced >= SYNC_SECONDS:
            self.sync()

    def sync(self) -> None:
        """Return when the disk has every record."""
        if self._waiting:
            os.fsync(self._file)
        self._waiting = False
        self._synced = monotonic()

    @property
    def waiting(self) -> bool:
        """Whether records stand that the disk may not have."""
        return self._waiting

    def close(self, *, keep: bool) -> None:
        """End the journal; ``keep`` leaves it for a recovery."""
        self.sync()
        os.close(self._file)
        if not keep:
            self.path.unlink(missing_ok=True)


def read_journal(path: Path) -> list[dict[str, Any]]:
    """The records of a journal up to the first torn one; raises ``FormatError`` if not even the first is
    whole."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise FormatError("the journal is too large", where=str(path), allowed=f"{MOST_BYTES} bytes")
        data = path.read_bytes()
    except OSError as error:
        raise FormatError(f"the journal cannot be read ({error.strerror})", where=str(path)) from error
    records = list(_records(data))
    if not records:
        raise FormatError("the journal holds no whole record", where=str(path), fix="it can be deleted")
    return records


def _line(record: dict[str, Any]) -> bytes:
    text = json.dumps(record, allow_nan=False, separators=(",", ":"), ensure_ascii=False).encode()
    return b"%d %08x %s\n" % (len(text), zlib.crc32(text), text)


def _records(data: bytes) -> Iterator[dict[str, Any]]:
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
        yield json.loads(text)
        position = start + len(text) + 1
