"""Drawing of the signs on blocks, as large as the face allows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from armblocks.diagram.signs import FaceSign, Fraction, Graph, Lines, Title, Words
from armblocks.pictures.picture import Mark, Polyline, Text
from armblocks.pictures.style import Tone
from armblocks.pictures.text_width import shorten, text_width

_FONT_SIZES = (13.0, 9.0)
"""Largest and smallest legible font size of a sign, px."""
_TITLE_SIZE = 10.0
_MIN_SIGN_WIDTH = 44.0
"""Minimum width of a sign between the port names, px."""
_MAX_SIGN_WIDTH = 132.0
"""Maximum width of a sign, px; longer signs are shortened."""


@dataclass(frozen=True)
class FaceArea:
    """The part of a face that is free of port names."""

    x: float
    y: float
    width: float
    height: float

    @property
    def middle(self) -> tuple[float, float]:
        """The centre of the area, px."""
        return self.x + self.width / 2, self.y + self.height / 2

    def shrunk(self, dx: float, dy: float) -> FaceArea:
        """The same area without a border."""
        return FaceArea(
            self.x + dx, self.y + dy, max(self.width - 2 * dx, 1.0), max(self.height - 2 * dy, 1.0)
        )


def min_face_size(sign: FaceSign) -> tuple[float, float]:
    """Width and height (px) that a complete sign needs."""
    match sign:
        case Words():
            return min(max(text_width(sign.text, 11.0) + 10, _MIN_SIGN_WIDTH), _MAX_SIGN_WIDTH), 24.0
        case Lines():
            return min(max(text_width(line, 9.5) for line in sign.texts) + 10, _MAX_SIGN_WIDTH), 40.0
        case Title():
            widest_part = max(text_width(line, _TITLE_SIZE) for line in _wrapped_lines(sign.text, 0.0))
            width = max(widest_part, text_width(sign.text, _TITLE_SIZE) / 3, _MIN_SIGN_WIDTH)
            rows = len(_wrapped_lines(sign.text, width))
            return min(width + 10, _MAX_SIGN_WIDTH), 13.0 * rows + 10
        case Fraction():
            widest = max(text_width(text, 10.0) for text in (sign.above, sign.below))
            return min(widest + (26 if sign.limited else 16), _MAX_SIGN_WIDTH), 44.0
        case Graph():
            return 42.0, 40.0


def sign_marks(sign: FaceSign, area: FaceArea) -> list[Mark]:
    """Draw a sign in the middle of an area."""
    match sign:
        case Words():
            size = _FONT_SIZES[0] if len(sign.text) > 2 else 16.0
            return words(area, sign.text, size=size, italic=sign.italic)
        case Lines():
            return _lines(area, sign.texts, size=9.5)
        case Title():
            return _lines(area, _wrapped_lines(sign.text, area.width - 6), size=_TITLE_SIZE)
        case Fraction():
            return _fraction(area, sign)
        case Graph():
            return _graph(area, sign.points)


def words(area: FaceArea, text: str, *, size: float = _FONT_SIZES[0], italic: bool = False) -> list[Mark]:
    """Draw one line of text. A long text gets a smaller font, then it is shortened."""
    x, y = area.middle
    font = size
    while font > _FONT_SIZES[1] and text_width(text, font) > area.width - 6:
        font -= 0.5
    fitted = shorten(text, font, area.width - 4)
    return [Text(x, y + 0.36 * font, fitted, font, Tone.INK, "middle", italic=italic)]


def _wrapped_lines(text: str, width: float) -> list[str]:
    """Lines of text, broken at spaces and hyphens to fit a width; a longer word is on a
    separate line."""
    parts = [part for word in text.split() for part in _hyphen_parts(word)]
    lines = [""]
    for part in parts:
        line = lines[-1] + ("" if lines[-1].endswith("-") else " ") + part if lines[-1] else part
        if lines[-1] and text_width(line, _TITLE_SIZE) > width:
            lines.append(part)
        else:
            lines[-1] = line
    return lines


def _hyphen_parts(word: str) -> list[str]:
    first, hyphen, rest = word.partition("-")
    # "Zero-Pole" may be broken, "S-R" and "n-D" must not be.
    return [first + hyphen, rest] if len(first) > 2 and len(rest) > 2 else [word]


def _lines(area: FaceArea, texts: Sequence[str], *, size: float) -> list[Mark]:
    x, y = area.middle
    top = y - (len(texts) - 1) * size * 0.65
    shortened = [shorten(text, size, area.width - 4) for text in texts]
    return [
        Text(x, top + k * size * 1.3 + 0.36 * size, text, size, Tone.INK, "middle")
        for k, text in enumerate(shortened)
    ]


def _fraction(area: FaceArea, sign: Fraction) -> list[Mark]:
    x, y = area.middle
    size, free = _FONT_SIZES[0], area.width - (20 if sign.limited else 10)
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


def _graph(area: FaceArea, points: Sequence[tuple[float, float]]) -> list[Mark]:
    width = min(area.width, 1.6 * area.height)  # a tall block does not stretch its curve
    height = min(area.height, area.width)
    middle = FaceArea(area.x + (area.width - width) / 2, area.y + (area.height - height) / 2, width, height)
    box = middle.shrunk(min(12.0, 0.18 * width), min(12.0, 0.22 * height))
    line = [(box.x + u * box.width, box.y + (1 - v) * box.height) for u, v in points]
    left, top, right, bottom = box.x - 3, box.y - 3, box.x + box.width + 3, box.y + box.height + 3
    axes = [(left, top), (left, bottom), (right, bottom)]
    return [
        Polyline(axes, stroke=Tone.HAIRLINE, width=1.0, sharp=True),
        Polyline(line, stroke=Tone.TRACE_0, width=1.8),
    ]
