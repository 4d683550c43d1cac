"""A journal gives back every whole record, whatever happened to its end."""

from __future__ import annotations

from pathlib import Path

import pytest

from armblocks.errors import FormatError
from armblocks.studio.journal import Journal, read_journal

RECORDS = [{"edit": k, "text": "ä\n" * k} for k in range(6)]


def written(path: Path) -> bytes:
    journal = Journal(path, {"document": "d"})
    for record in RECORDS:
        journal.append(record)
    assert journal.waiting
    journal.close(keep=True)
    return path.read_bytes()


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "a.journal"
    written(path)
    assert read_journal(path) == [{"document": "d"}, *RECORDS]
    assert path.stat().st_mode & 0o077 == 0


def test_every_torn_end_leaves_the_records_before_it(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    data = written(path)
    known = [{"document": "d"}, *RECORDS]
    first = data.index(b"\n") + 1
    counts: set[int] = set()
    for end in range(first, len(data)):
        path.write_bytes(data[:end])
        found = read_journal(path)
        assert found == known[: len(found)]
        counts.add(len(found))
    assert counts == set(range(1, len(known)))


def test_a_changed_byte_ends_the_journal_there(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    data = bytearray(written(path))
    data[-3] ^= 1
    path.write_bytes(data)
    assert read_journal(path) == [{"document": "d"}, *RECORDS[:-1]]


def test_a_journal_without_a_whole_record_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    path.write_bytes(b"12 00000000 {")
    with pytest.raises(FormatError, match="the journal holds no whole record"):
        read_journal(path)
    with pytest.raises(FormatError, match="the journal cannot be read"):
        read_journal(tmp_path / "nowhere")


def test_a_journal_that_is_not_kept_is_gone(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    Journal(path, {}).close(keep=False)
    assert not path.exists()
