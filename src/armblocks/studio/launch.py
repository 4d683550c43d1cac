"""Starting the studio: a free port on this machine, a link that works once, and a clean end."""

from __future__ import annotations

import socket
import webbrowser
from collections.abc import Callable
from pathlib import Path
from urllib.parse import quote

from armblocks.errors import InputError
from armblocks.studio.guard import Keys
from armblocks.studio.project_folder import ProjectFolder
from armblocks.studio.server import built_page, studio_app

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
MOST_MESSAGE_BYTES = 8 * 2**20


def serve(
    folder: str | Path, model: str, *, port: int, open_browser: bool, announce: Callable[[str], None]
) -> None:
    """Serve until Ctrl-C. ``announce`` gets the login link. ``port`` 0 takes a free one.

    Only this machine can reach it: the socket is bound to 127.0.0.1. Raises ``InputError`` where the port is
    taken, ``FormatError`` where the page was not built.
    """
    import uvicorn

    web = built_page()
    project = ProjectFolder(folder)
    listener = _listener(port)
    taken: int = listener.getsockname()[1]
    keys = Keys(taken)
    app = studio_app(project, keys, frozenset(f"{host}:{taken}" for host in LOOPBACK), web)
    fragment = f"#{quote(model)}" if model else ""
    link = f"http://127.0.0.1:{taken}/login?key={keys.new_login()}{fragment}"
    announce(link)
    if open_browser:
        webbrowser.open(link)
    config = uvicorn.Config(
        app,
        log_level="warning",
        access_log=False,  # its lines would hold the login link
        server_header=False,
        ws_max_size=MOST_MESSAGE_BYTES,
        ws="websockets-sansio",
        timeout_graceful_shutdown=1,
    )
    uvicorn.Server(config).run(sockets=[listener])


def _listener(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(("127.0.0.1", port))
        listener.listen()  # before the link is told: who follows it at once waits, and is not refused
    except OSError as error:
        listener.close()
        raise InputError(
            f"port {port} cannot be used ({error.strerror})",
            where="armblocks studio",
            allowed="a free port, or 0 for any",
            fix="choose another --port, or close the program that holds this one",
        ) from None
    return listener
