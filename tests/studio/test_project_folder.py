"""The studio reads and writes below its folder only."""

from __future__ import annotations

from pathlib import Path

import pytest

from armblocks.errors import ArmblocksError
from armblocks.studio.project_folder import ProjectFolder


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
    before = folder.state("new/model.json")
    folder.write("new/model.json", b"{}")
    assert before is None
    assert folder.read("new/model.json") == b"{}"
    assert folder.state("new/model.json") is not None


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("../outside.json", "lies outside of the project folder"),
        ("arms/../../outside.json", "lies outside of the project folder"),
        ("../project-secret/a.json", "lies outside of the project folder"),
        ("link.json", "lies outside of the project folder"),
        ("/etc/passwd.json", "is no path of the project"),
        ("\\\\host\\share\\a.json", "is no path of the project"),
        ("C:/a.json", "is no path of the project"),
        ("a\0.json", "is no path of the project"),
        ("", "is no path of the project"),
        ("notes.txt", "the studio does not open 'notes.txt'"),
        ("inside.json/..", "lies outside of the project folder"),
    ],
)
def test_paths_that_lead_elsewhere_are_refused(folder: ProjectFolder, path: str, words: str) -> None:
    with pytest.raises(ArmblocksError, match=words):
        folder.read(path)
    with pytest.raises(ArmblocksError):
        folder.write(path, b"{}")


def test_scripts_are_read_and_never_written(folder: ProjectFolder) -> None:
    with pytest.raises(ArmblocksError, match=r"the studio does not open 'arms/arm\.m'"):
        folder.write("arms/arm.m", b"")


def test_robots_are_shipped_ones_or_files_of_the_folder(folder: ProjectFolder) -> None:
    assert folder.robot_path("puma560", ("puma560",)) == "puma560"
    assert folder.robot_path("arms/arm.m", ()) == str(folder.root / "arms" / "arm.m")
    with pytest.raises(ArmblocksError, match="there is no robot named 'pumma'"):
        folder.robot_path("pumma", ("puma560",))
    with pytest.raises(ArmblocksError, match="lies outside"):
        folder.robot_path("../outside.json", ())


def test_a_folder_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(ArmblocksError, match="there is no such folder"):
        ProjectFolder(tmp_path / "nowhere")
