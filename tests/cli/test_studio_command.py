"""``armblocks studio`` says in words why it cannot start; exit code 2."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

import pytest

Refused = Callable[..., str]


def said(text: str) -> str:
    """A message without its line breaks and its box."""
    return " ".join(text.replace("│", " ").split())


def test_a_port_that_another_program_holds(refused: Refused) -> None:
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        held.listen()
        port = held.getsockname()[1]
        text = said(refused("studio", "--no-browser", "--port", str(port)))
    assert f"port {port} cannot be used" in text
    assert "choose another --port" in text


def test_a_folder_that_is_missing_or_is_a_file(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{}")
    for folder in ("none", "a.json"):
        assert "there is no such folder" in said(refused("studio", "--no-browser", "--folder", folder))


def test_a_folder_that_cannot_be_read(
    refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda *_: False)  # whoever runs the tests may be allowed everything
    assert "is not readable" in said(refused("studio", "--no-browser", "--folder", str(tmp_path)))


def test_a_model_outside_of_the_folder(refused: Refused, tmp_path: Path) -> None:
    (tmp_path / "m.json").write_text("{}")
    (tmp_path / "other").mkdir()
    text = said(refused("studio", "--no-browser", "--folder", "other", "m.json"))
    assert "the model 'm.json' does not lie in the folder" in text
    assert "leave --folder out" in text


def test_a_model_that_is_not_there(refused: Refused) -> None:
    assert "there is no such file and no such example" in said(refused("studio", "--no-browser", "nix"))


def test_an_installation_without_the_page(refused: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> Path:
        from armblocks.studio.server import web_app as server

        return server.built_page(Path("nowhere"))

    monkeypatch.setattr("armblocks.studio.server.launch.built_page", missing)
    text = said(refused("studio", "--no-browser"))
    assert "this installation has no studio page" in text
    assert "install Node.js" in text
