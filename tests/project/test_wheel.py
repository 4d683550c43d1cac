"""The wheel is pure Python, brings what is shipped, and runs without the checkout."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    (built,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return Path(built)


def test_the_wheel_fits_every_system(wheel: Path) -> None:
    assert wheel.name.endswith("-py3-none-any.whl")


def test_the_wheel_brings_what_is_shipped(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    for folder in ("robots", "examples", "libraries"):
        for path in (ROOT / folder).rglob("*.*"):
            if path.is_file() and not path.name.startswith("."):
                assert f"armblocks/shipped/{path.relative_to(ROOT).as_posix()}" in names
    for path in (ROOT / "src" / "armblocks").rglob("*"):
        if path.is_file() and path.suffix != ".pyc":
            assert f"armblocks/{path.relative_to(ROOT / 'src' / 'armblocks').as_posix()}" in names
    assert "armblocks/py.typed" in names


def test_the_wheel_runs_without_the_checkout(wheel: Path, tmp_path: Path) -> None:
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    script = "import armblocks, sys; print(armblocks.__file__); from armblocks.cli.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", script, "run", "kr180model", "--no-figures"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path / "site")},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(str(tmp_path / "site"))
    assert (tmp_path / "kr180model-report" / "report.html").is_file()
