"""State files of the studio: readable only by their user; damaged files do not prevent a start."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from armblocks import user_folders
from armblocks.errors import FormatError
from armblocks.studio.documents import state_folder
from armblocks.studio.documents.state_folder import SESSION_SECONDS, StateFolder


@pytest.fixture
def studio_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StateFolder:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return StateFolder(tmp_path / "project")


def test_a_session_is_resumed_at_its_port_until_it_expires(studio_state: StateFolder) -> None:
    assert studio_state.session() is None
    first = studio_state.begin_session(8642)
    assert studio_state.begin_session(8642) == first
    assert studio_state.begin_session(8643).secret != first.secret
    second = studio_state.begin_session(8642)
    assert studio_state.begin_session(8642, new=True).secret != second.secret
    file = studio_state.root / "session.json"
    assert file.stat().st_mode & 0o077 == 0
    assert studio_state.root.stat().st_mode & 0o077 == 0
    os.utime(file, (0, file.stat().st_mtime - SESSION_SECONDS - 1))
    assert studio_state.session() is None


@pytest.mark.parametrize("content", ["", "[]", '{"port": 1}', '{"port": "x", "secret": "y"}'])
def test_a_damaged_file_is_ignored(studio_state: StateFolder, content: str) -> None:
    studio_state.begin_session(1)
    (studio_state.root / "session.json").write_text(content)
    (studio_state.root / "recent.json").write_text(content)
    assert studio_state.session() is None
    assert studio_state.recent() == []


def test_recent_files_are_unique_and_latest_first(studio_state: StateFolder) -> None:
    for name in ("a.json", "b.json", "a.json", *(f"{k}.json" for k in range(20))):
        studio_state.add_recent(name)
    assert studio_state.recent()[:2] == ["19.json", "18.json"]
    assert len(studio_state.recent()) == state_folder.MAX_RECENT_FILES


def test_a_missing_home_folder_raises_an_error_with_a_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(user_folders, "state_folder", lambda: None)
    with pytest.raises(FormatError, match=r"this user has no home folder.*set XDG_STATE_HOME to a folder"):
        StateFolder(tmp_path)
