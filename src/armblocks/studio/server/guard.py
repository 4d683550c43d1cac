"""Access control of the studio: checks of every HTTP request and websocket before anything else.

A request must pass all of these checks; only the routes in ``Guard.OPEN`` need no session:

1. exactly one ``Host`` header, which names this server (against DNS rebinding: CVE-2026-21883 and similar);
2. an ``Origin``, if present, equals this server's own, compared as a whole string, never by a pattern
   (CVE-2026-40110); a websocket without an ``Origin`` must send the token as a bearer token;
3. a request with ``Sec-Fetch-Site`` other than ``same-origin`` or ``none`` may not change anything;
4. the session: the cookie from the one-time login link, or ``Authorization: Bearer TOKEN``;
5. a request that changes something has the header ``X-Armblocks``, which a plain HTML form cannot send.

The guard is an ASGI wrapper because the middleware of web frameworks does not process websockets
(CVE-2026-39987, CVE-2024-28179).
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from starlette.requests import cookie_parser

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

SAFE_METHODS = ("GET", "HEAD")
CHANGE_HEADER = "x-armblocks"
POLICY_VIOLATION = 4403
"""Close code of a rejected websocket."""

SECURITY_HEADERS: tuple[tuple[bytes, bytes], ...] = (
    (
        b"content-security-policy",
        b"default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
        b"img-src 'self' data: blob:; "
        b"font-src 'self'; connect-src 'self'; worker-src 'self' blob:; object-src 'none'; base-uri 'none'; "
        b"form-action 'none'; frame-ancestors 'none'",
    ),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"x-frame-options", b"DENY"),
)


class Keys:
    """The secrets of one server, created at its start.

    ``token`` grants full access as a bearer token. ``login`` is valid once; it sets the cookie ``session``.
    A given ``session`` is the session of the previous server, so that its clients can reconnect.
    """

    def __init__(self, port: int, session: str = "") -> None:
        self.token = secrets.token_urlsafe(32)
        self.session = session or secrets.token_urlsafe(32)
        self.cookie_name = f"armblocks-{port}"
        self._login: str | None = None
        self._logins: list[str] = []

    def secrets(self) -> tuple[str, ...]:
        """All secrets that must not be logged, including logins that are no longer valid."""
        return (self.token, self.session, *self._logins)

    def new_login(self) -> str:
        """Create a new one-time login; the previous login becomes invalid."""
        self._login = secrets.token_urlsafe(32)
        self._logins.append(self._login)
        return self._login

    def spend_login(self, login: str) -> bool:
        """Return whether ``login`` is valid, and invalidate it."""
        is_valid = self._login is not None and hmac.compare_digest(login.encode(), self._login.encode())
        if is_valid:
            self._login = None
        return is_valid


class Guard:
    """Wraps an ASGI application with the checks of this module."""

    OPEN = ("/login", "/health")

    def __init__(self, app: App, keys: Keys, hosts: frozenset[str]) -> None:
        """``hosts``: the ``Host`` values of this server, for example ``127.0.0.1:8642``."""
        self._app = app
        self._keys = keys
        self._hosts = hosts
        self._origins = frozenset(f"http://{host}" for host in hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Reject the request, or pass it on and add the security headers to the response."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        refusal = self.refusal(scope)
        if scope["type"] == "websocket":
            if refusal:
                await receive()
                await send({"type": "websocket.close", "code": POLICY_VIOLATION, "reason": refusal[1]})
                return
            await self._app(scope, receive, send)
            return

        async def send_guarded(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *SECURITY_HEADERS]
            await send(message)

        if refusal:
            await _answer(send_guarded, *refusal)
            return
        await self._app(scope, receive, send_guarded)

    def refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Return status and text of a rejection, or ``None`` for a valid request."""
        headers: list[tuple[str, str]] = [
            (name.decode("latin-1").lower(), value.decode("latin-1")) for name, value in scope["headers"]
        ]

        def values(name: str) -> list[str]:
            return [value for key, value in headers if key == name]

        hosts, origins = values("host"), values("origin")
        if len(hosts) != 1 or hosts[0].lower() not in self._hosts:
            return 403, "this server accepts requests to its own address only"
        if len(origins) > 1 or (origins and origins[0].lower() not in self._origins):
            return 403, "requests from other pages are refused"
        websocket = scope["type"] == "websocket"
        changing = websocket or scope["method"] not in SAFE_METHODS
        if (
            changing
            and values("sec-fetch-site")
            and values("sec-fetch-site")[0] not in ("same-origin", "none")
        ):
            return 403, "requests from other sites are refused"
        bearer = self._has_bearer(values("authorization"))
        if websocket and not origins and not bearer:
            return 403, "a websocket without an origin needs the token"
        if scope["path"] not in self.OPEN and not bearer and not self._has_cookie(values("cookie")):
            return 401, "log in with the link that armblocks studio printed"
        if changing and not websocket and not values(CHANGE_HEADER):
            return 403, "the header X-Armblocks is missing"
        return None

    def _has_bearer(self, authorizations: list[str]) -> bool:
        scheme, _, token = authorizations[0].partition(" ") if len(authorizations) == 1 else ("", "", "")
        return scheme.lower() == "bearer" and hmac.compare_digest(token.encode(), self._keys.token.encode())

    def _has_cookie(self, cookies: list[str]) -> bool:
        sessions = [cookie_parser(text).get(self._keys.cookie_name, "") for text in cookies]
        return any(hmac.compare_digest(value.encode(), self._keys.session.encode()) for value in sessions)


async def _answer(send: Send, status: int, text: str) -> None:
    body = text.encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
