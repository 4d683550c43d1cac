"""The paths of the user's folders on each operating system, where earlier versions stored their files."""

import os
from pathlib import Path

import pytest
from platformdirs.api import PlatformDirsABC
from platformdirs.macos import MacOS
from platformdirs.unix import Unix
from platformdirs.windows import Windows

from armblocks import user_folders


@pytest.mark.skipif(os.name == "nt", reason="tests the paths of Unix")
@pytest.mark.parametrize(
    ("system", "cache", "state"),
    [
        (Unix, ".cache/armblocks", ".local/state/armblocks"),
        (MacOS, "Library/Caches/armblocks", "Library/Application Support/armblocks"),
    ],
)
def test_user_folders_on_unix_are_in_the_home_folder(
    system: type[PlatformDirsABC], cache: str, state: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("XDG_CACHE_HOME", "XDG_STATE_HOME", "XDG_DATA_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    requested = system("armblocks", appauthor=False)
    assert (requested.user_cache_path, requested.user_state_path) == (tmp_path / cache, tmp_path / state)


def test_user_folders_on_windows_are_in_the_local_application_data(monkeypatch: pytest.MonkeyPatch) -> None:
    folders = {"CSIDL_LOCAL_APPDATA": "local"}
    monkeypatch.setattr("platformdirs.windows.get_win_folder", folders.__getitem__)
    requested = Windows("armblocks", appauthor=False)
    assert Path(requested.user_cache_dir) == Path("local/armblocks/Cache")
    assert Path(requested.user_state_dir) == Path("local/armblocks")


def test_a_variable_sets_the_folders_and_without_a_home_there_are_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("platformdirs.PlatformDirs", Unix)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    monkeypatch.setattr("os.path.expanduser", lambda path: path)
    assert user_folders.cache_folder() == tmp_path / "armblocks"
    assert user_folders.state_folder() is None
    monkeypatch.setattr("platformdirs.user_state_path", lambda *_, **__: Path("~/.local/state/armblocks"))
    assert user_folders.state_folder() is None
