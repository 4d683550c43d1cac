"""The drawing of a diagram: blocks with their faces, and routed wires."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from armblocks.diagram import (
    Block,
    Bus,
    Connection,
    Diagram,
    PortRef,
    Shapes,
    View,
    ViewKind,
    diagram_views,
    flatten_hierarchy,
    infer_shapes,
    levels_of,
)
from armblocks.diagram.propagated_names import propagated_names
from armblocks.diagram.signs import Outline
from armblocks.drawing import block_faces
from armblocks.drawing.block_boxes import (
    NAME_HEIGHT,
    NAME_SIZE,
    PORT_TEXT,
    PORT_TEXT_HEIGHT,
    Box,
    BoxPort,
    box_at_origin,
)
from armblocks.drawing.block_colours import coloured_marks
from armblocks.drawing.comment_marks import COMMENT_WORDS, commented_marks, grey_mark
from armblocks.drawing.diagram_layout import boxes
from armblocks.drawing.face_marks import FaceArea
from armblocks.drawing.frame_lines import FRAME_TONE, drawn_frames, frame_nets, frame_port_marks
from armblocks.drawing.rates import Rates
from armblocks.drawing.sink_faces import Trend
from armblocks.drawing.structure_faces import control_ports
from armblocks.drawing.wire_marks import (
    WireKind,
    arrow_head,
    frame_line_marks,
    label_marks,
    rounded_path,
    wire_marks,
)
from armblocks.drawing.wire_names import name_marks
from armblocks.drawing.wire_routing import route
from armblocks.drawing.wires import Net, Obstacle, RoutedNet, WireEnd
from armblocks.errors import DiagramError, UnknownNameError, counted
from armblocks.pictures.picture import (
    Curve,
    Group,
    Mark,
    Picture,
    Polyline,
    Text,
    moved,
    rotated_clockwise,
)
from armblocks.pictures.style import Theme, Tone
from armblocks.pictures.svg import svg_file
from armblocks.pictures.text_width import shorten, text_width
from armblocks.simulation.result import SimulationResult

_MARGIN = 22.0
NOTE_SIZE = 12.0
NOTE_LINE = 17.0
"""Font size and line height of notes, px."""
_TREND_KINDS = (ViewKind.TRACES, ViewKind.PATH, ViewKind.VALUE)
_STUB_LENGTH = 16.0
"""Length of the wires at the ports of a block that is drawn alone, px."""


def diagram_picture(
    diagram: Diagram, result: SimulationResult | None = None, *, sheet: str = "", rates: bool = False
) -> Picture:
    """The drawing of a sheet; with a result, sinks show its data.

    ``sheet``: the path of a subsystem to draw instead of the top level. A sheet inside a commented subsystem
    is grey. An incomplete diagram, which cannot be traced, has thin lines only. ``rates``: sampled blocks and
    their wires show their clocks, and a legend lists the periods. Raises UnknownNameError for an unknown
    sheet, DiagramError if the sample times cannot be determined.
    """
    contents = _SignalContents.of(diagram)
    clocks = Rates.of(diagram) if rates else Rates()
    if sheet not in contents.levels:
        sheet_paths = [path for path in contents.levels if path]
        raise UnknownNameError("sheet", sheet, sheet_paths, where=f"diagram '{diagram.name}'")
    level = contents.levels[sheet]
    path = f"{sheet}/" if sheet else ""
    propagated = propagated_names(diagram, sheet)
    placed_boxes = boxes(level)
    nets, wires = wire_nets(level.connections, drawn_bends(level), placed_boxes)
    obstacles = [obstacle(box) for box in placed_boxes.values()]
    lines = frame_nets(drawn_frames(level, placed_boxes), placed_boxes)
    every = route(obstacles, [*nets, *(net for _, net in lines)])
    routed, routed_lines = every[: len(nets)], every[len(nets) :]
    marks: list[Mark] = []
    for (ends, net), line in zip(lines, routed_lines):
        marks += frame_line_marks(net, line, " and ".join(map(str, ends)), str(ends[0]), FRAME_TONE)
    for (source, _), net in zip(wires.items(), routed):
        kind = contents.kind(PortRef(path + source.block, source.port))
        _, tone = clocks.mark(path + source.block) or ("", Tone.WIRE)
        marks += wire_marks(net, kind, _wire_title(source, wires[source]), tone)
    for name, box in placed_boxes.items():
        trend = _trend(path + name, contents.views.get(path + name), result)
        own_comment = level.commented.get(name, "")
        block = _block(box, trend, own_comment)
        if (mark := clocks.mark(path + name)) is not None:
            corner = box.x + box.width, box.y - 4
            block.append(Text(*corner, mark[0], NAME_SIZE - 1.5, mark[1], "end", bold=True))
        marks.append(Group(tuple(block), title=_block_title(name, box, own_comment)))
    for (source, _), wire_net, net in zip(wires.items(), nets, routed):
        marks += label_marks(wire_net, net, wire_label(level, source))
        marks += name_marks(shown_name(level, source, propagated), net.paths, obstacles)
    comment = _outer_comment(contents.levels, sheet)
    if comment:
        marks = [grey_mark(mark) for mark in marks]
    marks += _notes(level)
    left, top, right, bottom = _extent(placed_boxes, every, level)
    picture = Picture(
        width=right - left + 2 * _MARGIN,
        height=bottom - top + 2 * _MARGIN,
        title=", ".join(filter(None, (f"Diagram {diagram.name}", sheet and f"sheet {sheet}", comment))),
        description=_text_alternative(level),
    )
    content = Picture(width=0, height=0, title="", marks=marks)
    picture.place(content, _MARGIN - left, _MARGIN - top)
    clocks.add_legend(picture)
    return picture


def _outer_comment(levels: Mapping[str, Diagram], sheet: str) -> str:
    """The words for the outermost commented subsystem that contains a sheet; empty if there is none."""
    level = ""
    for name in sheet.split("/") if sheet else ():
        if comment := levels[level].commented.get(name):
            return COMMENT_WORDS[comment]
        level = f"{level}/{name}" if level else name
    return ""


def sheets(diagram: Diagram) -> dict[str, tuple[str, ...]]:
    """The subsystems of a diagram by path, in order, each with the paths of its equal copies."""
    paths_of: dict[Diagram, list[str]] = {}
    for path, level in sorted(levels_of(diagram).items(), key=lambda entry: entry[0].split("/")):
        if path:
            paths_of.setdefault(level, []).append(path)
    return {paths[0]: tuple(paths[1:]) for paths in paths_of.values()}


def diagram_svg(
    diagram: Diagram, result: SimulationResult | None = None, *, theme: Theme | None = None
) -> str:
    """:func:`diagram_picture` as an SVG document; ``theme`` ``None`` follows the viewer's preference."""
    return svg_file(diagram_picture(diagram, result), theme=theme)


