"""Backgrounds of blocks in the colours that users choose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from armblocks.diagram import BLOCK_COLOURS
from armblocks.pictures.picture import Curve, Disc, Group, Mark, Polyline, Rectangle
from armblocks.pictures.style import Tone

_TINTS = {colour: Tone(f"tint-{colour}") for colour in BLOCK_COLOURS if colour != "none"}


def coloured_marks(marks: Sequence[Mark], colour: str) -> list[Mark]:
    """The drawing of a block whose background has one of ``BLOCK_COLOURS``."""
    tint = _TINTS.get(colour)
    return list(marks) if tint is None else [_tinted(mark, tint) for mark in marks]


def _tinted(mark: Mark, tint: Tone) -> Mark:
    match mark:
        case Group():
            return replace(mark, marks=tuple(_tinted(inner, tint) for inner in mark.marks))
        case Polyline() | Curve() | Rectangle() | Disc() if mark.fill is Tone.SURFACE:
            return replace(mark, fill=tint)
        case _:
            return mark
