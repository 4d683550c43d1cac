"""Reading a journal with a damaged end returns all complete records."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from armblocks.errors import FormatError
from armblocks.studio.documents import journal as journal_module
from armblocks.studio.documents.journal import Journal, in_use, read_journal

RECORDS = [{"edit": k, "text": "ä\n" * k} for k in range(6)]


def written(path: Path) -> bytes:
    journal = Journal(path)
    journal.append({"document": "d"})
    for record in RECORDS:
        journal.append(record)
    assert journal.waiting
    journal.close(keep=True)
    return path.read_bytes()


def test_written_records_are_read_again(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "a.journal"
    written(path)
    assert read_journal(path) == ([{"document": "d"}, *RECORDS], path.stat().st_size)
    assert path.stat().st_mode & 0o077 == 0


def test_a_journal_cut_at_any_byte_keeps_the_complete_records(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    data = written(path)
    known = [{"document": "d"}, *RECORDS]
    first = data.index(b"\n") + 1
    counts: set[int] = set()
    for end in range(first, len(data)):
        path.write_bytes(data[:end])
        content, whole = read_journal(path)
        assert whole <= end
        assert content == known[: len(content)]
        counts.add(len(content))
    assert counts == set(range(1, len(known)))


def test_a_changed_byte_ends_the_journal_at_its_record(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    data = bytearray(written(path))
    data[-3] ^= 1
    path.write_bytes(data)
    assert read_journal(path)[0] == [{"document": "d"}, *RECORDS[:-1]]


def test_a_journal_without_a_complete_record_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    path.write_bytes(b"12 00000000 {")
    with pytest.raises(FormatError, match="the journal contains no complete record"):
        read_journal(path)
    with pytest.raises(FormatError, match="the journal cannot be read"):
        read_journal(tmp_path / "nowhere")


def test_closing_a_journal_without_keep_deletes_it(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    Journal(path).close(keep=False)
    assert not path.exists()


def test_a_reopened_journal_continues_after_its_last_complete_record(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    data = written(path)
    path.write_bytes(data[:-5])
    records, whole = read_journal(path)
    journal = Journal(path, whole=whole)
    journal.append({"more": 1})
    journal.close(keep=True)
    assert read_journal(path)[0] == [*records, {"more": 1}]


def test_a_full_disk_leaves_the_earlier_records(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.journal"
    journal = Journal(path)
    journal.append({"first": 1})
    real, calls = os.write, [0]

    def half(descriptor: int, data: bytes) -> int:
        calls[0] += 1
        if calls[0] > 1:
            raise OSError(28, "No space left on device")
        return real(descriptor, data[: len(data) // 2])

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", half)
        with pytest.raises(OSError, match="No space left"):
            journal.append({"second": "x" * 100})
    journal.append({"third": 3})
    journal.close(keep=True)
    assert read_journal(path)[0] == [{"first": 1}, {"third": 3}]


def test_a_journal_locked_by_another_studio_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.journal"
    journal = Journal(path)
    journal.append({"first": 1})
    assert in_use(path)
    with pytest.raises(BlockingIOError, match="is the journal of another studio"):
        Journal(path)
    journal.close(keep=True)
    assert not in_use(path)
    assert not in_use(tmp_path / "nowhere")
    assert read_journal(path)[0] == [{"first": 1}]


def test_a_journal_above_the_size_limit_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.journal"
    written(path)
    monkeypatch.setattr(journal_module, "MAX_BYTES", 10)
    with pytest.raises(FormatError, match="the journal is too large"):
        read_journal(path)
