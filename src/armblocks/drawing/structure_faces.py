"""Faces of structural blocks: In and Out, tags, buses, switches, subsystems."""

from __future__ import annotations

from collections.abc import Sequence

from armblocks import blocks as kinds
from armblocks.diagram import Block, Diagram
from armblocks.drawing.face_marks import FaceArea, words
from armblocks.pictures.picture import Disc, Mark, Polyline, Rectangle, Text
from armblocks.pictures.style import Tone
from armblocks.pictures.text_width import text_width

CONTROLS = ("enable", "trigger", "reset", "action")
"""Control inputs of a subsystem, which are on its upper edge with their symbols below."""
CONTROL_HEIGHT = 18.0
"""Height of the area below the upper edge of a conditional subsystem for the symbol of its control, px."""
BAR = 6.0
"""Thickness of the bar of a bus block, px."""
_CONDITIONAL = (
    kinds.EnabledSubsystem,
    kinds.TriggeredSubsystem,
    kinds.EnabledTriggeredSubsystem,
    kinds.ResettableSubsystem,
    kinds.ActionSubsystem,
)
_SYMBOL_HEIGHT = 15.0
"""Height of the symbols of control inputs, px."""
_MASK_SIZE = 10.5
"""Font size of the text of a mask, px."""
_MASK_LINE_WIDTH = 84.0
"""Width at which a line of the text of a mask is broken, px."""
_MAX_MASK_WIDTH = 140.0
"""Maximum width of the text of a mask, px."""
Stroke = list[tuple[float, float]]
_RISING: Stroke = [(0, 1), (0.5, 1), (0.5, 0), (1, 0)]
_FALLING: Stroke = [(0, 0), (0.5, 0), (0.5, 1), (1, 1)]


def is_subsystem(block: Block) -> bool:
    """Whether a block contains a diagram."""
    return isinstance(block, (kinds.Subsystem, *_CONDITIONAL))


def control_ports(block: Block) -> tuple[str, ...]:
    """The inputs on the upper edge."""
    if not isinstance(block, _CONDITIONAL):
        return ()
    return tuple(port.name for port in block.input_ports() if port.name in CONTROLS)


def tag_text(block: kinds.Goto | kinds.From) -> str:
    """The tag, in brackets by its visibility: [local], {scoped}, global; without brackets for a From."""
    scope = block.visibility if isinstance(block, kinds.Goto) else "local"
    return {"local": f"[{block.tag}]", "scoped": f"{{{block.tag}}}", "global": block.tag}[scope]


def tag_outline(block: Block, x: float, y: float, width: float, height: float, flipped: bool) -> Mark:
    """The outline of a tag: a Goto has an arrow tip, a From the matching notch."""
    tip = 9.0
    if isinstance(block, kinds.Goto):
        corners = [(0.0, 0.0), (width - tip, 0.0), (width, height / 2), (width - tip, height), (0.0, height)]
    else:
        corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height), (tip, height / 2)]
    placed = [(x + (width - u if flipped else u), y + v) for u, v in corners]
    return Polyline(placed, stroke=Tone.WIRE, width=1.2, fill=Tone.SURFACE, closed=True)


def bus_bar(block: Block, x: float, y: float, width: float, height: float, flipped: bool) -> Mark:
    """Draw the bar on the side of the bus."""
    at_inputs = isinstance(block, kinds.BusSelector)
    left = x if at_inputs != flipped else x + width - BAR
    return Rectangle(left, y, BAR, height, radius=1.5, fill=Tone.WIRE)


def subsystem_marks(block: Block, area: FaceArea, tops: tuple[tuple[str, float], ...]) -> list[Mark]:
    """Draw a small diagram or the text of the mask, and the symbols of control inputs below their ports.

    ``tops``: names and positions x (px) of the control inputs.
    """
    down = CONTROL_HEIGHT if tops else 0.0
    below = FaceArea(area.x, area.y + down, area.width, area.height - down)
    inner: object = block.parameter_value("diagram")
    marks = _lines(below, mask_text(inner)) if isinstance(inner, Diagram) and inner.mask else _sheet(below)
    for name, x in tops:
        marks += _control(block, name, x, area.y + 5.0)
    return marks


def mask_width(block: Block) -> float:
    """Width of a subsystem's drawing between its port names, px."""
    inner: object = block.parameter_value("diagram")
    if not (isinstance(inner, Diagram) and inner.mask):
        return 44.0
    widest = max(text_width(line, _MASK_SIZE) for line in mask_text(inner))
    return min(max(widest + 12, 44.0), _MAX_MASK_WIDTH)


def mask_text(diagram: Diagram) -> tuple[str, ...]:
    """The lines on the face of a masked subsystem: its name, broken between words if it is long."""
    lines = [""]
    for word in diagram.name.replace("_", " ").split():
        line = f"{lines[-1]} {word}".strip()
        if lines[-1] and text_width(line, _MASK_SIZE) > _MASK_LINE_WIDTH:
            lines.append(word)
        else:
            lines[-1] = line
    return tuple(lines)


def _lines(area: FaceArea, texts: Sequence[str]) -> list[Mark]:
    """Draw lines of text in the middle of an area, each with a font size that fits."""
    height = _MASK_SIZE * 1.3
    top = area.middle[1] - height * len(texts) / 2
    rows = [FaceArea(area.x, top + k * height, area.width, height) for k in range(len(texts))]
    return [mark for row, text in zip(rows, texts) for mark in words(row, text, size=_MASK_SIZE)]


