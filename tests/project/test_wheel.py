"""The wheel is pure Python, contains shipped files and documentation, and runs without the checkout."""

import inspect
import os
import re
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Iterator
from email import message_from_bytes
from enum import Enum
from functools import cached_property
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

import armblocks as ab
from armblocks.blocks import BLOCKS

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    (built,) = WheelBuilder(str(ROOT)).build(directory=str(folder), versions=["standard"])
    return Path(built)


def test_the_wheel_is_platform_independent(wheel: Path) -> None:
    assert wheel.name.endswith("-py3-none-any.whl")


def test_the_description_for_a_package_index_has_no_links_to_files(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as content:
        (name,) = (name for name in content.namelist() if name.endswith(".dist-info/METADATA"))
        description = message_from_bytes(content.read(name)).get_payload()
    assert isinstance(description, str)
    assert description.startswith("# armblocks\n") and "## A short tour" in description
    assert re.findall(r"\]\((?!https?:)|(?:src|srcset)=", description) == []


def test_the_wheel_contains_the_shipped_files(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    for folder in ("robots", "examples", "libraries"):
        for path in (ROOT / folder).rglob("*.*"):
            if path.is_file() and not path.name.startswith("."):
                assert f"armblocks/shipped/{path.relative_to(ROOT).as_posix()}" in names
    for path in (ROOT / "src" / "armblocks").rglob("*"):
        if path.is_file() and path.suffix != ".pyc":
            assert f"armblocks/{path.relative_to(ROOT / 'src' / 'armblocks').as_posix()}" in names
    assert "armblocks/py.typed" in names


def test_the_wheel_contains_a_page_of_every_document_and_no_sources(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    documents = [path.stem for path in (ROOT / "docs").glob("*.md")]
    blocks = [f"reference/blocks/{name}" for name in BLOCKS]
    for page in ("index", "reference/blocks", "reference/robots", "reference/examples", *documents, *blocks):
        assert f"armblocks/shipped/docs/{page}.html" in names
    for left_out in ("_sources", ".doctrees", "_modules"):
        assert not [name for name in names if f"docs/{left_out}" in name]


def test_the_pages_load_nothing_from_the_network(wheel: Path) -> None:
    archive = zipfile.ZipFile(wheel)
    attributes = r"""<(?!a\s)[^>]*(?:src|srcset|href)="(?:https?:)?//[^"]*\""""
    loaded = re.compile(attributes + r"""|url\(["']?(?:https?:)?//""")
    for name in archive.namelist():
        if name.startswith("armblocks/shipped/docs/") and name.endswith((".html", ".css")):
            assert not loaded.findall(archive.read(name).decode()), name


def public_members(kind: type) -> Iterator[str]:
    """Methods and properties without an underscore, including those of public base classes."""
    for name, member in inspect.getmembers_static(kind):
        described = isinstance(member, property | cached_property | classmethod | staticmethod)
        if not name.startswith("_") and (described or inspect.isfunction(member)):
            yield name


def test_the_reference_has_every_public_name(wheel: Path) -> None:
    inventory = zipfile.ZipFile(wheel).read("armblocks/shipped/docs/objects.inv")
    # Four comment lines, then compressed lines of name, type and location.
    lines = zlib.decompress(inventory.split(b"\n", maxsplit=4)[4]).decode().splitlines()
    described = {line.split()[0] for line in lines if " py:" in line}
    missing: list[str] = []
    for name in ab.__all__:
        public = getattr(ab, name)
        if inspect.ismodule(public):
            continue  # each block has a page; errors are below
        required = [f"armblocks.{name}"]
        if inspect.isclass(public) and not issubclass(public, Enum):
            required += [f"armblocks.{name}.{member}" for member in public_members(public)]
        missing += [path for path in required if path not in described]
    for name, kind in inspect.getmembers_static(ab.errors, inspect.isclass):
        if issubclass(kind, ValueError | Warning) and f"armblocks.errors.{name}" not in described:
            missing.append(name)
    assert missing == []


SCRIPT = """
import armblocks
from armblocks.cli.main import app

print(armblocks.__file__)
app(["docs", "--path", "Gain"], standalone_mode=False)
app(["run", "kr180model", "--no-figures"], standalone_mode=False)
"""


def test_the_wheel_runs_without_the_checkout(wheel: Path, tmp_path: Path) -> None:
    site = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(site)
    completed = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(site)},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    assert completed.returncode == 0, completed.stderr
    module, page, *_ = completed.stdout.splitlines()
    assert Path(module) == site / "armblocks" / "__init__.py"
    assert Path(page) == site / "armblocks" / "shipped" / "docs" / "reference" / "blocks" / "Gain.html"
    assert (tmp_path / "kr180model-report" / "report.html").is_file()
