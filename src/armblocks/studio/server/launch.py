"""Start of the studio: a free local port, a one-time login link, and an orderly shutdown."""

from __future__ import annotations

import contextlib
import socket
import webbrowser
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from armblocks.errors import InputError
from armblocks.studio.built_page import built_page
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.server.guard import Keys
from armblocks.studio.server.terminal_log import log_settings
from armblocks.studio.server.web_app import FutureHub, studio_app

if TYPE_CHECKING:
    from armblocks.studio.server.hub import Hub

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
MAX_MESSAGE_BYTES = 8 * 2**20


def serve(
    folder: str | Path,
    model: str,
    *,
    port: int,
    open_browser: bool,
    announce: Callable[[str], None],
    new_session: bool = False,
) -> None:
    """Serve until Ctrl-C. ``announce`` receives the login link. ``port`` 0 selects a free port.

    With ``port`` 0, the port of the previous server for this folder is tried first, and its clients reconnect
    to this server, unless ``new_session``. The socket is bound to 127.0.0.1, so only this machine can
    connect. Raises ``InputError`` if the port is in use, ``FormatError`` if the front end is not built.
    """
    import uvicorn

    web = built_page()
    project = ProjectFolder(folder)
    state_folder = StateFolder(project.root)
    listener = _previous_listener(state_folder) if port == 0 and not new_session else None
    listener = listener or _listener(port)
    used_port: int = listener.getsockname()[1]
    keys = Keys(used_port, state_folder.begin_session(used_port, new=new_session).secret)
    hub = FutureHub(project)
    app = studio_app(hub, keys, frozenset(f"{host}:{used_port}" for host in LOOPBACK), web)
    fragment = f"#{quote(model)}" if model else ""
    link = f"http://127.0.0.1:{used_port}/login?key={keys.new_login()}{fragment}"
    announce(link)
    if open_browser:
        webbrowser.open(link)
    config = uvicorn.Config(
        app,
        log_level="warning",
        log_config=log_settings(keys.secrets),
        access_log=False,  # access logs would contain the login link
        server_header=False,
        ws_max_size=MAX_MESSAGE_BYTES,
        ws="websockets-sansio",
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)

    def stop_after_error(future: Future[Hub]) -> None:
        server.should_exit |= future.exception() is not None

    hub.result.add_done_callback(stop_after_error)
    server.run(sockets=[listener])
    if hub.result.done():
        hub.result.result()  # raises the error that prevented the creation of the hub


def _previous_listener(state_folder: StateFolder) -> socket.socket | None:
    """Listen at the port of the previous server, if it is free, so that its clients can reconnect."""
    last = state_folder.session()
    if last is not None:
        with contextlib.suppress(InputError):
            return _listener(last.port)
    return None


def _listener(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
        listener.listen()  # before the link is printed, so that an immediate click is not refused
    except OSError as error:
        listener.close()
        raise InputError(
            f"port {port} cannot be used ({error.strerror})",
            where="armblocks studio",
            allowed="a free port, or 0 for any",
            fix="choose another --port, or close the program that uses this port",
        ) from None
    return listener
