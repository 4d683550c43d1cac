"""``armblocks docs`` opens a page, builds the pages in a checkout, and reports the reason of a failure."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

from armblocks.cli import docs
from armblocks.errors import FormatError


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Test pages in place of the installed pages."""
    folder = tmp_path / "pages"
    for name in ("index", "simulation", "reference/blocks", "reference/blocks/Gain"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.html").touch()
    monkeypatch.setattr(docs, "INSTALLED_PAGES", folder)
    return folder


def test_a_page_or_a_block_is_opened(
    site: Path, invoke: Callable[..., Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []

    def open_page(address: str) -> bool:
        opened.append(address)
        return len(opened) < 4

    monkeypatch.setattr("webbrowser.open", open_page)
    for typed in ((), ("simulation",), ("Gain",)):
        assert invoke("docs", *typed).stdout == ""
    files = [site / f"{name}.html" for name in ("index", "simulation", "reference/blocks/Gain")]
    assert opened == [file.as_uri() for file in files]
    # Without a browser the address is printed, as with --path.
    assert invoke("docs").stdout.strip() == invoke("docs", "--path").stdout.strip() == str(files[0])
    assert len(opened) == 4


def test_page_names_are_completed_and_unknown_pages_are_refused(
    site: Path, refusal: Callable[..., str]
) -> None:
    assert docs.complete_pages("sim") == ["simulation"]
    text = refusal("docs", "simulatoin")
    assert "there is no page of the documentation named 'simulatoin'" in text
    assert "did you mean 'simulation'?" in text


def test_a_checkout_builds_the_pages_once_and_reports_why_a_build_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    absent, script = tmp_path / "absent", tmp_path / "docs" / "build_site.py"
    index = tmp_path / "docs" / "_build" / "html" / "index.html"
    lines: list[str] = []
    with pytest.raises(FormatError, match=r"installed with ARMBLOCKS_SKIP_DOCS=1.*install a wheel that has"):
        docs.built_pages(lines.append, absent, script)
    script.parent.mkdir()
    script.write_text("raise SystemExit(3)")
    with pytest.raises(FormatError, match=r"documentation could not be built; the reason.*correct the rep"):
        docs.built_pages(lines.append, absent, script)
    monkeypatch.setattr(docs, "installed", lambda tool: tool != "furo")
    with pytest.raises(FormatError, match=r"no built documentation, and Sphinx.*pip install --editable"):
        docs.built_pages(lines.append, absent, script)
    monkeypatch.undo()
    script.write_text(
        f"import pathlib; p = pathlib.Path({str(index)!r}); p.parent.mkdir(parents=True); p.touch()"
    )
    assert docs.built_pages(lines.append, absent, script) == index.parent
    assert len(lines) == 2
    assert "Building the documentation of this checkout" in lines[0]
    script.write_text("raise SystemExit(3)")
    assert docs.built_pages(lines.append, absent, script) == index.parent  # the pages exist
