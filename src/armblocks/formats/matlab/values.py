"""Values of scripts: matrices, text, cell arrays, links, robots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from armblocks.formats.matlab.records import LinkRecord, RobotRecord
from armblocks.matlab.arrays import Array, kind_of
from armblocks.matlab.source import Location

MAX_LINKS = 1000
"""Maximum number of elements of a cell array or an array of links."""


@dataclass
class Cell:
    """``{a, b}``: a row of values; ``None`` for elements that are not set. Cells cannot contain cells."""

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


def copy_of_value(value: Value) -> Value:
    """The value that an assignment stores: a copy, except for the handle objects of releases 9 and later."""
    match value:
        case Cell():
            return Cell([None if element is None else copy_of_value(element) for element in value.elements])
        case LinkArray():
            return LinkArray([None if link is None else link.copy_on_assignment() for link in value.links])
        case LinkRecord() | RobotRecord():
            return value.copy_on_assignment()
        case str():
            return value
        case _:
            return value.copy()


def join_links(location: Location, values: Sequence[Value]) -> LinkArray:
    """``[L1 L2]`` of links and arrays of links."""
    links: list[LinkRecord | None] = []
    for value in values:
        match value:
            case LinkRecord():
                links.append(value)
            case LinkArray():
                links += value.links
            case _ if isinstance(value, np.ndarray) and value.size == 0:
                pass  # an empty array to which links are appended: L = []; L = [L L1]
            case _:
                raise location.error(
                    f"{kind_of(value)} is an element of an array of links", allowed="links only"
                )
    if len(links) > MAX_LINKS:
        raise location.error(f"{len(links)} links in one array", allowed=f"at most {MAX_LINKS}")
    return LinkArray(links)
