"""Bookmarks: named parts of a sheet that the studio can show again. They do not affect the model."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from armblocks.diagram.names import check_new_name
from armblocks.errors import DiagramError

MAX_BOOKMARKS = 200
"""Largest number of bookmarks of a sheet."""
MAX_COORDINATE = 1e7
"""Largest magnitude of a coordinate, px."""
MAX_SIZE = 1e6
"""Largest width and height, px."""


@dataclass(frozen=True, kw_only=True)
class Bookmark:
    """A part of the sheet: top left corner and size in pixels, y downwards.

    Raises ``DiagramError`` for numbers that are not finite, sizes that are not positive, and numbers beyond
    ``MAX_COORDINATE`` and ``MAX_SIZE``.
    """

    x: float
    y: float
    width: float
    height: float

    def __post_init__(self) -> None:
        corner, size = (self.x, self.y), (self.width, self.height)
        # A comparison with NaN is false.
        if all(abs(value) <= MAX_COORDINATE for value in corner) and all(
            1 <= value <= MAX_SIZE for value in size
        ):
            return
        raise DiagramError(
            f"the part of the sheet is {self.width:g} x {self.height:g} px at ({self.x:g}, {self.y:g})",
            where="bookmark",
            allowed=f"coordinates up to {MAX_COORDINATE:g} px, sizes from 1 to {MAX_SIZE:g} px",
            fix="bookmark the view again",
        )


def check_bookmark_name(name: str, others: Iterable[str], where: str) -> None:
    """Raise ``DiagramError`` for a name that is empty, too long, not printable, or used on the sheet."""
    check_new_name(name, others, where, noun="bookmark", max_count=MAX_BOOKMARKS)
