"""``armblocks studio`` reports the reason of a failed start; exit code 2."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from armblocks.errors import FormatError
from armblocks.studio.built_page import build_in_checkout, built_page

Refusal = Callable[..., str]


def plain_text(text: str) -> str:
    """A message without its line breaks and its box."""
    return " ".join(text.replace("│", " ").split())


def test_a_port_in_use_by_another_program_is_refused(refusal: Refusal) -> None:
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        held.listen()
        port = held.getsockname()[1]
        text = plain_text(refusal("studio", "--no-browser", "--port", str(port)))
    assert f"port {port} cannot be used" in text
    assert "choose another --port" in text


def test_a_missing_folder_or_a_file_in_its_place_is_refused(refusal: Refusal, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{}")
    for folder in ("none", "a.json"):
        assert "there is no such folder" in plain_text(refusal("studio", "--no-browser", "--folder", folder))


def test_an_unreadable_folder_is_refused(
    refusal: Refusal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)  # the user who runs the tests may have all permissions
    assert "is not readable" in plain_text(refusal("studio", "--no-browser", "--folder", str(tmp_path)))


def test_a_model_outside_of_the_folder_is_refused(refusal: Refusal, tmp_path: Path) -> None:
    (tmp_path / "m.json").write_text("{}")
    (tmp_path / "other").mkdir()
    text = plain_text(refusal("studio", "--no-browser", "--folder", "other", "m.json"))
    assert "the model 'm.json' is not in the folder" in text
    assert "omit --folder" in text


def test_a_missing_model_is_refused(refusal: Refusal) -> None:
    assert "there is no such file and no such example" in plain_text(refusal("studio", "--no-browser", "nix"))


def test_an_installation_without_the_studio_page_is_reported(
    refusal: Refusal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing() -> Path:
        return built_page(Path("nowhere"), Path("nowhere/build_page.py"))

    monkeypatch.setattr("armblocks.studio.server.launch.built_page", missing)
    text = plain_text(refusal("studio", "--no-browser"))
    assert "this installation has no studio page" in text
    assert "install a wheel that has the front end" in text


def test_a_checkout_builds_the_page_once_and_reports_why_a_build_fails(tmp_path: Path) -> None:
    web, script = tmp_path / "web", tmp_path / "build_page.py"
    lines: list[str] = []
    build_in_checkout(lines.append, web, script)  # not a checkout: there are no sources to build
    assert lines == []
    script.write_text("raise SystemExit(3)")
    with pytest.raises(FormatError, match=r"front end of the studio could not be built.*install Node\.js"):
        build_in_checkout(lines.append, web, script)
    with pytest.raises(FormatError, match=r"run 'python .*build_page\.py'"):
        built_page(web, script)
    script.write_text(
        f"import pathlib; p = pathlib.Path({str(web)!r}); p.mkdir(); (p / 'index.html').touch()"
    )
    build_in_checkout(lines.append, web, script)
    assert len(lines) == 2
    assert "Building the studio page of this checkout" in lines[0]
    script.write_text("raise SystemExit(3)")
    build_in_checkout(lines.append, web, script)  # the page exists
    assert built_page(web) == web
