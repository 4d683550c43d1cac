"""The lines of the displayed sheets; only wires affected by a change are routed again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from armblocks.diagram import Connection, Diagram, PortRef
from armblocks.drawing.diagram_drawing import obstacle, shown_name, wire_label, wire_nets
from armblocks.drawing.diagram_layout import boxes
from armblocks.drawing.frame_lines import drawn_frames, frame_nets
from armblocks.drawing.wire_names import name_position
from armblocks.drawing.wire_routing import Routing
from armblocks.drawing.wires import moved_bends
from armblocks.studio.protocol.messages.sheets import WireLines

Lines = Mapping[str, WireLines]
PropagatedNames = Mapping[PortRef, str]
NO_NAMES: PropagatedNames = {}
_MAX_SHEETS = 16


class SheetLines:
    """The lines of one sheet."""

    def __init__(self) -> None:
        self._routing = Routing()
        self._cache: list[tuple[Diagram, PropagatedNames, Lines]] = []

    def route(self, sheet: Diagram, propagated: PropagatedNames = NO_NAMES) -> Lines:
        """Return the lines of a sheet, by output, with the names that signals have on other sheets."""
        for cached, names, lines in self._cache:
            if cached is sheet and names == propagated:
                return lines
        lines = self.route_dragged(sheet, {}, sheet.connections, sheet.bends, None, propagated)
        self._cache = [*self._cache[-1:], (sheet, propagated, lines)]
        return lines

    def route_dragged(
        self,
        sheet: Diagram,
        places: Mapping[str, tuple[float, float]],
        connections: Iterable[Connection],
        bends: Mapping[Connection, tuple[float, ...]],
        passed: str | None,
        propagated: PropagatedNames = NO_NAMES,
    ) -> Lines:
        """Return the lines of a sheet with some blocks at other positions and with other connections."""
        placed = dict(boxes(sheet))
        shifts: dict[str, tuple[float, float]] = {}
        for name, (x, y) in places.items():
            if name in placed:
                shifts[name] = x - placed[name].x, y - placed[name].y
                placed[name] = placed[name].at(x, y)
        moved = dict(bends)
        for wire, values in bends.items():
            shift = shifts.get(wire.source.block)
            if shift is not None and shift == shifts.get(wire.target.block):
                ports = placed[wire.source.block].outputs
                is_horizontal = any(port.name == wire.source.port and port.dx != 0 for port in ports)
                moved[wire] = moved_bends(values, is_horizontal, shift)
        nets, wires = wire_nets(connections, moved, placed)
        frames = frame_nets(drawn_frames(sheet, boxes(sheet)), placed)
        nets += [net for _, net in frames]
        wires |= {first: list(others) for (first, *others), _ in frames}
        obstacles = {name: obstacle(box) for name, box in placed.items() if name != passed}
        routed = self._routing.update(obstacles, dict(zip(map(str, wires), nets)))
        return {
            str(source): WireLines(
                paths={str(target): list(path) for target, path in zip(targets, routed[str(source)].paths)},
                dots=list(routed[str(source)].dots),
                label=wire_label(sheet, source),
                name=sheet.signal_names.get(source, ""),
                propagated_name=propagated.get(source, ""),
                name_at=name_position(
                    shown_name(sheet, source, propagated), routed[str(source)].paths, obstacles.values()
                ),
            )
            for source, targets in wires.items()
        }


class LinesOfSheets:
    """The lines of the last displayed sheets, by document and path."""

    def __init__(self) -> None:
        self._sheets: dict[tuple[str, tuple[str, ...]], SheetLines] = {}

    def for_sheet(self, document: str, path: tuple[str, ...]) -> SheetLines:
        """Return the lines of the sheet at a path of a document."""
        lines = self._sheets.pop((document, path), None) or SheetLines()
        self._sheets[document, path] = lines
        if len(self._sheets) > _MAX_SHEETS:
            del self._sheets[next(iter(self._sheets))]
        return lines


def has_ports(wire: Connection, sheet: Diagram) -> bool:
    """Whether both ports of a wire exist on the sheet; a client may show an earlier version of it."""
    source, target = sheet.blocks.get(wire.source.block), sheet.blocks.get(wire.target.block)
    return (
        source is not None
        and target is not None
        and any(port.name == wire.source.port for port in source.output_ports())
        and any(port.name == wire.target.port for port in target.input_ports())
    )


def changed_lines(before: Lines, after: Lines) -> dict[str, WireLines | None]:
    """Return the changed lines; ``None`` for outputs without wires."""
    changed: dict[str, WireLines | None] = {
        source: lines for source, lines in after.items() if before.get(source) != lines
    }
    return {**dict.fromkeys(before.keys() - after.keys()), **changed}
