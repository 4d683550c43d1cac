"""A small server on this machine for the pages of ``Arm.plot``, ``Arm.animate`` and ``Arm.teach``.

There is one server for a process, in threads that end with it. A loaded page has all its data, so that it can
be used after the program has ended. It keeps one event stream open, by which the server detects open pages.

Only this machine can connect. All paths begin with a secret of the server, so that other programs and web
sites have no access; requests with another ``Host`` (DNS rebinding) or ``Origin`` are rejected.
"""

from __future__ import annotations

import atexit
import hmac
import json
import math
import secrets
import sys
import threading
import time
import webbrowser
from collections.abc import Mapping
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, counted
from armblocks.pictures.style import Theme
from armblocks.robot.fields import numbers
from armblocks.studio.built_page import built_page
from armblocks.studio.view_content import ViewContent, moved

Array = NDArray[np.float64]

MAX_BODY_BYTES = 64 * 1024
MAX_PAGES = 32
"""Number of pages whose data are stored; older pages can no longer be reloaded."""
LOADING_TIME = 10.0
"""Time for which a program that ends waits for its last pages to load, s."""
BEAT = 1.0
"""Heartbeat interval of the event stream, s."""
ABSENCE = 2.5
"""Time without an event stream after which a page is closed, s; a reload takes less."""