def block_picture(block: Block) -> Picture:
    """The symbol of one block, with stubs of its connections."""
    box = box_at_origin("", block)
    marks: list[Mark] = []
    for port in (*box.inputs, *box.outputs):
        enters = port in box.inputs
        reach = -_STUB_LENGTH if enters else _STUB_LENGTH
        edge, outside = (port.x, port.y), (port.x + reach * port.dx, port.y + reach * port.dy)
        path = (outside, edge) if enters else (edge, outside)
        marks.append(Curve(rounded_path(path), stroke=Tone.WIRE, width=1.2))
        if enters:
            marks.append(arrow_head(path))
    for port in box.frames:
        end = (port.x + _STUB_LENGTH * port.dx, port.y + _STUB_LENGTH * port.dy)
        marks.append(Curve(rounded_path(((port.x, port.y), end)), stroke=FRAME_TONE, width=1.8))
    marks += [mark for mark in _block(box, None) if not isinstance(mark, Text) or mark.text]
    above, below = (any(port.dy == direction for port in box.inputs) for direction in (1, -1))
    picture = Picture(
        width=box.width + 2 * (_STUB_LENGTH + 2),
        height=box.height + 8 + _STUB_LENGTH * (above + below),
        title=f"Symbol of {block.title}",
    )
    content = Picture(width=0, height=0, title="", marks=marks)
    picture.place(content, _STUB_LENGTH + 2 - box.x, 4 + _STUB_LENGTH * above - box.y)
    return picture


