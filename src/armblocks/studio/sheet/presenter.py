"""Opening and display of diagrams, one sheet at a time, with the findings of the background check."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Awaitable, Callable, Mapping
from typing import Protocol

from armblocks.diagram import Diagram
from armblocks.diagram.propagated_names import propagated_names
from armblocks.errors import UnknownNameError
from armblocks.studio.documents.presenter import Opening, Place, Presenter
from armblocks.studio.protocol.clients import Clients, StudioClient
from armblocks.studio.protocol.messages.sheets import (
    Checked,
    DiagramChange,
    DiagramContent,
    Finding,
    WireKind,
)
from armblocks.studio.sheet.drawing_data import outer_comment, sheet, sheet_change
from armblocks.studio.sheet.lines import LinesOfSheets, changed_lines
from armblocks.studio.sheet.nesting import inside, linked_part
from armblocks.studio.sheet.open_documents import OpenDocument, OpenDocuments
from armblocks.studio.sheet.renames import path_after, renamed_paths
from armblocks.studio.sheet.scope_triggers import trigger_settings

CHECK_DELAY_SECONDS = 0.15
"""Delay of the background check after the last edit, s."""


class RunsOfDiagrams(Protocol):
    """The methods of ``DiagramRuns`` that the presenter uses."""

    def run_key(self, document: str) -> str | None:
        """The key of the run of a diagram, or ``None``."""
        ...

    def on_shown(self, client: StudioClient, document: str) -> None:
        """Called after a client was sent a diagram."""
        ...

    async def rename(self, document: str, renamed: Mapping[str, str]) -> None:
        """Called after blocks of a diagram were renamed: old path to new path."""
        ...


CheckDiagram = Callable[[Diagram], Awaitable[tuple[list[Finding], dict[str, WireKind]]]]
"""Returns the findings of a diagram, and the known types of its signals."""


class DiagramPresenter(Presenter[OpenDocument]):
    """Shows in each client the sheet of a diagram that the client has selected."""

    def __init__(
        self,
        files: OpenDocuments,
        clients: Clients,
        runs: RunsOfDiagrams,
        lines: LinesOfSheets,
        check: CheckDiagram,
    ) -> None:
        super().__init__(files)
        self._check_diagram = check
        self._lines = lines
        self._documents = files
        self._clients = clients
        self._runs = runs

    def dropped(self, data: bytes, name: str) -> Opening[OpenDocument]:
        """Open the diagram of a file from outside the project."""
        return Opening([self._documents.open_bytes(data, name)])

    def place(self, open_file: OpenDocument, requested: Place, *, known: bool) -> Place:
        """Return the path of the sheet; the top sheet if a reconnecting client shows a deleted sheet."""
        try:
            inside(open_file.document.diagram, requested)
        except UnknownNameError:
            if known:
                raise
            return ()
        return requested

    def content(self, open_file: OpenDocument, place: Place) -> DiagramContent:
        """Return the sheet at a path."""
        diagram = open_file.document.diagram
        shown_sheet, linked = inside(diagram, place), linked_part(diagram, place)
        names = propagated_names(diagram, "/".join(place))
        drawn_sheet = sheet(
            shown_sheet, self._lines.for_sheet(open_file.key, place).route(shown_sheet, names)
        )
        if linked:
            link = inside(diagram, linked).link
            drawn_sheet = drawn_sheet.model_copy(update={"linked": list(linked), "link": link})
        return DiagramContent(
            inside=list(place),
            sheet=drawn_sheet,
            settings=dataclasses.asdict(diagram.settings),
            scope_trigger=trigger_settings(diagram),
            run=self._runs.run_key(open_file.key),
            outer_comment=outer_comment(diagram, place),
        )

    def change(self, open_file: OpenDocument, before: Diagram, place: Place) -> DiagramChange:
        """Return the changes of the sheet at a path."""
        diagram = open_file.document.diagram
        old, new, lines = (
            inside(before, place),
            inside(diagram, place),
            self._lines.for_sheet(open_file.key, place),
        )
        old_lines, new_lines = (
            lines.route(inside(value, place), propagated_names(value, "/".join(place)))
            for value in (before, diagram)
        )
        return DiagramChange(
            sheet=sheet_change(old, new, changed_lines(old_lines, new_lines)),
            settings=dataclasses.asdict(diagram.settings),
            scope_trigger=trigger_settings(diagram),
            outer_comment=outer_comment(diagram, place),
            renamed=open_file.document.renamed(before),
        )

    def place_after(self, open_file: OpenDocument, before: Diagram, place: Place) -> Place:
        """Return the path of a sheet after a change; the change may have renamed its subsystems."""
        renamed = renamed_paths(before, open_file.document.diagram)
        return tuple(path_after("/".join(place), renamed).split("/")) if place else place

    def on_shown(self, client: StudioClient, open_file: OpenDocument, *, known: bool) -> None:
        """Send the client the run of the diagram, and start the background check."""
        if not known:
            self._runs.on_shown(client, open_file.key)
        self.on_changed(open_file)

    async def on_edited(self, open_file: OpenDocument, before: Diagram) -> None:
        """Notify the run of the diagram about renamed blocks, and start the background check."""
        if renamed := open_file.document.renamed(before):
            await self._runs.rename(open_file.key, renamed)
        self.on_changed(open_file)

    def on_changed(self, open_file: OpenDocument) -> None:
        """Start the background check after a pause in the edits; a check in progress is cancelled."""
        if open_file.checking is not None:
            open_file.checking.cancel()
        open_file.checking = asyncio.get_running_loop().create_task(self._check(open_file))

    async def _check(self, open_file: OpenDocument) -> None:
        await asyncio.sleep(CHECK_DELAY_SECONDS)
        diagram, checked_version = open_file.document.diagram, open_file.document.version
        findings, wires = await self._check_diagram(diagram)
        if open_file.document.version == checked_version:
            event = Checked(document=open_file.key, version=checked_version, findings=findings, wires=wires)
            await self._clients.notify_showing(open_file.key, event)