FOLDER = Path(__file__).parent
CONTENT_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "font-src 'self' data:; connect-src 'self' data: blob:; media-src blob:; frame-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)
HEADERS = {
    "Content-Security-Policy": CONTENT_POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>
<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">
<style>body{{margin:0;overflow:hidden}}</style>
<body{theme}><div id="view"></div><script type="module" src="view_page.js"></script>"""
FRAME = (
    '<!doctype html><html lang="en"><meta charset="utf-8"><link rel="stylesheet" href="{base}frame.css">'
    '<body><div id="root"></div><script src="{base}frame.js"></script>'
)


class ArmPage:
    """A page of the browser that shows an arm. Returned by ``Arm.plot``, ``animate`` and ``teach``."""

    def __init__(self, content: ViewContent, theme: Theme | None) -> None:
        self.content = content
        self.theme: Theme | None = theme
        self.link = ""
        self._q = content.q
        self._poses: list[list[list[float]]] = []
        self._moves = 0
        self._changed = threading.Condition()
        self._version = 0
        self._streams = 0
        self._last_stream: float | None = None
        self._closed = False

    @property
    def q(self) -> Array:
        """The coordinates (nq,) at the sliders, rad or m; of a motion, the coordinates at its end. Can be
        set."""
        with self._changed:
            return self._q.copy()

    @q.setter
    def q(self, value: ArrayLike) -> None:
        where = f"view of robot '{self.content.robot.name}'"
        self.move(_checked(self.content.robot.nq, numbers(value, where=where), where))
        with self._changed:
            self._version += 1
            self._changed.notify_all()

    @property
    def open(self) -> bool:
        """Whether the page is open in a browser."""
        with self._changed:
            return self._is_open()

    def wait(self, timeout: float | None = None) -> None:
        """Wait until the page is closed, at most ``timeout`` s; a page that is not open yet is awaited."""
        end = math.inf if timeout is None else time.monotonic() + timeout
        with self._changed:
            while time.monotonic() < end and not self._closed:
                if self._last_stream is not None and not self._is_open():
                    return
                self._changed.wait(0.2)  # short, so that Ctrl-C is noticed on Windows

    def close(self) -> None:
        """Close the view: the sliders of the page are disabled, and :meth:`wait` returns."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def __repr__(self) -> str:
        return f"<ArmPage {self.content.title}: {self.link}>"

    # ---- for the server ----------------------------------------------------------------------------------
    def move(self, q: Array) -> dict[str, Any]:
        """Move the arm; returns its coordinates and poses for the page whose sliders have moved."""
        with self._changed:
            self._q, self._poses = moved(self.content.robot, self._q, q)
            self._moves += 1
            return self._shown()

    def next_event(self, version: int) -> tuple[int, dict[str, Any] | None]:
        """Wait for a change after ``version``, at most one heartbeat interval; its number and data."""
        with self._changed:
            if self._version == version and not self._closed:
                self._changed.wait(BEAT)
            if self._closed:
                return version, {"closed": True}
            if self._version == version or not self._poses:
                return self._version, None
            return self._version, self._shown()

    def _shown(self) -> dict[str, Any]:
        """The state for a page, which ignores states with a smaller ``number`` than its own."""
        return {"q": self._q.tolist(), "poses": self._poses, "number": self._moves}

    def stream_opened(self) -> None:
        """Record that a page has opened its event stream."""
        with self._changed:
            self._streams += 1
            self._last_stream = time.monotonic()
            self._changed.notify_all()

    def stream_closed(self) -> None:
        """Record that a page has closed its event stream."""
        with self._changed:
            self._streams -= 1
            self._last_stream = time.monotonic()
            self._changed.notify_all()

    def wait_until_loaded(self, seconds: float) -> None:
        """Wait until the page has loaded."""
        with self._changed:
            self._changed.wait_for(lambda: self._last_stream is not None or self._closed, seconds)

    def _is_open(self) -> bool:
        if self._closed or self._last_stream is None:
            return False
        return self._streams > 0 or time.monotonic() - self._last_stream < ABSENCE


def open_page(content: ViewContent, theme: Theme | None) -> ArmPage:
    """Serve a page and open it in the browser. Without a browser, print its link.

    Raises ``FormatError`` if the front end is not built.
    """
    built_page()
    page = ArmPage(content, theme)
    server = _server()
    server.add(page)
    if webbrowser.open(page.link):
        server.awaited.append(page)
    else:
        print(f"{content.title}: {page.link}", file=sys.stderr)
    return page


@cache
def _server() -> ViewServer:
    server = ViewServer()
    threading.Thread(target=server.serve_forever, name="arm pages", daemon=True).start()
    atexit.register(server.wait_for_pages)
    return server


class ViewServer(ThreadingHTTPServer):
    """The server of this process, on a free port of 127.0.0.1."""

    daemon_threads = True
    block_on_close = False

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.secret = secrets.token_urlsafe(32)
        self.pages: dict[str, ArmPage] = {}
        self.awaited: list[ArmPage] = []

    @property
    def hosts(self) -> tuple[str, ...]:
        """The valid values of the header ``Host``."""
        return tuple(f"{name}:{self.server_port}" for name in ("127.0.0.1", "localhost"))

    def add(self, page: ArmPage) -> None:
        """Serve a page, and give it its link."""
        key = f"p{len(self.pages)}{secrets.token_hex(2)}"
        self.pages[key] = page
        page.link = f"http://127.0.0.1:{self.server_port}/{self.secret}/{key}/"
        while len(self.pages) > MAX_PAGES:
            self.pages.pop(next(iter(self.pages)))

    def wait_for_pages(self) -> None:
        """Wait until the pages that the browser was asked to open have loaded, at most ``LOADING_TIME``."""
        end = time.monotonic() + LOADING_TIME
        for page in self.awaited:
            page.wait_until_loaded(max(0.0, end - time.monotonic()))

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore connections that the browser has closed; print other errors."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers the requests of the pages."""

    timeout = 60

    @property
    def _server(self) -> ViewServer:
        return cast("ViewServer", self.server)

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing: the log would contain the secret."""

    def do_GET(self) -> None:
        """Send a page, its content, or its event stream."""
        found = self._found()
        if found is None:
            return
        page, name = found
        match name:
            case "":
                self._send(_document(page), "text/html; charset=utf-8")
            case "content":
                base = f"/{self._server.secret}/{self.path.split('/')[2]}/"
                content = {
                    "title": page.content.title,
                    "shown": page.content.shown,
                    "page": FRAME.format(base=base),
                }
                self._send(json.dumps(content).encode(), "application/json")
            case "samples":
                self._send(page.content.frame, "application/octet-stream")
            case "events":
                self._stream(page)
            case _:
                file = _files().get(name)
                if file is None:
                    self.send_error(404)
                else:
                    self._send(file.read_bytes(), _TYPES[file.suffix])

    def do_POST(self) -> None:
        """Move the arm to the coordinates of the sliders."""
        found = self._found()
        if found is None:
            return
        page, name = found
        origin, length = self.headers.get("Origin"), self.headers.get("Content-Length", "")
        origins = [f"http://{host}" for host in self._server.hosts]
        if origin is not None and origin not in origins:
            self.send_error(403)
        elif name != "joints" or not length.isdecimal() or int(length) > MAX_BODY_BYTES:
            self.send_error(400)
        else:
            self._move(page, self.rfile.read(int(length)))

    def _move(self, page: ArmPage, body: bytes) -> None:
        try:
            q = np.asarray(json.loads(body), dtype=np.float64)
            reply = page.move(_checked(page.content.robot.nq, q, "page"))
        except (ValueError, TypeError):
            self.send_error(400)
        else:
            self._send(json.dumps(reply).encode(), "application/json")

    def _found(self) -> tuple[ArmPage, str] | None:
        """The page of the path, and the rest of the path; sends an error if there is none."""
        parts = self.path.split("/")
        hosts = self.headers.get_all("Host") or []
        if len(hosts) != 1 or hosts[0] not in self._server.hosts:
            self.send_error(403)
            return None
        is_known = len(parts) == 4 and hmac.compare_digest(parts[1].encode(), self._server.secret.encode())
        page = self._server.pages.get(parts[2]) if is_known else None
        if page is None:
            self.send_error(404)
            return None
        return page, parts[3]

    def _send(self, data: bytes, kind: str) -> None:
        self._begin(kind, {"Content-Length": str(len(data))})
        self.wfile.write(data)

    def _begin(self, kind: str, headers: Mapping[str, str]) -> None:
        self.send_response(200)
        for header, value in {"Content-Type": kind, **headers, **HEADERS}.items():
            self.send_header(header, value)
        self.end_headers()

    def _stream(self, page: ArmPage) -> None:
        """Send changes of the coordinates as events, and a heartbeat each second."""
        self._begin("text/event-stream", {})
        page.stream_opened()
        version = 0
        try:
            closed = False
            while not closed:
                version, event = page.next_event(version)
                self.wfile.write(b": \n\n" if event is None else f"data: {json.dumps(event)}\n\n".encode())
                self.wfile.flush()
                closed = event is not None and "closed" in event
        except ConnectionError:
            pass
        finally:
            page.stream_closed()


_TYPES = {".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8"}


def _document(page: ArmPage) -> bytes:
    from html import escape

    # The scripts of notebook widgets read this attribute of JupyterLab.
    theme = "" if page.theme is None else f' data-jp-theme-light="{str(page.theme == "light").lower()}"'
    return PAGE.format(title=escape(page.content.title), theme=theme).encode()


@cache
def _files() -> dict[str, Path]:
    notebook = built_page() / "notebook"
    files = (
        notebook / "frame.js",
        notebook / "frame.css",
        FOLDER / "notebook_widget.js",
        FOLDER / "view_page.js",
    )
    return {file.name: file for file in files}


def _checked(count: int, q: Array, where: str) -> Array:
    if q.shape != (count,) or not np.isfinite(q).all():
        raise InputError(
            f"q has the shape {q.shape}" if q.shape != (count,) else "q is not finite",
            where=where,
            allowed=f"({count},), finite numbers",
            fix=f"give {counted(count, 'coordinate')}",
        )
    return q