def drawn_bends(diagram: Diagram) -> Mapping[Connection, tuple[float, ...]]:
    """The user-drawn routes; none if the layout lacks a block, because they belong to a complete layout."""
    return diagram.bends if set(diagram.layout) >= set(diagram.blocks) else {}


def wire_nets(
    connections: Iterable[Connection],
    bends: Mapping[Connection, tuple[float, ...]],
    placed_boxes: Mapping[str, Box],
) -> tuple[list[Net], dict[PortRef, list[PortRef]]]:
    """The nets to route, one for each connected output, and the targets of each source."""
    wires: dict[PortRef, list[PortRef]] = {}
    for wire in sorted(connections, key=lambda w: (w.source, w.target)):
        wires.setdefault(wire.source, []).append(wire.target)
    nets = [
        Net(
            _end(placed_boxes[source.block].outputs, source.port),
            tuple(_end(placed_boxes[target.block].inputs, target.port) for target in targets),
            tuple(bends.get(Connection(source, target), ()) for target in targets),
        )
        for source, targets in wires.items()
    ]
    return nets, wires


def _end(ports: tuple[BoxPort, ...], name: str) -> WireEnd:
    port = next(port for port in ports if port.name == name)
    return WireEnd(port.x, port.y, port.dx, port.dy)


def shown_name(diagram: Diagram, source: PortRef, propagated: Mapping[PortRef, str]) -> str:
    """The text at the line of a signal: its name, or ``<name>`` with its name on another sheet."""
    own, other = diagram.signal_names.get(source, ""), propagated.get(source, "")
    return own or (f"<{other}>" if other else "")


def wire_label(diagram: Diagram, source: PortRef) -> str:
    """The label at both ends of a wire without a line.

    The label is the name of the signal, else the name of the source block, with the port if the block has
    several.
    """
    if source in diagram.signal_names:
        return diagram.signal_names[source]
    return source.block if len(diagram.blocks[source.block].output_ports()) == 1 else str(source)


def obstacle(box: Box) -> Obstacle:
    """The area of a block and its name, which wires avoid."""
    return Obstacle(box.x, box.y, box.width, box.height, _label(box))


def _label(box: Box) -> tuple[float, float, float, float]:
    """The rectangle of the block's name; if the name is hidden, the rectangle of the block."""
    width, middle = box.name_width, box.y + box.height / 2 - 7
    match box.shown_name_side:
        case "hidden":
            return box.x, box.y, box.width, box.height
        case "right":
            return box.x + box.width + 5, middle, width, NAME_HEIGHT - 4
        case "left":
            return box.x - 5 - width, middle, width, NAME_HEIGHT - 4
        case "corner":
            return box.x + box.width * 0.78, box.y - NAME_SIZE - 2, width, NAME_SIZE + 3
        case "above":
            return box.x + (box.width - width) / 2, box.y - NAME_HEIGHT + 2, width, NAME_HEIGHT - 4
        case _:
            return box.x + (box.width - width) / 2, box.y + box.height + 2, width, NAME_HEIGHT - 4


def _shape(box: Box) -> Outline:
    return block_faces.face_size(box.block)[0]


def _trend(path: str, view: View | None, result: SimulationResult | None) -> Trend | None:
    if result is None or view is None:
        return None
    result = result.with_jumps()
    count = len(result.time)
    return Trend(
        time=result.time, inputs=tuple(result[f"{path}/{s}"].reshape(count, -1) for s in view.signals)
    )


def block_marks(box: Box, trend: Trend | None = None, comment: str = "") -> list[Mark]:
    """A block without its name: outline, port names and face, at the position of its box.

    A rotated block has a rotated outline and an upright drawing. A block with a ``comment`` is grey.
    """
    marks = _plain_marks(box, trend)
    return commented_marks(marks, box, comment) if comment else coloured_marks(marks, box.colour)


