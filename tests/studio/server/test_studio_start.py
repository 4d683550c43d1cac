"""The page is served before the hub exists; a hub that cannot be created ends the server with an error."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import MutableMapping
from pathlib import Path
from typing import Any

import pytest

from armblocks.errors import FormatError
from armblocks.studio import built_page as page_files
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.server import launch
from armblocks.studio.server.guard import Keys
from armblocks.studio.server.hub import Hub
from armblocks.studio.server.web_app import CACHE_CONTROL, FutureHub, studio_app

HOST = "127.0.0.1:8642"


@pytest.fixture
def web(tmp_path: Path) -> Path:
    (tmp_path / "web" / "assets").mkdir(parents=True)
    (tmp_path / "web" / "index.html").write_text("<html></html>")
    (tmp_path / "web" / "assets" / "index-1a2b.js").write_text("")
    return tmp_path / "web"


def response(web: Path, hub: FutureHub, path: str) -> tuple[int, dict[str, str]]:
    """Status and headers of the response to an authenticated request."""
    keys, sent = Keys(8642), list[MutableMapping[str, Any]]()
    app = studio_app(hub, keys, frozenset({HOST}), web)
    scope: dict[str, Any] = {
        "type": "http",
        "method": "GET",
        "path": path,
        "root_path": "",
        "query_string": b"",
        "headers": [
            (b"host", HOST.encode()),
            (b"cookie", f"{keys.cookie_name}={keys.session}".encode()),
        ],
    }

    messages = [{"type": "http.request", "body": b"", "more_body": False}]

    async def receive() -> MutableMapping[str, Any]:
        return messages.pop() if messages else await asyncio.Future()

    async def send(message: MutableMapping[str, Any]) -> None:
        sent.append(message)

    asyncio.run(app(scope, receive, send))
    return sent[0]["status"], {name.decode(): value.decode() for name, value in sent[0]["headers"]}


def test_the_page_is_served_while_the_hub_is_created(
    web: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    resume = threading.Event()

    def delayed_hub(folder: ProjectFolder) -> Hub:
        resume.wait()
        return Hub(folder)

    monkeypatch.setattr("armblocks.studio.server.hub.Hub", delayed_hub)
    hub = FutureHub(ProjectFolder(tmp_path))
    hub.begin()
    try:
        assert response(web, hub, "/")[0] == 200
        assert response(web, hub, "/assets/index-1a2b.js")[0] == 200
        assert not hub.result.done()
    finally:
        resume.set()
    assert isinstance(hub.result.result(timeout=60), Hub)
    hub.result.result().close()


def test_hashed_files_are_cached_and_the_page_is_not(web: Path, tmp_path: Path) -> None:
    hub = FutureHub(ProjectFolder(tmp_path))
    assert response(web, hub, "/assets/index-1a2b.js")[1]["cache-control"] == CACHE_CONTROL
    assert response(web, hub, "/")[1]["cache-control"] == "no-cache"


def test_a_server_whose_hub_cannot_be_created_ends_with_the_reason(
    web: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(folder: ProjectFolder) -> Hub:
        raise FormatError("the shipped robots are missing", where=str(folder.root))

    monkeypatch.setattr("armblocks.studio.server.hub.Hub", broken)
    monkeypatch.setattr(launch, "built_page", lambda: page_files.built_page(web))
    with pytest.raises(FormatError, match="the shipped robots are missing"):
        launch.serve(tmp_path, "", port=0, open_browser=False, announce=lambda _: None)
