"""Drawing of signs, as large as the face allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armblocks.diagram.signs import FaceSign, Fraction, Graph, Lines, Title, Words
from armblocks.pictures.picture import Mark, Polyline, Text
from armblocks.pictures.style import Tone
from armblocks.pictures.text_width import shorten, text_width

_WORDS = (13.0, 9.0)
"""Largest and smallest legible font size of a sign, px."""
_TITLE = 10.0
_MIN_SIGN_WIDTH = 44.0
"""Minimum width of a sign between the port names, px."""
_MAX_SIGN_WIDTH = 132.0
"""Maximum width of a sign, px; longer signs are shortened."""


@dataclass(frozen=True)
class Room:
    """The part of a face that is free of port names."""

    x: float
    y: float
    width: float
    height: float

    @property
    def middle(self) -> tuple[float, float]:
        """Centre."""
        return self.x + self.width / 2, self.y + self.height / 2

    def shrunk(self, dx: float, dy: float) -> Room:
        """The same area without a border."""
        return Room(self.x + dx, self.y + dy, max(self.width - 2 * dx, 1.0), max(self.height - 2 * dy, 1.0))


def least_room(sign: FaceSign) -> tuple[float, float]:
    """Width and height (px) that a complete sign needs."""
    match sign:
        case Words():
            return min(max(text_width(sign.text, 11.0) + 10, _MIN_SIGN_WIDTH), _MAX_SIGN_WIDTH), 24.0
        case Lines():
            return min(max(text_width(line, 9.5) for line in sign.texts) + 10, _MAX_SIGN_WIDTH), 40.0
        case Title():
            widest_part = max(text_width(line, _TITLE) for line in _broken(sign.text, 0.0))
            width = max(widest_part, text_width(sign.text, _TITLE) / 3, _MIN_SIGN_WIDTH)
            rows = len(_broken(sign.text, width))
            return min(width + 10, _MAX_SIGN_WIDTH), 13.0 * rows + 10
        case Fraction():
            widest = max(text_width(text, 10.0) for text in (sign.above, sign.below))
            return min(widest + (26 if sign.limited else 16), _MAX_SIGN_WIDTH), 44.0
        case Graph():
            return 42.0, 40.0


def sign_marks(sign: FaceSign, room: Room) -> list[Mark]:
    """Draw a sign in the middle of an area."""
    match sign:
        case Words():
            size = _WORDS[0] if len(sign.text) > 2 else 16.0
            return words(room, sign.text, size=size, italic=sign.italic)
        case Lines():
            return _lines(room, sign.texts, size=9.5)
        case Title():
            return _lines(room, _broken(sign.text, room.width - 6), size=_TITLE)
        case Fraction():
            return _fraction(room, sign)
        case Graph():
            return _graph(room, sign.points)


def words(room: Room, text: str, *, size: float = _WORDS[0], italic: bool = False) -> list[Mark]:
    """Draw one line of text. A long text gets a smaller font, then it is shortened."""
    x, y = room.middle
    font = size
    while font > _WORDS[1] and text_width(text, font) > room.width - 6:
        font -= 0.5
    fitted = shorten(text, font, room.width - 4)
    return [Text(x, y + 0.36 * font, fitted, font, Tone.INK, "middle", italic=italic)]


def _broken(text: str, width: float) -> list[str]:
    """Lines of text, broken at spaces and hyphens to fit a width; a word that is too long has its own
    line."""
    parts = [part for word in text.split() for part in _at_hyphens(word)]
    lines = [""]
    for part in parts:
        together = lines[-1] + ("" if lines[-1].endswith("-") else " ") + part if lines[-1] else part
        if lines[-1] and text_width(together, _TITLE) > width:
            lines.append(part)
        else:
            lines[-1] = together
    return lines


def _at_hyphens(word: str) -> list[str]:
    first, hyphen, rest = word.partition("-")
    # "Zero-Pole" may be broken, "S-R" and "n-D" must not be.
    return [first + hyphen, rest] if len(first) > 2 and len(rest) > 2 else [word]


def _lines(room: Room, texts: Sequence[str], *, size: float) -> list[Mark]:
    x, y = room.middle
    top = y - (len(texts) - 1) * size * 0.65
    shown = [shorten(text, size, room.width - 4) for text in texts]
    return [
        Text(x, top + k * size * 1.3 + 0.36 * size, text, size, Tone.INK, "middle")
        for k, text in enumerate(shown)
    ]


def _fraction(room: Room, sign: Fraction) -> list[Mark]:
    x, y = room.middle
    size, free = _WORDS[0], room.width - (20 if sign.limited else 10)
    while size > 8 and max(text_width(text, size) for text in (sign.above, sign.below)) > free:
        size -= 0.5
    above, below = (shorten(text, size, free + 2) for text in (sign.above, sign.below))
    half = max(text_width(above, size), text_width(below, size), 18.0 if sign.limited else 0.0) / 2 + 3
    marks: list[Mark] = [
        Text(x, y - 5, above, size, Tone.INK, "middle"),
        Polyline([(x - half, y), (x + half, y)], stroke=Tone.INK, width=1.1, sharp=True),
        Text(x, y + size, below, size, Tone.INK, "middle"),
    ]
    if sign.limited:
        left, right, top, low = x - half - 1, x + half + 1, y - 14, y + 14
        marks += [
            Polyline([(left - 7, low), (left, low), (left, low - 5)], stroke=Tone.TRACE_0, width=1.6),
            Polyline([(right, top + 5), (right, top), (right + 7, top)], stroke=Tone.TRACE_0, width=1.6),
        ]
    return marks


def _graph(room: Room, points: Sequence[tuple[float, float]]) -> list[Mark]:
    wide = min(room.width, 1.6 * room.height)  # a tall block does not stretch its curve
    high = min(room.height, room.width)
    middle = Room(room.x + (room.width - wide) / 2, room.y + (room.height - high) / 2, wide, high)
    box = middle.shrunk(min(12.0, 0.18 * wide), min(12.0, 0.22 * high))
    line = [(box.x + u * box.width, box.y + (1 - v) * box.height) for u, v in points]
    left, top, right, bottom = box.x - 3, box.y - 3, box.x + box.width + 3, box.y + box.height + 3
    axes = [(left, top), (left, bottom), (right, bottom)]
    return [
        Polyline(axes, stroke=Tone.HAIRLINE, width=1.0, sharp=True),
        Polyline(line, stroke=Tone.TRACE_0, width=1.8),
    ]
