"""Drawing of commented blocks: grey, with a percent sign or the wires that replace the block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armblocks.diagram.comments import passed_ports
from armblocks.drawing.block_boxes import NAME_SIZE, Box, BoxPort
from armblocks.pictures.picture import Curve, Disc, Group, Mark, Polyline, Raster, Rectangle, Text
from armblocks.pictures.style import Tone

COMMENT_WORDS = {"out": "commented out", "through": "commented through"}
"""The text for each comment."""
_BACKGROUNDS = (Tone.SURFACE, Tone.PAGE, Tone.SUNKEN)


def commented_marks(marks: Sequence[Mark], box: Box, comment: str) -> list[Mark]:
    """The drawing of a commented block.

    A percent sign marks a block that is commented out. A block that is commented through shows the wires that
    replace it.
    """
    grey = [grey_mark(mark) for mark in marks]
    if comment == "out":
        return [*grey, Text(box.x, box.y - 3, "%", NAME_SIZE, Tone.MUTED, bold=True)]
    inputs, outputs = ({port.name: port for port in ports} for ports in (box.inputs, box.outputs))
    return [*grey, *(_wire(inputs[into], outputs[out]) for into, out in passed_ports(box.block))]


def _wire(into: BoxPort, out: BoxPort) -> Mark:
    points = [(into.x, into.y), (out.x, out.y)]
    if not into.dy and not out.dy and into.y != out.y:
        middle = (into.x + out.x) / 2
        points[1:1] = [(middle, into.y), (middle, out.y)]
    return Polyline(points, stroke=Tone.WIRE, width=1.2)


def _fill_tone(tone: Tone | None) -> Tone | None:
    return None if tone is None else Tone.SUNKEN if tone in _BACKGROUNDS else Tone.HAIRLINE


def _stroke_tone(tone: Tone | None) -> Tone | None:
    return None if tone is None else Tone.HAIRLINE


def grey_mark(mark: Mark) -> Mark:
    """A mark in the greys of commented blocks."""
    match mark:
        case Text():
            return replace(mark, tone=Tone.MUTED)
        case Group():
            return replace(mark, marks=tuple(grey_mark(inner) for inner in mark.marks))
        case Polyline() | Curve() | Rectangle() | Disc():
            return replace(mark, stroke=_stroke_tone(mark.stroke), fill=_fill_tone(mark.fill))
        case Raster():
            return mark
