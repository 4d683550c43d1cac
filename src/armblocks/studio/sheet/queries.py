"""Requests about the sheets of open diagrams that do not change them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from armblocks.blocks import BLOCKS
from armblocks.diagram import Diagram, ParameterFormula
from armblocks.diagram.mask import formula_value
from armblocks.diagram.parameter import Value
from armblocks.diagram.propagated_names import propagated_names
from armblocks.errors import UnknownNameError
from armblocks.studio.documents.project_folder import ProjectFolder
from armblocks.studio.documents.requests import DocumentRequests
from armblocks.studio.protocol.clients import StudioClient
from armblocks.studio.protocol.messages import sheets as sheet_messages
from armblocks.studio.protocol.messages.sheet_edits import SetMask
from armblocks.studio.protocol.request_handlers import RequestHandlers
from armblocks.studio.sheet.bookmarks import bookmarks_of
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.edits import connection
from armblocks.studio.sheet.lines import LinesOfSheets, has_ports
from armblocks.studio.sheet.mask_edits import mask_of
from armblocks.studio.sheet.nesting import inside
from armblocks.studio.sheet.open_documents import OpenDocuments
from armblocks.studio.sheet.outline import find, outline
from armblocks.studio.sheet.parameter_sets import parameter_set_table
from armblocks.studio.sheet.parameter_values import ResolveRobot, parameter_json, parameter_value
from armblocks.studio.sheet.typed_settings import setting_faults


class SheetQueries:
    """Handles the requests of front ends about diagrams."""

    def __init__(
        self,
        folder: ProjectFolder,
        documents: DocumentRequests,
        diagrams: OpenDocuments,
        resolve_robot: ResolveRobot,
        lines: LinesOfSheets,
    ) -> None:
        self._folder = folder
        self._documents = documents
        self._diagrams = diagrams
        self._resolve_robot = resolve_robot
        self._lines = lines

    def register(self, handlers: RequestHandlers) -> None:
        """Register the handlers of the requests about sheets."""
        handlers.on(sheet_messages.ShowSheet, self._show_sheet)
        handlers.on(sheet_messages.RouteWires, self._route)
        handlers.on(sheet_messages.AskOutline, self._outline)
        handlers.on(sheet_messages.AskMask, self._mask)
        handlers.on(sheet_messages.AskParameterSets, self._parameter_sets)
        handlers.on(sheet_messages.AskBookmarks, self._bookmarks)
        handlers.on(sheet_messages.Copy, self._copy)
        handlers.on(sheet_messages.Find, self._find)
        handlers.on(sheet_messages.TypedValue, self._typed_value)
        handlers.on(sheet_messages.TypedSettings, self._typed_settings)

    def _sheet(self, document: str, path: Sequence[str] = ()) -> Diagram:
        return inside(self._diagrams[document].document.diagram, path)

    async def _show_sheet(self, client: StudioClient, request: sheet_messages.ShowSheet) -> None:
        await self._documents.show(client, self._diagrams[request.document], tuple(request.inside))

    async def _route(
        self, _: StudioClient, request: sheet_messages.RouteWires
    ) -> dict[str, sheet_messages.WireLines]:
        sheet = self._sheet(request.document, request.inside)
        lines = self._lines.for_sheet(request.document, tuple(request.inside))
        connections, bends = sheet.connections, sheet.bends
        if request.wires is not None:
            wires = {connection(wire): wire.bends for wire in request.wires}
            connections, bends = tuple(wire for wire in wires if has_ports(wire, sheet)), wires
        diagram = self._diagrams[request.document].document.diagram
        names = propagated_names(diagram, "/".join(request.inside))
        before = lines.route(sheet, names)
        places = {name: (corner.x, corner.y) for name, corner in request.places.items()}
        after = lines.route_dragged(sheet, places, connections, bends, request.passed, names)
        return {source: shown for source, shown in after.items() if before.get(source) != shown}

    async def _outline(self, _: StudioClient, request: sheet_messages.AskOutline) -> sheet_messages.Outline:
        return outline(self._sheet(request.document))

    async def _mask(self, _: StudioClient, request: sheet_messages.AskMask) -> SetMask:
        path = [*request.inside, request.block] if request.block else request.inside
        return mask_of(self._sheet(request.document, path)).model_copy(update={"block": request.block})

    async def _parameter_sets(
        self, _: StudioClient, request: sheet_messages.AskParameterSets
    ) -> sheet_messages.ParameterSetTable:
        return parameter_set_table(self._sheet(request.document), request.also)

    async def _bookmarks(
        self, _: StudioClient, request: sheet_messages.AskBookmarks
    ) -> list[sheet_messages.SheetBookmark]:
        return bookmarks_of(self._sheet(request.document))

    async def _copy(self, _: StudioClient, request: sheet_messages.Copy) -> str:
        sheet = self._sheet(request.document, request.inside)
        return clipped(sheet, request.blocks, request.notes, self._resolve_robot, self._folder.root)

    async def _find(self, _: StudioClient, request: sheet_messages.Find) -> list[sheet_messages.FoundBlock]:
        return find(self._sheet(request.document), request.text)

    async def _typed_settings(self, _: StudioClient, request: sheet_messages.TypedSettings) -> dict[str, str]:
        return setting_faults(self._sheet(request.document).settings, request.values)

    async def _typed_value(self, _: StudioClient, request: sheet_messages.TypedValue) -> Any:
        parameters, scope = BLOCKS[request.type].parameters(), dict[str, Value]()
        if request.document:
            level = self._sheet(request.document, request.inside)
            parameters, scope = level.block(request.block).own_parameters(), dict(level.mask_values)
        rules = {rule.name: rule for rule in parameters}
        if request.parameter not in rules:
            raise UnknownNameError(f"parameter of {request.type}", request.parameter, rules)
        rule = rules[request.parameter]
        value = parameter_value(rule, request.text, request.type, self._resolve_robot, scope)
        if isinstance(value, ParameterFormula):
            value = formula_value(rule, value.text, scope, request.type)
        return parameter_json(value)
