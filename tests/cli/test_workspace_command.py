"""Output, files and exit codes of ``armblocks workspace``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from typer.testing import Result

Invoke = Callable[..., Result]


def test_workspace_prints_the_region_and_writes_a_folder(invoke: Invoke, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    ranges = ("--range", "link1=-1,1", "--range", "link2=0,2")
    result = invoke("workspace", "twolink", "--samples", "2000", *ranges, "--out", str(folder))
    assert result.exit_code == 0, result.output
    assert "reach from the base: 2 m" in result.stdout
    assert "manipulability" in result.stdout and "4 files" in result.stdout
    assert (folder / "workspace.html").is_file() and (folder / "manipulability.svg").is_file()


def test_workspace_writes_one_file(invoke: Invoke, tmp_path: Path) -> None:
    path = tmp_path / "cells.csv"
    arguments = ("--samples", "500", "--measure", "limits", "--measure", "condition", "--cell", "0.2")
    result = invoke("workspace", "cobra600", *arguments, "--out", str(path))
    assert result.exit_code == 0, result.output
    assert path.read_text().startswith("x,y,z,count,condition most")


def test_workspace_names_a_wrong_range(invoke: Invoke) -> None:
    result = invoke("workspace", "twolink", "--range", "link1=low,high")
    assert result.exit_code == 2
    assert "'low,high' is not a pair of numbers" in result.stderr
