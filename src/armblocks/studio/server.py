"""The studio's server: one page, one websocket, a few downloads. Everything passes the guard first."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from functools import lru_cache
from pathlib import Path
from typing import Literal

from fastapi import FastAPI, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from fastapi.staticfiles import StaticFiles
from pydantic import ValidationError

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.errors import ArmblocksError, FormatError, UnknownNameError
from armblocks.report.diagram_file import drawing_bytes
from armblocks.studio.guard import Guard, Keys
from armblocks.studio.hub import Hub, Page
from armblocks.studio.project_folder import ProjectFolder

WEB = Path(__file__).parent / "web"
"""The built page; made by the front end's build, not kept in the repository."""

DRAWING_TYPES = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}


def built_page(folder: Path = WEB) -> Path:
    """The folder of the built page; raises ``FormatError`` with what to do if it was not built."""
    if not (folder / "index.html").is_file():
        raise FormatError(
            "this installation has no studio page: it was installed without Node.js",
            where=str(folder),
            allowed="everything but the studio works",
            fix="install Node.js 20.19 or newer and run 'pip install .' again, or install a released wheel",
        )
    return folder


@lru_cache(maxsize=64)
def example_drawing(name: str) -> bytes:
    """A shipped example as SVG; raises ``UnknownNameError``."""
    known = formats.list_examples()
    if name not in known:
        raise UnknownNameError("example", name, known)
    return drawing_bytes(formats.load_diagram(name, BLOCKS), "svg")


def studio_app(folder: ProjectFolder, keys: Keys, hosts: frozenset[str], web: Path) -> Guard:
    """The whole application, guarded. ``hosts``: the ``Host`` values that mean this server."""
    hub = Hub(folder)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncGenerator[None]:
        hub.prepare()
        yield
        hub.close()

    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, lifespan=lifespan)

    @app.get("/health")
    async def health() -> PlainTextResponse:  # pyright: ignore[reportUnusedFunction]
        return PlainTextResponse("armblocks studio")

    @app.get("/login")
    async def login(key: str = "") -> Response:  # pyright: ignore[reportUnusedFunction]
        if not keys.spend_login(key):
            return PlainTextResponse("this login link was used or is wrong: start the studio again", 401)
        answer = RedirectResponse("/", status_code=303)
        answer.set_cookie(keys.cookie_name, keys.session, httponly=True, samesite="strict", path="/")
        return answer

    @app.get("/drawing/{document}.{kind}")
    async def drawing(  # pyright: ignore[reportUnusedFunction]
        document: str, kind: str, sheet: str = "", theme: Literal["light", "dark"] | None = None
    ) -> Response:
        """A sheet as a file to keep; drawn aside, so that nobody else waits for it."""
        try:
            diagram = hub.documents[document].document.diagram
            data = await asyncio.to_thread(drawing_bytes, diagram, kind, sheet=sheet, theme=theme)
        except UnknownNameError as error:
            return PlainTextResponse(str(error), 404)
        return Response(data, media_type=DRAWING_TYPES[kind])

    @app.get("/example/{name}.svg")
    async def example(name: str) -> Response:  # pyright: ignore[reportUnusedFunction]
        """The drawing of a shipped example, for the gallery."""
        try:
            data = await asyncio.to_thread(example_drawing, name)
        except UnknownNameError as error:
            return PlainTextResponse(str(error), 404)
        return Response(data, media_type=DRAWING_TYPES["svg"])

    @app.get("/report/{document}")
    async def report(document: str) -> Response:  # pyright: ignore[reportUnusedFunction]
        try:
            return Response(await hub.report(document), media_type="text/html")
        except ArmblocksError as error:
            return PlainTextResponse(str(error), 404)

    @app.websocket("/ws")
    async def talk(socket: WebSocket) -> None:  # pyright: ignore[reportUnusedFunction]
        await socket.accept()
        page = Page(socket.send_text, socket.send_bytes)
        await hub.welcome(page)
        try:
            while True:
                await hub.answer(page, await socket.receive_text())
        except (ValidationError, KeyError):
            await socket.close(1008, "this is no request of the studio")
        except WebSocketDisconnect:
            pass
        finally:
            hub.leave(page)

    @app.get("/")
    async def index() -> FileResponse:  # pyright: ignore[reportUnusedFunction]
        return FileResponse(web / "index.html")

    app.mount("/", StaticFiles(directory=web))
    return Guard(app, keys, hosts)
