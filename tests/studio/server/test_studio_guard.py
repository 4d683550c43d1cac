"""Only the person who started the studio gets replies from it, on every HTTP route and websocket."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Iterator, MutableMapping
from pathlib import Path
from typing import Any

import pytest
from starlette.routing import Mount, Route, WebSocketRoute

from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.server.guard import Guard, Keys
from armblocks.studio.server.web_app import FutureHub, studio_app

HOST = "127.0.0.1:8642"
ORIGIN = f"http://{HOST}"


@pytest.fixture
def web(tmp_path: Path) -> Path:
    folder = tmp_path / "web"
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text("<html></html>")
    (tmp_path / "web-secret").mkdir()
    (tmp_path / "web-secret" / "key").write_text("HIDDEN")
    (tmp_path / "secret.txt").write_text("HIDDEN")
    (folder / "link.txt").symlink_to(tmp_path / "secret.txt")
    return folder


@pytest.fixture
def keys() -> Keys:
    return Keys(8642)


@pytest.fixture
def app(web: Path, keys: Keys, tmp_path: Path) -> Guard:
    project = tmp_path / "project"
    project.mkdir()
    return studio_app(FutureHub(ProjectFolder(project)), keys, frozenset({HOST}), web)


def call(app: Guard, path: str, headers: dict[str, str], *, method: str = "GET", kind: str = "http") -> Any:
    """Return status and headers of a request, or the close code of a websocket (0: accepted)."""
    sent: list[MutableMapping[str, Any]] = []
    route, _, query = path.partition("?")
    scope: dict[str, Any] = {
        "type": kind,
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "scheme": "http" if kind == "http" else "ws",
        "path": route,
        "raw_path": route.encode("utf-8", "replace"),
        "root_path": "",
        "query_string": query.encode("utf-8", "replace"),
        "headers": [(name.encode(), value.encode()) for name, value in headers.items()],
        "client": ("127.0.0.1", 1),
        "server": ("127.0.0.1", 8642),
        "subprotocols": [],
        "extensions": {},
    }
    if kind == "http":
        scope["method"] = method
    messages: list[MutableMapping[str, Any]] = (
        [{"type": "http.request", "body": b"", "more_body": False}, {"type": "http.disconnect"}]
        if kind == "http"
        else [{"type": "websocket.connect"}, {"type": "websocket.disconnect", "code": 1000}]
    )

    async def receive() -> MutableMapping[str, Any]:
        return messages.pop(0)

    async def send(message: MutableMapping[str, Any]) -> None:
        sent.append(message)

    asyncio.run(app(scope, receive, send))
    if kind == "websocket":
        return 0 if sent[0]["type"] == "websocket.accept" else sent[0]["code"]
    answer = {name.decode(): value.decode() for name, value in sent[0]["headers"]}
    return sent[0]["status"], answer, b"".join(part.get("body", b"") for part in sent[1:])


def cookie(keys: Keys) -> dict[str, str]:
    return {"host": HOST, "cookie": f"{keys.cookie_name}={keys.session}"}


def routes(app: Guard) -> list[tuple[str, str]]:
    """All routes of the application, so that the tests include new routes."""
    entries: list[tuple[str, str]] = []
    for route in app._app.routes:  # pyright: ignore
        if isinstance(route, WebSocketRoute):
            entries.append(("websocket", route.path))
        elif isinstance(route, Route):
            entries += [("http", route.path.replace("{document}", "x"))]
        elif isinstance(route, Mount):
            entries.append(("http", route.path + "/index.html"))
    return entries


def test_every_route_except_login_and_health_needs_a_session(app: Guard) -> None:
    paths = routes(app)
    assert ("websocket", "/ws") in paths
    assert len(paths) >= 5
    for kind, path in paths:
        if kind == "websocket":
            assert call(app, path, {"host": HOST, "origin": ORIGIN}, kind=kind) == 4403
        elif path not in Guard.OPEN:
            assert call(app, path, {"host": HOST})[0] == 401, path
    assert call(app, "/health", {"host": HOST})[0] == 200


HOSTILE = (
    "",
    ".",
    "..",
    "../secret",
    "../../secret.txt",
    "%2e%2e%2fsecret.txt",
    "..\\secret.txt",
    "/etc/passwd",
    "//host/share",
    "C:\\secret",
    "a\0b",
    "x" * 20_000,
    "\ud7ff\uffff",
    "<script>alert(1)</script>",
    "{document}",
    "%s%n",
    "__class__",
)
QUERIES = ("", "sheet=../..", "theme=dark&theme=x", "theme=%00", "sheet=" + "a/" * 5000, "key=%ff", "&&==&")


def hostile_paths(app: Guard, document: str) -> Iterator[str]:
    """Every route with hostile values for each of its parameters, and hostile queries."""
    for route in app._app.routes:  # pyright: ignore
        if isinstance(route, WebSocketRoute):
            continue
        path: str = route.path
        for hostile in HOSTILE:
            for name in re.findall(r"{\w+}", path):
                filled = path.replace(name, hostile)
                yield filled.replace("{document}", document).replace("{kind}", "svg")
            yield f"{path.rstrip('/')}/{hostile}"
        for query in QUERIES:
            yield f"{path.replace('{document}', document).replace('{kind}', 'svg')}?{query}"


def test_hostile_parameters_cause_no_server_error_and_reveal_no_file(
    web: Path, keys: Keys, tmp_path: Path
) -> None:
    (tmp_path / "project").mkdir()
    future_hub = FutureHub(ProjectFolder(tmp_path / "project"))
    app = studio_app(future_hub, keys, frozenset({HOST}), web)

    events: list[dict[str, Any]] = []

    async def receive(text: str | bytes) -> None:
        events.append(json.loads(text))

    async def opened() -> str:
        hub, client = await future_hub.ready(), StudioClient(receive, receive)
        await hub.answer(client, '{"number": 1, "request": {"kind": "new", "document_kind": "diagram"}}')
        return events[-1]["value"]

    document = asyncio.run(opened())
    assert call(app, f"/drawing/{document}.svg", cookie(keys))[0] == 200
    paths = sorted(set(hostile_paths(app, document)))
    assert len(paths) > 100
    for path in paths:
        status, answer, body = call(app, path, cookie(keys))
        assert status in (200, 303, 307, 401, 404, 405, 422), (status, path[:100])
        assert status == 200 or len(body) < 30_000
        assert b"HIDDEN" not in body
        assert "default-src 'self'" in answer["content-security-policy"]
        if b"<script>alert" in body:
            assert answer["content-type"].startswith("text/plain")
    headers = {**cookie(keys), "origin": ORIGIN, "x-armblocks": "1", "sec-fetch-site": "same-origin"}
    for path in [path for kind, path in routes(app) if kind == "http"]:
        for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "NONSENSE"):
            assert call(app, path, headers, method=method)[0] in (404, 405), (method, path)


def test_the_login_link_is_valid_once(app: Guard, keys: Keys) -> None:
    link = f"/login?key={keys.new_login()}"
    status, headers, _ = call(app, link, {"host": HOST})
    assert status == 303
    assert headers["location"] == "/"
    set_cookie = headers["set-cookie"].lower()
    assert "httponly" in set_cookie
    assert "samesite=strict" in set_cookie
    assert keys.session in headers["set-cookie"]
    assert call(app, link, {"host": HOST})[0] == 401
    assert call(app, "/login?key=", {"host": HOST})[0] == 401
    assert call(app, "/", cookie(keys))[0] == 200


@pytest.mark.parametrize(
    "host", ["evil.com", "127.0.0.1:8643", "127.0.0.1", "127.0.0.1.nip.io:8642", f"{HOST}.evil.com", ""]
)
def test_other_hosts_are_refused_even_with_the_cookie(app: Guard, keys: Keys, host: str) -> None:
    assert call(app, "/", {**cookie(keys), "host": host})[0] == 403
    assert call(app, "/ws", {**cookie(keys), "host": host, "origin": ORIGIN}, kind="websocket") == 4403


@pytest.mark.parametrize(
    "origin", ["null", "http://evil.com", f"{ORIGIN}.evil.com", "http://localhost:1", "https://" + HOST]
)
def test_other_origins_are_refused_on_http_and_websocket(app: Guard, keys: Keys, origin: str) -> None:
    assert call(app, "/", {**cookie(keys), "origin": origin})[0] == 403
    assert call(app, "/ws", {**cookie(keys), "origin": origin}, kind="websocket") == 4403


def test_a_websocket_needs_cookie_and_origin_or_the_token(app: Guard, keys: Keys) -> None:
    assert call(app, "/ws", {**cookie(keys), "origin": ORIGIN}, kind="websocket") == 0
    assert call(app, "/ws", cookie(keys), kind="websocket") == 4403
    bearer = {"host": HOST, "authorization": f"Bearer {keys.token}"}
    assert call(app, "/ws", bearer, kind="websocket") == 0
    assert call(app, "/ws", {**bearer, "authorization": "Bearer x"}, kind="websocket") == 4403
    cross_site = {**cookie(keys), "origin": ORIGIN, "sec-fetch-site": "cross-site"}
    assert call(app, "/ws", cross_site, kind="websocket") == 4403


def test_requests_that_change_something_need_the_custom_header(app: Guard, keys: Keys) -> None:
    assert call(app, "/", {**cookie(keys), "origin": ORIGIN}, method="POST")[0] == 403
    cross_site = {**cookie(keys), "origin": ORIGIN, "x-armblocks": "1", "sec-fetch-site": "same-site"}
    assert call(app, "/", cross_site, method="POST")[0] == 403
    # Accepted by the guard, rejected by the route, which has no POST method.
    accepted = {**cookie(keys), "origin": ORIGIN, "x-armblocks": "1", "sec-fetch-site": "same-origin"}
    assert call(app, "/", accepted, method="POST")[0] == 405


def test_two_host_headers_are_refused(app: Guard, keys: Keys) -> None:
    scope: dict[str, Any] = {
        "type": "http",
        "method": "GET",
        "path": "/",
        "headers": [(b"host", HOST.encode()), (b"host", b"evil.com")],
    }
    assert app.refusal(scope) == (403, "this server accepts requests to its own address only")


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.txt",
        "/..%2fsecret.txt",
        "/%2e%2e/secret.txt",
        "/../web-secret/key",
        "/link.txt",
        "//etc/passwd",
        "/..\\secret.txt",
    ],
)
def test_no_path_leads_out_of_the_page_folder(app: Guard, keys: Keys, path: str) -> None:
    status, _, body = call(app, path, cookie(keys))
    assert status in (401, 404, 405)
    assert b"HIDDEN" not in body


def test_responses_have_a_content_security_policy(app: Guard, keys: Keys) -> None:
    for headers in (cookie(keys), {"host": HOST}):
        _, answer, _ = call(app, "/", headers)
        policy = answer["content-security-policy"]
        assert "default-src 'self'" in policy
        assert "script-src 'self'" in policy
        assert "frame-ancestors 'none'" in policy
        assert answer["x-content-type-options"] == "nosniff"
        assert answer["referrer-policy"] == "no-referrer"
        assert "server" not in answer
    for path in ("/docs", "/openapi.json", "/redoc"):
        assert call(app, path, cookie(keys))[0] == 404