def _sheet(area: FaceArea) -> list[Mark]:
    """A small diagram of the content of a block."""
    x, y = area.middle
    boxes = [(x - 17, y - 9), (x + 5, y + 1)]
    wire = [(x - 5, y - 4.5), (x, y - 4.5), (x, y + 5.5), (x + 5, y + 5.5)]
    return [
        Polyline(wire, stroke=Tone.MUTED, width=1.1),
        *(Rectangle(left, top, 12, 9, 2, Tone.SUNKEN, Tone.MUTED, 1.1) for left, top in boxes),
    ]


def _control(block: Block, name: str, x: float, y: float) -> list[Mark]:
    if name == "action":
        return [Text(x, y + 10, "action", 9.0, Tone.INK, "middle")]
    if name == "enable":
        pulse: Stroke = [(0, 1), (0.3, 1), (0.3, 0), (0.7, 0), (0.7, 1), (1, 1)]
        return [_stroke(pulse, x, y)]
    edge = str(getattr(block, "edge", "rising"))
    strokes = {"rising": [_RISING], "falling": [_FALLING], "either": [_RISING, _FALLING]}[edge]
    marks: list[Mark] = []
    for k, stroke in enumerate(strokes):
        at = x + (k - (len(strokes) - 1) / 2) * 17
        marks += [_stroke(stroke, at, y), _edge_arrow(at, y, up=stroke is _RISING)]
    if name == "reset":
        marks.append(Text(x + 11 + 8 * (len(strokes) - 1), y + 11, "R", 9.0, Tone.INK))
    return marks


def _stroke(points: Stroke, x: float, y: float) -> Mark:
    width = 18.0 if len(points) > 4 else 14.0
    line = [(x + (u - 0.5) * width, y + v * (_SYMBOL_HEIGHT - 4)) for u, v in points]
    return Polyline(line, stroke=Tone.TRACE_0, width=1.6)


def _edge_arrow(x: float, y: float, *, up: bool) -> Mark:
    middle, direction = y + (_SYMBOL_HEIGHT - 4) / 2, -1.0 if up else 1.0
    corners = [
        (x - 3, middle - 1.6 * direction),
        (x, middle + 2.4 * direction),
        (x + 3, middle - 1.6 * direction),
    ]
    return Polyline(corners, stroke=None, fill=Tone.TRACE_0, closed=True)


def lever_marks(block: Block, area: FaceArea, heights: tuple[float, ...], flipped: bool) -> list[Mark]:
    """Draw the contacts of a switch at the heights of the inputs, the output contact, and a lever between
    two."""
    inner, outer = area.x + 0.2 * area.width, area.x + 0.8 * area.width
    begin, end = (outer, inner) if flipped else (inner, outer)
    middle = area.middle[1]
    connected_height = heights[0]
    if isinstance(block, kinds.ManualSwitch):
        connected_height = heights[0] if block.position < 1.5 else heights[-1]
    marks: list[Mark] = [
        Polyline([(begin, connected_height), (end, middle)], stroke=Tone.INK, width=1.6),
        *(Disc(begin, y, 2.4, Tone.SURFACE, Tone.INK, 1.2) for y in heights),
        Disc(end, middle, 2.4, Tone.SURFACE, Tone.INK, 1.2),
    ]
    return marks


def stop_marks(area: FaceArea) -> list[Mark]:
    """Draw a stop sign."""
    x, y = area.middle
    r = 17.0
    half_side = 0.41421356 * r
    corners = [
        (x - half_side, y - r), (x + half_side, y - r), (x + r, y - half_side), (x + r, y + half_side),
        (x + half_side, y + r), (x - half_side, y + r), (x - r, y + half_side), (x - r, y - half_side),
    ]  # fmt: skip
    sign = Polyline(corners, stroke=Tone.ERROR, width=1.6, fill=Tone.ERROR_WASH, closed=True)
    return [sign, Text(x, y + 3.4, "STOP", 9.5, Tone.ERROR, "middle", bold=True)]


def port_number(block: kinds.Inport | kinds.Outport, area: FaceArea) -> list[Mark]:
    """Draw the number of the port."""
    return words(area, str(block.port or 1), size=11.0)


def tag_width(block: kinds.Goto | kinds.From) -> float:
    """Width of a tag, px."""
    return min(max(52.0, text_width(tag_text(block), 11.0) + 28), 150.0)


def oval(x: float, y: float, width: float, height: float) -> Mark:
    """The outline of In and Out blocks: a rectangle with round ends."""
    return Rectangle(x, y, width, height, height / 2, Tone.SURFACE, Tone.WIRE, 1.2)


def bus_outline(
    block: Block, x: float, y: float, width: float, height: float, flipped: bool
) -> tuple[Mark, ...]:
    """The outline of a bus block; one edge is the bar."""
    card = Rectangle(x, y, width, height, 2, Tone.SURFACE, Tone.HAIRLINE, 1.0)
    return card, bus_bar(block, x, y, width, height, flipped)


def branch_labels(block: kinds.If | kinds.SwitchCase) -> tuple[str, ...]:
    """The texts beside the outputs of an If block: the conditions."""
    if isinstance(block, kinds.If):
        texts = [text.strip() for text in block.expressions.split(";")]
        return (*(f"{'else' * (k > 0)}if {text}" for k, text in enumerate(texts)), "else")
    return (*(f"case {text.strip()}" for text in block.cases.split(";")), "default")