def _plain_marks(box: Box, trend: Trend | None) -> list[Mark]:
    shape, block = _shape(box), box.block
    marks: list[Mark] = [_outline(box), *frame_port_marks(box)]
    area = FaceArea(box.x, box.y, box.width, box.height)
    if shape in (Outline.CARD, Outline.BUS):
        names, area = _port_names(box)
        marks += names
    elif shape is Outline.CIRCLE:
        marks += _signs(box)
    if shape is Outline.BAR:
        return marks
    flipped = box.flipped != (box.rotation == 180)
    if not box.upright and shape is Outline.TRIANGLE:
        # The number is in the wide half of the triangle, which is the upper half if the triangle points down.
        points_down = (box.rotation == 90) != box.flipped
        direction = -1 if points_down else 1
        area = FaceArea(
            area.x + 0.14 * area.width, area.y + direction * 0.14 * area.height, area.width, area.height
        )
        flipped = False
    above = set(control_ports(block))
    if box.upright:
        heights = tuple(port.y for port in box.inputs if port.name not in above)
    else:
        count = len(box.inputs)
        heights = tuple(area.y + area.height * (k + 0.5) / count for k in range(count))
    tops = tuple((port.name, port.x) for port in box.inputs if port.name in above and not box.rotation)
    port_marks = block_faces.face_at_ports(block, area, heights, tops, flipped=flipped)
    return marks + (
        port_marks if port_marks is not None else block_faces.face(block, area, trend, flipped=flipped)
    )


