"""The stored messages of a run, for clients that connect later: after a reload, after a lost connection, or
as a second client.

The messages are in an unnamed temporary file, so that a long run needs little memory. The system deletes
the file when the process ends. If the disk is full, no more samples are stored; the final message of the run
is stored in memory.
"""

from __future__ import annotations

import tempfile

from armblocks.studio.protocol.outbox import Payload


class RunRecord:
    """All messages of a run, in order."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - open until the end of the run
        self._unwritten: dict[int, str] = {}
        """Messages that could not be written to disk, by their number."""
        self._extents: list[tuple[int, int, bool]] = []
        self._size = 0

    def __len__(self) -> int:
        return len(self._extents)

    def __getitem__(self, index: int) -> Payload:
        if index in self._unwritten:
            return self._unwritten[index]
        begin, size, text = self._extents[index]
        self._file.seek(begin)
        data = self._file.read(size)
        return data.decode() if text else data

    def append(self, payload: Payload) -> None:
        """Store a message; raises ``OSError`` for a frame that cannot be written to disk."""
        data = payload.encode() if isinstance(payload, str) else payload
        try:
            self._write(data)
        except OSError:
            if not isinstance(payload, str):
                raise
            self._unwritten[len(self._extents)] = payload
            self._extents.append((self._size, 0, True))
            return
        self._extents.append((self._size, len(data), isinstance(payload, str)))
        self._size += len(data)

    def _write(self, data: bytes) -> None:
        self._file.seek(self._size)
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]

    def close(self) -> None:
        """Delete all messages."""
        self._file.close()
