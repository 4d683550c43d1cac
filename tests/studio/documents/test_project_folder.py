"""The studio reads and writes only below its folder."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from armblocks.errors import ArmblocksError
from armblocks.studio.documents.project_folder import ProjectFolder


@pytest.fixture
def folder(tmp_path: Path) -> ProjectFolder:
    root = tmp_path / "project"
    root.mkdir()
    (tmp_path / "outside.json").write_text("{}")
    (tmp_path / "project-secret").mkdir()
    (tmp_path / "project-secret" / "a.json").write_text("{}")
    (root / "link.json").symlink_to(tmp_path / "outside.json")
    (root / "inside.json").write_text("{}")
    (root / "arms").mkdir()
    (root / "arms" / "arm.m").write_text("x = 1;")
    (root / ".hidden.json").write_text("{}")
    (root / "notes.txt").write_text("")
    return ProjectFolder(root)


def test_files_inside_are_listed_read_and_written(folder: ProjectFolder) -> None:
    assert folder.files() == ["arms/arm.m", "inside.json", "link.json"]
    assert folder.read("arms/arm.m") == b"x = 1;"
    assert not folder.exists("new/model.json")
    written = folder.write("new/model.json", b"{}")
    assert folder.read_known("new/model.json") == (b"{}", written)
    assert folder.exists("new/model.json")


def test_a_file_written_by_another_program_is_detected(folder: ProjectFolder) -> None:
    known = folder.write("a.json", b"one")
    assert folder.compared("a.json", known) == ("same", known)
    path = folder.root / "a.json"
    os.utime(path, ns=(0, 0))
    disk, fingerprint = folder.compared("a.json", known)
    assert disk == "same"
    assert fingerprint != known
    (folder.root / "b.json").write_bytes(b"two")
    os.utime(folder.root / "b.json", ns=(known.modified, known.modified))
    (folder.root / "b.json").rename(path)  # of the same size and time
    assert folder.compared("a.json", known) == ("changed", known)
    path.unlink()
    assert folder.compared("a.json", known) == ("gone", known)
    path.mkdir()
    assert folder.compared("a.json", known) == ("changed", known)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (".hidden.json", "begins or ends with a dot"),
        ("a/ b.json", "begins or ends with a dot or space"),
        ("a//b.json", "is empty"),
        ("what?.json", "contains a character that some systems cannot store"),
        ("line\nbreak.json", "contains a character"),
        ("NUL.json", "is a reserved device name"),
        ("x" * 130 + ".json", "has 135 characters"),
    ],
)
def test_file_names_that_some_systems_cannot_store_are_refused(
    folder: ProjectFolder, name: str, words: str
) -> None:
    with pytest.raises(ArmblocksError, match=f"cannot be a file name: it .*{words}"):
        folder.write(name, b"{}")


def test_a_folder_that_cannot_be_created_raises_an_error(folder: ProjectFolder) -> None:
    with pytest.raises(ArmblocksError, match=r"the folder '.*inside.json' cannot be created"):
        folder.write("inside.json/a.json", b"{}")


def test_partly_written_files_of_a_killed_save_are_removed(folder: ProjectFolder) -> None:
    old, new_file = (
        folder.root / "arms" / ".a.json.0123456789ab.tmp",
        folder.root / ".b.json.0123456789ab.tmp",
    )
    other_file = folder.root / ".notes.tmp"
    for path in (old, new_file, other_file):
        path.write_bytes(b"")
    os.utime(old, (0, 0))
    os.utime(other_file, (0, 0))
    folder.remove_stray_files(["arms/a.json", "../elsewhere.json"])
    assert [path.exists() for path in (old, new_file, other_file)] == [False, True, True]


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("../outside.json", "is outside of the project folder"),
        ("arms/../../outside.json", "is outside of the project folder"),
        ("../project-secret/a.json", "is outside of the project folder"),
        ("link.json", "is outside of the project folder"),
        ("/etc/passwd.json", "is not a path of the project"),
        ("\\\\host\\share\\a.json", "is not a path of the project"),
        ("C:/a.json", "is not a path of the project"),
        ("a\0.json", "is not a path of the project"),
        ("", "is not a path of the project"),
        ("notes.txt", "the studio does not open 'notes.txt'"),
        ("inside.json/..", "is outside of the project folder"),
    ],
)
def test_paths_outside_the_project_are_refused(folder: ProjectFolder, path: str, words: str) -> None:
    with pytest.raises(ArmblocksError, match=words):
        folder.read(path)
    with pytest.raises(ArmblocksError):
        folder.write(path, b"{}")


def test_scripts_can_be_read_but_not_written(folder: ProjectFolder) -> None:
    with pytest.raises(ArmblocksError, match=r"the studio does not open 'arms/arm\.m'"):
        folder.write("arms/arm.m", b"")


def test_robot_names_refer_to_shipped_robots_or_project_files(folder: ProjectFolder) -> None:
    assert folder.robot_path("puma560", ("puma560",)) == "puma560"
    assert folder.robot_path("arms/arm.m", ()) == str(folder.root / "arms" / "arm.m")
    with pytest.raises(ArmblocksError, match="there is no robot named 'pumma'"):
        folder.robot_path("pumma", ("puma560",))
    with pytest.raises(ArmblocksError, match="is outside"):
        folder.robot_path("../outside.json", ())


def test_a_missing_project_folder_raises_an_error(tmp_path: Path) -> None:
    with pytest.raises(ArmblocksError, match="there is no such folder"):
        ProjectFolder(tmp_path / "nowhere")
