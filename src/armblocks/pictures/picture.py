"""A picture as a list of marks: built once, then written as SVG (:mod:`.svg`) or as PNG (:mod:`.png`).

Coordinates are px, x to the right, y down; marks are in painting order. Colours are tones, so that one
picture is valid for the light and the dark theme.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from armblocks.pictures.style import TEXT_SIZE, Tone

Points: TypeAlias = NDArray[np.float64] | Sequence[tuple[float, float]]
Anchor: TypeAlias = Literal["start", "middle", "end"]


@dataclass(frozen=True, eq=False)
class Polyline:
    """Straight lines through points (N, 2); a NaN point interrupts the line. ``fill`` fills the inside."""

    points: Points
    stroke: Tone | None = Tone.INK
    width: float = 1.0
    dash: tuple[float, ...] = ()
    fill: Tone | None = None
    closed: bool = False
    opacity: float = 1.0
    sharp: bool = False
    """True: mitred corners and butt ends (frames, ticks); False: round corners and ends (data)."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A path of absolute commands as in SVG: ``("M", x, y)``, ``("Q", x1, y1, x, y)`` and L, C, Z."""

    commands: tuple[tuple[str | float, ...], ...]
    stroke: Tone | None = Tone.INK
    width: float = 1.0
    dash: tuple[float, ...] = ()
    fill: Tone | None = None
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Rectangle:
    """A rectangle with its top left corner at (x, y), corners rounded by ``radius``."""

    x: float
    y: float
    width: float
    height: float
    radius: float = 0.0
    fill: Tone | None = None
    stroke: Tone | None = None
    stroke_width: float = 1.0
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Disc:
    """A circle about (x, y)."""

    x: float
    y: float
    radius: float
    fill: Tone | None = Tone.INK
    stroke: Tone | None = None
    stroke_width: float = 1.0
    opacity: float = 1.0


@dataclass(frozen=True, eq=False)
class Text:
    """One line of text with its ``anchor`` on the baseline at (x, y).

    ``rotation`` is in degrees, anticlockwise; ``mono`` selects a monospaced font.
    """

    x: float
    y: float
    text: str
    size: float = TEXT_SIZE
    tone: Tone = Tone.INK
    anchor: Anchor = "start"
    bold: bool = False
    italic: bool = False
    mono: bool = False
    rotation: Literal[0, 90] = 0


@dataclass(frozen=True, eq=False)
class Raster:
    """Pixels (rows, columns, 4) uint8, straight alpha, stretched over a rectangle."""

    x: float
    y: float
    width: float
    height: float
    pixels: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Group:
    """Marks that belong together; ``title`` is a tooltip, if the viewer supports it."""

    marks: tuple[Mark, ...]
    title: str = ""


Mark: TypeAlias = Polyline | Curve | Rectangle | Disc | Text | Raster | Group


@dataclass(eq=False, kw_only=True)
class Picture:
    """A drawing under construction: size in px, text alternative, and marks."""

    width: float
    height: float
    title: str
    description: str = ""
    marks: list[Mark] = field(default_factory=list[Mark])

    def add(self, *marks: Mark) -> None:
        """Add marks on top of the existing marks."""
        self.marks.extend(marks)

    def extend(self, marks: Iterable[Mark]) -> None:
        """Add many marks on top of the existing marks."""
        self.marks.extend(marks)

    def place(self, other: Picture, x: float, y: float) -> None:
        """Add another picture with its top left corner at (x, y)."""
        self.marks.extend(moved(mark, x, y) for mark in other.marks)


def moved(mark: Mark, dx: float, dy: float) -> Mark:
    """The same mark, shifted by (dx, dy) px."""
    match mark:
        case Polyline():
            return replace(mark, points=np.asarray(mark.points, dtype=np.float64) + np.array([dx, dy]))
        case Curve():
            shifted = tuple(
                (c[0], *(float(v) + (dx if i % 2 == 0 else dy) for i, v in enumerate(c[1:])))
                for c in mark.commands
            )
            return replace(mark, commands=shifted)
        case Group():
            return replace(mark, marks=tuple(moved(inner, dx, dy) for inner in mark.marks))
        case _:
            return replace(mark, x=mark.x + dx, y=mark.y + dy)


def rotated_clockwise(mark: Mark, height: float) -> Mark:
    """The mark rotated clockwise by 90 degrees with a sheet of this height; texts move but stay upright."""
    match mark:
        case Polyline():
            points = np.asarray(mark.points, dtype=np.float64)
            return replace(mark, points=np.stack([height - points[:, 1], points[:, 0]], axis=1))
        case Curve():
            commands = tuple(
                (c[0], *(v for x, y in zip(c[1::2], c[2::2]) for v in (height - float(y), float(x))))
                for c in mark.commands
            )
            return replace(mark, commands=commands)
        case Group():
            return replace(mark, marks=tuple(rotated_clockwise(inner, height) for inner in mark.marks))
        case Rectangle() | Raster():
            return replace(
                mark, x=height - mark.y - mark.height, y=mark.x, width=mark.height, height=mark.width
            )
        case Disc() | Text():
            return replace(mark, x=height - mark.y, y=mark.x)


def text_marks(picture: Picture) -> list[Text]:
    """All texts of a picture, in painting order, for checks of overlaps."""

    def walk(marks: Iterable[Mark]) -> Iterable[Text]:
        for mark in marks:
            if isinstance(mark, Text):
                yield mark
            elif isinstance(mark, Group):
                yield from walk(mark.marks)

    return list(walk(picture.marks))
