"""Positions of the names of signals, at horizontal segments of their lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Literal

from armblocks.drawing.wire_search import Point
from armblocks.drawing.wires import Obstacle
from armblocks.pictures.picture import Mark, Text
from armblocks.pictures.style import Tone
from armblocks.pictures.text_width import text_width

NAME_SIZE = 10.0
"""Font size of the names of signals, px."""
_GAP = 4.0
"""Distance between a line and the name, px."""

NamePosition = tuple[float, float, Literal["start", "middle"]]
"""Position on the baseline of the text, px, and its anchor."""


def name_position(
    name: str, paths: Iterable[Sequence[Point]], obstacles: Iterable[Obstacle]
) -> NamePosition | None:
    """The position of a signal's name: at the longest horizontal segment where it covers no block or name.

    It is beside the longest segment if no segment is horizontal. ``None`` without a name, and for a signal
    without a line, whose name is in the labels at its ends.
    """
    segments = [pair for path in paths for pair in pairwise(path)]
    if not segments or not name:
        return None
    segments.sort(key=lambda pair: -_length(*pair))
    flat = [pair for pair in segments if pair[0][1] == pair[1][1]]
    if not flat:
        (ax, ay), (_, by) = segments[0]
        return ax + _GAP, (ay + by) / 2 + 0.36 * NAME_SIZE, "start"
    areas = [area for obstacle in obstacles for area in obstacle.areas]
    half = text_width(name, NAME_SIZE) / 2
    candidates = [
        ((a[0] + b[0]) / 2, y) for a, b in flat for y in (a[1] - _GAP, a[1] + _GAP + 0.8 * NAME_SIZE)
    ]
    free = (
        (x, y)
        for x, y in candidates
        if not any(
            x - half < right and left < x + half and y - NAME_SIZE < low and top < y + 2
            for left, top, right, low in areas
        )
    )
    x, y = next(free, candidates[0])
    return x, y, "middle"


def _length(one: Point, other: Point) -> float:
    return abs(one[0] - other[0]) + abs(one[1] - other[1])


def name_marks(name: str, paths: Iterable[Sequence[Point]], obstacles: Iterable[Obstacle]) -> list[Mark]:
    """The mark with the name of a signal; empty without a name or a line."""
    position = name_position(name, paths, obstacles)
    if position is None:
        return []
    x, y, anchor = position
    return [Text(x, y, name, NAME_SIZE, Tone.INK, anchor, italic=True)]