def _outline(box: Box) -> Mark:
    width, height = (box.width, box.height) if box.upright else (box.height, box.width)
    content = block_faces.outline(box.block, 0.0, 0.0, width, height, box.flipped)
    for _ in range(box.rotation // 90):
        content, width, height = rotated_clockwise(content, height), height, width
    return moved(content, box.x, box.y)


def _block(box: Box, trend: Trend | None, comment: str = "") -> list[Mark]:
    marks = block_marks(box, trend, comment)
    side = box.shown_name_side
    if side == "hidden":
        return marks
    lx, ly, lw, _ = _label(box)
    name = shorten(box.name, NAME_SIZE, lw + 1)
    if side in ("above", "below"):
        marks.append(Text(lx + lw / 2, ly + NAME_SIZE + 1, name, NAME_SIZE, Tone.MUTED, "middle"))
    elif side == "left":
        marks.append(Text(lx + lw, ly + NAME_SIZE, name, NAME_SIZE, Tone.MUTED, "end"))
    else:
        marks.append(Text(lx, ly + NAME_SIZE, name, NAME_SIZE, Tone.MUTED))
    return marks


def _port_names(box: Box) -> tuple[list[Mark], FaceArea]:
    """Port names inside the edges of sides with several ports, and the remaining area."""
    if not box.upright:
        return _port_names_above_and_below(box)
    marks: list[Mark] = []
    label_width = {"left": 0.0, "right": 0.0}
    into, out = block_faces.port_labels(box.block)
    named = list(zip(box.frames, block_faces.frame_labels(box.block), box.block.frame_ports()))
    flipped = box.flipped != (box.rotation == 180)
    for ports, labels, side, own_side in (
        (box.inputs, into, "right" if flipped else "left", "left"),
        (box.outputs, out, "left" if flipped else "right", "right"),
    ):
        frames = [(port, label) for port, label, frame in named if frame.side == own_side]
        shown = [*zip(ports, labels), *frames]
        if not any(label for _, label in shown):
            continue
        label_width[side] = max(text_width(label, PORT_TEXT) for _, label in shown) + 5
        for port, label in shown:
            if not label:
                continue
            x = box.x + 5 if side == "left" else box.x + box.width - 5
            anchor = "start" if side == "left" else "end"
            marks.append(Text(x, port.y + 3.2, label, PORT_TEXT, Tone.MUTED, anchor))
    width = box.width - label_width["left"] - label_width["right"]
    return marks, FaceArea(box.x + label_width["left"], box.y, width, box.height)


def _port_names_above_and_below(box: Box) -> tuple[list[Mark], FaceArea]:
    marks: list[Mark] = []
    top, bottom = box.y, box.y + box.height
    frames = [(port, label) for port, label in zip(box.frames, block_faces.frame_labels(box.block)) if label]
    for ports, labels in zip((box.inputs, box.outputs), block_faces.port_labels(box.block)):
        labelled_ports = [(port, label) for port, label in zip(ports, labels) if label]
        edge = next((port.y for port in ports), None)
        labelled_ports += [(port, label) for port, label in frames if edge in (None, port.y)]
        frames = [entry for entry in frames if entry not in labelled_ports]
        above = any(port.y == box.y for port, _ in labelled_ports)
        for port, label in labelled_ports:
            y = box.y + PORT_TEXT + 3 if above else box.y + box.height - 5
            marks.append(Text(port.x, y, label, PORT_TEXT, Tone.MUTED, "middle"))
        if labelled_ports and above:
            top += PORT_TEXT_HEIGHT
        elif labelled_ports:
            bottom -= PORT_TEXT_HEIGHT
    return marks, FaceArea(box.x, top, box.width, bottom - top)


def _signs(box: Box) -> list[Mark]:
    """Plus and minus of a sum beside its ports, inside the circle."""
    signs = str(getattr(box.block, "signs", ""))
    marks: list[Mark] = []
    for sign, port in zip(signs, box.inputs):
        x, y = port.x + 8.0 * port.dx, port.y + 8.0 * port.dy
        marks.append(Polyline([(x - 3, y), (x + 3, y)], stroke=Tone.INK, width=1.3))
        if sign == "+":
            marks.append(Polyline([(x, y - 3), (x, y + 3)], stroke=Tone.INK, width=1.3))
    return marks


@dataclass(frozen=True, eq=False)
class _SignalContents:
    """The sheets of a diagram, and the known signals of their wires."""

    levels: Mapping[str, Diagram]
    views: Mapping[str, View]
    contents: Mapping[PortRef, PortRef | Bus]
    outputs: Mapping[str, Shapes]

    @classmethod
    def of(cls, diagram: Diagram) -> _SignalContents:
        try:
            form = flatten_hierarchy(diagram)
            outputs = infer_shapes(diagram).outputs
        except DiagramError:
            return cls(levels_of(diagram), {}, {}, {})
        views = {name: view for name, view in diagram_views(diagram) if view.kind in _TREND_KINDS}
        return cls(form.levels, views, form.contents, outputs)

    def kind(self, source: PortRef) -> WireKind:
        """The content of an output port of the hierarchy."""
        content = self.contents.get(source, source)
        if isinstance(content, Bus):
            return WireKind.BUS
        return WireKind(min(len(self.outputs.get(content.block, {}).get(content.port, ())), 2))


def _notes(diagram: Diagram) -> list[Mark]:
    return [
        Text(note.x, note.y + NOTE_SIZE + NOTE_LINE * row, line, NOTE_SIZE, Tone.INK)
        for note in diagram.notes.values()
        for row, line in enumerate(note.text.split("\n"))
        if line
    ]


def _extent(
    placed_boxes: dict[str, Box], routed: list[RoutedNet], diagram: Diagram
) -> tuple[float, float, float, float]:
    xs: list[float] = []
    ys: list[float] = []
    for note in diagram.notes.values():
        lines = note.text.split("\n")
        xs += [note.x, note.x + max(text_width(line, NOTE_SIZE) for line in lines)]
        ys += [note.y, note.y + NOTE_LINE * len(lines)]
    for box in placed_boxes.values():
        lx, ly, lw, lh = _label(box)
        xs += [box.x, box.x + box.width, lx, lx + lw]
        ys += [box.y, box.y + box.height, ly, ly + lh]
    for net in routed:
        for path in net.paths:
            xs += [x for x, _ in path]
            ys += [y for _, y in path]
    return min(xs, default=0.0), min(ys, default=0.0), max(xs, default=1.0), max(ys, default=1.0)


def _wire_title(source: PortRef, targets: list[PortRef]) -> str:
    return f"{source} to {', '.join(str(target) for target in targets)}"


def _block_title(name: str, box: Box, comment: str) -> str:
    kind = f"{box.block.title}, {COMMENT_WORDS[comment]}" if comment else box.block.title
    return f"{name} ({kind})"


def _text_alternative(diagram: Diagram) -> str:
    """The text alternative of the drawing: a list of all connections."""

    def connection_text(wire: Connection) -> str:
        return f"{wire.source} to {wire.target}"

    lines = [f"{line.first} and {line.second} are one frame" for line in diagram.frame_lines]
    connection_list = "; ".join([*(connection_text(wire) for wire in diagram.connections), *lines])
    return (
        f"{counted(len(diagram.blocks), 'block')}. Wires: {connection_list}."
        if connection_list
        else f"{counted(len(diagram.blocks), 'block')}."
    )
