"""The terminal output of the studio contains no key except the login link, and no file contents."""

from __future__ import annotations

import json
import logging
import logging.config
import socket
import struct
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from armblocks.studio.server.guard import Keys
from armblocks.studio.server.terminal_log import log_settings
from conftest import TIMEOUT_MS, Studio
from interruptible import killed_at_the_end

CONTENT = "confidential-content"


class NoRedirect(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *_: Any) -> None:
        """Return the login response itself; redirects are not followed."""


def status(address: str, headers: dict[str, str]) -> tuple[int, str]:
    """Return status and cookie of a response."""
    requested = urllib.request.Request(address, headers=headers)
    try:
        with urllib.request.build_opener(NoRedirect).open(requested, timeout=TIMEOUT_MS / 1000) as answer:
            return answer.status, answer.headers.get("set-cookie", "")
    except urllib.error.HTTPError as refused:
        with refused:
            return refused.code, refused.headers.get("set-cookie", "")


def test_the_terminal_shows_no_key_after_the_login_and_no_file_content(tmp_path: Path) -> None:
    (tmp_path / "bad.json").write_text('{"blocks": {"' + CONTENT)
    (tmp_path / "script.m").write_text(f"{CONTENT} = (1")
    studio = Studio(tmp_path)
    with killed_at_the_end(studio.process):
        rest, secrets = _output_after_the_login(studio)
    for secret in secrets:
        assert secret not in rest
    assert "Exception in ASGI application" not in rest  # of the aborted connections


def _abort(address: str, headers: dict[str, str]) -> None:
    """End a connection abruptly, as a killed browser does, while replies are pending."""
    opening = {"kind": "open_shipped", "document_kind": "diagram", "name": "kr180model"}
    with connect(address, additional_headers=headers, max_size=None) as client:
        for number in range(20):
            client.send(json.dumps({"number": number, "request": opening}))
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        client.socket.shutdown(socket.SHUT_RD)
        client.socket.close()


def _output_after_the_login(studio: Studio) -> tuple[str, tuple[str, ...]]:
    """Provoke errors that could reveal secrets; return the terminal output and the secrets."""
    key = studio.link.partition("key=")[2]
    code, cookie = status(studio.link, {})
    assert code == 303
    cookie = cookie.partition(";")[0]
    session = cookie.partition("=")[2]
    assert len(session) > 30
    for path in ("login?key=" + key, "login?key=" + session, "?key=" + key, "nowhere/" + CONTENT):
        assert status(studio.address + path, {"cookie": cookie})[0] in (200, 401, 404)
    assert status(studio.address, {"cookie": cookie, "host": "evil.com"})[0] == 403
    headers = {"cookie": cookie, "origin": studio.address.rstrip("/")}
    address = studio.address.replace("http", "ws") + "ws"
    for _ in range(3):
        _abort(address, headers)
    with connect(address, additional_headers=headers, max_size=None) as client:
        for number, path in enumerate(("bad.json", "script.m", CONTENT + ".json")):
            client.send(json.dumps({"number": number, "request": {"kind": "open", "path": path}}))
            while (message := json.loads(client.recv(timeout=60)))["kind"] != "reply":
                pass
            assert message["fault"]["what"]
        client.send(json.dumps({"number": 9, "request": {"kind": CONTENT}}))
        client.send(CONTENT)
        with pytest.raises(ConnectionClosed):
            while True:
                client.recv(timeout=60)
    assert studio.process.stdout is not None
    output = studio.process.stdout
    studio.process.terminate()
    rest = output.read()
    studio.process.wait(timeout=TIMEOUT_MS / 1000)
    return rest, (key, session, CONTENT)


def test_logged_exceptions_have_a_traceback_and_no_message(capsys: pytest.CaptureFixture[str]) -> None:
    keys = Keys(1)
    login = keys.new_login()
    keys.new_login()
    root = logging.getLogger()
    before, level = root.handlers[:], root.level
    try:
        logging.config.dictConfig(log_settings(keys.secrets))
        try:
            raise ValueError(CONTENT) from KeyError(CONTENT)
        except ValueError:
            logging.getLogger("armblocks.studio.server.hub").exception("a request failed because of a defect")
        logging.getLogger("uvicorn.error").warning("GET /login?key=%s %s %s", login, keys.session, keys.token)
    finally:
        root.handlers[:] = before
        root.setLevel(level)
    message = capsys.readouterr().err
    assert "ERROR: a request failed because of a defect" in message
    assert f'File "{__file__}"' in message
    assert "ValueError" in message
    assert "WARNING: GET /login?key=… … …" in message
    for secret in (CONTENT, *keys.secrets()):
        assert secret not in message.replace("raise ValueError(CONTENT) from KeyError(CONTENT)", "")
