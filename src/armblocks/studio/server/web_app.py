"""The web application of the studio: one page, one websocket and a few downloads, protected by the guard.

The page itself needs no hub and is served at once. The imports of the hub take longer than loading the page,
so the hub is created in a thread meanwhile (:class:`FutureHub`), and requests that need it wait.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncGenerator, MutableMapping
from concurrent.futures import Future
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Any

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, RedirectResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from armblocks.errors import ArmblocksError
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.protocol.clients import InvalidRequestError, StudioClient
from armblocks.studio.protocol.outbox import Outbox
from armblocks.studio.server.guard import Guard, Keys

if TYPE_CHECKING:
    from armblocks.studio.server.hub import Hub

DRAWING_TYPES = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}
THEMES = ("light", "dark", None)
CACHE_CONTROL = "private, max-age=31536000, immutable"
"""Cache header of a file whose name contains a hash of its content."""


class Assets(StaticFiles):
    """Files of the page whose names contain a content hash: a browser requests each of them once."""

    def file_response(
        self,
        full_path: str | os.PathLike[str],
        stat_result: os.stat_result,
        scope: MutableMapping[str, Any],
        status_code: int = 200,
    ) -> Response:
        """Return the file with a permanent cache lifetime."""
        response = super().file_response(full_path, stat_result, scope, status_code)
        response.headers["cache-control"] = CACHE_CONTROL
        return response


class FutureHub:
    """The hub of a folder, created in a thread when it is first requested."""

    def __init__(self, folder: ProjectFolder) -> None:
        self.result: Future[Hub] = Future()
        self._folder = folder
        self._started = False

    def begin(self) -> None:
        """Start creating the hub; later calls do nothing."""
        if not self._started:
            self._started = True
            Thread(target=self._create_hub, name="hub").start()

    async def ready(self) -> Hub:
        """Return the hub when it exists; raise the error that prevented its creation."""
        self.begin()
        return await asyncio.shield(asyncio.wrap_future(self.result))

    def _create_hub(self) -> None:
        try:
            from armblocks.studio.server.hub import Hub
            from armblocks.studio.sheet.drawing_data import library

            library()  # fills its cache for the first page
            self.result.set_result(Hub(self._folder))
        except BaseException as error:
            self.result.set_exception(error)


@dataclass(frozen=True)
class Endpoints:
    """The endpoints of the routes, one method each."""

    hub: FutureHub
    keys: Keys
    web: Path

    async def health(self, _: Request) -> Response:
        """Report that the server at this address is a studio."""
        return PlainTextResponse("armblocks studio")

    async def login(self, request: Request) -> Response:
        """Exchange the one-time key of the link for the session cookie."""
        if not self.keys.spend_login(request.query_params.get("key", "")):
            return PlainTextResponse(
                "this login link was already used or is invalid: start the studio again", 401
            )
        answer = RedirectResponse("/", status_code=303)
        answer.set_cookie(
            self.keys.cookie_name, self.keys.session, httponly=True, samesite="strict", path="/"
        )
        return answer

    async def index(self, _: Request) -> Response:
        """Return the page."""
        return FileResponse(self.web / "index.html", headers={"cache-control": "no-cache"})

    async def drawing(self, request: Request) -> Response:
        """Return a sheet as a file for download."""
        query, kind = request.query_params, request.path_params["kind"]
        theme = query.get("theme")
        if theme not in THEMES:
            return PlainTextResponse("the theme must be light or dark", 422)
        hub, document = await self.hub.ready(), request.path_params["document"]
        try:
            data = await hub.drawing(document, kind, sheet=query.get("sheet", ""), theme=theme)
        except ArmblocksError as error:
            return PlainTextResponse(str(error), 404)
        return Response(data, media_type=DRAWING_TYPES[kind])

    async def example(self, request: Request) -> Response:
        """Return the drawing of a shipped example, for the gallery."""
        hub = await self.hub.ready()
        try:
            data = await hub.example_drawing(request.path_params["name"])
        except ArmblocksError as error:
            return PlainTextResponse(str(error), 404)
        return Response(data, media_type=DRAWING_TYPES["svg"])

    async def report(self, request: Request) -> Response:
        """Return the report of the last run of a document."""
        hub = await self.hub.ready()
        try:
            data = await hub.runs.report(request.path_params["document"])
        except ArmblocksError as error:
            return PlainTextResponse(str(error), 404)
        return Response(data, media_type="text/html")

    async def websocket(self, socket: WebSocket) -> None:
        """Serve the websocket of a client until it disconnects."""
        await socket.accept()
        outbox = Outbox(socket.send_text, socket.send_bytes)
        hub, client = await self.hub.ready(), StudioClient(outbox.put, outbox.put, outbox)
        sending = asyncio.create_task(outbox.send_all())
        await hub.welcome(client)
        try:
            while (text := await _received(socket, sending)) is not None:
                await hub.answer(client, text)
        except (InvalidRequestError, KeyError):
            await socket.close(1008, "this is not a request of the studio")
        except WebSocketDisconnect:
            pass
        finally:
            hub.remove_client(client)
            sending.cancel()
            await asyncio.gather(sending, return_exceptions=True)


async def _received(socket: WebSocket, sending: asyncio.Task[None]) -> str | None:
    """Return the next message of the client; ``None`` after a failed transmission to the client.

    After a failed transmission, ``receive_text`` raises an error that is not a ``WebSocketDisconnect``, even
    if messages of the client are still queued.
    """
    receiving = asyncio.create_task(socket.receive_text())
    try:
        await asyncio.wait((receiving, sending), return_when=asyncio.FIRST_COMPLETED)
        return None if sending.done() else receiving.result()
    finally:
        if receiving.done():
            receiving.exception()  # marks the error as retrieved, so that asyncio does not log it
        else:
            receiving.cancel()


def studio_app(hub: FutureHub, keys: Keys, hosts: frozenset[str], web: Path) -> Guard:
    """Create the guarded application. ``hosts``: the accepted values of the HTTP header ``Host``."""

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncGenerator[None]:
        async def prepare() -> None:
            (await hub.ready()).prepare()

        preparing = asyncio.create_task(prepare())
        yield
        preparing.cancel()
        await asyncio.gather(preparing, return_exceptions=True)
        if hub.result.done() and hub.result.exception() is None:
            hub.result.result().close()

    endpoints = Endpoints(hub, keys, web)
    routes: list[Any] = [
        Route("/health", endpoints.health),
        Route("/login", endpoints.login),
        Route("/drawing/{document}.{kind}", endpoints.drawing),
        Route("/example/{name}.svg", endpoints.example),
        Route("/report/{document}", endpoints.report),
        WebSocketRoute("/ws", endpoints.websocket),
        Route("/", endpoints.index),
        Mount("/assets", Assets(directory=web / "assets", check_dir=False)),
        Mount("/", StaticFiles(directory=web)),
    ]
    return Guard(Starlette(routes=routes, lifespan=lifespan), keys, hosts)
