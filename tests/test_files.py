"""Atomic writing of files, and reading up to a size limit."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from armblocks.errors import FormatError
from armblocks.files import read_bounded, write_atomically


def test_written_bytes_are_read_back(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    write_atomically(path, b"one")
    write_atomically(path, b"two")
    assert read_bounded(path, 3) == b"two"
    assert [entry.name for entry in tmp_path.iterdir()] == ["model.json"], "a temporary file remains"


def test_a_file_is_synchronised_before_it_is_renamed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    real_sync, real_replace = os.fsync, Path.replace

    def sync(descriptor: int) -> None:
        calls.append("sync")
        real_sync(descriptor)

    def replace(self: Path, target: Path) -> Path:
        calls.append("rename")
        return real_replace(self, target)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(Path, "replace", replace)
    write_atomically(tmp_path / "a.json", b"x")
    expected = ["sync", "rename"] if os.name == "nt" else ["sync", "rename", "sync"]
    assert calls == expected


@pytest.mark.parametrize("failing", ["fsync", "open"])
def test_a_failed_write_leaves_the_old_file_unchanged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(b"old")

    def refuse(*_: object, **__: object) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, failing, refuse)
        with pytest.raises(FormatError, match=r"cannot be written \(No space left on device\).*unchanged"):
            write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.json"]


@pytest.mark.skipif(os.name == "nt", reason="POSIX permissions and links")
def test_a_write_keeps_permissions_and_links(tmp_path: Path) -> None:
    real, link = tmp_path / "real.json", tmp_path / "link.json"
    real.write_bytes(b"old")
    real.chmod(0o640)
    link.symlink_to(real)
    write_atomically(link, b"new")
    assert link.is_symlink()
    assert real.read_bytes() == b"new"
    assert real.stat().st_mode & 0o777 == 0o640


def test_a_missing_folder_raises_an_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"the folder '.*nowhere' does not exist.*Fix: create the folder"):
        write_atomically(tmp_path / "nowhere" / "a.json", b"")


def test_writing_to_the_path_of_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="the path is an existing folder"):
        write_atomically(tmp_path, b"")


def test_a_path_with_a_nul_character_is_refused() -> None:
    with pytest.raises(FormatError, match="the path contains a NUL character"):
        write_atomically("a\0b", b"")


def test_a_missing_file_raises_an_error_that_names_it(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"a\.json: there is no such file"):
        read_bounded(tmp_path / "a.json", 10)


@pytest.mark.skipif(os.name == "nt", reason="Windows refuses folders with a permission error")
def test_reading_a_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="this is a folder"):
        read_bounded(tmp_path, 10)


def test_an_unreadable_path_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="the file cannot be read"):
        read_bounded(f"{tmp_path}/a\0b", 10)


def test_a_file_above_the_size_limit_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"12345")
    with pytest.raises(FormatError, match=r"too large.*Allowed: at most 4 bytes"):
        read_bounded(tmp_path / "a", 4)
