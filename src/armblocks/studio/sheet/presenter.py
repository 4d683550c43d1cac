"""How diagrams are opened and shown: a sheet at a time, with what the background check finds."""

from __future__ import annotations

import asyncio
import dataclasses
from typing import Protocol

from armblocks.diagram import Diagram
from armblocks.errors import UnknownNameError
from armblocks.studio.documents.presenter import Opening, Place, Presenter
from armblocks.studio.protocol.messages.sheets import Checked, DiagramChange, DiagramContent
from armblocks.studio.protocol.page import Page, Pages
from armblocks.studio.sheet.check import check
from armblocks.studio.sheet.nesting import inside, linked_part
from armblocks.studio.sheet.open_documents import OpenDocument, OpenDocuments
from armblocks.studio.sheet.shown import sheet, sheet_change

STILL_SECONDS = 0.15
"""A drawing is checked when it has stood still for so long."""


class RunsOfDiagrams(Protocol):
    """What the presenter needs of the runs."""

    def of(self, document: str) -> str | None:
        """The key of the run of a diagram, ``None`` where there is none."""
        ...

    def shown(self, page: Page, document: str) -> None:
        """A page has just come to a diagram."""
        ...


class DiagramPresenter(Presenter[OpenDocument]):
    """Shows each page the sheet of a diagram that it looks at."""

    def __init__(self, files: OpenDocuments, pages: Pages, runs: RunsOfDiagrams) -> None:
        super().__init__(files)
        self._documents = files
        self._pages = pages
        self._runs = runs

    def dropped(self, data: bytes, name: str) -> Opening[OpenDocument]:
        """The diagram of a file from elsewhere."""
        return Opening([self._documents.open_bytes(data, name)])

    def place(self, found: OpenDocument, wished: Place, *, known: bool) -> Place:
        """The path of the sheet; the top where a page that comes again looked at one that is gone."""
        try:
            inside(found.document.diagram, wished)
        except UnknownNameError:
            if known:
                raise
            return ()
        return wished

    def content(self, found: OpenDocument, place: Place) -> DiagramContent:
        """The sheet at a path."""
        diagram = found.document.diagram
        drawn, linked = sheet(inside(diagram, place)), linked_part(diagram, place)
        if linked:
            link = inside(diagram, linked).link
            drawn = drawn.model_copy(update={"linked": list(linked), "link": link})
        return DiagramContent(
            inside=list(place),
            sheet=drawn,
            settings=dataclasses.asdict(diagram.settings),
            run=self._runs.of(found.key),
        )

    def change(self, found: OpenDocument, before: Diagram, place: Place) -> DiagramChange:
        """What changed on the sheet at a path."""
        diagram = found.document.diagram
        return DiagramChange(
            sheet=sheet_change(inside(before, place), inside(diagram, place)),
            settings=dataclasses.asdict(diagram.settings),
        )

    def shown(self, page: Page, found: OpenDocument, *, known: bool) -> None:
        """Tell the page of the run of the diagram, and check the diagram."""
        if not known:
            self._runs.shown(page, found.key)
        self.changed(found)

    def changed(self, found: OpenDocument) -> None:
        """Check the drawing once it has stood still for a moment; a check that is under way is given up."""
        if found.checking is not None:
            found.checking.cancel()
        found.checking = asyncio.get_running_loop().create_task(self._check(found))

    async def _check(self, found: OpenDocument) -> None:
        await asyncio.sleep(STILL_SECONDS)
        diagram, version_now = found.document.diagram, found.document.version
        findings, wires = await asyncio.to_thread(check, diagram)
        if found.document.version == version_now:
            event = Checked(document=found.key, version=version_now, findings=findings, wires=wires)
            await self._pages.tell_of(found.key, event)
