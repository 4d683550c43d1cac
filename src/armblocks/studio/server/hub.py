"""Where pages, documents and runs meet: one hub a server, on one event loop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
import warnings
from collections.abc import Sequence
from functools import lru_cache
from importlib.metadata import version
from typing import Literal

from pydantic import ValidationError

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram
from armblocks.drawing.diagram_file import drawing_bytes
from armblocks.errors import ArmblocksError, FormatError, InertiaWarning, InputError, UnknownNameError
from armblocks.robot import Robot
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.protocol.answers import Answers
from armblocks.studio.protocol.envelope import Envelope, Reply
from armblocks.studio.protocol.message import Fault
from armblocks.studio.protocol.messages import documents as say
from armblocks.studio.protocol.messages import robots as say_robot
from armblocks.studio.protocol.messages.sheets import Checked, SheetChange
from armblocks.studio.protocol.messages.studio import FileList, Files, Ping, Welcome
from armblocks.studio.protocol.page import NoRequestError, Page, Pages
from armblocks.studio.protocol.robot_scene import RobotScene
from armblocks.studio.robots.desk import RobotDesk
from armblocks.studio.robots.scene import link_frames_of, scene_of
from armblocks.studio.runs.desk import RunDesk
from armblocks.studio.runs.settings import setting_rules, solver_choices
from armblocks.studio.sheet.check import check
from armblocks.studio.sheet.diagram_kind import Performed
from armblocks.studio.sheet.nesting import inside, linked_part, with_robot
from armblocks.studio.sheet.open_documents import OpenDocument, OpenDocuments
from armblocks.studio.sheet.queries import SheetQueries
from armblocks.studio.sheet.shown import library, sheet, sheet_change

LOG = logging.getLogger(__name__)
NO_REQUEST = Fault(
    what="this is no request of the studio",
    where="page",
    allowed="what the page of this version asks",
    fix="load the page again: it may be of another version",
)
DEFECT = Fault(
    what="armblocks has a defect",
    where="studio",
    allowed="what was asked, or words about why it cannot be",
    fix="report it with what you did; what you have drawn is not harmed",
)
_NUMBERED = re.compile(r'\s*\{\s*"number"\s*:\s*(\d{1,15})\s*,')


class Hub:
    """Carries out what pages ask, and tells every page that shows a document what became of it."""

    def __init__(self, folder: ProjectFolder) -> None:
        self.folder = folder
        self.pages = Pages()
        kept = StateFolder(folder.root)
        self.documents = OpenDocuments(folder, kept, self.resolve_robot)
        self.robots = RobotDesk(folder, kept, self)
        drawing = self.documents.__getitem__
        self.runs = RunDesk(folder, self.pages, drawing, self.resolve_robot)
        self.answers = Answers()
        self._register(self.answers)
        for part in (self.robots, self.runs, SheetQueries(folder, drawing, self.resolve_robot)):
            part.register(self.answers)
        self._watching: list[asyncio.Task[None]] = []

    def _register(self, answers: Answers) -> None:
        answers.on(Ping, self._ping)
        answers.on(Files, self._files)
        answers.on(say.Open, self._open)
        answers.on(say.New, self._new)
        answers.on(say.Attach, self._attach)
        answers.on(say.Look, self._look)
        for alteration in (say.Change, say.Undo, say.Redo, say.ArrangeBlocks, say.Reload):
            answers.on(alteration, self._change)
        answers.on(say.Save, self._save)
        answers.on(say.KeepMine, self._keep_mine)
        answers.on(say.Close, self._close)
        answers.on(say.Recover, self._recover)
        answers.on(say_robot.Scene, self._scene)
        answers.on(say_robot.Pose, self._pose)

    def prepare(self) -> None:
        """Look after the files from now on."""
        self.folder.sweep(self.documents.kept.recent())
        loop = asyncio.get_running_loop()
        self._watching = [
            loop.create_task(self.documents.watch(self._tell_state)),
            loop.create_task(self.robots.robots.watch(self.robots.tell)),
        ]

    # -- pages -----------------------------------------------------------------------------------------------

    async def welcome(self, page: Page) -> None:
        """A page has come."""
        self.pages.add(page)
        await page.tell(
            Welcome(
                version=version("armblocks"),
                library=list(library()),
                robots=list(formats.list_robots()),
                solvers=solver_choices(),
                settings=setting_rules(),
                examples=dict(formats.example_descriptions()),
                files=self.folder.files(),
                recent=self._recent(),
                documents=[document.state() for document in self.documents],
                recoveries=self._recoveries(),
            )
        )
        await self.robots.welcome(page)

    def leave(self, page: Page) -> None:
        """A page has gone; what it showed stays open for when it returns."""
        self.pages.discard(page)
        self.robots.leave(page)

    async def answer(self, page: Page, text: str) -> None:
        """Carry out one request and reply to it, whatever becomes of it.

        A page that gets no reply asks again: so also what is no request is answered, and what meets a defect.
        Raises ``NoRequestError`` for what has not even a number.
        """
        try:
            envelope = Envelope.model_validate_json(text)
        except ValidationError as error:
            numbered = _NUMBERED.match(text)
            if numbered is None:
                raise NoRequestError(str(error)) from None
            await page.tell(Reply(number=int(numbered[1]), fault=NO_REQUEST))
            return
        number, fault, value = envelope.number, None, None
        try:
            value = await self.answers.to(page, envelope.request)
        except ArmblocksError as error:
            fault = Fault(what=error.what, where=error.where, allowed=error.allowed, fix=error.fix)
        except Exception as error:
            LOG.exception("a request met a defect")
            fault = DEFECT.model_copy(update={"what": f"{DEFECT.what} ({type(error).__name__})"})
        await page.tell(Reply(number=number, value=value, fault=fault))

    async def _ping(self, _: Page, request: Ping) -> None:
        pass

    async def _files(self, _: Page, request: Files) -> FileList:
        return FileList(files=self.folder.files(), recent=self._recent())

    # -- documents -------------------------------------------------------------------------------------------

    async def _open(self, page: Page, request: say.Open) -> say_robot.Opening | str:
        if request.path and self._is_robot_file(request.path):
            return await self.robots.open_file(page, request.path)
        documents, example = self.documents, request.example
        found = documents.open_shipped(example) if example else documents.open_path(request.path)
        return await self._show(page, found)

    async def _new(self, page: Page, _: say.New) -> str:
        return await self._show(page, self.documents.new())

    async def _attach(self, page: Page, request: say.Attach) -> str:
        found = self.documents.attach(request.document, request.path, request.example)
        return await self._show(page, found, tuple(request.inside))

    async def _look(self, page: Page, request: say.Look) -> str:
        return await self._show(page, self.documents[request.document], tuple(request.inside))

    async def _show(self, page: Page, found: OpenDocument, path: tuple[str, ...] = ()) -> str:
        try:
            shown = inside(found.document.diagram, path)
        except UnknownNameError:
            if found.key in page.shows:
                raise
            path, shown = (), found.document.diagram  # what the page looked at before is gone
        fresh = found.key not in page.shows
        page.shows[found.key] = path
        drawn, linked = sheet(shown), linked_part(found.document.diagram, path)
        if linked:
            link = inside(found.document.diagram, linked).link
            drawn = drawn.model_copy(update={"linked": list(linked), "link": link})
        await page.tell(
            say.Opened(state=found.state(), inside=list(path), sheet=drawn, run=self.runs.of(found.key))
        )
        if fresh:
            self.runs.shown(page, found.key)
        await self._tell_documents()
        self._check_later(found)
        return found.key

    async def _change(self, _: Page, request: Performed | say.Reload) -> int:
        found = self.documents[request.document]
        before, version_before = found.document.diagram, found.document.version
        if isinstance(request, say.Reload):
            self.documents.reload(found, request.key)
        elif not self.documents.perform(found, request):
            return found.document.version
        for page in self.pages.showing(found.key):
            await self._tell_change(page, found, before, version_before)
        self._check_later(found)
        return found.document.version

    async def _save(self, _: Page, request: say.Save) -> str:
        found = self.documents[request.document]
        try:
            path = await self.documents.save(found, request.path, overwrite=request.overwrite)
        finally:
            await self._tell_state(found)
        await self._tell_documents()
        return path

    async def _keep_mine(self, _: Page, request: say.KeepMine) -> None:
        found = self.documents[request.document]
        self.documents.keep_mine(found)
        await self._tell_state(found)
        await self._tell_documents()

    async def _close(self, _: Page, request: say.Close) -> None:
        self.documents.close(self.documents[request.document], discard=request.discard)
        await self._tell_documents()

    async def _recover(self, page: Page, request: say.Recover) -> str | None:
        if request.document in self.robots.robots.left:
            key = await self.robots.recover(page, request)
        else:
            opened = await self.documents.recover(request)
            key = await self._show(page, opened) if opened is not None else None
        await self._tell_documents()
        return key

    async def _tell_state(self, found: OpenDocument) -> None:
        """Tell the pages that show a document where it stands; the drawing is as it was."""
        nothing = SheetChange(blocks={}, wires_added=[], wires_removed=[])
        event = say.Changed(state=found.state(), before=found.document.version, change=nothing)
        await self.pages.tell_of(found.key, event)

    async def _tell_documents(self) -> None:
        """Tell every page what is open."""
        event = say.Documents(
            documents=[document.state() for document in self.documents],
            recoveries=self._recoveries(),
        )
        await self.pages.tell(event)

    def _recoveries(self) -> list[say.Recovery]:
        """Drawings and robots that wait to be recovered, the latest first."""
        found = [*self.documents.left.offers(), *self.robots.robots.left.offers()]
        return sorted(found, key=lambda entry: -entry.last)

    def _recent(self) -> list[str]:
        return [path for path in self.documents.kept.recent() if self._is_there(path)]

    def _is_there(self, path: str) -> bool:
        with contextlib.suppress(ArmblocksError):
            return self.folder.exists(path)
        return False

    async def _tell_change(
        self, page: Page, found: OpenDocument, before: Diagram, version_before: int
    ) -> None:
        """Tell a page what changed on the sheet that it looks at."""
        path = page.shows[found.key]
        try:
            old, new = inside(before, path), inside(found.document.diagram, path)
        except UnknownNameError:  # the subsystem is gone, or has just come back
            await self._show(page, found)
            return
        change = sheet_change(old, new)
        await page.tell(say.Changed(state=found.state(), before=version_before, change=change))

    def resolve_robot(self, name: str) -> Robot:
        """A shipped robot or a robot file of the project."""
        with warnings.catch_warnings():  # the robot editor marks them
            warnings.simplefilter("ignore", InertiaWarning)
            return formats.load_robot(self.folder.robot_path(name, formats.list_robots()))

    async def drawing(
        self, document: str, kind: str, *, sheet: str, theme: Literal["light", "dark"] | None
    ) -> bytes:
        """A sheet of a document as a file; drawn aside, so that nobody else waits for it."""
        diagram = self.documents[document].document.diagram
        return await asyncio.to_thread(drawing_bytes, diagram, kind, sheet=sheet, theme=theme)

    async def example_drawing(self, name: str) -> bytes:
        """A shipped example as SVG; raises ``UnknownNameError``."""
        return await asyncio.to_thread(_example_drawing, name)

    # -- robots ----------------------------------------------------------------------------------------------

    def _is_robot_file(self, path: str) -> bool:
        with contextlib.suppress(FormatError):  # what cannot be read may be open all the same
            return formats.kind_of_data(self.folder.read(path), path) is formats.DocumentKind.ROBOT
        return False

    def block_robot(self, document: str, path: Sequence[str], block: str) -> Robot:
        """The robot that a block of an open diagram uses."""
        level = inside(self.documents[document].document.diagram, path)
        robot = getattr(level.block(block), "robot", None)
        if not isinstance(robot, Robot):
            raise InputError(
                "the block has no robot",
                where=f"block '{block}'",
                allowed="a robot block",
                fix="choose a block with a robot",
            )
        return robot

    async def show_diagram(self, page: Page, data: bytes, name: str) -> str:
        """Open a diagram that has no file yet; its key."""
        return await self._show(page, self.documents.open_bytes(data, name))

    async def robot_saved(self, robot: Robot) -> None:
        """The file of a robot has changed: diagrams that use it take it anew, as a step of undo."""
        for found in self.documents:
            before, version_before = found.document.diagram, found.document.version
            after = with_robot(before, robot)
            if after is before:
                continue
            self.documents.replace(found, f"new form of {robot.name}", after)
            for page in self.pages.showing(found.key):
                await self._tell_change(page, found, before, version_before)
            self._check_later(found)

    async def _scene(self, _: Page, request: say_robot.Scene) -> RobotScene:
        return scene_of(self.block_robot(request.document, request.inside, request.block))

    async def _pose(self, _: Page, request: say_robot.Pose) -> list[list[list[float]]]:
        robot = self.block_robot(request.document, request.inside, request.block)
        return link_frames_of(robot, request.q)

    # -- the background check --------------------------------------------------------------------------------

    def _check_later(self, found: OpenDocument) -> None:
        """Look at the drawing once it has stood still for a moment; what is under way is forgotten."""
        if found.checking is not None:
            found.checking.cancel()
        found.checking = asyncio.get_running_loop().create_task(self._check(found))

    async def _check(self, found: OpenDocument) -> None:
        await asyncio.sleep(0.15)
        diagram, version_now = found.document.diagram, found.document.version
        findings, wires = await asyncio.to_thread(check, diagram)
        if found.document.version == version_now:
            event = Checked(document=found.key, version=version_now, findings=findings, wires=wires)
            await self.pages.tell_of(found.key, event)

    def close(self) -> None:
        """End every run, and leave the documents so that nothing is lost."""
        for task in self._watching:
            task.cancel()
        self.documents.end()
        self.robots.robots.end()
        self.runs.close()


@lru_cache(maxsize=64)
def _example_drawing(name: str) -> bytes:
    return drawing_bytes(formats.load_diagram(name, BLOCKS, draft=True), "svg")
