"""The hub of one server: it connects clients, documents and runs, on one event loop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
import warnings
from functools import lru_cache
from importlib.metadata import version
from typing import Literal

from pydantic import ValidationError

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.drawing.diagram_file import drawing_bytes
from armblocks.errors import ArmblocksError, InertiaWarning
from armblocks.robot import Robot
from armblocks.studio.documents.project_data import ProjectData
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.requests import DocumentRequests
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.documents.trusted_files import TrustedFiles
from armblocks.studio.protocol.clients import Clients, InvalidRequestError, StudioClient
from armblocks.studio.protocol.envelope import Envelope, Reply
from armblocks.studio.protocol.message import Fault
from armblocks.studio.protocol.messages.studio import FileList, Files, Ping, Welcome
from armblocks.studio.protocol.request_handlers import RequestHandlers
from armblocks.studio.robots.open_robots import OpenRobots
from armblocks.studio.robots.presenter import RobotPresenter
from armblocks.studio.robots.requests import RobotRequests
from armblocks.studio.robots.teaching_requests import TeachingRequests
from armblocks.studio.runs.checks import Checks
from armblocks.studio.runs.diagram_runs import DiagramRuns
from armblocks.studio.runs.settings import setting_rules, solver_choices
from armblocks.studio.sheet.data_requests import DataRequests
from armblocks.studio.sheet.drawing_data import library
from armblocks.studio.sheet.lines import LinesOfSheets
from armblocks.studio.sheet.nesting import with_robot
from armblocks.studio.sheet.open_documents import OpenDocuments
from armblocks.studio.sheet.presenter import DiagramPresenter
from armblocks.studio.sheet.queries import SheetQueries

LOG = logging.getLogger(__name__)
INVALID_REQUEST = Fault(
    what="this is not a request of the studio",
    where="page",
    allowed="requests of the page of this version",
    fix="reload the page: it may come from another version of armblocks",
)
DEFECT = Fault(
    what="armblocks has a defect",
    where="studio",
    allowed="a reply, or an error that explains why it is impossible",
    fix="report it with the steps that led to it; your drawing is not affected",
)
_REQUEST_NUMBER = re.compile(r'\s*\{\s*"number"\s*:\s*(\d{1,15})\s*,')


class Hub:
    """Parses the requests of clients, passes them to their handlers, and sends the replies."""

    def __init__(self, folder: ProjectFolder) -> None:
        self._folder = folder
        self._state = StateFolder(folder.root)
        self._clients = Clients()
        data = ProjectData(folder, TrustedFiles(self._state))
        checks = Checks(data, self._resolve_robot)
        self._diagrams = OpenDocuments(folder, self._state, self._resolve_robot, data)
        self.runs = DiagramRuns(self._clients, self._diagrams, checks.job)
        lines = LinesOfSheets()
        open_robots = OpenRobots(folder, self._state)
        robots = RobotPresenter(open_robots, folder, self._robot_saved)
        self._diagram_presenter = DiagramPresenter(
            self._diagrams, self._clients, self.runs, lines, checks.check
        )
        self.documents = DocumentRequests(
            folder, self._clients, {"diagram": self._diagram_presenter, "robot": robots}
        )
        self.request_handlers = RequestHandlers()
        self.request_handlers.on(Ping, self._ping)
        self.request_handlers.on(Files, self._files)
        for handlers in (
            self.documents,
            SheetQueries(folder, self.documents, self._diagrams, self._resolve_robot, lines),
            DataRequests(data, self._files_changed),
            RobotRequests(folder, self.documents, robots, self._diagrams),
            TeachingRequests(folder, open_robots),
            self.runs,
        ):
            handlers.register(self.request_handlers)
        self._watch_tasks: list[asyncio.Task[None]] = []

    def prepare(self) -> None:
        """Remove abandoned temporary files, and start to watch the open files for changes."""
        self._folder.remove_stray_files(self._state.recent())
        self._watch_tasks = self.documents.watch()

    def close(self) -> None:
        """End all runs and close the documents; journals of unsaved documents remain."""
        for task in self._watch_tasks:
            task.cancel()
        self.documents.end()
        self.runs.close()

    # -- clients ---------------------------------------------------------------------------------------------

    async def welcome(self, client: StudioClient) -> None:
        """Add a client that has connected, and send it the welcome message."""
        self._clients.add(client)
        await client.notify(
            Welcome(
                version=version("armblocks"),
                library=list(library()),
                robots=list(formats.list_robots()),
                solvers=solver_choices(),
                settings=setting_rules(),
                examples=dict(formats.example_descriptions()),
                files=self._folder.files(),
                recent=self._recent(),
                documents=self.documents.states(),
                recoveries=self.documents.recoveries(),
            )
        )

    def remove_client(self, client: StudioClient) -> None:
        """Remove a client that has disconnected; its documents stay open for a reconnection."""
        self._clients.discard(client)

    async def answer(self, client: StudioClient, text: str) -> None:
        """Handle one request; every request with a number gets a reply, also an invalid request.

        A client repeats a request without a reply, so invalid requests and defects are reported in a reply.
        Raises ``InvalidRequestError`` for a text without a request number.
        """
        try:
            envelope = Envelope.model_validate_json(text)
        except ValidationError as error:
            match = _REQUEST_NUMBER.match(text)
            if match is None:
                raise InvalidRequestError(str(error)) from None
            await client.notify(Reply(number=int(match[1]), fault=INVALID_REQUEST))
            return
        number, fault, value = envelope.number, None, None
        try:
            value = await self.request_handlers.reply_to(client, envelope.request)
        except ArmblocksError as error:
            fault = Fault(what=error.what, where=error.where, allowed=error.allowed, fix=error.fix)
        except Exception as error:
            LOG.exception("a request failed because of a defect")
            fault = DEFECT.model_copy(update={"what": f"{DEFECT.what} ({type(error).__name__})"})
        await client.notify(Reply(number=number, value=value, fault=fault))

    async def _ping(self, _: StudioClient, request: Ping) -> None:
        pass

    async def _files(self, _: StudioClient, request: Files) -> FileList:
        return FileList(files=self._folder.files(), recent=self._recent())

    def _recent(self) -> list[str]:
        return [path for path in self._state.recent() if self._exists(path)]

    def _exists(self, path: str) -> bool:
        with contextlib.suppress(ArmblocksError):
            return self._folder.exists(path)
        return False

    # -- drawings --------------------------------------------------------------------------------------------

    async def drawing(
        self, document: str, kind: str, *, sheet: str, theme: Literal["light", "dark"] | None
    ) -> bytes:
        """Return a sheet of a diagram as a file; a thread draws it, so that other requests do not wait."""
        diagram = self._diagrams[document].document.diagram
        return await asyncio.to_thread(drawing_bytes, diagram, kind, sheet=sheet, theme=theme)

    async def example_drawing(self, name: str) -> bytes:
        """Return the drawing of a shipped example as SVG; raises ``UnknownNameError``."""
        return await asyncio.to_thread(_example_drawing, name)

    # -- robots of diagrams ----------------------------------------------------------------------------------

    def _resolve_robot(self, name: str) -> Robot:
        """Return a shipped robot or a robot file of the project."""
        with warnings.catch_warnings():  # the robot editor shows them
            warnings.simplefilter("ignore", InertiaWarning)
            return formats.load_robot(self._folder.robot_path(name, formats.list_robots()))

    def _files_changed(self) -> None:
        """Check all open diagrams again after a change of a table or of the trust in a Python file."""
        for open_file in self._diagrams:
            self._diagram_presenter.on_changed(open_file)

    async def _robot_saved(self, robot: Robot) -> None:
        """Update the diagrams that use a robot whose file was saved, as one undo step each."""
        for open_file in self._diagrams:
            after = with_robot(open_file.document.diagram, robot)
            if after is not open_file.document.diagram:
                await self.documents.replace(open_file, f"update {robot.name}", after)


@lru_cache(maxsize=64)
def _example_drawing(name: str) -> bytes:
    return drawing_bytes(formats.load_diagram(name, BLOCKS, draft=True), "svg")
