"""Where pages, documents and runs meet: one hub a server, on one event loop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
import secrets
import warnings
from collections.abc import Sequence
from functools import lru_cache
from importlib.metadata import version
from typing import Any, Literal

from pydantic import ValidationError

from armblocks import formats
from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram, ParameterFormula
from armblocks.diagram.mask import formula_value
from armblocks.diagram.parameter import Value
from armblocks.drawing.diagram_file import drawing_bytes
from armblocks.errors import ArmblocksError, FormatError, InertiaWarning, InputError, UnknownNameError
from armblocks.robot import Robot
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.state_folder import StateFolder
from armblocks.studio.protocol import messages as say
from armblocks.studio.protocol.page import NoRequestError, Page
from armblocks.studio.robots.desk import RobotDesk
from armblocks.studio.robots.scene import link_frames_of, scene_of
from armblocks.studio.runs.process import RunProcess
from armblocks.studio.runs.record import RunRecord
from armblocks.studio.runs.report import report_of
from armblocks.studio.runs.settings import setting_rules, solver_choices
from armblocks.studio.runs.workers import Workers
from armblocks.studio.sheet.check import check
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.diagram_kind import Performed
from armblocks.studio.sheet.mask_edits import mask_of
from armblocks.studio.sheet.nesting import inside, linked_part, with_robot
from armblocks.studio.sheet.open_documents import OpenDocument, OpenDocuments
from armblocks.studio.sheet.outline import find, outline
from armblocks.studio.sheet.parameter_values import parameter_json, parameter_value
from armblocks.studio.sheet.shown import library, sheet, sheet_change
from armblocks.studio.sheet.typed_settings import setting_faults

PAGE_SECONDS = 1.5
"""A page that has its document draws for so long: the process for its first run is made after that."""
LOG = logging.getLogger(__name__)
NO_REQUEST = say.Fault(
    what="this is no request of the studio",
    where="page",
    allowed="what the page of this version asks",
    fix="load the page again: it may be of another version",
)
DEFECT = say.Fault(
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
        self.pages: set[Page] = set()
        kept = StateFolder(folder.root)
        self.documents = OpenDocuments(folder, kept, self.resolve_robot)
        self.runs: dict[str, RunProcess] = {}
        self.robots = RobotDesk(folder, kept, self)
        self.records: dict[str, RunRecord] = {}
        self.workers = Workers()
        self._watching: list[asyncio.Task[None]] = []
        self._telling: set[asyncio.Task[None]] = set()

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
            say.Welcome(
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
            envelope = say.Envelope.model_validate_json(text)
        except ValidationError as error:
            numbered = _NUMBERED.match(text)
            if numbered is None:
                raise NoRequestError(str(error)) from None
            await page.tell(say.Reply(number=int(numbered[1]), fault=NO_REQUEST))
            return
        number, fault, value = envelope.number, None, None
        try:
            value = await self.carry_out(page, envelope.request)
        except ArmblocksError as error:
            fault = say.Fault(what=error.what, where=error.where, allowed=error.allowed, fix=error.fix)
        except Exception as error:
            LOG.exception("a request met a defect")
            fault = DEFECT.model_copy(update={"what": f"{DEFECT.what} ({type(error).__name__})"})
        await page.tell(say.Reply(number=number, value=value, fault=fault))

    async def carry_out(self, page: Page, request: say.Request) -> Any:
        """Do what a page asks; the value goes into the reply. Raises ``ArmblocksError``."""
        match request:
            case say.Open(path=path) if path and self._is_robot_file(path):
                return await self.robots.open_file(page, path)
            case say.Open() | say.New() | say.Attach() | say.Look():
                return await self._open(page, request)
            case say.Change() | say.Undo() | say.Redo() | say.ArrangeBlocks() | say.Reload():
                return await self._change(request)
            case say.Save() | say.KeepMine() | say.Close() | say.Recover():
                return await self._keep(page, request)
            case say.Ping():
                return None
            case say.Files():
                return {"files": self.folder.files(), "recent": self._recent()}
            case say.AskOutline():
                return outline(self.documents[request.document].document.diagram)
            case say.AskMask():
                path = [*request.inside, request.block] if request.block else request.inside
                found = mask_of(inside(self.documents[request.document].document.diagram, path))
                return found.model_copy(update={"block": request.block})
            case say.Copy():
                level = inside(self.documents[request.document].document.diagram, request.inside)
                return clipped(level, request.blocks, request.notes, self.resolve_robot, self.folder.root)
            case say.Find():
                return find(self.documents[request.document].document.diagram, request.text)
            case say.TypedValue():
                return self._typed(request)
            case say.TypedSettings():
                options = self.documents[request.document].document.diagram.settings
                return setting_faults(options, request.values)
            case say.Scene():
                return scene_of(self.block_robot(request.document, request.inside, request.block))
            case say.Pose():
                robot = self.block_robot(request.document, request.inside, request.block)
                return link_frames_of(robot, request.q)
            case say.Run():
                return await self._run(request)
            case say.Control() | say.SetSpeed() | say.Rewind() | say.Tune():
                return self._known_run(request.run).obey(request)
            case _:
                return await self.robots.carry_out(page, request)

    async def tell_all(self, document: str, event: say.Message) -> None:
        """Tell every page that shows a document."""
        await asyncio.gather(*(page.tell(event) for page in self.pages if document in page.shows))

    # -- documents -------------------------------------------------------------------------------------------

    async def _open(self, page: Page, request: say.Open | say.New | say.Attach | say.Look) -> str:
        documents = self.documents
        match request:
            case say.Open():
                path, example = request.path, request.example
                found = documents.open_shipped(example) if example else documents.open_path(path)
                return await self._show(page, found)
            case say.New():
                return await self._show(page, documents.new())
            case say.Attach():
                return await self._show(
                    page,
                    documents.attach(request.document, request.path, request.example),
                    tuple(request.inside),
                )
            case say.Look():
                return await self._show(page, documents[request.document], tuple(request.inside))

    async def _show(self, page: Page, found: OpenDocument, path: tuple[str, ...] = ()) -> str:
        try:
            shown = inside(found.document.diagram, path)
        except UnknownNameError:
            if found.key in page.shows:
                raise
            path, shown = (), found.document.diagram  # what the page looked at before is gone
        fresh = found.key not in page.shows
        page.shows[found.key] = path
        run = next((run.key for run in self.runs.values() if run.document == found.key), None)
        drawn, linked = sheet(shown), linked_part(found.document.diagram, path)
        if linked:
            link = inside(found.document.diagram, linked).link
            drawn = drawn.model_copy(update={"linked": list(linked), "link": link})
        await page.tell(say.Opened(state=found.state(), inside=list(path), sheet=drawn, run=run))
        if fresh and run is not None:
            self._tell_run_later(page, run, 0)
        await self._tell_documents()
        self._check_later(found)
        if fresh:
            self.workers.prepare(after=PAGE_SECONDS)
        return found.key

    def _tell_run_later(self, page: Page, run: str, said: int) -> None:
        """Tell a page what a run has said but for the first ``said``, as fast as it listens: one that has
        just come, or that is behind. Until it has caught up it gets nothing else of the run.
        """
        page.hears[run] = said
        telling = asyncio.get_running_loop().create_task(self._tell_run(page, run))
        self._telling.add(telling)
        telling.add_done_callback(self._telling.discard)

    async def _tell_run(self, page: Page, run: str) -> None:
        record = self.records[run]
        while page.hears[run] < len(record) and self.records.get(run) is record and page in self.pages:
            page.hears[run] += 1
            await page.send(record[page.hears[run] - 1])
            await page.room()
        del page.hears[run]

    async def _change(self, request: Performed | say.Reload) -> int:
        found = self.documents[request.document]
        before, version_before = found.document.diagram, found.document.version
        if isinstance(request, say.Reload):
            self.documents.reload(found, request.key)
        elif not self.documents.perform(found, request):
            return found.document.version
        for page in [page for page in self.pages if found.key in page.shows]:
            await self._tell_change(page, found, before, version_before)
        self._check_later(found)
        return found.document.version

    async def _keep(self, page: Page, request: say.Save | say.KeepMine | say.Close | say.Recover) -> Any:
        """What is between a document and its file."""
        documents = self.documents
        if isinstance(request, say.Recover):
            if request.document in self.robots.robots.left:
                key = await self.robots.recover(page, request)
            else:
                opened = await documents.recover(request)
                key = await self._show(page, opened) if opened is not None else None
            await self._tell_documents()
            return key
        found = documents[request.document]
        answer: Any = None
        try:
            match request:
                case say.Save():
                    answer = await documents.save(found, request.path, overwrite=request.overwrite)
                case say.KeepMine():
                    documents.keep_mine(found)
                case say.Close():
                    documents.close(found, discard=request.discard)
                    await self._tell_documents()
                    return None
        finally:
            await self._tell_state(found)
        await self._tell_documents()
        return answer

    async def _tell_state(self, found: OpenDocument) -> None:
        """Tell the pages that show a document where it stands; the drawing is as it was."""
        nothing = say.SheetChange(blocks={}, wires_added=[], wires_removed=[])
        event = say.Changed(state=found.state(), before=found.document.version, change=nothing)
        await self.tell_all(found.key, event)

    async def _tell_documents(self) -> None:
        """Tell every page what is open."""
        event = say.Documents(
            documents=[document.state() for document in self.documents],
            recoveries=self._recoveries(),
        )
        await asyncio.gather(*(page.tell(event) for page in self.pages))

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
            for page in [page for page in self.pages if found.key in page.shows]:
                await self._tell_change(page, found, before, version_before)
            self._check_later(found)

    def _typed(self, request: say.TypedValue) -> Any:
        known, scope = BLOCKS[request.type].parameters(), dict[str, Value]()
        if request.document:
            level = inside(self.documents[request.document].document.diagram, request.inside)
            known, scope = level.block(request.block).own_parameters(), dict(level.mask_values)
        rules = {rule.name: rule for rule in known}
        if request.parameter not in rules:
            raise UnknownNameError(f"parameter of {request.type}", request.parameter, rules)
        rule = rules[request.parameter]
        value = parameter_value(rule, request.text, request.type, self.resolve_robot, scope)
        if isinstance(value, ParameterFormula):
            value = formula_value(rule, value.text, scope, request.type)
        return parameter_json(value)

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
            event = say.Checked(document=found.key, version=version_now, findings=findings, wires=wires)
            await self.tell_all(found.key, event)

    # -- runs ------------------------------------------------------------------------------------------------

    def _known_run(self, key: str) -> RunProcess:
        if key not in self.runs:
            raise UnknownNameError("run", key, self.runs)
        return self.runs[key]

    async def _run(self, request: say.Run) -> str:
        found = self.documents[request.document]

        key, record = secrets.token_hex(8), RunRecord()

        async def tell(event: say.Message | bytes) -> None:
            said = event if isinstance(event, bytes) else event.model_dump_json()
            record.append(said)
            for page in [page for page in self.pages if found.key in page.shows and key not in page.hears]:
                if page.behind:
                    self._tell_run_later(page, key, len(record) - 1)
                else:
                    await page.send(said)

        worker = await self.workers.take()
        for other in list(self.runs.values()):
            if other.document == found.key:
                other.end()
                del self.runs[other.key]
                self.records.pop(other.key).close()
        job = {
            "diagram": formats.diagram_to_bytes(
                found.document.diagram, self.resolve_robot, folder=self.folder.root
            ).decode(),
            "folder": str(self.folder.root),
            "speed": request.speed,
            "tuned": request.tuned,
        }
        run = RunProcess(key, found.key, worker, tell)
        self.runs[key], self.records[key] = run, record
        run.start(job)
        return run.key

    async def report(self, document: str) -> bytes:
        """The report of the last run of a document, a page; raises ``ArmblocksError``."""
        jobs = [run.job for run in self.runs.values() if run.document == self.documents[document].key]
        if not jobs:
            raise InputError("there is no run to report", where="report", fix="run the model first")
        return await report_of(jobs[-1])

    def close(self) -> None:
        """End every run, and leave the documents so that nothing is lost."""
        for task in (*self._watching, *self._telling):
            task.cancel()
        self.documents.end()
        self.robots.robots.end()
        for run in self.runs.values():
            run.end()
        for record in self.records.values():
            record.close()
        self.workers.end()


@lru_cache(maxsize=64)
def _example_drawing(name: str) -> bytes:
    return drawing_bytes(formats.load_diagram(name, BLOCKS, draft=True), "svg")
