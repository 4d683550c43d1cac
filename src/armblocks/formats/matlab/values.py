"""Values of scripts: matrices, text, cell arrays, links, robots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from armblocks.formats.matlab.records import LinkRecord, RobotRecord
from armblocks.matlab.arrays import Array, kind_of
from armblocks.matlab.source import Place

MOST_LINKS = 1000
"""Elements of one cell array or array of links."""


@dataclass
class Cell:
    """``{a, b}``: a row of values, of which some may not be set (``None``). Cells do not nest."""

    elements: list[Value | None] = field(default_factory=lambda: list[Value | None]())

    @property
    def kind(self) -> str:
        """The name of this kind of value in messages."""
        return "a cell array"


@dataclass
class LinkArray:
    """``[L1 L2]``: a row of links; an element may not be set yet."""

    links: list[LinkRecord | None] = field(default_factory=lambda: list[LinkRecord | None]())

    @property
    def kind(self) -> str:
        """The name of this kind of value in messages."""
        return "an array of links"


Value = Array | str | Cell | LinkRecord | LinkArray | RobotRecord


def copied(value: Value) -> Value:
    """What an assignment keeps: releases up to 8 copy links and robots, later ones share them."""
    match value:
        case Cell():
            return Cell([None if element is None else copied(element) for element in value.elements])
        case LinkArray():
            return LinkArray([None if link is None else link.assigned() for link in value.links])
        case LinkRecord() | RobotRecord():
            return value.assigned()
        case str():
            return value
        case _:
            return value.copy()


def join_links(place: Place, values: Sequence[Value]) -> LinkArray:
    """``[L1 L2]`` of links and arrays of links."""
    links: list[LinkRecord | None] = []
    for value in values:
        match value:
            case LinkRecord():
                links.append(value)
            case LinkArray():
                links += value.links
            case _ if isinstance(value, np.ndarray) and value.size == 0:
                pass  # [[] L1] is how loops without loops start
            case _:
                raise place.error(f"{kind_of(value)} stands among links", allowed="links only")
    if len(links) > MOST_LINKS:
        raise place.error(f"{len(links)} links in one array", allowed=f"at most {MOST_LINKS}")
    return LinkArray(links)
